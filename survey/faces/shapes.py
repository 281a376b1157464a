"""Shape of a face: one plane, or bevelled, curved or rough."""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri, fdtri

from survey.arrays import Array, Bools
from survey.conventions import FEW, ODDS, RARE, STEEPEST, VANISHING
from survey.faces._kernels.shapes import fit_columns, fit_two_planes, grow_columns, truncated_sum
from survey.faces.planes import FaceFit


class ShapeKind(StrEnum):
    """Kinds of shape of a face."""

    PLANE = "plane"
    BEVELLED = "bevelled"
    CURVED = "curved"
    ROUGH = "rough"
    UNTESTED = "untested"


@dataclass(frozen=True)
class FaceShape:
    """The verdict on the shape of one face.

    Attributes
    ----------
    kind : PLANE; BEVELLED, two planes; CURVED, a quadric; ROUGH, none of these explains the residuals; UNTESTED,
        three points lie on any plane
    text : the verdict in words, with its numbers
    bevel_angle : between the two planes [rad]; None unless bevelled, or if the second plane's tilt is not known
    bevel_points : indices of the points on the second plane
    curvature : (2,) principal curvatures, the larger in size first, positive where the face bulges towards the
        observer [1/m]; None unless curved
    curvature_sigma : (2,) their standard deviations [1/m]
    """

    kind: ShapeKind
    text: str
    bevel_angle: float | None = None
    bevel_points: tuple[int, ...] = ()
    curvature: Array | None = None
    curvature_sigma: Array | None = None


def judge_shape(fit: FaceFit, points: ArrayLike, sigma: ArrayLike | None) -> FaceShape:
    """Judge from the residuals whether one plane describes a face.

    Parameters
    ----------
    fit : the plane through the points
    points : (n, 3) as given to `fit_plane` [m]
    sigma : as given to `fit_plane` [m]

    Returns
    -------
    FaceShape
    """
    if fit.redundancy == 0:
        return FaceShape(ShapeKind.UNTESTED, "untested: three points lie on any plane")
    stated, count = sigma is not None, len(fit.residuals)
    if stated and not fit.rejected and fit.sigma0**2 <= likely_ratio(fit.redundancy, 1.2816):
        return FaceShape(ShapeKind.PLANE, f"plane: {count} points, rms {fit.rms * 1e3:.1f} mm")
    return explain_heights(fit, points, sigma)


def likely_ratio(redundancy: int, quantile: float) -> float:
    """Return the ratio of variances that chance exceeds as rarely as a normal quantile (Wilson and Hilferty)."""
    spread = 2.0 / (9.0 * redundancy)
    return (1.0 - spread + quantile * math.sqrt(spread)) ** 3


_CURVED = float(chdtri(3, RARE))  # chi-square of the 3 parameters of a quadric at 0.1 %
_CURVED_WITHOUT = float(chdtri(3, FEW))  # the same at 5 %: must remain without any one point
_CURVED_BEYOND_TWO = 22.0  # truncated squares of two outliers that a quadric can be bent through
_SEARCH = 10.6  # squares that the search of the line accounts for: 2 ln 200
_STRIP = float(chdtri(2, RARE)) + _SEARCH  # squares that a strip along an edge must explain: 2 parameters
_SECOND_PLANE = (
    _CURVED + _SEARCH
)  # squares that a second plane must explain: 3 parameters at 0.1 %, 200 lines tried
_WIDER = ODDS  # advantage in likelihood that wider scatter needs as an explanation
_SCATTERED = 1.0 / 3.0  # share of points off the plane beyond which they are not isolated


def explain_heights(fit: FaceFit, points: ArrayLike, sigma: ArrayLike | None) -> FaceShape:
    """Judge the shape of a face whose residuals exceed chance; arguments as of `judge_shape`."""
    if not fit.sigma0 > VANISHING * fit.singular_values[0]:
        return FaceShape(ShapeKind.PLANE, f"plane: {len(fit.residuals) - len(fit.rejected)} points, exactly")
    scene = _heights(fit, points, sigma)
    verdicts = [verdict for verdict in (_curved(scene), _bevelled(scene)) if verdict is not None]
    if verdicts:
        return min(verdicts, key=lambda verdict: verdict[0])[1]
    return _eroded(scene) or _plane_or_rough(fit, scene)


@dataclass(frozen=True)
class _Heights:
    """Heights z above the plane at places (u, v) on it, all (n,) [m]; root (n,) is 1/σ [1/m]; off marks outliers."""

    u: Array
    v: Array
    z: Array
    root: Array
    off: Bools
    known: bool


