"""Report of what fills the joints: mortar into which stones grow, openings that stay, and the weight that is added."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from pipelines.run.assemble import Assembly
from pipelines.scene.file import SceneFile
from survey.conventions import LISTED
from survey.geometry.solids import Solid, volume_of
from survey.joints.grown_leaf import GrownLeaf, Opening
from survey.joints.report import StoneJoint

_SURROUNDED = 3  # sides of the frame that an opening about the wall reaches
_REACHED = {"left": "the left side", "below": "the foot", "right": "the right side", "above": "the top"}
_CHANGED = 5e-4  # share of the volume below which a change rounds to nothing in words [-]


@dataclass(frozen=True)
class OpeningPlace:
    """A place of a leaf that mortar does not fill, as it is too far from every stone.

    Attributes
    ----------
    width, height : of its box [m]
    area : [m²]
    across, up : of the lower left corner of its box from that of the leaf [m]
    place : (x, y, z) of its middle [m]
    stones : codes of those beside it
    sides : of the leaf that it reaches: "left", "below", "right" or "above"
    """

    width: float
    height: float
    area: float
    across: float
    up: float
    place: tuple[float, float, float]
    stones: tuple[str, ...]
    sides: tuple[str, ...]

    def in_words(self) -> str:
        """Return its size and place in words."""
        size, place = (self.width, self.height), (self.across, self.up)
        size_and_place = (
            f"{_lengths(*size, ' × ')}, at {_lengths(*place, ' and ')} from the lower left corner"
        )
        if len(self.sides) >= _SURROUNDED:
            return f"{size_and_place} and about the wall (crop the picture to it)"
        sides = " and ".join(_REACHED[side] for side in self.sides)
        return f"{size_and_place}, up to {sides}" if sides else size_and_place


@dataclass(frozen=True)
class LeafReport:
    """Rubble of one leaf, whose stones grew to the middle of the mortar between their outlines.

    Attributes
    ----------
    stones : their number
    width, height : of the leaf with its mortar [m]
    stone_share : area of the outlines over that of the leaf [-]
    pairs, edges : pairs of neighbours, and straight edges between them
    thickness : of the mortar between two stones: mean of all, weighted by the lengths of the joints [m]
    thinnest, thickest : smallest and largest mean thickness between two stones [m]
    growth : largest distance of a corner of a grown stone from its outline [m], of the stone `farthest`
    crossing : pairs of stones whose outlines touch or cross
    open_share : area of the openings over that of the leaf [-]
    filled : width up to which mortar is filled in [m]
    openings : at least as large as a usual outline, the largest first
    pockets : smaller ones, likewise
    """

    stones: int
    width: float
    height: float
    stone_share: float
    pairs: int
    edges: int
    thickness: float
    thinnest: float
    thickest: float
    growth: float
    farthest: str
    crossing: tuple[tuple[str, str], ...]
    open_share: float = 0.0
    filled: float = np.inf
    openings: tuple[OpeningPlace, ...] = ()
    pockets: tuple[OpeningPlace, ...] = ()

    def in_words(self) -> tuple[str, ...]:
        """Return the report as lines for a person."""
        share, free = 100.0 * self.stone_share, 100.0 * self.open_share
        opened = f", {free:.1f} % open" if self.openings or self.pockets else ""
        lines = [
            f"leaf of {self.stones} stones, {self.width:.3f} × {self.height:.3f} m: {share:.1f} % stone, "
            f"{100.0 - share - free:.1f} % mortar{opened}",
            f"mortar between {self.pairs} pairs of stones, in {self.edges} straight edges: "
            f"{1e3 * self.thickness:.1f} mm thick on average, {1e3 * self.thinnest:.1f} to "
            f"{1e3 * self.thickest:.1f} mm; stones grew by {1e3 * self.growth:.1f} mm at most (stone {self.farthest})",
        ]
        if self.crossing:
            pairs = ", ".join(" and ".join(pair) for pair in self.crossing[:LISTED])
            more = ", …" if len(self.crossing) > LISTED else ""
            lines.append(
                f"{len(self.crossing)} pairs of outlines touch or cross: {pairs}{more}; look at them"
            )
        return (*lines, *self.open_in_words())

    def open_in_words(self) -> tuple[str, ...]:
        """Return what stays open as lines for a person."""
        lines = [f"an opening stays open: {opening.in_words()}" for opening in self.openings[:LISTED]]
        if len(self.openings) > LISTED:
            rest = self.openings[LISTED:]
            lines.append(
                f"{len(rest)} more openings, {sum(opening.area for opening in rest):.3g} m² in all, stay open"
            )
        if self.pockets:
            area = sum(pocket.area for pocket in self.pockets)
            lines.append(
                f"{len(self.pockets)} pockets smaller than a usual stone, {area:.2g} m² in all, stay open; the "
                f"largest: {self.pockets[0].in_words()}"
            )
        if lines:
            lines[-1] += (
                f"; mortar fills what is up to {1e3 * self.filled:.0f} mm wide (max_width in [joints])"
            )
        return tuple(lines)


def leaf_report(leaf: GrownLeaf, joints: Sequence[StoneJoint], origin: Array) -> LeafReport:
    """Summarise a leaf and what stays open in it, whose positions are relative to `origin` (3,) [m]."""
    leaf_joints = [joint for joint in joints if all(code in leaf.grown for code in joint.stones)]
    pairs = [value for stones, value in leaf.thickness.items() if len(stones) > 1]
    areas = np.array([leaf_joint.area for leaf_joint in leaf_joints])
    mean = (
        float(np.average([leaf_joint.width for leaf_joint in leaf_joints], weights=areas))
        if len(leaf_joints)
        else 0.0
    )
    usual = leaf.usual_area
    return LeafReport(
        stones=len(leaf.grown),
        width=leaf.size[0],
        height=leaf.size[1],
        stone_share=leaf.stones_over_all,
        pairs=len(pairs),
        edges=leaf.edges,
        thickness=mean,
        thinnest=min(pairs, default=0.0),
        thickest=max(pairs, default=0.0),
        growth=leaf.growth,
        farthest=leaf.farthest,
        crossing=leaf.crossing,
        open_share=leaf.open_over_all,
        filled=leaf.filled,
        openings=tuple(_opening(opening, origin) for opening in leaf.openings if opening.area >= usual),
        pockets=tuple(_opening(opening, origin) for opening in leaf.openings if opening.area < usual),
    )


def stays_open(assembly: Assembly) -> tuple[str, ...]:
    """Return the openings and pockets of the leaves of a scene as lines for a person."""
    closing = assembly.closing
    reports = (leaf_report(leaf, closing.joints, assembly.origin) for leaf in closing.leaves)
    return tuple(line for report in reports for line in report.open_in_words())


def _lengths(first: float, second: float, between: str) -> str:
    return f"{first:.2f}{between}{second:.2f} m"


def _opening(opening: Opening, origin: Array) -> OpeningPlace:
    (width, height), (across, up) = opening.size, opening.low.tolist()
    x, y, z = (opening.front.mean(axis=(0, 1)) + origin).tolist()
    return OpeningPlace(width, height, opening.area, across, up, (x, y, z), opening.stones, opening.sides)


@dataclass(frozen=True)
class Filling:
    """Volume and weight of all stones as surveyed, and as they are modelled with closed joints.

    Attributes
    ----------
    surveyed, modelled : volume [m³]
    surveyed_weight, modelled_weight : of these, the surveyed one with the stones' density [N]
    mortar_density : of the mortar into which stones grew, if it is stated [kg/m³]
    """

    surveyed: float
    modelled: float
    surveyed_weight: float
    modelled_weight: float
    mortar_density: float | None

    def in_words(self) -> str:
        """Return it as a line for a person."""
        change, weight = (
            self.modelled / self.surveyed - 1.0,
            self.modelled_weight / self.surveyed_weight - 1.0,
        )
        if abs(change) < _CHANGED and abs(weight) < _CHANGED:
            return f"stones fill {self.modelled:.4g} m³ as surveyed, and weigh {1e-3 * self.modelled_weight:.4g} kN"
        if self.mortar_density is not None:
            why = f"stones take in mortar of {self.mortar_density:g} kg/m³"
        else:
            why = "joints are filled with stone" if change > 0.0 else "joints take of the stones"
        return (
            f"stones fill {self.modelled:.4g} m³ for {self.surveyed:.4g} m³ as surveyed ({100.0 * change:+.1f} %), and "
            f"weigh {1e-3 * self.modelled_weight:.4g} kN for {1e-3 * self.surveyed_weight:.4g} kN "
            f"({100.0 * weight:+.1f} %): {why}"
        )


def filling(scene: SceneFile, assembly: Assembly) -> Filling:
    """Return how much volume and weight closing the joints of a scene adds to its stones."""
    records = [model.record for model in assembly.models]
    density = np.array([model.material.density for model in assembly.models])
    before = np.array(
        [volume_of(Solid(record.code, record.solid_vertices, record.solid_faces)) for record in records]
    )
    blocks = assembly.scene.blocks
    after = np.array([volume_of(Solid(block.code, block.vertices, block.faces)) for block in blocks])
    gravity = float(np.linalg.norm(scene.gravity))
    return Filling(
        surveyed=float(before.sum()),
        modelled=float(after.sum()),
        surveyed_weight=gravity * float(density @ before),
        modelled_weight=gravity * float(np.array([block.material.density for block in blocks]) @ after),
        mortar_density=scene.joints.mortar_density if assembly.closing.leaves else None,
    )
