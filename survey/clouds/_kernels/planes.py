"""Numba kernel that turns the sampled points of one stone into patches on its plane, each with its precision."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from survey.conventions import CHECKED, ENOUGH, MOST, ROUNDS, SAMPLE, STEEPEST, TRIALS, TUKEY

FINE, FEW, COVERED, STEEP = range(4)  # status of `fit_patches`

_TRIPLES = TRIALS  # planes that are tried: three patches of a face half covered are clear in one of eight
_STEEPEST = math.tan(STEEPEST)  # slope against the line of sight beyond which nobody outlines a face
_FEWEST_POINTS = CHECKED  # points from which a patch has a height
_FEWEST_PATCHES = ENOUGH  # patches from which a plane has a scatter
_CLEAR = MOST  # share of a patch's points near the plane below which something covers it
_TAILS = (
    6.0  # three standard deviations hold 99.7 % although the variance is estimated: t² ≈ 9 (1 + 6 / freedom)
)
_CURVED = SAMPLE  # patches from which a curved surface is told from scatter
_BENT = (
    1.6  # variance about a plane over that about a curved surface beyond which a face is curved: one in 1,000
)


class Rules(NamedTuple):
    """Lengths that decide which points belong to a face.

    near : float64, distance from the plane that is noise [m]
    band : float64, that is roughness of the stone [m]
    least : float64, smallest noise that a scanner can have [m]
    """

    near: float
    band: float
    least: float


@njit(cache=True, nogil=True)
def _random(state):
    state[0] = (state[0] * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)) & np.uint64(
        0xFFFFFFFFFFFFFFFF
    )
    return state[0] >> np.uint64(33)


@njit(cache=True, nogil=True)
def _least_squares(rows, heights, weights):
    """Return the coefficients of weighted least squares, by Cholesky's method with a little regularisation."""
    count = rows.shape[1]
    normal, right = np.zeros((count, count)), np.zeros(count)
    for k in range(len(rows)):
        for i in range(count):
            right[i] += weights[k] * rows[k, i] * heights[k]
            for j in range(count):
                normal[i, j] += weights[k] * rows[k, i] * rows[k, j]
    for i in range(count):
        normal[i, i] += 1e-12 * (normal[0, 0] + 1e-300)
    return np.linalg.solve(normal, right)


@njit(cache=True, nogil=True)
def _best_plane(points, patch, filled, near):
    """Return the plane w = a u + b v + c near most of the patches, each of which counts once."""
    state = np.array([np.uint64(20260101)])
    starts, size = np.zeros(len(filled) + 1, np.int64), np.zeros(len(filled), np.float64)
    for k in range(len(filled)):
        size[k] = filled[k]
        starts[k + 1] = starts[k] + filled[k]
    used = np.flatnonzero(filled >= _FEWEST_POINTS)
    spread = 0.0
    for k in range(len(points)):
        spread = max(spread, abs(points[k, 0]), abs(points[k, 1]))
    best, plane = np.inf, np.zeros(3)
    chosen = np.empty(3, np.int64)
    for _ in range(_TRIPLES):
        for j in range(3):
            p = used[_random(state) % np.uint64(len(used))]
            chosen[j] = starts[p] + _random(state) % np.uint64(filled[p])
        a, b, c = points[chosen[0]], points[chosen[1]], points[chosen[2]]
        u1, v1, w1 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        u2, v2, w2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        area = u1 * v2 - u2 * v1
        if abs(area) < 0.02 * spread * spread:
            continue
        su, sv = (w1 * v2 - w2 * v1) / area, (u1 * w2 - u2 * w1) / area
        if su * su + sv * sv > _STEEPEST * _STEEPEST:
            continue
        level = a[2] - su * a[0] - sv * a[1]
        cost = 0.0
        for k in range(len(points)):
            apart = (points[k, 2] - su * points[k, 0] - sv * points[k, 1] - level) / near
            cost += min(apart * apart, 1.0) / size[patch[k]]
            if cost >= best:
                break
        if cost < best:
            best = cost
            plane[0], plane[1], plane[2] = su, sv, level
    return best, plane


@njit(cache=True, nogil=True)
def _refined(points, patch, filled, plane, near):
    """Fit the plane again to the points near it, each patch with the same weight."""
    for _ in range(ROUNDS):
        rows, weights = np.ones((len(points), 3)), np.zeros(len(points))
        for k in range(len(points)):
            rows[k, 0], rows[k, 1] = points[k, 0], points[k, 1]
            apart = points[k, 2] - plane[0] * points[k, 0] - plane[1] * points[k, 1] - plane[2]
            if abs(apart) <= near:
                weights[k] = 1.0 / filled[patch[k]]
        plane = _least_squares(rows, points[:, 2].astype(np.float64), weights)
    return plane


