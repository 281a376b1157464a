"""Free flight of elastic stones: a rigid motion, and a deformation that rides on it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mechanics.dynamics.observers.energy import elastic_energy, kinetic_energy
from mechanics.dynamics.simulation import Clock, Simulation
from mechanics.dynamics.stepping import predict
from mechanics.model._kernels import Frames, deform, rigid_part
from mechanics.model.model import build_model
from mechanics.scene.scene import Fidelity
from mechanics.stones.meshing.elements import Element
from tests.mechanics.shapes import TURN, brick, ground, moved, scene

SOFT = Fidelity.DEFORMABLE
ELEMENTS = pytest.mark.parametrize("element", [Element.TET4, Element.HEX8, Element.TET10, Element.HEX20])
seeds = st.integers(0, 2**32 - 1)


def build(element=Element.TET4, lumped=False, **more):
    """Two elastic stones, the second turned, between a fixed and a rigid one."""
    size = {"mesh_size": 0.3, "element": element}
    blocks = (
        ground((5, 5, 5), (6, 6, 6)),
        brick("a", (0, 0, 0), (0.6, 0.4, 0.3), SOFT, **size),
        brick("hard", (2, 0, 0), (2.5, 0.3, 0.4), velocity=(1, 2, 3, 0.4, 2.0, -0.3)),
        moved(brick("b", (0, 0, 0), (0.3, 0.5, 0.7), SOFT, **size), TURN, (0, 3, 0)),
    )
    return build_model(scene(*blocks, gravity=(0, 0, 0), lumped_mass=lumped, **more))


@cache
def model_of(element=Element.TET4, lumped=False):
    return build(element, lumped)


def shaken(model, start, seed, strain=1e-2, pace=3.0):
    """A state in which all that moves is turned, strained, spinning and vibrating.

    Deformations have no rigid part, as the frames of a run see to it.
    """
    rng = np.random.default_rng(seed)
    turn = Rotation.random(len(start.centre), random_state=rng).as_matrix()
    turn[model.fixed] = np.eye(3)
    node, velocity = start.node.copy(), start.velocity.copy()
    node_velocity = pace * rng.normal(size=3) + rng.normal(size=start.node.shape)
    for b, stone in enumerate(model.stones):
        if stone is not None:
            own, rest = model.nodes_of(b), stone.mesh.nodes
            d = strain * rng.normal(size=rest.shape)
            d -= (stone.modes @ (stone.projector @ d.ravel())).reshape(-1, 3)
            node[own] = start.centre[b] + (rest + d) @ turn[b].T
            node_velocity[own] += np.cross(pace * rng.normal(size=3), rest @ turn[b].T)
        elif not model.fixed[b]:
            velocity[b] = pace * rng.normal(size=6)
    return replace(start, rotation=turn, node=node, node_velocity=node_velocity, velocity=velocity)


def momenta(model, state):
    """Linear momentum (3,) and spin about the centre (3,) of each stone, world axes; spin with undeformed arms.

    That is what a body has that is looked upon as small in strain.
    """
    result = []
    for b, stone in enumerate(model.stones):
        if stone is not None:
            local = (state.node_velocity[model.nodes_of(b)] @ state.rotation[b]).ravel()
            push = stone.modes.T @ (stone.operators.mass @ local)
            result.append((state.rotation[b] @ push[:3], state.rotation[b] @ push[3:]))
    return np.array(result)


def displacement(model, state):
    return [
        stone.displacement(state.node[model.nodes_of(b)], state.centre[b], state.rotation[b])
        for b, stone in enumerate(model.stones)
        if stone is not None
    ]


# --- the kernels against slow twins ---


def rigid_part_twin(model, rotation, node_velocity):
    motion, rate = np.zeros((len(rotation), 6)), np.zeros_like(node_velocity)
    for b, stone in enumerate(model.stones):
        if stone is None:
            continue
        own = model.nodes_of(b)
        local = node_velocity[own] @ rotation[b]
        # the rigid motion next to it, in the norm of M: a least-squares problem
        mass = stone.operators.mass.toarray()
        s = np.linalg.solve(stone.modes.T @ mass @ stone.modes, stone.modes.T @ mass @ local.ravel())
        rate[own] = local - (s[:3] + np.cross(s[3:], stone.mesh.nodes))
        motion[b] = np.concatenate([rotation[b] @ s[:3], rotation[b] @ s[3:]])
    return motion, rate


def deform_twin(model, centre, rotation, node, rate, duration, new_centre, new_rotation, motion):
    place, velocity = np.zeros_like(node), np.zeros_like(node)
    for b, stone in enumerate(model.stones):
        if stone is None:
            continue
        own, rest = model.nodes_of(b), stone.mesh.nodes
        d = (node[own] - centre[b]) @ rotation[b] - rest + duration * rate[own]
        place[own] = new_centre[b] + (rest + d) @ new_rotation[b].T
        velocity[own] = motion[b, :3] + np.cross(motion[b, 3:], rest @ new_rotation[b].T)
        velocity[own] += rate[own] @ new_rotation[b].T
    return place, velocity


@ELEMENTS
@pytest.mark.parametrize("lumped", [False, True])
def test_the_rigid_part_is_that_of_the_slow_twin(element, lumped):
    model, start = model_of(element, lumped)
    state = shaken(model, start, 1)
    own = model.elastic_stones
    motion, rate = rigid_part(own.start, own.reference, own.projector, state.rotation, state.node_velocity)
    slow = rigid_part_twin(model, state.rotation, state.node_velocity)
    np.testing.assert_allclose(motion, slow[0], atol=1e-11)
    np.testing.assert_allclose(rate, slow[1], atol=1e-11)
    # bodies without nodes are left out
    np.testing.assert_array_equal(motion[~model.elastic], 0.0)


@pytest.mark.parametrize("duration", [0.0, 1e-3, 2.0])
def test_deformed_places_are_those_of_the_slow_twin(duration):
    model, start = model_of()
    state, other = shaken(model, start, 2), shaken(model, start, 3)
    rng = np.random.default_rng(4)
    rate, motion = rng.normal(size=start.node.shape), rng.normal(size=(len(start.centre), 6))
    centre = start.centre + rng.normal(size=start.centre.shape)
    own = model.elastic_stones
    fast = deform(
        own.start, own.reference, Frames(state.centre, state.rotation), state.node, rate, duration,
        Frames(centre, other.rotation), motion,
    )  # fmt: skip
    slow = deform_twin(
        model, state.centre, state.rotation, state.node, rate, duration, centre, other.rotation, motion
    )
    for one, twin in zip(fast, slow, strict=True):
        np.testing.assert_allclose(one, twin, atol=1e-12)


# --- what a flight keeps ---


@given(seeds, st.sampled_from([1e-4, 0.05, 1.0]))
@settings(max_examples=30, deadline=None)
def test_momentum_and_kinetic_energy_are_kept_to_rounding(seed, duration):
    model, start = model_of()
    before = shaken(model, start, seed)
    after = predict(model, start, before, duration)
    p, q = momenta(model, before), momenta(model, after)
    np.testing.assert_allclose(q, p, atol=1e-11 * np.abs(p).max())
    assert kinetic_energy(model, after) == pytest.approx(kinetic_energy(model, before), rel=1e-11)
    assert after.time == before.time + duration


@ELEMENTS
@pytest.mark.parametrize("lumped", [False, True])
def test_they_are_kept_with_all_elements_and_masses(element, lumped):
    model, start = model_of(element, lumped)
    before = shaken(model, start, 5)
    after = predict(model, start, before, 0.1)
    p, q = momenta(model, before), momenta(model, after)
    np.testing.assert_allclose(q, p, atol=1e-11 * np.abs(p).max())
    assert kinetic_energy(model, after) == pytest.approx(kinetic_energy(model, before), rel=1e-11)


@given(seeds)
@settings(max_examples=30, deadline=None)
def test_the_deformation_grows_at_a_rate_without_rigid_part(seed):
    model, start = model_of()
    before, duration = shaken(model, start, seed), 0.02
    after = predict(model, start, before, duration)
    again = predict(model, start, before, 2.0 * duration)
    stones = [stone for stone in model.stones if stone is not None]
    was, now, later = (displacement(model, state) for state in (before, after, again))
    for stone, d0, d1, d2 in zip(stones, was, now, later, strict=True):
        rate = (d1 - d0) / duration
        assert np.abs(rate).max() > 0.1
        # as long as it flies, the rate is one and the same
        np.testing.assert_allclose((d2 - d0) / (2.0 * duration), rate, atol=1e-10)
        assert np.abs(stone.projector @ rate.ravel()).max() < 1e-10
        assert np.abs(stone.projector @ d1.ravel()).max() < 1e-11


def test_the_frame_follows_the_mean_motion_of_the_nodes():
    """The centre of mass of the nodes is that of the frame, and moves on a straight line."""
    model, start = model_of()
    before = shaken(model, start, 6)
    after = predict(model, start, before, 0.7)
    for b, stone in enumerate(model.stones):
        if stone is not None:
            own = model.nodes_of(b)
            mean = stone.weight @ after.node[own] / stone.mass
            pace = stone.weight @ before.node_velocity[own] / stone.mass
            np.testing.assert_allclose(mean, after.centre[b], atol=1e-12)
            np.testing.assert_allclose(after.centre[b], before.centre[b] + 0.7 * pace, atol=1e-12)
            # frames of elastic stones carry no velocity of their own
            np.testing.assert_array_equal(after.velocity[b], 0.0)


@pytest.mark.parametrize("duration", [1e-3, 1.0, 30.0])
@pytest.mark.parametrize("spin", [0.1, 50.0])
def test_turning_strains_nothing(spin, duration):
    """However far and fast: no deformation, no energy, frames as those of a rigid stone of the same inertia."""
    block = brick("a", (0, 0, 0), (0.6, 0.4, 0.3), SOFT, mesh_size=0.2, element=Element.HEX8)
    velocity = (0.3, -1.0, 2.0, *(spin * np.array([0.5, 0.8, -0.3])))
    flown = []
    for fidelity, size in ((SOFT, 0.2), (Fidelity.RIGID, None)):
        own = replace(block, fidelity=fidelity, mesh_size=size, velocity=velocity)
        model, start = build_model(scene(own))
        flown.append((model, start, predict(model, start, start, duration)))
    (model, _, soft), (_, _, hard) = flown
    assert np.abs(displacement(model, soft)[0]).max() < 1e-12 * (1.0 + duration * np.abs(velocity).max())
    assert elastic_energy(model, soft) < 1e-12 * kinetic_energy(model, soft)
    np.testing.assert_allclose(soft.centre, hard.centre, atol=1e-10)
    if spin * duration < 100:
        np.testing.assert_allclose(soft.rotation, hard.rotation, atol=1e-9)


def test_a_stone_that_only_vibrates_does_not_turn():
    model, start = model_of()
    rng = np.random.default_rng(7)
    node_velocity = start.node_velocity.copy()
    for b, stone in enumerate(model.stones):
        if stone is not None:
            v = rng.normal(size=stone.mesh.nodes.shape)
            v -= (stone.modes @ (stone.projector @ v.ravel())).reshape(-1, 3)
            node_velocity[model.nodes_of(b)] = v
    after = predict(model, start, replace(start, node_velocity=node_velocity), 0.01)
    for b in np.flatnonzero(model.elastic):
        np.testing.assert_allclose(after.rotation[b], np.eye(3), atol=1e-13)
        np.testing.assert_allclose(after.centre[b], start.centre[b], atol=1e-13)
    np.testing.assert_allclose(after.node, start.node + 0.01 * node_velocity, atol=1e-13)
    np.testing.assert_allclose(after.node_velocity, node_velocity, atol=1e-13)


def test_rigid_stones_fly_as_if_alone():
    model, start = model_of()
    before = shaken(model, start, 8)
    after = predict(model, start, before, 0.3)
    hard = 2
    np.testing.assert_allclose(
        after.centre[hard], before.centre[hard] + 0.3 * before.velocity[hard, :3], atol=1e-12
    )
    spins = []
    for state in (before, after):
        turn = state.rotation[hard]
        spins.append(turn @ model.inertia.inertia[hard] @ turn.T @ state.velocity[hard, 3:])
    np.testing.assert_allclose(spins[1], spins[0], rtol=1e-10)
    np.testing.assert_array_equal(after.centre[0], start.centre[0])


def test_momentum_is_kept_through_kicks_too():
    """200 steps of 1 ms with elastic forces and centrifugal ones: they push no stone as a whole."""
    model, start = build(step=1e-3, theta=0.5)
    simulation = Simulation(model, start, Clock())
    simulation.state = before = shaken(model, start, 9, strain=1e-4)
    for _ in range(200):
        after = simulation.step().after
    p, q = momenta(model, before), momenta(model, after)
    np.testing.assert_allclose(q, p, atol=1e-9 * np.abs(p).max())
