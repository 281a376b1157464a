"""Report of `moma check` on simplified stones and closed joints, in plain values and site coordinates."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from pipelines.run.filling import LeafReport, leaf_report
from pipelines.run.soundness import DEEP
from survey.joints.report import ClosingReport
from survey.simplify.simplify import BlockyStone


@dataclass(frozen=True)
class OutsideStone:
    """A stone that simplification changed by more than the uncertainty of the survey.

    Attributes
    ----------
    code : of the stone
    displacement : largest of a corner [m]
    tolerance : uncertainty of the survey [m]
    reason : the simplification, in words
    """

    code: str
    displacement: float
    tolerance: float
    reason: str


@dataclass(frozen=True)
class SimplificationReport:
    """Changes by simplification of the stones.

    Attributes
    ----------
    shapes : number of stones by shape
    least_blocky : code of the stone that was farthest from a hexahedron
    blockiness : of that stone [-]
    max_displacement : largest of a corner [m], of `worst_stone`
    outside : stones outside the tolerance of the survey, the farthest first
    general : stones that stay general polyhedra, and why
    displacement : largest of a corner of each stone [m]
    """

    shapes: Mapping[str, int]
    least_blocky: str
    blockiness: float
    max_displacement: float
    worst_stone: str
    outside: tuple[OutsideStone, ...]
    general: Mapping[str, str]
    displacement: Mapping[str, float]


@dataclass(frozen=True)
class GapPlace:
    """Two stones that face each other and do not meet.

    Attributes
    ----------
    stones : codes of the two
    width : mean [m]
    area : over which they face each other [m²]
    place : (x, y, z) [m]
    reason : why the joint was not closed
    """

    stones: tuple[str, str]
    width: float
    area: float
    place: tuple[float, float, float]
    reason: str


@dataclass(frozen=True)
class OverlapPlace:
    """Two stones that overlap.

    Attributes
    ----------
    stones : codes of the two
    volume : of the overlap [m³]
    depth : distance by which one stone would have to move to be free [m]
    place : (x, y, z) [m]
    """

    stones: tuple[str, str]
    volume: float
    depth: float
    place: tuple[float, float, float]


@dataclass(frozen=True)
class JointsReport:
    """Joints after closing.

    Attributes
    ----------
    mode : close, mortar or as-surveyed
    count : number of closed joints
    planes : number of their contact planes
    mean_width : mean surveyed width, weighted by area, of all joints, open ones included [m]
    area : of the closed joints [m²]
    left_open : number of joints that stay open, by reason
    max_displacement : largest movement of a corner [m], of `worst_stone`
    max_volume_change : largest relative change of a volume [-]
    alone : stones without any joint
    displacement : largest movement of a corner of each stone [m]
    measured_overlaps : closed joints of stones whose measurements overlap, as gaps of negative width
    gaps, overlaps : those that remain, the largest first
    leaves : rubble whose stones grew to the middle of their mortar
    """

    mode: str
    count: int
    planes: int
    mean_width: float
    area: float
    left_open: Mapping[str, int]
    max_displacement: float
    worst_stone: str | None
    max_volume_change: float
    alone: tuple[str, ...]
    displacement: Mapping[str, float]
    measured_overlaps: tuple[GapPlace, ...]
    gaps: tuple[GapPlace, ...]
    overlaps: tuple[OverlapPlace, ...]
    leaves: tuple[LeafReport, ...] = ()


def simplification_report(stones: Sequence[BlockyStone]) -> SimplificationReport | None:
    """Summarise the changes by simplification; None without stones."""
    if not stones:
        return None
    moved = {stone.code: float(stone.report.displacement.max(initial=0.0)) for stone in stones}
    least = min(stones, key=lambda stone: stone.report.blockiness)
    worst = max(moved, key=lambda code: moved[code])
    outside = [
        OutsideStone(stone.code, moved[stone.code], stone.report.tolerance, stone.report.reason)
        for stone in stones
        if not stone.report.within
    ]
    shapes = Counter(str(stone.shape) for stone in stones)
    return SimplificationReport(
        shapes=dict(shapes.most_common()),
        least_blocky=least.code,
        blockiness=least.report.blockiness,
        max_displacement=moved[worst],
        worst_stone=worst,
        outside=tuple(sorted(outside, key=lambda stone: -stone.displacement)),
        general={stone.code: stone.report.reason for stone in stones if str(stone.shape) == "polyhedron"},
        displacement=moved,
    )


def joints_report(
    closing: ClosingReport, origin: Array, hypotheses: frozenset[str] = frozenset()
) -> JointsReport:
    """Summarise the joints, whose positions are relative to `origin` (3,) [m].

    Overlaps of the stones in `hypotheses`, which were not measured, are left out.
    """
    closed = [joint for joint in closing.joints if not joint.left_open]
    areas = np.array([joint.area for joint in closing.joints])
    moved = {code: float(distance.max(initial=0.0)) for code, distance in closing.displacement.items()}
    worst = max(moved, key=lambda code: moved[code], default=None)
    open_for = Counter(joint.left_open for joint in closing.joints if joint.left_open)
    return JointsReport(
        mode=str(closing.mode),
        count=len(closed),
        planes=len({joint.plane for joint in closed}),
        mean_width=float(np.average([joint.width for joint in closing.joints], weights=areas))
        if areas.any()
        else 0.0,
        area=sum(joint.area for joint in closed),
        left_open=dict(open_for.most_common()),
        max_displacement=0.0 if worst is None else moved[worst],
        worst_stone=worst,
        max_volume_change=max((abs(change) for change in closing.volume_change.values()), default=0.0),
        alone=closing.alone,
        displacement=moved,
        measured_overlaps=tuple(
            GapPlace(
                joint.stones, joint.width, joint.area, _place(joint.centroid + origin), "closed half-way"
            )
            for joint in sorted(closed, key=lambda joint: joint.width)
            if joint.width < -DEEP and not hypotheses & set(joint.stones)
        ),
        gaps=tuple(
            GapPlace(gap.stones, gap.width, gap.area, _place(gap.centroid + origin), gap.reason)
            for gap in sorted(closing.gaps, key=lambda gap: -gap.width * gap.area)
        ),
        overlaps=tuple(
            OverlapPlace(overlap.stones, overlap.volume, overlap.depth, _place(overlap.centroid + origin))
            for overlap in sorted(closing.overlaps, key=lambda overlap: -overlap.volume)
        ),
        leaves=tuple(leaf_report(leaf, closing.joints, origin) for leaf in closing.leaves),
    )


def _place(point: Array) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z
