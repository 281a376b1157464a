"""Bent beds of courses: several planes that meet at head joints.

A course that has sagged is still a course. Its bed is modelled as a chain of planes. Where two of them make a valley,
the stone across it gets two undersides, and the planes change at a head joint below; where they make a ridge, the
stone under it gets two tops, and they change at a head joint above. So all stones stay convex and have full contact.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from ground.statistics.scale import deviation
from survey.arrays import Array, Bools, Ints
from survey.conventions import GROUP, MAX_ROUNDS, MOST, ROUNDS, TENTH
from survey.geometry.adjacency import SolidArrays
from survey.joints._kernels import WORN
from survey.joints.facing import FacePlanes, FacingFaces
from survey.joints.settings import JointSettings

_FINE = MOST  # of the straightness: distance from the chain that is preferred for corners
_MAX_OFF_SHARE = TENTH  # largest part of the sound corners that may be off the chain
_MIN_LINKS = GROUP  # least number of links of a chain
_MAX_CHAINS = 12  # largest number of chains of a bed


@dataclass(frozen=True)
class _Bed:
    """A joint in side view, with its links in order along it.

    Attributes
    ----------
    axes : (3, 3) rows: along, perpendicular to it in the joint, across it
    origin : (3,) of the frame [m]
    place, height : (m,) coordinates of the middle of each link along and across [m]
    lower, upper : (m,) faces of each link
    """

    axes: Array
    origin: Array
    place: Array
    height: Array
    lower: Ints
    upper: Ints


@dataclass(frozen=True)
class _Chain:
    """A chain of planes.

    Attributes
    ----------
    posts, heights : (n + 1,) places along the bed where planes meet or end, and the heights there [m]
    slant : rise across the bed, common to all planes [-]
    residuals : of the sound corners [m]
    number : (m,) plane of each link
    """

    posts: Array
    heights: Array
    slant: float
    residuals: Array
    number: Ints

    def off(self, far: float) -> float:
        """Return the part of the sound corners that are farther than `far` from the chain [-]."""
        return float((self.residuals > far).mean()) if len(self.residuals) else 0.0


def fit_bent_bed(
    solids: SolidArrays,
    planes: FacePlanes,
    sound: Bools,
    facing: FacingFaces,
    links: Ints,
    settings: JointSettings,
    off: float,
) -> tuple[Array, Ints] | None:
    """Fit a chain of planes to a joint that one plane does not fit.

    Parameters
    ----------
    solids, planes, sound : stones, planes of their faces, and the corners that are sound
    facing, links : pairs of facing faces, and those of this joint
    settings : tolerance of a sound corner from its plane
    off : part of the sound corners that are off one plane; a chain may leave at most a quarter of it off

    Returns
    -------
    planes (n, 4) as n·x = d, and the plane (m,) of each link; None if a chain of planes does not fit either
    """
    bed = _bed(planes, facing, links)
    extents = _extents(solids, bed)
    reach = [end for face in extents.values() for end in face]
    most = min(_MAX_OFF_SHARE, 0.25 * off)
    coarse: list[_Chain] = []
    for ends in _chains(bed.place, bed.height):
        slopes = _slopes(bed, ends)
        for _ in range(ROUNDS):
            number, knots = _changes(bed, ends, slopes, extents)
            posts = np.array([min(reach), *knots, max(reach)])
            if not (np.diff(posts) > 0.0).all():
                break
            chain = _fitted(solids, sound, bed, posts, number)
            before, slopes = slopes, np.diff(chain.heights) / np.diff(posts)
            # where a valley turns out to be a ridge, the planes change elsewhere
            if ((np.diff(slopes) > 0.0) == (np.diff(before) > 0.0)).all():
                if chain.off(settings.straightness) <= most:
                    coarse.append(chain)
                break
        if coarse and coarse[-1].off(_FINE * settings.straightness) <= _MAX_OFF_SHARE:
            return _planes(bed, coarse[-1]), coarse[-1].number
    return (_planes(bed, coarse[0]), coarse[0].number) if coarse else None


def _bed(planes: FacePlanes, facing: FacingFaces, links: Ints) -> _Bed:
    pairs, centroid = facing.faces[links], facing.centroid[links]
    reference = planes.normals[pairs[int(facing.area[links].argmax()), 0]]
    out_of_first = (planes.normals[pairs[:, 0]] * reference).sum(axis=1) > 0.0
    up = (np.where(out_of_first, 1.0, -1.0)[:, None] * -facing.normal[links]).sum(axis=0)
    up /= np.linalg.norm(up)
    origin = centroid.mean(axis=0)
    flat = (centroid - origin) - np.outer((centroid - origin) @ up, up)
    along = np.linalg.svd(flat, full_matrices=False)[2][0]
    along = along - (along @ up) * up
    along /= np.linalg.norm(along)
    axes = np.array([along, np.cross(up, along), up])
    lower = np.where(out_of_first, pairs[:, 0], pairs[:, 1])
    upper = np.where(out_of_first, pairs[:, 1], pairs[:, 0])
    local = (centroid - origin) @ axes.T
    return _Bed(axes, origin, local[:, 0], local[:, 2], lower, upper)


def _extents(solids: SolidArrays, bed: _Bed) -> dict[int, tuple[float, float]]:
    """Return the interval that each face covers along the bed [m]."""
    out = {}
    for face in np.unique(np.concatenate([bed.lower, bed.upper])).tolist():
        corners = solids.corners[solids.face_starts[face] : solids.face_starts[face + 1]]
        along = (solids.vertices[corners] - bed.origin) @ bed.axes[0]
        out[face] = float(along.min()), float(along.max())
    return out


def _chains(place: Array, height: Array) -> Iterator[list[int]]:
    """Yield the ends (in order along the bed) of two straight chains that the links make, of three, and so on."""
    order = np.argsort(place, kind="stable")
    x, y = place[order], median_filter(height[order], size=5, mode="mirror")
    for count in range(2, min(len(x) // _MIN_LINKS, _MAX_CHAINS) + 1):
        yield _divided(x, y, count)


def _divided(x: Array, y: Array, count: int) -> list[int]:
    """Return the ends of `count` chains of at least three links with the least sum of squares (Bellman 1961)."""
    n = len(x)
    cost = _squares(x, y)
    best = np.full(n + 1, np.inf)
    best[0] = 0.0
    before = np.zeros((count + 1, n + 1), np.int64)
    for k in range(1, count + 1):
        total = best[:, None] + cost
        before[k], best = total.argmin(axis=0), total.min(axis=0)
    ends, at = [], n
    for k in range(count, 0, -1):
        ends.append(at)
        at = int(before[k, at])
    return ends[::-1]


def _squares(x: Array, y: Array) -> Array:
    """Return the sum of squares (n + 1, n + 1) off the line of links i to j - 1; infinite for too few links."""
    x, y = x - x.mean(), y - y.mean()
    sums = [np.concatenate([[0.0], np.cumsum(term)]) for term in (np.ones_like(x), x, y, x * x, x * y, y * y)]
    n, sx, sy, sxx, sxy, syy = (total[None, :] - total[:, None] for total in sums)
    safe = np.maximum(n, 1.0)
    xx, xy, yy = sxx - sx * sx / safe, sxy - sx * sy / safe, syy - sy * sy / safe
    off = yy - np.where(xx > 1e-12, xy * xy / np.maximum(xx, 1e-12), 0.0)
    out: Array = np.where(n >= _MIN_LINKS, np.maximum(off, 0.0), np.inf)
    return out


def _slope(x: Array, y: Array) -> float:
    mean_x, mean_y = float(x.mean()), float(y.mean())
    square = float(((x - mean_x) ** 2).sum())
    return float(((x - mean_x) * (y - mean_y)).sum()) / square if square > 1e-12 else 0.0


def _slopes(bed: _Bed, ends: list[int]) -> Array:
    """Return the slopes (n,) of the lines of the chains with these ends [-]."""
    order = np.argsort(bed.place, kind="stable")
    x, y = bed.place[order], bed.height[order]
    return np.array([_slope(x[a:b], y[a:b]) for a, b in zip([0, *ends[:-1]], ends, strict=True)])


def _changes(
    bed: _Bed, ends: list[int], slopes: Array, extents: dict[int, tuple[float, float]]
) -> tuple[Ints, list[float]]:
    """Return the plane (m,) of each link, and the places (n - 1) along the bed where planes change [m]."""
    order = np.argsort(bed.place, kind="stable")
    x = bed.place[order]
    middle = {face: 0.5 * (low + high) for face, (low, high) in extents.items()}
    number, knots = np.zeros(len(x), np.int64), []
    for k, end in enumerate(ends[:-1]):
        at = 0.5 * (x[end - 1] + x[end])
        valley = slopes[k + 1] > slopes[k]
        faces = (bed.lower if valley else bed.upper)[order]
        after = np.array([middle[int(face)] for face in faces]) > at
        number[after] = k + 1
        before_end = max((extents[int(f)][1] for f in faces[~after]), default=at)
        after_start = min((extents[int(f)][0] for f in faces[after]), default=at)
        knots.append(0.5 * (before_end + after_start))
    of_link = np.empty(len(x), np.int64)
    of_link[order] = number
    return of_link, knots


def _fitted(solids: SolidArrays, sound: Bools, bed: _Bed, posts: Array, number: Ints) -> _Chain:
    """Fit the chain through posts to the corners on both sides."""
    rows, hands = [], []
    for side, sign in ((bed.lower, -1.0), (bed.upper, 1.0)):
        for face in np.unique(side).tolist():
            corners = solids.corners[solids.face_starts[face] : solids.face_starts[face + 1]]
            rows.append(corners)
            hands.append(np.full(len(corners), sign))
    corner, hand = np.concatenate(rows), np.concatenate(hands)
    local = (solids.vertices[corner] - bed.origin) @ bed.axes.T
    design = np.column_stack([_hats(local[:, 0], posts), local[:, 1], 0.5 * hand])
    weight = np.where(sound[corner], 1.0, WORN)
    solution: Array = np.zeros(design.shape[1])
    residual: Array = np.zeros(len(corner))
    for _ in range(MAX_ROUNDS):
        root = np.sqrt(weight)
        fitted = np.linalg.lstsq(design * root[:, None], local[:, 2] * root, rcond=None)[0]
        solution = fitted.astype(np.float64)
        residual = np.abs(local[:, 2] - design @ solution)
        spread = max(deviation(residual, 0.0), 1e-4)
        robust = np.minimum(1.0, 1.5 * spread / np.maximum(residual, 1e-300))
        weight = np.where(sound[corner], robust, WORN)
    return _Chain(posts, solution[:-2], float(solution[-2]), residual[sound[corner]], number)


def _hats(x: Array, posts: Array) -> Array:
    """Return the weights (k, n + 1) of the heights at the posts in the height of the chain at each place."""
    piece = np.clip(np.searchsorted(posts, x, side="right") - 1, 0, len(posts) - 2)
    share = (x - posts[piece]) / (posts[piece + 1] - posts[piece])
    out = np.zeros((len(x), len(posts)))
    out[np.arange(len(x)), piece] = 1.0 - share
    out[np.arange(len(x)), piece + 1] = share
    return out


def _planes(bed: _Bed, chain: _Chain) -> Array:
    """Return the planes (n, 4) between posts, in the frame of the stones."""
    slopes = np.diff(chain.heights) / np.diff(chain.posts)
    across = np.column_stack([-slopes, np.full(len(slopes), -chain.slant), np.ones(len(slopes))])
    normals = across / np.linalg.norm(across, axis=1)[:, None] @ bed.axes
    along, up = np.outer(chain.posts[:-1], bed.axes[0]), np.outer(chain.heights[:-1], bed.axes[2])
    return np.column_stack([normals, (normals * (bed.origin + along + up)).sum(axis=1)])
