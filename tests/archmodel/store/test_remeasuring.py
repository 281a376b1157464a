import numpy as np
import pytest
from sqlalchemy import select

from archmodel.database.session import Database
from archmodel.query.api import find
from archmodel.store.stones import load_stones, store_survey
from archmodel.tables.entities import Entity
from archmodel.tables.entries import held_at
from archmodel.tables.knowledge import Correction
from archmodel.tables.surveys import Measurement
from ground.errors import DatabaseError, GeometryError
from tests.archmodel.stones import box_stone

LONGER = box_stone("V2", "header", course=9, size=(0.25, 0.42, 0.3), at=(1.4, 0.0, 1.1))
NEW = box_stone("N1", "stretcher", size=(0.8, 0.3, 0.25), at=(5.0, 0.0, 0.0))


def test_a_stone_measured_again_has_the_new_measurement_and_keeps_the_old_one(filled: Database) -> None:
    with filled.session() as session:
        (before,) = load_stones(session, find(session, "entity", ["code = V2"]))
        stored = store_survey(session, "again", "again.moma", "cd" * 32, [LONGER, NEW], again=True)
        (entity,) = find(session, "entity", ["code = V2"])
        (after,) = load_stones(session, [entity])
        old, new = entity.measurements
        assert stored.again == (entity.id,)
        assert [session.get_one(Entity, number).code for number in stored.new] == ["N1"]
        assert (old.superseded_id, new.superseded_id) == (stored.entry, None)
        np.testing.assert_array_equal(old.outline, before.outline)
        np.testing.assert_array_equal(after.outline, LONGER.outline)
        earlier = session.scalars(
            select(Measurement).where(
                Measurement.entity_id == entity.id, held_at(Measurement, stored.entry - 1)
            )
        ).one()
        assert earlier is old


def test_what_follows_from_the_measurement_is_corrected_and_what_does_not_is_kept(filled: Database) -> None:
    with filled.session() as session:
        stored = store_survey(session, "again", "again.moma", "cd" * 32, [LONGER], again=True)
        (entity,) = find(session, "entity", ["code = V2"])
        assert (entity.kind, entity.course) == ("voussoir", None)
        assert entity.length == 0.25
        assert entity.volume == pytest.approx(0.25 * 0.42 * 0.3)
        corrections = session.scalars(select(Correction)).all()
        assert {one.entry_id for one in corrections} == {stored.entry}
        found = {one.attribute: (one.before, one.after) for one in corrections}
        assert sorted(found) == ["area", "length", "volume", "x"]
        assert found["length"] == (0.2, 0.25)


def test_the_same_measurement_again_corrects_nothing(filled: Database, wall: tuple[object, ...]) -> None:
    with filled.session() as session:
        stored = store_survey(session, "again", "again.moma", "cd" * 32, wall, again=True)  # type: ignore[arg-type]
        assert (len(stored.again), len(stored.new)) == (7, 0)
        assert session.scalars(select(Correction)).all() == []


def test_a_code_twice_in_one_file_is_refused_also_where_it_was_measured_again(filled: Database) -> None:
    many = [box_stone(f"A{i}") for i in range(600)]
    with (
        pytest.raises(DatabaseError, match=r"code V2 is taken by the stone at again\.moma:7"),
        filled.session() as s,
    ):
        store_survey(s, "again", "again.moma", "cd" * 32, [LONGER, *many, LONGER], again=True)


def test_a_bad_stone_leaves_all_as_it_was(filled: Database) -> None:
    flat = box_stone("V3", size=(0.2, 0.0, 0.3))
    with pytest.raises(GeometryError, match="stone V3: the volume"), filled.session() as session:
        store_survey(session, "again", "again.moma", "cd" * 32, [LONGER, flat], again=True)
    with filled.session(read_only=True) as session:
        (entity,) = find(session, "entity", ["code = V2"])
        assert entity.length == 0.2
        assert len(entity.measurements) == 1


def test_without_the_word_a_known_code_is_refused_and_the_word_named(filled: Database) -> None:
    with (
        pytest.raises(DatabaseError, match=r"taken by the stone at window\.moma:7; .* --again"),
        filled.session() as s,
    ):
        store_survey(s, "again", "again.moma", "cd" * 32, [LONGER])
