"""Stress, fabric, strain and shape of groups of disks, thrusts, and the critical taper, beside closed forms."""

import numpy as np
import pytest

from benchmarks.taper import critical_slope
from ground.errors import SceneError
from mechanics.planar.measures.blocks import blocks_of
from mechanics.planar.measures.cells import Cell, members, shape_of
from mechanics.planar.measures.limits import crest_radius, shear_limits
from mechanics.planar.measures.surface import profile, slope
from mechanics.planar.measures.tensors import deformation, fabric_of, mean_stress, moments
from mechanics.planar.measures.tessellation import tessellation
from mechanics.planar.measures.thrusts import thrusts_of

MAP = np.array([[1.2, 0.4], [-0.1, 0.8]])


def packing(rows=15, columns=15):
    """Hexagonal packing of disks of radius 1, and its contacts with their normals."""
    j, i = np.indices((rows, columns)).reshape(2, -1)
    centre = np.column_stack([2.0 * i + j % 2, np.sqrt(3.0) * j])
    first, second = np.triu_indices(len(centre), 1)
    touching = np.linalg.norm(centre[first] - centre[second], axis=1) < 2.001
    bodies = np.column_stack([first[touching], second[touching]])
    normal = 0.5 * (centre[bodies[:, 0]] - centre[bodies[:, 1]])
    return centre, bodies, normal


def test_stress_of_a_packing_is_that_which_made_its_forces():
    """Forces f = -l A σ·n with the widths of the hexagons give σ back (Love & Weber)."""
    centre, bodies, normal = packing()
    sigma = np.array([[3.0, 0.5], [0.5, 1.5]])
    # each contact of a hexagonal packing passes the traction on a hexagon's side of 2/√3 r
    force = (2.0 / np.sqrt(3.0)) * normal @ sigma
    point = centre[bodies[:, 0]] - normal
    moment = moments(len(centre), centre, bodies, point, force)
    cells = tessellation(centre, np.ones(len(centre)))
    inner = np.linalg.norm(centre - centre.mean(axis=0), axis=1) < 6.0
    found = mean_stress(moment[inner], float(cells.share[inner].sum()))
    assert found.tensor == pytest.approx(sigma, rel=1e-9)
    values = np.linalg.eigvalsh(sigma)
    assert found.pressure == pytest.approx(values.mean())
    assert found.deviator == pytest.approx(0.5 * np.ptp(values))
    assert np.tan(2 * found.direction) == pytest.approx(2 * 0.5 / (3.0 - 1.5))


def test_walls_press_on_disks_alone():
    """A disk between two walls that press with F has σ_xx = F (2r)/A."""
    centre = np.array([[0.0, 0.0], [5.0, 0.0], [-5.0, 0.0]])
    bodies, point = np.array([[0, 1], [0, 2]]), np.array([[1.0, 0.0], [-1.0, 0.0]])
    moment = moments(1, centre, bodies, point, np.array([[-7.0, 0.0], [7.0, 0.0]]))
    assert moment[0] == pytest.approx(np.array([[14.0, 0.0], [0.0, 0.0]]))


def test_fabric_of_a_packing_has_no_direction_and_six_contacts():
    centre, bodies, normal = packing()
    inner = np.linalg.norm(centre - centre.mean(axis=0), axis=1) < 6.0
    radius = np.ones(len(centre))
    cells = tessellation(centre, radius)
    found = fabric_of(inner, bodies, normal, normal, radius, cells)
    assert found.coordination == pytest.approx(6.0)
    assert found.anisotropy == pytest.approx(0.0, abs=1e-12)
    assert found.porosity == pytest.approx(1.0 - np.pi / np.sqrt(12.0))
    level = np.abs(normal[:, 1]) < 0.1
    only_level = fabric_of(inner, bodies, normal, normal * level[:, None], radius, cells)
    assert only_level.anisotropy == pytest.approx(2.0)
    assert only_level.direction == pytest.approx(0.0)
    assert only_level.coordination == pytest.approx(2.0)


