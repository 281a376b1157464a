"""Courses, kinds and codes of outlined stones, by the rules of masonry."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.conventions import GROUP, MOST, PARALLEL, SLOPED, SOME

_HEADER = 1.5  # length over height below which a stone of a course shows its head
_SHARED = MOST  # part of the lesser height that two neighbours of one course share
_NEAR = SOME  # distance between neighbours of a course, over their height
_LEANS = math.degrees(SLOPED)  # angle of a side from upright from which it is radial [degrees]
_STEEP = math.degrees(PARALLEL)  # and from which it is the skewback of an arch, beside it
_TOUCHES = (
    0.2  # distance from an opening or a corner, over the height of a stone, up to which a stone bounds it
)
_EDGE = SOME  # part of the height of an opening, of its top, in which its arch or lintel lies
_FEWEST = GROUP  # stones of an arch, and courses that end flush at a corner
_BESIDE = MOST  # part of a stone's height that lies beside an opening, for a jamb


@dataclass(frozen=True)
class Named:
    """Name of a stone.

    Attributes
    ----------
    code : e.g. "C03-05": the fifth from the left in the third course from the ground; "S017" without courses
    kind : proposed by rule
    course : from the ground, from 1; None without courses
    place : from the left within it, or in reading order, from 1
    """

    code: str
    kind: str
    course: int | None
    place: int


def name_stones(
    rings: Sequence[Array], openings: Sequence[Array], coursed: bool, cut: Sequence[bool] | None = None
) -> list[Named]:
    """Name stones by their place.

    Parameters
    ----------
    rings : (n, 2) outlines, to the right and upwards [m]
    openings : (2, 2) lower left and upper right corner of each opening [m]
    coursed : whether the wall has courses
    cut : stones that the edge of the picture cuts; None: none
    """
    if not rings:
        return []
    boxes = np.array([[ring.min(axis=0), ring.max(axis=0)] for ring in rings])
    kinds = [""] * len(rings)
    for opening in openings:
        _around(rings, boxes, opening, kinds, coursed)
    if not coursed:
        order = _reading_order(boxes)
        place_of = {k: place for place, k in enumerate(order, start=1)}
        return [
            Named(f"S{place_of[k]:03d}", kind or "rubble", None, place_of[k]) for k, kind in enumerate(kinds)
        ]
    arch = np.array([kind in ("voussoir", "keystone") for kind in kinds])
    courses = _courses(boxes, arch)
    _corners(boxes, courses, kinds, cut or [False] * len(rings))
    out: dict[int, Named] = {}
    for number, members in enumerate(courses, start=1):
        for place, k in enumerate(members, start=1):
            size = boxes[k, 1] - boxes[k, 0]
            kind = kinds[k] or ("header" if size[0] < _HEADER * size[1] else "stretcher")
            out[k] = Named(f"C{number:02d}-{place:02d}", kind, number, place)
    across = sorted(np.flatnonzero(arch).tolist(), key=lambda k: float(boxes[k, :, 0].mean()))
    for place, k in enumerate(across, start=1):
        out[k] = Named(f"V{place:02d}", kinds[k], None, place)
    return [out[k] for k in range(len(rings))]


def _courses(boxes: Array, arch: Array) -> list[list[int]]:
    """Return the stones of each course from the ground, from left to right."""
    low, high = boxes[:, 0, 1], boxes[:, 1, 1]
    height = high - low
    group = list(range(len(boxes)))

    def root(k: int) -> int:
        """Return the first member of the group of a stone."""
        while group[k] != k:
            group[k] = group[group[k]]
            k = group[k]
        return k

    candidates = [k for k in range(len(boxes)) if not arch[k]]
    order = sorted(candidates, key=lambda k: float(boxes[k, 0, 0]))
    for i, a in enumerate(order):
        for b in order[i + 1 :]:
            least = min(height[a], height[b])
            if boxes[b, 0, 0] - boxes[a, 1, 0] > _NEAR * least:
                break
            beside = boxes[b, 0, 0] > 0.5 * (boxes[a, 0, 0] + boxes[a, 1, 0])
            shared = min(high[a], high[b]) - max(low[a], low[b])
            if beside and shared > _SHARED * max(height[a], height[b]):
                group[root(b)] = root(a)
    members: dict[int, list[int]] = {}
    for k in order:
        members.setdefault(root(k), []).append(k)
    return _joined_rows(list(members.values()), boxes)


def _joined_rows(rows: list[list[int]], boxes: Array) -> list[list[int]]:
    """Join the parts of courses that an opening or a gap interrupts, and order all from the ground."""
    rows = sorted(rows, key=lambda row: float(np.median(boxes[row, :, 1].mean(axis=1))))
    out: list[list[int]] = []
    for row in rows:
        low, high = np.median(boxes[row, 0, 1]), np.median(boxes[row, 1, 1])
        for known in out:
            shared = min(high, np.median(boxes[known, 1, 1])) - max(low, np.median(boxes[known, 0, 1]))
            larger = max(high - low, float(np.median(boxes[known, 1, 1] - boxes[known, 0, 1])))
            middles = boxes[row][:, :, 0].mean(axis=1)[:, None]
            apart = ((middles < boxes[known, 0, 0]) | (middles > boxes[known, 1, 0])).all()
            if shared > _SHARED * larger and apart:
                known += row
                break
        else:
            out.append(list(row))
    out.sort(key=lambda row: float(np.median(boxes[row, :, 1].mean(axis=1))))
    return [sorted(row, key=lambda k: float(boxes[k, 0, 0])) for row in out]


def _reading_order(boxes: Array) -> list[int]:
    """Return stones in rows of about a stone's height, from the ground, each from left to right."""
    middles = boxes.mean(axis=1)
    height = float(np.median(boxes[:, 1, 1] - boxes[:, 0, 1]))
    row = np.floor((middles[:, 1] - middles[:, 1].min()) / max(height, 1e-9) + 0.5)
    order: list[int] = np.lexsort((middles[:, 0], row)).tolist()
    return order


