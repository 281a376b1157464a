"""Frames of a stone whose place and strain a test gives."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechanics.model.model import build_model
from mechanics.results.postprocess import Observer
from mechanics.scene.scene import Fidelity, Start
from mechanics.simulate import simulate
from mechanics.stones.meshing.elements import Element
from tests.mechanics.shapes import LIMESTONE, brick, ground, scene


def test_the_stress_of_a_stone_turns_with_it():
    """A stone that is stretched along its own x by ε bears λ ε in all ways and 2 G ε along x, wherever x points."""
    strain, turn = 1e-4, Rotation.from_rotvec([0.3, -0.5, 0.9]).as_matrix()
    model, start = build_model(scene(brick("a", (0, 0, 0), (1, 1, 0.5), Fidelity.DEFORMABLE)))
    own = start.node - start.centre[0]
    node = start.centre[0] + (own * [1.0 + strain, 1.0, 1.0]) @ turn.T
    turned = replace(start, rotation=turn[None], node=node)
    shear = LIMESTONE.young / (2.0 * (1.0 + LIMESTONE.poisson))
    lame = 2.0 * shear * LIMESTONE.poisson / (1.0 - 2.0 * LIMESTONE.poisson)
    stress = strain * (lame * np.eye(3) + 2.0 * shear * np.outer(turn[:, 0], turn[:, 0]))
    expected = stress[[0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    (found,) = Observer(model, start).first_frame(turned).stresses
    assert found == pytest.approx(np.tile(expected, (len(found), 1)), rel=1e-6, abs=1e-6 * lame * strain)


@pytest.mark.parametrize("element", ["tet4", "tet10"])
@pytest.mark.parametrize("width", [0.5, 0.3])
def test_stress_of_a_stone_follows_from_the_forces_on_its_nodes(element, width):
    """At rest K d is the force of the contacts and of the weight on each node, of a stone between two others too."""
    stones = [
        brick("a", (0, 0, 0), (0.5, 0.4, 0.3), Fidelity.DEFORMABLE, element=Element(element)),
        brick("b", (0, 0, 0.3), (width, 0.4, 0.6), Fidelity.DEFORMABLE, element=Element(element)),
    ]
    one = scene(ground(), *stones, step=1e-3, theta=1.0, start=Start.EQUILIBRIUM, duration=0.05)
    result = simulate(one)
    frame, (model, _) = result.frames[-1], build_model(one)
    assert frame.nodal_forces[0] is None
    for body in (1, 2):
        stone, forces = model.stones[body], frame.nodal_forces[body]
        place = stone.mesh.nodes + result.bodies[body].position - result.bodies[body].reference
        inner = (stone.operators.stiffness @ (place - stone.mesh.nodes).ravel()).reshape(-1, 3)
        weight = stone.weight[:, None] * np.array([0.0, 0.0, -9.81])
        assert inner == pytest.approx(forces + weight, abs=1e-4 * stone.mass * 9.81)
        assert forces.sum(axis=0) == pytest.approx([0, 0, 9.81 * stone.mass], abs=1e-4 * 9.81 * stone.mass)
    assert result.frames[0].nodal_forces[1] == pytest.approx(0.0)