def test_a_linear_map_is_found_at_every_disk_and_in_cells():
    rng = np.random.default_rng(1)
    start = rng.uniform(0, 10, (400, 2))
    cells = tessellation(start, np.full(400, 0.25))
    found = deformation(start, start @ MAP.T + [3.0, 1.0], cells)
    known = np.isfinite(found.volume)
    assert known.mean() > 0.9
    assert found.gradient[known] == pytest.approx(np.broadcast_to(MAP, (known.sum(), 2, 2)))
    stretch = np.linalg.svd(MAP, compute_uv=False)
    assert found.shear[known] == pytest.approx(np.log(stretch[0] / stretch[1]))
    assert found.volume[known] == pytest.approx(np.linalg.det(MAP) - 1.0)
    group = members(Cell("W1", (5.0, 5.0), 3.0), start)
    shape = shape_of(start[group], start[group] @ MAP.T)
    assert shape.gradient == pytest.approx(MAP)
    assert shape.turned == pytest.approx(np.arctan2(MAP[1, 0] - MAP[0, 1], np.trace(MAP)))


def test_holes_and_the_outside_belong_to_no_disk():
    centre, _, _ = packing()
    hole = np.linalg.norm(centre - centre.mean(axis=0), axis=1) < 5.0
    centre = centre[~hole]
    cells = tessellation(centre, np.ones(len(centre)))
    assert cells.share.sum() < 2 * np.sqrt(3.0) * len(centre)
    rim = np.linalg.norm(centre - centre.mean(axis=0), axis=1) < 6.0
    assert not cells.inside[rim].any()


def test_a_cell_outside_the_sample_is_refused():
    with pytest.raises(SceneError, match="holds 0 disks"):
        members(Cell("W9", (100.0, 0.0), 2.0), packing()[0])
    with pytest.raises(SceneError, match="radius"):
        Cell("W9", (0.0, 0.0), -1.0)


def test_the_surface_of_a_heap_has_its_slope():
    x = np.arange(0.0, 20.0, 0.1)
    centre = np.column_stack([x, x * np.tan(np.radians(20.0))])
    places = np.arange(3.0, 17.0, 0.5)
    height = profile(centre, np.full(len(x), 0.5), places)
    assert slope(places, height) == pytest.approx(np.radians(20.0), abs=1e-3)
    assert height == pytest.approx(
        places * np.tan(np.radians(20.0)) + 0.5 / np.cos(np.radians(20.0)), abs=0.01
    )


def twenty_disks():
    """Twenty disks in a packing of 225, with random forces, and a third of the contacts without any."""
    centre, bodies, normal = packing()
    group = np.isin(np.arange(len(centre)), np.argsort(np.linalg.norm(centre - [13.0, 12.0], axis=1))[:20])
    rng = np.random.default_rng(7)
    force = rng.normal(size=(len(bodies), 2)) * (rng.uniform(size=len(bodies)) > 0.3)[:, None]
    return centre, bodies, normal, force, group


def test_stress_and_fabric_of_twenty_disks_are_the_sums_of_renouf_dubois_and_alart():
    """Their equations 7 to 10, one contact at a time; of one that leaves the cell the half within it counts."""
    centre, bodies, normal, force, group = twenty_disks()
    radius, area = np.ones(len(centre)), 20 * 2 * np.sqrt(3.0)
    sigma, f = np.zeros((2, 2)), np.zeros((2, 2))
    for (first, second), n, r in zip(bodies, normal, force, strict=True):
        part = 0.5 * (int(group[first]) + int(group[second])) * bool(np.any(r))
        for i in range(2):
            for j in range(2):
                # the normal points to the candidate, and compression is positive
                sigma[i, j] += part * r[i] * 2.0 * n[j] / area
                f[i, j] += part * n[i] * n[j] / area
    tessellated = tessellation(centre, radius)
    share = float(tessellated.share[group].sum())
    assert share == pytest.approx(area, rel=1e-12)
    moment = moments(len(centre), centre, bodies, centre[bodies[:, 0]] - normal, force)
    found = mean_stress(moment[group], share)
    low, high = np.linalg.eigvalsh(0.5 * (sigma + sigma.T))
    assert found.pressure == pytest.approx(0.5 * (high + low), rel=1e-12)
    assert found.deviator == pytest.approx(0.5 * (high - low), rel=1e-12)
    low, high = np.linalg.eigvalsh(f)
    fabric = fabric_of(group, bodies, normal, force, radius, tessellated)
    assert fabric.density == pytest.approx(0.5 * (high - low), rel=1e-12)
    assert fabric.density > 1e-3


