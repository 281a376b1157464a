"""Faces as GeoJSON: rings, properties, and polygons in the plane of a wall."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from archmodel.database.session import Database
from archmodel.query.api import FoundFace, find_faces
from archmodel.query.geojson import feature_collection, flattened
from ground.errors import UsageError
from tests.archmodel.conftest import WALL

SQUARE = np.array([[0.0, 0, 0], [2, 0, 0], [2, 0, 1], [0, 0, 1]])


def turned(angle: float, tilt: float = 0.0) -> FoundFace:
    """A face of 2 m × 1 m, looking to negative y, turned about the vertical and then leaning backwards [rad]."""
    lean = np.array([[1, 0, 0], [0, math.cos(tilt), math.sin(tilt)], [0, -math.sin(tilt), math.cos(tilt)]])
    turn = np.array(
        [[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]]
    )
    rotation = turn @ lean
    return FoundFace(
        SQUARE @ rotation.T, rotation @ np.array([0.0, -1.0, 0.0]), {"code": f"{math.degrees(angle):.0f}"}
    )


def signed_area(ring: NDArray[np.float64]) -> float:
    x, y = ring.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def test_faces_are_those_that_were_measured(filled: Database) -> None:
    with filled.session(read_only=True) as session:
        faces = find_faces(session, "entity", "depth > 0.4", columns=["code", "depth"])
    collection = json.loads(json.dumps(feature_collection(faces)))
    assert collection["type"] == "FeatureCollection"
    stones = [stone for stone in WALL if stone.depth > 0.4]
    assert [feature["id"] for feature in collection["features"]] == [stone.code for stone in stones]
    for feature, stone in zip(collection["features"], stones, strict=True):
        (ring,) = feature["geometry"]["coordinates"]
        assert feature["geometry"]["type"] == "Polygon"
        assert ring[0] == ring[-1]
        np.testing.assert_allclose(ring[:-1], stone.outline, atol=1e-6)
        assert feature["properties"] == {"code": stone.code, "depth": stone.depth}


def test_what_was_not_measured_has_no_geometry() -> None:
    (feature,) = feature_collection([FoundFace(None, None, {"code": "X"})])["features"]  # type: ignore[misc]
    assert feature == {"type": "Feature", "id": "X", "geometry": None, "properties": {"code": "X"}}
    assert flattened([FoundFace(None, None, {})])[0].outline is None
    assert flattened([]) == []


@given(st.floats(-math.pi, math.pi), st.floats(-0.4, 0.4))
def test_a_flat_face_has_its_own_area_and_goes_counter_clockwise(angle: float, tilt: float) -> None:
    (face,) = flattened([turned(angle, tilt)])
    assert face.outline is not None
    assert face.outline.shape == (4, 2)
    assert signed_area(face.outline) == pytest.approx(2.0)
    np.testing.assert_allclose(np.ptp(face.outline, axis=0), [2.0, 1.0])


def test_on_an_upright_wall_v_is_the_height_and_u_goes_to_the_right() -> None:
    (face,) = flattened([turned(0.0)])
    np.testing.assert_allclose(face.outline, SQUARE[:, [0, 2]], atol=1e-12)  # type: ignore[arg-type]
    (face,) = flattened([turned(math.pi)])  # seen from the other side, u is -x
    np.testing.assert_allclose(face.outline, SQUARE[:, [0, 2]], atol=1e-12)  # type: ignore[arg-type]
    assert face.outline is not None


def test_a_paving_keeps_its_plan() -> None:
    plan = np.array([[1.0, 2, 0.1], [3, 2, 0.1], [3, 5, 0.1], [1, 5, 0.1]])
    (face,) = flattened([FoundFace(plan, np.array([0.0, 0.0, 1.0]), {"code": "P"})])
    np.testing.assert_allclose(face.outline, plan[:, :2])  # type: ignore[arg-type]


def test_faces_of_one_wall_may_look_a_little_apart() -> None:
    faces = [turned(math.radians(angle)) for angle in (-25.0, 0.0, 25.0)]
    assert len(flattened(faces)) == 3


@pytest.mark.parametrize("angles", [(0, 0, 0, 90), (0, 180), (0, 120, 240), (0, 0, 45)])
def test_faces_of_several_walls_are_refused(angles: tuple[int, ...]) -> None:
    faces = [turned(math.radians(angle)) for angle in angles]
    with pytest.raises(
        UsageError, match=r"--flat: the face of \d+ looks \d+° away .* select the stones of one wall"
    ):
        flattened(faces)
