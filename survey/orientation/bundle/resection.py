"""Orientation of single photographs and pairs, from nothing: resection, relative orientation, intersection.

Resection: three points give up to four orientations (Grunert's quartic in the form of Haralick et al. 1994); of random
triples, the orientation that most other points agree with is taken. Relative orientation: five pairs of rays give
up to ten
essential matrices (Stewénius, Engels & Nistér 2006), chosen likewise. The plane of a wall leaves two orientations
of a pair, of which both are returned.
"""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array
from survey.conventions import ATTEMPTS, PER_CENT, SAME, VANISHING

TRIPLES = 60
"""Random triples tried: with half of the points wrong, one is free of them but once in (8/7)⁶⁰ = 3,000 cases."""

_FIVES = 80  # random fives of pairs of rays tried: with half of them wrong, one is right but once in 13 cases
_ENOUGH = ATTEMPTS  # of these, after which nearly all pairs may end the search
_AGREES = PER_CENT  # angle between a ray and the direction of its point [rad]
_PARALLEL = (
    VANISHING  # smallest eigenvalue of the sum of the projections across rays, below which they are parallel
)


def resect(rays: Array, points: Array) -> tuple[Array, Array, int] | None:
    """Orient a photograph by known points.

    Parameters
    ----------
    rays : (n, 3) in the camera's axes, n ≥ 4
    points : (n, 3) [m]

    Returns
    -------
    rotation (3, 3), station (3,), number of points that agree; None if no triple gives any
    """
    rays = rays / np.linalg.norm(rays, axis=1)[:, None]
    rng = np.random.default_rng(0)
    best: tuple[int, float, Array, Array] | None = None
    for _ in range(TRIPLES):
        three = rng.choice(len(rays), 3, replace=False)
        for rotation, station in _three_point(rays[three], points[three]):
            seen = (points - station) @ rotation
            length = np.linalg.norm(seen, axis=1)
            cosine = np.einsum("ij,ij->i", seen, rays) / np.maximum(length, 1e-300)
            angle = np.arccos(np.clip(cosine, -1.0, 1.0))
            agree = int((angle < _AGREES).sum())
            rest = float(np.median(angle))
            if best is None or (agree, -rest) > (best[0], -best[1]):
                best = agree, rest, rotation, station
    return None if best is None else (best[2], best[3], best[0])


def _three_point(rays: Array, points: Array) -> Iterator[tuple[Array, Array]]:
    """Yield the orientations from which three points are seen along three unit rays."""
    a2 = float(((points[1] - points[2]) ** 2).sum())
    b2 = float(((points[0] - points[2]) ** 2).sum())
    c2 = float(((points[0] - points[1]) ** 2).sum())
    if min(a2, b2, c2) < 1e-18:
        return
    alpha, beta, gamma = rays[1] @ rays[2], rays[0] @ rays[2], rays[0] @ rays[1]
    m, p = (a2 - c2) / b2, (a2 + c2) / b2
    quartic = [
        (m - 1.0) ** 2 - 4.0 * c2 / b2 * alpha**2,
        4.0 * (m * (1.0 - m) * beta - (1.0 - p) * alpha * gamma + 2.0 * c2 / b2 * alpha**2 * beta),
        2.0
        * (
            m**2 - 1.0 + 2.0 * m**2 * beta**2 + 2.0 * (b2 - c2) / b2 * alpha**2
            - 4.0 * p * alpha * beta * gamma + 2.0 * (b2 - a2) / b2 * gamma**2
        ),
        4.0 * (-m * (1.0 + m) * beta + 2.0 * a2 / b2 * gamma**2 * beta - (1.0 - p) * alpha * gamma),
        (1.0 + m) ** 2 - 4.0 * a2 / b2 * gamma**2,
    ]  # fmt: skip
    if not np.isfinite(quartic).all() or abs(quartic[0]) < 1e-14:
        return
    for root in np.roots(quartic):
        v = float(root.real)
        under = 2.0 * (gamma - v * alpha)
        if abs(root.imag) > SAME * max(1.0, abs(v)) + 1e-4 or v <= 0.0 or abs(under) < 1e-12:
            continue
        u = ((m - 1.0) * v**2 - 2.0 * m * beta * v + 1.0 + m) / under
        square = 1.0 + v**2 - 2.0 * v * beta
        if u <= 0.0 or square <= 0.0:
            continue
        first = np.sqrt(b2 / square)
        rotation, station, _ = similarity_between(
            rays * (first * np.array([1.0, u, v]))[:, None], points, scaled=False
        )
        yield rotation, station


