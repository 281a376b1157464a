"""Equal blocks share their finite elements; blocks that differ in anything do not; results are the same."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.model.stone_groups import elastic_stones
from mechanics.scene.scene import Fidelity
from mechanics.stones.meshing.elements import Element
from tests.mechanics.shapes import LIMESTONE, TURN, brick, ground, moved, profile, rectangle, scene

SOFT = Fidelity.DEFORMABLE
SIZE = (0.4, 0.3, 0.2)


def stone(code="a", at=(0.0, 0.0, 0.0), size=SIZE, **more):
    more.setdefault("mesh_size", 0.15)
    return brick(code, at, tuple(np.add(at, size)), SOFT, **more)


def stones_of(*blocks):
    return build_model(scene(*blocks))[0].stones


@given(st.lists(st.tuples(*[st.floats(-100.0, 100.0)] * 3), min_size=2, max_size=4))
@settings(max_examples=25, deadline=None)
def test_equal_blocks_share_one_stone_wherever_they_lie(places):
    stones = stones_of(*(stone(str(k), at) for k, at in enumerate(places)))
    assert all(one is stones[0] for one in stones)


@pytest.mark.parametrize("factor", [1e-3, 1.0, 1e3])
def test_stones_of_any_size_are_shared(factor):
    blocks = [moved(stone(str(k), (0.7 * k, 0.1, 0.3)), scale=factor) for k in range(3)]
    stones = stones_of(*blocks)
    assert all(one is stones[0] for one in stones)


@pytest.mark.parametrize("element", [Element.TET4, Element.HEX8, Element.TET10])
def test_each_has_its_own_centre_and_nodes(element):
    places = (0, 0, 0), (1, 0, 0), (0.1, 2.0, 3.0)
    model, state = build_model(scene(*(stone(str(k), at, element=element) for k, at in enumerate(places))))
    for b, at in enumerate(places):
        nodes = state.node[model.nodes_of(b)]
        np.testing.assert_allclose(state.centre[b], np.add(at, SIZE) - 0.5 * np.array(SIZE), atol=1e-12)
        np.testing.assert_allclose(nodes.min(axis=0), at, atol=1e-12)
        np.testing.assert_allclose(nodes.max(axis=0), np.add(at, SIZE), atol=1e-12)


OTHERS = {
    "longer": {"size": (0.41, 0.3, 0.2)},
    "larger": {"size": (0.8, 0.6, 0.4)},
    "larger by a millionth": {"size": tuple(1.000001 * np.array(SIZE))},
    "lying otherwise": {"size": (0.3, 0.4, 0.2)},
    "finer": {"mesh_size": 0.1},
    "of another element": {"element": Element.HEX8},
    "stiffer": {"material": replace(LIMESTONE, young=2e9)},
    "heavier": {"material": replace(LIMESTONE, density=2100.0)},
    "of another Poisson's ratio": {"material": replace(LIMESTONE, poisson=0.25)},
    "damped": {"material": replace(LIMESTONE, mass_damping=1.0)},
}


@pytest.mark.parametrize("change", OTHERS.values(), ids=OTHERS)
def test_blocks_that_differ_have_stones_of_their_own(change):
    one, other, again = stones_of(stone("a"), stone("b", (1, 0, 0), **change), stone("c", (2, 0, 0)))
    assert one is again
    assert one is not other


@pytest.mark.parametrize("factor", [2.0, 10.0, 1.0 + 1e-6])
def test_similar_shapes_of_different_size_are_told_apart(factor):
    """Also with meshes of the same size, and with as many elements."""
    small = stone("small", mesh_size=0.3)
    large = moved(replace(small, code="large"), scale=factor, shift=(3, 0, 0))
    coarse = replace(large, mesh_size=3.0), replace(small, mesh_size=3.0)
    for blocks in ((small, large), coarse[::-1]):
        one, other = stones_of(*blocks)
        assert one is not other
        assert other.mass == pytest.approx(factor**3 * one.mass, rel=1e-9)
        np.testing.assert_allclose(np.ptp(other.mesh.nodes, axis=0), factor * np.array(SIZE), rtol=1e-9)


def test_turned_and_mirrored_blocks_have_stones_of_their_own():
    leaning = stone("a").vertices.copy()
    leaning[4:, 0] += 0.1
    one = replace(stone("a"), vertices=leaning)
    mirrored = leaning * [-1, 1, 1]
    order = [1, 0, 3, 2, 5, 4, 7, 6]
    other = replace(one, code="b", vertices=mirrored[order] + [2, 0, 0])
    turned = moved(replace(one, code="c"), TURN, (5, 0, 0))
    stones = stones_of(one, other, turned)
    assert len(set(map(id, stones))) == 3
    for made in stones:
        assert made.mass == pytest.approx(2000 * 0.4 * 0.3 * 0.2, rel=1e-9)


def test_stones_made_of_parts_keep_their_own_shapes():
    """Two outlines that are the same, cut into parts in two ways."""
    outline = [(0, 0), (0.6, 0), (0.6, 0.2), (0.2, 0.2), (0.2, 0.6), (0, 0.6)]
    upright = [rectangle(0, 0, 0.2, 0.6), rectangle(0.2, 0, 0.6, 0.2)]
    lying = [rectangle(0, 0, 0.6, 0.2), rectangle(0, 0.2, 0.2, 0.6)]
    one, other = (
        profile(code, outline, parts, 0.2, fidelity=SOFT, mesh_size=0.4)
        for code, parts in (("a", upright), ("b", lying))
    )
    first, second = stones_of(one, moved(other, shift=(2, 0, 0)))
    assert first is not second
    assert first.mass == pytest.approx(second.mass, rel=1e-9)


def test_lumped_and_consistent_masses_are_not_mixed():
    blocks = stone("a"), stone("b", (1, 0, 0))
    lumped = build_model(scene(*blocks, lumped_mass=True))[0].stones
    consistent = build_model(scene(*blocks))[0].stones
    assert lumped[0] is lumped[1]
    assert lumped[0].operators.mass.nnz < consistent[0].operators.mass.nnz


def test_equal_stones_come_in_one_group():
    blocks = (
        ground((-2, -2, -1), (8, 3, -0.5)),
        stone("a"),
        stone("b", (1, 0, 0), size=(0.5, 0.3, 0.2)),
        stone("c", (2, 0, 0)),
        brick("hard", (3, 0, 0), (3.5, 0.5, 0.5)),
        stone("d", (4, 0, 0)),
    )
    model, state = build_model(scene(*blocks))
    groups = {tuple(group.bodies): group for group in model.elastic_stones.groups}
    assert set(groups) == {(1, 3, 5), (2,)}
    for bodies, group in groups.items():
        for row, b in enumerate(bodies):
            assert model.stones[b] is group.stone
            own = model.nodes_of(b)
            np.testing.assert_array_equal(group.nodes[row], np.arange(own.start, own.stop))
            np.testing.assert_allclose(
                state.node[group.nodes[row]] - state.centre[b], group.stone.mesh.nodes, atol=1e-12
            )
    assert np.diff(model.elastic_stones.start)[[0, 4]].tolist() == [0, 0]
    assert model.elastic_stones.start[-1] == len(state.node)
    # the projector of each node is its columns of the stone's own
    packed = model.elastic_stones.projector
    v = np.random.default_rng(0).normal(size=state.node.shape)
    for b, one in enumerate(model.stones):
        if one is not None:
            rows = model.nodes_of(b)
            np.testing.assert_allclose(
                np.einsum("nij,nj->i", packed[rows], v[rows]), one.projector @ v[rows].ravel(), atol=1e-12
            )


def test_a_scene_without_elastic_stones_has_no_groups():
    packed = elastic_stones([None, None])
    assert packed.groups == ()
    assert packed.start.tolist() == [0, 0, 0]
    assert packed.reference.shape == (0, 3)
    assert packed.projector.shape == (0, 6, 3)


def test_shared_stones_move_as_separate_ones(monkeypatch):
    """A small pile with velocities: the same nodes after 20 steps, to rounding."""
    blocks = (
        ground(),
        stone("a", velocity=(0.6, 0, 0, 0, 0, 0)),
        stone("b", (0.5, 0, 0)),
        stone("c", (0.25, 0.0, 0.2), velocity=(0, 0, -0.5, 0, 0, 1.0)),
    )
    one = scene(*blocks, friction=0.2, step=1e-3, theta=0.75)

    def run():
        model, start = build_model(one)
        simulation = Simulation(model, start)
        steps = [simulation.step() for _ in range(20)]
        return model, steps[-1].after

    shared, first = run()

    monkeypatch.setattr("mechanics.model.stone_meshes.translation", lambda first, second: False)
    separate, second = run()
    assert len(shared.elastic_stones.groups) == 1
    assert len(separate.elastic_stones.groups) == 3
    assert np.abs(first.node_velocity).max() > 0.1
    np.testing.assert_allclose(first.node, second.node, atol=1e-9)
    np.testing.assert_allclose(first.node_velocity, second.node_velocity, atol=1e-6)
