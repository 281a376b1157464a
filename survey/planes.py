"""Least-squares planes through surveyed face points, robust to blunders.

The plane n·x = d minimises Σ w (n·x - d)², w = 1/σ². With the weighted centroid c taken out, n is the right
singular vector of the smallest singular value. In the axes e₁, e₂ of the other two singular vectors the normal
equations are diagonal, so the Gauss–Markov covariance is closed form and diagonal: the tilts θᵢ (δn = -Σ θᵢ eᵢ)
have variance σ²/sᵢ², the height at the centroid σ²/Σw. The offset d at the origin of coordinates would say
little of a face 10⁶ m away.

Blunders: one that is as far out as a stone is wide turns a least-squares plane so much that its own residual
looks harmless, so residuals of the first fit cannot be trusted. The search starts from planes through triples
of points: the one of least median distance (Rousseeuw 1984), which tolerates almost half of the points being
wrong, and, where the precision is known, the one of least truncated squares. From there the fit grows one
point at a time: a point enters, or leaves again, by the test of its standardised residual (Baarda 1968,
α₀ = 0.1 %).
"""

import math
from dataclasses import dataclass
from itertools import combinations
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

from moma.errors import GeometryError

__all__ = ["FaceFit", "fit_plane"]

Array = NDArray[np.float64]

