"""Stones that nobody has seen: all or nothing into the database, and out of every question when withdrawn."""

from dataclasses import replace

import numpy as np
import pytest
from sqlalchemy import func, select

from archmodel.database.session import open_database
from archmodel.query.api import find, find_faces, find_rows
from archmodel.store.hypotheses import store_hypotheses, withdraw_hypotheses
from archmodel.store.revisions import RowCounts
from archmodel.store.stones import load_stones
from archmodel.tables.entities import Entity
from archmodel.tables.entries import Entry, new_entry
from archmodel.tables.surveys import Measurement
from ground.errors import DatabaseError, UsageError
from pipelines.ingest.records import stone_record, surveyed_block
from survey.extrusion.depth import depth_for
from survey.extrusion.extrusion import extrude
from survey.faces.faces import outline_face
from survey.unseen.missing.propose import propose_missing
from synthetic.buildings.window import make_window


@pytest.fixture(scope="module")
def records():
    survey = make_window().survey
    blocks = [
        extrude(outline_face(one, survey.head.viewpoint(None)), depth_for(one, survey.head.depth_rules))
        for one in survey.blocks
    ]
    gone = {"W05-02", "W10-05"}
    found = propose_missing([one for one in blocks if one.code not in gone])
    return [stone_record(one.block) for one in found]


@pytest.fixture
def session():
    with open_database("sqlite://") as database, database.session() as session:
        yield session


def count(session, table):
    return session.scalar(select(func.count()).select_from(table))


def test_what_is_stored_comes_back_as_it_was(session, records):
    entry, numbers = store_hypotheses(
        session, "test", records, "thought", author="A. Mason", settings={"max_stones": 3}
    )
    assert (entry.action, entry.author, entry.source) == ("declaration", "A. Mason", "thought")
    assert entry.settings == {"max_stones": 3}
    found = find(session, "entity", ["hypothesis = true"])
    assert [one.id for one in found] == list(numbers)
    for loaded, record in zip(load_stones(session, found), records, strict=True):
        assert loaded.hypothesis
        assert loaded.provenance == "hypothesis"
        block = surveyed_block(loaded)
        assert block.face.provenance.source == "hypothesis"
        assert block.solid.vertices == pytest.approx(record.solid_vertices, abs=1e-12)


def test_all_or_nothing(session, records):
    store_hypotheses(session, "test", records[:1], "thought")
    before = count(session, Entity), count(session, Entry), count(session, Measurement)
    with pytest.raises(DatabaseError, match="is taken"):
        store_hypotheses(session, "test", records, "thought")
    with pytest.raises(DatabaseError, match="is taken"):
        store_hypotheses(session, "test", [records[1], records[1]], "thought")
    with pytest.raises(UsageError, match="is no hypothesis"):
        store_hypotheses(session, "test", [replace(records[1], hypothesis=False)], "thought")
    with pytest.raises(UsageError, match="no stones"):
        store_hypotheses(session, "test", [], "thought")
    assert (count(session, Entity), count(session, Entry), count(session, Measurement)) == before


def test_one_that_is_withdrawn_is_found_no_more_and_forgotten_not(session, records):
    _, numbers = store_hypotheses(session, "test", records, "thought")
    entry = new_entry(session, "declaration", "seen", author="A. Mason")
    assert withdraw_hypotheses(session, entry, numbers[:1]) == RowCounts(withdrawn=1)
    assert withdraw_hypotheses(session, entry, numbers) == RowCounts(withdrawn=1, unchanged=1)
    assert find(session, "entity") == []
    assert find_rows(session, "entity", ["hypothesis = true"]) == find_faces(session, "entity") == []
    assert count(session, Entity) == 2
    kept = session.scalars(select(Measurement).order_by(Measurement.id)).all()
    assert [one.superseded_id for one in kept] == [entry.id, entry.id]
    assert np.array_equal(kept[0].solid_vertices, records[0].solid_vertices)


def test_what_was_surveyed_is_not_withdrawn(session, records):
    _, numbers = store_hypotheses(session, "test", records, "thought")
    session.get(Entity, numbers[1]).hypothesis = False
    session.flush()
    entry = new_entry(session, "declaration", "seen")
    with pytest.raises(UsageError, match="was surveyed"):
        withdraw_hypotheses(session, entry, numbers)
