"""Storeys of a tower from the survey to equilibrium: `python -m benchmarks.storey [--courses N …] [--json]`.

Each storey, with its core, is a process of its own on one core. See benchmarks/README.md for what the columns mean.
"""

import math
import time
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

from archmodel.database.session import open_database
from benchmarks.report import Row, alone, columns, guarded, options_of, peak_bytes, progress, show
from mechanics.simulate import simulate
from pipelines.ingest.ingest import ingest
from pipelines.ingest.reading_options import reading_options
from pipelines.propose.propose import Recording, propose_core
from pipelines.record.record import record
from pipelines.run.assemble import assemble
from pipelines.scene.file import read_scene
from synthetic.write import write_sample

_SMALL = 5  # courses of a storey that compiles or loads the kernels
_TABLE = columns(
    "courses courses :d | stones stones :d | bodies with core :d | contacts contacts :d | "
    "ingest ingest s :.3g | core core s :.3g | closing reading, closing s :.3g | "
    "simulation simulation s :.3g | total in all s :.3g | "
    "power_simulation simulation ~ bodies to the :.2f | power_total in all ~ bodies to the :.2f | "
    "memory_gb memory GB :.2f | open joints left open :d | steps steps :d | outcome outcome | "
    "reaction reaction error :.1e"
)


def main() -> None:
    """Run every storey, print."""
    parser = options_of("storey", __doc__)
    parser.add_argument("--courses", type=int, nargs="+", default=[5, 10, 20, 40], help="(5 10 20 40)")
    options = parser.parse_args()
    rows: list[Row] = []
    for courses in options.courses:
        progress(f"{courses} courses")
        rows.append(alone(measured, courses))
    for row in rows:
        for key in ("simulation", "total"):
            row[f"power_{key}"] = _power(rows[0], row, key)
    show(rows, _TABLE, as_json=options.json)


def _power(first: Row, row: Row, key: str) -> float | None:
    """Return the exponent with which a time has grown with the bodies since the first storey."""
    if row["bodies"] == first["bodies"]:
        return None
    return math.log(row[key] / first[key]) / math.log(row["bodies"] / first["bodies"])


def measured(courses: int) -> Row:
    """Return the numbers of one storey, after a small one."""
    found: Row = {}
    for count in (_SMALL, courses):
        with TemporaryDirectory() as name:
            found = _from_survey(count, Path(name))
    return found


def _from_survey(courses: int, folder: Path) -> Row:
    """Return the numbers of one storey, processor times of each part [s]."""
    written = write_sample("tower", folder, courses=courses)
    url = f"sqlite:///{folder / 'tower.db'}"
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
        "memory_gb": peak_bytes() / 1e9,
        "open": len(built.closing.gaps),
        "steps": result.steps,
        "outcome": str(result.outcome),
        "reaction": abs(result.reaction / result.weight - 1.0),
    }


if __name__ == "__main__":
    guarded(main)
