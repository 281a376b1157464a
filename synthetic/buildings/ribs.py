"""A quadripartite rib vault over a square bay: diagonal ribs, a boss, springers, webs in courses, and wall ribs.

::

        ┌─────────────┐     Plan of the bay, half as wide as `half`. Each diagonal rib is an arc of a circle in its own
        │ ╲    N    ╱ │     upright plane. The beds of the webs are level and run square to the wall: bed k and joint k
        │   ╲     ╱   │     of the rib meet in one line. A rib segment has a seat under either web, in the plane of the
        │  W  boss  E │     web's bed and square to the thrust of the web, and an end upright beside the course below.
        │   ╱     ╲   │     So all joints are plane, and all stones convex.
        │ ╱    S    ╲ │
        └─────────────┘

Above the springers the web's soffit along a rib is an arc of radius R in the rib's plane; at the angle θ from the
vertical, u = R sin θ from the centre. The web over a half of a wall goes through the same heights at x = (u - w) / √2,
where w is half the width of the rib at its joints. So tan α = √2 tan θ is its slope, and a bed that is square to it
meets the joint of the rib, square to the arc, in a line upright over y = x + √2 w.

Along each wall a wall rib (formeret) may continue the curve of the web, an arch from springer to springer: its joints
lie in the beds of the web, whose courses end beside it.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from random import Random

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.extrusion.extrusion import prism
from survey.geometry.half_spaces import intersection
from survey.geometry.solids import Solid
from synthetic.bond import PlannedStone
from synthetic.building import Draft, SolidDraft, SyntheticBuilding, measured_building, observer
from synthetic.frame import TrueStone, WallFrame

WALL_RIB = 0.22
"""Width of wall ribs where a vault has them [m]."""
WEBS = "NESW"
"""Names of the webs, by the walls that they meet."""

_FOOT = np.array([31.4, 22.65, 9.8])  # of the vertical axis in the site, at the springing [m]
_AZIMUTH = math.radians(11.0)  # of the wall S against the x axis
_LENGTH = 0.5  # of a stone of a web [m]
_SHORTEST = 0.15  # part of a stone of a web beyond the seat that it rests on [m]
_JITTER = 0.04  # largest deviation of head joints from a regular bond [m]
_PENDANT = 0.03  # drop of the boss below the ribs [m]
_PLANE_ROUNDING = 1e-12  # distance of corners that lie on one plane [m]


@dataclass(frozen=True)
class RibVaultShape:
    """Dimensions of a rib vault.

    Attributes
    ----------
    half : half the side of the bay [m]
    radius : of the web's soffit along a rib, in the plane of the rib [m]
    segments : of a rib, from a springer to the boss
    springing, crown : angles of a rib's joints with the springer and with the boss from the vertical [rad]
    width : of a rib at its joints [m]
    drop : of a rib's soffit below the web's [m]
    height : of a rib [m]
    thickness : of the webs [m]
    springer : height of a springer below the web's soffit at its joint with the rib [m]
    wall_rib : width of the wall ribs; 0: there are none [m]
    wall_drop : of the soffit of a wall rib below the web's [m]
    clear : distance of wall ribs, or of webs without them, from the walls, which springers reach [m]
    """

    half: float = 2.0
    radius: float = 2.0 * math.sqrt(2.0)
    segments: int = 8
    springing: float = math.radians(50.0)
    crown: float = math.radians(5.0)
    width: float = 0.26
    drop: float = 0.10
    height: float = 0.34
    thickness: float = 0.20
    springer: float = 0.7
    wall_rib: float = 0.0
    wall_drop: float = 0.06
    clear: float = 0.0

    @property
    def reach(self) -> float:
        """Distance of the ends of the webs from the axis [m]."""
        return self.half - self.clear - self.wall_rib

    @property
    def heights(self) -> tuple[float, float, float]:
        """Heights of the springers' foot and highest corner and of the boss's back above the arcs' centre [m]."""
        first = self.beds()[0]
        corner = first.z - (self.half - first.x) * float(first.along[0] / first.along[2])
        return first.z - self.springer, corner, (self.radius + self.height - self.drop) * math.cos(self.crown)

    @property
    def angles(self) -> Array:
        """Angles of the joints of a rib from the vertical, from the springer up [rad]."""
        return np.linspace(self.springing, self.crown, self.segments + 1)

    def beds(self) -> list["WebBed"]:
        """Return the beds of the webs, from the springers up."""
        return [WebBed.of(angle, self) for angle in self.angles.tolist()]