def similarity_between(
    source: Array, target: Array, *, scaled: bool = True, mirrored: bool = False
) -> tuple[Array, Array, float]:
    """Fit target = scale · R · source + shift by least squares.

    Parameters
    ----------
    source, target : (n, 3)
    scaled : the scale is estimated, otherwise 1
    mirrored : R is a reflection

    Returns
    -------
    R (3, 3), shift (3,), scale
    """
    middle, aim = source.mean(axis=0), target.mean(axis=0)
    a, b = source - middle, target - aim
    u, values, vt = np.linalg.svd(b.T @ a)
    sign = np.array([1.0, 1.0, np.linalg.det(u @ vt) * (-1.0 if mirrored else 1.0)])
    rotation = u * sign @ vt
    size = float((a**2).sum())
    scale = float((values * sign).sum()) / size if scaled and size > 0.0 else 1.0
    return rotation, aim - scale * rotation @ middle, scale


def intersect_rays(stations: Array, rays: Array) -> tuple[Array, float]:
    """Return the point nearest to rays in space, (3,), and the largest angle between two of them [rad].

    Parameters
    ----------
    stations : (n, 3) [m]
    rays : (n, 3) directions in space, of any length
    """
    rays = rays / np.linalg.norm(rays, axis=1)[:, None]
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    normal = across.sum(axis=0)
    cosine = float(np.clip((rays @ rays.T).min(), -1.0, 1.0))
    if np.linalg.matrix_rank(normal, tol=_PARALLEL) < 3:
        return np.full(3, np.nan), 0.0
    return np.linalg.solve(normal, np.einsum("nij,nj->i", across, stations)), float(np.arccos(cosine))


def intersect_many(
    points: NDArray[np.int64], stations: Array, rays: Array
) -> tuple[NDArray[np.int64], Array, Array]:
    """Return what `intersect_rays` does for many points at once.

    Parameters
    ----------
    points : (n,) index of the point of each ray, ascending
    stations, rays : (n, 3) as in `intersect_rays`

    Returns
    -------
    the points (np,), their places (np, 3), and the largest angle between two rays of each (np,) [rad]; where the rays
    do not define a place it is nan, and the angle 0
    """
    rays = rays / np.linalg.norm(rays, axis=1)[:, None]
    across = np.eye(3) - rays[:, :, None] * rays[:, None, :]
    numbers, start, group = np.unique(points, return_index=True, return_inverse=True)
    normal = np.add.reduceat(across, start)
    right = np.add.reduceat(np.einsum("nij,nj->ni", across, stations), start)
    cosine = np.ones(len(numbers))
    for apart in range(1, len(points)):
        pairs = np.flatnonzero(points[apart:] == points[:-apart])
        if not len(pairs):
            break
        np.minimum.at(cosine, group[pairs], np.einsum("ni,ni->n", rays[pairs], rays[pairs + apart]))
    sound = np.linalg.eigvalsh(normal)[:, 0] > _PARALLEL
    places, angles = np.full((len(numbers), 3), np.nan), np.zeros(len(numbers))
    places[sound] = np.linalg.solve(normal[sound], right[sound][:, :, None])[:, :, 0]
    angles[sound] = np.arccos(np.clip(cosine[sound], -1.0, 1.0))
    return numbers, places, angles


def essential_orientations(first: Array, second: Array) -> list[tuple[Array, Array, int]]:
    """Orient a second photograph in the axes of the first.

    Parameters
    ----------
    first, second : (n, 3) rays of the same points in the axes of either camera, n ≥ 5

    Returns
    -------
    list of (rotation, station of length 1, number of pairs that agree), the best first, at most four that differ
    """
    first = first / np.linalg.norm(first, axis=1)[:, None]
    second = second / np.linalg.norm(second, axis=1)[:, None]
    rng = np.random.default_rng(0)
    candidates: list[tuple[Array, Array, int, float]] = []
    for count in range(_FIVES):
        if count >= _ENOUGH and max((candidate[2] for candidate in candidates), default=0) > 0.9 * len(first):
            break
        five = rng.choice(len(first), 5, replace=False)
        for essential in _essential(first[five], second[five]):
            for rotation, station in _decomposed(essential):
                agree, rest = _agreement(first, second, rotation, station)
                if agree >= 5:
                    candidates.append((rotation, station, agree, rest))
    candidates.sort(key=lambda candidate: (-candidate[2], candidate[3]))
    chosen: list[tuple[Array, Array, int]] = []
    for rotation, station, agree, _ in candidates[:60]:
        if agree < 0.8 * candidates[0][2] or len(chosen) == 4:
            break
        if all(
            np.trace(rotation.T @ chosen_before[0]) < 2.999 or station @ chosen_before[1] < 0.999
            for chosen_before in chosen
        ):
            chosen.append((rotation, station, agree))
    return chosen


