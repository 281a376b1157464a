"""Stress, fabric, strain and shape of groups of disks, beside closed forms."""

import numpy as np
import pytest

from mechanics.planar.measures.cells import Cell, members, shape_of
from mechanics.planar.measures.fabric import fabric_of
from mechanics.planar.measures.strain import deformation
from mechanics.planar.measures.stress import mean_stress, moments
from mechanics.planar.measures.surface import profile, slope
from mechanics.planar.measures.tessellation import tessellation
from moma.errors import SceneError

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
