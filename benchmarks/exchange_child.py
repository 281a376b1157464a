"""One stage of `benchmarks.exchange`, in a process of its own; prints one line of JSON."""

import json
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.database.session import open_database
from archmodel.store.bulk import insert_rows
from archmodel.tables.entities import Entity
from archmodel.tables.entries import new_entry
from archmodel.tables.relations import Relation
from archmodel.tables.surveys import Measurement, Survey
from benchmarks.memory import peak_bytes
from pipelines.ingest.exchange import export_database, import_database

__all__ = ["main"]

_ACROSS = 500  # stones of one course
_LENGTH, _HEIGHT, _DEPTH = 0.6, 0.3, 0.4
_FACE = np.array([[0.0, 0.0, 0.0], [_LENGTH, 0.0, 0.0], [_LENGTH, 0.0, _HEIGHT], [0.0, 0.0, _HEIGHT]])
_AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
_BEHIND = np.array([0.0, _DEPTH, 0.0])
_SOLID = [[0, 1, 2, 3], [4, 7, 6, 5], [0, 4, 5, 1], [1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 4, 0]]


def main() -> None:
    """Run the stage that the command line names."""
    stage, folder, stones, suffix = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    before = peak_bytes() or 0
    wall, processor = time.perf_counter(), time.process_time()
    found = _STAGES[stage](folder, stones, suffix)
    found |= {
        "seconds": time.perf_counter() - wall,
        "processor": time.process_time() - processor,
        "memory": peak_bytes(),
        "before": before,
    }
    print(json.dumps(found))


def _make(folder: Path, stones: int, suffix: str) -> dict[str, Any]:
    """One wall of so many stones and three relations for each, with their measurements."""
    with open_database(f"sqlite:///{folder / 'made.db'}") as database, database.session() as session:
        entry = new_entry(session, "ingest", "benchmark").id
        survey = Survey(
            name="wall", path="wall.moma", sha256="0" * 64, entry_id=entry, stations={}, frame=None
        )
        session.add(survey)
        session.flush()
        rows = insert_rows(session, Entity, _entities(stones, entry))
        rows += insert_rows(session, Measurement, _measurements(stones, entry, survey.id))
        rows += insert_rows(session, Relation, _relations(stones, entry))
    return {"rows": rows, "bytes": (folder / "made.db").stat().st_size}


def _entities(stones: int, entry: int) -> Iterator[dict[str, Any]]:
    for number in range(stones):
        course, place = divmod(number, _ACROSS)
        yield {
            "id": number + 1,
            "kind": "header" if number % 3 == 0 else "stretcher",
            "code": f"W{course + 1}-{place + 1}",
            "entry_id": entry,
            "course": course + 1,
            "zone": "west wall",
            "depth": _DEPTH,
            "depth_sigma": 0.03,
            "depth_source": "rule of the benchmark",
            "depth_origin": "kind",
            "length": _LENGTH,
            "height": _HEIGHT,
            "area": _LENGTH * _HEIGHT,
            "volume": _LENGTH * _HEIGHT * _DEPTH,
            "x": _LENGTH * (place + 0.5),
            "y": _DEPTH / 2,
            "z": _HEIGHT * (course + 0.5),
            "hypothesis": False,
        }


def _measurements(stones: int, entry: int, survey: int) -> Iterator[dict[str, Any]]:
    """Ten points and four corners for each stone; all numbers have all their digits, as fitted ones have."""
    rng = np.random.default_rng(1)
    for number in range(stones):
        course, place = divmod(number, _ACROSS)
        corner = [_LENGTH * place, 0.0, _HEIGHT * course]
        inside = rng.uniform(0.0, 1.0, (10, 3)) * [_LENGTH, 0.0, _HEIGHT]
        outline = _FACE + corner + rng.normal(0.0, 0.001, (4, 3))
        yield {
            "id": number + 1,
            "entity_id": number + 1,
            "survey_id": survey,
            "entry_id": entry,
            "superseded_id": None,
            "line": 16 * number + 8,
            "sigma": 0.003,
            "offset": float(rng.normal(0.0, 0.001)),
            "rms": float(rng.uniform(0.002, 0.004)),
            "redundancy": 7,
            "point_count": 10,
            "rejected_count": 0,
            "rejected": [],
            "rejected_vertices": [],
            "provenance": "points",
            "provenance_text": "",
            "shape": "plane",
            "shape_text": "",
            "station": None,
            "photograph": None,
            "tail": 0.0,
            "direction": None,
            "normal": rng.normal(0.0, 0.01, 3) - [0.0, 1.0, 0.0],
            "centroid": outline.mean(axis=0),
            "axes": _AXES + rng.normal(0.0, 0.01, (2, 3)),
            "covariance": 1e-6 * rng.normal(1.0, 0.1, (3, 3)),
            "vertices": outline + rng.normal(0.0, 0.003, (4, 3)),
            "points": inside + corner + rng.normal(0.0, 0.003, (10, 3)),
            "outline": outline,
            "solid_vertices": np.vstack([outline, outline + _BEHIND]),
            "solid_faces": _SOLID,
            "vertex_sigma": np.vstack([rng.uniform(0.001, 0.004, (4, 3)), np.full((4, 3), np.nan)]),
            "image": np.empty((0, 2)),
            "sigmas": None,
            "names": [],
            "remarks": [],
            "notes": {},
        }


def _relations(stones: int, entry: int) -> Iterator[dict[str, Any]]:
    """Each stone on two others and beside one, as far as there are any: three for each stone on an endless wall."""
    rng = np.random.default_rng(2)
    for number in range(3 * stones):
        subject, which = divmod(number, 3)
        below = (subject - _ACROSS, subject - _ACROSS + 1, subject - 1)[which] % stones
        numbers = rng.normal(0.0, 1.0, 6).tolist()
        yield {
            "id": number + 1,
            "kind": "beside" if which == 2 else "rests_on",
            "subject_id": min(subject, below) + 1 if which == 2 else subject + 1,
            "object_id": max(subject, below) + 1 if which == 2 else below + 1,
            "declared": False,
            "area": 0.12 + 0.001 * numbers[0],
            "gap": 0.01 + 0.001 * numbers[1],
            **dict(zip(("x", "y", "z", "nx", "ny", "nz"), numbers, strict=True)),
            "entry_id": entry,
            "superseded_id": None,
        }


def _export(folder: Path, stones: int, suffix: str) -> dict[str, Any]:
    report = export_database(f"sqlite:///{folder / 'made.db'}", folder / f"made{suffix}")
    return {"rows": sum(report.rows.values()), "bytes": report.bytes}


def _import(folder: Path, stones: int, suffix: str) -> dict[str, Any]:
    target = folder / f"again{suffix}.db"
    report = import_database(folder / f"made{suffix}", f"sqlite:///{target}")
    return {"rows": sum(report.rows.values()), "bytes": report.bytes}


_STAGES: dict[str, Callable[[Path, int, str], dict[str, Any]]] = {
    "make": _make,
    "export": _export,
    "import": _import,
}


if __name__ == "__main__":
    main()
