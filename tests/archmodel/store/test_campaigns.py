"""Stones measured twice: displacement with its standard deviation; shapes of arches."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from archmodel.database.session import Database, open_database
from archmodel.query.api import find, find_rows
from archmodel.store.arch_shapes import arch_shape
from archmodel.store.campaigns import SIGNIFICANT, FacePlace, displacement, face_place
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stones import store_survey
from ground.errors import QueryError
from tests.archmodel.stones import SHA, box_stone

SIGMA = 0.002


def measured(code: str, offset: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> StoneRecord:
    place = {"A": 0.0, "B": 1.0, "C": 2.0}[code]
    stone = box_stone(code, at=(place + offset[0], offset[1], offset[2]))
    return replace(stone, vertex_sigma=np.full_like(stone.solid_vertices, SIGMA), covariance=np.eye(3) * 1e-6)


@pytest.fixture
def twice() -> Database:
    with open_database("sqlite://") as database, database.session() as session:
        store_survey(session, "1992", "a.moma", SHA, [measured(code) for code in "ABC"])
        moved = [measured("A"), measured("B", (0.0, 0.0, -0.02))]
        store_survey(session, "2024", "b.moma", SHA[::-1], moved, again=True)
        session.commit()
        yield database


def test_what_was_measured_twice_and_moved_is_found_with_its_significance(twice: Database) -> None:
    with twice.session(read_only=True) as session:
        assert [one.code for one in find(session, "entity", ["moved_since('1992')"])] == ["B"]
        assert [one.code for one in find(session, "entity", ["not moved_since('1992')"])] == ["A"]
        assert [one.code for one in find(session, "entity", ["moved_since('1992') is null"])] == ["C"]
        assert [one.code for one in find(session, "entity", ["moved/moved_sigma > 5"])] == ["B"]
        rows = find_rows(session, "entity", ["moved_since('1992')"], columns=["moved", "moved_sigma"])
        # along the face: the mean of four corners, twice
        assert rows == [
            {"moved": pytest.approx(0.02), "moved_sigma": pytest.approx(SIGMA / 2 * 2**0.5, rel=1e-3)}
        ]
        with pytest.raises(
            QueryError, match=r"measured again since the survey '2024'; name the earlier .*: 1992"
        ):
            find(session, "entity", ["moved_since('2024')"])


def test_a_campaign_that_is_not_there_is_named(twice: Database) -> None:
    with twice.session(read_only=True) as session:
        with pytest.raises(QueryError, match="there is no survey '1993' in the database; did you mean 1992"):
            find(session, "entity", ["moved_since('1993')"])
        with pytest.raises(QueryError, match="displacements since 1992 and 2024; ask in two queries"):
            find(session, "entity", ["moved_since('1992') or moved_since('2024')"])


def test_one_in_a_hundred_stones_that_did_not_move_is_taken_to_have_moved() -> None:
    """With exact planes and corners the threshold is that of three independent components."""
    chance = np.random.default_rng(5)
    covariance = np.diag([1.0, 4.0, 9.0]) * 1e-6
    places = chance.multivariate_normal(np.zeros(3), covariance, (2, 20_000))
    found = [
        displacement(*(FacePlace(place, covariance, np.eye(3)[2]) for place in (one, other))).significant
        for one, other in zip(*places, strict=True)
    ]
    assert np.mean(found) == pytest.approx(0.01, abs=0.003)
    assert pytest.approx(11.345, rel=1e-3) == SIGNIFICANT**2


def test_the_place_of_a_face_is_the_centroid_of_its_area() -> None:
    """A corner more on an edge changes nothing; a turned plane is less certain away from its centroid."""
    square = np.array([[0.0, 0, 0], [0.4, 0, 0], [0.4, 0, 0.4], [0.0, 0, 0.4]])
    fifth = np.insert(square, 1, [0.1, 0.0, 0.0], axis=0)
    normal, axes = np.array([0.0, -1.0, 0.0]), np.array([[1.0, 0, 0], [0, 0, 1.0]])
    covariance = np.diag([1e-4, 1e-4, 1e-6])

    def place(outline: np.ndarray, centroid: np.ndarray) -> FacePlace:
        return face_place(outline, normal, centroid, axes, covariance, np.full(outline.shape, SIGMA))

    middle = np.array([0.2, 0.0, 0.2])
    assert place(square, middle).centroid == pytest.approx(middle)
    assert place(fifth, middle).centroid == pytest.approx(middle)
    assert place(square, middle).covariance[1, 1] == pytest.approx(1e-6)
    aside = place(square, middle - [0.1, 0.0, 0.0])
    assert aside.covariance[1, 1] == pytest.approx(1e-6 + 1e-4 * 0.1**2)
    assert aside.covariance[0, 0] == pytest.approx(SIGMA**2 / 4)


@pytest.mark.parametrize(
    ("rise", "lean"), [(0.5, 0.0), (0.25, 0.0), (0.5, 0.7)], ids=["round", "segmental", "in an oblique wall"]
)
def test_rise_and_span_of_an_arch_are_those_of_its_intrados(rise: float, lean: float) -> None:
    """Nine voussoirs of an arch of 2 m of clear width, with springers beside it."""
    radius = (rise**2 + 0.25) / (2 * rise) * 2.0
    half = np.arcsin(1.0 / radius)
    angles = np.linspace(-half, half, 10)
    across, up = np.array([np.cos(lean), np.sin(lean), 0.0]), np.array([0.0, 0.0, 1.0])

    def point(angle: float, depth: float) -> np.ndarray:
        distance = radius + depth
        return 3.0 + distance * np.sin(angle) * across + (distance * np.cos(angle) + 5.0) * up

    outlines = [
        np.array([point(one, 0.0), point(one, 0.4), point(two, 0.4), point(two, 0.0)])
        for one, two in pairwise(angles)
    ]
    normal = np.array([np.sin(lean), -np.cos(lean), 0.0])
    found = arch_shape(outlines, [normal] * len(outlines))
    assert found is not None
    assert found.span == pytest.approx(2.0, rel=1e-9)
    assert found.rise == pytest.approx(2.0 * rise, rel=1e-9)
    assert arch_shape([], []) is None
