"""Dense Delassus operator in plain numpy, for problems that need no scene."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array

from mechanics.problem._kernels import local_factors, solve_contact
from mechanics.problem.problem import mean_diagonal


@dataclass(frozen=True)
class DenseDelassus:
    """W (3 nc, 3 nc) as it is given; with `products_alone` it cannot be factorised."""

    w: np.ndarray
    products_alone: bool = False
    rigid = None
    plane = None
    joint_compliance = None
    mostly_rigid = False
    as_rigid = None

    @cached_property
    def diagonal(self):
        blocks = self.w.reshape((len(self.w) // 3, 3) * 2)
        n = np.arange(len(blocks))
        return blocks[n, :, n]

    @property
    def scale(self):
        return mean_diagonal(self.diagonal)

    @property
    def form(self):
        return None if self.products_alone else DenseForm(self.w)

    def apply(self, impulse):
        return (self.w @ impulse.ravel()).reshape(impulse.shape)

    def gauss_seidel(self, shift, friction, cohesion):
        def sweeps(impulse, count):
            for _ in range(count):
                slow_sweep(self.w, impulse, shift, friction, cohesion)

        return sweeps

    def scaled(self, unit):
        d = np.repeat(unit, 3)
        return replace(self, w=d[:, None] * self.w * d)


@dataclass(frozen=True)
class DenseForm:
    """Dense inverses."""

    w: np.ndarray

    @property
    def matrix(self):
        return csc_array(self.w)

    def shifted(self, theta, exact=True):
        matrix = self.w.copy()
        for c, block in enumerate(theta):
            matrix[3 * c : 3 * c + 3, 3 * c : 3 * c + 3] += block
        inverse = np.linalg.inv(matrix)
        return lambda b: inverse @ b


def blocks_apart(*blocks):
    """W of contacts that do not feel each other, each with its own block (3, 3)."""
    w = np.zeros((len(blocks), 3, len(blocks), 3))
    n = np.arange(len(blocks))
    w[n, :, n] = np.array(blocks).reshape(-1, 3, 3)
    return DenseDelassus(w.reshape((3 * len(blocks),) * 2))


def products_alone(problem):
    """The same problem with W known by its products alone."""
    w = [problem.delassus.apply(e.reshape(-1, 3)).ravel() for e in np.eye(problem.u_free.size)]
    return replace(problem, delassus=DenseDelassus(np.column_stack(w), products_alone=True))


def slow_sweep(w, r, shift, mu, cohesion):
    """One pass of Gauss–Seidel with dense rows; each contact is solved with the symmetric part of its own block."""
    for c in range(len(r)):
        rows = slice(3 * c, 3 * c + 3)
        local = 0.5 * (w[rows, rows] + w[rows, rows].T)
        b = shift[c] + w[rows] @ r.ravel() - local @ r[c]
        solve_contact(local_factors(local[None])[0], b, mu[c], cohesion[c], r[c])
