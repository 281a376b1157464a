"""Joint closing: surveyed stones, a centimetre apart, become solids that share contact planes.

Every two faces that face each other get one plane (`survey.joints.contact_planes`), identical to the last bit in both
stones, which lie on opposite sides of it. Each stone is then cut by the planes of its joints and of its own faces
that touch nothing (`survey.geometry.cutting`). So no two stones that share a joint overlap, wherever the joint runs:
beds of a course, head joints, skewbacks, the radial joints of a vault seen from below. Stones that still overlap
without sharing a joint, for instance at the foot of an arch, are separated (`survey.joints.overlaps`). Joints that
would move a corner farther than the bound stay open and are listed.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array, Ints
from survey.conventions import ROUNDS, TOUCHING
from survey.extrusion.extrusion import SurveyedBlock
from survey.geometry.adjacency import SolidArrays
from survey.geometry.solids import Solid, planes_of_solid
from survey.geometry.stone_parts import stone_parts
from survey.joints.bounded_closing import Cut, LocalStones, as_building, close_within_bounds
from survey.joints.contact_planes import ContactPlanes
from survey.joints.facing import FacingFaces, find_facing, planes_of
from survey.joints.grown.grow import GrownStones, grow
from survey.joints.grown.leaf import Leaf, find_leaves
from survey.joints.overlaps import Overlapping, find_overlaps, part_stones
from survey.joints.report import ClosingReport, StoneJoint, closing_report
from survey.joints.settings import JointMode, JointSettings
from survey.simplify.result import BlockShape
from survey.simplify.simplify import BlockyStone, simplify

_AS_SURVEYED = "joints are left as surveyed"
_GROWN = "grows from its outline as surveyed"


@dataclass(frozen=True)
class ClosedStones:
    """Stones whose joints are closed or left as they are.

    Attributes
    ----------
    solids : in the order given
    simplified : the stones before their joints were closed
    report : changes, and remaining gaps and overlaps
    """

    solids: tuple[Solid, ...]
    simplified: tuple[BlockyStone, ...]
    report: ClosingReport


def close_joints(
    stones: Sequence[SurveyedBlock | BlockyStone], settings: JointSettings | None = None
) -> ClosedStones:
    """Close the joints of a building, so that neighbours share contact planes.

    Parameters
    ----------
    stones : surveyed or simplified stones; of one wall or several, of arches and vaults
    settings : criteria of a joint, treatment of joints, and bounds; None: JointSettings()

    Returns
    -------
    ClosedStones; convex stones with joints are cut, others stay as they are. With `JointMode.MORTAR`, stones of one
    leaf that are known by their outlines grow to the medial lines between these (`survey.joints.grown`)

    Raises
    ------
    GeometryError
        naming the stone, if two have one code, one is degenerate, or one has too many convex parts

    Examples
    --------
    >>> from survey.formats.reading import open_survey
    >>> from survey.registration.stones import survey_stones
    >>> survey = open_survey("data/samples/window/window.moma", "moma")
    >>> closed = close_joints([stone for stone in survey_stones(survey).stones if stone.course == 1])
    >>> len(closed.solids), len(closed.report.joints), len(closed.report.gaps)
    (10, 9, 0)
    >>> round(1000 * max(joint.width for joint in closed.report.joints), 1)  # mm
    15.2
    """
    settings = settings or JointSettings()
    leaves = find_leaves(stones, settings)
    if leaves:
        return _with_leaves(stones, leaves, settings)
    blocky = tuple(stone if isinstance(stone, BlockyStone) else simplify(stone) for stone in stones)
    if not blocky:
        return ClosedStones((), (), ClosingReport(settings.mode, (), {}, {}, (), (), ()))
    building, facing, cut, overlaps = _cut(blocky, settings)
    report = closing_report(building, facing, cut, overlaps, settings)
    return ClosedStones(_placed(blocky, building, cut), blocky, report)


def closed_solids(stones: Sequence[BlockyStone], settings: JointSettings) -> tuple[Solid, ...]:
    """Return the solids of `close_joints` without the report, of stones none of which grows.

    Raises
    ------
    GeometryError
        as `close_joints`
    """
    building, _, cut, _ = _cut(tuple(stones), settings)
    return _placed(stones, building, cut)


def _cut(
    blocky: tuple[BlockyStone, ...], settings: JointSettings
) -> tuple[LocalStones, FacingFaces, Cut, list[Overlapping]]:
    """Return the building, the faces that face each other, the stones with closed joints, and what still overlaps."""
    building = as_building(blocky)
    facing = find_facing(building.faces.solids, building.faces.planes, settings)
    if settings.mode is JointMode.AS_SURVEYED:
        cut = _as_surveyed(building, facing)
        parts, planes = _parts(building, cut)
        overlaps = find_overlaps([*cut.solids, *parts], cut.planes | planes)
    else:
        cut, facing = _closed(building, facing, settings)
        parts, planes = _parts(building, cut)
        convex = np.flatnonzero(building.convex).tolist()
        parted, overlaps = part_stones(
            [*building.solids, *parts],
            [*cut.solids, *parts],
            {i: cut.planes[i] for i in convex} | planes,
            {i: cut.free[i] for i in convex},
            settings.max_displacement,
        )
        cut = replace(cut, solids=parted[: len(building.solids)])
    return building, facing, cut, overlaps


def _placed(stones: Sequence[BlockyStone], building: LocalStones, cut: Cut) -> tuple[Solid, ...]:
    """Return the solids in the frame of the stones; those that did not change as they were."""
    placed = (replace(solid, vertices=solid.vertices + building.origin) for solid in cut.solids)
    return tuple(
        stone.solid if solid is old else new
        for stone, old, solid, new in zip(stones, building.solids, cut.solids, placed, strict=True)
    )


def _with_leaves(
    stones: Sequence[SurveyedBlock | BlockyStone], leaves: Sequence[Leaf], settings: JointSettings
) -> ClosedStones:
    """Let the stones of leaves grow, and close the joints of the others among themselves."""
    codes = [stone.code for stone in stones]
    _check_distinct(codes)
    grown = [grow(leaf, [codes[k] for k in leaf.members], settings) for leaf in leaves]
    members = {k: leaf_solids for leaf, leaf_solids in zip(leaves, grown, strict=True) for k in leaf.members}
    rest = close_joints(
        [stone for k, stone in enumerate(stones) if k not in members], replace(settings, grow=False)
    )
    blocky = {leaf_solids.code: leaf_solids for leaf_solids in rest.simplified}
    blocky |= {codes[k]: _unsimplified(stones[k]) for k in members}
    solids = {solid.code: solid for solid in rest.solids}
    solids |= {solid.code: solid for leaf_solids in grown for solid in leaf_solids.solids}
    ordered = [solids[code] for code in codes]
    joints = (*(joint for leaf_solids in grown for joint in leaf_solids.joints), *rest.report.joints)
    joints += tuple(_met(ordered, members, grown, settings))
    joined = {code for joint in joints for code in joint.stones}
    displacement, volume_change = dict(rest.report.displacement), dict(rest.report.volume_change)
    for leaf, leaf_solids in zip(leaves, grown, strict=True):
        own = [codes[k] for k in leaf.members]
        displacement |= dict(zip(own, leaf_solids.displacement, strict=True))
        volume_change |= dict(zip(own, leaf_solids.volume_change, strict=True))
    report = replace(
        rest.report,
        mode=settings.mode,
        joints=joints,
        displacement={code: displacement[code] for code in codes},
        volume_change={code: volume_change[code] for code in codes},
        alone=tuple(code for code in codes if code not in joined),
        leaves=tuple(leaf_solids.report for leaf_solids in grown),
    )
    return ClosedStones(tuple(ordered), tuple(blocky[code] for code in codes), report)


def _check_distinct(codes: Sequence[str]) -> None:
    twice = next((code for code, count in Counter(codes).items() if count > 1), None)
    if twice is not None:
        raise GeometryError("two stones have this code", where=f"stone {twice}", remedy="rename one of them")


def _unsimplified(stone: SurveyedBlock | BlockyStone) -> BlockyStone:
    """Return a stone as surveyed, with what simplifying it would make of it as a measure of its shape."""
    simple = stone if isinstance(stone, BlockyStone) else simplify(stone)
    if isinstance(stone, BlockyStone):
        return simple
    report = replace(
        simple.report,
        displacement=np.zeros(len(stone.solid.vertices)),
        volume_change=0.0,
        within=True,
        reason=_GROWN,
    )
    sound = np.ones(len(stone.face.outline), np.bool_)
    return replace(simple, solid=stone.solid, sound=sound, shape=BlockShape.POLYHEDRON, report=report)


def _met(
    solids: Sequence[Solid],
    members: Mapping[int, GrownStones],
    grown: Sequence[GrownStones],
    settings: JointSettings,
) -> Iterator[StoneJoint]:
    """Yield the joints between stones of a leaf and stones that are none of it, where they meet."""
    arrays = SolidArrays.gather((solid.vertices, solid.faces) for solid in solids)
    planes = planes_of(arrays)
    close = replace(settings, max_width=TOUCHING, max_angle=0.01, min_overlap=0.0)
    facing = find_facing(arrays, planes, close)
    number = sum(len(one.joints) for one in grown)
    for k, (i, j) in enumerate(planes.owner[facing.faces].tolist()):
        own = [members[one] for one in (i, j) if one in members]
        if not own or (len(own) == 2 and own[0] is own[1]):
            continue
        codes = (solids[i].code, solids[j].code)
        width = sum(leaf.report.thickness.get(frozenset({code}), 0.0) for leaf in own for code in codes)
        yield StoneJoint(
            codes, number + k, width, 0.0, float(facing.area[k]), facing.centroid[k], facing.normal[k], ""
        )


def _closed(building: LocalStones, facing: FacingFaces, settings: JointSettings) -> tuple[Cut, FacingFaces]:
    """Close all joints that can be closed, including those revealed by closing others."""
    cut = close_within_bounds(building, facing, settings, building.solids)
    for _ in range(ROUNDS):
        before, facing = facing, newly_facing(building, facing, cut, settings)
        cut = close_within_bounds(building, facing, settings, cut.solids)
        if len(facing) == len(before):
            break
    return cut, facing


def _parts(building: LocalStones, cut: Cut) -> tuple[list[Solid], dict[int, Array]]:
    """Return the convex parts of non-convex stones, and their planes (n, 4), numbered after all stones."""
    parts: list[Solid] = []
    for i in np.flatnonzero(~building.convex).tolist():
        parts += stone_parts(cut.solids[i])
    return parts, {len(building.solids) + k: planes_of_solid(part) for k, part in enumerate(parts)}


def _as_surveyed(building: LocalStones, facing: FacingFaces) -> Cut:
    """Return all stones as they are, with all joints open except those whose faces already share a plane."""
    convex = np.flatnonzero(building.convex).tolist()
    planes = {i: building.planes[building.rows(i)] for i in convex}
    free = {i: np.ones(len(planes[i]), np.bool_) for i in convex}
    first, second = building.planes[facing.faces[:, 0]], building.planes[facing.faces[:, 1]]
    size = np.sqrt(building.faces.planes.areas[facing.faces].max(axis=1))
    turned = np.linalg.norm(first[:, :3] + second[:, :3], axis=1) * size
    shared = (np.abs(facing.gap) <= TOUCHING) & (turned <= TOUCHING)
    of_link = np.where(shared, np.arange(len(facing)), -1)
    contact = ContactPlanes(first[:, :3], first[:, 3], of_link, np.ones(len(facing), np.int64))
    reasons = ["" if one else _AS_SURVEYED for one in shared.tolist()]
    return Cut(contact, reasons, list(building.solids), planes, free, {})


def newly_facing(
    building: LocalStones, facing: FacingFaces, cut: Cut, settings: JointSettings
) -> FacingFaces:
    """Return the known pairs of faces, and those of further stones that face each other now.

    Parameters
    ----------
    building : the stones as surveyed
    facing : known pairs
    cut : stones with the joints of these closed
    settings : criteria of a joint; a newly found joint is at most half as wide
    """
    solids = SolidArrays.gather((solid.vertices, solid.faces) for solid in cut.solids)
    fresh_facing = find_facing(
        solids, planes_of(solids), replace(settings, max_width=0.5 * settings.max_width)
    )
    pairs, owner = _surveyed_faces(building, cut)[fresh_facing.faces], building.faces.planes.owner
    known = set(map(tuple, owner[facing.faces].tolist()))
    fresh = [
        k
        for k, (first, second) in enumerate(pairs.tolist())
        if first >= 0 and second >= 0 and (int(owner[first]), int(owner[second])) not in known
    ]
    width = _height(building, pairs[fresh, 0], fresh_facing, fresh) - _height(
        building, pairs[fresh, 1], fresh_facing, fresh
    )
    return FacingFaces(
        np.concatenate([facing.faces, pairs[fresh]]),
        np.concatenate([facing.area, fresh_facing.area[fresh]]),
        np.concatenate([facing.gap, width]),
        np.concatenate([facing.centroid, fresh_facing.centroid[fresh]]),
        np.concatenate([facing.normal, fresh_facing.normal[fresh]]),
    )


def _surveyed_faces(building: LocalStones, cut: Cut) -> Ints:
    """Return the surveyed face of each face of the cut stones; -1 for one that came from a bend of its bed."""
    out = []
    for i, solid in enumerate(cut.solids):
        rows = building.rows(i)
        of_face = np.array(cut.of_face.get(i, range(len(solid.faces))), np.int64)
        out.append(np.where(of_face < rows.stop - rows.start, rows.start + of_face, -1))
    return np.concatenate(out)


def _height(building: LocalStones, faces: Ints, facing: FacingFaces, links: list[int]) -> Array:
    """Return the heights of the planes of surveyed faces along the normal of a joint, above its middle [m]."""
    normals, offsets = building.faces.planes.normals[faces], building.faces.planes.offsets[faces]
    centroid, normal = facing.centroid[links], facing.normal[links]
    out: Array = (offsets - (normals * centroid).sum(axis=1)) / (normals * normal).sum(axis=1)
    return out
