"""A large survey, from its file to a document: `python -m benchmarks.ingest [--stones N] [--only STAGE …] [--json]`.

One wall of N stones, ten points and four corners each, some with blunders and worn corners, in the native format and
as tables: read, fitted, extruded, taken into a database, and this carried out and in as one document. Walls of N/100
and N/10 stones with an arch, whose joints are open: simplified, and their joints closed. Each row is a process of its
own on one core. See benchmarks/README.md for what the columns mean.
"""

import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.report import (
    Row,
    alone,
    arrays_bytes,
    columns,
    guarded,
    options_of,
    peak_bytes,
    progress,
    show,
)
from ground.errors import SurveyError
from mechanics.arrays import Array
from pipelines.ingest.exchange import export_database, import_database
from pipelines.ingest.ingest import ingest
from survey.extrusion.extrusion import SurveyedBlock
from survey.formats.reading import open_survey
from survey.joints.close import close_joints
from survey.joints.settings import JointSettings
from survey.records.survey import BlockRecord
from survey.registration.stones import survey_stones
from survey.simplify.simplify import simplify
from synthetic.buildings.openings import ArchShape
from synthetic.buildings.walls import wall

# what is done, with which file, of how many times N stones
_STAGES = (
    ("read", "moma", 1),
    ("read", "csv", 1),
    ("read", "pnezd", 1),
    ("read, fit, extrude", "moma", 1),
    ("read, fit, extrude", "moma", 2),
    ("the same, all kept", "moma", 1),
    ("ingest into SQLite", "moma", 1),
    ("export", "json", 1),
    ("import", "json", 1),
    ("export", "json.gz", 1),
    ("import", "json.gz", 1),
)
_CLOSING = "simplify, close joints"
_TABLE = columns(
    "stage what is done | format format | stones stones :d | points points and corners :d | seconds s :.3g | "
    "us_per_stone µs per stone :.3g | us_per_line µs per line :.3g | file_mb file, MB :.3g | "
    "memory_mb memory it took, MB :.3g | memory_per_stone kB per stone :.3g | "
    "arrays_per_stone of which numbers :.3g | rejected points left out :d"
)
_CLOSED = columns(
    "stage what is done | stones stones :d | seconds s :.3g | us_per_stone µs per stone :.3g | "
    "memory_mb memory it took, MB :.3g | joints joints :d | open left open :d | "
    "moved_mm farthest corner moved, mm :.1f"
)
_ACROSS = 500  # stones of one course
_LENGTH, _HEIGHT, _SIGMA = 0.6, 0.3, 0.003
_CORNERS = np.array([[0.0, 0.0, 0.0], [_LENGTH, 0.0, 0.0], [_LENGTH, 0.0, _HEIGHT], [0.0, 0.0, _HEIGHT]])
_HEAD = """moma-survey 1
name wall
observer 150 -60 20
sigma 0.003
depth header 0.50 sigma 0.03 source rule of the benchmark
depth stretcher 0.25 sigma 0.03 source rule of the benchmark

"""