@dataclass(frozen=True)
class WebBed:
    """A bed of a web and the joint of the rib that it meets, in the bay: x and y level from the axis, z upwards.

    Attributes
    ----------
    x, z : of the web's soffit at the bed [m]
    end : distance y of the end of the bed from the axis [m]
    along : (3,) square to the bed, down the web that lies over +y [-]
    up : (3,) in the bed, square to the web [-]
    joint : (3,) square to the rib's joint, down the rib [-]
    rise : (3,) in the joint, square to the rib [-]
    """

    x: float
    z: float
    end: float
    along: Array
    up: Array
    joint: Array
    rise: Array

    @classmethod
    def of(cls, angle: float, shape: RibVaultShape) -> "WebBed":
        """Return the bed at an angle of the rib from the vertical [rad]."""
        x = (shape.radius * math.sin(angle) - 0.5 * shape.width) / math.sqrt(2.0)
        slope = math.atan(math.sqrt(2.0) * math.tan(angle))
        level = math.sin(angle) / math.sqrt(2.0), math.cos(angle) / math.sqrt(2.0)
        return cls(
            x,
            shape.radius * math.cos(angle),
            x + shape.width / math.sqrt(2.0),
            np.array([math.cos(slope), 0.0, -math.sin(slope)]),
            np.array([math.sin(slope), 0.0, math.cos(slope)]),
            np.array([level[1], level[1], -math.sin(angle)]),
            np.array([level[0], level[0], math.cos(angle)]),
        )

    def on_soffit(self) -> Array:
        """Return the place of the bed on the web's soffit, at its end (3,) [m]."""
        return np.array([self.x, self.end, self.z])


@dataclass(frozen=True)
class SyntheticRibVault:
    """A synthetic rib vault.

    Attributes
    ----------
    building : its webs measured from below; springers, segments of both kinds of ribs, and boss modelled as solids
    shape : its dimensions
    foot : (3,) centre of the arcs of both diagonal ribs, beneath the boss [m]
    axes : (3, 3) rows: along the walls S and W, and upwards [-]
    """

    building: SyntheticBuilding
    shape: RibVaultShape
    foot: Array
    axes: Array

    def rib_axis(self, rib: int, count: int = 50) -> Array:
        """Return places (count, 3) along the axis of a half rib, 1 to 4, from its springer to the boss [m].

        The axis is an arc in the upright plane of the rib, through the middle of its section.
        """
        shape = self.shape
        angles = np.linspace(shape.springing, shape.crown, count)
        radius = shape.radius - shape.drop + 0.5 * shape.height
        level = radius * np.sin(angles) / math.sqrt(2.0)
        arc = np.column_stack([level, level, radius * np.cos(angles)])
        out: Array = arc @ _turn(rib - 1).T @ self.axes + self.foot
        return out


def rib_vault(shape: RibVaultShape | None = None, seed: int = 1) -> SyntheticRibVault:
    """Build a rib vault over a square bay and measure its webs from below.

    Parameters
    ----------
    shape : its dimensions; None: RibVaultShape()
    seed : of Python's own generator, whose stream is the same everywhere

    Returns
    -------
    SyntheticRibVault, whose codes are <web><course>-<number>, with l or r after the course for the halves of a web;
    R<rib>-<number> for the segments of the four half ribs, T<rib> for their springers, B for the boss, and
    F<web>-<number> for the segments of the wall rib beside a web, from left to right as seen from inside

    Raises
    ------
    GeometryError
        if the webs meet behind the ribs, or the springers do not reach the walls
    """
    shape, rng = shape or RibVaultShape(), Random(seed)
    cos, sin = math.cos(_AZIMUTH), math.sin(_AZIMUTH)
    axes = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    drafts, ribs = vault_drafts(shape, _FOOT, axes, rng)
    base = [draft.solid.code for draft in ribs if draft.kind == "rib_springer"]
    depths = {"web_stone": shape.thickness}
    building = measured_building("rib vault", drafts, depths, [observer(_FOOT)], base, rng, modelled=ribs)
    return SyntheticRibVault(building, shape, _FOOT, axes)


