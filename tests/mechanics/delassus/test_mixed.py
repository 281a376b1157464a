"""Sweeps over contacts of rigid and deformable stones against a slow twin; products are tested where W is assembled."""

import numpy as np
import pytest

from mechanics.scene.scene import Fidelity
from tests.mechanics.shapes import TURN, brick, dense_operator, ground, moved, posed, scene, slow_pass


@pytest.fixture(scope="module")
def case():
    soft = Fidelity.DEFORMABLE
    stones = (
        ground((-1, -1, -0.4), (2, 2, 0)),
        brick("soft", (0, 0, 0), (0.7, 0.5, 0.4), soft, mesh_size=0.5),
        brick("hard", (0.2, 0.1, 0.4), (0.9, 0.5, 0.7)),
        brick("upper", (0.1, 0, 0.7), (0.7, 0.4, 1.0), soft, mesh_size=0.5),
    )
    one = posed(scene(*(moved(stone, TURN) for stone in stones)))
    w_hat, transpose = dense_operator(one.model, one.state, one.contacts, one.compliance)
    return one, transpose @ w_hat @ transpose.T


@pytest.mark.parametrize("count", [1, 2, 5])
def test_sweeps_are_those_of_the_slow_twin_forth_and_back(case, count):
    one, dense = case
    rng, contacts = np.random.default_rng(3), len(one.contacts)
    size = 1.0 / np.abs(one.operator.diagonal).mean()
    shift, start = rng.normal(size=(contacts, 3)) - [0.5, 0, 0], size * rng.normal(size=(contacts, 3))
    mu, cohesion = rng.uniform(0, 1, contacts), 0.3 * size * rng.integers(0, 2, contacts)
    fast, slow = start.copy(), start.copy()
    one.operator.gauss_seidel(shift, mu, cohesion)(fast, count)
    forth = np.arange(contacts)
    for n in range(count):
        slow_pass(dense, slow, shift, mu, cohesion, forth if n % 2 == 0 else forth[::-1])
    np.testing.assert_allclose(fast, slow, atol=1e-8 * np.abs(slow).max())
    assert 0.1 < (slow[:, 0] == 0).mean() < 0.9


def test_rigid_bodies_alone_answer_with_a_velocity_of_their_own(case):
    one, _ = case
    change = one.operator.rigid_change(np.ones((len(one.contacts), 3)))
    assert np.abs(change[2]).max() > 0
    np.testing.assert_array_equal(change[[0, 1, 3]], 0.0)
