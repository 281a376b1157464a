"""The robust plane of a face as `survey.faces.planes` finds it, in slow and readable numpy."""

import math
from dataclasses import dataclass
from itertools import combinations
from statistics import NormalDist

import numpy as np

from survey.arrays import Array, Bools

LIMIT = 3.2905267314919255
EROSION = 0.03
GRAZING = math.sin(math.radians(10.0))
TILT = math.radians(10.0)

# Reference case P01, "TLS plane, exact checkerboard set" (closed form): x in {-3,-1,1,3},
# y in {-1.5,-.5,.5,1.5}, z = ±0.01 alternating, i + j odd → +
CHECKERBOARD = np.array(
    [
        (x, y, 0.01 if (i + j) % 2 else -0.01)
        for i, x in enumerate((-3.0, -1.0, 1.0, 3.0))
        for j, y in enumerate((-1.5, -0.5, 0.5, 1.5))
    ]
)


@dataclass(frozen=True)
class Plane:
    """Weighted least squares by the singular value decomposition; rows of `vectors` are the singular vectors."""

    centroid: Array
    vectors: Array
    singular: Array
    weight: float

    def distances(self, xyz: Array) -> Array:
        out: Array = (xyz - self.centroid) @ self.vectors[2]
        return out

    def leverages(self, xyz: Array, root: Array) -> Array:
        lateral = (xyz - self.centroid) @ self.vectors[:2].T / self.singular[:2]
        out: Array = root**2 * (1.0 / self.weight + (lateral**2).sum(axis=1))
        return out


def plane_of(xyz: Array, root: Array, accepted: Bools) -> Plane | None:
    some, weights = xyz[accepted], root[accepted] ** 2
    centroid = weights @ some / weights.sum()
    _, singular, vectors = np.linalg.svd(
        (some - centroid) * root[accepted, None], full_matrices=len(some) < 3
    )
    return Plane(centroid, vectors, singular, weights.sum()) if singular[1] > 1e-9 * singular[0] else None


def largest_sum(redundancy: int) -> float:
    spread = 2.0 / (9.0 * redundancy)
    return float(redundancy * (1.0 - spread + 3.09 * math.sqrt(spread)) ** 3)


def accepted_points(points: Array, sigma: Array, known: bool, observer: Array | None) -> Bools:
    """Return the points that `fit_plane` accepts, (n,)."""
    kept = compact(points)
    part = plane_of(points - points[0], 1.0 / sigma, kept)
    wide = part is not None and part.singular[1] > max(0.15 * part.singular[0], 3.0 / TILT if known else 0.0)
    if wide and not kept.all():
        out = np.zeros(len(points), dtype=bool)
        out[kept] = accepted_of_the_compact(points[kept], sigma[kept], known, observer)
        return out
    return accepted_of_the_compact(points, sigma, known, observer)


