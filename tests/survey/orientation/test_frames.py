"""Rotations, frames, lengths and small formats by hand: places that are known, and derivatives by differences."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from survey.orientation.bundle import lengths
from survey.orientation.bundle.statistics import Statistics
from survey.orientation.formats.local_frame import LocalFrame
from survey.orientation.network import Camera
from survey.orientation.projection import corrected, directions, project
from survey.orientation.rotations import from_angles


@pytest.mark.parametrize("seed", range(3))
def test_three_angles_turn_one_after_another(seed):
    omega, phi, kappa = np.random.default_rng(seed).uniform(-1.5, 1.5, 3)
    # R₁(ω) R₂(φ) R₃(κ): turns about the axes that move along
    assert from_angles(omega, phi, kappa) == pytest.approx(
        Rotation.from_euler("XYZ", [omega, phi, kappa]).as_matrix()
    )


def camera(pixel=0.01, forward=False, inner=(20.0, 5.0, 3.0)):
    return Camera("c", np.array([*inner, *np.zeros(7)]), (1000, 600), pixel, forward=forward)


@pytest.mark.parametrize("forward", [False, True])
def test_a_pinhole_shows_a_point_where_proportion_says(forward):
    # 20 mm behind the hole; 2 m to the right, 1 m up, 10 m away: 4 and 2 mm from the principal point
    found = project(
        camera(forward=forward), np.eye(3), np.zeros(3), np.array([[2.0, 1.0, -10.0], [0.0, 0.0, 10.0]])
    )
    assert found[0] == pytest.approx([(5.0 + 4.0) / 0.01, (3.0 - 2.0) / 0.01])
    assert np.isnan(found[1]).all()
    assert corrected(camera(forward=forward), found[:1])[0] == pytest.approx([4.0, 2.0])
    assert directions(camera(forward=forward), found[:1])[0] == pytest.approx([4.0, 2.0, -20.0])


@pytest.mark.parametrize("forward", [False, True])
def test_affinity_and_skew_and_distortion_come_off_again(forward):
    inner = np.array([20.0, 5.0, 3.0, 0.02, 0.01, 1e-4, -2e-6, 1e-8, 2e-4, -3e-4])
    made = Camera("c", inner, (1000, 600), 0.01, forward=forward)
    points = np.array([[2.0, 1.0, -10.0], [-1.5, 0.4, -8.0], [0.3, -1.2, -9.0]])
    ideal = -20.0 * points[:, :2] / points[:, 2:]
    shown = project(made, np.eye(3), np.zeros(3), points)
    assert corrected(made, shown) == pytest.approx(ideal, abs=1e-9)
    assert np.abs(shown - project(camera(forward=forward), np.eye(3), np.zeros(3), points)).max() > 1.0


def test_degrees_are_as_long_on_the_ellipsoid_as_tables_say():
    """At 48° N a degree of latitude is 111.2 km long (111,200 m), one of longitude 74.6 km (74,627 m)."""
    frame = LocalFrame(np.array([11.0, 48.0, 0.0]))
    east = frame.place(np.array([11.001, 48.0, 0.0]))
    north = frame.place(np.array([11.0, 48.001, 0.0]))
    assert east[0] == pytest.approx(74.628, abs=0.01)
    assert north[1] == pytest.approx(111.200, abs=0.01)
    assert abs(east[1:]).max() < 1e-3
    assert abs(north[[0, 2]]).max() < 1e-2
    # the normal's radius of curvature, which the height adds to
    high = LocalFrame(np.array([11.0, 48.0, 1000.0]))
    more = high.place(np.array([11.001, 48.0, 1000.0]))[0] - east[0]
    assert more == pytest.approx(1000.0 * np.cos(np.radians(48.0)) * np.radians(0.001), rel=1e-3)


def test_a_pole_is_as_far_from_the_middle_as_half_of_the_minor_axis():
    frame = LocalFrame(np.array([0.0, 0.0, 0.0]))
    pole = frame.place(np.array([0.0, 90.0, 0.0]))
    assert pole == pytest.approx([0.0, 6356752.3142, -6378137.0], abs=1e-3)


def test_a_world_frame_moves_into_a_local_one():
    frame = LocalFrame(np.array([11.0, 48.0, 500.0]))
    turn, shift, scale = (
        Rotation.from_rotvec([0.1, -0.4, 0.7]).as_matrix(),
        np.array([4.1e6, 8.0e5, 4.7e6]),
        1.5,
    )
    there, moved, same = frame.moved((turn, shift, scale))
    assert there == pytest.approx(frame.axes @ turn)
    other = frame.moved((turn, shift + frame.axes[0] * 7.0, scale))[1]
    assert other - moved == pytest.approx([7.0, 0.0, 0.0], abs=1e-6)
    ground = LocalFrame(np.array([0.0, 0.0, 0.0])).moved((np.eye(3), np.array([6378137.0, 2.0, 3.0]), 1.0))[1]
    assert ground == pytest.approx([2.0, 3.0, 0.0], abs=1e-6)
    assert same == 1.5


@pytest.mark.parametrize("up", [(0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, -0.8, -0.6), (0.0, 0.0, -1.0)])
def test_the_smallest_turn_takes_a_direction_upright(up):
    turn = lengths._upright(np.array(up))
    assert turn @ up == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    assert turn @ turn.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1.0)
    # by the angle between both
    assert np.trace(turn) == pytest.approx(1.0 + 2.0 * up[2])


POINTS = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [0.0, 1.0, 2.0], [1.0, 1.0, 5.0]])


def network(bars=(), plumb=()):
    return SimpleNamespace(
        bars=tuple(SimpleNamespace(points=pair, length=length, sigma=sigma) for pair, length, sigma in bars),
        plumb_lines=tuple(SimpleNamespace(points=chosen, sigma=sigma) for chosen, sigma in plumb),
    )


def unknowns(points=POINTS, free=None):
    return SimpleNamespace(point=points, free=np.ones(len(points), bool) if free is None else free)


def test_bars_and_plumb_lines_are_off_by_what_they_measure():
    about = network([((0, 1), 5.1, 0.01)], [((2, 3), 0.02)])
    off, moves, sigma = lengths._observed(about, unknowns())
    assert off == pytest.approx([0.1, -1.0, 0.0])
    assert sigma.tolist() == [0.01, 0.02, 0.02]
    assert moves[1, :, 0] == pytest.approx([0.6, 0.8, 0.0])
    # derivatives of what is computed, by differences
    for point in range(4):
        for axis in range(3):
            moved = POINTS.copy()
            moved[point, axis] += 1e-6
            change = (off - lengths._observed(about, unknowns(moved))[0]) / 1e-6
            assert moves[point, axis] == pytest.approx(change, abs=1e-5)
    held = lengths._observed(about, unknowns(free=np.array([True, False, True, True])))[1]
    assert not held[1].any()


def test_a_block_comes_to_its_bars_and_lines_by_a_similarity():
    from collections import namedtuple

    made = namedtuple("Unknowns", "rotation station point free")(
        np.eye(3)[None], np.array([[0.0, -5.0, 1.0]]), POINTS, np.ones(4, bool)
    )
    about = network([((0, 1), 10.0, 0.01), ((0, 2), 2.0 * np.sqrt(5.0), 0.01)], [((2, 3), 0.02)])
    found = lengths._near(about, SimpleNamespace(datum=True), made)
    rise = found.point[3] - found.point[2]
    assert rise[:2] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert rise[2] == pytest.approx(2.0 * np.sqrt(10.0))
    # the middle stays, and the camera sees the same
    assert found.point.mean(axis=0) == pytest.approx(POINTS.mean(axis=0))
    before = (POINTS - made.station[0]) @ made.rotation[0]
    after = (found.point - found.station[0]) @ found.rotation[0]
    assert after == pytest.approx(2.0 * before)
    assert lengths._near(about, SimpleNamespace(datum=False), made) is made


def test_what_bars_and_lines_determine_is_free_of_marks():
    columns = [lengths.SIMILARITY.index(name) for name in ("rx", "ry", "scale")]
    free = SimpleNamespace(datum=True)
    assert lengths._free_columns(network([((0, 1), 1.0, 0.1)], [((2, 3), 0.1)]), free) == columns
    assert lengths._free_columns(network([((0, 1), 1.0, 0.1)]), free) == columns[2:]
    assert lengths._free_columns(network([((0, 1), 1.0, 0.1)]), SimpleNamespace(datum=False)) == []


def test_of_two_bars_that_contradict_each_other_each_misses_by_half_and_is_as_sure_as_their_mean(monkeypatch):
    """Points are exact but for their scale: of two equal bars, residuals have the variance σ²/2."""
    points = np.array([[0.0, 0, 0], [5, 0, 0], [0, 2, 0], [5, 2, 0]])
    about = network([((0, 1), 5.04, 0.01), ((2, 3), 4.96, 0.01)])
    monkeypatch.setattr(lengths, "_covariances", lambda *_: (np.zeros((2, 6)), np.zeros((4, 2, 3))))
    monkeypatch.setattr(lengths, "inner_constraints", lambda *_: np.zeros((6, len(lengths.SIMILARITY))))
    found = lengths.fit_lengths(about, SimpleNamespace(datum=True), unknowns(points), np.zeros((6, 6)))
    assert found is not None
    off, test, redundancy, square = list(vars(found).values())[:4]
    assert off == pytest.approx([0.04, -0.04])
    assert test == pytest.approx([4.0 * np.sqrt(2.0)] * 2)
    assert (redundancy, square) == (1, pytest.approx(32.0))


def test_what_marks_can_find_follows_from_their_redundancy():
    """A blunder of 4.13 σ over the root of the redundancy is found with 80 % (Baarda)."""
    parts = np.array([[0.25, 1.0], [0.0, 0.04]])
    residuals = np.array([[1.0, -2.0], [3.0, 0.1]])
    reach = np.full((2, 2), 0.01)
    made = Statistics(4, 1.0, None, None, residuals, parts, reach)
    assert made.standardised == pytest.approx(np.array([[2.0, -2.0], [0.0, 0.5]]))
    detectable = made.detectable
    assert detectable[0] == pytest.approx([2.0 * detectable[0, 1], detectable[0, 1]])
    assert detectable[0, 1] == pytest.approx(4.13, abs=0.01)
    assert detectable[1] == pytest.approx([np.inf, 5.0 * detectable[0, 1]])
    assert made.external[0] == pytest.approx(0.01 * detectable[0])