@njit(cache=True, nogil=True)
def _heights(points, patch, filled, plane, rules):
    """Return mean place, height over the plane and number of the points of each clear patch, and their noise.

    The heights are means within three standard deviations of the patch's median, since what grows over a part of a
    patch lies on one side of the face and pulls a median along.
    """
    count = len(filled)
    out = np.full((count, 4), np.nan)
    apart = np.empty(len(points))
    for k in range(len(points)):
        apart[k] = points[k, 2] - plane[0] * points[k, 0] - plane[1] * points[k, 1] - plane[2]
    middle, noise = np.full(count, np.nan), np.full(count, np.nan)
    start = 0
    for p in range(count):
        own = apart[start : start + filled[p]]
        start += filled[p]
        close = own[np.abs(own) <= rules.band]
        if len(close) < max(_FEWEST_POINTS, _CLEAR * len(own)):
            continue
        middle[p] = np.median(close)
        noise[p] = 1.4826 * np.median(np.abs(close - middle[p]))
    if np.isnan(noise).all():
        return out, 0.0
    # quantised or noiseless points still have a little
    scale = max(np.nanmedian(noise), 0.5 * rules.least)
    for _ in range(2):
        start = 0
        squares, total = 0.0, 0
        for p in range(count):
            first, start = start, start + filled[p]
            if np.isnan(middle[p]):
                continue
            n, u, v, w, ww = 0, 0.0, 0.0, 0.0, 0.0
            for k in range(first, start):
                off = apart[k] - middle[p]
                if abs(off) <= 3.0 * scale:
                    n += 1
                    u += points[k, 0]
                    v += points[k, 1]
                    w += off
                    ww += off * off
            if n >= _FEWEST_POINTS:
                out[p, 0], out[p, 1], out[p, 2], out[p, 3] = u / n, v / n, middle[p] + w / n, n
                squares += ww - w * w / n
                total += n - 1
        if total > 0:
            # what lies beyond three standard deviations is missing: 1.3 % of a standard deviation
            scale = max(1.013 * math.sqrt(squares / total), 0.5 * rules.least)
    return out, scale


@njit(cache=True, nogil=True)
def _scatter(places, heights, curved):
    """Return design and residuals of a robust smooth surface, their variance, and which patches count for it."""
    count = len(heights)
    width = max(np.abs(places).max(), 1e-9)
    columns = 6 if curved else 3
    rows = np.ones((count, columns))
    for k in range(count):
        x, y = places[k, 0] / width, places[k, 1] / width
        rows[k, 1], rows[k, 2] = x, y
        if curved:
            rows[k, 3], rows[k, 4], rows[k, 5] = x * x, x * y, y * y
    residuals = heights - np.median(heights)
    weights = np.ones(count)
    for _ in range(8):
        scale = max(1.4826 * np.median(np.abs(residuals)), 1e-9)
        for k in range(count):
            reduced = residuals[k] / (TUKEY * scale)
            weights[k] = (1.0 - reduced * reduced) ** 2 if abs(reduced) < 1.0 else 1e-9
        residuals = heights - rows @ _least_squares(rows, heights, weights)
    scale = max(1.4826 * np.median(np.abs(residuals)), 1e-9)
    good = np.abs(residuals) <= 3.5 * scale
    kept = np.count_nonzero(good)
    squares = 0.0
    for k in range(count):
        if good[k]:
            squares += residuals[k] ** 2
    return rows, residuals, squares / max(kept - columns, 1), good


@njit(cache=True, nogil=True)
def _neighbours(residuals, good, variance, rows, cells):
    """Return sums over the pairs of neighbouring patches: of their correlation, of the hat matrix, and their number."""
    total, taken, pairs = 0.0, 0.0, 0.0
    kept = rows[good]
    normal = kept.T @ kept
    for i in range(len(normal)):
        normal[i, i] += 1e-12 * normal[0, 0]
    hat = rows @ np.linalg.solve(normal, rows.T.copy())
    for i in range(len(residuals)):
        for j in range(i):
            if good[i] and good[j] and abs(cells[i, 0] - cells[j, 0]) + abs(cells[i, 1] - cells[j, 1]) == 1.0:
                total += residuals[i] * residuals[j] / variance
                taken += hat[i, j]
                pairs += 1.0
    return total, taken, pairs


