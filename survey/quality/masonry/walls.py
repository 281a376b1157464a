"""Masonry quality of each wall of a survey, with what the survey leaves open.

Of the seven parameters of the index (`survey.quality.masonry.index`) a survey of faces and depths tells five:

- SD from the larger side of the faces: most above 0.40 m, or most below 0.20 m;
- SS from the share of the face that is cut: flat, with straight sides, not of kind rubble;
- HJ from the share of head joints at which the bed runs through, within a joint's height;
- VJ from the line of minimum trace on the face: above 1.6 or 1.4 times the straight distance;
- WC from the line of minimum trace in sections, above 1.55 or 1.25, where the opposite face was surveyed too; else from
  the headers per square metre, 5 or 2, where the survey tells headers from stretchers.

The state of the stones and the mortar are left open unless they are given. Every grade has probabilities: shares of n
stones are binomial, traces scatter from place to place.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.special import expit

from ground.statistics.scale import deviation
from survey.arrays import Array
from survey.conventions import ALIKE, MOST, SOME, STEP, STONE, TENTH, WIDEST_JOINT
from survey.geometry.polygons import ring_area
from survey.quality.courses import lower_corners
from survey.quality.facades import Facade
from survey.quality.masonry.index import (
    DIRECTIONS,
    UNKNOWN,
    Direction,
    Grade,
    Parameter,
    category,
    graded,
    index_range,
    limits,
    mechanical_ranges,
)
from survey.quality.masonry.trace import minimum_traces, section_trace

_MIN_WALL_STONES = 8  # least number of stones of a wall
_ARCH = frozenset({"voussoir", "keystone", "springer", "rib_segment", "boss", "rib_springer", "web_stone"})
_CUT = 0.85  # area over that of the convex hull above which sides are straight [-]
_CORNERS = 8  # most corners of a cut face
_THROUGH = STEP  # height of a step at a head joint up to which a bed runs through: a joint [m]
_HEAD_JOINT_DISTANCE = WIDEST_JOINT  # distance of corners at one head joint [m]
_SHARES = (MOST, 1.0 - TENTH)  # of beds that run through, partly and wholly level
_CUT_SHARES = (SOME, 1.0 - SOME)  # of cut stone in the face, partly and predominant
_OPPOSITE = -math.cos(ALIKE)  # of the angle between opposite faces
_THICKEST = 3.0  # thickest wall whose two faces are one section [m]
_APART = STONE  # distance of sections [m]
_ROW = STEP  # height of a row of a section [m]
_LOWEST = STONE  # least height of a section [m]


@dataclass(frozen=True)
class WallStone:
    """A stone, as far as it tells about the masonry.

    Attributes
    ----------
    code, kind, course, zone : as in the survey
    outline : (nv, 3) counter-clockwise seen from outside [m]
    normal : (3,) outward [-]
    sigma : standard deviation of a corner [m]
    depth, depth_sigma : [m]; None if not known
    area : of its face [m²]
    """

    code: str
    kind: str
    course: int | None
    zone: str | None
    outline: Array
    normal: Array
    sigma: float
    depth: float | None
    depth_sigma: float | None
    area: float


@dataclass(frozen=True)
class MasonryQuality:
    """Masonry quality of a wall.

    Attributes
    ----------
    facade, zone : wall
    stones : (m,) indices of its stones
    area : of its faces [m²]
    trace, trace_sigma : line of minimum trace on the face over the straight distance, its median over the wall [-];
        None if the wall is too low
    section, section_sigma : the same in sections through the wall; None if the opposite face was not surveyed
    headers : per square metre; None if the survey does not tell headers from stretchers
    grades : of each parameter
    indices : lowest and highest masonry quality index of each direction, as the survey allows
    """

    facade: str
    zone: str | None
    stones: NDArray[np.intp]
    area: float
    trace: float | None
    trace_sigma: float | None
    section: float | None
    section_sigma: float | None
    headers: float | None
    grades: Mapping[Parameter, Grade]
    indices: Mapping[Direction, tuple[float, float]]

    @property
    def categories(self) -> dict[Direction, str]:
        """Categories of each direction, "B" or from the lowest to the highest, "C to A"."""
        categories = {}
        for direction, ends in self.indices.items():
            low, high = (category(end, direction) for end in ends)
            categories[direction] = low if low == high else f"{low} to {high}"
        return categories

    @property
    def strengths(self) -> dict[str, tuple[float, float]]:
        """Ranges of compressive strength, shear strength and Young's modulus that the index gives [Pa]."""
        return mechanical_ranges(self.indices)


