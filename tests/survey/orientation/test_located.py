"""Points intersected from photographs and plotted on one, with their covariances."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from ground.errors import GeometryError
from survey.orientation.network import Camera, Photo
from survey.orientation.oriented import Oriented
from survey.orientation.projection import project
from survey.orientation.rotations import turned
from survey.orientation.stones.intersection import intersect
from survey.orientation.stones.located import Mark, joint_covariance
from survey.orientation.stones.plotting import plot
from survey.orientation.stones.surfaces import fit_surface
from tests.survey.orientation.synthetic_block import INNER, SIZE, looking

PIXEL = 24.0 / SIZE[1]
SIGMA = 0.5


def oriented(stations, target=(4.0, 0.0, 2.0), deviation=0.0):
    """Photographs with independent errors of their orientation."""
    camera = Camera("c", INNER, SIZE, PIXEL)
    photos = tuple(
        Photo(f"P{k + 1}", 0, looking(one, np.asarray(target)), np.asarray(one, float))
        for k, one in enumerate(stations)
    )
    count = 6 * len(photos)
    table = np.full((len(photos), 16), -1)
    table[:, :6] = np.arange(count).reshape(-1, 6)
    sizes = np.tile([deviation / 10.0] * 3 + [deviation] * 3, len(photos))
    return Oriented("o.json", (camera,), photos, table, np.diag(sizes**2), SIGMA)


def disturbed(one, rng):
    """The same photographs where they might truly stand."""
    off = (np.sqrt(np.diag(one.covariance)) * rng.normal(size=len(one.covariance))).reshape(-1, 6)
    return replace(
        one,
        photos=tuple(
            replace(p, rotation=turned(p.rotation[None], o[None, :3])[0], station=p.station + o[3:])
            for p, o in zip(one.photos, off, strict=True)
        ),
    )


def marks(one, place, rng=None, photos=None):
    out = []
    for f in range(len(one.photos)) if photos is None else photos:
        image = project(one.camera(f), one.rotation(f), one.station(f), place[None])[0]
        out.append(Mark(f, image + (0.0 if rng is None else SIGMA * rng.normal(size=2)), SIGMA))
    return out


def test_the_normal_case():
    """σ_Z = Z²/(B c) √2 σ, σ_X = σ_Y = Z/c σ/√2 amid two parallel photographs."""
    camera = Camera("c", np.array([24.0, 18.0, 12.0, *[0.0] * 7]), SIZE, PIXEL)
    base, distance = 0.2, 10.0
    front = looking([0.0, -1.0, 0.0], [0.0, 0.0, 0.0])
    photos = tuple(
        Photo(f"P{k}", 0, front, np.array([x, -distance, 0.0])) for k, x in enumerate((-base / 2, base / 2))
    )
    pair = Oriented("o", (camera,), photos, np.full((2, 16), -1), np.zeros((0, 0)), SIGMA)
    found = intersect(pair, "p", marks(pair, np.array([0.0, 0.0, 0.0])))
    np.testing.assert_allclose(found.place, 0.0, atol=1e-9)
    sigma = np.sqrt(np.diag(found.covariance(pair)))
    mark = SIGMA * PIXEL
    depth = distance**2 / (base * 24.0) * np.sqrt(2.0) * mark
    across = distance / 24.0 * mark / np.sqrt(2.0)
    np.testing.assert_allclose(sigma, [across, depth, across], rtol=1e-3)


def test_intersected_points_are_as_precise_as_predicted_and_share_errors():
    block = oriented([(1.0, -6.0, 1.0), (4.0, -6.5, 2.0), (7.0, -6.0, 2.5)], deviation=0.003)
    places = np.array([[2.0, 0.1, 1.0], [5.5, -0.2, 3.0]])
    tests = []
    for draw in range(300):
        rng = np.random.default_rng(draw)
        true = disturbed(block, rng)
        found = [intersect(block, str(k), marks(true, place, rng)) for k, place in enumerate(places)]
        off = np.concatenate([one.place - place for one, place in zip(found, places, strict=True)])
        tests.append(off @ np.linalg.solve(joint_covariance(found, block), off))
    assert np.mean(tests) == pytest.approx(6.0, abs=4 * np.sqrt(2 * 6 / 300))
    assert np.mean(np.array(tests) < chi2.ppf(0.95, 6)) == pytest.approx(0.95, abs=0.04)


def cylinder_places(count, rng, radius=1.5):
    turn = rng.uniform(-1.0, 1.0, count)
    return np.column_stack(
        [rng.uniform(1.5, 6.5, count), 1.2 - radius * np.cos(turn), 2.0 + radius * np.sin(turn)]
    )


def check_coverage(kind, draws):
    """Points plotted on one photograph: coverage of 95 %, and agreement with the intersection of two."""
    block = oriented([(1.0, -6.0, 1.0), (4.0, -6.5, 2.0), (7.0, -6.0, 2.5)], deviation=0.002)
    rng = np.random.default_rng(1)
    defining = cylinder_places(12, rng)
    place = cylinder_places(1, rng)[0]
    if kind == "plane":
        defining[:, 1], place[1] = 0.1 * defining[:, 0], 0.1 * place[0]
    covered, agree = [], []
    for draw in range(draws):
        rng = np.random.default_rng(draw)
        true = disturbed(block, rng)
        known = [intersect(block, str(k), marks(true, one, rng)) for k, one in enumerate(defining)]
        surface = fit_surface(kind, known, block, np.array([4.0, -6.0, 2.0]))
        first, second = marks(true, place, rng, (0, 2))
        single = plot(block, "single", first, surface)
        off = single.place - place
        covered.append(off @ np.linalg.solve(single.covariance(block), off) < chi2.ppf(0.95, 3))
        both = intersect(block, "both", [first, second])
        apart = np.hstack([np.eye(3), -np.eye(3)])
        spread = apart @ joint_covariance([single, both], block) @ apart.T
        off = single.place - both.place
        deviations = np.sqrt(np.diag(spread))
        agree.append((np.abs(off) < 2.0 * deviations).all())
    return np.mean(covered), np.mean(agree)


@pytest.mark.parametrize("kind", ["cylinder", "plane"])
def test_points_plotted_on_one_photograph_agree_with_intersections(kind):
    covered, agree = check_coverage(kind, 60)
    assert covered > 0.85
    assert agree > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["cylinder", "plane"])
def test_coverage_of_points_plotted_on_one_photograph(kind):
    covered, agree = check_coverage(kind, 1000)
    print(f"{kind}: {covered:.1%} covered, {agree:.1%} within 2 sigma of the intersection in x, y and z")
    assert covered == pytest.approx(0.95, abs=0.03)
    assert agree > 0.86  # three coordinates within 2 σ


def test_the_assumption_costs_precision_along_the_ray():
    block = oriented([(1.0, -6.0, 1.0), (4.0, -6.5, 2.0), (7.0, -6.0, 2.5)])
    rng = np.random.default_rng(1)
    known = [
        intersect(block, str(k), marks(block, np.array([x, 0.0, z]), rng))
        for k, (x, z) in enumerate(rng.uniform([2, 1], [6, 3], (8, 2)))
    ]
    (mark,) = marks(block, np.array([5.0, 0.0, 2.0]), rng, (0,))
    towards = np.array([4.0, -6.0, 2.0])
    exact, rough = (
        plot(block, "p", mark, fit_surface("plane", known, block, towards, scatter=one))
        for one in (0.0, 0.01)
    )
    ray = exact.place - block.station(0)
    ray /= np.linalg.norm(ray)
    more = rough.covariance(block) - exact.covariance(block)
    np.testing.assert_allclose(more, np.outer(ray, ray) * (0.01 / ray[1]) ** 2, rtol=1e-3)


def test_mistakes_of_marks_are_named():
    block = oriented([(1.0, -6.0, 1.0), (4.0, -6.5, 2.0), (7.0, -6.0, 2.5)])
    place = np.array([4.0, 0.0, 2.0])
    good = marks(block, place)
    wrong = [good[0], replace(good[2], image=good[2].image + np.array([0.0, 60.0]))]
    with pytest.raises(GeometryError, match="the marks of point c1 on P1 and P3 miss by"):
        intersect(block, "c1", wrong)
    near = oriented([(4.0, -6.0, 2.0), (4.01, -6.0, 2.0)])
    with pytest.raises(GeometryError, match=r"the rays of point c1 from P1 and P2 meet at 0\.1°"):
        intersect(near, "c1", marks(near, place))
    flat = [
        intersect(block, str(k), marks(block, np.array([x, 0.0, z])))
        for k, (x, z) in enumerate([(2, 1), (6, 1), (4, 3)])
    ]
    towards = np.array([4.0, -6.0, 2.0])
    with pytest.raises(GeometryError, match="2 points define no plane"):
        fit_surface("plane", flat[:2], block, towards)
    with pytest.raises(GeometryError, match="3 points define no cylinder"):
        fit_surface("cylinder", flat, block, towards)
    rng = np.random.default_rng(1)
    wall = [
        intersect(block, str(k), marks(block, np.array([x, 0.0, z]), rng))
        for k, (x, z) in enumerate(rng.uniform([2, 1], [6, 3], (9, 2)))
    ]
    with pytest.raises(GeometryError, match="do not define a cylinder"):
        fit_surface("cylinder", wall, block, towards)
    side = oriented([(4.0, -6.0, 2.0), (12.0, -0.3, 2.0)], target=(2.0, 0.0, 2.0))
    plane = fit_surface("plane", flat, block, towards)
    with pytest.raises(GeometryError, match="P2 sees the plane of 3 points, which nothing checks at 2°"):
        plot(side, "c1", marks(side, np.array([3.0, 0.0, 2.0]), None, (1,))[0], plane)


@pytest.mark.parametrize(("wrong", "off"), [(0, (60.0, 40.0)), (2, (-80.0, 35.0)), (3, (0.0, 200.0))])
def test_of_several_marks_the_wrong_one_is_left_out_and_named(wrong, off):
    block = oriented([(1.0, -6.0, 1.0), (4.0, -6.5, 2.0), (7.0, -6.0, 2.5), (3.0, -6.0, 3.5)])
    place = np.array([3.0, 0.1, 1.5])
    seen = marks(block, place)
    seen[wrong] = replace(seen[wrong], image=seen[wrong].image + np.array(off))
    point = intersect(block, "p", seen)
    np.testing.assert_allclose(point.place, place, atol=1e-6)
    assert len(point.sights) == 3
    assert point.left_out.startswith(f"the mark on P{wrong + 1}, {np.hypot(*off):.0f} px")


def test_two_marks_that_contradict_each_other_are_refused_as_neither_is_known_to_be_wrong():
    block = oriented([(1.0, -6.0, 1.0), (4.0, -6.5, 2.0)])
    seen = marks(block, np.array([3.0, 0.1, 1.5]))
    seen[0] = replace(seen[0], image=seen[0].image + np.array([0.0, 90.0]))
    with pytest.raises(GeometryError, match="miss by"):
        intersect(block, "p", seen)
