"""A run in the database: whole or not at all, and every number where it belongs."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sqlalchemy import func, select

from archmodel.database.session import Database
from archmodel.store.run_record import (
    Columns,
    ErrorMeasures,
    RunRecord,
    SimplificationRecord,
    StoneResult,
)
from archmodel.store.runs import store_run
from archmodel.store.stones import store_survey
from archmodel.tables.entities import Entity
from archmodel.tables.runs import ContactPoint, EntityResult, JointResult, Run
from archmodel.tables.surveys import Simplification
from ground.errors import DatabaseError
from tests.archmodel.stones import SHA, box_stone, contents, run_record

NAN, INF = float("nan"), float("inf")
PLAIN = run_record({"V1": 1e5, "V2": 2e5, "V3": None})
SOLID = SimplificationRecord(
    "V2", "close", 0.004, -0.01, np.eye(4, 3), ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3))
)


def joints(**values: Any) -> Columns:
    """Two joints, V1 on V2 and V2 on V3, with every number another; `values` in place of some."""
    numbers = np.arange(2.0)
    columns: dict[str, Any] = {
        "first": np.array([0, 1]),
        "second": np.array([1, 2]),
        **dict(zip("xyz", np.array([[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]]), strict=True)),
        **dict(zip(("nx", "ny", "nz"), np.array([[0.0, 0.6], [0.0, 0.0], [1.0, 0.8]]), strict=True)),
        "area": numbers + 10,
        "parted": np.array([False, True]),
        "force_normal": numbers + 20,
        "force_shear": numbers + 30,
        "pressure_mean": numbers + 40,
        "pressure_max": numbers + 50,
        "kern": numbers + 60,
        "friction_use": numbers + 70,
        "slipping": numbers + 80,
        "open": numbers + 90,
        "gap": numbers + 100,
        "opening": numbers + 110,
        "sliding": numbers + 120,
        "width": np.full(2, NAN),
    }
    return columns | values


def contacts(count: int = 3, **values: Any) -> Columns:
    """Points between V1 and V2, every number another; `values` in place of some."""
    numbers = np.arange(float(count))
    columns: dict[str, Any] = {
        "candidate": np.zeros(count, dtype=np.int64),
        "antagonist": np.ones(count, dtype=np.int64),
        "joint": np.arange(count) - 1,
        **{name: numbers + shift for name, shift in zip("xyz", (0.1, 0.2, 0.3), strict=True)},
        **{
            name: numbers + shift + 1e6
            for name, shift in zip(("nx", "ny", "nz"), (0.1, 0.2, 0.3), strict=True)
        },
        **{
            name: numbers + shift + 2e6
            for name, shift in zip(("fx", "fy", "fz"), (0.1, 0.2, 0.3), strict=True)
        },
        "area": numbers + 0.5,
        "gap": numbers + 0.6,
        "opening": numbers + 0.7,
        "slide": numbers + 0.8,
        "status": np.array(["open", "stick", "slip", "bonded", "broken"])[np.arange(count) % 5],
    }
    return columns | values


def test_a_run_is_kept_with_its_results(filled: Database) -> None:
    with filled.session() as session:
        first = store_run(session, run_record({"V1": 3e5, "V2": None}))
        second = store_run(session, run_record({"V1": 1e5}, scene="again"))
    assert second > first
    with filled.session(read_only=True) as session:
        run = session.get_one(Run, first)
        assert (run.scene, run.outcome, run.summary["contacts"]) == ("window", "equilibrium", 12)
        assert {r.entity.code: r.von_mises_max for r in run.results} == {"V1": 3e5, "V2": None}
        assert run.results[0].values == {"weight": 900.5}


@pytest.mark.parametrize(
    ("run", "message"),
    [
        (run_record({"V1": 1e5, "V9": 1e5}), "run of window: stone V9 is not in the database"),
        (run_record({"V1": float("nan")}), "run of window, stone V1: von_mises_p99 is nan"),
        (replace(run_record({}), results=run_record({"V1": 1.0}).results * 2), "two results for stone V1"),
        (replace(run_record({}), summary={"weight": float("inf")}), "the summary cannot be stored"),
        (replace(run_record({}), summary={"weight": object()}), "the summary cannot be stored"),
        (
            replace(run_record({}), results=(replace(run_record({"V1": 1.0}).results[0], fidelity="soft"),)),
            "fidelity 'soft' is none of fixed, rigid, deformable",
        ),
        (replace(PLAIN, settings={"step": NAN}), "the settings cannot be stored"),
        (replace(PLAIN, as_of=99), "there is no entry 99"),
        (replace(PLAIN, wall=INF), "wall is inf"),
        (replace(PLAIN, errors=ErrorMeasures(energy=NAN)), "energy is nan"),
        (replace(PLAIN, simplifications=(SOLID, SOLID)), "two simplifications for stone V2"),
        (replace(PLAIN, simplifications=(replace(SOLID, code="R1"),)), "stone R1 has a solid and no result"),
        (
            replace(PLAIN, simplifications=(replace(SOLID, vertices=np.full((4, 3), NAN)),)),
            "stone V2: the corners of its solid are not",
        ),
        (
            replace(PLAIN, joints=joints(second=np.array([1, 3]))),
            "not among the 3 stones of the run",
        ),
        (
            replace(PLAIN, joints=joints(first=np.array([0, -1]))),
            "not among the 3 stones of the run",
        ),
        (replace(PLAIN, joints=joints(area=np.array([1.0, NAN]))), "joints, number 1: area is nan"),
        (replace(PLAIN, joints=joints(kern=np.array([NAN, INF]))), "joints, number 1: kern is inf"),
        (replace(PLAIN, joints=joints(depth=np.zeros(2))), "columns are not those of the table: depth"),
        (replace(PLAIN, contacts=contacts(x=np.full(3, NAN))), "contact points, number 0: x is nan"),
        (
            replace(PLAIN, joints=joints(), contacts=contacts(1100, slide=np.append(np.zeros(1099), -INF))),
            "contact points, number 1099: slide is -inf",
        ),
    ],
)
def test_a_run_is_kept_whole_or_not_at_all(filled: Database, run: RunRecord, message: str) -> None:
    before = contents(filled)
    with filled.session() as session, pytest.raises(DatabaseError, match=message):
        store_run(session, run)
    assert contents(filled) == before


def test_results_of_another_stone_are_not_mixed_up(filled: Database) -> None:
    with filled.session() as session:
        store_run(session, run_record({"V3": 3.0, "W01-01": 1.0}))
    with filled.session(read_only=True) as session:
        assert {r.entity.code: r.von_mises_max for r in session.query(EntityResult)} == {
            "V3": 3.0,
            "W01-01": 1.0,
        }


def test_nothing_to_say_is_null_and_not_a_number(filled: Database) -> None:
    unknown = np.array([NAN, 0.25])
    names = ("pressure_mean", "pressure_max", "kern", "friction_use", "slipping", "open")
    with filled.session() as session:
        store_run(session, replace(PLAIN, joints=joints(**dict.fromkeys(names, unknown))))
    with filled.session(read_only=True) as session:
        rows = session.scalars(select(JointResult).order_by(JointResult.number)).all()
        assert [[getattr(row, name) for name in names] for row in rows] == [[None] * 6, [0.25] * 6]
        for name in names:
            column = getattr(JointResult, name)
            assert session.scalar(select(func.count()).where(column.is_(None))) == 1


def test_every_column_of_a_joint_has_its_own_number(filled: Database) -> None:
    with filled.session() as session:
        number = store_run(session, replace(PLAIN, joints=joints()))
    with filled.session(read_only=True) as session:
        row = session.get_one(JointResult, (number, 1))
        assert (row.first.code, row.second.code, row.parted) == ("V2", "V3", True)
        assert (row.x, row.y, row.z, row.nx, row.ny, row.nz) == (4.0, 5.0, 6.0, 0.6, 0.0, 0.8)
        names = (
            *("area", "force_normal", "force_shear", "pressure_mean", "pressure_max", "kern"),
            "friction_use",
        )
        names += ("slipping", "open", "gap", "opening", "sliding")
        assert [getattr(row, name) for name in names] == list(range(11, 131, 10))


@pytest.mark.parametrize("count", [1, 500, 5000, 5001, 12_345])
def test_contact_points_of_any_number_come_out_in_order(filled: Database, count: int) -> None:
    """Batches are of 500 rows, chunks of arrays of 5,000: their ends must neither lose nor repeat a row."""
    given = contacts(count)
    with filled.session() as session:
        number = store_run(session, replace(PLAIN, contacts=given))
    with filled.session(read_only=True) as session:
        assert session.get_one(Run, number).contacts == count
        rows = session.execute(select(ContactPoint.__table__).order_by(ContactPoint.number)).all()
        codes = {row.id: row.code for row in session.execute(select(Entity.id, Entity.code))}
    assert [row.number for row in rows] == list(range(count))
    assert [row.joint for row in rows] == [None, *range(count - 1)]
    assert {(codes[row.candidate_id], codes[row.antagonist_id]) for row in rows} == {("V1", "V2")}
    assert [row.status for row in rows] == given["status"].tolist()
    for name in ("x", "y", "z", "nx", "fz", "area", "gap", "slide"):
        np.testing.assert_array_equal([getattr(row, name) for row in rows], given[name])


def test_solids_settings_and_errors_are_kept(filled: Database) -> None:
    record = replace(
        PLAIN,
        simplifications=(SOLID,),
        settings={"time": {"step": 0.01}},
        versions={"moma": "0.1.0", "numpy": "2.0"},
        errors=ErrorMeasures(natural_map=1e-7, reaction=0.0),
        steps=12,
        simulated=0.5,
        wall=3.25,
        as_of=1,
    )
    with filled.session() as session:
        number = store_run(session, record)
    with filled.session(read_only=True) as session:
        run = session.get_one(Run, number)
        assert run.entry.settings == {"time": {"step": 0.01}}
        assert run.versions == {"moma": "0.1.0", "numpy": "2.0"}
        assert (run.natural_map, run.reaction, run.energy) == (1e-7, 0.0, None)
        assert (run.steps, run.simulated, run.wall, run.contacts) == (12, 0.5, 3.25, None)
        assert (run.as_of_id, run.entry.action) == (1, "run")
        (solid,) = session.scalars(select(Simplification))
        assert (solid.mode, solid.displacement_max, solid.volume_change) == ("close", 0.004, -0.01)
        np.testing.assert_array_equal(solid.vertices, SOLID.vertices)
        assert solid.faces == [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]


def test_more_stones_than_one_statement_holds_have_results(empty: Database) -> None:
    codes = [f"S{i}" for i in range(1201)]
    with empty.session() as session:
        store_survey(session, "big", "big.moma", SHA, (box_stone(code) for code in codes))
        results = tuple(
            StoneResult(code, "rigid", None, None, None, i / 8, None) for i, code in enumerate(codes)
        )
        store_run(session, replace(PLAIN, results=results[::-1]))
    with empty.session(read_only=True) as session:
        rows = session.execute(
            select(Entity.code, EntityResult.displacement_max).join(EntityResult.entity).order_by(Entity.id)
        )
        assert [tuple(row) for row in rows] == [(code, i / 8) for i, code in enumerate(codes)]
