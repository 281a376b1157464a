"""Departure of faces from plane and plumb: what leans, bulges or comes forward, and which stones stand out."""

import math

import numpy as np
import pytest

from survey.quality.departures.faces import FaceMovement, WallFace, find_face_departures
from survey.quality.facades import facades_of
from survey.quality.precision import StoneQuality
from tests.survey.quality.departures.walls_by_hand import Shift, wall
from tests.survey.quality.plain_stones import polygon_stone

HEIGHT = 2.1  # between the middles of the lowest and the highest of eight courses [m]


def face_of(stones: list[StoneQuality]) -> WallFace:
    (face,) = find_face_departures(stones, facades_of(stones), 0.003)
    return face


def only(stones: list[StoneQuality]) -> FaceMovement:
    (movement,) = face_of(stones).movements
    return movement


def up(course: int) -> float:
    """Height of the middle of a course above that of the lowest over that of the wall [-]."""
    return (course - 1) * 0.3 / HEIGHT


def foot(course: int) -> float:
    """Height of the middle of a course above the foot of the wall, over that of the highest [-]."""
    return (course - 0.5) * 0.3 / (HEIGHT + 0.15)


def test_a_wall_at_rest_is_plumb_and_plane() -> None:
    stones = wall(1)
    face = face_of(stones)
    assert (face.movements, face.odd) == ((), ())
    assert face.scatter == pytest.approx(0.002, rel=0.3)
    assert abs(face.lean) < 4.0 * face.lean_sigma < 0.004
    assert len(face.stones) == len(stones) == len(face.plane) == len(face.plumb)
    assert face.plane.std() == pytest.approx(math.hypot(0.002, 0.002), rel=0.2)
    assert face.excluded is not None
    assert face.excluded_stone is not None
    assert face.excluded < 0.006 < face.excluded_stone < 0.025


@pytest.mark.parametrize("amount", [0.02, -0.02])
def test_a_rotated_facade_leans(amount: float) -> None:
    stones = wall(2, out=lambda s, c: amount * up(c))
    one = only(stones)
    assert one.kind == "lean"
    assert abs(one.amount - amount) < 3.5 * one.sigma < 0.005
    assert f"leans {'outwards' if amount > 0 else 'inwards'}" in one.text
    assert one.high - one.low == pytest.approx(HEIGHT, abs=0.03)
    face = face_of(stones)
    assert face.lean == pytest.approx(math.atan(amount / HEIGHT), abs=3.5 * face.lean_sigma)
    # out of plumb, but not out of its plane
    assert face.plane.std() < 0.004 < face.plumb.std()


@pytest.mark.parametrize(
    ("out", "kind", "amount", "words"),
    [
        (lambda s, c: 0.02 * (1 - (2 * up(c) - 1) ** 2), "bulge", 0.02, "it bulges by"),
        (lambda s, c: -0.02 * (1 - (2 * up(c) - 1) ** 2), "bulge", -0.02, "is hollow by"),
        (lambda s, c: 0.02 * (1 - (s / 2.9 - 1) ** 2), "bow", 0.02, "bows outwards"),
        (lambda s, c: 0.02 if s > 3.0 else 0.0, "offset", 0.02, "its right part"),
        (lambda s, c: -0.03 if c > 4 else 0.0, "setback", -0.03, "up it stands"),
        (lambda s, c: 0.03 * max(s - 3.5, 0) / 2.2 * up(c), "right corner", 0.03, "its right corner"),
        (lambda s, c: 0.03 * max(2.2 - s, 0) / 2.2 * up(c), "left corner", 0.03, "its left corner"),
        (lambda s, c: 0.03 * max(s - 3.5, 0) / 2.2, "right end", 0.03, "its right end"),
        (lambda s, c: 0.03 * max(2.2 - s, 0) / 2.2, "left end", 0.03, "its left end"),
        (lambda s, c: 0.03 * (s < 2.0) * foot(c), "leaning part", 0.03, "leans outwards as one"),
        (lambda s, c: -0.03 * (s > 4.1) * foot(c), "leaning part", -0.03, "leans inwards as one"),
        (lambda s, c: 0.03 * (2.0 < s < 4.0) * foot(c), "leaning part", 0.03, "leans outwards as one"),
        (
            lambda s, c: 0.03 * math.cos(min(math.hypot(s - 2, 0.3 * (c - 4)) / 1.2, 1) * math.pi / 2) ** 2,
            "local bulge",
            0.03,
            "m up",
        ),
    ],
)
def test_every_shape_has_its_name(out: Shift, kind: str, amount: float, words: str) -> None:
    one = only(wall(4, out=out, faces=0.001, sigma=0.001))
    assert one.kind == kind
    assert one.amount == pytest.approx(amount, abs=0.005)
    assert words in one.text
    assert one.probability < 1e-6