def judge_masonry(
    stones: Sequence[WallStone], facades: Sequence[Facade], grades: Mapping[str, Grade] | None = None
) -> tuple[MasonryQuality, ...]:
    """Judge the masonry of every wall: the stones of one facade and zone, without those of arches.

    Parameters
    ----------
    stones : all stones of the survey
    facades : of the stones
    grades : grades that the survey does not tell, of "SM" and "MM"
    """
    walls = [
        (facade, zone, rows)
        for facade in facades
        if facade.azimuth is not None
        for zone, rows in _zones(stones, facade).items()
        if len(rows) >= _MIN_WALL_STONES
    ]
    return tuple(_judge(stones, facade, zone, rows, facades, grades or {}) for facade, zone, rows in walls)


def _zones(stones: Sequence[WallStone], facade: Facade) -> dict[str | None, list[int]]:
    zones: dict[str | None, list[int]] = defaultdict(list)
    for i in facade.members.tolist():
        if stones[i].kind not in _ARCH:
            zones[stones[i].zone].append(i)
    return zones


def _judge(
    stones: Sequence[WallStone],
    facade: Facade,
    zone: str | None,
    rows: Sequence[int],
    facades: Sequence[Facade],
    stated: Mapping[str, Grade],
) -> MasonryQuality:
    members = [stones[i] for i in rows]
    area = float(sum(member.area for member in members))
    traces = minimum_traces([facade.frame.flatten(member.outline) for member in members])
    trace, trace_sigma = _typical(traces, float(np.median([member.sigma for member in members])))
    sections = np.array(list(_sections(members, facade, _behind(stones, facade, facades))))
    depth_sigma = float(np.median([member.depth_sigma or 0.0 for member in members]))
    section, section_sigma = _typical(sections, depth_sigma)
    kinds = Counter(member.kind for member in members)
    told = kinds["header"] + kinds["stretcher"] > 0
    headers = kinds["header"] / area if told else None
    grades = {
        Parameter.SM: stated.get("SM", UNKNOWN),
        Parameter.MM: stated.get("MM", UNKNOWN),
        Parameter.SD: _size(members),
        Parameter.SS: _shape(members, facade),
        Parameter.HJ: _level(members, facade),
        Parameter.VJ: UNKNOWN
        if trace is None or trace_sigma is None
        else graded(
            trace,
            trace_sigma,
            limits("face_trace"),
            f"minimum trace {trace:.2f} ± {trace_sigma:.2f} on the face",
        ),
        Parameter.WC: _bond(section, section_sigma, headers, kinds["header"], area),
    }
    indices = {direction: index_range(grades, direction) for direction in DIRECTIONS}
    return MasonryQuality(
        facade.name,
        zone,
        np.array(rows, dtype=np.intp),
        area,
        trace,
        trace_sigma,
        section,
        section_sigma,
        headers,
        grades,
        indices,
    )


def _typical(traces: Array, sigma: float) -> tuple[float, float] | tuple[None, None]:
    """Return the median of traces and its standard deviation: from place to place, and of the corners of ten sides."""
    if len(traces) < 3:
        return None, None
    middle = float(np.median(traces))
    spread = deviation(traces, middle)
    return middle, math.hypot(1.2533 * spread / math.sqrt(len(traces)), math.sqrt(10.0) * sigma)


def _share(share: float, count: int, bounds: tuple[float, float], text: str) -> Grade:
    """Grade a share of some stones; its standard deviation is binomial, of one stone more that is half and half."""
    even = (share * count + 0.5) / (count + 1)
    return graded(share, math.sqrt(even * (1.0 - even) / count), bounds, text)


def _size(stones: Sequence[WallStone]) -> Grade:
    sides = np.array([_side(stone) for stone in stones])
    sigma = np.array([max(math.sqrt(2.0) * stone.sigma, 1e-9) for stone in stones])
    above = [float((expit(1.702 * (sides - limit) / sigma)).mean()) for limit in limits("size")]
    count = len(stones)
    text = f"larger sides {np.median(sides):.2f} m, {100.0 * above[1]:.0f} % of them above 0.40 m"
    # fulfilled if most are large, not if most are small
    large = graded(above[1], _deviation(above[1], count), (0.5, 0.5), "")
    small = graded(1.0 - above[0], _deviation(1.0 - above[0], count), (0.5, 0.5), "")
    assert large.chances is not None
    assert small.chances is not None
    fulfilled, unfulfilled = large.chances[2], small.chances[2]
    return Grade((unfulfilled, max(1.0 - fulfilled - unfulfilled, 0.0), fulfilled), text)


def _deviation(share: float, count: int) -> float:
    even = (share * count + 0.5) / (count + 1)
    return math.sqrt(even * (1.0 - even) / count)


def _side(stone: WallStone) -> float:
    """Return the larger of the level and the upright extent of a face."""
    across = np.ptp(stone.outline[:, :2] @ _along(stone.normal))
    return float(max(across, np.ptp(stone.outline[:, 2])))


def _along(normal: Array) -> Array:
    along = np.array([-normal[1], normal[0]])
    return along / max(float(np.linalg.norm(along)), 1e-12)


