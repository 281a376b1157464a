"""Core of a wall as one continuum for each storey: closed, around the tails of headers, nearly all of it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from survey.geometry.solids import Solid, volume_of
from survey.geometry.stone_parts import grid_parts
from survey.geometry.watertight import check_watertight
from survey.unseen.core.cells import CellGrid, grid_solids
from survey.unseen.core.facings import facing_stone
from survey.unseen.core.propose import propose_infill
from survey.unseen.core.settings import InfillSettings, InfillShape
from synthetic.buildings.facings import two_facings
from tests.survey.unseen.core.two_facings import contains, core_volume, facing

STOREYS = InfillSettings(shape=InfillShape.STOREYS)
BEDS = [0.0, 0.3, 0.62, 0.9, 1.2]
PLAIN = [[(0.7, 0.3), (0.4, 0.3), (0.9, 0.3)], [(1.1, 0.3), (0.9, 0.3)]] * 2


def test_stones_of_one_depth_leave_a_box():
    stones = facing(PLAIN, BEDS) + facing(PLAIN, BEDS, back=True)
    (core,) = propose_infill(stones, STOREYS)
    assert core.code == "I1-S1"
    assert (len(core.solid.faces), len(core.solid.vertices)) == (6, 8)
    assert core.volume == pytest.approx(2.0 * 0.4 * 1.2, rel=1e-12)
    check_watertight(core.solid, convex=True)


def test_storeys_end_at_beds_and_share_them():
    stones = facing(PLAIN, BEDS) + facing(PLAIN, BEDS, back=True)
    core = propose_infill(stones, InfillSettings(shape=InfillShape.STOREYS, storey_height=0.5))
    assert [one.code for one in core] == ["I1-S1", "I1-S2"]
    assert [one.solid.vertices[:, 2].min() for one in core] == pytest.approx([0.0, 0.62], abs=1e-12)
    assert [one.solid.vertices[:, 2].max() for one in core] == pytest.approx([0.62, 1.2], abs=1e-12)
    assert "courses 1 to 2" in core[0].evidence


def test_the_continuum_steps_around_tails():
    front = [*PLAIN[:1], [(0.8, 0.3), (0.4, 0.5), (0.8, 0.3)], *PLAIN[2:]]
    (core,) = propose_infill(facing(front, BEDS) + facing(PLAIN, BEDS, back=True), STOREYS)
    check_watertight(core.solid)
    assert core.volume == pytest.approx(2.0 * 0.4 * 1.2 - 0.4 * 0.32 * 0.2, rel=1e-12)
    inside = np.array([[1.0, -0.1, 0.45], [1.0, 0.1, 0.45], [1.0, -0.1, 0.2], [0.7, -0.1, 0.45]])
    assert contains(core.solid, inside).tolist() == [False, True, True, True]


def test_a_stone_that_goes_through_all_courses_parts_the_storey():
    front = [[(0.8, 0.3), (0.4, 1.0), (0.8, 0.3)]] * 4
    back = [[(0.8, 0.3), (0.4, None), (0.8, 0.3)]] * 4
    core = propose_infill(facing(front, BEDS) + facing(back, BEDS, back=True), STOREYS)
    assert [one.code for one in core] == ["I1-S1", "I1-S1-2"]
    assert [one.volume for one in core] == pytest.approx([0.8 * 0.4 * 1.2] * 2, rel=1e-12)


def test_facings_that_meet_have_no_core():
    thick = [[(1.1, 0.5), (0.9, 0.5)]] * 4
    assert propose_infill(facing(thick, BEDS) + facing(thick, BEDS, back=True), STOREYS) == ()


@pytest.mark.parametrize(("closed", "seed"), [(False, 4), (True, 4), (True, 5)])
def test_the_core_of_a_surveyed_wall_is_nearly_whole_and_in_no_stone(closed, seed):
    wall = two_facings(5.0, 6, seed)
    blocks = wall.building.blocks()
    solids = wall.building.solids if closed else [block.solid for block in blocks]
    stones = [facing_stone(block, solid) for block, solid in zip(blocks, solids, strict=True)]
    core = propose_infill(stones, InfillSettings(shape=InfillShape.STOREYS, storey_height=0.8))
    assert len(core) >= 2
    # a plane behind the deepest of a hundred hidden sides that scatter by some millimetres
    assert 0.94 < sum(one.volume for one in core) / core_volume(wall) < 1.0
    rng = np.random.default_rng(seed)
    corners = np.array([solid.vertices for solid in solids if len(solid.vertices) == 8])
    weights = rng.dirichlet(np.full(8, 0.3), size=(len(corners), 6))
    points = (weights @ corners).reshape(-1, 3)
    # surveyed stones may reach across a bed by a few millimetres, as long as their joints are open
    shrunk = 1e-6 if closed else 0.05
    points = corners.mean(axis=1).repeat(6, axis=0) * shrunk + points * (1.0 - shrunk)
    for one in core:
        check_watertight(one.solid)
        assert not contains(one.solid, points).any()


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_solids_of_cells_are_closed_and_as_large_as_the_cells(data):
    shape = tuple(data.draw(st.integers(1, 4)) for _ in range(3))
    count = int(np.prod(shape))
    filled = np.array(data.draw(st.lists(st.booleans(), min_size=count, max_size=count))).reshape(shape)
    beds = np.array([[0.02, 1.0, 0.01, 0.3 * k] for k in range(shape[1] + 1)])
    levels = np.array([[0.01, -0.02, 1.0, -0.2 * k] for k in range(shape[2] + 1)])
    grid = CellGrid(0.5 * np.arange(shape[0] + 1.0), beds, levels, filled)
    solids = list(grid_solids(grid))
    for solid in solids:
        check_watertight(solid)
    # a cell between parallel planes is a parallelepiped: 0.5 · 0.3 · 0.2 over the determinant of the normals
    cell = 0.5 * 0.3 * 0.2 / np.linalg.det(np.array([[1.0, 0.0, 0.0], beds[0, :3], levels[0, :3]]))
    cells = sum(volume_of(solid) for solid in solids) / cell
    assert cells == pytest.approx(round(cells), abs=1e-9)
    assert round(cells) <= filled.sum()
    if not touches_at_an_edge(filled):
        assert round(cells) == filled.sum()


def touches_at_an_edge(filled):
    """Return whether two cells share an edge or a corner without a third beside both."""
    cells = {tuple(cell) for cell in np.argwhere(filled).tolist()}
    for one in cells:
        for step in np.ndindex(3, 3, 3):
            other = tuple(c + s - 1 for c, s in zip(one, step, strict=True))
            if other in cells and other != one:
                low, high = np.minimum(one, other), np.maximum(one, other)
                between = {
                    tuple(place)
                    for place in np.ndindex(*filled.shape)
                    if (low <= place).all() and (place <= high).all()
                }
                between -= {one, other}
                if between and not between & cells:
                    return True
    return False


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_parts_of_solids_of_cells_fill_them(data):
    shape = tuple(data.draw(st.integers(1, 4)) for _ in range(3))
    count = int(np.prod(shape))
    filled = np.array(data.draw(st.lists(st.booleans(), min_size=count, max_size=count))).reshape(shape)
    beds = np.array([[0.02 - 0.005 * k, 1.0, 0.01, 0.3 * k] for k in range(shape[1] + 1)])
    levels = np.array([[0.01, -0.02 + 0.01 * k, 1.0, -0.2 * k] for k in range(shape[2] + 1)])
    for solid in grid_solids(CellGrid(0.5 * np.arange(shape[0] + 1.0), beds, levels, filled)):
        parts = grid_parts(solid)
        assert parts is not None
        assert sum(volume_of(part) for part in parts) == pytest.approx(volume_of(solid), rel=1e-9)
        for part in parts:
            check_watertight(part, convex=True)
            inner = part.vertices.mean(axis=0) + 0.99 * (part.vertices - part.vertices.mean(axis=0))
            assert contains(solid, inner).all()
            for other in parts:
                assert other is part or not contains(other, inner).any()


def test_what_is_no_solid_of_cells_has_no_such_parts():
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert grid_parts(Solid("tetrahedron", corners, ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)))) is None


def test_a_storey_of_a_wall_has_parts():
    wall = two_facings(5.0, 6, 4)
    stones = [facing_stone(block) for block in wall.building.blocks()]
    for core in propose_infill(stones, InfillSettings(shape=InfillShape.STOREYS, storey_height=0.8)):
        parts = grid_parts(core.solid)
        assert parts is not None
        assert sum(volume_of(part) for part in parts) == pytest.approx(core.volume, rel=1e-9)