def test_lambda_of_twenty_disks_is_that_of_their_outermost_places():
    """Equation 11 of Renouf, Dubois & Alart (2006)."""
    centre, *_, group = twenty_disks()
    start = centre[group]
    now = start @ MAP.T + 0.1 * np.random.default_rng(3).normal(size=start.shape)
    for axis in range(2):
        ratio = (max(now[:, axis]) - min(now[:, axis])) / (max(start[:, axis]) - min(start[:, axis]))
        assert shape_of(start, now).extent[axis] == pytest.approx(ratio, rel=1e-12)


def test_lambda_changes_with_a_rigid_turn_and_the_shear_does_not():
    """A square of 2 × 1 that turns by 90° has λx = 1/2, λy = 2."""
    x, y = np.meshgrid(np.linspace(0.0, 2.0, 9), np.linspace(0.0, 1.0, 5))
    start = np.column_stack([x.ravel(), y.ravel()])
    shape = shape_of(start, start @ np.array([[0.0, 1.0], [-1.0, 0.0]]))
    assert shape.extent == pytest.approx([0.5, 2.0])
    assert shape.shear == pytest.approx(0.0, abs=1e-9)
    assert shape.turned == pytest.approx(0.5 * np.pi)


@pytest.mark.parametrize(("left", "right"), [(60.0, 20.0), (110.0, 45.0), (35.0, 25.0)])
def test_the_limits_of_a_sheared_zone_are_found(left, right):
    rng = np.random.default_rng(2)
    place = rng.uniform([-40.0, 0.0], [60.0, 10.0], (8000, 2))
    ends = [place[:, 1] / np.tan(np.radians(angle)) for angle in (left, right)]
    share = np.clip((ends[1] - place[:, 0]) / np.maximum(ends[1] - ends[0], 1e-9), 0.0, 1.0)
    limits = shear_limits(place, share)
    # between the limits the share falls evenly, and 5 % of it are not told from none
    run = [1.0 / np.tan(np.radians(angle)) for angle in (left, right)]
    expected = [run[0] + part * (run[1] - run[0]) for part in (0.05, 0.95)]
    assert np.degrees(limits.left) == pytest.approx(np.degrees(np.arctan2(1.0, expected[0])), abs=3.0)
    assert np.degrees(limits.right) == pytest.approx(np.degrees(np.arctan2(1.0, expected[1])), abs=3.0)


def test_a_motion_without_a_zone_has_no_limits_and_a_level_surface_no_radius():
    place = np.random.default_rng(2).uniform([0.0, 0.0], [60.0, 10.0], (2000, 2))
    limits = shear_limits(place, np.ones(len(place)))
    assert np.isnan([limits.left, limits.right, limits.mean]).all()
    x = np.linspace(0.0, 10.0, 40)
    assert crest_radius(x, 0.01 * np.random.default_rng(1).normal(size=40)) == np.inf
    assert np.isnan(crest_radius(x[:3], x[:3]))


def bed(width=12, height=6):
    """Square packing of disks of radius 1/2, rows from below."""
    return np.array([(x, y) for y in range(height) for x in range(width)], dtype=float)


def test_a_block_that_slid_off_and_lies_on_others_has_come_off():
    """Contacts that formed anew do not join it to what it lies on."""
    start = bed()
    corner = (start[:, 0] > 8.5) & (start[:, 1] > 3.5)
    found = blocks_of(start, start + np.where(corner[:, None], [1.0, 0.0], 0.0), np.full(72, 0.5), 0.02)
    assert found.size.tolist() == [66, 6]
    assert found.detached_disks == 6
    assert found.largest_share == pytest.approx(66 / 72)
    assert (found.label == 1).tolist() == corner.tolist()