def _around(rings: Sequence[Array], boxes: Array, opening: Array, kinds: list[str], coursed: bool) -> None:
    """Name the stones around an opening: its arch or lintel, its jambs, its sill."""
    (left, bottom), (right, top) = opening
    width, height = right - left, top - bottom
    over: list[int] = []
    for k, ring in enumerate(rings):
        (x0, y0), (x1, y1) = boxes[k]
        reach = _TOUCHES * (y1 - y0)
        beside = min(y1, top) - max(y0, bottom)
        across = min(x1, right) - max(x0, left)
        if y1 <= bottom + 0.5 * (y1 - y0) and bottom - y1 < reach and across > 0.7 * width:
            kinds[k] = "sill"
        elif y1 > top - _EDGE * height and y0 < top + reach and x0 < right + reach and x1 > left - reach:
            leaning = _radial_sides(ring)
            if leaning == 2 or (across > 0.0 and leaning and abs(x0 + x1 - left - right) < width):
                over.append(k)
                kinds[k] = "voussoir"
            elif across > 0.9 * width and y0 > top - reach:
                kinds[k] = "lintel"
        if not kinds[k] and coursed and beside > _BESIDE * (y1 - y0):
            start, stop = _width_at(ring, 0.5 * (min(y1, top) + max(y0, bottom)))
            if min(abs(stop - left), abs(start - right)) < reach:
                kinds[k] = "jamb"
    for k, ring in enumerate(rings):
        beside = [j for j in over if _touch(boxes[j], boxes[k], _TOUCHES * (boxes[k, 1, 1] - boxes[k, 0, 1]))]
        if kinds[k] in ("", "jamb") and beside and _radial_sides(ring, _STEEP) == 1:
            kinds[k] = "springer"
    if len(over) >= _FEWEST:
        middle = 0.5 * (left + right)
        crown = [k for k in over if boxes[k, 0, 0] < middle < boxes[k, 1, 0]]
        if crown:
            best = min(crown, key=lambda k: abs(float(boxes[k, :, 0].mean()) - middle))
            if abs(float(boxes[best, :, 0].mean()) - middle) < 0.25 * (boxes[best, 1, 0] - boxes[best, 0, 0]):
                kinds[best] = "keystone"


def _width_at(ring: Array, height: float) -> tuple[float, float]:
    """Return where a level line enters and leaves a stone."""
    after = np.roll(ring, -1, axis=0)
    low, high = ring[:, 1] - height, after[:, 1] - height
    crossed = (low > 0.0) != (high > 0.0)
    share = low[crossed] / (low - high)[crossed]
    places = ring[crossed, 0] + share * (after - ring)[crossed, 0]
    return float(places.min()), float(places.max())


def _corners(boxes: Array, courses: Sequence[Sequence[int]], kinds: list[str], cut: Sequence[bool]) -> None:
    """Name the quoins: the last stones of courses that end flush, where the wall is seen to end."""
    for side, place in ((0, 0), (1, -1)):
        ends = [members[place] for members in courses if not cut[members[place]]]
        if not ends:
            continue
        outer = boxes[ends, side, 0]
        height = boxes[ends, 1, 1] - boxes[ends, 0, 1]
        flush = np.abs(outer - np.median(outer)) < _TOUCHES * height
        if flush.sum() < max(_FEWEST, 2 * len(courses) / _FEWEST):  # two of three
            continue
        for k in np.array(ends)[flush].tolist():
            kinds[k] = kinds[k] or "quoin"


def _touch(one: Array, other: Array, reach: float) -> bool:
    """Return whether two boxes (2, 2) are within a distance."""
    return bool((one[0] < other[1] + reach).all() and (other[0] < one[1] + reach).all())


def _radial_sides(ring: Array, least: float = _LEANS) -> int:
    """Return how many of the two lateral sides of a stone lean, each one side of a tenth of its outline or more."""
    side = np.roll(ring, -1, axis=0) - ring
    length = np.linalg.norm(side, axis=1)
    lean = np.degrees(np.arctan2(np.abs(side[:, 0]), np.abs(side[:, 1])))
    leaning = (lean > least) & (lean < 83.0) & (length > 0.12 * length.sum())
    middle = ring[:, 0].mean()
    at = 0.5 * (ring[:, 0] + np.roll(ring[:, 0], -1))
    return int((leaning & (at < middle)).any()) + int((leaning & (at >= middle)).any())