def main() -> None:
    """Make the files, run every stage, print."""
    parser = options_of("ingest", __doc__)
    parser.add_argument("--stones", type=int, default=100_000, help="stones of the wall (100000)")
    stages = [*dict.fromkeys(stage for stage, _, _ in _STAGES), _CLOSING]
    parser.add_argument(
        "--only", nargs="+", choices=stages, default=stages, help="a document needs a database"
    )
    parser.add_argument("--folder", type=Path, help="where to write, 2 GB for 100000 stones")
    options = parser.parse_args()
    rows: list[Row] = []
    with tempfile.TemporaryDirectory(prefix="moma-ingest-", dir=options.folder) as name:
        for stage, kind, times in (one for one in _STAGES if one[0] in options.only):
            count = options.stones * times
            progress(f"{stage}, {kind}, {count} stones")
            source = Path(name) / f"{times}.{kind.replace('json.gz', 'moma').replace('json', 'moma')}"
            if not source.exists():
                write(source, count)
            rows.append({"stage": stage, "format": kind} | alone(measured, stage, kind, str(source)))
    joints: list[Row] = []
    if _CLOSING in options.only:
        for count in (options.stones // 100, options.stones // 10):
            progress(f"close the joints of {count} stones")
            joints += alone(closed, count)["rows"]
    for row in rows + joints:
        row["us_per_stone"] = 1e6 * row["seconds"] / row["stones"]
        row["memory_mb"] = row["memory"] / 1e6
    if options.json:
        show(rows + joints, as_json=True)
        return
    for some, table in ((rows, _TABLE), (joints, _CLOSED)):
        if some:
            show(some, table, as_json=False)


# --- the wall ---


def write(path: Path, stones: int) -> None:
    """Write the wall in the format that the ending of the file names."""
    lines = {".moma": _moma, ".csv": _csv, ".pnezd": _pnezd}[path.suffix]
    with path.open("w", encoding="utf-8") as file:
        file.writelines(lines(stones))


def _wall(stones: int) -> Iterator[tuple[str, str, int, Array]]:
    """(code, kind, course, places (14, 3): ten points, then the corners counter-clockwise seen from outside).

    Every tenth stone has two points 30 to 300 mm off the face, every twentieth a corner worn by 20 to 80 mm.
    """
    rng = np.random.default_rng(1)
    for number in range(stones):
        course, place = divmod(number, _ACROSS)
        inside = np.column_stack([rng.uniform(0, _LENGTH, 10), np.zeros(10), rng.uniform(0, _HEIGHT, 10)])
        places = np.vstack([inside, _CORNERS]) + rng.normal(0.0, _SIGMA, (14, 3))
        places += [_LENGTH * place, 0.0, _HEIGHT * course]
        if number % 10 == 3:
            places[:2, 1] += rng.choice([-1, 1], 2) * rng.uniform(0.03, 0.3, 2)
        if number % 20 == 7:
            places[10 + number % 4, 1] += rng.uniform(0.02, 0.08)
        yield f"W{course + 1}-{place + 1}", "header" if number % 3 == 0 else "stretcher", course + 1, places


def _moma(stones: int) -> Iterator[str]:
    yield _HEAD
    for code, kind, course, places in _wall(stones):
        yield f"stone {code} {kind} course {course}\n"
        for k, (x, y, z) in enumerate(places):
            yield f"  {'point' if k < 10 else 'vertex'} {x:.4f} {y:.4f} {z:.4f}\n"
        yield "end\n"


def _csv(stones: int) -> Iterator[str]:
    yield "block,kind,course,role,x,y,z,sigma\n"
    for code, kind, course, places in _wall(stones):
        for k, (x, y, z) in enumerate(places):
            role = "point" if k < 10 else "vertex"
            yield f"{code},{kind},{course},{role},{x:.4f},{y:.4f},{z:.4f},0.003\n"


def _pnezd(stones: int) -> Iterator[str]:
    for number, (code, _, _, places) in enumerate(_wall(stones)):
        for k, (x, y, z) in enumerate(places):
            yield f"{14 * number + k + 1},{y:.4f},{x:.4f},{z:.4f},{code}:{'p' if k < 10 else 'v'}\n"


# --- the stages: stones, points, points left out, bytes of the arrays of all that was kept ---


def measured(stage: str, kind: str, source: str) -> Row:
    """Return what a stage costs that begins with a file of the wall, or the database made of it."""
    path, run = Path(source), _RUNS[stage]
    if stage in ("export", "import"):  # what was exported is imported
        document = path.with_suffix(f".{kind}")
        before, start = peak_bytes(), time.process_time()
        found = run(str(path.with_suffix(".db")), document)
    else:
        small = path.with_name(f"small{path.suffix}")
        write(small, 200)
        run(kind, small)  # compiles the kernels and fills caches
        before, start = peak_bytes(), time.process_time()
        found = run(kind, path)
    found |= {"seconds": time.process_time() - start, "memory": peak_bytes() - before}
    if stage not in ("export", "import"):
        with path.open(encoding="utf-8") as file:
            found["us_per_line"] = 1e6 * found["seconds"] / sum(1 for _ in file)
        found["file_mb"] = path.stat().st_size / 1e6
    if (arrays := found.pop("arrays", None)) is not None:
        found["memory_per_stone"] = found["memory"] / found["stones"] / 1e3
        found["arrays_per_stone"] = arrays / found["stones"] / 1e3
    return found


def _read(kind: str, path: Path) -> Row:
    stones = points = 0
    for one in open_survey(path, kind).blocks:
        if not isinstance(one, BlockRecord):
            raise SurveyError(f"not a stone: {one}", where=str(path))
        stones += 1
        points += len(one.points) + len(one.vertices)
    return {"stones": stones, "points": points}


def _survey(kind: str, path: Path) -> Row:
    stones = points = rejected = 0
    for block in _surveyed(kind, path):
        stones += 1
        points += len(block.face.fit.residuals)
        rejected += len(block.face.fit.rejected)
    return {"stones": stones, "points": points, "rejected": rejected}


def _keep(kind: str, path: Path) -> Row:
    blocks = deque(_surveyed(kind, path))
    some = [blocks[k] for k in range(0, len(blocks), max(1, len(blocks) // 200))]
    return {
        "stones": len(blocks),
        "points": sum(len(block.face.fit.residuals) for block in blocks),
        "rejected": sum(len(block.face.fit.rejected) for block in blocks),
        "arrays": arrays_bytes(some) * len(blocks) // len(some),
    }


def _surveyed(kind: str, path: Path) -> Iterator[SurveyedBlock]:
    for one in survey_stones(open_survey(path, kind)).stones:
        if not isinstance(one, SurveyedBlock):
            raise SurveyError(f"not a stone: {one.error}", where=str(path))
        yield one


def _ingest(kind: str, path: Path) -> Row:
    report = ingest([path], f"sqlite:///{path.with_suffix('.db')}", kind)
    stones = sum(sum(one.stones.values()) for one in report.files)
    rejected = sum(sum(one.rejected.values()) for one in report.files)
    return {"stones": stones, "points": 14 * stones, "rejected": rejected}


def _export(database: str, document: Path) -> Row:
    report = export_database(f"sqlite:///{database}", document)
    return {"stones": report.rows["entity"], "file_mb": report.bytes / 1e6}


def _import(database: str, document: Path) -> Row:
    report = import_database(document, f"sqlite:///{document}.db")
    return {"stones": report.rows["entity"], "file_mb": report.bytes / 1e6}


_RUNS: dict[str, Callable[..., Row]] = {
    "read": _read,
    "read, fit, extrude": _survey,
    "the same, all kept": _keep,
    "ingest into SQLite": _ingest,
    "export": _export,
    "import": _import,
}


# --- closed joints ---


def closed(stones: int) -> Row:
    """Return the rows of a wall with an arch, its joints 8 to 15 mm open, its corners worn."""
    rows: list[Row] = []
    for count in (100, stones):  # the first one compiles the kernels and fills caches
        blocks = wall(count, arch=ArchShape.SEGMENTAL).blocks()
        marks = [(time.process_time(), peak_bytes())]
        simple = [simplify(block) for block in blocks]
        marks.append((time.process_time(), peak_bytes()))
        report = close_joints(simple, JointSettings()).report
        marks.append((time.process_time(), peak_bytes()))
        rows = [
            {
                "stage": stage,
                "stones": len(blocks),
                "seconds": marks[k + 1][0] - marks[k][0],
                "memory": marks[k + 1][1] - marks[k][1],
            }
            for k, stage in enumerate(("simplify", "close joints"))
        ]
        rows[1] |= {
            "joints": len(report.joints),
            "open": sum(bool(joint.left_open) for joint in report.joints),
            "moved_mm": 1e3 * report.largest_displacement,
        }
    return {"rows": rows}


if __name__ == "__main__":
    guarded(main)
