"""Resections, pairs, blunders and doubts of orientations by hand, from rays and networks that a test gives."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ground.errors import GeometryError, SurveyError
from survey.orientation.bundle import agreement, control, orient, resection, soundness, start
from survey.orientation.bundle.resection import essential_orientations, similarity_between
from survey.orientation.bundle.start import swapped

RNG = np.random.default_rng(5)
TURN = Rotation.from_rotvec([0.2, -0.5, 0.3]).as_matrix()
STATION = np.array([2.0, -1.0, 4.0])
POINTS = np.array(
    [[0.0, 3.0, -8.0], [4.0, -1.0, -7.0], [-3.0, -2.0, -10.0], [1.0, 0.5, -12.0], [-2.0, 4.0, -9.0]]
)


def rays_of(points, turn=TURN, station=STATION):
    """Unit rays in the axes of a camera towards points."""
    rays = (points - station) @ turn
    return rays / np.linalg.norm(rays, axis=1)[:, None]


@pytest.mark.parametrize("chosen", [(0, 1, 2), (1, 2, 4), (0, 3, 4)])
def test_three_points_give_up_to_four_stations_of_which_one_is_true(chosen):
    points = POINTS[list(chosen)]
    found = list(resection._three_point(rays_of(points), points))
    assert 1 <= len(found) <= 4
    off = [np.linalg.norm(station - STATION) + np.abs(turn - TURN).max() for turn, station in found]
    assert min(off) < 1e-6
    # every answer sees the points along the rays
    for turn, station in found:
        assert rays_of(points, turn, station) == pytest.approx(rays_of(points), abs=1e-6)


@pytest.mark.parametrize(("scaled", "mirrored"), [(True, False), (False, False), (True, True)])
def test_a_similarity_comes_back(scaled, mirrored):
    scale = 2.5 if scaled else 1.0
    side = np.diag([1.0, 1.0, -1.0]) if mirrored else np.eye(3)
    target = scale * POINTS @ (TURN @ side).T + STATION
    turn, shift, found = similarity_between(POINTS, target, scaled=scaled, mirrored=mirrored)
    assert found == pytest.approx(scale)
    assert turn == pytest.approx(TURN @ side)
    assert shift == pytest.approx(STATION)


def pair(count=40, seed=1):
    """Rays of two photographs to common points, and how the second stands to the first."""
    points = np.random.default_rng(seed).uniform([-3, -3, -12], [3, 3, -6], (count, 3))
    turn = Rotation.from_rotvec([0.05, 0.3, -0.1]).as_matrix()
    station = np.array([2.0, 0.3, 0.2])
    return rays_of(points, np.eye(3), np.zeros(3)), rays_of(points, turn, station), turn, station


def test_two_photographs_are_oriented_to_one_another_by_their_rays():
    first, second, turn, station = pair()
    found = essential_orientations(first, second)
    best, way, agreeing = found[0]
    assert agreeing == 40
    assert best == pytest.approx(turn, abs=1e-6)
    assert way == pytest.approx(station / np.linalg.norm(station), abs=1e-6)
    # what differs by less is one answer
    for k, (one, along, _) in enumerate(found):
        for other, way_, _ in found[:k]:
            assert np.trace(one.T @ other) < 2.999 or along @ way_ < 0.999


def test_an_essential_matrix_stands_for_four_orientations_of_which_one_sees_points_before_it():
    first, second, turn, station = pair()
    unit = station / np.linalg.norm(station)
    cross = np.array([[0, -unit[2], unit[1]], [unit[2], 0, -unit[0]], [-unit[1], unit[0], 0]])
    assert np.abs(np.einsum("ni,ij,nj->n", first, cross @ turn, second)).max() < 1e-12
    four = list(resection._decomposed(cross @ turn))
    assert len(four) == 4
    before = []
    for one, way in four:
        assert np.linalg.det(one) == pytest.approx(1.0)
        assert np.linalg.norm(way) == pytest.approx(1.0)
        before.append(resection._agreement(first, second, one, way)[0])
    assert sorted(before) == [0, 0, 0, 40]
    best = four[int(np.argmax(before))]
    assert best[0] == pytest.approx(turn)
    assert best[1] == pytest.approx(unit)


def test_rays_agree_by_the_angle_by_which_they_miss():
    first, second, turn, station = pair()
    unit = station / np.linalg.norm(station)
    assert resection._agreement(first, second, turn, unit)[1] < 1e-12
    normal = np.cross(unit, first)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    # rays of the second turned by 2 mrad out of their planes
    off = second @ turn.T + 0.002 * normal
    count, miss = resection._agreement(first, off @ turn, turn, unit)
    assert miss == pytest.approx(0.002, rel=1e-3)
    assert count in (0, 40)


def test_the_scale_of_tests_is_one_or_the_median_where_marks_are_worse_than_stated():
    sizes = np.abs(np.random.default_rng(2).normal(size=4001))
    assert orient._scale(sizes) == pytest.approx(1.0, abs=0.03)
    assert orient._scale(3.0 * sizes) == pytest.approx(3.0, rel=0.05)
    assert orient._scale(0.2 * sizes) == 1.0
    # what is not checked counts for nothing
    assert orient._scale(np.concatenate([3.0 * sizes, np.zeros(9000), [np.nan]])) == pytest.approx(
        3.0, rel=0.05
    )
    assert orient._scale(np.zeros(3)) == 1.0


def test_marks_are_suspected_by_the_larger_of_both_coordinates():
    tests = np.tile([[0.5, -0.6]], (50, 1))
    tests[7] = [0.1, -orient.CRITICAL - 0.1]
    tests[9] = [orient.CRITICAL - 0.1, np.nan]
    assert orient._suspects(SimpleNamespace(standardised=tests)).tolist() == [7]
    # of marks twice as bad as stated only what is twice as large
    wide = 2.0 * np.tile([[0.6745, -0.6745]], (50, 1))
    wide[7] = [0.1, -1.5 * orient.CRITICAL]
    wide[9] = [0.1, -2.1 * orient.CRITICAL]
    assert orient._suspects(SimpleNamespace(standardised=wide)).tolist() == [9]


def test_of_each_photograph_and_point_the_worst_mark_is_left_out_and_none_that_nothing_checks():
    network = SimpleNamespace(
        names=("a", "b", "c", "d"),
        photo=np.array([0, 0, 1, 1, 2, 2]),
        point=np.array([0, 1, 0, 2, 3, 2]),
        control=(SimpleNamespace(point=3, check=False), SimpleNamespace(point=1, check=True)),
    )
    rays = np.array([3, 2, 3, 2])
    # b and d have two rays; d is a control point, b only a check point
    assert orient._worst_marks(network, rays, np.array([1, 2, 0, 4, 5])) == [2, 4]


def swapped_network(order, observed=False):
    stations = np.array([[0.0, 0, 0], [5.0, 0, 0], [10.0, 0, 0.3]])
    stated = tuple(
        SimpleNamespace(
            station=None if observed else stations[k], observed_station=stations[k] if observed else None
        )
        for k in range(3)
    )
    oriented = tuple(SimpleNamespace(station=stations[k] + [0.2, -0.1, 0.0]) for k in order)
    return SimpleNamespace(photos=stated), SimpleNamespace(photos=oriented)


@pytest.mark.parametrize(
    ("order", "found"), [((0, 1, 2), None), ((1, 0, 2), (0, 1)), ((0, 2, 1), (1, 2)), ((1, 2, 0), None)]
)
def test_two_photographs_that_changed_places_are_told(order, found):
    assert swapped(*swapped_network(order)) == found
    assert swapped(*swapped_network(order, observed=True)) == found


def test_control_points_that_were_exchanged_are_named():
    places = {0: np.array([0.0, 0, 0]), 1: np.array([4.0, 0, 0]), 2: np.array([0.0, 3, 0])}
    network = SimpleNamespace(names=("A", "B", "C"))

    def given(*order):
        return [SimpleNamespace(point=k, place=places[of] + 0.01) for k, of in enumerate(order)]

    assert agreement.exchanged_control(network, given(1, 0), places) == ". A and B are exchanged"
    assert agreement.exchanged_control(network, given(0, 2, 1)[1:], places) == ". B and C are exchanged"
    off = [
        SimpleNamespace(point=0, place=np.array([9.0, 9, 9])),
        SimpleNamespace(point=1, place=np.array([-7.0, 2, 2])),
    ]
    assert agreement.exchanged_control(network, off, places) == ""


def control_network(sigma=0.01, flat=True, check=(), **photo):
    """A network of four control points, in a plane, 20 m from photographs whose pixels cover 5 mm there."""
    places = np.array([[0.0, 0, 0], [4.0, 0, 0], [0.0, 0, 3], [4.0, 0 if flat else 2.0, 3]])
    places = places + np.array([100.0, 200.0, 50.0])
    gcps = tuple(
        SimpleNamespace(place=place, covariance=sigma**2 * np.eye(3), check=k in check, where="c.csv:2")
        for k, place in enumerate(places)
    )
    photos = tuple(
        SimpleNamespace(observed_station=None, fixed=False, station=photo.get("station")) for _ in range(2)
    )
    stations = np.array([[101.0, 180.0, 51.5], [103.0, 180.0, 51.5]])
    network = SimpleNamespace(
        path="n", control=gcps, photos=photos,
        camera_of=lambda f: SimpleNamespace(inner=np.array([24.0]), pixel=0.006),
    )  # fmt: skip
    solution = SimpleNamespace(unknowns=SimpleNamespace(station=stations))
    return network, solution, photos


def test_control_points_in_a_plane_may_be_mirrored():
    (remark,) = control.control_remarks(*control_network())
    assert "stand 20 m from it on the side of its normal (0, -1, 0)" in remark
    assert control.control_remarks(*control_network(flat=False)) == []
    assert control.control_remarks(*control_network(check=(0, 1))) == []
    # not where photographs say on which side they stand
    assert control.control_remarks(*control_network(station=np.array([102.0, 180.5, 51.5]))) == []
    assert control.control_remarks(*control_network(station=np.array([102.0, 220.0, 51.5]))) != []


def test_coordinates_far_finer_than_a_pixel_are_of_another_unit():
    network, solution, photos = control_network(sigma=0.01)
    far = SimpleNamespace(unknowns=SimpleNamespace(station=solution.unknowns.station - [0.0, 4e4, 0.0]))
    with pytest.raises(SurveyError, match=r"a pixel covers about 10 m .* stated to 0\.01 m"):
        control.control_remarks(network, far, photos)
    coarse = control_network(sigma=5.0)[0]
    assert control.control_remarks(coarse, far, photos)[0].endswith("are their coordinates in metres?")


def paired(common):
    """Two photographs with so many common points, and a third with three of them."""
    photo = np.concatenate([np.zeros(common, int), np.ones(common, int), np.full(3, 2)])
    point = np.concatenate([np.arange(common), np.arange(common), np.arange(3)])
    names = [SimpleNamespace(name=f"P{k}") for k in range(3)]
    return SimpleNamespace(path="n", photos=tuple(names), photo=photo, point=point)


def test_pairs_with_most_common_points_come_first_and_need_six():
    first, second, turn, station = pair(12)
    made = next(iter(start._pairs(paired(12), np.concatenate([first, second, first[:3]]))))
    assert set(made) == {0, 1}
    assert made[1][0] == pytest.approx(turn, abs=1e-6)
    assert made[1][1] == pytest.approx(station / np.linalg.norm(station), abs=1e-6)
    assert made[0][1].tolist() == [0.0, 0.0, 0.0]
    with pytest.raises(GeometryError, match="P0 and P1 share 5 points, no pair more"):
        list(start._pairs(paired(5), np.concatenate([first[:5], second[:5], first[:3]])))


@pytest.mark.parametrize(
    ("count", "words"), [(1, "1 control point (A) cannot"), (2, "2 control points (A, B) cannot")]
)
def test_fewer_than_three_control_points_hold_no_photographs(count, words):
    gcps = tuple(
        SimpleNamespace(point=k, place=np.eye(3)[k], check=False, where="c.csv:1") for k in range(count)
    )
    photo = SimpleNamespace(observed_station=None, fixed=False, where="")
    about = SimpleNamespace(
        names=("A", "B"), point=np.array([0, 1, 0, 1]), photo=np.array([0, 0, 1, 1]), control=gcps,
        photos=(photo, photo), path="n",
    )  # fmt: skip
    with pytest.raises(SurveyError) as raised:
        soundness._check_control(about)
    assert words in raised.value.what
