import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import GeometryError, SurveyError
from survey.extrusion.depth import depth_for
from survey.extrusion.extrusion import extrude
from survey.faces.faces import outline_face
from survey.geometry.solids import volume_of
from survey.geometry.watertight import check_watertight
from survey.records.survey import BlockRecord, DepthRule

SQUARE = np.array([[0, 0, 0], [0.6, 0, 0], [0.6, 0.3, 0], [0, 0.3, 0]], dtype=float)
ABOVE = np.array([0.3, 0.1, 4.0])
RULES = (DepthRule("header", 0.5, 0.03, "guess", 7), DepthRule("jamb", 0.4, None, "plan", 8))


def record(vertices: object, points: object = (), **more: object) -> BlockRecord:
    settings = {"kind": "header", "course": 1, "sigma": 0.002, "line": 12} | more
    return BlockRecord(
        code="A",
        vertices=np.array(vertices, dtype=float),
        points=np.array(points, dtype=float).reshape(-1, 3),
        **settings,  # type: ignore[arg-type]
    )


@pytest.mark.parametrize("vertices", [SQUARE, SQUARE[::-1]])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_outline_runs_counter_clockwise_for_the_observer(vertices: np.ndarray, side: float) -> None:
    face = outline_face(record(vertices), side * ABOVE)
    centre = face.outline.mean(axis=0)
    turns = np.cross(face.outline - centre, np.roll(face.outline, -1, axis=0) - centre)
    assert (turns @ face.fit.normal > 0).all()
    assert face.fit.normal[2] * side > 0.99


def test_without_an_observer_counter_clockwise_corners_tell_the_outside() -> None:
    assert outline_face(record(SQUARE), None).fit.normal[2] == pytest.approx(1.0)
    assert outline_face(record(SQUARE[::-1]), None).fit.normal[2] == pytest.approx(-1.0)


def test_an_eroded_corner_is_left_out_and_does_not_tilt_the_plane() -> None:
    corners = SQUARE.copy()
    corners[2] = [0.57, 0.28, -0.02]
    grid = [(x, y, 0.0) for x in (0.1, 0.3, 0.5) for y in (0.05, 0.25)]
    face = outline_face(record(corners[::-1], grid), ABOVE)
    assert face.rejected_vertices == (2,)
    assert face.rejected_points == ()
    assert face.fit.rejected == (6 + 1,)
    np.testing.assert_allclose(face.outline[2], [0.57, 0.28, 0.0], atol=1e-3)
    assert np.degrees(np.arccos(face.fit.normal[2])) < 0.2


@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        (np.vstack([SQUARE, [0.3, 0.1, 0.0]])[[0, 2, 1, 3, 4]], "crosses itself"),
        (SQUARE * [1, 0, 1], "one line"),
    ],
)
def test_an_outline_that_cannot_be_is_refused_by_name(vertices: np.ndarray, words: str) -> None:
    with pytest.raises(GeometryError, match=r"stone A \(line 12\): .*" + words):
        outline_face(record(vertices), ABOVE)


def test_corners_out_of_order_are_put_in_order_if_one_order_alone_is_possible() -> None:
    face = outline_face(record(SQUARE[[0, 2, 1, 3]]), ABOVE)
    assert face.measures.area == pytest.approx(outline_face(record(SQUARE), ABOVE).measures.area)
    assert "put in order" in face.remarks[0]
    assert sorted(face.corner_of) == [0, 1, 2, 3]
    # without an observer the order also tells the outside: then it cannot be wrong
    with pytest.raises(GeometryError, match="crosses itself"):
        outline_face(record(SQUARE[[0, 2, 1, 3]]), None)


def test_corners_that_are_one_corner_are_not_an_outline() -> None:
    corners = np.vstack([SQUARE[[0, 1, 1]], SQUARE[1] + 1e-5])
    with pytest.raises(GeometryError, match="2 distinct corners"):
        outline_face(record(corners, [(0.1, 0.2, 0.0), (0.4, 0.2, 0.0), (0.3, 0.1, 0.0)]), ABOVE)


def test_a_corner_measured_twice_counts_once() -> None:
    face = outline_face(record(np.vstack([SQUARE, SQUARE[3] + 1e-5])), ABOVE)
    assert len(face.outline) == 4
    assert face.remarks == ("corners 5 were measured twice and are left out",)


def test_the_stone_s_own_depth_comes_before_the_rule_of_its_kind() -> None:
    assert depth_for(record(SQUARE), RULES).source == "guess"
    assert depth_for(record(SQUARE, kind="jamb"), RULES).sigma is None
    own = depth_for(record(SQUARE, depth=0.61, depth_sigma=0.01, depth_source="drilled"), RULES)
    assert (own.value, own.sigma, own.source, own.origin) == (0.61, 0.01, "drilled", "stone")


def test_a_stone_of_unknown_depth_is_refused_with_the_remedy() -> None:
    with pytest.raises(SurveyError, match=r"stone A \(line 12\): no depth .* sill; .*depth sill D source"):
        depth_for(record(SQUARE, kind="sill"), RULES)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(3, 9), st.booleans())
def test_any_simple_outline_extrudes_to_a_watertight_solid_of_area_times_depth(
    seed: int, count: int, dented: bool
) -> None:
    rng = np.random.default_rng(seed)
    angles = 2 * np.pi * (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / count
    radii = rng.uniform(0.2, 0.6, count) if dented else np.full(count, 0.4)
    flat = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(count)])
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    face = outline_face(record(flat @ turn.T + rng.uniform(-50, 50, 3)), None)
    block = extrude(face, depth_for(record(SQUARE), RULES))
    check_watertight(block.solid)
    area = 0.5 * abs(flat[:, 0] @ np.roll(flat[:, 1], -1) - flat[:, 1] @ np.roll(flat[:, 0], -1))
    assert volume_of(block.solid) == pytest.approx(area * 0.5, rel=1e-9)


def test_a_solid_with_a_hole_or_inside_out_is_refused_by_name() -> None:
    solid = extrude(outline_face(record(SQUARE), ABOVE), depth_for(record(SQUARE), RULES)).solid
    for faces, words in (
        (solid.faces[:-1], "not closed"),
        (tuple(f[::-1] for f in solid.faces), "inside out"),
        ((solid.faces[0][::-1], *solid.faces[1:]), "seen from outside"),
    ):
        with pytest.raises(GeometryError, match=f"stone A: .*{words}"):
            check_watertight(type(solid)("A", solid.vertices, faces))