def test_stones_at_the_crack_of_a_leaning_part_are_not_odd() -> None:
    """The crack goes around the stones, to the right in one course and to the left in the next."""
    face = face_of(
        wall(15, out=lambda s, c: 0.025 * (s < 2.0 + 0.3 * (-1) ** c) * foot(c), faces=0.001, sigma=0.001)
    )
    (one,) = face.movements
    assert one.kind == "leaning part"
    assert abs(one.amount - 0.025) < 3.0 * one.sigma < 0.003
    assert face.odd == ()


def test_a_bulge_beside_an_edge_ends_where_the_wall_ends() -> None:
    (one,) = face_of(wall(16, out=lambda s, c: 0.04 * math.exp(-(s**2 + (0.3 * c - 2.4) ** 2)))).movements[:1]
    assert -3.0 <= one.left < one.right <= 3.0
    assert 0.0 <= one.low < one.high <= 2.4


@pytest.mark.parametrize(("amount", "sort"), [(0.03, "proud"), (-0.03, "sunk"), (0.25, "proud")])
def test_a_stone_out_of_the_face_is_named(amount: float, sort: str) -> None:
    stones = wall(5, out=lambda s, c: amount if c == 4 and abs(s - 2.75) < 0.1 else 0.0, line=9)
    face = face_of(stones)
    (odd,) = face.odd
    assert (odd.code, odd.sort, odd.line) == ("4-6", sort, 9)
    assert abs(odd.amount - amount) < 4.0 * odd.sigma < 0.016
    assert f"stands {sort} by {abs(odd.amount) * 1e3:.0f} ± {odd.sigma * 1e3:.0f} mm" in odd.text
    assert face.movements == ()
    # its neighbours and the plane of the wall are as they were
    assert face.lean == pytest.approx(face_of(wall(5)).lean, abs=face.lean_sigma)


def test_thirty_millimetres_on_a_wall_of_one_are_told_beside_a_bulge() -> None:
    bulge = wall(
        6,
        out=lambda s, c: 0.05 * (1 - (2 * up(c) - 1) ** 2) + 0.03 * (c == 6 and abs(s - 1.25) < 0.1),
        faces=0.001,
        sigma=0.001,
    )
    face = face_of(bulge)
    assert [one.code for one in face.odd] == ["6-3"]
    assert [one.kind for one in face.movements] == ["bulge"]


def test_a_turned_stone_is_named_by_its_angle() -> None:
    stones = wall(7, tilt_sigma=0.3)
    angle = math.radians(5.0)
    rng = np.random.default_rng(1)
    for k, one in enumerate(stones):
        yaw, pitch = rng.normal(0.0, math.radians(0.3), 2) + ([angle, 0.0] if k == 30 else [0.0, 0.0])
        one.normal[:] = [math.sin(yaw), -math.cos(yaw), math.sin(pitch)]
        one.normal[:] /= np.linalg.norm(one.normal)
    (odd,) = face_of(stones).odd
    assert (odd.code, odd.sort) == (stones[30].code, "turned")
    assert odd.amount == pytest.approx(angle, abs=4.0 * odd.sigma)
    assert "is turned by" in odd.text
    assert "°" in odd.text


def test_rough_masonry_has_wide_limits() -> None:
    smooth, rough = (face_of(wall(8, faces=scatter)) for scatter in (0.001, 0.01))
    assert smooth.excluded_stone is not None
    assert rough.excluded_stone is not None
    assert rough.excluded_stone > 3.0 * smooth.excluded_stone
    proud = wall(8, faces=0.01, out=lambda s, c: 0.02 if c == 4 and abs(s - 2.75) < 0.1 else 0.0)
    assert face_of(proud).odd == ()


def test_a_buttress_is_a_wall_of_its_own() -> None:
    stones = wall(9, out=lambda s, c: 0.4 if s > 4.0 else 0.0)
    faces = find_face_departures(stones, facades_of(stones), 0.003)
    assert len(faces) == 2
    assert sum(len(one.stones) for one in faces) == len(stones)
    assert all(one.odd == () and one.movements == () for one in faces)


