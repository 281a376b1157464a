"""The outline of a face in its own plane: order, orientation and size."""

import math
from dataclasses import dataclass

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import FEW, LEAST, NOTICEABLE

Point = tuple[float, float]

_NOISE = NOTICEABLE  # so are corners nearer than this many standard deviations of a coordinate
_LEVEL = FEW  # sine of the angle between normal and vertical below which a face has no level direction


@dataclass(frozen=True)
class Outline:
    """A simple polygon.

    Attributes
    ----------
    corners : (nv, 2) in the plane of the face, counter-clockwise [m]
    source : index of the given corner of each; of merged corners, the first
    merged : given corners that were merged with one before them
    reordered : whether the outline crossed itself in the given order
    """

    corners: Array
    source: tuple[int, ...]
    merged: tuple[int, ...] = ()
    reordered: bool = False


@dataclass(frozen=True)
class OutlineMeasures:
    """Size and shape of a face.

    Attributes
    ----------
    area : [m²]
    length, height : extents along the level direction of the face and perpendicular to it [m]; of a level face,
        the larger and the smaller principal extent
    skew : difference of the angle between the two middle lines of a face of four corners from a right angle, its
        absolute value [rad]; None for other faces
    """

    area: float
    length: float
    height: float
    skew: float | None


def outline_polygon(flat: Array, sigma: float, *, keep_order: bool = False) -> Outline:
    """Make a simple polygon, counter-clockwise, of the measured corners of a face.

    Corners measured twice are merged. An outline that crosses itself is put in order if its corners are in
    convex position: then only one order goes around them.

    Parameters
    ----------
    flat : (n, 2) corners in the plane of the face, seen from outside [m]
    sigma : standard deviation of a coordinate [m]
    keep_order : refuse an outline that crosses itself, because its order defines the outer side

    Returns
    -------
    Outline, with the changes made

    Raises
    ------
    GeometryError
        if fewer than three corners are left, they enclose nothing, or the order cannot be known
    """
    points: list[Point] = [(x, y) for x, y in flat.tolist()]
    nearest = max(LEAST, _NOISE * sigma)
    order, merged = _distinct(points, nearest)
    if len(order) < 3:
        raise GeometryError(
            f"its outline has {len(order)} distinct corners", remedy="measure 3 corners or more, each once"
        )
    reordered = False
    if (crossing := _first_crossing([points[i] for i in order])) is not None:
        unique = [] if keep_order else _unique(points, order, nearest)
        around = _around(points, unique) if len(unique) > 2 else None
        if around is None:
            first, second = (order[side] + 1 for side in crossing)
            raise GeometryError(
                f"the outline crosses itself after corners {first} and {second}",
                remedy="list the corners in order around the face",
            )
        merged += [i for i in order if i not in unique]
        reordered = _first_crossing([points[i] for i in unique]) is not None
        order = around
    area = _signed_area([points[i] for i in order])
    if abs(area) <= (3.0 * sigma) ** 2:
        raise GeometryError(
            f"its outline encloses {abs(area) * 1e6:.3g} mm²",
            remedy="look at the order and place of its corners",
        )
    if area < 0.0:
        order.reverse()
    return Outline(flat[order], tuple(order), tuple(sorted(merged)), reordered)


def measure_outline(flat: Array, level: Array | None) -> OutlineMeasures:
    """Measure a polygon.

    Parameters
    ----------
    flat : (nv, 2) corners, counter-clockwise [m]
    level : (2,) unit vector of the level direction in the plane; None if the face itself is level
    """
    lying = level is None
    if level is None:
        level = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)[2][0]
    c, s = level.tolist()
    points = [(x, y) for x, y in (flat - flat[0]).tolist()]
    along, across = [c * x + s * y for x, y in points], [c * y - s * x for x, y in points]
    length, height = max(along) - min(along), max(across) - min(across)
    if lying and length < height:  # crowded corners can spread most along the shorter extent
        length, height = height, length
    return OutlineMeasures(
        area=_signed_area(points),
        length=length,
        height=height,
        skew=_skew(points) if len(points) == 4 else None,
    )


