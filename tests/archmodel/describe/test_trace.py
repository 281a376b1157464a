"""From a result back to the measurement that it rests on, also when the stone was measured again since."""

from dataclasses import replace

import numpy as np
import pytest
from sqlalchemy import insert, select, update

from archmodel.database.session import Database
from archmodel.describe.trace import trace
from archmodel.store.run_record import SimplificationRecord
from archmodel.store.runs import store_run
from archmodel.tables.entities import Entity
from archmodel.tables.entries import latest_entry, new_entry
from archmodel.tables.surveys import Measurement
from ground.errors import UsageError
from tests.archmodel.conftest import WALL
from tests.archmodel.stones import run_record

KEYSTONE = WALL[5]
RAISED = np.array([0.0, 0.0, 1e-3])


def measure_again(database: Database, code: str) -> None:
    """A second measurement of the stone, with all points 1 mm higher, in place of the one that is held."""
    with database.session() as session:
        entry = new_entry(session, "correction", "measured again")
        held = session.scalars(
            select(Measurement)
            .join(Entity, Entity.id == Measurement.entity_id)
            .where(Entity.code == code, Measurement.superseded_id.is_(None))
        ).one()
        row = {
            column.key: getattr(held, column.key)
            for column in Measurement.__table__.columns
            if column.key != "id"
        }
        session.execute(update(Measurement).where(Measurement.id == held.id).values(superseded_id=entry.id))
        session.execute(
            insert(Measurement),
            [
                row
                | {
                    "entry_id": entry.id,
                    "superseded_id": None,
                    "line": 99,
                    "points": held.points + RAISED,
                }
            ],
        )


def test_a_stress_leads_to_points_residuals_and_the_line_of_the_survey(filled: Database) -> None:
    solid = SimplificationRecord("V3", "close", 0.012, 0.03, KEYSTONE.solid_vertices, KEYSTONE.solid_faces)
    with filled.session() as session:
        number = store_run(session, replace(run_record({"V3": 4e5}), simplifications=(solid,)))
    with filled.session(read_only=True) as session:
        told = trace(session, "V3")
    assert told.result.von_mises_max == 4e5
    assert (told.run.id, told.run.scene) == (number, "window")
    assert told.simplification is not None
    assert told.simplification.displacement_max == 0.012
    assert told.measurement is not None
    np.testing.assert_array_equal(told.measurement.points, KEYSTONE.points)
    # the face is the plane y = 0, seen from the side of negative y
    np.testing.assert_array_equal(told.measurement.residuals, -KEYSTONE.points[:, 1])
    assert told.place == "window.moma:7"
    assert not told.is_outdated
    assert told.entity.kind == "keystone"


def test_the_latest_run_of_the_stone_is_meant_unless_one_is_named(filled: Database) -> None:
    with filled.session() as session:
        first, second, third = (
            store_run(session, run_record(results)) for results in ({"V3": 1.0}, {"V3": 2.0}, {"V1": 3.0})
        )
    with filled.session(read_only=True) as session:
        assert trace(session, "V3").run.id == second
        assert trace(session, "V3").simplification is None
        assert trace(session, "V3", first).result.von_mises_max == 1.0
        with pytest.raises(UsageError, match=f"stone V3 was not in run {third}; it was in {first}, {second}"):
            trace(session, "V3", third)


def test_a_run_rests_on_what_was_measured_when_it_read_the_stones(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        read = latest_entry(session)
    # measured again while it ran: it is stored after that, and yet rests on the first measurement
    measure_again(filled, "V3")
    with filled.session() as session:
        before = store_run(session, replace(run_record({"V3": 1.0}), as_of=read))
        after = store_run(session, replace(run_record({"V3": 2.0}), as_of=latest_entry(session)))
    with filled.session(read_only=True) as session:
        old, new = trace(session, "V3", before), trace(session, "V3", after)
    assert old.measurement is not None
    assert new.measurement is not None
    assert (old.place, new.place) == ("window.moma:7", "window.moma:99")
    assert (old.is_outdated, new.is_outdated) == (True, False)
    np.testing.assert_array_equal(old.measurement.points, KEYSTONE.points)
    np.testing.assert_array_equal(new.measurement.points, KEYSTONE.points + RAISED)


@pytest.mark.parametrize(
    ("code", "run", "said"),
    [
        ("V33", None, "there is no stone 'V33' in the database; did you mean V3"),
        ("V\n3", None, "is not"),
        ("V2", None, "stone V2 was in no run; simulate it first"),
        ("V3", 99, "stone V3 was not in run 99"),
        ("V3", 10**30, "stone V3 was not in run 1000000"),
        ("V3", -1, "stone V3 was not in run -1"),
    ],
)
def test_what_cannot_be_traced_is_said(filled: Database, code: str, run: int | None, said: str) -> None:
    with filled.session() as session:
        store_run(session, run_record({"V3": 4e5}))
    with filled.session(read_only=True) as session, pytest.raises(UsageError) as caught:
        trace(session, code, run)
    assert said in str(caught.value)
