"""Depths that are known better: the measured face is extruded anew, and what was held before is kept."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import select

from archmodel.assertions.statements import Remark
from archmodel.database.session import open_database
from archmodel.describe.entity import describe
from archmodel.store.revisions import RowCounts
from archmodel.tables.entities import Entity
from archmodel.tables.entries import held_at, new_entry
from archmodel.tables.knowledge import Correction, DepthEvidence
from archmodel.tables.surveys import Measurement
from ground.errors import UsageError
from pipelines.ingest.ingest import ingest
from pipelines.record.depth import record_depth
from tests.paths import ROOT

SAMPLE = ROOT / "data/samples/window/window.moma"
CODE = "W06-06"


@pytest.fixture
def url(new_url: Callable[[], str], tmp_path: Path) -> str:
    """A database with a few stones of the sample."""
    head, *stones = SAMPLE.read_text(encoding="utf-8").split("\nstone ")
    some = [one for one in stones if one.startswith(("W06-05", CODE, "W06-07"))]
    (tmp_path / "three.moma").write_text("\nstone ".join([head, *some]), encoding="utf-8")
    made = new_url()
    ingest([tmp_path / "three.moma"], made)
    return made


def test_the_solid_follows_the_depth(url: str) -> None:
    with open_database(url) as database:
        with database.session() as session:
            before = session.scalars(select(Entity).where(Entity.code == CODE)).one()
            old = {
                name: getattr(before, name) for name in ("depth", "volume", "area", "x", "y", "z", "length")
            }
            entry = new_entry(session, "correction", "drill hole", author="A")
            remark = Remark("measured in a drill hole")
            outcome = record_depth(session, entry, [CODE], 0.6, 0.01, remark)
            assert outcome == RowCounts(new=1, replaced=1)
            assert record_depth(session, entry, [CODE], 0.6, 0.01, remark) == RowCounts(unchanged=1)
            number = entry.id
        with database.session(read_only=True) as session:
            stone = session.scalars(select(Entity).where(Entity.code == CODE)).one()
            rows = session.scalars(
                select(Measurement).where(Measurement.entity_id == stone.id).order_by(Measurement.id)
            ).all()
            corrected = {
                one.attribute: (one.before, one.after)
                for one in session.scalars(select(Correction).where(Correction.entry_id == number))
            }
            (said,) = session.scalars(select(DepthEvidence))
            then = describe(session, CODE, number - 1)
    assert (stone.depth, stone.depth_sigma, stone.depth_source) == (0.6, 0.01, "measured in a drill hole")
    # the face is square to the extrusion: the volume is that of a prism
    assert stone.volume == pytest.approx(old["volume"] * 0.6 / 0.5, rel=1e-9)
    assert (stone.area, stone.length) == (old["area"], old["length"])
    first, second = rows
    # the centroid moves into the wall by half of what the stone became deeper
    moved = np.array([stone.x, stone.y, stone.z]) - [old["x"], old["y"], old["z"]]
    assert moved == pytest.approx(-0.05 * first.normal, abs=1e-9)
    assert (first.superseded_id, second.entry_id, second.superseded_id) == (number, number, None)
    assert np.array_equal(first.points, second.points)
    assert first.normal == pytest.approx(second.normal, abs=1e-12)
    assert (first.survey_id, first.line) == (second.survey_id, second.line)
    assert corrected["depth"] == (0.5, 0.6)
    assert corrected["volume"] == (old["volume"], stone.volume)
    assert set(corrected) == {"depth", "depth_sigma", "depth_source", "depth_origin", "volume", "x", "y", "z"}
    assert (said.value, said.sigma) == (0.6, 0.01)
    assert then["depth"]["value"] == 0.5  # type: ignore[index]
    assert then["solid"]["volume"] == old["volume"]  # type: ignore[index]


def test_a_stone_without_a_measured_face_has_no_solid_to_follow(url: str) -> None:
    with open_database(url) as database, database.session() as session:
        entry = new_entry(session, "correction", "drill hole")
        session.add(Entity(kind="infill", code="CORE", entry_id=entry.id))
        session.flush()
        with pytest.raises(UsageError, match="CORE was not measured; ingest a survey of its face first"):
            record_depth(session, entry, ["CORE"], 0.3)


def test_the_depth_of_a_surveyed_solid_stays(url: str) -> None:
    with open_database(url) as database, database.session() as session:
        entry = new_entry(session, "correction", "drill hole")
        held = session.scalars(
            select(Measurement).join(Entity).where(Entity.code == CODE, held_at(Measurement))
        ).one()
        held.provenance = "solid"
        session.flush()
        with pytest.raises(UsageError, match=f"the depth of {CODE} is that of its solid, which was surveyed"):
            record_depth(session, entry, [CODE], 0.3)
