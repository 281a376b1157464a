"""The similarity y = t + s R x between two measured sets of points: closed form, then least squares.

Closed form (Horn 1987; Umeyama 1991): with the weighted centroids taken out and the singular values
U D Vᵀ = Σ w y xᵀ, the rotation is R = U S Vᵀ with S = diag(1, …, det U det V), which is never a reflection, and the
scale is s = tr(D S) / Σ w |x|². It takes the x as free of error.

Least squares with errors on both sides (Gauss–Helmert model; Pope 1972): the misclosure
rᵢ = yᵢ - t - s R xᵢ has the variance σᵢ² = σ_y² + s² σ_x² in every direction, and derivatives are taken at the
adjusted point x̂ᵢ = xᵢ + s σ_x²/σᵢ² Rᵀ rᵢ. Taken at the measured one, the scale would be biased.
"""

from dataclasses import dataclass

import numpy as np

from survey.arrays import Array, Bools
from survey.conventions import EPSILON, MAX_ITERATIONS
from survey.registration.outliers import Agreement, point_tests


@dataclass(frozen=True)
class Similarity:
    """y = target_centre + s R (x - source_centre), adjusted to two sets of points.

    Attributes
    ----------
    rotation : (3, 3) [-]
    scale : [-]
    source_centre, target_centre : (3,) weighted centroid of the adjusted points in either frame [m]
    covariance : (7, 7) of the translation there [m], the small rotation about the target's axes [rad] and
        the relative scale [-]
    residuals : (n, 3) target minus transformed source, of all points [m]
    verdict : tests of the residuals
    """

    rotation: Array
    scale: float
    source_centre: Array
    target_centre: Array
    covariance: Array
    residuals: Array
    verdict: Agreement


def best_similarity(
    source: Array, target: Array, weights: Array, mirrored: bool = False
) -> tuple[Array, float, Array, Array]:
    """Compute the least-squares similarity in closed form.

    Parameters
    ----------
    source, target : (n, d) corresponding points in the plane, d = 2, or in space, d = 3
    weights : (n,)
    mirrored : search among reflections instead of rotations

    Returns
    -------
    rotation (d, d), scale, source_centre (d,), target_centre (d,):
        y = target_centre + scale * rotation @ (x - source_centre)

    References
    ----------
    Umeyama (1991), Least-squares estimation of transformation parameters between two point patterns
    """
    share = weights / weights.sum()
    # about a point of the set, so that the sums keep their precision where coordinates are large
    source_centre = source[0] + share @ (source - source[0])
    target_centre = target[0] + share @ (target - target[0])
    x, y = source - source_centre, target - target_centre
    u, singular, v = np.linalg.svd((share[:, None] * y).T @ x)
    signs = np.ones(len(singular))
    signs[-1] = np.sign(np.linalg.det(u) * np.linalg.det(v)) * (-1.0 if mirrored else 1.0)
    scale = float(singular @ signs) / float(share @ (x * x).sum(axis=1))
    return (u * signs) @ v, scale, source_centre, target_centre


def adjust_similarity(
    source: Array,
    target: Array,
    sigmas: tuple[Array, Array],
    accepted: Bools,
    mirrored: bool = False,
) -> Similarity:
    """Fit a similarity in space to points that are uncertain in both frames.

    Parameters
    ----------
    source, target : (n, 3) corresponding points [m]
    sigmas : (n,) and (n,) standard deviation of a coordinate of the source, of the target [m]
    accepted : (n,) points to fit; they must not lie on one line
    mirrored : search among reflections instead of rotations

    Returns
    -------
    Similarity
    """
    some = np.flatnonzero(accepted)
    sx, sy = sigmas[0] ** 2, sigmas[1] ** 2
    spread = [np.linalg.norm(p[some] - p[some].mean(axis=0)) for p in (source, target)]
    guess = float(spread[1] / spread[0])
    rotation, scale, source_centre, target_centre = best_similarity(
        source[some], target[some], 1.0 / (sy + guess**2 * sx)[some], mirrored
    )
    x, y = source - source_centre, target - target_centre
    shift, size = np.zeros(3), float(spread[1]) / np.sqrt(len(some))
    before = (rotation, scale, shift)
    least = np.inf
    for _ in range(MAX_ITERATIONS):
        residuals, weights, arms = _linearised(x, y, (sx, sy), rotation, scale, shift)
        squares = float(weights[some] @ (residuals[some] ** 2).sum(axis=1))
        if squares > least * (1.0 + 1e-9):  # steps may diverge for sets that no similarity fits
            rotation, scale, shift = before
            break
        least, before = squares, (rotation, scale, shift)
        step = _step(residuals[some], weights[some], arms[some], size)
        shift = shift + step[:3]
        rotation = _turn(step[3:6]) @ rotation
        scale *= float(np.exp(np.clip(step[6], -1.0, 1.0)))
        if np.abs(step * [1.0, 1.0, 1.0, size, size, size, size]).max() <= EPSILON * size:
            break
    arms = _linearised(x, y, (sx, sy), rotation, scale, shift)[2]
    centre = np.average((arms[some] / scale) @ rotation, axis=0, weights=weights[some])
    shift = shift + scale * rotation @ centre
    return _result(
        (x - centre, y, (sx, sy), accepted),
        (rotation, scale, shift),
        (source_centre + centre, target_centre + shift),
        size,
    )


