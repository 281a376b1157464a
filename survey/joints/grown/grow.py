"""Growth of the stones of a leaf to the medial lines of their mortar."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.conventions import LEAST
from survey.extrusion.extrusion import prism
from survey.geometry.polygons import ring_area
from survey.geometry.solids import Solid
from survey.joints.grown.chains import apart
from survey.joints.grown.leaf import Leaf
from survey.joints.grown.medial_lines import LEFT_BELOW_RIGHT_ABOVE, medial_lines
from survey.joints.grown.partition import Edge, Partition, partition
from survey.joints.grown_leaf import GrownLeaf, Opening
from survey.joints.report import StoneJoint
from survey.joints.settings import JointSettings

_SAMPLES = 50  # along the side of a usual stone
_CLOSE = 8  # and across the widest mortar, so that samples tell what it fills
_SIDES = ("left", "below", "right", "above")  # of the frame

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

    Places too far from all of them stay open, and outlines beside these as they are.

    Parameters
    ----------
    leaf : outlines and frame
    codes : of its members
    settings : `straightness` bounds the distance of edges from medial lines, `min_overlap` their length from below;
        `max_width` is the width up to which mortar is filled in, or four times that of the usual joint where more
    fineness : number by which samples along the outlines are denser

    Raises
    ------
    GeometryError
        if an outline lies within another, or outlines cross so much that they cannot be told apart
    """
    areas = np.array([abs(ring_area(outline)) for outline in leaf.outlines])
    step = min(float(np.sqrt(np.median(areas))) / _SAMPLES, settings.max_width / _CLOSE) / fineness
    lines = medial_lines(leaf.outlines, leaf.frame, step, settings.max_width)
    divided = partition(lines, leaf.outlines, settings.straightness, settings.min_overlap)
    rings = [divided.corners[list(ring)] for ring in divided.rings]
    grown = [
        prism(code, leaf.place(ring, 0.0), leaf.place(ring, leaf.depth))
        for code, ring in zip(codes, rings, strict=True)
    ]
    moved = [apart(outline, ring) for outline, ring in zip(leaf.outlines, rings, strict=True)]
    growth = [float(apart(ring, outline).max()) for outline, ring in zip(leaf.outlines, rings, strict=True)]
    new = np.array([abs(ring_area(ring)) for ring in rings])
    low = leaf.frame[0]
    width, height = (leaf.frame[1] - low).tolist()
    farthest = int(np.argmax(growth))
    report = GrownLeaf(
        size=(width, height),
        outlines={code: outline - low for code, outline in zip(codes, leaf.outlines, strict=True)},
        grown={code: ring - low for code, ring in zip(codes, rings, strict=True)},
        thickness=_thickness(divided, codes),
        stone_share=dict(zip(codes, np.minimum(areas / new, 1.0).tolist(), strict=True)),
        edges=sum(_between_stones(edge, codes) for edge in divided.edges),
        collapsed=divided.collapsed,
        growth=growth[farthest],
        farthest=codes[farthest],
        crossing=tuple((codes[i], codes[j]) for i, j in lines.crossing),
        filled=lines.filled,
        openings=tuple(sorted(_openings(leaf, divided, codes), key=lambda opening: -opening.area)),
    )
    return GrownStones(
        solids=tuple(grown),
        displacement=tuple(np.concatenate([shift, shift]) for shift in moved),
        volume_change=tuple((new / areas - 1.0).tolist()),
        joints=_joints(leaf, divided, codes),
        report=report,
    )


def _thickness(divided: Partition, codes: Sequence[str]) -> dict[frozenset[str], float]:
    """Return the mean thickness of the mortar of each pair of stones, and of each stone at foot and top of the frame.

    Edges count by their lengths.
    """
    sums: dict[frozenset[str], list[tuple[float, float]]] = defaultdict(list)
    for edge in divided.edges:
        stones = [k for k in (edge.left, edge.right) if 0 <= k < len(codes)]
        if len(stones) == 2 or (len(stones) == 1 and min(edge.left, edge.right) in (_BELOW, _ABOVE)):
            length = float(np.hypot(*(divided.corners[edge.ends[1]] - divided.corners[edge.ends[0]])))
            sums[frozenset(codes[k] for k in stones)].append((edge.thickness, length))
    return {
        stones: max(sum(own * length for own, length in of) / sum(length for _, length in of), LEAST)
        for stones, of in sums.items()
    }


def _between_stones(edge: Edge, codes: Sequence[str]) -> bool:
    return min(edge.left, edge.right) >= 0 and max(edge.left, edge.right) < len(codes)


def _openings(leaf: Leaf, divided: Partition, codes: Sequence[str]) -> Iterator[Opening]:
    """Yield what stays open in a leaf."""
    for number in range(len(codes), len(codes) + divided.openings):
        border = [edge for edge in divided.edges if number in (edge.left, edge.right)]
        # with the opening to their left, edges sum to its area whatever lies within it
        ends = np.array([edge.ends if edge.left == number else edge.ends[::-1] for edge in border])
        edges = divided.corners[ends]
        start, stop = (edges - leaf.frame[0]).swapaxes(0, 1)
        beside = {edge.left + edge.right - number for edge in border}
        yield Opening(
            edges=edges - leaf.frame[0],
            front=leaf.place(edges.reshape(-1, 2), 0.0).reshape(-1, 2, 3),
            area=0.5 * float((start[:, 0] * stop[:, 1] - start[:, 1] * stop[:, 0]).sum()),
            stones=tuple(codes[k] for k in sorted(beside) if 0 <= k < len(codes)),
            sides=tuple(_SIDES[-1 - k] for k in sorted(beside, reverse=True) if k < 0),
        )


def _joints(leaf: Leaf, divided: Partition, codes: Sequence[str]) -> tuple[StoneJoint, ...]:
    joints = []
    for number, edge in enumerate(divided.edges):
        if not _between_stones(edge, codes):
            continue
        start, stop = divided.corners[list(edge.ends)]
        run = stop - start
        length = float(np.hypot(*run))
        # square to the edge, to its left: into the first stone
        normal = (-run[1] * leaf.right + run[0] * leaf.up) / length
        joints.append(
            StoneJoint(
                stones=(codes[edge.left], codes[edge.right]),
                plane=number,
                width=edge.thickness,
                opening=edge.opening,
                area=length * leaf.depth,
                centroid=leaf.place(0.5 * (start + stop)[None], 0.5 * leaf.depth)[0],
                normal=normal,
                left_open="",
            )
        )
    return tuple(joints)
