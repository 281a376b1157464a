"""Planes and cylinders of located points by hand: where rays meet them, how they follow their points, what they say."""

from types import SimpleNamespace

import numpy as np
import pytest

from ground.errors import GeometryError
from survey.orientation.stones import surfaces
from survey.orientation.stones.located import Located
from survey.orientation.stones.surfaces import fit_surface

FRONT = np.array([0.0, -10.0, 0.0])
AXIS = np.array([0.0, 0.0, 1.0])


def located(places, sigma=0.001):
    """Points with errors of their own alone."""
    return [
        Located(f"p{k}", np.array(place, float), np.zeros((3, 6)), {f"p{k}": sigma * np.eye(3)}, (), "")
        for k, place in enumerate(places)
    ]


def oriented():
    """An orientation without errors, of which fits ask for no more than its covariance."""
    return SimpleNamespace(covariance=np.zeros((6, 6)))


def arc(radius=2.0, degrees=(-100.0, 100.0), rows=4, columns=9, centre=(1.0, 3.0, 0.0), off=0.0):
    """Places on an upright cylinder, seen from negative y."""
    turn = np.radians(np.linspace(*degrees, columns)) - 0.5 * np.pi
    heights = np.linspace(-1.0, 1.0, rows)
    rng = np.random.default_rng(3)
    out = []
    for height in heights:
        for angle in turn:
            far = radius + off * rng.normal()
            out.append(np.array(centre) + np.array([far * np.cos(angle), far * np.sin(angle), height]))
    return np.array(out)


def cylinder(**more):
    return fit_surface("cylinder", located(arc(**more)), oriented(), FRONT)


def test_a_cylinder_has_the_axis_and_the_radius_of_its_points():
    found = cylinder()
    assert found.radius == pytest.approx(2.0, abs=1e-6)
    assert abs(found.axis @ AXIS) == pytest.approx(1.0, abs=1e-9)
    assert found.centre == pytest.approx([1.0, 3.0, 0.0], abs=1e-6)
    assert found.sigma == pytest.approx(np.full(36, 0.001))
    assert "radius 2.000 m of 36 points, rms 0.0 mm" in found.text
    assert found.scatter == pytest.approx(0.0, abs=1e-6)


def test_points_that_scatter_more_than_they_are_precise_tell_of_the_faces():
    found = cylinder(off=0.01)
    residual = np.linalg.norm(np.cross(arc(off=0.01) - found.centre, found.axis), axis=1) - found.radius
    assert found.scatter == pytest.approx(0.01, rel=0.3)
    assert f"rms {1e3 * np.sqrt((residual**2).mean()):.1f} mm" in found.text
    assert f"faces within {1e3 * found.scatter:.1f} mm of it" in found.text


def test_the_scatter_is_what_is_left_of_the_variance():
    off, sigma = np.array([3.0, -4.0, 0.0, 5.0]), np.full(4, 2.0)
    assert surfaces._scatter(off, sigma, 2) == pytest.approx(np.sqrt(50.0 / 2.0 - 4.0))
    assert surfaces._scatter(off, np.full(4, 9.0), 2) == 0.0
    assert surfaces._scatter(off, sigma, 0) == 0.0
    assert surfaces._told(3, 0.0, 0, 0.0) == "3 points, which nothing checks"


@pytest.mark.parametrize(
    ("origin", "direction", "place"),
    [
        # from in front: the side of the points, not the one behind
        ((1.0, -10.0, 0.5), (0.0, 2.0, 0.0), (1.0, 1.0, 0.5)),
        # from within
        ((1.0, 3.0, 0.5), (0.0, -1.0, 0.0), (1.0, 1.0, 0.5)),
        # rising towards it: at the height where it is 9 m away
        ((1.0, -8.0, 0.0), (0.0, 1.0, 0.1), (1.0, 1.0, 0.9)),
        # beside it, along its axis, and away from it
        ((4.0, -10.0, 0.0), (0.0, 1.0, 0.0), None),
        ((1.0, 1.5, -9.0), (0.0, 0.0, 1.0), None),
        ((1.0, -10.0, 0.0), (0.0, -1.0, 0.0), None),
        # off its middle: x = 1 + 1.2, so y = 3 - 1.6
        ((2.2, -10.0, 0.0), (0.0, 1.0, 0.0), (2.2, 1.4, 0.0)),
    ],
)
def test_a_ray_meets_a_cylinder_where_it_comes_in(origin, direction, place):
    found = cylinder().meet(np.array(origin), np.array(direction))
    assert (found is None) == (place is None)
    if place is not None:
        assert found == pytest.approx(place, abs=1e-5)