def vault_drafts(
    shape: RibVaultShape, foot: Array, axes: Array, rng: Random
) -> tuple[list[Draft], list[SolidDraft]]:
    """Draft the stones of a rib vault in the site: its webs, and what is modelled as solids.

    Parameters
    ----------
    shape : its dimensions
    foot : (3,) centre of the arcs of both diagonal ribs [m]
    axes : (3, 3) rows: along the walls S and W, and upwards [-]
    rng : random numbers

    Raises
    ------
    GeometryError
        as `rib_vault`
    """
    _check(shape)
    beds = shape.beds()
    webs = [
        _web_draft(stone, foot, axes)
        for turns, name in enumerate(WEBS)
        for stone in _web(name, _turn(turns), beds, shape, rng)
    ]
    ribs = [
        SolidDraft(Solid(code, rib.vertices @ axes + foot, rib.faces), kind)
        for code, (kind, rib) in _ribs(beds, shape)
    ]
    return webs, ribs


def _check(shape: RibVaultShape) -> None:
    """Refuse shapes whose stones would lie in each other."""
    first = shape.beds()[0]
    if shape.thickness * float(first.up[0]) >= math.sqrt(0.5) * shape.width:
        raise GeometryError(
            f"webs {shape.thickness:g} m thick meet behind ribs {shape.width:g} m wide",
            remedy="make ribs wider, webs thinner, or springers higher",
        )
    if first.end + _SHORTEST >= shape.reach:
        raise GeometryError(
            f"the first bed ends {first.end:.2f} m from the axis, the {'wall rib' if shape.wall_rib else 'wall'} is at "
            f"{shape.reach:g} m",
            remedy="give a smaller radius, or a smaller angle of the springing",
        )


@dataclass(frozen=True)
class _WebStone:
    """A stone of a web in the bay: its plan, its frame there, and the ways (4, 3) to its hidden corners [m]."""

    plan: PlannedStone
    frame: WallFrame
    back: Array


def _turn(quarters: int) -> Array:
    """Return a turn (3, 3) clockwise about the axis, with which the web over +y becomes the others."""
    c, s = ((1.0, 0.0), (0.0, -1.0), (-1.0, 0.0), (0.0, 1.0))[quarters]
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _mirrored(bed: WebBed) -> WebBed:
    """Return the bed of the other half of a web, whose joint and rise stay those of this half's rib."""
    mirror = np.diag([-1.0, 1.0, 1.0])
    return WebBed(-bed.x, bed.z, bed.end, mirror @ bed.along, mirror @ bed.up, bed.joint, bed.rise)


def _web(
    name: str, turn: Array, beds: Sequence[WebBed], shape: RibVaultShape, rng: Random
) -> Iterator[_WebStone]:
    """Lay the courses of a web, those of both halves up to the course at its crown."""
    mirror = np.diag([-1.0, 1.0, 1.0])
    for half, into in (("l", turn @ mirror), ("r", turn)):
        for course, (low, high) in enumerate(pairwise(beds), start=1):
            seat = beds[course - 2].end if course > 1 else low.end
            heads = _heads(course, low.end, seat, shape.reach, rng)
            yield from _course(f"{name}{course:02d}{half}", course, (low, high), heads, into, shape)
    last, course = beds[-1], len(beds)
    mirrored = _mirrored(last)
    heads = _heads(course, last.end, beds[-2].end, shape.reach, rng)
    yield from _course(f"{name}{course:02d}", course, (last, mirrored), heads, turn, shape)


