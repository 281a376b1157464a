"""Simulated stone faces, and their exact truth."""

from dataclasses import dataclass

import mpmath
import numpy as np
from scipy.spatial.transform import Rotation

# rows of 9 R and 3 R for rotations R by integer quaternions: rational, so whatever they turn is known exactly
NINTHS = np.array([[1, -8, 4], [4, 4, 7], [-8, 1, 4]])
THIRDS = np.array([[2, -1, 2], [2, 2, -1], [-1, 2, 2]])


def turned(rng):
    """Draw a uniform random rotation (3, 3)."""
    return Rotation.from_quat(np.roll(rng.normal(size=4), -1)).as_matrix()


@dataclass
class TrueFace:
    """A plane face: its corner points and points on it, without errors, and where it is."""

    points: np.ndarray
    normal: np.ndarray
    place: np.ndarray

    @property
    def observer(self):
        return self.place + 20.0 * self.normal


def face(rng, inner=10, length=0.6, height=0.3, turn=None, place=(0.0, 0.0, 0.0)):
    """Draw a rectangular face with `inner` points on it and then its four corners."""
    turn = turned(rng) if turn is None else turn
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [length / 2, height / 2]
    some = rng.uniform(-0.5, 0.5, (inner, 2)) * [length, height]
    flat = np.column_stack([np.vstack([some, corners]), np.zeros(inner + 4)])
    return TrueFace(flat @ turn.T + place, turn[:, 2], np.asarray(place, dtype=float))


@dataclass
class PrecisePlane:
    """Result of `precise_plane`; multiprecision numbers, in arrays of objects."""

    normal: np.ndarray
    offset: mpmath.mpf
    centroid: np.ndarray
    singular: np.ndarray
    tilt_variance: np.ndarray
    height_variance: mpmath.mpf
    squares: mpmath.mpf
    heights: np.ndarray


def precise_plane(points, sigmas, accepted, digits=50):
    """Compute total least squares by the definition, in many digits: the eigenvectors of Σ w (p - c)(p - c)ᵀ.

    `tilt_variance` is that of the normal's error, the (3, 3) matrix Σ e eᵀ / λ over the two directions e in the plane.
    """
    with mpmath.workdps(digits):
        all_points = np.array([[mpmath.mpf(float(x)) for x in p] for p in points], dtype=object)
        xyz = all_points[accepted]
        weights = np.array(
            [1 / mpmath.mpf(float(s)) ** 2 for s in np.asarray(sigmas)[accepted]], dtype=object
        )
        total = weights.sum()
        centroid = (weights @ xyz) / total
        centred = xyz - centroid
        values, vectors = mpmath.eigsy(mpmath.matrix((centred.T @ (centred * weights[:, None])).tolist()))
        e = np.array(vectors.tolist(), dtype=object).T  # rows, in ascending order of the eigenvalues
        variance = sum(np.outer(e[k], e[k]) / values[k] for k in (1, 2))
        heights = (all_points - centroid) @ e[0]
        return PrecisePlane(
            normal=e[0],
            offset=e[0] @ centroid,
            centroid=centroid,
            singular=np.array([mpmath.sqrt(abs(values[k])) for k in (2, 1, 0)], dtype=object),
            tilt_variance=variance,
            height_variance=1 / total,
            squares=(weights * heights[accepted] ** 2).sum(),
            heights=heights,
        )
