"""Simulated measurement of true stones: open joints, worn corners, noise and blunders; planes of solids."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from random import Random

import numpy as np

from survey.arrays import Array
from survey.geometry.half_spaces import intersection
from survey.geometry.solids import Solid, planes_of_solid
from survey.records.survey import BlockRecord
from synthetic.bond import PlanLine, crossing
from synthetic.frame import TrueStone, WallFrame

# of one coordinate [m]: 3 mm in space (√3 · 1.73 mm), the mean error of a photogrammetric point
SIGMA = 0.00173
HALF_JOINT = (0.004, 0.0075)  # distance of each stone from the true joint: joints are 8 to 15 mm open [m]
ERODED = 0.16  # share of stones with an eroded corner
BEVELLED = 0.10  # share of stones with a bevelled corner
BACK_OF_WORN_EDGE = (0.012, 0.025)  # distance of worn surface behind the face [m]
CUT_BY_EROSION = (0.02, 0.035)  # length cut off the sides at an eroded corner [m]
CUT_BY_BEVEL = (0.03, 0.06)  # length cut off the sides at a bevelled corner [m]
MARGIN = (0.008, 0.02)  # distance of points on the dressed margin from the arris [m]
BLUNDER = (0.03, 0.30)  # size of a gross error [m]
COUNTS = (17, 20)  # points on one face
_TILT = 0.003  # standard deviation of each tilt of a measured plane: SIGMA over half a stone's width [rad]
_BEYOND = 0.1  # room around a stone for its measured planes [m]
_PLANE_ROUNDING = 1e-9  # distance of corners that lie on one plane [m]


@dataclass(frozen=True)
class MeasuredStone:
    """A stone's record and its truth.

    Attributes
    ----------
    record : as it goes into the survey file
    half_joints : (4,) distance of each measured side from the true joint; 0 on free sides [m]
    worn : "eroded", "bevelled" or None
    worn_corner : index of the worn corner of the true quadrilateral; None if there is none
    worn_points : indices of points that lie on worn surface behind the face
    worn_vertices : indices of vertices that lie behind the face
    blunders : indices of points with a gross error
    """

    record: BlockRecord
    half_joints: tuple[float, ...]
    worn: str | None
    worn_corner: int | None
    worn_points: tuple[int, ...]
    worn_vertices: tuple[int, ...]
    blunders: tuple[int, ...] = ()


def measure_stone(stone: TrueStone, frame: WallFrame, rng: Random) -> MeasuredStone:
    """Measure one face: its corners and 17 to 20 points along its margin."""
    halves = tuple(rng.uniform(*HALF_JOINT) if joint else 0.0 for joint in stone.plan.joint)
    visible = inset(stone.plan.corners, halves)
    chance = rng.random()
    worn = "eroded" if chance < ERODED else "bevelled" if chance < ERODED + BEVELLED else None
    corner = rng.randrange(4) if worn else None
    flat, behind = _corners(visible, worn, corner, rng)
    points = margin_points(visible, rng.randint(*COUNTS), rng)
    points_behind = np.zeros(len(points))
    if worn == "eroded" and corner is not None:
        nearest = np.argsort(np.linalg.norm(points - visible[corner], axis=1), kind="stable")[
            : rng.randint(1, 2)
        ]
        points_behind[nearest] = [rng.uniform(*BACK_OF_WORN_EDGE) for _ in nearest]
    if rng.random() < 0.1:  # some surveyors go around the stone the other way
        flat, behind = flat[::-1], behind[::-1]
    record = BlockRecord(
        code=stone.plan.code,
        kind=stone.plan.kind,
        course=stone.plan.course,
        vertices=_noisy(stone.on_face(frame, flat) - np.outer(behind, stone.normal), rng),
        points=_noisy(stone.on_face(frame, points) - np.outer(points_behind, stone.normal), rng),
        sigma=SIGMA,
        notes={"edge": worn} if worn else {},
    )
    return MeasuredStone(
        record=record,
        half_joints=halves,
        worn=worn,
        worn_corner=corner,
        worn_points=tuple(int(i) for i in np.flatnonzero(points_behind)),
        worn_vertices=tuple(int(i) for i in np.flatnonzero(behind)),
    )


def add_blunders(
    measured: list[MeasuredStone], normals: list[Array], count: int, rng: Random
) -> list[MeasuredStone]:
    """Spoil `count` sound points of the whole survey by 3 to 30 cm along the line of sight."""
    out = list(measured)
    for _ in range(count):
        which = rng.randrange(len(out))
        old = out[which]
        taken = set(old.worn_points) | set(old.blunders)
        index = rng.choice([i for i in range(len(old.record.points)) if i not in taken])
        size = math.exp(rng.uniform(*(math.log(limit) for limit in BLUNDER))) * rng.choice((-1.0, 1.0))
        points = old.record.points.copy()
        points[index] = np.round(points[index] + size * normals[which], 4)
        out[which] = replace(
            old,
            record=replace(old.record, points=points),
            blunders=tuple(sorted((*old.blunders, index))),
        )
    return out


def modelled_solid(solid: Solid, joints: Iterable[int], rng: Random) -> Solid:
    """Measure the planes of a convex stone and cut its solid out of them.

    Parameters
    ----------
    solid : the true stone
    joints : faces in contact with other stones, measured half a joint inside
    rng : random numbers

    Returns
    -------
    the measured solid, with plane faces
    """
    touched, middle = set(joints), solid.vertices.mean(axis=0)
    planes = []
    for k, normal in enumerate(planes_of_solid(solid)[:, :3]):
        centre = solid.vertices[list(solid.faces[k])].mean(axis=0)
        tilted = normal + np.cross(normal, [rng.gauss(0.0, _TILT) for _ in range(3)])
        tilted /= np.linalg.norm(tilted)
        half = rng.uniform(*HALF_JOINT) if k in touched else 0.0
        at = float(tilted @ (centre - middle)) - half + rng.gauss(0.0, SIGMA)
        planes.append((*tilted.tolist(), at))
    low, high = solid.vertices.min(axis=0) - middle - _BEYOND, solid.vertices.max(axis=0) - middle + _BEYOND
    cut = intersection(solid.code, planes, low, high, _PLANE_ROUNDING)
    assert cut is not None
    return Solid(solid.code, cut.vertices + middle, cut.faces)


def inset(corners: Array, distances: tuple[float, ...]) -> Array:
    """Move each side of a counter-clockwise polygon inwards and intersect neighbouring sides again."""
    lines = []
    for k, distance in enumerate(distances):
        (x, y), (to_x, to_y) = corners[k], corners[(k + 1) % len(corners)]
        length = math.hypot(to_x - x, to_y - y)
        u, v = (to_x - x) / length, (to_y - y) / length
        lines.append(PlanLine((x - distance * v, y + distance * u), (u, v)))
    return np.array([crossing(lines[k - 1], lines[k]) for k in range(len(lines))])


def _corners(visible: Array, worn: str | None, corner: int | None, rng: Random) -> tuple[Array, Array]:
    """Return the corners that the surveyor finds, and the distance of each behind the face."""
    if worn is None or corner is None:
        return visible, np.zeros(4)
    here, before, after = visible[corner], visible[corner - 1], visible[(corner + 1) % 4]
    back, on = _towards(here, before), _towards(here, after)
    if worn == "eroded":
        cut = rng.uniform(*CUT_BY_EROSION) * back + rng.uniform(*CUT_BY_EROSION) * on
        flat, behind = visible.copy(), np.zeros(4)
        flat[corner] = here + cut
        behind[corner] = rng.uniform(*BACK_OF_WORN_EDGE)
        return flat, behind
    two = np.array([here + rng.uniform(*CUT_BY_BEVEL) * back, here + rng.uniform(*CUT_BY_BEVEL) * on])
    return np.vstack([visible[:corner], two, visible[corner + 1 :]]), np.zeros(5)


def _towards(start: Array, stop: Array) -> Array:
    step = stop - start
    unit: Array = step / math.hypot(step[0], step[1])
    return unit


def margin_points(visible: Array, count: int, rng: Random) -> Array:
    """Choose points along the dressed margin, densest near its corners, and two further in."""
    ring = inset(visible, (rng.uniform(*MARGIN),) * 4)
    edges = np.roll(ring, -1, axis=0) - ring
    reach = np.cumsum(np.hypot(edges[:, 0], edges[:, 1]))
    points = []
    for k in range(count - 2):
        along = (k + rng.uniform(0.1, 0.9)) / (count - 2) * reach[-1]
        side = int(np.searchsorted(reach, along))
        start = reach[side - 1] if side else 0.0
        points.append(ring[side] + _spread((along - start) / (reach[side] - start)) * edges[side])
    centre = visible.mean(axis=0)
    points += [centre + rng.uniform(0.1, 0.6) * (visible[k] - centre) for k in rng.sample(range(4), 2)]
    return np.array(points)


def _spread(share: float) -> float:
    """Push a place along a side (0 to 1) towards its ends: points far apart determine the tilt best."""
    u = 2.0 * share - 1.0
    return 0.5 + 0.5 * math.copysign(math.sqrt(abs(u)), u)


def _noisy(points: Array, rng: Random) -> Array:
    """Add the noise of measurement and round to a tenth of a millimetre, as in the file."""
    noise = np.array([[rng.gauss(0.0, SIGMA) for _ in range(3)] for _ in points])
    out: Array = np.round(points + noise, 4) + 0.0  # + 0.0: no negative zeros
    return out
