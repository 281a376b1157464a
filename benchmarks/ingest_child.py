"""One stage of `benchmarks.ingest`, in a process of its own; prints one line of JSON."""

import json
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.memory import arrays_bytes, peak_bytes
from mechanics.arrays import Array
from moma.errors import SurveyError
from pipelines.ingest.ingest import ingest
from survey.extrusion.extrusion import SurveyedBlock
from survey.formats.reading import open_survey
from survey.records.survey import BlockRecord
from survey.stones import survey_stones

__all__ = ["main"]

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
    """Run the stage that the command line names."""
    stage, format, path, stones = sys.argv[1], sys.argv[2], Path(sys.argv[3]), int(sys.argv[4])
    if stage == "write":
        _WRITERS[format](path, stones)
        print("{}")
        return
    small = path.with_name("small." + format)
    _WRITERS[format](small, 200)
    _STAGES[stage](format, small)  # compiles the kernels and fills caches
    before, start = peak_bytes() or 0, time.process_time()
    found = _STAGES[stage](format, path)
    seconds = time.process_time() - start
    found |= {
        "seconds": seconds,
        "memory": (peak_bytes() or 0) - before,
        "file": path.stat().st_size,
        "lines": sum(1 for _ in path.open(encoding="utf-8")),
    }
    print(json.dumps(found))


# --- the wall ---


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


def _write_moma(path: Path, stones: int) -> None:
    with path.open("w", encoding="utf-8") as file:
        file.write(_HEAD)
        for code, kind, course, places in _wall(stones):
            rows = [f"  {'point' if k < 10 else 'vertex'} {_place(p)}\n" for k, p in enumerate(places)]
            file.write(f"stone {code} {kind} course {course}\n{''.join(rows)}end\n")


def _write_csv(path: Path, stones: int) -> None:
    with path.open("w", encoding="utf-8") as file:
        file.write("block,kind,course,role,x,y,z,sigma\n")
        for code, kind, course, places in _wall(stones):
            for k, p in enumerate(places):
                role = "point" if k < 10 else "vertex"
                file.write(f"{code},{kind},{course},{role},{_place(p).replace(' ', ',')},0.003\n")


def _write_pnezd(path: Path, stones: int) -> None:
    with path.open("w", encoding="utf-8") as file:
        for number, (code, _, _, places) in enumerate(_wall(stones)):
            for k, (x, y, z) in enumerate(places):
                role = "p" if k < 10 else "v"
                file.write(f"{14 * number + k + 1},{y:.4f},{x:.4f},{z:.4f},{code}:{role}\n")


def _place(place: Array) -> str:
    x, y, z = place
    return f"{x:.4f} {y:.4f} {z:.4f}"


_WRITERS: dict[str, Callable[[Path, int], None]] = {
    "moma": _write_moma,
    "csv": _write_csv,
    "pnezd": _write_pnezd,
}


# --- the stages: stones, points, points left out, bytes of the arrays of all that was kept ---


def _read(format: str, path: Path) -> dict[str, Any]:
    stones = points = 0
    for one in open_survey(path, format).blocks:
        if not isinstance(one, BlockRecord):
            raise SurveyError(f"not a stone: {one}", where=str(path))
        stones += 1
        points += len(one.points) + len(one.vertices)
    return _found(stones, points, None, None)


def _survey(format: str, path: Path) -> dict[str, Any]:
    stones = points = rejected = 0
    for block in _surveyed(format, path):
        stones += 1
        points += len(block.face.fit.residuals)
        rejected += len(block.face.fit.rejected)
    return _found(stones, points, rejected, None)


def _keep(format: str, path: Path) -> dict[str, Any]:
    blocks = deque(_surveyed(format, path))
    points = sum(len(block.face.fit.residuals) for block in blocks)
    rejected = sum(len(block.face.fit.rejected) for block in blocks)
    some = [blocks[k] for k in range(0, len(blocks), max(1, len(blocks) // 200))]
    arrays = arrays_bytes(some) * len(blocks) // len(some)
    return _found(len(blocks), points, rejected, arrays)


def _surveyed(format: str, path: Path) -> Iterator[SurveyedBlock]:
    for one in survey_stones(open_survey(path, format)).stones:
        if not isinstance(one, SurveyedBlock):
            raise SurveyError(f"not a stone: {one.error}", where=str(path))
        yield one


def _ingest(format: str, path: Path) -> dict[str, Any]:
    database = path.with_suffix(".db")
    report = ingest([path], f"sqlite:///{database}", format)
    stones = sum(sum(one.stones.values()) for one in report.files)
    rejected = sum(sum(one.rejected.values()) for one in report.files)
    return _found(stones, 14 * stones, rejected, None)


def _found(stones: int, points: int, rejected: int | None, arrays: int | None) -> dict[str, Any]:
    return {"stones": stones, "points": points, "rejected": rejected, "arrays": arrays}


_STAGES: dict[str, Callable[[str, Path], dict[str, Any]]] = {
    "read": _read,
    "read, fit, extrude": _survey,
    "the same, all kept": _keep,
    "ingest into SQLite": _ingest,
}


if __name__ == "__main__":
    main()
