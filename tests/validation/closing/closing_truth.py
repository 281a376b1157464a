"""What closing the joints of a synthetic building made of it, against its truth: all found anew from the solids."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from mechanics.arrays import Array
from survey.geometry.solids import Solid, area_vector
from survey.geometry.watertight import check_watertight
from survey.joints.close import ClosedStones
from synthetic.true_joints import TrueJoint, true_joints
from tests.validation.closing.convex_overlap import overlaps

Pair = tuple[str, str]


@dataclass(frozen=True)
class Verdict:
    """How well the joints of a building were closed.

    Attributes
    ----------
    true_area : of all true joints [m²]
    areas : the same by pair of stones [m²]
    found : by pair of stones, area that they share now over what they truly share [-]
    found_share : what is shared now of the true area, no joint counted for more than it is [-]
    beyond_share : what is shared beyond: joints that are too large, and pairs that do not truly touch [-]
    wrong : pairs that touch and should not, with their area [m²]
    plane_error : largest height of a corner of a shared face over its partner's plane [m]
    flatness : largest height of a corner over the plane of its own face [m]
    overlap : volume that any two stones share, largest [m³]
    moved : largest distance of a corner of a closed stone from the nearest of the stone before [m]
    misreported : corners whose displacement in the report is less than the truth, worst of all [m]
    """

    true_area: float
    areas: dict[Pair, float]
    found: dict[Pair, float]
    found_share: float
    beyond_share: float
    wrong: dict[Pair, float]
    plane_error: float
    flatness: float
    overlap: float
    moved: float
    misreported: float

    def below(self, share: float) -> dict[Pair, float]:
        """Pairs of which less than this share of the true area is found."""
        return {pair: found for pair, found in self.found.items() if found < share}

    def line(self) -> str:
        """The numbers, for a report."""
        return (
            f"area {self.true_area:.1f} m², found {100 * self.found_share:.2f} %, "
            f"beyond {100 * self.beyond_share:.2f} %, "
            f"joints below 80 %: {len(self.below(0.8))} of {len(self.found)}, wrong {len(self.wrong)}, "
            f"plane {self.plane_error:.1e} m, flat {self.flatness:.1e} m, overlap {self.overlap:.1e} m³, "
            f"moved {1e3 * self.moved:.1f} mm, misreported {1e3 * self.misreported:.2f} mm"
        )


def judge(
    closed: ClosedStones, before: Sequence[Solid], joints: Sequence[TrueJoint], parts: Sequence[Solid] = ()
) -> Verdict:
    """Judge closed stones; all must be watertight and of positive volume.

    Parameters
    ----------
    closed : what came of closing
    before : the stones as they went into it, in the same order
    joints : the true ones
    parts : convex parts of the closed stones, if some are not convex
    """
    for solid in closed.solids:
        check_watertight(solid)
    pieces = list(parts or closed.solids)
    for piece in pieces:
        check_watertight(piece, convex=True)
    shared = _shared(pieces)
    true = _areas((joint.stones, joint.area) for joint in joints)
    now = _areas(((pieces[i].code, pieces[j].code), joint.area) for i, j, joint in shared)
    total = sum(true.values())
    common = sum(min(now.get(pair, 0.0), area) for pair, area in true.items())
    return Verdict(
        true_area=total,
        areas=true,
        found={pair: now.get(pair, 0.0) / area for pair, area in true.items()},
        found_share=common / total,
        beyond_share=(sum(now.values()) - common) / total,
        wrong={pair: area for pair, area in now.items() if pair not in true},
        plane_error=max((_apart(pieces[i], pieces[j], joint.faces) for i, j, joint in shared), default=0.0),
        flatness=max(_flatness(solid) for solid in pieces),
        overlap=max(overlaps(pieces).values(), default=0.0),
        moved=max(_moved(b, a).max() for b, a in zip(before, closed.solids, strict=True)),
        misreported=_misreported(closed, before),
    )


def _shared(pieces: Sequence[Solid]) -> list[tuple[int, int, TrueJoint]]:
    """Faces that pieces of different stones share, with the numbers of the two pieces."""
    numbered = [Solid(str(k), piece.vertices, piece.faces) for k, piece in enumerate(pieces)]
    found = [(int(joint.stones[0]), int(joint.stones[1]), joint) for joint in true_joints(numbered)]
    return [one for one in found if pieces[one[0]].code != pieces[one[1]].code]


def _areas(joints: Iterable[tuple[Pair, float]]) -> dict[Pair, float]:
    """Area by pair of stones, in the order of their codes."""
    out: dict[Pair, float] = {}
    for stones, area in joints:
        pair = (min(stones), max(stones))
        out[pair] = out.get(pair, 0.0) + area
    return out


def _apart(one: Solid, two: Solid, faces: tuple[int, int]) -> float:
    """Largest distance of the corners of a face from the plane of the face that it lies on, both ways."""
    heights = []
    for (own, face), (other, against) in permutations(((one, faces[0]), (two, faces[1]))):
        corners = other.vertices[list(other.faces[against])]
        normal = area_vector(corners)
        normal /= np.linalg.norm(normal)
        heights.append(np.abs((own.vertices[list(own.faces[face])] - corners.mean(axis=0)) @ normal).max())
    return float(max(heights))


def _flatness(solid: Solid) -> float:
    worst = 0.0
    for face in solid.faces:
        corners = solid.vertices[list(face)]
        normal = area_vector(corners)
        heights = (corners - corners.mean(axis=0)) @ (normal / np.linalg.norm(normal))
        worst = max(worst, float(np.abs(heights).max()))
    return worst


def _moved(before: Solid, after: Solid) -> Array:
    """Distance of each corner of a stone before from the nearest corner after [m]."""
    return np.linalg.norm(before.vertices[:, None] - after.vertices[None], axis=2).min(axis=1)


def _misreported(closed: ClosedStones, before: Sequence[Solid]) -> float:
    """By how much a corner moved farther than the largest displacement that is reported for its stone."""
    told = closed.report.displacement
    return max(
        float(_moved(b, a).max() - np.max(told[a.code], initial=0.0))
        for b, a in zip(before, closed.solids, strict=True)
    )
