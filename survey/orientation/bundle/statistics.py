"""Precision and reliability of a bundle adjustment.

The covariance of cameras and points for σ₀ = 1 is the inverse of the normal matrix; with the estimated σ₀² in
front of it, that
of the result. Where there is no control, it refers to the datum in which the points have the least total variance
(inner constraints over the points, by an S-transformation).
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpotri
from scipy.special import ndtri

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import CRITICAL, SAME
from survey.orientation._kernels.adjustment import datum_sums, point_statistics
from survey.orientation.bundle.adjustment import (
    Prepared,
    Solution,
    cholesky,
    inner_constraints,
    normals,
    prior,
    similarity,
    with_datum,
    without_datum,
)
from survey.orientation.bundle.lengths import LengthFit, fit_lengths
from survey.orientation.network import Network
from survey.orientation.rotations import angle_slopes

_DETECTABLE = CRITICAL + float(ndtri(0.8))  # noncentrality δ₀ for α₀ = 0.1 % and a power of 80 %
_MIN_EIGENVALUE = 1e-11  # smallest eigenvalue of the scaled normal matrix that is more than rounding


@dataclass(frozen=True)
class Statistics:
    """Precision and reliability of an adjustment.

    Attributes
    ----------
    redundancy : observations minus unknowns, the datum's included
    sigma0 : √(vᵀPv / redundancy); nan without redundancy
    cameras : (nr, nr) covariance of what is estimated at the cameras' side, for σ₀ = 1: rotation vectors [rad],
        stations [m], interior orientation
    points : (np, 3, 3) covariance of the points for σ₀ = 1 [m²]; zero where fixed, nan where unknown
    residuals : (n, 2) weighted residuals of the marks, measured minus computed, in the order of the network; nan where
        left out
    parts : (n, 2) redundancy number of each coordinate of a mark, between 0 and 1
    reach : (n, 2) movement of the point if a coordinate is wrong by one σ [m]
    lengths, length_tests : (m,) observed minus adjusted [m] of scale bars, then of plumb lines (x and y of each point
        above the first), and over their standard deviations; None: there are none
    """

    redundancy: int
    sigma0: float
    cameras: Array
    points: Array
    residuals: Array
    parts: Array
    reach: Array
    lengths: Array | None = None
    length_tests: Array | None = None

    @property
    def standardised(self) -> Array:
        """(n, 2) residuals over their own standard deviation, with the stated σ of the marks; 0 where unchecked."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(
                self.parts > SAME,
                self.residuals / np.sqrt(np.maximum(self.parts, SAME)),
                0.0,
            )

    @property
    def detectable(self) -> Array:
        """(n, 2) smallest blunder that the test finds with a probability of 80 %, in σ; inf where unchecked."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(
                self.parts > SAME,
                _DETECTABLE / np.sqrt(np.maximum(self.parts, SAME)),
                np.inf,
            )

    @property
    def external(self) -> Array:
        """(n, 2) movement of the point by a blunder that the test just does not find [m]; inf where unchecked."""
        return self.detectable * self.reach


def statistics(network: Network, prepared: Prepared, solution: Solution) -> Statistics:
    """Compute the statistics of an adjustment.

    Raises
    ------
    GeometryError
        if the observations do not determine the orientation, naming the photograph or camera that is least determined
    """
    unknowns = solution.unknowns
    normal = normals(network, prepared, unknowns, 0.0)[0]
    cameras = _inverse(with_datum(normal, prepared, unknowns), network, prepared)
    cameras = without_datum(cameras, prepared, unknowns)
    points = np.empty((len(network.names), 3, 3))
    per_ray = np.empty((len(prepared.order), 3, 2))
    known = prior(prepared, unknowns)
    point_statistics(prepared.rays, unknowns, known, cameras, points, per_ray)
    lengths = fit_lengths(network, prepared, unknowns, cameras)
    if lengths is not None:
        cameras, points = _by_lengths(lengths, cameras, points)
    elif prepared.datum:
        cameras, points = _to_points(prepared, solution, known, cameras, points)
    spread = np.full((len(network.photo), 3, 2), np.nan)
    spread[prepared.order] = per_ray
    redundancy = prepared.observations - prepared.count + prepared.datum
    square = solution.square
    if lengths is not None:
        redundancy, square = redundancy + lengths.redundancy, square + lengths.square
    return Statistics(
        redundancy,
        float(np.sqrt(square / redundancy)) if redundancy > 0 else float("nan"),
        cameras,
        points,
        spread[:, 0],
        spread[:, 1],
        spread[:, 2],
        None if lengths is None else lengths.residual,
        None if lengths is None else lengths.test,
    )


def _by_lengths(fit: LengthFit, cameras: Array, points: Array) -> tuple[Array, Array]:
    """Return covariances of cameras and points with what scale bars and plumb lines tell."""
    weight, free = fit.weight, fit.free_covariance
    cameras = (
        cameras - fit.by_cameras.T @ weight @ fit.by_cameras + fit.free_cameras @ free @ fit.free_cameras.T
    )
    points = (
        points
        - np.einsum("imx,mn,iny->ixy", fit.by_points, weight, fit.by_points)
        + np.einsum("ixg,gh,iyh->ixy", fit.free_points, free, fit.free_points)
    )
    return cameras, points


def _inverse(normal: Array, network: Network, prepared: Prepared) -> Array:
    """Invert the normal matrix of the cameras; name what it does not determine."""
    if not len(normal):
        return normal
    size = np.diag(normal).copy()
    names = prepared.columns
    worst, smallest = int(np.argmin(size)), 0.0
    if (size > 0.0).all():
        scale = 1.0 / np.sqrt(size)
        try:
            factor = cholesky(normal, scale)
        except np.linalg.LinAlgError:
            full = np.tril(normal) + np.tril(normal, -1).T
            _, vectors = np.linalg.eigh(full * scale[:, None] * scale)
            worst = int(np.argmax(np.abs(vectors[:, 0])))
        else:
            pivots = np.diag(factor) ** 2
            worst, smallest = int(np.argmin(pivots)), float(pivots.min())
            if smallest > _MIN_EIGENVALUE:
                upper = dpotri(factor, lower=0, overwrite_c=1)[0]
                out: Array = np.tril(upper.T)
                out += np.tril(out, -1).T
                out *= scale
                out *= scale[:, None]
                return out
    owner, parameter = names[worst]
    places = {camera.name: camera.where for camera in network.cameras} | {
        photo.name: photo.where for photo in network.photos
    }
    raise GeometryError(
        f"the marks do not determine {owner} ({parameter}): there is no sound datum, or points lie on a line",
        where=places.get(owner) or network.path,
        remedy="mark more points that are spread over the photograph, or more control points, not all on one line",
    )


def _to_points(
    prepared: Prepared, solution: Solution, priors: Array, cameras: Array, points: Array
) -> tuple[Array, Array]:
    """Refer covariances to the datum that the points define together."""
    unknowns = solution.unknowns
    arms = unknowns.point - unknowns.point[unknowns.free].mean(axis=0)
    moves = np.where(unknowns.free[:, None, None], similarity(arms), 0.0)
    gathered = np.zeros((7, len(cameras)))  # cov(t, c) and cov(t, p) of t = Σ Gᵀ p
    each = np.zeros((len(points), 7, 3))
    datum_sums(prepared.rays, unknowns, priors, cameras, moves, (gathered, each))
    total = np.einsum("iax,ixb->ab", each, moves)
    inverse = np.linalg.inv(np.einsum("ixa,ixb->ab", moves, moves))
    whole = inverse @ total @ inverse
    side = inner_constraints(prepared, unknowns)
    part = side @ inverse @ gathered
    cameras = cameras - part - part.T + side @ whole @ side.T
    mixed = np.einsum("ixa,ab,ibc->ixc", moves, inverse, each)
    points = points - mixed - mixed.transpose(0, 2, 1) + np.einsum("ixa,ab,iyb->ixy", moves, whole, moves)
    return cameras, points


def photo_precision(network: Network, prepared: Prepared, solution: Solution, result: Statistics) -> Array:
    """Return the covariance of ω, φ, κ [rad], X, Y, Z [m] of each photograph for σ₀ = 1, (nf, 6, 6); 0 where held."""
    out = np.zeros((len(network.photos), 6, 6))
    for f, place in enumerate(prepared.unknowns.column[:, :6]):
        if place[0] < 0:
            continue
        turn = np.eye(6)
        turn[:3, :3] = angle_slopes(solution.unknowns.rotation[f])
        out[f] = turn @ result.cameras[np.ix_(place, place)] @ turn.T
    return out