def _shape(stones: Sequence[WallStone], facade: Facade) -> Grade:
    cut = np.array(
        [stone.kind != "rubble" and _is_cut(facade.frame.flatten(stone.outline)) for stone in stones]
    )
    area = np.array([stone.area for stone in stones])
    share = float(area[cut].sum() / area.sum())
    return _share(share, len(stones), _CUT_SHARES, f"{100.0 * share:.0f} % of the face is of cut stones")


def _is_cut(flat: Array) -> bool:
    if len(flat) > _CORNERS:
        return False
    return ring_area(flat) >= _CUT * float(ConvexHull(flat, qhull_options="QJ").volume)


def _level(stones: Sequence[WallStone], facade: Facade) -> Grade:
    """Grade the beds by their steps at head joints."""
    courses: dict[int, list[tuple[float, float, str]]] = defaultdict(list)
    for stone in stones:
        if stone.course is None:
            continue
        flat = facade.frame.flatten(stone.outline)
        places = lower_corners(stone.outline, facade.frame)
        courses[stone.course] += [(float(flat[k, 0]), float(stone.outline[k, 2]), stone.code) for k in places]
    steps = [
        (abs(high - low), first, second)
        for corners in courses.values()
        for (left, low, first), (right, high, second) in pairwise(sorted(corners))
        if first != second and right - left < _HEAD_JOINT_DISTANCE
    ]
    if len(steps) < _MIN_WALL_STONES // 2:
        return UNKNOWN
    share = float(np.mean([step <= _THROUGH for step, *_ in steps]))
    text = f"beds run through at {100.0 * share:.0f} % of {len(steps)} head joints"
    return _share(share, len(steps), _SHARES, text)


def _bond(
    section: float | None, sigma: float | None, headers: float | None, count: int, area: float
) -> Grade:
    if section is not None and sigma is not None:
        return graded(
            section, sigma, limits("section_trace"), f"minimum trace {section:.2f} ± {sigma:.2f} in sections"
        )
    if headers is not None:
        deviation = math.sqrt(count + 0.5) / area
        return graded(
            headers, deviation, limits("headers"), f"{headers:.1f} ± {deviation:.1f} headers per m²"
        )
    return UNKNOWN


def _behind(stones: Sequence[WallStone], facade: Facade, facades: Sequence[Facade]) -> list[WallStone]:
    """Return the stones of facades that look the other way."""
    others = [
        candidate
        for candidate in facades
        if candidate.azimuth is not None and candidate.frame.axes[2] @ facade.frame.axes[2] <= _OPPOSITE
    ]
    return [stones[i] for one in others for i in one.members.tolist()]


def _sections(stones: Sequence[WallStone], facade: Facade, behind: Sequence[WallStone]) -> Iterator[float]:
    """Yield the line of minimum trace in sections along a wall of which both faces were surveyed."""
    if not behind:
        return
    front, back = _boxes(stones, facade), _boxes(behind, facade)
    left, right = max(front[:, 0].min(), back[:, 0].min()), min(front[:, 2].max(), back[:, 2].max())
    for s in np.arange(left + _APART / 2.0, right, _APART).tolist():
        here, there = (boxes[(boxes[:, 0] <= s) & (s <= boxes[:, 2])] for boxes in (front, back))
        if not len(here) or not len(there):
            continue
        low, high = max(here[:, 1].min(), there[:, 1].min()), min(here[:, 3].max(), there[:, 3].max())
        outer = float(np.median(here[:, 4]))
        there = there[(outer - there[:, 4] > 0.0) & (outer - there[:, 4] < _THICKEST)]
        if (
            high - low < _LOWEST
            or not len(there)
            or np.isnan(here[:, 5]).any()
            or np.isnan(there[:, 5]).any()
        ):
            continue
        thick = outer - float(np.median(there[:, 4]))
        rows = np.arange(low + _ROW / 2.0, high, _ROW)
        reach = [_reach(here, z) for z in rows]
        rest = [thick - _reach(there, z) for z in rows]
        yield section_trace(np.full(len(rows), _ROW), np.minimum(reach, thick), np.maximum(rest, 0.0))


def _reach(boxes: Array, height: float) -> float:
    """Return the depth of the stone at a height of a section, 0 in a joint wider than that of its stones."""
    inside = boxes[(boxes[:, 1] <= height) & (height <= boxes[:, 3])]
    if len(inside):
        return float(inside[:, 5].max())
    return 0.0


def _boxes(stones: Sequence[WallStone], facade: Facade) -> Array:
    """Return left, low, right, high, place outwards and depth of faces in a facade's frame, (m, 6)."""
    rows = []
    for stone in stones:
        flat = facade.frame.flatten(stone.outline)
        out = float(((stone.outline - facade.frame.origin) @ facade.frame.axes[2]).mean())
        rows.append(
            [*flat.min(axis=0), *flat.max(axis=0), out, math.nan if stone.depth is None else stone.depth]
        )
    return np.array(rows)
