"""One size of `benchmarks.storey`, in a process of its own; prints one line of JSON."""

import json
import sys
import time
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

from archmodel.database.session import open_database
from benchmarks.memory import peak_bytes
from benchmarks.report import Row
from mechanics.simulate import simulate
from pipelines.ingest.ingest import ingest
from pipelines.ingest.reading_options import reading_options
from pipelines.propose.propose import Recording, propose_core
from pipelines.record.record import record
from pipelines.run.assemble import assemble
from pipelines.samples.write import write_sample
from pipelines.scene.file import read_scene

__all__ = ["main"]

_SMALL = 5  # courses of a storey that compiles or loads the kernels


def main() -> None:
    """Take the storey of as many courses as the command line says to equilibrium."""
    courses = int(sys.argv[1])
    _run(_SMALL)
    print(json.dumps(_run(courses)))


def _run(courses: int) -> Row:
    with TemporaryDirectory() as name:
        return _from_survey(courses, Path(name))


def _from_survey(courses: int, folder: Path) -> Row:
    """Return the numbers of one storey, processor times of each part [s]."""
    written = write_sample("tower", folder, courses=courses)
    url = f"sqlite:///{folder / 'storey.db'}"
    clock = [time.process_time()]
    ingest([folder / "tower.moma"], url)
    if (solids := folder / "solids.obj").exists():
        ingest([solids], url, "solids", options=reading_options(folder / "head.moma", None, None, None))
    record([folder / "knowledge.toml"], url)
    clock.append(time.process_time())
    propose_core(url, recording=Recording())
    clock.append(time.process_time())
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        built = assemble(read_scene(folder / "tower.toml"), session)
    clock.append(time.process_time())
    result = simulate(built.scene)
    clock.append(time.process_time())
    ingested, core, closing, simulation = (after - before for before, after in pairwise(clock))
    return {
        "courses": courses,
        "stones": written.stones,
        "bodies": len(built.scene.blocks),
        "contacts": len(result.contacts.force),
        "ingest": ingested,
        "core": core,
        "closing": closing,
        "simulation": simulation,
        "total": clock[-1] - clock[0],
        "memory_gb": (peak_bytes() or 0) / 1e9,
        "open": len(built.closing.gaps),
        "steps": result.steps,
        "outcome": str(result.outcome),
        "reaction": abs(result.reaction / result.weight - 1.0),
    }


if __name__ == "__main__":
    main()