def _agreement(first: Array, second: Array, rotation: Array, station: Array) -> tuple[int, float]:
    """Return how many pairs of rays meet in front of both cameras, and the median angle by which they miss."""
    turned = second @ rotation.T
    normal = np.cross(np.broadcast_to(station, first.shape), first)
    miss = np.abs(np.einsum("ij,ij->i", normal, turned)) / np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    # depths along either ray, by the cross products of the law of sines
    across = np.cross(first, turned)
    size = np.maximum((across**2).sum(axis=1), 1e-18)
    first_depth = np.einsum("ij,ij->i", np.cross(station, turned), across) / size
    second_depth = np.einsum("ij,ij->i", np.cross(station, first), across) / size
    fine = (miss < _AGREES) & (first_depth > 0.0) & (second_depth > 0.0)
    return int(fine.sum()), float(np.median(miss))


def _decomposed(essential: Array) -> Iterator[tuple[Array, Array]]:
    """Yield the four orientations of an essential matrix with x₁ᵀ E x₂ = 0, E = [b]× R."""
    u, _, vt = np.linalg.svd(essential)
    u, vt = u * np.linalg.det(u), vt * np.linalg.det(vt)
    w = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for turn in (w, w.T):
        for side in (1.0, -1.0):
            yield u @ turn @ vt, side * u[:, 2]


def _monomials(degree: int) -> Iterator[tuple[int, int, int]]:
    """Yield the exponents of x, y, z of the monomials of a degree, then of those below."""
    for below in range(degree, -1, -1):
        for z in range(below + 1):
            yield from ((below - z - y, y, z) for y in range(below - z + 1))


def _times(a: Array, b: Array) -> Array:
    """Multiply polynomials in x, y, z: arrays (4, 4, 4) of coefficients by exponents."""
    out = np.zeros((4, 4, 4))
    for i, j, k in np.argwhere(a):
        out[i:, j:, k:] += a[i, j, k] * b[: 4 - i, : 4 - j, : 4 - k]
    return out


def _sum(terms: Iterable[Array]) -> Array:
    return np.asarray(np.sum(list(terms), axis=0))


def _essential(first: Array, second: Array) -> Iterator[Array]:
    """Yield the essential matrices of five pairs of rays."""
    rows = np.einsum("ni,nj->nij", first, second).reshape(len(first), 9)
    space = np.linalg.svd(rows)[2][5:].reshape(4, 3, 3)
    e = np.zeros((3, 3, 4, 4, 4))
    e[:, :, 1, 0, 0], e[:, :, 0, 1, 0], e[:, :, 0, 0, 1], e[:, :, 0, 0, 0] = space
    eet = [[_sum(_times(e[i, k], e[j, k]) for k in range(3)) for j in range(3)] for i in range(3)]
    half = 0.5 * (eet[0][0] + eet[1][1] + eet[2][2])
    for i in range(3):
        eet[i][i] = eet[i][i] - half
    equations = [_sum(_times(eet[i][k], e[k, j]) for k in range(3)) for i in range(3) for j in range(3)]
    minor = [
        _times(e[1, (j + 1) % 3], e[2, (j + 2) % 3]) - _times(e[1, (j + 2) % 3], e[2, (j + 1) % 3])
        for j in range(3)
    ]
    equations.append(_sum(_times(e[0, j], minor[j]) for j in range(3)))
    matrix = np.array([[equation[power] for power in _monomials(3)] for equation in equations])
    try:
        rest = -np.linalg.solve(matrix[:, :10], matrix[:, 10:])
    except np.linalg.LinAlgError:
        return
    action = np.zeros((10, 10))
    action[:6] = rest[[0, 1, 2, 4, 5, 7]]
    action[[6, 7, 8, 9], [0, 1, 3, 6]] = 1.0
    values, vectors = np.linalg.eig(action)
    for value, vector in zip(values, vectors.T, strict=True):
        if abs(value.imag) < SAME and abs(vector[9]) > 1e-12:
            x, y, z = (vector[6:9] / vector[9]).real
            yield x * space[0] + y * space[1] + z * space[2] + space[3]
