"""W + Θ between rigid bodies against dense matrices, made column by column from W's own products."""

import numpy as np
import pytest

from ground.errors import SolverError
from mechanics.delassus._kernels import bodies as kernel
from tests.mechanics.shapes import brick, ground, posed, scene

PILE = (
    ground(),
    brick("a", (0, 0, 0), (0.5, 0.4, 0.3)),
    brick("b", (0.5, 0, 0), (1.0, 0.4, 0.3)),
    brick("c", (0.25, 0, 0.3), (0.75, 0.4, 0.5)),
    # touches nothing
    brick("d", (9, 9, 9), (9.5, 9.5, 9.5)),
)


@pytest.fixture(scope="module")
def pile():
    return posed(scene(*PILE))


def dense(operator):
    """W (3 nc, 3 nc)."""
    nc = len(operator.diagonal)
    return np.column_stack([operator.apply(e.reshape(nc, 3)).ravel() for e in np.eye(3 * nc)])


def blocks(theta):
    """Θ (nc, 3, 3) as a matrix (3 nc, 3 nc)."""
    matrix = np.zeros((3 * len(theta),) * 2)
    for c, block in enumerate(theta):
        matrix[3 * c : 3 * c + 3, 3 * c : 3 * c + 3] = block
    return matrix


def test_w_is_singular_and_has_contacts_with_fixed_and_moving_bodies(pile):
    """Otherwise the other tests would not say much."""
    values = np.linalg.eigvalsh(dense(pile.operator))
    assert values[0] < 1e-12 * values[-1]
    held = pile.model.fixed[pile.contacts.bodies].any(axis=1)
    assert held.any()
    assert not held.all()


@pytest.mark.parametrize("spread", [0.0, 3.0, 6.0])
def test_w_plus_theta_is_solved_for_unsymmetric_blocks_of_any_size(pile, spread):
    """Θ over 2 · `spread` decades: what the solution leaves of b is rounding."""
    rng = np.random.default_rng(4)
    nc, w = len(pile.contacts), dense(pile.operator)
    theta = np.eye(3) + 0.3 * rng.normal(size=(nc, 3, 3)) * [[0, 1, 1], [0, 0, 1], [0, 0, 0]]
    theta *= w.diagonal().mean() * 10.0 ** rng.uniform(-spread, spread, size=(nc, 1, 1))
    # from where forces come: velocities that the bodies can have, as W has nothing else to answer with
    b = w @ rng.normal(size=3 * nc)
    r = pile.operator.form.shifted(theta)(b)
    matrix = w + blocks(theta)
    assert np.abs(matrix @ r - b).max() < 1e-12 * np.abs(b).max()


def test_a_penalty_on_the_diagonal_is_solved_as_the_dense_system(pile):
    rng = np.random.default_rng(5)
    nc, w = len(pile.contacts), dense(pile.operator)
    for sigma in (1e-4 * w.diagonal().mean(), w.diagonal().mean()):
        b = rng.normal(size=3 * nc)
        found = sigma * pile.operator.form.shifted(np.tile(sigma * np.eye(3), (nc, 1, 1)))(b)
        np.testing.assert_allclose(
            found, np.linalg.solve(w / sigma + np.eye(3 * nc), b), atol=1e-9 * np.abs(b).max()
        )


def test_a_singular_theta_is_refused(pile):
    with pytest.raises(SolverError, match="singular"):
        pile.operator.form.shifted(np.zeros((len(pile.contacts), 3, 3)))


def test_inverses_are_those_of_numpy():
    rng = np.random.default_rng(6)
    given = rng.normal(size=(50, 3, 3)) + 3 * np.eye(3)
    np.testing.assert_allclose(kernel.inverses(given), np.linalg.inv(given), rtol=1e-10)