def _heights(fit: FaceFit, points: ArrayLike, sigma: ArrayLike | None) -> _Heights:
    lateral = (np.asarray(points, dtype=np.float64) - fit.centroid) @ fit.axes.T
    z, off = fit.residuals, np.zeros(len(fit.residuals), dtype=bool)
    off[list(fit.rejected)] = True
    stated, root = sigma is not None, np.empty_like(z)
    root[:] = 1.0 / np.asarray(fit.sigma0 if sigma is None else sigma, dtype=np.float64)
    u, v = (np.ascontiguousarray(column) for column in lateral.T)
    return _Heights(u, v, z, root, off, stated)


def _curved(face: _Heights) -> tuple[float, FaceShape] | None:
    """Return a quadric and the squares it leaves unexplained, if it explains significantly more than the plane."""
    count = len(face.z)
    if count < 7:
        return None
    flatness = truncated_sum(face.root, face.z)
    if face.known and flatness <= _CURVED:
        return None
    size = max(float(np.abs(face.u).max()), float(np.abs(face.v).max()))
    u, v = face.u / size, face.v / size
    design = np.column_stack([np.ones(count), u, v, u * u, u * v, v * v])
    chosen, score = _best_start(design, face)
    used = int(chosen.sum())
    enough = _CURVED if face.off.sum() < 2 else _CURVED_BEYOND_TWO
    if used < max(7, count - max(1, count // 10)):
        return None
    flat, _, flat_without = _squares(design[:, :3].copy(), face, chosen)
    bent, solution, bent_without = _squares(design, face, chosen)
    if solution is None:
        return None
    excess = bent / (used - 6)
    rough = not face.known or excess > likely_ratio(used - 6, 3.0902)
    scale = max(excess, 1e-300) if rough else 1.0
    critical = 3.0 * fdtri(3, used - 6, 0.999) if rough else _CURVED
    if not (flatness - score) / scale > enough:
        return None
    least = (flat_without - bent_without)[chosen].min()  # one outlier at a corner bends a quadric by itself
    if (flat - bent) / scale <= critical or least / scale <= _CURVED_WITHOUT:
        return None
    coefficients, covariance = solution
    unit = size ** np.array([0, 1, 1, 2, 2, 2])
    return score, _curvature(coefficients / unit, covariance * scale / np.outer(unit, unit), used, count)


def _best_start(design: Array, face: _Heights) -> tuple[Bools, float]:
    """Grow the points that a quadric explains from all points or from those on the plane; return the better."""
    fewest = max(7, len(face.z) // 2 + 2)
    best, least = ~face.off, math.inf
    for start in (np.ones_like(face.off), ~face.off):
        chosen = grow_columns(design, face.z, face.root, start, fewest)
        residuals, lever = face.z.copy(), np.empty_like(face.z)
        fit_columns(design, face.z, face.root, chosen, np.empty((6, 6)), residuals, lever)
        score = truncated_sum(face.root, residuals)
        if score < least:
            best, least = chosen, score
    return best, least


def _squares(design: Array, face: _Heights, chosen: Bools) -> tuple[float, tuple[Array, Array] | None, Array]:
    """Return the sum of squares of the chosen points, (coefficients, covariance), and (n,) the sum without each."""
    width = design.shape[1]
    inverse, residuals, lever = np.empty((width, width)), face.z.copy(), np.zeros_like(face.z)
    coefficients = fit_columns(design, face.z, face.root, chosen, inverse, residuals, lever)
    squares = (face.root * residuals) ** 2
    total = float(squares[chosen].sum())
    without = total - squares / np.maximum(1.0 - lever, 1e-9)
    return total, None if math.isnan(coefficients[0]) else (coefficients, inverse), without


def _curvature(coefficients: Array, covariance: Array, used: int, count: int) -> FaceShape:
    """Compute the principal curvatures of z = z₀ + p u + q v + a u² + b uv + c v², positive towards the observer.

    Eigenvalues of the second fundamental form in the first (do Carmo 1976, section 3.3).
    """
    slope, (a, b, c) = coefficients[1:3], coefficients[3:]
    stretch = math.sqrt(1.0 + float(slope @ slope))
    inverse = np.linalg.inv(np.linalg.cholesky(np.eye(2) + np.outer(slope, slope)))
    values, vectors = np.linalg.eigh(inverse @ np.array([[2.0 * a, b], [b, 2.0 * c]]) @ inverse.T / stretch)
    order = np.argsort(-np.abs(values))
    curvature = -values[order]
    directions = (inverse.T @ vectors[:, order]).T
    change = np.array([[2.0 * e * e, 2.0 * e * f, 2.0 * f * f] for e, f in directions]) / stretch
    deviation = np.sqrt(np.einsum("ki,ij,kj->k", change, covariance[3:, 3:], change))
    side = "outwards" if curvature[0] > 0.0 else "inwards"
    radius = 1.0 / abs(curvature[0])
    text = (
        f"curved {side}: radius {radius:.3g} m ± {deviation[0] * radius**2:.2g} m, "
        f"across it {curvature[1]:.2g} ± {deviation[1]:.2g} 1/m, by {used} of {count} points"
    )
    return FaceShape(ShapeKind.CURVED, text, curvature=curvature, curvature_sigma=deviation)


def _bevelled(face: _Heights) -> tuple[float, FaceShape] | None:
    """Return a second plane beyond a line and the squares both leave, if they explain enough more than one plane."""
    flat = truncated_sum(face.root, face.z)
    if face.off.sum() < 2 or flat <= _STRIP:
        return None
    score, within, second_side, direction, plane = fit_two_planes(face.u, face.v, face.z, face.root)
    redundancy = max(len(face.z) - 6, 1)
    scale = max(within / redundancy, 1.0 if face.known else 0.0)
    enough = _STRIP if math.isnan(plane[2]) else _SECOND_PLANE
    if not flat - score > enough * max(scale, 1e-300):
        return None
    score += _SEARCH
    beyond = tuple(np.flatnonzero(second_side).tolist())
    count, height = len(face.z), float(face.z[second_side].mean())
    if math.isnan(plane[2]):
        return score, _strip(beyond, face)
    angle = math.atan(math.hypot(plane[1], plane[2]))
    if angle > STEEPEST:
        return None
    across = direction[0] * face.u[second_side] + direction[1] * face.v[second_side]
    deviation = 1.0 / math.sqrt(float(((face.root[second_side] * (across - across.mean())) ** 2).sum()))
    text = (
        f"bevelled: {len(beyond)} of {count} points on a second plane turned {math.degrees(angle):.1f}° "
        f"± {math.degrees(deviation):.1f}°, {_side(height)}"
    )
    return score, FaceShape(ShapeKind.BEVELLED, text, bevel_angle=angle, bevel_points=beyond)


def _strip(beyond: tuple[int, ...], face: _Heights) -> FaceShape:
    height = face.z[list(beyond)]
    text = f"bevelled: {len(beyond)} of {len(face.z)} points along one edge, {_side(float(height.mean()))}"
    return FaceShape(ShapeKind.BEVELLED, text, bevel_points=beyond)


def _side(height: float) -> str:
    return f"{abs(height) * 1e3:.0f} mm {'in front' if height > 0.0 else 'behind'} on average"


def _eroded(face: _Heights) -> FaceShape | None:
    """Return an edge eroded to no plane: all points off the plane lie behind it and beyond one line."""
    lost = int(face.off.sum())
    if lost < 3 or (face.z[face.off] > 0.0).any():
        return None
    for angle in np.linspace(0.0, 2.0 * math.pi, 72, endpoint=False):
        across = math.cos(angle) * face.u + math.sin(angle) * face.v
        sound = int((across[~face.off] >= across[face.off].min()).sum())
        if 3 * sound <= lost:
            return _strip(tuple(np.flatnonzero(face.off).tolist()), face)
    return None


def _plane_or_rough(fit: FaceFit, face: _Heights) -> FaceShape:
    count, lost = len(face.z), len(fit.rejected)
    if lost > _SCATTERED * count:
        return FaceShape(ShapeKind.ROUGH, f"rough: {lost} of {count} points off the plane, in no order")
    ratio = max(float(((face.root * face.z) ** 2).mean()), 1.0)
    # twice the negative logarithms of the likelihoods of wider scatter, and of outliers from a plane
    wider, isolated = count * (1.0 + math.log(ratio)), truncated_sum(face.root, face.z)
    if face.known and (fit.sigma0**2 > likely_ratio(fit.redundancy, 3.0902) or wider + _WIDER < isolated):
        text = f"rough: points scatter {math.sqrt(ratio):.1f} times their standard deviation"
        return FaceShape(ShapeKind.ROUGH, f"{text}, rms {fit.rms * 1e3:.1f} mm of {count - lost} points")
    without = f" without {lost} isolated ones" if lost else ""
    return FaceShape(ShapeKind.PLANE, f"plane: {count - lost} points{without}, rms {fit.rms * 1e3:.1f} mm")
