"""Growth of the stones of a leaf to the medial lines of their mortar."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.extrusion.extrusion import prism
from survey.geometry.polygons import ring_area
from survey.geometry.solids import Solid
from survey.joints.grown.leaf import Leaf
from survey.joints.grown.medial_lines import LEFT_BELOW_RIGHT_ABOVE, medial_lines
from survey.joints.grown.partition import Partition, apart, partition
from survey.joints.report import GrownLeaf, StoneJoint
from survey.joints.settings import JointSettings

__all__ = ["GrownStones", "grow"]

_SAMPLES = 50  # along the side of a usual stone
_THINNEST = 1e-3  # metres: least thickness of mortar, where outlines touch

_, _BELOW, _, _ABOVE = LEFT_BELOW_RIGHT_ABOVE


@dataclass(frozen=True)
class GrownStones:
    """The stones of a leaf, grown.

    Attributes
    ----------
    solids : of its members, prisms between the planes of the leaf
    displacement : of each member, distance of each corner of its outline from the edges of what it grew to [m]
    volume_change : of each member, new volume over old, minus 1 [-]
    joints : between them, one for each edge
    report : sizes, thickness and shares
    """

    solids: tuple[Solid, ...]
    displacement: tuple[Array, ...]
    volume_change: tuple[float, ...]
    joints: tuple[StoneJoint, ...]
    report: GrownLeaf


def grow(leaf: Leaf, codes: Sequence[str], settings: JointSettings, fineness: float = 1.0) -> GrownStones:
    """Let the stones of a leaf grow until they meet in the middle of their mortar.

    Parameters
    ----------
    leaf : outlines and frame
    codes : of its members
    settings : `straightness` bounds the distance of edges from medial lines, `min_overlap` their length from below
    fineness : number by which samples along the outlines are denser

    Raises
    ------
    GeometryError
        if an outline lies within another, or outlines cross so much that they cannot be told apart
    """
    areas = np.array([abs(ring_area(one)) for one in leaf.outlines])
    step = float(np.sqrt(np.median(areas))) / (_SAMPLES * fineness)
    lines = medial_lines(leaf.outlines, leaf.frame, step)
    found = partition(lines, leaf.outlines, settings.straightness, settings.min_overlap)
    rings = [found.corners[list(one)] for one in found.rings]
    grown = [
        prism(code, leaf.place(ring, 0.0), leaf.place(ring, leaf.depth))
        for code, ring in zip(codes, rings, strict=True)
    ]
    moved = [apart(outline, ring) for outline, ring in zip(leaf.outlines, rings, strict=True)]
    growth = [float(apart(ring, outline).max()) for outline, ring in zip(leaf.outlines, rings, strict=True)]
    new = np.array([abs(ring_area(one)) for one in rings])
    low = leaf.frame[0]
    width, height = (leaf.frame[1] - low).tolist()
    farthest = int(np.argmax(growth))
    report = GrownLeaf(
        size=(width, height),
        outlines={code: one - low for code, one in zip(codes, leaf.outlines, strict=True)},
        grown={code: one - low for code, one in zip(codes, rings, strict=True)},
        thickness=_thickness(found, codes),
        stone_share=dict(zip(codes, np.minimum(areas / new, 1.0).tolist(), strict=True)),
        edges=sum(one.left >= 0 and one.right >= 0 for one in found.edges),
        collapsed=found.collapsed,
        growth=growth[farthest],
        farthest=codes[farthest],
        crossing=tuple((codes[i], codes[j]) for i, j in lines.crossing),
    )
    return GrownStones(
        solids=tuple(grown),
        displacement=tuple(np.concatenate([one, one]) for one in moved),
        volume_change=tuple((new / areas - 1.0).tolist()),
        joints=_joints(leaf, found, codes),
        report=report,
    )


def _thickness(found: Partition, codes: Sequence[str]) -> dict[frozenset[str], float]:
    """Return the mean thickness of the mortar of each pair of stones, and of each stone at foot and top of the frame.

    Edges count by their lengths.
    """
    sums: dict[frozenset[str], list[tuple[float, float]]] = defaultdict(list)
    for one in found.edges:
        stones = [k for k in (one.left, one.right) if k >= 0]
        if len(stones) == 2 or min(one.left, one.right) in (_BELOW, _ABOVE):
            length = float(np.hypot(*(found.corners[one.ends[1]] - found.corners[one.ends[0]])))
            sums[frozenset(codes[k] for k in stones)].append((one.thickness, length))
    return {
        stones: max(sum(own * length for own, length in of) / sum(length for _, length in of), _THINNEST)
        for stones, of in sums.items()
    }


def _joints(leaf: Leaf, found: Partition, codes: Sequence[str]) -> tuple[StoneJoint, ...]:
    joints = []
    for number, one in enumerate(found.edges):
        if one.left < 0 or one.right < 0:
            continue
        start, stop = found.corners[list(one.ends)]
        way = stop - start
        length = float(np.hypot(*way))
        # square to the edge, to its left: into the first stone
        normal = (-way[1] * leaf.right + way[0] * leaf.up) / length
        joints.append(
            StoneJoint(
                stones=(codes[one.left], codes[one.right]),
                plane=number,
                width=one.thickness,
                opening=one.opening,
                area=length * leaf.depth,
                centroid=leaf.place(0.5 * (start + stop)[None], 0.5 * leaf.depth)[0],
                normal=normal,
                left_open="",
            )
        )
    return tuple(joints)
