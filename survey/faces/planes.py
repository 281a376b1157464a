"""Least-squares planes through surveyed face points, robust to outliers.

The plane n·x = d minimises Σ w (n·x - d)², w = 1/σ². With the weighted centroid c taken out, n is the right
singular vector of the smallest singular value. In the axes e₁, e₂ of the other two singular vectors the normal
equations are diagonal, so the Gauss–Markov covariance is closed form and diagonal: the tilts θᵢ (δn = -Σ θᵢ eᵢ)
have variance σ²/sᵢ², the height at the centroid σ²/Σw. The offset d at the origin of coordinates would be
useless for a face 10⁶ m away.

Outliers: one that is as far out as a stone is wide turns a least-squares plane so much that its own residual
looks harmless, so residuals of the first fit cannot be trusted. The search starts from planes through triples
of points: the one of least median distance (Rousseeuw 1984), which tolerates almost half of the points being
wrong, and, where the precision is known, those of least truncated squares. From each the fit grows one point at
a time: a point enters, or leaves again, by the test of its standardised residual (Baarda 1968, α₀ = 0.1 %). The
one with the least truncated squares is kept, where a point that lies a little in front of the face counts twice:
stones erode and mortar recedes behind the face, and nothing grows out of it. Points far beside the face are left
out first, unless all points lie on one plane to rounding: where they happen to lie near the prolonged plane, they
would outvote all others. Other estimators are compared on such faces in docs/design/survey-planes.md.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import PARALLEL

_LARGEST_TILT = PARALLEL  # standard deviation of a tilt beyond which a plane is refused


@dataclass(frozen=True)
class FaceFit:
    """Plane n·x = d fitted to one stone face.

    Attributes
    ----------
    normal : (3,) unit vector towards the observer [-]
    offset : signed distance of the plane from the origin [m]
    centroid : (3,) weighted mean of the accepted points; it lies on the plane [m]
    axes : (2, 3) unit directions in the plane, of largest and of smaller spread [-]
    singular_values : (3,) of the accepted, centred points, unweighted if all weigh the same [m]
    covariance : (3, 3) of two tilts [rad] and the height of the plane at `centroid` [m], diagonal; tilt i turns
        the normal towards -axes[i]
    rms : root mean square of the accepted residuals [m]
    sigma0 : sqrt(Σ w r² / redundancy), 1 if the points are as precise as stated; in metres if no precision was
        given; nan without redundancy, because three points fit any plane
    redundancy : number of accepted points minus 3
    rejected : indices of the outliers, which the fit leaves out
    residuals : (n,) signed distance of every given point from the plane, towards the observer [m]
    standardised : (n,) residual over its own standard deviation, which is that of the point times sqrt(1 - h) in
        the fit and sqrt(1 + h) where it was rejected, h its leverage; nan where no other point checks it [-]
    """

    normal: Array
    offset: float
    centroid: Array
    axes: Array
    singular_values: Array
    covariance: Array
    rms: float
    sigma0: float
    redundancy: int
    rejected: tuple[int, ...]
    residuals: Array
    standardised: Array

    def height_sigma(self, points: ArrayLike) -> Array:
        """Compute the standard deviation of the plane's height at places on or near it.

        Parameters
        ----------
        points : (n, 3) [m]

        Returns
        -------
        (n,) sqrt(var(height at the centroid) + Σ var(tiltᵢ) uᵢ²), uᵢ the place along axes[i] [m]
        """
        lateral = (np.asarray(points, dtype=np.float64) - self.centroid) @ self.axes.T
        variances = self.covariance.diagonal()
        out: Array = np.sqrt(variances[2] + lateral**2 @ variances[:2])
        return out


def fit_plane(points: ArrayLike, sigma: ArrayLike | None, observer: ArrayLike | None = None) -> FaceFit:
    """Fit a plane to the points of a face and leave outliers out.

    Parameters
    ----------
    points : (n, 3) surveyed points, n ≥ 3 [m]
    sigma : standard deviation of a coordinate, one for all or (n,) [m]; None if unknown: then all points weigh
        the same and the residuals scale the covariance
    observer : (3,) the normal looks towards this point [m]; without it, its largest component is positive

    Returns
    -------
    FaceFit

    Raises
    ------
    GeometryError
        if a number is wrong, if there are fewer than three distinct points, if they lie on one line or on a strip
        so narrow that a tilt has a standard deviation of more than 10°. A face turned so far puts the hidden side
        of a stone 0.4 m deep 70 mm aside, and the first-order covariance no longer describes it.

    Examples
    --------
    >>> face = [(x, 0.0, z) for x in (0.0, 0.3, 0.6) for z in (0.0, 0.2, 0.4)]
    >>> fit = fit_plane([*face, (0.3, 0.08, 0.1)], 0.003, observer=(0.3, -5.0, 0.0))
    >>> [round(float(component), 6) + 0.0 for component in fit.normal]
    [0.0, -1.0, 0.0]
    >>> fit.rejected  # 80 mm behind the face
    (9,)
    """
    from survey.faces._kernels.robust_fit import FINE, fit_face  # numba: readers of fits do without it

    xyz, deviations = _checked(points, sigma)
    towards = np.full(3, math.nan) if observer is None else np.ascontiguousarray(observer, dtype=np.float64)
    status, frame, accepted, residuals, standardised, covariance, (offset, rms, sigma0) = fit_face(
        xyz, deviations, sigma is not None, towards
    )
    if status != FINE:
        raise _refusal(status, xyz, deviations)
    if max(covariance[0, 0], covariance[1, 1]) > _LARGEST_TILT**2:
        raise _unknown_tilt(xyz[accepted], math.sqrt(covariance[1, 1]))
    rejected = () if accepted.all() else tuple(np.flatnonzero(~accepted).tolist())
    return FaceFit(
        normal=frame[3],
        offset=offset,
        centroid=frame[0],
        axes=frame[1:3],
        singular_values=frame[4],
        covariance=covariance,
        rms=rms,
        sigma0=sigma0,
        redundancy=len(xyz) - len(rejected) - 3,
        rejected=rejected,
        residuals=residuals,
        standardised=standardised,
    )


def _checked(points: ArrayLike, sigma: ArrayLike | None) -> tuple[Array, Array]:
    """Return points (n, 3) and a standard deviation for each (n,), 1 where none is known; refuse other shapes."""
    xyz = np.ascontiguousarray(points, dtype=np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or len(xyz) < 3:
        raise GeometryError(
            f"a plane needs (n ≥ 3, 3) points, found {xyz.shape}", remedy="measure more points"
        )
    deviations = np.empty(len(xyz))
    if sigma is not None and np.shape(sigma) not in ((), deviations.shape):
        raise GeometryError(
            f"{np.shape(sigma)} standard deviations for {len(xyz)} points", remedy="give one, or one of each"
        )
    deviations[:] = 1.0 if sigma is None else sigma
    return xyz, deviations


def _refusal(status: int, xyz: Array, deviations: Array) -> GeometryError:
    """Return the error that explains why there is no plane."""
    from survey.faces._kernels.robust_fit import NOT_FINITE, SIGMA

    if status == NOT_FINITE:
        number = int(np.argmin(np.isfinite(xyz).all(axis=1)))
        return GeometryError(
            f"point {number + 1} is not finite: {xyz[number]}", remedy="correct the measurement"
        )
    if status == SIGMA:
        number = int(np.argmin((deviations > 1e-100) & (deviations < 1e100)))
        return GeometryError(
            f"standard deviation of point {number + 1} is {deviations[number]:g} m",
            remedy="give a positive one",
        )
    distinct, remedy = len(np.unique(xyz, axis=0)), "measure points across the face"
    if distinct == 1:
        return GeometryError(f"all {len(xyz)} points coincide", remedy=remedy)
    length, width = _extent(xyz)
    if distinct == 2:
        what = f"only 2 of {len(xyz)} points are distinct: they lie on one line, {length:.3g} m long"
    else:
        what = f"the points lie on one line, {length:.3g} m long and {width:.2g} m wide"
    return GeometryError(what, remedy=remedy)


def _unknown_tilt(xyz: Array, tilt: float) -> GeometryError:
    length, width = _extent(xyz)
    return GeometryError(
        f"{len(xyz)} points, {length:.3g} m by {width:.2g} m: the tilt of their plane is not known better than "
        f"{math.degrees(min(tilt, math.pi / 2.0)):.0f}° (1 sigma)",
        remedy="measure points across the face",
    )


def _extent(xyz: Array) -> tuple[float, float]:
    """Return length and width of a narrow set of points [m]."""
    centred = xyz - xyz[0]
    centred -= centred.mean(axis=0)
    along = np.linalg.svd(centred, full_matrices=False)[2]
    extents = np.ptp(centred @ along.T, axis=0)
    return float(extents[0]), float(extents[1])


def with_shared_errors(
    fit: FaceFit, points: Array, sigma: Array, joint: Array, roughness: float = 0.0
) -> FaceFit:
    """Return a fit whose covariance counts the errors that its points share.

    The plane stays. Its axes and its centre are chosen anew, so that its tilts and its height there are
    uncorrelated again.

    Parameters
    ----------
    fit : of the points
    points, sigma : (n, 3) and (n,) as for `fit_plane` [m]
    joint : (9n²,) covariance of their coordinates, by rows [m²]
    roughness : standard deviation of the surface about its plane, which `joint` does not count [m]
    """
    used = np.setdiff1d(np.arange(len(points)), fit.rejected)
    rows = np.column_stack([(points[used] - fit.centroid) @ fit.axes.T, np.ones(len(used))])
    weights = sigma[used] ** -2.0
    gain = np.linalg.solve(rows.T @ (weights[:, None] * rows), rows.T * weights)
    count = len(points)
    heights = np.einsum("a,iajb,b->ij", fit.normal, joint.reshape(count, 3, count, 3), fit.normal)
    covariance = gain @ (heights[np.ix_(used, used)] + roughness**2 * np.eye(len(used))) @ gain.T
    tilts, turn = np.linalg.eigh(covariance[:2, :2])
    tilts = np.maximum(tilts, 1e-18)
    across = turn.T @ covariance[:2, 2]
    shift = -across / tilts
    reach = float(np.abs(rows[:, :2]).max())
    shift = np.clip(
        shift, -10.0 * reach, 10.0 * reach
    )  # two perfectly correlated errors would send it far away
    axes = turn.T @ fit.axes
    centroid = fit.centroid + shift @ axes
    height = covariance[2, 2] + 2.0 * shift @ across + shift**2 @ tilts
    return replace(fit, axes=axes, centroid=centroid, covariance=np.diag([*tilts, max(float(height), 1e-18)]))
