"""Runs in a list, in full and beside each other."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from sqlalchemy.orm import Session

from archmodel.database.session import Database
from archmodel.describe.runs import compare_runs, describe_run, list_runs
from archmodel.store.run_record import Columns, ErrorMeasures, SimplificationRecord
from archmodel.store.runs import store_run
from ground.errors import UsageError
from tests.archmodel.stones import run_record

NAN = float("nan")


def joints(opening: list[float], kern: list[float], friction_use: list[float]) -> Columns:
    """Joints in the order V1 on V2, V2 on V3, V1 on V3, equal but for what is given."""
    given = {"first": [0, 1, 0], "second": [1, 2, 2], "nz": [1.0] * 3, "parted": [False] * 3}
    given |= {"opening": opening, "kern": kern, "friction_use": friction_use, "width": [0.01, NAN, 0.012]}
    names = ("area", "force_normal", "force_shear", "pressure_mean", "pressure_max", "slipping", "open")
    constant = dict.fromkeys((*names, "gap", "sliding"), [1.0] * 3)
    constant |= dict.fromkeys(("x", "y", "z", "nx", "ny"), [0.0] * 3)
    return {name: np.array(values) for name, values in (constant | given).items()}


def solid(code: str, moved: float, shape: str | None = None, within: bool = True) -> SimplificationRecord:
    corners, faces = np.eye(4, 3), ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
    return SimplificationRecord(code, "mortar", moved, 0.0, corners, faces, shape, 0.9, 0.1, within)


@pytest.fixture
def session(filled: Database) -> Iterator[Session]:
    """Two runs: in the second, V1 is stressed twice as much, V3 is rigid, and R1 takes part instead of W01-01."""
    first = replace(
        run_record({"V1": 1e5, "V2": 3e5, "V3": 2e5, "W01-01": 5e4}),
        settings={"time": {"step": 0.01, "theta": 1.0}},
        errors=ErrorMeasures(natural_map=1e-7),
        joints=joints([1e-3, 0.0, 2e-3], [0.5, 1.5, NAN], [0.2, NAN, 0.9]),
        wall=12.5,
        simplifications=(
            solid("V1", 0.02, "wedge", False),
            solid("V2", 0.03, "hexahedron"),
            solid("V3", 0.01),
        ),
    )
    second = replace(
        run_record({"V1": 2e5, "V2": 3.1e5, "V3": None, "R1": None}, scene="again"),
        outcome="moving",
        settings={"time": {"step": 0.02, "theta": 1.0}},
    )
    with filled.session() as writing:
        store_run(writing, first)
        store_run(writing, second)
    with filled.session(read_only=True) as reading:
        yield reading


def test_the_list_has_every_run_with_its_errors_and_its_stones(session: Session) -> None:
    one, two = list_runs(session)
    assert (one["run"], one["scene"], one["outcome"], one["stones"]) == (1, "window", "equilibrium", 4)
    assert (one["natural_map"], one["balance"], one["wall"]) == (1e-7, None, 12.5)
    assert (two["run"], two["scene"], two["outcome"], two["stones"]) == (2, "again", "moving", 4)


def test_a_run_in_full_names_the_worst_stones_and_joints(session: Session) -> None:
    told = describe_run(session, 1)
    assert [row["code"] for row in told["largest_stresses"]] == ["V2", "V3", "V1", "W01-01"]
    pairs = {
        name: [(row["first"], row["second"]) for row in told[name]]
        for name in ("largest_openings", "least_centred", "most_used_friction")
    }
    assert pairs == {
        "largest_openings": [("V1", "V3"), ("V1", "V2")],
        "least_centred": [("V2", "V3")],
        "most_used_friction": [("V1", "V3"), ("V1", "V2")],
    }
    assert told["fidelities"] == {"deformable": 4}
    assert describe_run(session, 2)["fidelities"] == {"deformable": 2, "rigid": 2}
    assert told["settings"]["time"]["step"] == 0.01
    assert told["errors"]["natural_map"] == 1e-7
    assert [row["code"] for row in describe_run(session, 1, count=1)["largest_stresses"]] == ["V2"]


def test_the_worst_joints_are_those_of_the_run_itself_and_the_worst_of_all(filled: Database) -> None:
    """Two runs of the same joints, opened the other way round."""
    runs = [
        replace(run_record({"V1": None, "V2": None, "V3": None}), joints=joints(opening, kern, use))
        for opening, kern, use in (
            ([1e-3, 2e-3, 3e-3], [2.0, 3.0, 4.0], [0.2, 0.3, 0.4]),
            ([6e-3, 5e-3, 4e-3], [7.0, 6.0, 5.0], [0.7, 0.6, 0.5]),
        )
    ]
    with filled.session() as session:
        numbers = [store_run(session, one) for one in runs]
    columns = {"largest_openings": "opening", "least_centred": "kern", "most_used_friction": "friction_use"}
    with filled.session(read_only=True) as session:
        for number, pairs in zip(
            numbers, ((("V1", "V3"), ("V2", "V3")), (("V1", "V2"), ("V2", "V3"))), strict=True
        ):
            told, run = describe_run(session, number, count=2), runs[number - numbers[0]]
            for name, column in columns.items():
                assert [(row["first"], row["second"]) for row in told[name]] == [*pairs]
                worst = sorted(run.joints[column], reverse=True)[:2]
                assert [row[column] for row in told[name]] == worst


def test_a_run_in_full_says_what_its_stones_were_simplified_to(session: Session) -> None:
    told = describe_run(session, 1)
    assert told["simplification"] == {
        "mode": "mortar",
        "shapes": {"hexahedron": 1, "wedge": 1},
        "outside_tolerance": 1,
        "displacement_max": 0.03,
        "farthest": "V2",
    }
    assert {(row["first"], row["second"]): row["width"] for row in told["most_used_friction"]} == {
        ("V1", "V3"): 0.012,
        ("V1", "V2"): 0.01,
    }
    assert describe_run(session, 2)["simplification"] is None


def test_two_runs_differ_by_settings_stones_and_values(session: Session) -> None:
    told = compare_runs(session, 2, 1)
    assert told["settings"] == {"time.step": [0.02, 0.01]}
    assert told["outcomes"] == ["moving", "equilibrium"]
    assert (told["only_in_run"], told["only_against"]) == (1, 1)
    # V3 has no stress in one of them, so that there is nothing to compare
    changes = [(row["code"], row["run"], row["against"]) for row in told["stresses"]]
    assert changes == [("V1", 2e5, 1e5), ("V2", 3.1e5, 3e5)]
    assert [row["change"] for row in told["stresses"]] == [2e5 - 1e5, 3.1e5 - 3e5]
    assert [row["change"] for row in compare_runs(session, 1, 2)["stresses"]] == [1e5 - 2e5, 3e5 - 3.1e5]
    assert told["displacements"] == []
    assert compare_runs(session, 1, 1)["stresses"] == []


def test_stones_of_one_run_alone_are_counted_for_that_run(filled: Database) -> None:
    """One run has V2 and V3 for itself, the other R1; both have V1."""
    with filled.session() as session:
        one = store_run(session, run_record({"V1": 1e5, "V2": 1e5, "V3": None}))
        other = store_run(session, run_record({"V1": 1e5, "R1": None}))
    with filled.session(read_only=True) as session:
        told, turned = compare_runs(session, one, other), compare_runs(session, other, one)
    assert (told["only_in_run"], told["only_against"]) == (2, 1)
    assert (turned["only_in_run"], turned["only_against"]) == (1, 2)


@pytest.mark.parametrize("number", [3, 0, -1, 10**30])
def test_a_run_that_is_not_there_is_an_error_that_names_those_that_are(session: Session, number: int) -> None:
    with pytest.raises(UsageError, match=f"there is no run {number}; there are 1, 2$"):
        describe_run(session, number)
    with pytest.raises(UsageError, match=f"there is no run {number}"):
        compare_runs(session, 1, number)


def test_before_the_first_run_there_is_none(filled: Database) -> None:
    with filled.session(read_only=True) as reading:
        assert list_runs(reading) == []
        with pytest.raises(UsageError, match="there is no run 1; there is none yet"):
            describe_run(reading, 1)
