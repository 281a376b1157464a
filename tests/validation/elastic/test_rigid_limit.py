"""Stiffer and stiffer stones against rigid ones: reactions, places and motion tend to those of the rigid engine."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from tests.validation.elastic.elastic_blocks import resting
from tests.validation.masonry import semicircular_arch
from tests.validation.scenes import G, box, ground, moved, rotation, tilted_gravity

# from 10 GPa to 10⁴ GPa
YOUNGS = (1e10, 1e11, 1e12, 1e13)
DENSITY = 2400.0


def slope(values):
    """d log value / d log E by least squares up to 10³ GPa, beyond which the solver's tolerance shows [-]."""
    return np.polyfit(np.log10(YOUNGS[:3]), np.log10(values[:3]), 1)[0]


def elastic(block: Block, young, size, element=Element.HEX8) -> Block:
    """A rigid block made elastic; fixed ones stay."""
    if block.fidelity is Fidelity.FIXED:
        return block
    material = Material("stone", DENSITY, young, 0.2)
    return replace(block, fidelity=Fidelity.DEFORMABLE, mesh_size=size, element=element, material=material)


def joints(result):
    """Pairs of bodies that touch (nj, 2), ascending, and force and moment about the origin in each (nj, 6)."""
    bodies, force, point = result.contacts.bodies, result.contacts.force, result.contacts.point
    turned = bodies[:, 0] > bodies[:, 1]
    pair = np.sort(bodies, axis=1)
    force = np.where(turned[:, None], force, -force)
    wrench = np.column_stack([force, np.cross(point, force)])
    keys, at = np.unique(pair, axis=0, return_inverse=True)
    return keys, np.array([wrench[at == k].sum(axis=0) for k in range(len(keys))])


LEAN = 4.0


def leaning_stack():
    """Four stones on each other, on a table that leans by 4°: statically determinate."""
    material = Material("stone", DENSITY, 1e10, 0.2)
    half, rise = 0.2, 0.3
    stones = [box(f"{k}", [-half, -half, k * rise], [half, half, (k + 1) * rise], material) for k in range(4)]
    return [ground(half=1.0), *stones]


def test_joints_of_a_leaning_stack_bear_as_between_rigid_stones():
    """Force and moment in each joint differ from those of statics by the deflection, ∝ 1/E: 1e-8 at 10⁴ GPa.

    Places differ with a slope of -1 ± 0.05 in E, forces and moments with one of -0.9 at least.
    """
    blocks = leaning_stack()
    weight = DENSITY * G * 0.4**2 * 0.3
    direction = np.array(tilted_gravity(LEAN)) / G
    errors, places = [], []
    for young in YOUNGS:
        result = resting(
            "lean",
            [elastic(block, young, 0.2) for block in blocks],
            gravity=tilted_gravity(LEAN),
            tolerance=1e-10,
            balance=1e-6,
            step=1e-2,
        )
        keys, found = joints(result)
        assert keys.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4]]
        exact = []
        for k in range(4):
            force = -(4 - k) * weight * direction
            # the weights act in the middle of the stones above
            middle = np.array([0.0, 0.0, 0.3 * (k + 4) / 2])
            exact.append([*force, *np.cross(middle, force)])
        scale = np.linalg.norm(exact[0])
        errors.append(np.abs(found - exact).max() / scale)
        places.append(max(np.abs(body.displacement).max() for body in result.bodies[1:]))
    assert slope(places) == pytest.approx(-1.0, abs=0.05)
    assert slope(errors) < -0.9
    assert errors[-1] < 1e-8


def rigid_turn(reference, place):
    """Rotation (3, 3) that takes points nearest to where they are now, both (n, 3) (Kabsch 1976)."""
    u, _, vt = np.linalg.svd((place - place.mean(axis=0)).T @ (reference - reference.mean(axis=0)))
    return (u * [1.0, 1.0, np.linalg.det(u @ vt)]) @ vt