def test_a_gap_counts_only_beyond_the_range_of_the_cohesion():
    start = bed()
    upper = start[:, 1] > 2.5
    raised = start + np.where(upper[:, None], [0.0, 0.02], 0.0)
    assert blocks_of(start, raised, np.full(72, 0.5), 0.03).size.tolist() == [72]
    assert blocks_of(start, raised, np.full(72, 0.5), 0.01).size.tolist() == [36, 36]


def test_debris_what_is_covered_and_what_stands_on_the_base_have_not_come_off():
    start = bed()
    debris = (start[:, 1] > 4.5) & (start[:, 0] > 8.5)
    # three slabs of two rows; three disks fly off the upper one
    apart = start + np.array([0.0, 0.1]) * np.floor(start[:, 1:] / 2.0)
    apart[debris] += 0.5
    found = blocks_of(start, apart, np.full(72, 0.5), 0.02)
    assert found.size.tolist() == [24, 24, 21, 3]
    assert found.detached.tolist() == [2]


X, Y = np.meshgrid(np.arange(0.0, 40.0, 0.2), np.arange(0.1, 2.0, 0.2))
PLACES = np.column_stack([X.ravel(), Y.ravel()])
RADII = np.full(len(PLACES), 0.1)


def bands(places, dip):
    """Shear that falls off from lines which start at the base and dip to the left."""
    away = [PLACES[:, 0] - place - PLACES[:, 1] / np.tan(dip) for place in places]
    return 0.01 + sum(np.exp(-((one * np.sin(dip) / 0.15) ** 2)) for one in away)


def test_bands_are_found_with_their_spacing_and_dip():
    found = thrusts_of(PLACES, PLACES, bands((8.0, 16.0, 24.0), np.radians(35.0)), RADII, 2.0)
    assert found.place == pytest.approx(np.array([8.0, 16.0, 24.0]) + 1.0 / np.tan(np.radians(35.0)), abs=0.8)
    assert found.spacing == pytest.approx(8.0, abs=0.3)
    assert np.degrees(found.dip) == pytest.approx(35.0, abs=4.0)


def test_without_a_layer_there_is_no_thrust():
    found = thrusts_of(PLACES, PLACES, bands((8.0,), 0.6), RADII, 0.0)
    assert len(found.place) == 0
    assert np.isnan(found.spacing)


def friction_on_base(internal, surface, base):
    """tan φ_b on a plane below the surface of a wedge that fails: Mohr's circle through the stress at a given depth.

    With z down from the surface, σ_zz = ρ g z cos α, τ = ρ g z sin α; of two circles at failure the larger one, which
    is that of a wedge that is pushed.
    """
    normal, shear = np.cos(surface), np.sin(surface)
    # (normal - p)² + shear² = (p sin φ)²
    a, b, c = np.cos(internal) ** 2, -2.0 * normal, normal**2 + shear**2
    p = (-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    turn = 2.0 * (surface + base)
    away = normal - p
    on_base = p + away * np.cos(turn) + shear * np.sin(turn)
    along = shear * np.cos(turn) - away * np.sin(turn)
    return abs(along) / on_base


@pytest.mark.parametrize(("internal", "basal", "base"), [(30, 10, 0), (30, 25, 0), (36, 16, 3), (20, 5, -1)])
def test_the_base_of_a_critical_wedge_is_about_to_slide(internal, basal, base):
    internal, basal, base = np.radians([internal, basal, base])
    surface = critical_slope(internal, basal, base)
    assert friction_on_base(internal, surface, base) == pytest.approx(np.tan(basal), rel=1e-9)


def test_a_base_stronger_than_the_wedge_is_refused():
    with pytest.raises(SceneError, match="basal"):
        critical_slope(0.3, 0.4)