def accepted_of_the_compact(points: Array, sigma: Array, known: bool, observer: Array | None) -> Bools:
    xyz, root, count = points - points[0], 1.0 / sigma, len(points)
    everything = np.ones(count, dtype=bool)
    plain = plane_of(xyz, root, everything)
    assert plain is not None
    if count == 3 or (known and is_clean(plain, xyz, root)):
        return everything
    view, grazing = viewing(plain, None if observer is None else observer - points[0])
    normals, distances = triple_planes(xyz, root, view, grazing)
    size = min(count // 2 + 2, count)
    medians = np.sort(np.abs(distances), axis=1)[:, size - 1]
    start = nearest(np.abs(distances[medians.argmin()]), size, xyz, root)
    found = [grow(start, size, xyz, root, known, view)]
    if known:
        sides = np.sign(normals @ view)
        sums = np.array([cost(d, root, side).sum() for d, side in zip(distances, sides, strict=True)])
        starts = different_sets(sums, np.abs(distances) <= LIMIT, 6)
        found.extend(grow(within, 4, xyz, root, known, view) for within in starts if within.sum() > 4)
    least, best = min(found, key=lambda one: one[0])
    return best if least < math.inf else everything


def compact(points: Array) -> Bools:
    if len(points) < 6:
        return np.ones(len(points), dtype=bool)
    centre = points.mean(axis=0)
    for _ in range(15):
        weights = 1.0 / np.maximum(np.linalg.norm(points - centre, axis=1), 1e-9)
        centre = weights @ points / weights.sum()
    away = np.linalg.norm(points - centre, axis=1)
    limit = 2.5 * np.sort(away)[len(points) - len(points) // 4 - 1]
    gaps = np.linalg.norm(points[:, None] - points[None, away <= limit], axis=2).min(axis=1)
    near = (away <= limit) | (gaps <= 0.7 * limit)
    directions = (points - centre)[~near] / away[~near, None]
    around = len(directions) > 3 and np.linalg.norm(directions.mean(axis=0)) < 0.4
    alike = around and away[~near].max() <= min(2.0 * away[~near].min(), 4.0 * limit)
    return np.ones(len(points), dtype=bool) if alike else near


def is_clean(plane: Plane, xyz: Array, root: Array) -> bool:
    squares = (root * plane.distances(xyz)) ** 2
    share = np.maximum(1.0 - plane.leverages(xyz, root), 1e-6)
    return bool((squares <= LIMIT**2 * share).all() and squares.sum() <= largest_sum(len(xyz) - 3))


def viewing(plane: Plane, observer: Array | None) -> tuple[Array, float]:
    if observer is None:
        return np.zeros(3), 0.0
    view = observer - plane.centroid
    view /= np.linalg.norm(view)
    return view, GRAZING if abs(view @ plane.vectors[2]) > 2.0 * GRAZING else 0.0


def triple_planes(xyz: Array, root: Array, view: Array, grazing: float) -> tuple[Array, Array]:
    """Normals (m, 3) of all planes through three points, and signed distances (m, n) in units of sigma."""
    a, b, c = (xyz[list(column)] for column in zip(*combinations(range(len(xyz)), 3), strict=True))
    normals = np.cross(b - a, c - a)
    areas = np.linalg.norm(normals, axis=1)
    usable = areas > 1e-3 * areas.max()
    normals, a = normals[usable] / areas[usable, None], a[usable]
    turned = np.abs(normals @ view) >= grazing
    normals, a = normals[turned], a[turned]
    return normals, (normals @ xyz.T - (normals * a).sum(axis=1)[:, None]) * root


def cost(tests: Array, root: Array, side: float) -> Array:
    heights = side * tests / root
    little_in_front = (heights > 0.0) & (heights < EROSION)
    return np.where(np.abs(tests) <= LIMIT, tests**2, LIMIT**2 * np.where(little_in_front, 2.0, 1.0))


def different_sets(sums: Array, within: Bools, most: int) -> list[Bools]:
    out: list[Bools] = []
    for i in np.argsort(sums, kind="stable"):
        if len(out) < most and not any((within[i] == one).all() for one in out):
            out.append(within[i].copy())
    return out


def nearest(distances: Array, size: int, xyz: Array, root: Array) -> Bools:
    accepted = np.zeros(len(xyz), dtype=bool)
    for _ in range(20):
        chosen = np.argsort(distances, kind="stable")[:size]
        if accepted[chosen].all():
            break
        accepted[:] = False
        accepted[chosen] = True
        plane = plane_of(xyz, root, accepted)
        if plane is None:
            break
        distances = root * np.abs(plane.distances(xyz))
    return accepted


def grow(start: Bools, fewest: int, xyz: Array, root: Array, known: bool, view: Array) -> tuple[float, Bools]:
    accepted, total = start.copy(), math.inf
    for _ in range(4 * len(xyz)):
        plane = plane_of(xyz, root, accepted)
        if plane is None:
            return math.inf, accepted
        tests, lever = root * plane.distances(xyz), plane.leverages(xyz, root)
        scale = scatter(tests[accepted], len(xyz), known)
        if scale > plane.singular[1] * TILT:
            return math.inf, accepted
        total = float(cost(tests, root, float(np.sign(plane.vectors[2] @ view))).sum())
        share = np.where(accepted, np.maximum(1.0 - lever, 1e-6), 1.0 + lever)
        tests = np.abs(tests) / (scale * np.sqrt(share))
        worst = int(np.argmax(np.where(accepted, tests, 0.0)))
        best = int(np.argmin(np.where(accepted, np.inf, tests)))
        if tests[worst] > LIMIT and accepted.sum() > fewest:
            accepted[worst] = False
        elif not accepted[best] and tests[best] <= LIMIT:
            accepted[best] = True
        else:
            break
    return total, accepted


def scatter(tests: Array, count: int, known: bool) -> float:
    redundancy, squares = max(len(tests) - 3, 1), float(tests @ tests)
    raw = math.sqrt(squares / redundancy)
    if known:
        return raw if squares > largest_sum(redundancy) else 1.0
    part = len(tests) / count
    if part == 1.0:
        return max(raw, 1e-300)
    z = NormalDist().inv_cdf(0.5 + 0.5 * part)
    return max(raw / math.sqrt(1.0 - 2.0 * z * NormalDist().pdf(z) / part), 1e-300)
