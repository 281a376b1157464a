"""A barrel vault surveyed from below, and a free-standing arch surveyed in elevation."""

import math
from collections.abc import Sequence
from itertools import pairwise
from random import Random

import numpy as np

from survey.extrusion.extrusion import prism
from synthetic.bond import PlannedStone
from synthetic.building import Draft, SyntheticBuilding, flat_stone, measured_building, observer
from synthetic.frame import TrueStone, WallFrame

_FOOT = np.array([14.2, 31.75, 5.6])  # of the axis in the site [m]
_AZIMUTH = math.radians(23.0)  # of a vault's span, of an arch's face against the x axis
_JITTER = 0.06  # largest deviation of head joints from a regular bond [m]


def barrel_vault(
    voussoirs: int = 15,
    rings: int = 5,
    seed: int = 1,
    *,
    bonded: bool = True,
    radius: float = 2.0,
    thickness: float = 0.35,
    length: float = 0.55,
) -> SyntheticBuilding:
    """Build a semicircular barrel vault and measure its intrados from below.

    The stones are wedges between planes through the axis; their faces are chords of the intrados, plane and of four
    sides. The face and the thickness are measured: sides of neighbours open like wedges.

    Parameters
    ----------
    voussoirs : courses from springing to springing
    rings : stones along the axis, in each course
    seed : of Python's own generator, whose stream is the same everywhere
    bonded : whether head joints of neighbouring courses are staggered by half a stone; else rings stand side by side
    radius, thickness : of the intrados and of the vault [m]
    length : of a stone along the axis [m]

    Returns
    -------
    SyntheticBuilding, whose codes are C<course>-<number>
    """
    rng = Random(seed)
    along = np.array([math.cos(_AZIMUTH), math.sin(_AZIMUTH), 0.0])
    axis = np.array([-along[1], along[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    half = 0.5 * math.pi / voussoirs
    drafts = []
    for course in range(voussoirs):
        angle = (2 * course + 1) * half
        outward = math.cos(angle) * along + math.sin(angle) * up
        turning = -math.sin(angle) * along + math.cos(angle) * up
        frame = WallFrame(_FOOT + radius * math.cos(half) * outward, np.array([turning, axis, -outward]))
        for number, ends in enumerate(pairwise(_heads(course, rings, length, bonded, rng)), start=1):
            code, kind = f"C{course + 1:02d}-{number:02d}", _kind(course, voussoirs)
            level = min(course, voussoirs - 1 - course) + 1
            plan = _rectangle(code, kind, level, radius * math.sin(half), ends)
            drafts.append(Draft(_wedge(plan, frame, radius * math.cos(half), thickness), frame, plan.corners))
    base = [d.stone.plan.code for d in drafts if d.stone.plan.course == 1]
    station = observer(_FOOT + 0.5 * rings * length * axis)
    kinds = dict.fromkeys(("keystone", "springer", "voussoir"), thickness)
    name = f"barrel vault, {'bonded' if bonded else 'rings'}"
    return measured_building(name, drafts, kinds, [station], base, rng)


def semicircular_arch(
    voussoirs: int = 17, seed: int = 1, *, radius: float = 2.0, thickness: float = 0.5, depth: float = 0.6
) -> SyntheticBuilding:
    """Build a free-standing semicircular arch and measure one face of it.

    Parameters
    ----------
    voussoirs : stones from springing to springing
    seed : of Python's own generator, whose stream is the same everywhere
    radius, thickness : of the intrados, a chord polygon, and of the ring [m]
    depth : of the stones behind the face [m]

    Returns
    -------
    SyntheticBuilding, whose codes are A<number> from the left springing
    """
    rng = Random(seed)
    along = np.array([math.cos(_AZIMUTH), math.sin(_AZIMUTH), 0.0])
    frame = WallFrame(_FOOT, np.array([along, [0.0, 0.0, 1.0], [along[1], -along[0], 0.0]]))
    angles = [math.pi * (1.0 - k / voussoirs) for k in range(voussoirs + 1)]
    drafts = []
    for number, (left, right) in enumerate(pairwise(angles)):
        places = [(left, radius), (right, radius), (right, radius + thickness), (left, radius + thickness)]
        corners = np.array([(r * math.cos(angle), r * math.sin(angle)) for angle, r in places])
        kind = _kind(number, voussoirs)
        plan = PlannedStone(f"A{number + 1:02d}", kind, None, corners, (True,) * 4)
        drafts.append(Draft(flat_stone(plan, depth, frame), frame, plan.corners))
    base = [drafts[0].stone.plan.code, drafts[-1].stone.plan.code]
    station = observer(frame.place(np.array([[0.3, 1.5]]), 8.0)[0])
    kinds = dict.fromkeys(("keystone", "springer", "voussoir"), depth)
    return measured_building("semicircular arch", drafts, kinds, [station], base, rng)


def _kind(number: int, count: int) -> str:
    if number in (0, count - 1):
        return "springer"
    return "keystone" if 2 * number + 1 == count else "voussoir"


def _heads(course: int, rings: int, length: float, bonded: bool, rng: Random) -> list[float]:
    """Return the head joints of a course along the axis, ends included [m]."""
    if not bonded:
        return [k * length for k in range(rings + 1)]
    first = 0.5 if course % 2 else 1.0
    inner: Sequence[float] = [(first + k) * length for k in range(rings - (course % 2 == 0))]
    return [0.0, *(y + rng.uniform(-_JITTER, _JITTER) for y in inner), rings * length]


def _rectangle(code: str, kind: str, course: int, half: float, ends: tuple[float, float]) -> PlannedStone:
    low, high = ends
    corners = np.array([(-half, low), (half, low), (half, high), (-half, high)])
    return PlannedStone(code, kind, course, corners, (True,) * 4)


def _wedge(plan: PlannedStone, frame: WallFrame, apothem: float, thickness: float) -> TrueStone:
    """Make a stone whose sides lie on planes through the axis, `apothem` in front of its face."""
    front = frame.place(plan.corners)
    wider = plan.corners * [(apothem + thickness) / apothem, 1.0]
    solid = prism(plan.code, front, frame.place(wider, -thickness))
    return TrueStone(plan, frame.axes[2], float(frame.axes[2] @ frame.origin), thickness, solid)
