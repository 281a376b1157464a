"""The homography between a photograph of a plane and the plane.

A pinhole camera maps a plane on its image by y = (A u + b) / (cᵀ u + 1). The direct linear transform in reduced
coordinates (Hartley 1997) starts a least-squares adjustment with errors on both sides (Gauss–Helmert model): the
misclosure y - h(u) has the covariance σ_y² I + σ_u² J Jᵀ, J = ∂h/∂u, taken at the adjusted image point. Reduced
coordinates have their origin amid the marks, where the denominator of a camera that has all of them in front of
it cannot vanish, so the last entry of the matrix can be held at 1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from ground.errors import GeometryError
from survey.arrays import Array, Bools
from survey.conventions import ENOUGH, EPSILON, GROSS, MAX_ITERATIONS
from survey.registration.outliers import Agreement, find_outliers, point_tests
from survey.registration.projective import (
    ReducedFrame,
    direct_homography,
    frame_of,
    linearised,
    mapped_points,
)

_TESTABLE = ENOUGH  # least number of points without the outliers: any four agree exactly
_APART = GROSS  # least distance of a point from another or from a line, in standard deviations


@dataclass(frozen=True)
class Homography:
    """y = (A u + b) / (cᵀ u + 1) in coordinates reduced on both sides.

    Attributes
    ----------
    reduced : (3, 3) [[A, b], [cᵀ, 1]]
    image_frame, plane_frame : frames of the reduced coordinates of the image and of the plane
    covariance : (8, 8) of the first eight entries of `reduced`, row by row
    residuals : (n, 2) point of the plane minus mapped image point [m]
    image_residuals : (n, 2) image point minus mapped point of the plane [px]
    standardised : (n,) length of each residual in terms of its own standard deviations; nan where the other
        points do not control it [-]
    limits : (n,) value of `standardised` that a sound point exceeds once in a thousand [-]
    sigma0 : sqrt(Σ rᵀ Q⁻¹ r / redundancy), 1 if the points are as precise as stated; nan without redundancy
    redundancy : twice the number of accepted points minus 8
    rejected : indices of the outliers, which the fit leaves out
    """

    reduced: Array
    image_frame: ReducedFrame
    plane_frame: ReducedFrame
    covariance: Array
    residuals: Array
    image_residuals: Array
    standardised: Array
    limits: Array
    sigma0: float
    redundancy: int
    rejected: tuple[int, ...]

    @property
    def matrix(self) -> Array:
        """Matrix (3, 3) from homogeneous image coordinates [px] to those of the plane [m], last entry 1."""
        full = np.linalg.inv(self.plane_frame.matrix) @ self.reduced @ self.image_frame.matrix
        out: Array = full / full[2, 2]
        return out

    def horizon(self, image: ArrayLike) -> Array:
        """Return the denominator at image points (…, 2): 1 amid the marks, 0 on the horizon of the plane [-]."""
        u = self.image_frame.reduce(np.asarray(image, dtype=np.float64))
        out: Array = u @ self.reduced[2, :2] + 1.0
        return out

    def apply(self, image: ArrayLike) -> Array:
        """Map image points (…, 2) [px] to the plane, (…, 2) [m]."""
        mapped, _, _ = mapped_points(
            self.reduced, self.image_frame.reduce(np.asarray(image, dtype=np.float64))
        )
        out: Array = self.plane_frame.centre + mapped / self.plane_frame.scale
        return out

    def covariance_at(self, image: ArrayLike, image_sigma: ArrayLike) -> Array:
        """Compute the covariance of mapped image points from the homography and their own precision.

        Parameters
        ----------
        image : (n, 2) [px]
        image_sigma : standard deviation of an image coordinate, one for all or (n,) [px]

        Returns
        -------
        (n, 2, 2) [m²]
        """
        u = self.image_frame.reduce(np.asarray(image, dtype=np.float64))
        _, by_point, by_parameter = mapped_points(self.reduced, u)
        sigma = np.asarray(image_sigma, dtype=np.float64) * self.image_frame.scale
        own = np.broadcast_to(sigma**2, len(u))[:, None, None] * by_point @ by_point.transpose(0, 2, 1)
        carried = by_parameter @ self.covariance @ by_parameter.transpose(0, 2, 1)
        out: Array = (own + carried) / self.plane_frame.scale**2
        return out


def fit_homography(
    image: ArrayLike,
    image_sigma: ArrayLike,
    plane: ArrayLike,
    plane_sigma: ArrayLike,
    names: Sequence[str] | None = None,
) -> Homography:
    """Fit the homography that maps a photograph to a plane, and leave outliers out.

    Parameters
    ----------
    image : (n, 2) points on the photograph, n ≥ 4 [px]
    image_sigma : standard deviation of an image coordinate, one for all or (n,) [px]
    plane : (n, 2) the same points in the plane [m]
    plane_sigma : standard deviation of a coordinate in the plane, one for all or (n,) [m]
    names : of the points, for errors; None: "mark 1", "mark 2", …

    Returns
    -------
    Homography

    Raises
    ------
    GeometryError
        if there are fewer than four points, if all but one are on a line, if no camera has all of them in
        front of it, or if points contradict each other and the wrong one cannot be identified; the error names
        the points

    References
    ----------
    Hartley (1997), In defense of the eight-point algorithm; Hartley & Zisserman (2004), Multiple view geometry,
    § 4.4 and 5.2
    """
    u, y = np.asarray(image, dtype=np.float64), np.asarray(plane, dtype=np.float64)
    labels = [f"mark {i + 1}" for i in range(len(u))] if names is None else list(names)
    if len(u) < 4 or u.shape != y.shape or u.shape[1:] != (2,):
        raise GeometryError(
            f"a homography needs (n ≥ 4, 2) points in image and plane, found {u.shape} and {y.shape}",
            remedy="mark four or more points, spread over the photograph",
        )
    sigmas = np.array(
        [np.broadcast_to(np.asarray(s, dtype=np.float64), len(u)) for s in (image_sigma, plane_sigma)]
    )
    values = np.hstack([u, y, sigmas.T])
    if not (np.isfinite(values).all() and (sigmas >= 0.0).all() and (sigmas.sum(axis=0) > 0.0).all()):
        raise GeometryError("coordinates must be finite and sigma positive", remedy="correct the marks")
    return _without_outliers(_Marks(u, y, sigmas[0], sigmas[1]), labels)


@dataclass(frozen=True)
class _Marks:
    """Points in image and plane with their precision."""

    image: Array
    plane: Array
    image_sigma: Array
    plane_sigma: Array


def _without_outliers(marks: _Marks, names: list[str]) -> Homography:
    everything = np.ones(len(names), dtype=bool)
    _check_spread(marks, names)
    fits: dict[bytes, tuple[Homography, Agreement]] = {}

    def judge(accepted: Bools) -> Agreement | None:
        """Return the agreement of the accepted marks; None where they give no homography."""
        if _aligned(marks, accepted) is not None:
            return None
        try:
            # an outlier may lie on the horizon
            with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
                fit = _adjust(marks, accepted)
        except np.linalg.LinAlgError:  # far from any homography a step may become singular
            return None
        if fit is None:
            return None
        fits[accepted.tobytes()] = fit
        return fit[1]

    found = find_outliers(len(names), _TESTABLE, judge)
    accepted = everything.copy()
    accepted[list(found.rejected)] = False
    if not found.suspects:
        return fits[accepted.tobytes()][0]
    if everything.tobytes() not in fits:
        raise GeometryError(
            "no camera has all the marks in front of it: their order around the photograph is not that on the wall",
            where=", ".join(names[i] for i in _beyond(marks)),
            remedy="look for marks with exchanged positions",
        )
    fit = fits[everything.tobytes()][0]
    lengths = np.linalg.norm(fit.image_residuals, axis=1)
    worst = int(np.argmax(lengths))
    raise GeometryError(
        f"the {len(names)} marks contradict each other: {names[worst]} is {lengths[worst]:.1f} px off, all are "
        f"{fit.sigma0:.1f} times less precise than stated, and the wrong one cannot be identified",
        where=", ".join(names[i] for i in found.suspects),
        remedy="measure these again, leave a wrong one out, state a larger sigma, or mark more points",
    )


def _check_spread(marks: _Marks, names: list[str]) -> None:
    line = _aligned(marks, np.ones(len(names), dtype=bool))
    if line is not None:
        raise GeometryError(
            "all marks but one lie on one line, or marks coincide: they determine no homography",
            where=", ".join(names[i] for i in line),
            remedy="mark four points of which no three are on a line",
        )


def _aligned(marks: _Marks, accepted: Bools) -> tuple[int, ...] | None:
    """Return the points of a line that all but one distinct point lie on; None if four are in general position."""
    index = np.flatnonzero(accepted)
    for points, sigma in ((marks.image, marks.image_sigma), (marks.plane, marks.plane_sigma)):
        local = points[index] - points[index[0]]
        least = max(_APART * float(sigma[index].max()), 1e-7 * float(np.ptp(local, axis=0).max()))
        apart = np.linalg.norm(local[:, None] - local[None], axis=2) > least
        distinct = [i for i in range(len(index)) if apart[i, :i].all()]
        if len(distinct) < 4:
            return tuple(int(index[i]) for i in range(len(index)) if apart[i].sum() != len(index) - 1)
        for i, j in combinations(distinct, 2):
            run = (local[j] - local[i]) / np.linalg.norm(local[j] - local[i])
            off = np.abs((local - local[i]) @ np.array([-run[1], run[0]]))
            if (off[distinct] > least).sum() <= 1:
                return tuple(int(k) for k in index[off <= least])
    return None


def _beyond(marks: _Marks) -> tuple[int, ...]:
    """Return the marks that the direct linear transform puts behind the camera; all if it is inconclusive."""
    u, y = frame_of(marks.image).reduce(marks.image), frame_of(marks.plane).reduce(marks.plane)
    matrix = direct_homography(u, y)
    side = np.zeros(len(u), dtype=bool) if matrix is None else u @ matrix[2, :2] + 1.0 <= 0.0
    few = side if 2 * side.sum() < len(side) else ~side
    return tuple(np.flatnonzero(few if 0 < 2 * few.sum() < len(few) else np.ones(len(u))).tolist())


def _adjust(marks: _Marks, accepted: Bools) -> tuple[Homography, Agreement] | None:
    """Fit by least squares; return None if some point is not in front of the camera."""
    frames = frame_of(marks.image[accepted]), frame_of(marks.plane[accepted])
    u, y = frames[0].reduce(marks.image), frames[1].reduce(marks.plane)
    variances = (marks.image_sigma * frames[0].scale) ** 2, (marks.plane_sigma * frames[1].scale) ** 2
    matrix = direct_homography(u[accepted], y[accepted])
    # an outlier may lie anywhere: only accepted points have to be in front of the camera
    if matrix is None or (u[accepted] @ matrix[2, :2] + 1.0).min() <= 0.0:
        return None
    adjusted = u.copy()
    for _ in range(MAX_ITERATIONS):
        misclosures, covariances, by_point, by_parameter = linearised(matrix, u, adjusted, y, variances)
        weights = np.linalg.inv(covariances)
        turned = by_parameter.transpose(0, 2, 1) @ weights
        normal = (turned @ by_parameter)[accepted].sum(axis=0)
        step = np.linalg.solve(normal, np.einsum("nij,nj->i", turned[accepted], misclosures[accepted]))
        matrix = matrix + np.append(step, 0.0).reshape(3, 3)
        left = misclosures - by_parameter @ step
        adjusted = u + variances[0][:, None] * np.einsum("nji,njk,nk->ni", by_point, weights, left)
        adjusted[~accepted] = u[~accepted]
        if not ((adjusted[accepted] @ matrix[2, :2] + 1.0).min() > 0.0):
            return None
        if np.abs(step).max() <= EPSILON:
            break
    return _result(marks, accepted, (matrix, *frames), linearised(matrix, u, adjusted, y, variances))


def _result(
    marks: _Marks,
    accepted: Bools,
    fitted: tuple[Array, ReducedFrame, ReducedFrame],
    terms: tuple[Array, Array, Array, Array],
) -> tuple[Homography, Agreement]:
    matrix, image_frame, plane_frame = fitted
    misclosures, covariances, _, by_parameter = terms
    weights = np.linalg.inv(covariances)
    normal = (by_parameter.transpose(0, 2, 1) @ weights @ by_parameter)[accepted].sum(axis=0)
    covariance = np.linalg.inv(normal)
    tests, limits = point_tests(misclosures, covariances, by_parameter, covariance, accepted)
    squares = float(np.einsum("ni,nij,nj->n", misclosures, weights, misclosures)[accepted].sum())
    redundancy = 2 * int(accepted.sum()) - 8
    u, y = image_frame.reduce(marks.image), plane_frame.reduce(marks.plane)
    inverse = np.linalg.inv(matrix)
    back = mapped_points(inverse / inverse[2, 2], y)[0]
    fit = Homography(
        reduced=matrix,
        image_frame=image_frame,
        plane_frame=plane_frame,
        covariance=covariance,
        residuals=(y - mapped_points(matrix, u)[0]) / plane_frame.scale,
        image_residuals=(u - back) / image_frame.scale,
        standardised=tests,
        limits=limits,
        sigma0=float(np.sqrt(squares / redundancy)) if redundancy else float("nan"),
        redundancy=redundancy,
        rejected=tuple(int(i) for i in np.flatnonzero(~accepted)),
    )
    return fit, Agreement(squares, redundancy, tests, limits, accepted)
