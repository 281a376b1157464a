"""The kernels of clouds beside slow twins."""

import numpy as np
from matplotlib.path import Path as Polygon

from survey.clouds._kernels.paint import Canvas, paint
from survey.clouds._kernels.planes import COVERED, FEW, FINE, Rules, fit_patches, patch_sigmas
from survey.clouds.collecting import collect_points
from survey.clouds.outlines.outline import Attributes, Outline
from survey.clouds.placing import place_outlines
from survey.clouds.points.chunks import Chunk, PointCloud
from survey.clouds.wall import read_wall
from tests.survey.clouds import scans

RULES = Rules(0.008, 0.025, 1e-4)


def test_points_are_in_the_outlines_that_a_slow_search_finds(tmp_path):
    rng = np.random.default_rng(4)
    stars = []
    for k in range(9):
        angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 9))
        ring = rng.uniform(0.2, 0.5, (9, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
        stars.append(Outline(k, str(k), ring + np.array([0.4 * k, 0.1 * (k % 3)]), Attributes(), ""))
    wall = read_wall("3,1 5,4")
    placed = place_outlines(stars, wall, ())
    local = np.column_stack(
        [rng.uniform(-1.0, 5.0, 20000), rng.uniform(-1.0, 1.5, 20000), rng.uniform(-0.2, 0.2, 20000)]
    )
    points = wall.origin + local @ wall.axes
    source = PointCloud(tmp_path, None, points[0], lambda origin, _: iter([Chunk(points - origin)]))
    margin = 0.02
    found = collect_points([source], placed, np.full(9, margin), 0.1)
    for k, one in enumerate(stars):
        edges = np.roll(one.corners, -1, axis=0) - one.corners
        along = ((local[:, None, :2] - one.corners) * edges).sum(axis=2) / (edges**2).sum(axis=1)
        apart = local[:, None, :2] - one.corners - np.clip(along, 0.0, 1.0)[..., None] * edges
        clear = np.linalg.norm(apart, axis=2).min(axis=1) >= margin
        inside = Polygon(one.corners).contains_points(local[:, :2]) & clear & (np.abs(local[:, 2]) <= 0.1)
        counts, places, _ = found.of(k)
        assert counts.sum() == inside.sum() > 100
        kept = np.concatenate([row[: min(n, len(row))] for n, row in zip(counts, places, strict=True)])
        flat = kept[:, :2] + 0.5 * (one.corners.min(axis=0) + one.corners.max(axis=0))
        assert np.linalg.norm(local[inside][:, None, :2] - flat[None, :50], axis=2).min(axis=0).max() < 1e-5


def test_every_point_has_the_same_chance_to_be_kept(tmp_path):
    """Of 960 points of a patch in order, 24 are kept; over many patches, early and late ones are as frequent."""
    square = Outline(1, "A", np.array([(0, 0), (6, 0), (6, 6), (0, 6.0)]), Attributes(), "")
    placed = place_outlines([square], read_wall("0,0 1,0"), ())
    rng = np.random.default_rng(6)
    flat = rng.uniform(0.0, 6.0, (36 * 960, 2))
    order = np.linspace(-0.1, 0.1, len(flat))  # the depth says which point it is
    points = np.column_stack([flat[:, 0], -order, flat[:, 1]])
    source = PointCloud(tmp_path, None, points[0], lambda origin, _: iter([Chunk(points - origin)]))
    found = collect_points([source], placed, np.zeros(1), 0.2)
    kept = found.samples.places[:, :, 2].ravel()
    assert kept.size == 36 * 24
    assert abs(kept.mean()) < 4 * 0.2 / np.sqrt(12 * kept.size)


def patches(rng, heights, noise, kept=24):
    """Samples of a face of 6 × 6 patches of 50 mm, whose heights are given."""
    rows, columns = np.divmod(np.arange(36), 6)
    places = np.empty((36, kept, 3))
    places[..., 0] = (columns[:, None] + rng.random((36, kept))) * 0.05 - 0.15
    places[..., 1] = (rows[:, None] + rng.random((36, kept))) * 0.05 - 0.15
    places[..., 2] = 0.1 * places[..., 0] + heights[:, None] + rng.normal(0.0, noise, (36, kept))
    return np.full(36, 1000), places.astype(np.float32)


def test_a_plane_is_found_with_its_noise_and_the_scatter_of_its_patches():
    rng, noises, variances, slopes = np.random.default_rng(7), [], [], []
    for _ in range(60):
        status, rows, _, plane, numbers = fit_patches(
            *patches(rng, rng.normal(0.0, 0.0008, 36), 0.002), 6, RULES
        )
        assert (status, len(rows)) == (FINE, 36)
        noises.append(numbers[0])
        variances.append(numbers[1])
        slopes.append(plane[0])
    assert abs(np.mean(noises) / 0.002 - 1.0) < 0.02
    assert abs(np.mean(variances) / (0.0008**2 + 0.002**2 / 24) - 1.0) < 0.1
    assert abs(np.mean(slopes) - 0.1) < 4 * np.std(slopes) / np.sqrt(60)


def test_correlated_patches_are_less_precise():
    rng = np.random.default_rng(9)
    _, rows, cells, _, numbers = fit_patches(*patches(rng, rng.normal(0.0, 0.0008, 36), 0.002), 6, RULES)
    alone, worth = patch_sigmas(rows, cells, numbers, 0.0)
    together, less = patch_sigmas(rows, cells, numbers, 0.3)
    apart = np.linalg.norm(cells[:, None] - cells[None], axis=2)
    factor = (0.3**apart).sum() / 36
    # a fit leaves fewer degrees of freedom of correlated patches, too
    assert (together > alone * np.sqrt(factor)).all()
    assert less < worth / factor


def test_half_a_face_behind_leaves_and_few_points():
    rng = np.random.default_rng(11)
    counts, places = patches(rng, np.zeros(36), 0.001)
    places[:16, :, 2] += rng.uniform(0.02, 0.12, (16, 24))
    status, rows, _, plane, _ = fit_patches(counts, places, 6, RULES)
    assert status == FINE
    assert abs(plane[2]) < 0.001
    assert len(rows) <= 21
    assert fit_patches(np.full(36, 2), places, 6, RULES)[0] == FEW
    places[..., 2] = rng.uniform(-0.12, 0.12, (36, 24))
    assert fit_patches(counts, places, 6, RULES)[0] == COVERED


def test_a_picture_is_a_histogram():
    rng = np.random.default_rng(12)
    points, colours = rng.uniform(0.0, 1.0, (5000, 3)), rng.integers(0, 256, (5000, 3)).astype(np.uint8)
    blank = np.zeros((10, 20), np.float32)
    axes = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
    canvas = Canvas(
        np.array([0.0, 0.5, 0.5]), axes, 0.05, 0.3, blank, blank.copy(), np.zeros((10, 20, 3), np.float32)
    )
    shown = paint(points, colours, canvas)
    near = (np.abs(points[:, 1] - 0.5) <= 0.3) & (points[:, 2] < 0.5)
    expected, _, _ = np.histogram2d(points[near, 2], points[near, 0], (10, 20), ((0, 0.5), (0, 1)))
    np.testing.assert_array_equal(canvas.counts, expected[::-1])
    assert shown == near.sum()
    assert canvas.tints.sum() == np.float32(colours[near].sum())


def test_the_small_wall_is_as_it_is_meant_to_be():
    points = scans.scan()
    depths = (points - scans.ORIGIN) @ scans.OUT
    assert np.quantile(depths, 0.001) > -0.02
    assert np.abs(np.median(depths)) < 0.005
