"""Scale bars and plumb lines as observations of a bundle adjustment.

They tie points together, which the elimination of the points one by one does not allow. So they are added to what the
marks and the control points tell, x₀ with covariance C, as one more observation l = J x + e, cov(e) = R: with
S = J C Jᵀ + R, and the movements G of which the marks know nothing (a change of scale, two turns) and A = J G,

    s = (Aᵀ S⁻¹ A)⁻¹ Aᵀ S⁻¹ (l - J x₀),   x = x₀ + G s + C Jᵀ S⁻¹ (l - J x₀ - A s).

This is the least-squares adjustment of all observations together.
"""

from dataclasses import dataclass

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import MAX_ITERATIONS, VANISHING
from survey.orientation._kernels.adjustment import Unknowns, datum_sums
from survey.orientation.bundle.adjustment import (
    SIMILARITY,
    Prepared,
    Solution,
    corrected_unknowns,
    gauss_newton_step,
    inner_constraints,
    prior,
    similarity,
)
from survey.orientation.network import Network, PlumbLine, ScaleBar

_BATCH = len(SIMILARITY)
"""Functions of the points whose covariances one loop of the kernel sums: it is compiled for those of the datum."""


@dataclass(frozen=True)
class LengthFit:
    """Influence of scale bars and plumb lines on an adjustment.

    Attributes
    ----------
    residual, test : (m,) observed minus adjusted [m], and over its standard deviation; 0 where nothing checks it
    redundancy : observations minus movements that they alone determine
    square : sum of the squares of the weighted residuals
    by_cameras, by_points : (m, nr), (np, m, 3) covariances of the observed functions with cameras and points
    weight : (m, m) S⁻¹ [m⁻²]
    free_cameras, free_points : (nr, g), (np, 3, g) movements that these observations alone determine
    free_covariance : (g, g) of these movements
    """

    residual: Array
    test: Array
    redundancy: int
    square: float
    by_cameras: Array
    by_points: Array
    weight: Array
    free_cameras: Array
    free_points: Array
    free_covariance: Array


def check_lengths(network: Network, prepared: Prepared) -> None:
    """Check that the points of scale bars and plumb lines are known.

    Raises
    ------
    GeometryError
        naming the point that the marks do not determine
    """
    controlled = {gcp.point for gcp in network.control if not gcp.check}
    lines: list[ScaleBar | PlumbLine] = [*network.bars, *network.plumb_lines]
    for line in lines:
        for i in line.points:
            rays = int(prepared.rays.start[i + 1] - prepared.rays.start[i])
            if rays < 2 and i not in controlled:
                raise GeometryError(
                    f"the end {network.names[i]} of a scale bar or plumb line has {rays} marks",
                    where=line.where or network.path,
                    remedy="mark it on two or more photographs",
                )


def with_lengths(network: Network, prepared: Prepared, solution: Solution) -> Solution:
    """Adjust a network with its scale bars and plumb lines, from a solution without them.

    Raises
    ------
    GeometryError
        if the adjustment does not converge
    """
    if not (network.bars or network.plumb_lines):
        return solution
    check_lengths(network, prepared)
    unknowns = _near(network, prepared, solution.unknowns)
    before = np.inf
    for taken in range(1, MAX_ITERATIONS + 1):
        cameras, step, moved, square, behind = gauss_newton_step(network, prepared, unknowns)
        off, _, sigma = _observed(network, unknowns)
        total = square + float(((off / sigma) ** 2).sum())
        if abs(before - total) <= VANISHING * max(total, 1.0):
            return Solution(unknowns, square, solution.iterations + taken, behind)
        before = total
        fit = _fitted(network, prepared, unknowns, cameras, moved)
        gain = fit.weight @ fit.misfit
        step = step + fit.by_cameras.T @ gain + fit.free_cameras @ fit.freedom
        moved = moved + np.einsum("imx,m->ix", fit.by_points, gain) + fit.free_points @ fit.freedom
        unknowns = corrected_unknowns(unknowns, step, moved)
    raise GeometryError(
        "the adjustment with scale bars and plumb lines has not converged",
        where=network.path,
        remedy="check their lengths and the numbers of their points",
    )


def fit_lengths(network: Network, prepared: Prepared, unknowns: Unknowns, cameras: Array) -> LengthFit | None:
    """Return how the scale bars and plumb lines of an adjusted network fit; None if it has none.

    Parameters
    ----------
    cameras : (nr, nr) covariance of the cameras without them, for σ₀ = 1
    """
    if not (network.bars or network.plumb_lines):
        return None
    off, moves, sigma = _observed(network, unknowns)
    fit = _fitted(network, prepared, unknowns, cameras, np.zeros_like(unknowns.point))
    observed_by_free = np.einsum("ixm,ixg->mg", moves, fit.free_points)
    weight = fit.weight - fit.weight @ observed_by_free @ fit.covariance @ observed_by_free.T @ fit.weight
    variance = np.diag(weight) * sigma**4
    checked = variance > 1e-6 * sigma**2
    test = np.where(checked, np.abs(off) / np.sqrt(np.where(checked, variance, 1.0)), 0.0)
    return LengthFit(
        off,
        test,
        len(off) - observed_by_free.shape[1],
        float(((off / sigma) ** 2).sum()),
        fit.by_cameras,
        fit.by_points,
        fit.weight,
        fit.free_cameras - fit.by_cameras.T @ fit.weight @ observed_by_free,
        fit.free_points - np.einsum("imx,mg->ixg", fit.by_points, fit.weight @ observed_by_free),
        fit.covariance,
    )