_CRITICAL = 3.29  # two-sided normal quantile of Baarda's α₀ = 0.1 %
_MAX_TRIPLES = 3000  # up to 26 points all triples are tried; beyond, a seeded draw of so many
_UNCHECKED = 1e-9  # share of the others in a point's residual below which they say nothing of it
_COLLINEAR = 1e-9  # second singular value over the first below which there is no plane


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
    sigma0 : sqrt(Σ w r² / redundancy), 1 if the points are as precise as was said; in metres if no precision was
        given; nan without redundancy, because three points fit any plane
    redundancy : number of accepted points minus 3
    rejected : indices of the points left out as blunders
    residuals : (n,) signed distance of every given point from the plane, towards the observer [m]
    standardised : (n,) residual over its own standard deviation: sqrt(1 - h) of the point's where it is part of
        the fit, sqrt(1 + h) where it was rejected, h its leverage; nan where no other point checks it [-]
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
        """Standard deviation of the plane's height at places on or near it.

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
    """Fit a plane to the points of a face and leave blunders out.

    Parameters
    ----------
    points : (n, 3) surveyed points, n ≥ 3 [m]
    sigma : standard deviation of a coordinate, one for all or (n,) [m]; None if unknown: then all points weigh
        the same and the covariance is scaled by what the residuals say
    observer : (3,) the normal looks towards this point [m]; without it, its largest component is positive

    Returns
    -------
    FaceFit

    Raises
    ------
    GeometryError
        if there are fewer than three distinct points, or all lie on a line
    """
    xyz, weights = _checked(points, sigma)
    plain = _weighted_plane(xyz, weights, np.ones(len(xyz), dtype=bool))
    if _is_clean(plain, xyz, weights, sigma is not None):
        accepted = np.ones(len(xyz), dtype=bool)
    else:
        accepted = _without_blunders(xyz, weights, sigma is not None)
    return _result(
        _weighted_plane(xyz, weights, accepted), xyz, weights, accepted, sigma is not None, observer
    )


@dataclass(frozen=True)
class _Plane:
    """Weighted least-squares plane of a subset; rows of `vectors` are its singular vectors."""

    centroid: Array
    vectors: Array
    singular: Array
    total_weight: float

    def distances(self, xyz: Array) -> Array:
        out: Array = (xyz - self.centroid) @ self.vectors[2]
        return out

    def leverages(self, xyz: Array, weights: Array) -> Array:
        """Diagonal of the hat matrix: the share of each observation in its own fit."""
        lateral = (xyz - self.centroid) @ self.vectors[:2].T / self.singular[:2]
        out: Array = weights * (1.0 / self.total_weight + (lateral**2).sum(axis=1))
        return out


def _checked(points: ArrayLike, sigma: ArrayLike | None) -> tuple[Array, Array]:
    xyz = np.asarray(points, dtype=np.float64)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or len(xyz) < 3:
        raise GeometryError(
            f"a plane needs (n ≥ 3, 3) points, found {xyz.shape}", remedy="measure more points"
        )
    deviations = np.broadcast_to(1.0 if sigma is None else np.asarray(sigma, dtype=np.float64), len(xyz))
    if not (np.isfinite(xyz).all() and np.isfinite(deviations).all() and (deviations > 0.0).all()):
        raise GeometryError("coordinates must be finite and sigma positive", remedy="correct the measurement")
    return xyz, 1.0 / deviations**2


def _weighted_plane(xyz: Array, weights: Array, accepted: NDArray[np.bool_]) -> _Plane:
    some, w = xyz[accepted], weights[accepted]
    total = float(w.sum())
    centroid = (
        some[0] + (w @ (some - some[0])) / total
    )  # about a point of the face: exact at 10⁶ m from the origin
    _, singular, vectors = np.linalg.svd((some - centroid) * np.sqrt(w)[:, None], full_matrices=len(some) < 3)
    if not singular[1] > _COLLINEAR * singular[0]:
        raise GeometryError("the points lie on one line or coincide", remedy="measure points across the face")
    return _Plane(centroid, vectors, singular, total)


def _is_clean(plane: _Plane, xyz: Array, weights: Array, known: bool) -> bool:
    """Whether the plain fit passes every test, so that there is nothing to search for.

    The sum of squares catches blunders that hide each other from the single tests, given a precision.
    """
    redundancy = len(xyz) - 3
    if redundancy == 0:
        return True
    if not known:
        return False
    squares = weights * plane.distances(xyz) ** 2
    share = np.maximum(1.0 - plane.leverages(xyz, weights), 1e-6)
    return bool(squares.sum() <= _largest_sum(redundancy) and (squares <= _CRITICAL**2 * share).all())


def _largest_sum(redundancy: int) -> float:
    """Sum of squares that chance exceeds once in a thousand: chi-square after Wilson and Hilferty."""
    spread = 2.0 / (9.0 * redundancy)
    return redundancy * (1.0 - spread + 3.09 * math.sqrt(spread)) ** 3


def _without_blunders(xyz: Array, weights: Array, known: bool) -> NDArray[np.bool_]:
    """Accepted points, from the better of the starts."""
    distances = _distances_from_triples(xyz, weights)
    size = min(len(xyz) // 2 + 2, len(xyz))  # of p = 3 parameters: the majority that tolerates most blunders
    medians = np.partition(distances, size - 1, axis=1)[:, size - 1]
    grown = [_grow(_nearest(distances[np.argmin(medians)], size, xyz, weights), xyz, weights, known)]
    if not known:
        return grown[0]
    # the least median sees half of the points only; with a known precision all of them can be judged
    within = distances[np.argmin(np.minimum(distances**2, _CRITICAL**2).sum(axis=1))] <= _CRITICAL
    if within.sum() >= size:
        grown.append(_grow(within, xyz, weights, known))
    return min(grown, key=lambda accepted: _truncated(accepted, xyz, weights))


def _truncated(accepted: NDArray[np.bool_], xyz: Array, weights: Array) -> float:
    """Sum of squares of all points in units of sigma, in which no blunder counts more than the limit."""
    squares = weights * _weighted_plane(xyz, weights, accepted).distances(xyz) ** 2
    return float(np.minimum(squares, _CRITICAL**2).sum())


def _grow(start: NDArray[np.bool_], xyz: Array, weights: Array, known: bool) -> NDArray[np.bool_]:
    """Add the best point, or drop the worst, one at a time, until the next one is a blunder."""
    accepted, majority = start.copy(), min(len(xyz) // 2 + 2, len(xyz))
    for _ in range(4 * len(xyz)):
        plane = _weighted_plane(xyz, weights, accepted)
        distances, lever = np.sqrt(weights) * np.abs(plane.distances(xyz)), plane.leverages(xyz, weights)
        scale = _scale(distances[accepted], len(xyz), known)
        # a point in the fit pulls the plane towards itself, one outside does not: variances 1 - h and 1 + h
        share = np.where(accepted, np.maximum(1.0 - lever, 1e-6), 1.0 + lever)
        tests = distances / (scale * np.sqrt(share))
        worst = int(np.argmax(np.where(accepted, tests, 0.0)))
        best = int(np.argmin(np.where(accepted, np.inf, tests)))
        if tests[worst] > _CRITICAL and accepted.sum() > majority:
            accepted[worst] = False
        elif not accepted[best] and tests[best] <= _CRITICAL:
            accepted[best] = True
        else:
            break
    return accepted


def _scale(distances: Array, count: int, known: bool) -> float:
    """Standard deviation of the accepted points in units of sigma.

    With a known precision it is 1, or more where the face itself is clearly rough. Without, the best part of
    all points looks too good by a factor known for normal errors (the consistency factor of least trimmed
    squares).
    """
    part = len(distances) / count
    redundancy = max(len(distances) - 3, 1)
    squares = float(distances @ distances)
    raw = math.sqrt(squares / redundancy)
    if known:
        return raw if squares > _largest_sum(redundancy) else 1.0
    z = NormalDist().inv_cdf(0.5 + 0.5 * min(part, 1.0 - 1e-9))
    return max(raw / math.sqrt(1.0 - 2.0 * z * NormalDist().pdf(z) / part), 1e-300)


def _nearest(distances: Array, size: int, xyz: Array, weights: Array) -> NDArray[np.bool_]:
    """The `size` points nearest to a plane, and then to the plane through them, until they stay the same."""
    accepted = np.zeros(len(xyz), dtype=bool)
    for _ in range(20):
        nearest = np.argsort(distances, kind="stable")[:size]
        if accepted[nearest].all():
            break
        accepted[:] = False
        accepted[nearest] = True
        distances = np.sqrt(weights) * np.abs(_weighted_plane(xyz, weights, accepted).distances(xyz))
    return accepted


def _distances_from_triples(xyz: Array, weights: Array) -> Array:
    """Distances of all points, in units of sigma, from planes through three of them, (triples, n)."""
    triples = _triples(len(xyz))
    a, b, c = (xyz[triples[:, k]] - xyz[0] for k in range(3))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    usable = areas > 1e-3 * areas.max()
    normals, a = normals[usable] / areas[usable, None], a[usable]
    distances = normals @ (xyz - xyz[0]).T - (normals * a).sum(axis=1)[:, None]
    out: Array = np.sqrt(weights) * np.abs(distances)
    return out


def _triples(count: int) -> NDArray[np.intp]:
    if math.comb(count, 3) <= _MAX_TRIPLES:
        return np.array(list(combinations(range(count), 3)), dtype=np.intp)
    draw = np.random.default_rng(count).random((_MAX_TRIPLES, count))
    return np.argpartition(draw, 3, axis=1)[:, :3]


def _result(
    plane: _Plane,
    xyz: Array,
    weights: Array,
    accepted: NDArray[np.bool_],
    known: bool,
    observer: ArrayLike | None,
) -> FaceFit:
    """Orient the plane and give its precision."""
    towards = None if observer is None else np.asarray(observer, dtype=np.float64) - plane.centroid
    normal = plane.vectors[2] * _sign(plane.vectors[2], towards)
    residuals = (xyz - plane.centroid) @ normal
    redundancy = int(accepted.sum()) - 3
    squares = float((weights * residuals**2)[accepted].sum())
    sigma0 = math.sqrt(squares / redundancy) if redundancy else math.nan
    covariance = np.diag([*(1.0 / plane.singular[:2] ** 2), 1.0 / plane.total_weight])
    lever = plane.leverages(xyz, weights)
    share = np.where(accepted, 1.0 - lever, 1.0 + lever)
    share[share < _UNCHECKED] = math.nan
    mean_weight = plane.total_weight / float(accepted.sum())
    return FaceFit(
        normal=normal,
        offset=float(normal @ plane.centroid),
        centroid=plane.centroid,
        axes=plane.vectors[:2],
        singular_values=plane.singular / math.sqrt(mean_weight),
        covariance=covariance if known else covariance * sigma0**2,
        rms=math.sqrt(float((residuals[accepted] ** 2).mean())),
        sigma0=sigma0,
        redundancy=redundancy,
        rejected=tuple(int(i) for i in np.flatnonzero(~accepted)),
        residuals=residuals,
        standardised=residuals * np.sqrt(weights / share) / (1.0 if known else sigma0),
    )


def _sign(normal: Array, towards: Array | None) -> float:
    if towards is None:
        return float(np.sign(normal[np.argmax(np.abs(normal))]))
    return 1.0 if normal @ towards >= 0.0 else -1.0
