"""Closing the joints: surveyed stones, a centimetre apart, become solids that share contact planes.

Work is done in the mean plane of the wall. Each joint is one straight line (`survey.joint_lines`), shared by
all
stones on either hand; a side that faces nothing keeps its own line. Every stone is then cut out by six
planes:
four square to the wall through its lines, its own fitted face, and that face moved back by its depth.
Neighbours
hold the very same line, so their contact planes agree to the last bits, and no two stones overlap.

"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from moma.errors import GeometryError
from survey.blocky import BlockyStone, simplify
from survey.extrusion import SurveyedBlock, hidden_side, prism
from survey.free_sides import free_lines
from survey.joint_lines import JointLine, JointSettings, joint_lines
from survey.solids import Solid
from survey.walls import Sides, WallPlane, sides_of, wall_plane
from survey.watertight import check_watertight

__all__ = ["ClosedStones", "ClosingReport", "Joint", "JointSettings", "close_joints"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Joint:
    """A closed joint.

    Attributes
    ----------
    stones : codes of the stones that share it
    start, stop : (3,) its ends in the mean plane of the wall [m]
    width : mean width that was open [m]
    rms : of the stones' corners from the straight joint [m]
    """

    stones: tuple[str, ...]
    start: Array
    stop: Array
    width: float
    rms: float


@dataclass(frozen=True)
class ClosingReport:
    """What closing the joints has changed.

    Attributes
    ----------
    joints : every joint that was found
    displacement : by code, (8,) distance that each corner of the six-faced stone moved [m]
    volume_change : by code, new volume over old, minus 1 [-]
    alone : codes of stones without any joint
    """

    joints: tuple[Joint, ...]
    displacement: Mapping[str, Array]
    volume_change: Mapping[str, float]
    alone: tuple[str, ...]

    @property
    def largest_displacement(self) -> float:
        """Largest distance that any corner moved [m]."""
        return max(float(moved.max()) for moved in self.displacement.values())


@dataclass(frozen=True)
class ClosedStones:
    """Stones whose joints are closed.

    Attributes
    ----------
    solids : hexahedra in the order given; visible corners first, then the hidden ones
    report : what was changed
    """

    solids: tuple[Solid, ...]
    report: ClosingReport


def close_joints(
    stones: Sequence[SurveyedBlock | BlockyStone], settings: JointSettings | None = None
) -> ClosedStones:
    """Close the joints of one wall, so that neighbours share contact planes.

    Parameters
    ----------
    stones : surveyed or six-faced stones of one wall
    settings : what counts as a joint, and bounds; None: JointSettings()

    Returns
    -------
    ClosedStones

    Raises
    ------
    GeometryError
        naming the stones, if a joint is not straight, a stone would turn inside out, or a corner would move
        farther than the bound
    """
    settings = settings or JointSettings()
    blocky = [stone if isinstance(stone, BlockyStone) else simplify(stone) for stone in stones]
    if not blocky:
        return ClosedStones((), ClosingReport((), {}, {}, ()))
    wall = wall_plane(blocky)
    sides = sides_of(blocky, wall)
    joints = joint_lines(sides, settings)
    codes = [stone.code for stone in blocky]
    for joint in joints:
        _check_straight(joint, codes, settings)
    corners = _closed_corners(sides, joints, codes, settings)
    solids = tuple(_cut(stone, flat, wall) for stone, flat in zip(blocky, corners, strict=True))
    displacement = {
        stone.code: np.linalg.norm(solid.vertices - stone.solid.vertices, axis=1)
        for stone, solid in zip(blocky, solids, strict=True)
    }
    touching = {i for joint in joints for i, _ in joint.members}
    for i, (stone, solid) in enumerate(zip(blocky, solids, strict=True)):
        check_watertight(solid, convex=True)
        _check_bound(stone.code, displacement[stone.code], _neighbours(i, joints, codes), settings)
    report = ClosingReport(
        joints=tuple(_reported(joint, sides, codes, wall) for joint in joints),
        displacement=displacement,
        volume_change={
            stone.code: _volume(solid) / _volume(stone.solid) - 1.0
            for stone, solid in zip(blocky, solids, strict=True)
        },
        alone=tuple(code for i, code in enumerate(codes) if i not in touching),
    )
    return ClosedStones(solids, report)


def _closed_corners(
    sides: Sides, joints: tuple[JointLine, ...], codes: Sequence[str], settings: JointSettings
) -> Array:
    """Corners (n, 4, 2) of the closed quadrilaterals in the wall plane."""
    point, direction = sides.start.copy(), sides.stop - sides.start
    owner = np.full(sides.start.shape[:2], -1)
    for number, joint in enumerate(joints):
        for i, k in joint.members:
            point[i, k], direction[i, k], owner[i, k] = joint.point, joint.direction, number
    corners = _crossings(point, direction, codes)
    for (i, k), line in free_lines(sides, corners, owner, settings.max_width).items():
        point[i, k], direction[i, k] = line
    return _crossings(point, direction, codes)


def _crossings(point: Array, direction: Array, codes: Sequence[str]) -> Array:
    """Corner k of each stone: where the lines of side k - 1 and side k cross."""
    before, u = np.roll(point, 1, axis=1), np.roll(direction, 1, axis=1)
    u = u / np.linalg.norm(u, axis=2)[..., None]
    v = direction / np.linalg.norm(direction, axis=2)[..., None]
    sine = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    if (np.abs(sine) < 0.05).any():
        i = int(np.argwhere(np.abs(sine) < 0.05)[0][0])
        raise GeometryError(
            "two neighbouring sides are almost one line",
            where=f"stone {codes[i]}",
            remedy="look at the corners of its face",
        )
    gap = point - before
    out: Array = before + ((gap[..., 0] * v[..., 1] - gap[..., 1] * v[..., 0]) / sine)[..., None] * u
    return out


def _cut(stone: BlockyStone, flat: Array, wall: WallPlane) -> Solid:
    """Cut the stone out along lines square to the wall, between its face and the face moved back.

    A stone with a direction or a tail of its own keeps it, behind the closed edges of its face.
    """
    normal, offset = stone.face.fit.normal, stone.face.fit.offset
    placed = wall.origin + flat @ wall.axes[:2]
    square = float(wall.axes[2] @ normal)
    lift = (offset - placed @ normal) / square
    front = placed + np.outer(lift, wall.axes[2])
    back = front - stone.depth.value / square * wall.axes[2]
    if stone.extrusion.direction is not None or stone.extrusion.tail != 1.0:
        back = hidden_side(front, normal, stone.depth.value, stone.extrusion)
    return prism(stone.code, front, back)


def _check_straight(joint: JointLine, codes: Sequence[str], settings: JointSettings) -> None:
    if joint.largest > settings.straightness:
        raise GeometryError(
            f"the joint of {_named([i for i, _ in joint.members], codes)} is not straight: stone "
            f"{codes[joint.worst]} is {joint.largest * 1e3:.0f} mm off, more than "
            f"{settings.straightness * 1e3:.0f} mm",
            where=f"stone {codes[joint.worst]}",
            remedy="look at its corners, or allow a larger straightness",
        )


def _check_bound(code: str, moved: Array, neighbours: str, settings: JointSettings) -> None:
    if moved.max() > settings.max_displacement:
        raise GeometryError(
            f"closing its joints with {neighbours} would move a corner by {moved.max() * 1e3:.0f} mm, "
            f"more than {settings.max_displacement * 1e3:.0f} mm",
            where=f"stone {code}",
            remedy="look at its corners, or allow a larger max_displacement",
        )


def _neighbours(i: int, joints: tuple[JointLine, ...], codes: Sequence[str]) -> str:
    """Stones that share a joint with stone i, named."""
    own = [joint for joint in joints if any(member == i for member, _ in joint.members)]
    others = [member for joint in own for member, _ in joint.members if member != i]
    return _named(others, codes) if others else "no stone"


def _named(members: Sequence[int], codes: Sequence[str]) -> str:
    names = list(dict.fromkeys(codes[i] for i in members))
    return ", ".join(names[:6]) + (f" and {len(names) - 6} more" if len(names) > 6 else "")


def _reported(joint: JointLine, sides: Sides, codes: Sequence[str], wall: WallPlane) -> Joint:
    ends = np.concatenate([[sides.start[m], sides.stop[m]] for m in joint.members])
    along = (ends - joint.point) @ joint.direction
    start, stop = (
        wall.origin + (joint.point + reach * joint.direction) @ wall.axes[:2]
        for reach in (along.min(), along.max())
    )
    stones = tuple(dict.fromkeys(codes[i] for i, _ in joint.members))
    return Joint(stones, start, stop, joint.width, joint.rms)


def _volume(solid: Solid) -> float:
    """Volume of a hexahedron [m³], by the divergence theorem over its faces."""
    centre = solid.vertices.mean(axis=0)
    total = 0.0
    for face in solid.faces:
        p = solid.vertices[list(face)] - centre
        total += sum(float(p[0] @ np.cross(p[k], p[k + 1])) for k in range(1, len(p) - 1)) / 6.0
    return total