def level_direction(normal: Array, axes: Array) -> Array | None:
    """Return the level direction in a plane, (2,) in its axes (2, 3); None if the plane itself is level."""
    along = np.array([-normal[1], normal[0], 0.0])
    size = math.hypot(along[0], along[1])
    if size <= _LEVEL:
        return None
    out: Array = axes @ along / size
    return out


def _distinct(points: list[Point], nearest: float) -> tuple[list[int], list[int]]:
    """Separate corners from repetitions of the corner before them."""
    order: list[int] = [0]
    merged: list[int] = []
    for i in range(1, len(points)):
        (merged if math.dist(points[i], points[order[-1]]) < nearest else order).append(i)
    while len(order) > 1 and math.dist(points[order[-1]], points[order[0]]) < nearest:
        merged.append(order.pop())
    return order, merged


def _unique(points: list[Point], order: list[int], nearest: float) -> list[int]:
    """Drop repetitions of any earlier corner, wherever they come."""
    unique: list[int] = []
    for i in order:
        if all(math.dist(points[i], points[k]) >= nearest for k in unique):
            unique.append(i)
    return unique


def _first_crossing(points: list[Point]) -> tuple[int, int] | None:
    """Find two sides that cross or touch and are not neighbours; return their numbers, or None."""
    count = len(points)
    if count > 40:
        return _first_crossing_of_many(np.array(points))
    for i in range(count):
        for j in range(i + 2, count - (i == 0)):
            if _cross(points[i], points[i + 1], points[j], points[(j + 1) % count]):
                return i, j
    return None


def _cross(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Return whether the segments a–b and c–d have a point in common; parallel ones never do."""
    ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], d[0] - c[0], d[1] - c[1]
    wx, wy = c[0] - a[0], c[1] - a[1]
    denominator = ux * vy - uy * vx
    if abs(denominator) < 1e-15:
        return False
    s, t = (wx * vy - wy * vx) / denominator, (wx * uy - wy * ux) / denominator
    return 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0


def _first_crossing_of_many(points: Array) -> tuple[int, int] | None:
    """Do as `_first_crossing`, testing one side against all later ones at a time."""
    sides = np.roll(points, -1, axis=0) - points
    for i in range(len(points) - 2):
        later = slice(i + 2, len(points) - (i == 0))
        (ux, uy), (vx, vy), (wx, wy) = sides[i], sides[later].T, (points[later] - points[i]).T
        denominator = ux * vy - uy * vx
        apart = np.abs(denominator) < 1e-15
        denominator = np.where(apart, 1.0, denominator)
        s, t = (wx * vy - wy * vx) / denominator, (wx * uy - wy * ux) / denominator
        hits = ~apart & (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
        if hits.any():
            return i, i + 2 + int(hits.argmax())
    return None


def _around(points: list[Point], order: list[int]) -> list[int] | None:
    """Return the order in which an outline goes around corners in convex position; None if they are not."""
    x = math.fsum(points[i][0] for i in order) / len(order)
    y = math.fsum(points[i][1] for i in order) / len(order)
    around = sorted(order, key=lambda i: math.atan2(points[i][1] - y, points[i][0] - x))
    start = around.index(order[0])
    around = around[start:] + around[:start]
    for before, here, after in zip(around[-1:] + around[:-1], around, around[1:] + around[:1], strict=True):
        if _signed_area([points[before], points[here], points[after]]) <= 0.0:
            return None
    return around


def _signed_area(points: list[Point]) -> float:
    x, y = points[0]
    return 0.5 * math.fsum(
        (a[0] - x) * (b[1] - y) - (b[0] - x) * (a[1] - y)
        for a, b in zip(points, points[1:] + points[:1], strict=True)
    )


def _skew(points: list[Point]) -> float:
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = points
    ux, uy, vx, vy = bx + cx - ax - dx, by + cy - ay - dy, cx + dx - ax - bx, cy + dy - ay - by
    return abs(math.atan2(ux * vy - uy * vx, ux * vx + uy * vy) - 0.5 * math.pi)