def test_what_projects_by_design_and_what_was_not_measured_is_left_out() -> None:
    stones = wall(10)
    cornice = [
        polygon_stone(f"c{k}", "cornice", one.outline[:, [0, 2]], normal=one.normal, course=9)
        for k, one in enumerate(stones[-4:])
    ]
    solid = polygon_stone("s", "ashlar", stones[0].outline[:, [0, 2]], source="solid", offset_sigma=0.0)
    every = [*stones, *cornice, solid]
    assert len(face_of(every).stones) == len(stones)


def test_points_that_were_left_out_make_a_place_less_certain() -> None:
    stones = wall(11, faces=0.0, out=lambda s, c: 0.0095 if c == 4 and abs(s - 2.75) < 0.1 else 0.0)
    assert [one.code for one in face_of(stones).odd] == ["4-6"]
    doubted = wall(
        11,
        faces=0.0,
        out=lambda s, c: 0.0095 if c == 4 and abs(s - 2.75) < 0.1 else 0.0,
        worn=("corner 1", "corner 2"),
        blunders=("point 1",) * 3,
    )
    assert face_of(doubted).odd == ()


def test_a_frame_that_may_lean_shows_no_lean() -> None:
    stones = wall(12, out=lambda s, c: 0.01 * up(c))
    facades = facades_of(stones)
    assert [one.kind for one in find_face_departures(stones, facades, 0.003)[0].movements] == ["lean"]
    (shaken,) = find_face_departures(stones, facades, 0.003, {"facade 1": 0.01})
    assert shaken.movements == ()
    assert shaken.lean_sigma > 0.01


def test_what_is_excluded_would_have_been_found() -> None:
    found = stone = 0
    for seed in range(12):
        face = face_of(wall(seed))
        assert face.excluded is not None
        assert face.excluded_stone is not None
        bulging = wall(seed, out=lambda s, c, size=face.excluded: size * (1 - (2 * up(c) - 1) ** 2))  # type: ignore[misc]
        found += bool(face_of(bulging).movements)
        proud = wall(
            seed,
            out=lambda s, c, size=face.excluded_stone: size if c == 4 and abs(s - 2.75) < 0.1 else 0.0,  # type: ignore[misc]
        )
        stone += [one.code for one in face_of(proud).odd] == ["4-6"]
    assert found >= 10
    assert stone >= 9


def test_nineteen_of_twenty_movements_of_the_size_that_is_excluded_are_found() -> None:
    """Of those that just reach the critical value half are found."""
    shapes = (lambda c: 1.0 - (2.0 * (c - 1) / 4.0 - 1.0) ** 2, lambda c: (c - 1) / 4.0)
    found = 0
    for seed in range(10):
        size = face_of(wall(seed, courses=5, length=4.0)).excluded
        assert size is not None
        for shape in shapes:
            moved = wall(
                seed,
                courses=5,
                length=4.0,
                out=lambda s, c, size=size, shape=shape: size * shape(c),  # type: ignore[misc]
            )
            found += bool(face_of(moved).movements)
    assert found >= 17


def test_a_facade_without_enough_stones_is_not_judged() -> None:
    stones = wall(13, courses=1, length=2.0)
    assert find_face_departures(stones, facades_of(stones), 0.003) == ()


def test_toothed_faces_are_not_given_movements() -> None:
    """The end of a vault: every second row stands 8 cm back."""
    for faces in (0.0, 0.003):
        face = face_of(wall(14, out=lambda s, c: -0.08 * (int(s / 0.5) % 2), faces=faces, sigma=0.0005))
        assert face.movements == ()
        assert face.excluded is None or face.excluded > 0.05


def test_less_than_a_millimetre_is_not_told_and_no_sigma_is_nothing() -> None:
    """Of exact faces, as programs make them."""
    exact = {"faces": 0.0, "sigma": 0.0}
    tiny = face_of(
        wall(17, out=lambda s, c: 0.0005 * up(c) + 0.0004 * (c == 4 and abs(s - 2.75) < 0.1), **exact)
    )  # type: ignore[arg-type]
    assert (tiny.movements, tiny.odd) == ((), ())
    (lean,) = face_of(wall(17, out=lambda s, c: 0.0262 * up(c), **exact)).movements  # type: ignore[arg-type]
    assert "± 0.1 mm over" in lean.text
    (odd,) = face_of(wall(17, out=lambda s, c: 0.01 * (c == 4 and abs(s - 2.75) < 0.1), **exact)).odd  # type: ignore[arg-type]
    assert "proud by 10 ± 1 mm" in odd.text
