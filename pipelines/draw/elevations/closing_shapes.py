"""Shapes for the pictures of closed joints: stones before and after, joints, gaps and overlaps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mechanics.arrays import Array
from survey.conventions import THINNEST, TOUCHING
from survey.geometry.solids import Solid, area_vector
from survey.joints.grown_leaf import Opening
from survey.joints.report import ClosingReport, StoneJoint

_FACING = np.cos(np.radians(45.0))  # faces turned farther from the joint are not sides of it


@dataclass(frozen=True)
class DrawnStone:
    """One stone, as surveyed and as simulated.

    Attributes
    ----------
    surveyed, simple, closed : its solid as surveyed, as simplified, and as it is simulated
    simplified : (n,) how far simplifying moved each corner of `surveyed`; NaN where it is not known [m]
    moved : (m,) how far closing the joints moved each corner of `simple`; NaN where it is not known [m]
    normal : (3,) of its visible face, outwards [-]
    centroid : (3,) of its visible face [m]
    area : of its visible face [m²]
    hypothesis : whether it is hypothetical
    core : whether it lies behind the stones of a facing
    grown : whether it grew from its outline to the middle of its mortar
    """

    surveyed: Solid
    simple: Solid
    closed: Solid
    simplified: Array
    moved: Array
    normal: Array
    centroid: Array
    area: float
    hypothesis: bool
    core: bool = False
    grown: bool = False

    @property
    def code(self) -> str:
        """Code of the stone."""
        return self.closed.code


@dataclass(frozen=True)
class DrawnJoint:
    """A joint with the area over which its stones face each other.

    Attributes
    ----------
    joint : as it is reported
    polygon : (k, 3) [m]; None where it is not known
    """

    joint: StoneJoint
    polygon: Array | None


@dataclass(frozen=True)
class Place:
    """Defect of a joint, with its position on the wall.

    Attributes
    ----------
    kind : "gap" or "overlap"
    stones : codes of the two
    centroid : (3,) [m]
    text : description with its measure
    """

    kind: str
    stones: tuple[str, str]
    centroid: Array
    text: str


@dataclass(frozen=True)
class ClosingShapes:
    """Everything that the pictures show.

    Attributes
    ----------
    scene : its name
    stones, joints : of the scene
    places : gaps and overlaps, the largest first
    openings : of leaves, that mortar does not fill
    """

    scene: str
    stones: tuple[DrawnStone, ...]
    joints: tuple[DrawnJoint, ...]
    places: tuple[Place, ...]
    openings: tuple[Opening, ...] = ()


class Stages(NamedTuple):
    """Solids of all stones, in one order, at three stages: as surveyed, as simplified, as simulated."""

    surveyed: Sequence[Solid]
    simple: Sequence[Solid]
    closed: Sequence[Solid]


def closing_shapes(
    scene: str,
    solids: Stages,
    simplified: Mapping[str, Array],
    closing: ClosingReport,
    faces: Sequence[Array],
    hypotheses: frozenset[str],
    core: frozenset[str] = frozenset(),
) -> ClosingShapes:
    """Gather the shapes of stones and of the report on their joints.

    Parameters
    ----------
    scene : its name
    solids : of the stones
    simplified : by code, the movement of each corner of the surveyed solid [m]
    closing : changes by closing the joints
    faces : (nv, 3) outline of each stone's visible face, counter-clockwise seen from outside [m]
    hypotheses : codes of hypothetical stones
    core : codes of those that lie behind the stones of a facing
    """
    grown = {code for leaf in closing.leaves for code in leaf.grown}
    stones = tuple(
        DrawnStone(
            surveyed=before,
            simple=between,
            closed=after,
            simplified=_of_corners(simplified.get(after.code), before),
            moved=_of_corners(closing.displacement.get(after.code), between),
            normal=area_vector(face) / np.linalg.norm(area_vector(face)),
            centroid=face.mean(axis=0),
            area=float(np.linalg.norm(area_vector(face))),
            hypothesis=after.code in hypotheses,
            core=after.code in core,
            grown=after.code in grown,
        )
        for before, between, after, face in zip(*solids, faces, strict=True)
    )
    closed = {stone.code: stone for stone in solids.closed}
    joints = tuple(
        DrawnJoint(
            joint,
            joint_polygon(closed[joint.stones[0]], closed[joint.stones[1]], joint.normal, joint.centroid),
        )
        for joint in closing.joints
    )
    openings = tuple(opening for leaf in closing.leaves for opening in leaf.openings)
    return ClosingShapes(scene, stones, joints, places(closing), openings)


def places(closing: ClosingReport) -> tuple[Place, ...]:
    """List overlaps, then gaps, the largest of each first."""
    overlaps = [
        Place(
            "overlap",
            overlap.stones,
            overlap.centroid,
            f"{_pair(overlap.stones)} lie {overlap.depth * 1e3:.1f} mm in each other",
        )
        for overlap in sorted(closing.overlaps, key=lambda overlap: -overlap.volume)
    ]
    gaps = [
        Place(
            "gap",
            gap.stones,
            gap.centroid,
            f"{_pair(gap.stones)} open by {gap.width * 1e3:.1f} mm: {gap.reason}",
        )
        for gap in sorted(closing.gaps, key=lambda gap: -gap.width * gap.area)
    ]
    return (*overlaps, *gaps)


def _pair(stones: tuple[str, str]) -> str:
    return " and ".join(stones)


def _of_corners(values: Array | None, solid: Solid) -> Array:
    """Return a value for each corner of a solid; the largest for all where `values` belong to other corners."""
    count = len(solid.vertices)
    if values is None or not len(values):
        return np.full(count, np.nan)
    return values if len(values) == count else np.full(count, float(values.max()))


def joint_polygon(first: Solid, second: Solid, normal: Array, centroid: Array) -> Array | None:
    """Intersect a face of one stone with a face of the other, projected onto their joint.

    Of several pairs of faces, the one with the largest intersection counts. Faces are taken for convex.

    Parameters
    ----------
    first, second : the two stones
    normal : (3,) unit normal of the joint, from the second to the first [-]
    centroid : (3,) a place of the joint [m]

    Returns
    -------
    (k, 3) corners on the joint's plane, counter-clockwise about its normal [m]; None where no faces face each other
    """
    along = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
    along /= np.linalg.norm(along)
    axes = np.array([along, np.cross(normal, along)])
    best: Array | None = None
    most = THINNEST**2  # a smaller area [m²] is rounding
    for above in _sides(first, -normal, axes, centroid):
        for below in _sides(second, normal, axes, centroid):
            common = _clipped(above, below)
            if (area := _area(common)) > most:
                best, most = common, area
    return None if best is None else centroid + best @ axes


def _sides(solid: Solid, towards: Array, axes: Array, centroid: Array) -> list[Array]:
    """Project the faces of a stone that look in a direction onto the joint: (k, 2) each, counter-clockwise.

    Where faces lie in the plane of the joint, others do not count.
    """
    sides, within = [], []
    for face in solid.faces:
        polygon = solid.vertices[list(face)]
        area = area_vector(polygon)
        if area @ towards > _FACING * float(np.linalg.norm(area)):
            flat = (polygon - centroid) @ axes.T
            sides.append(flat if _area(flat) > 0.0 else flat[::-1])
            within.append(bool((np.abs((polygon - centroid) @ towards) < TOUCHING).all()))
    return [side for side, own in zip(sides, within, strict=True) if own] if any(within) else sides


def _clipped(subject: Array, window: Array) -> Array:
    """Clip a polygon by a convex one, both counter-clockwise, (k, 2) (Sutherland and Hodgman 1974)."""
    corners: Sequence[Array] = list(subject)
    for start, end in zip(window, np.roll(window, -1, axis=0), strict=True):
        edge = end - start
        inside = [
            float(edge[0] * (corner[1] - start[1]) - edge[1] * (corner[0] - start[0])) for corner in corners
        ]
        polygon: list[Array] = []
        for i, corner in enumerate(corners):
            before = inside[i - 1]
            if before * inside[i] < 0.0:
                polygon.append(corners[i - 1] + before / (before - inside[i]) * (corner - corners[i - 1]))
            if inside[i] >= 0.0:
                polygon.append(corner)
        corners = polygon
        if not corners:
            break
    return np.array(corners).reshape(-1, 2)


def _area(polygon: Array) -> float:
    """Return the area of a polygon (k, 2), positive if it is counter-clockwise [m²]."""
    if len(polygon) < 3:
        return 0.0
    x, y = (polygon - polygon[0]).T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
