"""Least-movement adjustment of corners onto planes that are unknown as well.

Unknown are the corners x_v and the planes (n_p, d_p). The squared movement Σ |x_v - x_v⁰|² is minimised, subject to
n_p·x_v = d_p for each corner v of each plane p. Every step solves the linearised problem (sequential quadratic
programming with the Hessian of the movement alone),

    | I        Aᵀ | | δx |   | x⁰ - x |
    |     μI   Bᵀ | | δp | = |   0    |
    | A   B   -δI | | λ  |   |  -g    |

with A, B the derivatives of the distances g by corners and by planes. A plane turns about two axes in it and shifts
along its normal; its turns are scaled by its own radius, so that all unknowns are lengths. δ makes the system
solvable where a corner has more planes than its three coordinates determine; the last steps start from the corners'
current positions, so that it leaves no error.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from survey.arrays import Array, Ints
from survey.conventions import EPSILON, MAX_ITERATIONS, ROUNDS, VANISHING


@dataclass(frozen=True)
class Settled:
    """Adjusted corners and planes.

    Attributes
    ----------
    vertices : (nv, 3) corners [m]
    normals : (np, 3) unit normals of the planes [-]
    residual : (ni,) distance of each corner from each of its planes [m]
    """

    vertices: Array
    normals: Array
    residual: Array


def settle(vertices: Array, corner: Ints, plane: Ints) -> Settled:
    """Move corners onto planes with the least total squared movement.

    Parameters
    ----------
    vertices : (nv, 3) initial corners [m]
    corner, plane : (ni,) corner and plane of each incidence; each plane has at least three corners, not on a line
    """
    centre = vertices.mean(axis=0)
    network = _Network(vertices - centre, corner, plane)
    size = float(np.abs(network.x).max())
    for _ in range(MAX_ITERATIONS):
        if network.step() <= EPSILON * size:
            break
    for _ in range(ROUNDS):
        network.start = network.x.copy()
        if network.step() <= EPSILON * size:
            break
    return Settled(network.x + centre, network.normal, network.distances())


class _Network:
    """Corners and planes during the iteration."""

    def __init__(self, vertices: Array, corner: Ints, plane: Ints) -> None:
        self.start, self.x = vertices.copy(), vertices.copy()
        self._corner, self._plane = corner, plane
        count = int(plane.max()) + 1 if len(plane) else 0
        share = 1.0 / np.bincount(plane, minlength=count)
        self._centre = np.zeros((count, 3))
        np.add.at(self._centre, plane, vertices[corner] * share[plane, None])
        lever = vertices[corner] - self._centre[plane]
        second = np.zeros((count, 3, 3))
        np.add.at(second, plane, lever[:, :, None] * lever[:, None, :] * share[plane, None, None])
        values, vectors = np.linalg.eigh(second)
        self._radius = np.sqrt(values[:, 2])
        self.normal, self._turns = vectors[:, :, 0], vectors[:, :, 1:]
        self._offset = np.zeros(count)

    def distances(self) -> Array:
        """Return the distance of each corner from each of its planes (ni,) [m]."""
        lever = self.x[self._corner] - self._centre[self._plane]
        out: Array = (self.normal[self._plane] * lever).sum(axis=1) - self._offset[self._plane]
        return out

    def step(self) -> float:
        """Do one step; return the largest movement of a corner [m]."""
        nv, count, ni = len(self.x), len(self._offset), len(self._corner)
        right = np.concatenate([(self.start - self.x).ravel(), np.zeros(3 * count), -self.distances()])
        solution = splu(self._matrix()).solve(right)
        move = solution[: 3 * nv].reshape(-1, 3)
        turn = solution[3 * nv : 3 * (nv + count)].reshape(-1, 3)
        self.x += move
        self._offset += turn[:, 2]
        tilt = (self._turns @ turn[:, :2, None])[:, :, 0] / self._radius[:, None]
        self.normal = self.normal + tilt
        self.normal /= np.linalg.norm(self.normal, axis=1)[:, None]
        first = self._turns[:, :, 0] - (self._turns[:, :, 0] * self.normal).sum(axis=1)[:, None] * self.normal
        first /= np.linalg.norm(first, axis=1)[:, None]
        self._turns = np.stack([first, np.cross(self.normal, first)], axis=2)
        return float(np.linalg.norm(move, axis=1).max(initial=0.0)) if ni else 0.0

    def _matrix(self) -> csc_array:
        """Return the symmetric matrix of the linearised problem."""
        nv, count, ni = len(self.x), len(self._offset), len(self._corner)
        lever = self.x[self._corner] - self._centre[self._plane]
        turns = np.einsum("ki,kij->kj", lever, self._turns[self._plane]) / self._radius[self._plane, None]
        values = np.column_stack([self.normal[self._plane], turns, -np.ones(ni)])
        columns = np.column_stack(
            [3 * self._corner[:, None] + np.arange(3), 3 * (nv + self._plane[:, None]) + np.arange(3)]
        )
        rows = 3 * (nv + count) + np.repeat(np.arange(ni), 6)
        diagonal = np.repeat([1.0, VANISHING, -VANISHING], [3 * nv, 3 * count, ni])
        every = np.arange(len(diagonal))
        flat = columns.ravel()
        matrix = coo_array(
            (
                np.concatenate([values.ravel(), values.ravel(), diagonal]),
                (np.concatenate([rows, flat, every]), np.concatenate([flat, rows, every])),
            ),
            shape=(len(diagonal), len(diagonal)),
        )
        return csc_array(matrix)
