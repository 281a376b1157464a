"""What a page holds of stones is what the database tells of each."""

import numpy as np
import pytest

from archmodel.database.session import open_database
from archmodel.describe.entity import describe
from pipelines.record.record import record
from pipelines.reports.page.known import known_stones
from pipelines.reports.view import database_model
from tests.paths import ROOT


@pytest.fixture(scope="module")
def codes():
    return ["V4", "W02-05", "not there", "W08-03"]


def test_columns_relations_and_points_are_those_of_the_description(session, codes):
    known = known_stones(session, codes)
    columns = {one.name: one for one in known.columns}
    for number, code in enumerate(codes):
        if code == "not there":
            assert columns["kind"].values[number] is None
            assert np.isnan(columns["depth"].values[number])
            continue
        told = describe(session, code)
        assert columns["kind"].values[number] == told["kind"]
        assert columns["depth"].values[number] == pytest.approx(told["depth"]["value"])
        assert columns["depth_source"].values[number] == told["depth"]["source"]
        own = known.points.owner == number
        assert own.sum() == told["measured"]["points"]
        assert known.points.rejected[own].sum() == len(told["measured"]["rejected"])
        for subject, object_ in known.relations.pairs[(known.relations.pairs == number).any(axis=1)].tolist():
            other = codes[object_ if subject == number else subject]
            assert any(other == one["code"] for ones in told["relations"].values() for one in ones)
    assert all(columns["rms"].unit == "m" for _ in (0,))


def test_history_names_who_recorded_what(own_url):
    record([ROOT / "data/samples/window/knowledge.toml"], own_url)
    with open_database(own_url, create=False) as database, database.session(read_only=True) as session:
        known = known_stones(session, ["V4"])
        told = describe(session, "V4")
    events = [one.what for one in known.events]
    assert any("measured" in one for one in events)
    assert sum("corrected" in one for one in events) == len(told["corrections"])
    assert sum(one.startswith("member of") for one in events) >= len(told["structures"])


def test_the_solids_of_the_database_are_those_of_the_view(session):
    model = database_model(session, "Window", "voussoir", ["depth < 0.44"])
    assert model.stones.codes
    for number, code in enumerate(model.stones.codes):
        centre = describe(session, code)["solid"]["centroid"]
        own = model.stones.vertices[model.stones.owner == number] + model.origin
        assert (own.min(axis=0) <= centre).all()
        assert (centre <= own.max(axis=0)).all()
