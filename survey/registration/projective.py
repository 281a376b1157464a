"""Projective maps of a plane: reduced coordinates, the direct linear transform, derivatives.

y = (A u + b) / (cᵀ u + 1). Coordinates are reduced to the order of 1 on both sides (Hartley 1997): there the
direct linear transform is well conditioned, and the last entry of the matrix may be held at 1, because the
denominator of a camera that has all points in front of it cannot vanish amid them.
"""

from dataclasses import dataclass

import numpy as np

from survey.arrays import Array


@dataclass(frozen=True)
class ReducedFrame:
    """Frame of reduced coordinates (p - centre) · scale, at a mean distance of √2 from the origin."""

    centre: Array
    scale: float

    def reduce(self, points: Array) -> Array:
        """Reduce the coordinates of points (…, 2)."""
        out: Array = (points - self.centre) * self.scale
        return out

    @property
    def matrix(self) -> Array:
        """Matrix (3, 3) for homogeneous coordinates."""
        s, (x, y) = self.scale, self.centre
        return np.array([[s, 0.0, -s * x], [0.0, s, -s * y], [0.0, 0.0, 1.0]])


def frame_of(points: Array) -> ReducedFrame:
    """Make the frame in which points (n, 2) lie about the origin, at a mean distance of √2."""
    centre = points[0] + (points - points[0]).mean(axis=0)
    return ReducedFrame(centre, float(np.sqrt(2.0) / np.linalg.norm(points - centre, axis=1).mean()))


def direct_homography(u: Array, y: Array) -> Array | None:
    """Compute the direct linear transform of reduced points, last entry 1; None if that vanishes."""
    ones, zeros = np.ones((len(u), 1)), np.zeros((len(u), 3))
    plain = np.hstack([u, ones])
    rows = np.vstack(
        [
            np.hstack([plain, zeros, -y[:, :1] * plain]),
            np.hstack([zeros, plain, -y[:, 1:] * plain]),
        ]
    )
    matrix = np.linalg.svd(rows, full_matrices=True)[2][-1].reshape(3, 3)
    if not abs(matrix[2, 2]) > 1e-9 * np.abs(matrix).max():
        return None
    out: Array = matrix / matrix[2, 2]
    return out


def mapped_points(matrix: Array, u: Array) -> tuple[Array, Array, Array]:
    """Map points, (…, 2); return the derivatives by the point (…, 2, 2) and by the parameters (…, 2, 8) too."""
    below = u @ matrix[2, :2] + 1.0
    mapped = (u @ matrix[:2, :2].T + matrix[:2, 2]) / below[..., None]
    by_point = (matrix[:2, :2] - mapped[..., :, None] * matrix[2, :2]) / below[..., None, None]
    by_parameter = np.zeros((*u.shape[:-1], 2, 8))
    direct = np.concatenate([u, np.ones((*u.shape[:-1], 1))], axis=-1) / below[..., None]
    by_parameter[..., 0, :3] = direct
    by_parameter[..., 1, 3:6] = direct
    by_parameter[..., 6:] = -mapped[..., :, None] * direct[..., None, :2]
    return mapped, by_point, by_parameter


def linearised(
    matrix: Array, u: Array, adjusted: Array, y: Array, variances: tuple[Array, Array]
) -> tuple[Array, Array, Array, Array]:
    """Return misclosures (n, 2), their covariances (n, 2, 2), derivatives by point and by parameter at `adjusted`."""
    mapped, by_point, by_parameter = mapped_points(matrix, adjusted)
    misclosures = y - mapped - np.einsum("nij,nj->ni", by_point, u - adjusted)
    of_image, of_plane = variances[0][:, None, None], variances[1][:, None, None]
    covariances = of_plane * np.eye(2) + of_image * by_point @ by_point.transpose(0, 2, 1)
    return misclosures, covariances, by_point, by_parameter
