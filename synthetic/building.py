"""A synthetic building: its true stones with closed joints, and its survey, with open ones."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from random import Random
from types import MappingProxyType

import numpy as np

from survey.arrays import Array
from survey.extrusion.depth import depth_for
from survey.extrusion.extrusion import SurveyedBlock, extrude, prism
from survey.extrusion.imported_solids import block_of_solid
from survey.faces.faces import outline_face
from survey.geometry.solids import Solid
from survey.records.survey import OBSERVER, DepthRule, SolidRecord, Station, Survey, SurveyHead
from synthetic.bond import PlannedStone
from synthetic.frame import Movement, RigidMotion, TrueStone, WallFrame
from synthetic.measure import (
    HALF_JOINT,
    SIGMA,
    MeasuredStone,
    add_blunders,
    measure_stone,
    modelled_solid,
)
from synthetic.true_joints import TrueJoint, true_joints

SOURCE = "synthetic value, chosen for this building"
SEEN = "synthetic value, as if measured on a side that can be seen"
_NONE: Movement = MappingProxyType({})
DEPTH_SIGMA = 0.03  # standard deviation of a depth by rule [m]
_DECIMALS = 5  # of the coordinates of modelled solids, in metres


@dataclass(frozen=True)
class Draft:
    """A true stone before its measurement.

    Attributes
    ----------
    stone : its true geometry
    frame : of its plan
    quad : (4, 2) the four corners that a surveyor sees, counter-clockwise [m]
    side_of : side of `quad` that each side of the plan belongs to
    zone, station : as in a survey's record
    seen_depth : whether its depth is visible and measured
    """

    stone: TrueStone
    frame: WallFrame
    quad: Array
    side_of: tuple[int, ...] = (0, 1, 2, 3)
    zone: str | None = None
    station: str | None = None
    seen_depth: bool = False


@dataclass(frozen=True)
class SolidDraft:
    """A true stone that is modelled as a closed solid, as several of its sides are seen.

    Attributes
    ----------
    solid : its true geometry, convex
    kind, course : as in a survey's record
    """

    solid: Solid
    kind: str
    course: int | None = None


@dataclass(frozen=True)
class SyntheticBuilding:
    """A synthetic building.

    Attributes
    ----------
    name : a description
    survey : the measurements of a surveyor
    modelled : stones that were measured as closed solids, seen from the observer, and are not in the survey
    solids : the true stones, convex, where they are now; in the order of the survey, then of `modelled`
    joints : all true joints, as they were laid
    base : codes of the stones that stand on the ground
    movement : of the stones since their joints were closed
    """

    name: str
    survey: Survey
    modelled: tuple[SolidRecord, ...]
    solids: tuple[Solid, ...]
    joints: tuple[TrueJoint, ...]
    base: tuple[str, ...]
    movement: Movement = field(default_factory=dict)

    def blocks(self) -> list[SurveyedBlock]:
        """Make the surveyed stones, in the order of the true ones: fit planes, extrude outlines by their depth."""
        head = self.survey.head
        extruded = [
            extrude(outline_face(block, head.viewpoint(block.station)), depth_for(block, head.depth_rules))
            for block in self.survey.blocks
        ]
        return [*extruded, *(block_of_solid(one, head.viewpoint(None), self.name) for one in self.modelled)]


def flat_stone(plan: PlannedStone, depth: float, frame: WallFrame) -> TrueStone:
    """Make a stone whose face lies in the plane of the frame."""
    corners = frame.place(plan.corners)
    solid = prism(plan.code, corners, corners - depth * frame.axes[2])
    return TrueStone(plan, frame.axes[2], float(frame.axes[2] @ frame.origin), depth, solid)


def measured_building(
    name: str,
    drafts: Sequence[Draft],
    depths: dict[str, float],
    stations: Sequence[Station],
    base: Sequence[str],
    rng: Random,
    *,
    blunders: int = 0,
    movement: Movement = _NONE,
    modelled: Sequence[SolidDraft] = (),
) -> SyntheticBuilding:
    """Measure a building; sides in contact with another stone are surveyed half a joint inside.

    Parameters
    ----------
    name : of the survey
    drafts : the true stones
    depths : by kind [m]
    stations : of the surveyor
    base : codes of the stones on the ground
    rng : random numbers
    blunders : number of points with a gross error
    movement : of the stones since they were laid
    modelled : true stones that are measured as closed solids, after the others
    """
    joints = true_joints([*(draft.stone.solid for draft in drafts), *(draft.solid for draft in modelled)])
    touched = {(code, face) for joint in joints for code, face in zip(joint.stones, joint.faces, strict=True)}
    drafts = [_moved(draft, movement.get(draft.stone.plan.code)) for draft in drafts]
    modelled = [_moved_solid(draft, movement.get(draft.solid.code)) for draft in modelled]
    measured = [_measured(draft, touched, rng) for draft in drafts]
    measured = add_blunders(measured, [draft.stone.normal for draft in drafts], blunders, rng)
    rules = tuple(DepthRule(kind, depth, DEPTH_SIGMA, SOURCE) for kind, depth in sorted(depths.items()))
    head = SurveyHead(f"{name} (synthetic)", f"{name}.moma", tuple(stations), depth_rules=rules)
    return SyntheticBuilding(
        name,
        Survey(head, tuple(one.record for one in measured)),
        tuple(_modelled(draft, touched, rng) for draft in modelled),
        (*(draft.stone.solid for draft in drafts), *(draft.solid for draft in modelled)),
        joints,
        tuple(base),
        movement,
    )


def observer(position: Array) -> Station:
    """Make the station from which the whole building is seen."""
    return Station(OBSERVER, np.round(position, 4))


def _moved(draft: Draft, motion: RigidMotion | None) -> Draft:
    if motion is None:
        return draft
    return replace(draft, stone=draft.stone.moved(motion), frame=draft.frame.moved(motion))


def _moved_solid(draft: SolidDraft, motion: RigidMotion | None) -> SolidDraft:
    if motion is None:
        return draft
    return replace(draft, solid=replace(draft.solid, vertices=motion.place(draft.solid.vertices)))


def _modelled(draft: SolidDraft, touched: set[tuple[str, int]], rng: Random) -> SolidRecord:
    """Measure the planes of a stone that is modelled as a closed solid."""
    code = draft.solid.code
    seen = modelled_solid(draft.solid, (face for stone, face in touched if stone == code), rng)
    return SolidRecord(code, draft.kind, draft.course, np.round(seen.vertices, _DECIMALS) + 0.0, seen.faces)


def _measured(draft: Draft, touched: set[tuple[str, int]], rng: Random) -> MeasuredStone:
    """Measure one face, and the depth where it is visible."""
    stone, code = draft.stone, draft.stone.plan.code
    touching = {side for i, side in enumerate(draft.side_of) if (code, 2 + i) in touched}
    joint = (0 in touching, 1 in touching, 2 in touching, 3 in touching)
    plan = replace(stone.plan, corners=draft.quad, joint=joint)
    measured = measure_stone(replace(stone, plan=plan), draft.frame, rng)
    record = replace(measured.record, zone=draft.zone, station=draft.station)
    if not draft.seen_depth:
        return replace(measured, record=record)
    hidden_half = rng.uniform(*HALF_JOINT) if (code, 1) in touched else 0.0
    depth = round(stone.depth - hidden_half + rng.gauss(0.0, SIGMA), 4)
    record = replace(record, depth=depth, depth_sigma=SIGMA, depth_source=SEEN)
    return replace(measured, record=record)
