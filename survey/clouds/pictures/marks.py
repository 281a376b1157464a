"""Outlines of others that the picture contradicts: across a joint, overlapping, or two on one stone."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from survey.arrays import Array
from survey.clouds.extras import optional
from survey.clouds.pictures.proposal import Proposal
from survey.conventions import FEW, LARGELY, SOME

_STONE_SHARE = SOME  # part of a proposed stone within an outline from which the outline holds it
_SHARE_WITHIN_STONE = 0.6  # part of an outline within a proposed stone from which it lies in it
_OVERLAP = FEW  # shared part of the smaller of two outlines from which they overlap
_SURE = LARGELY  # probability of a joint from which it parts stones


@dataclass(frozen=True)
class Mark:
    """A doubt about outlines: the numbers of one or two, the reason, and a place in the wall's plane [m]."""

    outlines: tuple[int, ...]
    reason: str
    text: str
    place: tuple[float, float]


def mark_outlines(rings: Sequence[Array], proposal: Proposal) -> list[Mark]:
    """Mark outlines that contradict the joints that a picture shows.

    Parameters
    ----------
    rings : (n, 2) outlines of others in the wall's plane [m]
    proposal : of the same picture
    """
    shapely = optional("shapely", "the review of outlines")
    drawn = shapely.make_valid(np.array([shapely.polygons(ring) for ring in rings], dtype=object))
    marks = _overlaps(shapely, drawn)
    if not proposal.stones:
        return marks
    polygons = shapely.make_valid(
        np.array([shapely.polygons(stone.ring) for stone in proposal.stones], dtype=object)
    )
    first, second = shapely.STRtree(polygons).query(drawn, predicate="intersects")
    shared = shapely.area(shapely.intersection(drawn[first], polygons[second]))
    holds = shared > _STONE_SHARE * shapely.area(polygons[second])
    lies = shared > _SHARE_WITHIN_STONE * shapely.area(drawn[first])
    joints = {tuple(sorted(border.stones)): border for border in proposal.borders}
    for k in np.unique(first[holds]).tolist():
        inside = second[holds & (first == k)].tolist()
        for i, a in enumerate(inside):
            for b in inside[i + 1 :]:
                joint = joints.get((min(a, b), max(a, b)))
                if joint is not None and joint.probability >= _SURE:
                    text = f"it runs across a joint ({joint.probability:.0%} sure)"
                    marks.append(Mark((k,), "leak", text, joint.place))
    for b in np.unique(second[lies]).tolist():
        parts = first[lies & (second == b)].tolist()
        for i, a in enumerate(parts):
            for further in parts[i + 1 :]:
                middle = 0.5 * (rings[a].mean(axis=0) + rings[further].mean(axis=0))
                text = "two outlines on one stone: no joint shows between them"
                marks.append(Mark((a, further), "split", text, (float(middle[0]), float(middle[1]))))
    return marks


def _overlaps(shapes: Any, drawn: Any) -> list[Mark]:
    """Return the pairs of outlines that share much of their area."""
    first, second = shapes.STRtree(drawn).query(drawn, predicate="intersects")
    once = first < second
    first, second = first[once], second[once]
    shared = shapes.intersection(drawn[first], drawn[second])
    part = shapes.area(shared) / np.maximum(
        np.minimum(shapes.area(drawn[first]), shapes.area(drawn[second])), 1e-12
    )
    out = []
    for k in np.flatnonzero(part > _OVERLAP).tolist():
        place = shapes.centroid(shared[k])
        text = f"two outlines share {part[k]:.0%} of the smaller"
        out.append(Mark((int(first[k]), int(second[k])), "overlap", text, (place.x, place.y)))
    return out