def _linearised(
    x: Array, y: Array, variances: tuple[Array, Array], rotation: Array, scale: float, shift: Array
) -> tuple[Array, Array, Array]:
    """Return misclosures (n, 3), their weights (n,) and the adjusted points less the shift (n, 3)."""
    moved = scale * x @ rotation.T
    residuals = y - shift - moved
    weights = 1.0 / (variances[1] + scale**2 * variances[0])
    return residuals, weights, moved + (scale**2 * variances[0] * weights)[:, None] * residuals


def _design(arms: Array) -> Array:
    """Return the derivatives of transformed points by translation, rotation and relative scale, (n, 3, 7)."""
    out = np.zeros((len(arms), 3, 7))
    out[:, [0, 1, 2], [0, 1, 2]] = 1.0
    out[:, [1, 2, 0], [3, 4, 5]] = -arms[:, [2, 0, 1]]
    out[:, [2, 0, 1], [3, 4, 5]] = arms[:, [1, 2, 0]]
    out[:, :, 6] = arms
    return out


def _normal_matrix(design: Array, weights: Array) -> Array:
    rows = (design * np.sqrt(weights)[:, None, None]).reshape(-1, 7)
    out: Array = rows.T @ rows
    return out


def _step(residuals: Array, weights: Array, arms: Array, size: float) -> Array:
    # angles and scale in units in which they move a point of the set by a metre
    units = np.array([1.0, 1.0, 1.0, 1.0 / size, 1.0 / size, 1.0 / size, 1.0 / size])
    design = _design(arms) * units
    right = np.einsum("nij,ni->j", design, weights[:, None] * residuals)
    out: Array = units * np.linalg.solve(_normal_matrix(design, weights), right)
    return out


def _turn(angles: Array) -> Array:
    """Return the rotation by a vector of angles (Rodrigues)."""
    angle = float(np.linalg.norm(angles))
    wx, wy, wz = angles
    cross = np.array([[0.0, -wz, wy], [wz, 0.0, -wx], [-wy, wx, 0.0]])
    half = np.sinc(angle / (2.0 * np.pi))
    out: Array = np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half**2 * cross @ cross
    return out


def _result(
    data: tuple[Array, Array, tuple[Array, Array], Bools],
    fitted: tuple[Array, float, Array],
    centres: tuple[Array, Array],
    size: float,
) -> Similarity:
    x, y, variances, accepted = data
    rotation, scale, shift = fitted
    residuals, weights, arms = _linearised(x, y, variances, rotation, scale, shift)
    design = _design(arms)
    units = np.array([1.0, 1.0, 1.0, 1.0 / size, 1.0 / size, 1.0 / size, 1.0 / size])
    inverse: Array = np.asarray(
        np.linalg.inv(_normal_matrix(design[accepted] * units, weights[accepted])), dtype=np.float64
    )
    covariance: Array = inverse * np.outer(units, units)
    tests, limits = point_tests(residuals, np.eye(3) / weights[:, None, None], design, covariance, accepted)
    squares = float((weights[:, None] * residuals**2)[accepted].sum())
    verdict = Agreement(squares, 3 * int(accepted.sum()) - 7, tests, limits, accepted)
    return Similarity(rotation, scale, *centres, covariance, residuals, verdict)