def _heads(course: int, end: float, seat: float, wall: float, rng: Random) -> list[float]:
    """Return the ends of the stones of a course from the rib to the wall; the rib bears what lies up to `seat` [m]."""
    first = _LENGTH * (0.5 if course % 2 else 1.0)
    count = int((wall - first - seat - _SHORTEST - _JITTER) // _LENGTH) + 1
    inner = [wall - first - k * _LENGTH + rng.uniform(-_JITTER, _JITTER) for k in range(max(count, 0))]
    return [end, *reversed(inner), wall]


def _course(
    code: str, course: int, beds: tuple[WebBed, WebBed], heads: list[float], into: Array, shape: RibVaultShape
) -> Iterator[_WebStone]:
    """Lay the stones of a course between two beds of the web over +y, turned or mirrored by `into`."""
    low, high = beds
    chord = np.array([high.x - low.x, 0.0, high.z - low.z])
    length = float(np.linalg.norm(chord))
    rise = into @ chord / length
    outward = into @ np.array([-chord[2], 0.0, chord[0]]) / length
    outward *= np.sign(outward[2])
    frame = WallFrame(into @ [low.x, 0.0, low.z], np.array([np.cross(rise, -outward), rise, -outward]))
    along = float(frame.axes[0] @ into[:, 1])
    back = [into @ bed.up / float((into @ bed.up) @ outward) for bed in beds]
    for number, ends in enumerate(pairwise(heads), start=1):
        start, stop = sorted(along * end for end in ends)
        corners = np.array([(start, 0.0), (stop, 0.0), (stop, length), (start, length)])
        plan = PlannedStone(f"{code}-{number}", "web_stone", course, corners, (True,) * 4)
        yield _WebStone(plan, frame, shape.thickness * np.array([back[0], back[0], back[1], back[1]]))


def _web_draft(stone: _WebStone, foot: Array, axes: Array) -> Draft:
    """Place a stone of a web in the site."""
    frame = WallFrame(stone.frame.origin @ axes + foot, stone.frame.axes @ axes)
    front = frame.place(stone.plan.corners)
    solid = prism(stone.plan.code, front, front + stone.back @ axes)
    offset = float(frame.axes[2] @ frame.origin)
    depth = float(-stone.back[0] @ stone.frame.axes[2])
    true = TrueStone(stone.plan, frame.axes[2], offset, depth, solid)
    return Draft(true, frame, stone.plan.corners, zone=f"web {stone.plan.code[0]}")


def _ribs(beds: Sequence[WebBed], shape: RibVaultShape) -> Iterator[tuple[str, tuple[str, Solid]]]:
    """Cut springers, segments of the ribs and the wall ribs, and boss in the bay; yield code, kind and solid."""
    for rib in range(4):
        turn = _turn(rib)
        yield f"T{rib + 1}", ("rib_springer", _turned(_springer(beds[0], shape), turn))
        for number, (low, high) in enumerate(pairwise(beds), start=1):
            segment = _turned(_segment(low, high, shape), turn)
            yield f"R{rib + 1}-{number:02d}", ("rib_segment", segment)
    yield "B", ("boss", _boss(beds[-1], shape))
    whole = [*map(_mirrored, beds), *reversed(beds)]
    for turns, name in enumerate(WEBS if shape.wall_rib else ""):
        for number, (left, right) in enumerate(pairwise(whole), start=1):
            yield (
                f"F{name}-{number:02d}",
                ("rib_segment", _turned(_wall_segment(left, right, shape), _turn(turns))),
            )


def _turned(solid: Solid, turn: Array) -> Solid:
    return Solid(solid.code, solid.vertices @ turn.T, solid.faces)


def _segment(low: WebBed, high: WebBed, shape: RibVaultShape) -> Solid:
    """Cut the rib segment over +x and +y between two joints; its seats lie in the upper beds."""
    soffit = _on_soffit(low, shape), _on_soffit(high, shape)
    back = low.rise + high.rise
    back = back / np.linalg.norm(back)
    planes = [
        (low.joint, float(low.joint @ low.on_soffit())),
        (-high.joint, float(-high.joint @ high.on_soffit())),
        *((one, offset) for one, offset in _both(-high.along, float(-high.along @ high.on_soffit()))),
        *_both(np.array([0.0, 1.0, 0.0]), low.end),
        (-back, float(-back @ soffit[0])),
        (back, float(back @ soffit[0]) + shape.height),
    ]
    return _cut("segment", planes, shape)


def _wall_segment(left: WebBed, right: WebBed, shape: RibVaultShape) -> Solid:
    """Cut the segment of the wall rib over +y between two beds of the web, as thick as the web and its drop."""
    chord = np.array([right.x - left.x, 0.0, right.z - left.z])
    outward = np.array([-chord[2], 0.0, chord[0]]) / float(np.linalg.norm(chord))
    soffit = float(outward @ left.on_soffit())
    ends = [-math.copysign(1.0, left.along[0]) * left.along, math.copysign(1.0, right.along[0]) * right.along]
    planes = [
        (ends[0], float(ends[0] @ left.on_soffit())),
        (ends[1], float(ends[1] @ right.on_soffit())),
        (np.array([0.0, 1.0, 0.0]), shape.half - shape.clear),
        (np.array([0.0, -1.0, 0.0]), -shape.reach),
        (-outward, shape.wall_drop - soffit),
        (outward, soffit + shape.thickness),
    ]
    return _cut("segment", planes, shape)


def _springer(bed: WebBed, shape: RibVaultShape) -> Solid:
    """Cut the springer: below the first joint of its rib and the first beds of two webs, up to the walls."""
    soffit = _on_soffit(bed, shape)
    # its sides go down from the corners of the rib's soffit, along the webs
    corner = bed.on_soffit()
    corner += float(bed.rise @ (soffit - corner)) / float(bed.rise @ bed.up) * bed.up
    lowest = min(float(bed.up @ corner), float(bed.up @ corner[[1, 0, 2]]))
    planes = [
        (-bed.joint, float(-bed.joint @ bed.on_soffit())),
        *_both(-bed.along, float(-bed.along @ bed.on_soffit())),
        *_both(np.array([0.0, 1.0, 0.0]), shape.half),
        *_both(-bed.up, -lowest),
        (-bed.rise, float(-bed.rise @ soffit)),
        (np.array([0.0, 0.0, -1.0]), shape.springer - bed.z),
    ]
    return _cut("springer", planes, shape)


def _boss(bed: WebBed, shape: RibVaultShape) -> Solid:
    """Cut the boss between the last joints of four ribs and the ends of four courses at the crowns of the webs."""
    joint, offset = bed.joint, float(bed.joint @ bed.on_soffit())
    bottom = (_on_soffit(bed, shape) - _PENDANT * np.array([0.0, 0.0, 1.0]))[2]
    top = (_on_soffit(bed, shape) + shape.height * bed.rise)[2]
    planes = [
        *((_turn(k) @ joint, offset) for k in range(4)),
        *((_turn(k) @ [0.0, 1.0, 0.0], bed.end) for k in range(4)),
        (np.array([0.0, 0.0, -1.0]), float(-bottom)),
        (np.array([0.0, 0.0, 1.0]), float(top)),
    ]
    return _cut("boss", planes, shape)


def _on_soffit(bed: WebBed, shape: RibVaultShape) -> Array:
    """Return where a joint of the rib meets its soffit, in the plane of the rib (3,) [m]."""
    middle = 0.5 * (bed.x + bed.end)
    out: Array = np.array([middle, middle, bed.z]) - shape.drop * bed.rise
    return out


def _both(normal: Array, offset: float) -> list[tuple[Array, float]]:
    """Return a plane of the web over +y, and the same of the web over +x."""
    return [(normal, offset), (normal[[1, 0, 2]], offset)]


def _cut(code: str, planes: Sequence[tuple[Array, float]], shape: RibVaultShape) -> Solid:
    reach = np.full(3, 2.0 * shape.radius)
    rows = [(*normal.tolist(), offset) for normal, offset in planes]
    solid = intersection(code, rows, -reach, reach, _PLANE_ROUNDING)
    assert solid is not None
    return solid
