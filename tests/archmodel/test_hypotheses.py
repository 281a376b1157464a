"""Stones that nobody has seen are entities like others, and say so wherever they are told of."""

from dataclasses import replace

import numpy as np
import pytest

from archmodel.correcting import correct
from archmodel.database import Database
from archmodel.entities import Support, kinds
from archmodel.entries import new_entry
from archmodel.query import describe, find, find_rows
from archmodel.records import StoneRecord
from archmodel.run_records import SimplificationRecord
from archmodel.store import load_stones, store_survey
from archmodel.store_runs import store_run
from moma.errors import UsageError
from tests.archmodel.stones import box_stone, run_record


def guessed(code: str) -> StoneRecord:
    text = "fills the hole between V1 and V2"
    plain = box_stone(code, at=(8.0, 0.0, 0.0))
    return replace(plain, hypothesis=True, provenance="hypothesis", provenance_text=text)


@pytest.fixture
def building(filled: Database) -> Database:
    with filled.session() as session:
        stones = [guessed("M1"), box_stone("G1", "support", at=(9.0, 0.0, 0.0))]
        store_survey(session, "proposed", "proposals", "cd" * 32, stones)
    return filled


def test_a_hypothesis_is_found_and_comes_back(building: Database) -> None:
    with building.session(read_only=True) as session:
        (stone,) = find(session, "header", ["hypothesis == true"])
        assert (stone.code, stone.hypothesis) == ("M1", True)
        (record,) = load_stones(session, [stone])
        assert (record.hypothesis, record.provenance) == (True, "hypothesis")
        assert len(find(session, "entity", ["hypothesis = false"])) == 8
        rows = find_rows(
            session, "entity", ["code in (M1, V1)"], columns=["code", "hypothesis", "provenance"]
        )
    assert rows == [
        {"code": "V1", "hypothesis": False, "provenance": "points"},
        {"code": "M1", "hypothesis": True, "provenance": "hypothesis"},
    ]
    assert all(type(row["hypothesis"]) is bool for row in rows)


def test_what_it_rests_on_is_told(building: Database) -> None:
    with building.session(read_only=True) as session:
        told, other = describe(session, "M1"), describe(session, "V1")
    assert (told["hypothesis"], other["hypothesis"]) == (True, False)
    assert told["measured"]["provenance"] == "fills the hole between V1 and V2"  # type: ignore[index]


def test_once_it_is_measured_it_is_none_any_more(building: Database) -> None:
    with building.session() as session:
        before = store_survey(
            session, "again", "again.moma", "ef" * 32, [box_stone("M1", at=(8.0, 0.0, 0.0))], again=True
        )
        assert find(session, "entity", ["hypothesis = true"]) == []
        told, then = describe(session, "M1"), describe(session, "M1", before.entry - 1)
    assert (told["hypothesis"], then["hypothesis"]) == (False, True)
    (change,) = told["corrections"]  # type: ignore[misc]
    assert (change["attribute"], change["before"], change["after"]) == ("hypothesis", True, False)


def test_nobody_can_declare_that_it_was_seen(building: Database) -> None:
    with (
        building.session() as session,
        pytest.raises(UsageError, match="follows from its survey; measure it"),
    ):
        correct(session, new_entry(session, "correction", "a test"), "M1", {"hypothesis": False})


def test_a_support_is_a_stone_of_its_own_kind(building: Database) -> None:
    with building.session(read_only=True) as session:
        assert [type(stone) for stone in find(session, "support")] == [Support]
        assert [stone.code for stone in find(session, "stone", ["kind = support"])] == ["G1"]
    assert "support" in kinds()


def test_what_a_solid_was_simplified_to_can_be_asked(building: Database) -> None:
    corners, faces = np.eye(4, 3), ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    told = [
        ("V1", "wedge", 0.8, 0.3, False),
        ("V2", "hexahedron", 1.0, 0.1, True),
        ("V3", None, None, None, None),
    ]
    solids = tuple(
        SimplificationRecord(code, "close", 0.0, 0.0, corners, faces, *values) for code, *values in told
    )
    with building.session() as session:
        store_run(session, replace(run_record(dict.fromkeys(("V1", "V2", "V3"))), simplifications=solids))
    asked = {
        "solid_shape = wedge": ["V1"],
        "blockiness < 0.9": ["V1"],
        "worst_angle > 0.2 and solid_shape = wedge": ["V1"],
        "within_tolerance = true": ["V2"],
        "within_tolerance != true": ["V1"],
        "within_tolerance@1 = false": ["V1"],
        "within_tolerance is null and runs > 0": ["V3"],
    }
    with building.session(read_only=True) as session:
        found = {where: [one.code for one in find(session, "entity", [where])] for where in asked}
        (row,) = find_rows(session, "entity", ["code = V1"], columns=["within_tolerance", "blockiness"])
    assert found == asked
    assert row == {"within_tolerance": False, "blockiness": 0.8}
