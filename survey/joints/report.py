"""Report of joint closing: joints found, changes, and joints left open."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from survey.arrays import Array
from survey.conventions import MOST, TOUCHING
from survey.geometry.adjacency import SolidArrays
from survey.geometry.cutting import moves
from survey.joints.bounded_closing import Cut, LocalStones
from survey.joints.facing import FacePlanes, FacingFaces, find_facing, planes_of
from survey.joints.grown_leaf import GrownLeaf
from survey.joints.overlaps import Overlapping
from survey.joints.settings import JointMode, JointSettings


@dataclass(frozen=True)
class StoneJoint:
    """A joint between two stones.

    Attributes
    ----------
    stones : codes of the two
    plane : number of the contact plane, common to all joints of a straight bed; -1 if the joint stays open
    width : mean distance of the two faces as surveyed; negative where they overlap [m]
    opening : angle between the two faces as surveyed [degrees]
    area : shared after closing; as surveyed, seen square to the joint, if it stays open [m²]
    centroid : (3,) of that area [m]
    normal : (3,) unit normal, from the second stone to the first [-]
    left_open : reason why it stays open; empty if it is closed
    """

    stones: tuple[str, str]
    plane: int
    width: float
    opening: float
    area: float
    centroid: Array
    normal: Array
    left_open: str


@dataclass(frozen=True)
class Gap:
    """A gap between two stones that face each other.

    Attributes
    ----------
    stones : codes of the two
    width : mean [m]
    area : over which they face each other [m²]
    centroid : (3,) [m]
    reason : reason why it was not closed
    """

    stones: tuple[str, str]
    width: float
    area: float
    centroid: Array
    reason: str


@dataclass(frozen=True)
class Overlap:
    """An overlap of two stones.

    Attributes
    ----------
    stones : codes of the two
    volume : of the overlap [m³]
    depth : distance that one would have to move to be clear [m]
    centroid : (3,) [m]
    """

    stones: tuple[str, str]
    volume: float
    depth: float
    centroid: Array


@dataclass(frozen=True)
class ClosingReport:
    """Changes made by joint closing, stone by stone and joint by joint.

    Attributes
    ----------
    mode : treatment of the joints
    joints : all joints found, including open ones
    displacement : by code, displacement of each corner of the stone's solid [m]
    volume_change : by code, new volume over old, minus 1 [-]
    alone : codes of stones without any joint
    gaps, overlaps : remaining ones
    leaves : stones that grew to the medial lines between their outlines
    """

    mode: JointMode
    joints: tuple[StoneJoint, ...]
    displacement: Mapping[str, Array]
    volume_change: Mapping[str, float]
    alone: tuple[str, ...]
    gaps: tuple[Gap, ...]
    overlaps: tuple[Overlap, ...]
    leaves: tuple[GrownLeaf, ...] = ()

    @property
    def largest_displacement(self) -> float:
        """Largest displacement of any corner [m]."""
        return max((float(moved.max()) for moved in self.displacement.values()), default=0.0)


# area, centroid and normal of faces in contact, by the pair of stones
_Contacts = dict[tuple[int, int], list[tuple[float, Array, Array]]]

_SAME_WAY = 0.999  # cosine of the largest angle between contacts of one joint
_MOST_LOST = MOST  # of the area of facing faces: a larger part without contact is reported as a gap
_BENT = "the bed is bent or stepped here, and stones stay convex"


def closing_report(
    building: LocalStones,
    facing: FacingFaces,
    cut: Cut,
    overlaps: list[Overlapping],
    settings: JointSettings,
) -> ClosingReport:
    """Summarise joints, movements, gaps and overlaps.

    Parameters
    ----------
    building : stones before closing
    facing : pairs of faces to be closed
    cut : closed stones, the solids in their final state
    overlaps : stones that still overlap
    settings : settings of the closing
    """
    now = SolidArrays.gather((solid.vertices, solid.faces) for solid in cut.solids)
    planes = planes_of(now)
    joints = _joints(building, facing, cut, _contacts(now, planes, settings))
    codes = [stone.code for stone in building.stones]
    joined = {code for joint in joints for code in joint.stones}
    facing_area = facing.area.tolist()
    within = {frozenset(overlap.codes) for overlap in overlaps}
    gaps = [
        Gap(joint.stones, max(joint.width, 0.0), facing_area[k], joint.centroid, joint.left_open or _BENT)
        for k, joint in enumerate(joints)
        if (joint.left_open and frozenset(joint.stones) not in within)
        or (not joint.left_open and joint.area < _MOST_LOST * facing_area[k])
    ]
    return ClosingReport(
        mode=settings.mode,
        joints=tuple(joints),
        displacement={
            code: moves(old, new) for code, old, new in zip(codes, building.solids, cut.solids, strict=True)
        },
        volume_change=dict(zip(codes, _volume_changes(building, cut, _volumes(now, planes)), strict=True)),
        alone=tuple(code for code in codes if code not in joined),
        gaps=tuple(gaps),
        overlaps=_overlaps(building, overlaps),
    )


def _overlaps(building: LocalStones, overlapping: list[Overlapping]) -> tuple[Overlap, ...]:
    """Return one entry for each pair of stones, summed over their parts."""
    together: dict[tuple[str, str], list[Overlapping]] = defaultdict(list)
    for overlap in overlapping:
        together[overlap.codes].append(overlap)
    out = []
    for codes, parts in together.items():
        volume = sum(one.volume for one in parts)
        place = sum((one.volume * one.part.vertices.mean(axis=0) for one in parts), np.zeros(3)) / volume
        out.append(Overlap(codes, volume, max(one.depth for one in parts), place + building.origin))
    return tuple(out)


def _volume_changes(building: LocalStones, cut: Cut, after: Array) -> list[float]:
    """Return the new volume (n,) over the old, minus 1, of each stone; zero for an unchanged one."""
    before = _volumes(building.faces.solids, building.faces.planes)
    out: list[float] = (after / before - 1.0).tolist()
    pairs = zip(building.solids, cut.solids, out, strict=True)
    return [0.0 if old is new else change for old, new, change in pairs]


def _volumes(solids: SolidArrays, planes: FacePlanes) -> Array:
    """Return volumes (n,), by the divergence theorem [m³]."""
    cones = planes.areas * planes.offsets / 3.0
    out: Array = np.add.reduceat(cones, solids.solid_starts[:-1])
    return out


def _joints(building: LocalStones, facing: FacingFaces, cut: Cut, touching: _Contacts) -> list[StoneJoint]:
    """Return all joints in the order of `facing`."""
    planes, codes = building.faces.planes, [stone.code for stone in building.stones]
    pairs = planes.owner[facing.faces]
    cosines = -(planes.normals[facing.faces[:, 0]] * planes.normals[facing.faces[:, 1]]).sum(axis=1)
    opening = np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))
    joints = []
    for k in range(len(facing)):
        plane, reason = int(cut.contact.of_link[k]), cut.reasons[k]
        area, centroid, normal = float(facing.area[k]), facing.centroid[k], facing.normal[k]
        if not reason:
            # the plane's normal points out of the first stone, the joint's into it
            normal = -cut.contact.side[k] * cut.contact.normals[plane]
            area, middle = _shared(touching.get((int(pairs[k, 0]), int(pairs[k, 1])), []), normal)
            centroid = centroid if middle is None else middle
        joints.append(
            StoneJoint(
                stones=(codes[pairs[k, 0]], codes[pairs[k, 1]]),
                plane=plane if not reason else -1,
                width=float(facing.gap[k]) if reason else _width(building, facing, cut, k),
                opening=float(opening[k]),
                area=area,
                centroid=centroid + building.origin,
                normal=normal,
                left_open=reason,
            )
        )
    return joints


def _width(building: LocalStones, facing: FacingFaces, cut: Cut, link: int) -> float:
    """Return the distance of the sound corners of the two faces along the normal of their plane [m].

    Measured corners count; hidden ones follow from them, and would open a joint like a wedge where faces are turned.
    """
    faces, plane = building.faces, int(cut.contact.of_link[link])
    side, total = float(cut.contact.side[link]), 0.0
    for face, out in zip(facing.faces[link].tolist(), (side, -side), strict=True):
        stone = int(faces.planes.owner[face])
        rows = building.rows(stone)
        begin, end = faces.solids.face_starts[[rows.start, rows.stop]]
        first = int(faces.solids.corners[begin:end].min())
        corners = faces.corners(face)
        sound = corners[faces.sound[corners]]
        seen = sound[sound < first + len(building.stones[stone].sound)]
        measured = seen if len(seen) else sound
        if not len(measured):
            return float(facing.gap[link])
        heights = faces.solids.vertices[measured] @ cut.contact.normals[plane] - cut.contact.offsets[plane]
        total -= out * float(heights.mean())
    return total


def _contacts(solids: SolidArrays, planes: FacePlanes, settings: JointSettings) -> _Contacts:
    """Return all current contacts of faces."""
    close = replace(settings, max_width=TOUCHING, max_angle=0.01, min_overlap=0.0)
    facing = find_facing(solids, planes, close)
    out = defaultdict(list)
    for k, (i, j) in enumerate(planes.owner[facing.faces].tolist()):
        out[i, j].append((float(facing.area[k]), facing.centroid[k], facing.normal[k]))
    return out


def _shared(contacts: list[tuple[float, Array, Array]], normal: Array) -> tuple[float, Array | None]:
    """Return the area and centroid of the contacts with a given normal."""
    alike = [(area, centroid) for area, centroid, own in contacts if own @ normal > _SAME_WAY]
    total = sum(area for area, _ in alike)
    if not total > 0.0:
        return 0.0, None
    middle: Array = np.sum([area * centroid for area, centroid in alike], axis=0) / total
    return total, middle
