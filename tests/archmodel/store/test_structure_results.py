"""Results of structures in the database: stored with a run, asked for by name and by run, and compared."""

from dataclasses import replace

import pytest

from archmodel.database.session import Database
from archmodel.describe.entity import describe
from archmodel.describe.runs import compare_runs, describe_run
from archmodel.query.api import find, find_rows
from archmodel.relations.members import members_of_structures
from archmodel.store.run_record import StructureValues
from archmodel.store.runs import store_run
from archmodel.tables.entities import Entity
from archmodel.tables.entries import new_entry
from archmodel.tables.relations import Membership
from archmodel.tables.structures import Course, Wall
from ground.errors import DatabaseError, QueryError
from tests.archmodel.stones import run_record

RESULTS = {"W01-01": 1e5, "W01-02": 1e5, "W02-01": 1e5}


@pytest.fixture
def cracked(filled: Database) -> Database:
    """Two courses of a wall, and two runs: the crack of the lower course grows from 0.5 to 3 mm in the second."""
    with filled.session() as session:
        entry = new_entry(session, "declaration", "a test").id
        wall = Wall(code="WALL", entry_id=entry)
        session.add(wall)
        session.flush()
        stones = {one.code: one.id for one in session.query(Entity)}
        numbers = {}
        for number, codes in ((1, ("W01-01", "W01-02")), (2, ("W02-01",))):
            course = Course(code=f"course {number}", number=number, parent_id=wall.id, entry_id=entry)
            session.add(course)
            session.flush()
            numbers[course.code] = course.id
            for code in codes:
                session.add(
                    Membership(entity_id=stones[code], structure_id=course.id, declared=False, entry_id=entry)
                )
        for widths in ({"course 1": 5e-4, "course 2": 1e-4}, {"course 1": 3e-3, "course 2": 1e-4}):
            values = (
                StructureValues(numbers[code], code, "course", frozenset(), {"crack_width": width})
                for code, width in widths.items()
            )
            store_run(session, replace(run_record(RESULTS), structures=tuple(values)))
    return filled


def test_members_of_a_structure_are_those_of_its_parts_too(cracked: Database) -> None:
    with cracked.session(read_only=True) as session:
        found = members_of_structures(session, ["W01-02", "W02-01", "V1"])
    assert [(one.code, one.kinds, sorted(one.members)) for one in found] == [
        ("WALL", ("structure", "wall"), ["W01-02", "W02-01"]),
        ("course 1", ("structure", "course"), ["W01-02"]),
        ("course 2", ("structure", "course"), ["W02-01"]),
    ]


def test_courses_are_found_by_a_result_of_their_latest_run_or_of_a_named_one(cracked: Database) -> None:
    with cracked.session(read_only=True) as session:

        def wide(expression: str, run: int | None = None) -> list[object]:
            return [row["code"] for row in find_rows(session, "course", [expression], run, ["code"])]

        assert wide("crack_width > 0.001") == ["course 1"]
        assert wide("crack_width > 0.001", run=1) == []
        assert wide("crack_width@1 > 0.0003") == ["course 1"]
        (first, second) = find_rows(session, "course", columns=["crack_width", "crack_width@1"])
        assert (list(first.values()), list(second.values())) == ([3e-3, 5e-4], [1e-4, 1e-4])
        (wall,) = find_rows(session, "wall", columns=["crack_width"])
        assert wall == {"crack_width": None}
        inside = find(session, "entity", ["member_of(crack_width > 0.001)"])
        assert [one.code for one in inside] == ["W01-01", "W01-02"]
        with pytest.raises(QueryError, match="there is no run '3'"):
            wide("crack_width@3 > 0")
        with pytest.raises(QueryError, match="there is no such run"):
            wide("crack_width > 0", run=3)


def test_runs_are_described_and_compared_by_results_of_structures(cracked: Database) -> None:
    with cracked.session(read_only=True) as session:
        told = describe_run(session, 2, count=1)["structures"]
        assert told == [{"structure": "course 1", "result": "crack_width", "value": 3e-3, "unit": "m"}]
        (change,) = compare_runs(session, 2, 1)["structures"]
        assert (change["structure"], change["run"], change["against"]) == ("course 1", 3e-3, 5e-4)
        assert change["change"] == pytest.approx(2.5e-3)
        runs = describe(session, "course 1")["runs"]
    assert [(run["run"], run["crack_width"]) for run in runs] == [(2, 3e-3), (1, 5e-4)]  # type: ignore[index, union-attr]


def test_a_result_that_is_no_number_is_refused_with_its_structure(cracked: Database) -> None:
    values = StructureValues(2, "course 1", "course", frozenset(), {"crack_width": float("nan")})
    with cracked.session() as session, pytest.raises(DatabaseError, match="course 1: crack_width is nan"):
        store_run(session, replace(run_record(RESULTS), structures=(values,)))