def test_the_normal_of_a_cylinder_leads_from_its_axis():
    found = cylinder()
    assert found.normal(np.array([1.0, 0.0, 5.0])) == pytest.approx([0.0, -1.0, 0.0], abs=1e-6)
    assert found.normal(np.array([4.0, 3.0, -2.0])) == pytest.approx([1.0, 0.0, 0.0], abs=1e-6)


@pytest.mark.parametrize("kind", ["plane", "cylinder"])
def test_a_surface_follows_its_points_as_another_fit_of_moved_ones_does(kind):
    places = (
        arc(columns=5, rows=3)
        if kind == "cylinder"
        else np.array([[x, 0.2 * x, z] for x in (0.0, 0.7, 2.0) for z in (0.0, 0.4, 1.5)])
    )
    found = fit_surface(kind, located(places), oriented(), FRONT)
    at = found.meet(np.array([1.3, -10.0, 0.6]), np.array([0.0, 1.0, 0.0]))
    pull = found.pull(at)
    step = 1e-4
    for k in (0, 4, 7):
        for axis in range(3):
            moved = places.copy()
            moved[k, axis] += step
            other = fit_surface(kind, located(moved), oriented(), FRONT)
            normal = found.normal(at)
            change = other.meet(at + 5.0 * normal, -normal) - at
            assert change @ normal / step == pytest.approx(pull[k, axis], abs=2e-3)


def test_a_ray_meets_a_plane_in_front_of_its_origin_alone():
    places = [[x, 1.0, z] for x in (0.0, 2.0) for z in (0.0, 1.0)]
    found = fit_surface("plane", located(places), oriented(), FRONT)
    assert found.normal(FRONT) == pytest.approx([0.0, -1.0, 0.0])
    assert found.meet(np.array([0.5, -3.0, 0.2]), np.array([0.0, 2.0, 0.5])) == pytest.approx([0.5, 1.0, 1.2])
    assert found.meet(np.array([0.5, -3.0, 0.2]), np.array([0.0, -2.0, 0.5])) is None
    assert found.meet(np.array([0.5, -3.0, 0.2]), np.array([1.0, 0.0, 0.5])) is None
    assert found.text.startswith("the plane of 4 points")


@pytest.mark.parametrize(
    ("kind", "places", "words"),
    [
        ("plane", [[0, 0, 0], [1, 0, 0]], "2 points define no plane"),
        ("cylinder", arc()[:5], "5 points define no cylinder"),
        ("cylinder", [[x, 0.0, z] for x in range(4) for z in range(3)], "too short an arc, or are plane"),
        (
            "cylinder",
            [[x, 1e-9 * x**2, z] for x in range(4) for z in range(3)],
            "too short an arc, or are plane",
        ),
        (
            "cylinder",
            [[x, 1e-6 * x**2, z] for x in range(4) for z in range(3)],
            "too short an arc, or are plane",
        ),
        ("cylinder", arc(degrees=(-3.0, 3.0), off=0.003), "too short an arc"),
    ],
)
def test_points_that_define_no_surface_are_refused(kind, places, words):
    with pytest.raises(GeometryError, match=words):
        fit_surface(kind, located(places), oriented(), FRONT)


def test_a_circle_of_points_on_it_is_found_exactly():
    turn = np.radians([0.0, 40.0, 100.0, 170.0, 260.0])
    axis = np.array([0.6, 0.0, 0.8])
    across = surfaces._frame(axis)
    places = np.array([3.0, -1.0, 2.0]) + 1.7 * np.column_stack([np.cos(turn), np.sin(turn)]) @ across
    misfit, centre, radius = surfaces._circle(places, axis)
    assert (misfit, radius) == (pytest.approx(0.0, abs=1e-18), pytest.approx(1.7))
    assert centre - centre @ axis * axis == pytest.approx(
        np.array([3.0, -1.0, 2.0]) - np.array([3.0, -1.0, 2.0]) @ axis * axis
    )
    # a radius longer for one point by d leaves a misfit
    places[0] += 0.1 * across[0]
    assert surfaces._circle(places, axis)[0] > 1e-4


def test_starts_are_spread_over_a_half_sphere_and_the_best_come_first():
    starts = surfaces._starts(arc())
    assert len(starts) == 6
    assert abs(starts[0] @ AXIS) > np.cos(np.radians(12.0))
    assert np.linalg.norm(starts, axis=1) == pytest.approx(np.ones(6))
