"""Frames of a stone whose place and strain a test gives."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mechanics.model.model import build_model
from mechanics.results.postprocess import Observer
from mechanics.scene.scene import Fidelity
from tests.mechanics.shapes import LIMESTONE, brick, scene


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