@dataclass(frozen=True)
class _Fit:
    by_cameras: Array
    by_points: Array
    weight: Array
    free_cameras: Array
    free_points: Array
    covariance: Array
    freedom: Array
    misfit: Array


def _fitted(network: Network, prepared: Prepared, unknowns: Unknowns, cameras: Array, moved: Array) -> _Fit:
    """Fit the observations after a step (np, 3) of the points; `misfit` is what the free movements leave."""
    off, moves, sigma = _observed(network, unknowns)
    off = off - np.einsum("ixm,ix->m", moves, moved)
    by_cameras, by_points = _covariances(prepared, unknowns, cameras, moves)
    spread = np.einsum("imx,ixn->mn", by_points, moves) + np.diag(sigma**2)
    weight = np.linalg.inv(0.5 * (spread + spread.T))
    chosen = _free_columns(network, prepared)
    arms = unknowns.point - unknowns.point[unknowns.free].mean(axis=0)
    free_points = np.where(unknowns.free[:, None, None], similarity(arms), 0.0)[:, :, chosen]
    free_cameras = inner_constraints(prepared, unknowns)[:, chosen]
    by_free = np.einsum("ixm,ixg->mg", moves, free_points)
    covariance = np.linalg.inv(by_free.T @ weight @ by_free)
    freedom = covariance @ by_free.T @ weight @ off
    return _Fit(
        by_cameras, by_points, weight, free_cameras, free_points, covariance, freedom, off - by_free @ freedom
    )


def _free_columns(network: Network, prepared: Prepared) -> list[int]:
    """Return the movements that neither marks nor control points determine, but these observations do."""
    if not prepared.datum:
        return []
    names = [*(("rx", "ry") if network.plumb_lines else ()), *(("scale",) if network.bars else ())]
    return [SIMILARITY.index(name) for name in names]


def _observed(network: Network, unknowns: Unknowns) -> tuple[Array, Array, Array]:
    """Return observed minus computed values (m,) [m], their derivatives (np, 3, m), and standard deviations (m,)."""
    rows: list[tuple[float, int, int, Array, float]] = []
    for bar in network.bars:
        first, second = bar.points
        between = unknowns.point[second] - unknowns.point[first]
        length = float(np.linalg.norm(between))
        rows.append((bar.length - length, first, second, between / length, bar.sigma))
    for line in network.plumb_lines:
        foot = line.points[0]
        for top in line.points[1:]:
            between = unknowns.point[top] - unknowns.point[foot]
            rows += [(-float(between[a]), foot, top, np.eye(3)[a], line.sigma) for a in (0, 1)]
    moves = np.zeros((len(unknowns.point), 3, len(rows)))
    for m, (_, first, second, slope, _) in enumerate(rows):
        moves[second, :, m] += slope
        moves[first, :, m] -= slope
    moves[~unknowns.free] = 0.0
    return np.array([row[0] for row in rows]), moves, np.array([row[4] for row in rows])


def _covariances(prepared: Prepared, unknowns: Unknowns, cameras: Array, moves: Array) -> tuple[Array, Array]:
    """Return the covariances of functions Σ Gᵀ p of the points with cameras (m, nr) and points (np, m, 3)."""
    count = moves.shape[2]
    weights = prior(prepared, unknowns)
    by_cameras, by_points = np.zeros((count, len(cameras))), np.zeros((len(moves), count, 3))
    for first in range(0, count, _BATCH):
        width = min(_BATCH, count - first)
        some = np.zeros((*moves.shape[:2], _BATCH))
        some[:, :, :width] = moves[:, :, first : first + width]
        sums, each = np.zeros((_BATCH, len(cameras))), np.zeros((len(moves), _BATCH, 3))
        datum_sums(prepared.rays, unknowns, weights, cameras, some, (sums, each))
        by_cameras[first : first + width] = sums[:width]
        by_points[:, first : first + width] = each[:, :width]
    return by_cameras, by_points


def _near(network: Network, prepared: Prepared, unknowns: Unknowns) -> Unknowns:
    """Bring a network without control near its scale bars and plumb lines, by a similarity that no mark notices."""
    if not prepared.datum:
        return unknowns
    turn, scale = np.eye(3), 1.0
    if network.plumb_lines:
        rises = [
            unknowns.point[line.points[-1]] - unknowns.point[line.points[0]] for line in network.plumb_lines
        ]
        up = np.sum(rises, axis=0)
        turn = _upright(up / np.linalg.norm(up))
    if network.bars:
        lengths = [
            np.linalg.norm(unknowns.point[bar.points[1]] - unknowns.point[bar.points[0]])
            for bar in network.bars
        ]
        scale = float(
            np.median([bar.length / length for bar, length in zip(network.bars, lengths, strict=True)])
        )
    middle = unknowns.point[unknowns.free].mean(axis=0)
    return unknowns._replace(
        rotation=np.ascontiguousarray(turn @ unknowns.rotation),
        station=middle + scale * (unknowns.station - middle) @ turn.T,
        point=middle + scale * (unknowns.point - middle) @ turn.T,
    )


def _upright(up: Array) -> Array:
    """Return the smallest rotation (3, 3) that turns a direction to z."""
    axis, cosine = np.cross(up, [0.0, 0.0, 1.0]), float(up[2])
    if cosine < -1.0 + 1e-12:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    turn: Array = np.eye(3) + cross + cross @ cross / (1.0 + cosine)
    return turn
