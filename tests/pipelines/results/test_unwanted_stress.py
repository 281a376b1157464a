"""Stones that deform without a stress request are left out wherever stresses are reported or drawn."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.scene.scene import Fidelity
from pipelines.draw.offscreen.surfaces import wall_surface
from pipelines.draw.pictures import missing
from pipelines.results.stone_values import stone_results, stress_statistics
from pipelines.results.summary import summarise
from pipelines.results.vtk import body_cells, body_grid
from tests.pipelines.results_by_hand import deformable_body, result_of, rigid_body

FORCES = ((0.0, 0.0, 3000.0), (0.0, 600.0, 800.0))


def height(points):
    """A stress that is linear in height, from 0 at z = 1 to 2 MPa at z = 3."""
    return 1e6 * (points[:, 2] - 1.0)


@pytest.fixture(scope="module")
def stones():
    """A fixed, a deformable and a rigid block on each other; a fourth that deforms without any stress."""
    ring = deformable_body("D2", (1, 0, 1), (2, 1, 3), height, size=0.5)
    return (
        rigid_body("base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
        deformable_body("D1", (0, 0, 1), (1, 1, 3), height, size=0.5, shift=(0, 0, -0.002)),
        rigid_body("top", (0, 0, 3), (1, 1, 4), shift=(0, 0.003, -0.004)),
        replace(ring, stress=None, von_mises=None, principal=None, values=None),
    )


def test_numbers_are_those_of_the_requested_stones(stones):
    without = result_of(stones[:3], pairs=((1, 0), (2, 1)), forces=FORCES)
    beside = result_of(stones, pairs=((1, 0), (2, 1)), forces=FORCES)
    assert stress_statistics(beside) == stress_statistics(without)
    told = [summarise(one, version="1", seconds={}) for one in (beside, without)]
    assert told[0]["stress"] == told[1]["stress"]
    assert (told[0]["bodies"]["deformable"], told[1]["bodies"]["deformable"]) == (2, 1)
    ring = stone_results(beside)[3]
    assert (ring.fidelity, ring.von_mises_max, ring.von_mises_mean) == ("deformable", None, None)
    assert {"volume", "mass"} <= set(ring.values)
    assert not any("stress" in name or "mises" in name for name in ring.values)


def test_files_and_pictures_have_its_mesh_and_no_stress(stones):
    beside = result_of(stones, pairs=((1, 0), (2, 1)), forces=FORCES)
    grid, nodes = body_grid(beside, beside.frames[-1], body_cells(beside)), len(stones[3].reference)
    assert np.isnan(grid.point_data["von_mises"][-nodes:]).all()
    assert np.isfinite(grid.point_data["displacement"]).all()
    assert grid.cell_data["fidelity"][-1] == 2
    assert np.isnan(grid.cell_data["stress_error"][-1])
    surface = wall_surface(beside).field("von_mises")
    assert np.isnan(surface[-nodes:]).all()
    assert np.isfinite(surface).sum() == len(stones[1].reference)
    assert missing(beside, "von_mises") is None


def test_a_missing_picture_of_stress_has_a_reason(stones):
    alone = result_of([stones[0], stones[3]], pairs=((1, 0),), forces=FORCES[:1])
    assert missing(alone, "von_mises") == "no stress was asked for"