@njit(cache=True, nogil=True)
def patch_sigmas(rows, cells, numbers, correlation):
    """Return standard deviations of patches (m,) as if they were independent, and the points that they are worth.

    Patches at a distance of d patches have the correlation r^d. The variance of their mean is larger by the factor
    f = (Σᵢⱼ r^dᵢⱼ) / m than if they were independent, and so is that of each patch here. A fit of p unknowns then
    leaves n - f p degrees of freedom.

    Inputs:
    rows : (m, 4) float64, place (u, v, w) of each patch [m] and the number of its points
    cells : (m, 2) float64, column and row of each
    numbers : as of `fit_patches`
    correlation : float64, r of neighbouring patches
    """
    total = 0.0
    if correlation > 1e-3:
        for i in range(len(rows)):
            for j in range(i):
                apart = math.hypot(cells[i, 0] - cells[j, 0], cells[i, 1] - cells[j, 1])
                total += 2.0 * correlation**apart
    factor, noise = 1.0 + total / len(rows), numbers[0]
    count, unknowns = numbers[7], numbers[8]
    freedom = max(count - factor * unknowns, 1.0)
    variance = numbers[1] * max(count - unknowns, 1.0) / freedom
    white = 0.0
    for k in range(len(rows)):
        white += noise * noise / rows[k, 3] / len(rows)
    own = max(variance - white, 0.0) + variance * _TAILS / freedom
    sigmas, information = np.empty(len(rows)), 0.0
    for k in range(len(rows)):
        sigmas[k] = math.sqrt(factor * (own + noise * noise / rows[k, 3]))
        information += 1.0 / max(sigmas[k], 1e-9) ** 2
    return sigmas, (noise * noise + own) * information


@njit(cache=True, nogil=True)
def fit_patches(counts, places, columns, rules):
    """Find the plane of a stone among its sampled points, and the height of its patches with their precision.

    Inputs:
    counts : (patches,) int64, points that fell into each
    places : (patches, kept, 3) float32, their samples along two axes and the line of sight [m]
    columns : int64, patches in a row
    rules : which points belong to a face

    Outputs:
    status : FINE, FEW points, COVERED by something, or STEEP
    rows : (m, 4) float64, place (u, v, w) of each clear patch [m] and the number of its points
    cells : (m, 2) float64, column and row of each
    plane : (3,) float64, w = a u + b v + c
    numbers : (9,) float64: noise of a point [m]; variance of the patches about a smooth surface [m²]; share of patches
        that are clear; points; for neighbouring patches, sums of the correlation of their residuals and of the hat
        matrix, and the number of pairs; patches that count for the variance, and unknowns of the surface
    """
    kept, count = places.shape[1], len(counts)
    filled = np.minimum(counts, kept)
    total = int(filled.sum())
    numbers, none = np.zeros(9), np.empty((0, 4))
    numbers[3] = counts.sum()
    occupied = int((filled >= _FEWEST_POINTS).sum())
    if occupied < _FEWEST_PATCHES:
        return FEW, none, none[:, :2], np.zeros(3), numbers
    points, patch = np.empty((total, 3)), np.empty(total, np.int64)
    at = 0
    for p in range(count):
        for k in range(filled[p]):
            for j in range(3):
                points[at, j] = places[p, k, j]
            patch[at] = p
            at += 1
    best, plane = _best_plane(points, patch, filled, rules.near)
    if not best < np.inf:
        return STEEP, none, none[:, :2], plane, numbers
    plane = _refined(points, patch, filled, plane, rules.near)
    heights, noise = _heights(points, patch, filled, plane, rules)
    clear = np.flatnonzero(~np.isnan(heights[:, 2]))
    numbers[0], numbers[2] = noise, len(clear) / occupied
    if len(clear) < _FEWEST_PATCHES:
        return COVERED, none, none[:, :2], plane, numbers
    spots = heights[clear, :2].copy()
    design, residuals, variance, good = _scatter(spots, heights[clear, 2].copy(), False)
    if len(clear) >= _CURVED:
        bent = _scatter(spots, heights[clear, 2].copy(), True)
        if variance > _BENT * bent[2]:
            design, residuals, variance, good = bent
    cells = np.empty((len(clear), 2))
    for k in range(len(clear)):
        cells[k, 0], cells[k, 1] = clear[k] % columns, clear[k] // columns
    numbers[4], numbers[5], numbers[6] = _neighbours(residuals, good, max(variance, 1e-18), design, cells)
    rows = np.empty((len(clear), 4))
    for k in range(len(clear)):
        u, v, w, n = heights[clear[k]]
        rows[k] = u, v, plane[0] * u + plane[1] * v + plane[2] + w, n
    numbers[1], numbers[7], numbers[8] = variance, np.count_nonzero(good), design.shape[1]
    return FINE, rows, cells, plane, numbers