@pytest.mark.slow
def test_a_rocking_block_tends_to_the_rigid_one():
    """A block released at half its slenderness: its path until and after the impact, elastic against rigid, same step.

    0.25 × 0.25 × 1 m, h = 0.5 ms, θ = 1: the angle over the first rocking differs by less than 2 % of the slenderness
    from 100 GPa on.
    """
    width, height = 0.25, 1.0
    alpha = np.arctan(width / height)
    turn = rotation([0, 1, 0], -np.degrees(alpha / 2))
    material = Material("stone", DENSITY, 1e10, 0.2)
    low, high = [0.0, -width / 2, 0.0], [width, width / 2, height]
    rigid = moved(box("block", low, high, material), turn)
    # it stands on the edge at the origin, leaning back over it
    rigid = replace(rigid, vertices=rigid.vertices - [0.0, 0.0, rigid.vertices[:, 2].min()])

    def angle(block):
        scene = Scene(
            "rock",
            (ground(half=2.0), block),
            contact=ContactSettings(DryJoint(0.8)),
            time=TimeSettings(5e-4, 1.0, 0.8, stop_at_equilibrium=False),
            solver=SolverSettings(tolerance=1e-9),
            frame_every=4,
        )
        result = simulate(scene)
        reference = result.bodies[1].reference
        axes = [rigid_turn(reference, frame.positions[1]) @ turn[:, 2] for frame in result.frames]
        return np.array([np.arctan2(axis[0], axis[2]) for axis in axes])

    exact = angle(rigid)
    error = [np.abs(angle(elastic(rigid, young, 0.25)) - exact).max() / alpha for young in YOUNGS]
    assert max(error[1:]) < 0.02


def test_a_sliding_stack_moves_as_the_rigid_one():
    """Two stones that slide and hold on an incline: places after 0.1 s tend to the rigid ones, to 1e-7 m.

    The way of the centres falls with 1/E; what friction locks into elastic stones where they stop falls more slowly,
    and shows below 1e-8 m (solved to η ≤ 1e-10 and 1e-12 the places differ by 1e-13 m).
    """
    material = Material("stone", DENSITY, 1e10, 0.2)
    blocks = [
        ground(half=2.0),
        box("lower", [-0.2, -0.2, 0.0], [0.2, 0.2, 0.2], material, velocity=(0.5, 0, 0, 0, 0, 0)),
        box("upper", [-0.1, -0.1, 0.2], [0.1, 0.1, 0.3], material),
    ]

    def places(stones):
        scene = Scene(
            "slide",
            tuple(stones),
            gravity=tilted_gravity(10.0),
            contact=ContactSettings(DryJoint(0.4)),
            time=TimeSettings(1e-3, 1.0, 0.1, stop_at_equilibrium=False),
            solver=SolverSettings(tolerance=1e-10),
        )
        return np.array([body.position.mean(axis=0) for body in simulate(scene).bodies[1:]])

    exact = places(blocks)
    errors = [np.abs(places([elastic(b, young, 0.2) for b in blocks]) - exact).max() for young in YOUNGS]
    assert errors[-1] < 1e-7
    assert np.log10(errors[1] / errors[0]) < -0.9
    assert slope(errors) < -0.8


@pytest.mark.slow
@pytest.mark.parametrize(("young", "allowed"), [(1e10, 0.07), (1e11, 0.01), (1e13, 0.01)])
def test_an_arch_that_is_too_thin_falls_as_the_rigid_one(young, allowed):
    """Nine voussoirs 0.09 m thick on a mean radius of 1 m, for 0.25 s: the crown sinks by 27 mm, all stones alike.

    From 100 GPa on no stone is farther from its rigid twin than 1 % of that, hinges and all; at 10 GPa 7 %.
    """
    rigid = semicircular_arch(9, 0.09)

    def centres(stones):
        scene = Scene(
            "arch",
            tuple(stones),
            contact=ContactSettings(DryJoint(0.7)),
            time=TimeSettings(1e-3, 1.0, 0.25, stop_at_equilibrium=False),
            solver=SolverSettings(tolerance=1e-9),
        )
        return np.array([body.displacement.mean(axis=0) for body in simulate(scene).bodies])

    exact = centres(rigid)
    largest = np.linalg.norm(exact, axis=1).max()
    assert largest == pytest.approx(0.027, rel=0.05)
    found = centres([elastic(block, young, 0.1) for block in rigid])
    assert np.linalg.norm(found - exact, axis=1).max() < allowed * largest
