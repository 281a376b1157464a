"""Proposals for missing stones of a surveyed wall, from their neighbours.

A hole is a gap between two neighbours of a course that is wider than a joint, with stones, or the ground, below
and stones above; in an arch, an angle between two voussoirs wider than any joint. Openings stay open: gaps framed by
two jambs, a jamb and a sill or the like, gaps several courses high, and gaps that would take many stones. The end of
a wall and its top give no evidence of missing stones.
"""

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.conventions import BROKEN, JOINT, ROUNDS, WIDEST_JOINT
from survey.extrusion.extrusion import SurveyedBlock
from survey.geometry.solids import area_vector
from survey.unseen.missing.arches import ArchGap, arch_gaps, voussoir_outlines
from survey.unseen.missing.faces import MissingFace, is_plausible, stone_of
from survey.unseen.missing.gaps import CourseGap, Gaps, Hole, find_gaps, find_holes, opening_signs
from survey.unseen.missing.kinds import Filling, UsualKind, depth_of_kind, likeliest, split, usual_kinds
from survey.unseen.missing.openings import FrameGap, frame_gaps
from survey.unseen.missing.settings import MissingSettings
from survey.unseen.missing.sides import Elevation, FlatStone, Line, elevations, meeting

_LEFT, _RIGHT, _UPRIGHT = np.array([-1.0, 0.0]), np.array([1.0, 0.0]), np.array([0.0, 1.0])
_SCATTER = 0.003  # metres: standard deviation of a stone's end about the middle of its joint
_TALL = WIDEST_JOINT  # metres: distance of ends of gaps of two courses below which they belong to one stone
_BEHIND = WIDEST_JOINT  # metres: depth behind the face at which stones seen from elsewhere are compared
_SPLIT_SIGMA = BROKEN  # metres: standard deviation of the joint between two missing stones


@dataclass(frozen=True)
class MissingStone:
    """A missing stone of a survey, as it probably is.

    Attributes
    ----------
    block : the stone; its face's provenance is "hypothesis", with the evidence
    beside : codes of the stones, or proposals, to its left and right
    notes : reasons for less certainty, in words
    """

    block: SurveyedBlock
    beside: tuple[str, str]
    notes: tuple[str, ...]

    @property
    def evidence(self) -> str:
        """Evidence for the stone, in words."""
        return self.block.face.provenance.text


class _FreeCodes:
    """Supply of free codes.

    Parameters
    ----------
    taken : codes of stones; codes handed out are added
    """

    def __init__(self, taken: set[str]) -> None:
        self._taken = taken

    def after(self, left: str, right: str) -> str:
        """Return H- and the code of a stone between two others: the next free number after the left one."""
        left, right = left.removeprefix("H-"), right.removeprefix("H-")
        for code, step in ((left, 1), (right, -1)):
            number = re.search(r"\d+$", code)
            if number is None:
                continue
            name = f"{code[: number.start()]}{int(number[0]) + step:0{len(number[0])}d}"
            if int(number[0]) + step >= 0 and not {name, f"H-{name}"} & self._taken:
                return self._take(f"H-{name}")
        count = 1
        while f"H-{left}+{count}" in self._taken:
            count += 1
        return self._take(f"H-{left}+{count}")

    def _take(self, code: str) -> str:
        self._taken.add(code)
        return code


def propose_missing(
    blocks: Sequence[SurveyedBlock],
    settings: MissingSettings | None = None,
    *,
    taken: Collection[str] = (),
) -> tuple[MissingStone, ...]:
    """Propose the missing stones of all facades of a survey.

    Parameters
    ----------
    blocks : all known stones
    settings : criteria of holes and openings
    taken : codes, besides those of the stones, that proposals must not have

    Returns
    -------
    Proposals, facade by facade: the voussoirs first, then course by course from below
    """
    settings = settings or MissingSettings()
    codes = _FreeCodes({*taken, *(block.code for block in blocks)})
    missing: list[MissingStone] = []
    for elevation in elevations(blocks):
        mine = {id(stone.block) for stone in elevation.stones}
        others = [block for block in blocks if id(block) not in mine]
        # the space beside a missing jamb is a hole of its own once the jamb is there
        for _ in range(ROUNDS):
            new = []
            for propose in (_voussoirs, _of_courses):
                proposed = list(propose(elevation, settings, codes))
                new += [stone for stone in proposed if not _is_there(stone.block, others)]
                flat = [_flat(stone.block, elevation) for stone in proposed]
                elevation = Elevation(elevation.frame, (*elevation.stones, *flat))
            missing += new
            if not new:
                break
    return tuple(missing)


def _is_there(proposal: SurveyedBlock, others: Sequence[SurveyedBlock]) -> bool:
    """Return whether another stone, seen from elsewhere, reaches through the wall to the middle of the proposal."""
    outline = proposal.face.outline
    middle = outline.mean(axis=0) - _BEHIND * proposal.face.fit.normal
    places = np.concatenate([[middle], 0.5 * (middle + outline - _BEHIND * proposal.face.fit.normal)])
    for stone in others:
        corners = stone.solid.vertices
        if (corners.min(axis=0) <= middle).all() and (middle <= corners.max(axis=0)).all():
            polygons = [corners[list(face)] for face in stone.solid.faces]
            inside = [((places - polygon.mean(axis=0)) @ area_vector(polygon) <= 0.0) for polygon in polygons]
            if 2 * int(np.all(inside, axis=0).sum()) > len(places):
                return True
    return False


def _flat(block: SurveyedBlock, elevation: Elevation) -> FlatStone:
    return FlatStone(block, elevation.frame.flatten(block.face.outline), frozenset())


def _voussoirs(elevation: Elevation, settings: MissingSettings, codes: _FreeCodes) -> Iterator[MissingStone]:
    gaps = arch_gaps(elevation, settings)
    joint = _usual_joint(find_gaps(elevation, settings)) if gaps else JOINT
    for gap in gaps:
        left, right = gap.left.block.code, gap.right.block.code
        before = left
        outlines = voussoir_outlines(gap, joint)
        there = any(
            stone.contains(outline.mean(axis=0)) for outline in outlines for stone in elevation.stones
        )
        if there or not all(map(is_plausible, outlines)):
            continue
        for k, outline in enumerate(outlines):
            kind = "keystone" if k == gap.keystone else "voussoir"
            depth = depth_of_kind("voussoir", (gap.left, gap.right), elevation, None)
            angle = float(np.degrees(gap.sides[1].angle - gap.sides[0].angle))
            evidence = (
                f"gap of {angle:.1f}° in an arch between {left} and {right}, whose voussoirs take "
                f"{np.degrees(gap.usual):.1f}°; intrados and extrados from theirs, joints of {joint * 1e3:.0f} mm"
            )
            code = codes.after(before, right)
            sigma, along = _sigma(gap.left, gap.right), _SPLIT_SIGMA if gap.count > 1 else 0.0
            face = MissingFace(
                code,
                kind,
                None,
                gap.left.block.face.record.zone,
                outline,
                (gap.left, gap.right),
                depth,
                sigma,
                along,
                evidence,
            )
            beside = (before, right)
            notes = _arch_notes(gap, k)
            before = code
            yield MissingStone(stone_of(face, elevation), beside, notes)


def _arch_notes(gap: ArchGap, number: int) -> tuple[str, ...]:
    notes = []
    if gap.count > 1:
        notes.append(f"one of {gap.count} in the gap: their joints are thought to be evenly spaced")
    if number == gap.keystone:
        notes.append("at the crown of an arch without a keystone, taken for one")
    return tuple(notes)


def _usual_joint(gaps: Gaps) -> float:
    return float(np.median(gaps.joints)) if len(gaps.joints) else JOINT


def _sigma(left: FlatStone, right: FlatStone) -> float:
    measured = max(stone.block.face.record.sigma for stone in (left, right))
    return float(np.hypot(measured, _SCATTER))


def _of_courses(elevation: Elevation, settings: MissingSettings, codes: _FreeCodes) -> Iterator[MissingStone]:
    gaps = find_gaps(elevation, settings)
    joint, kinds = _usual_joint(gaps), usual_kinds(elevation)
    for hole in find_holes(gaps.gaps):
        signs = opening_signs(hole, elevation)
        for frame in frame_gaps(hole, signs, elevation, settings):
            yield from _frame_stone(frame, joint, elevation, codes)
        if len(signs) >= 2 or hole.courses > settings.max_courses or hole.bounded < settings.covered:
            continue
        fillings = [likeliest(gap.width, joint, kinds, settings) for gap in hole.gaps]
        tall = _is_tall(hole)
        filled = [filling for filling in fillings if filling is not None]
        if (
            len(filled) < len(fillings)
            or sum(len(fill.kinds) for fill in filled) > settings.max_stones + tall
        ):
            continue
        pairs = list(zip(hole.gaps, filled, strict=True))
        for gap, filling in pairs[:1] if tall else pairs:
            if gap.width - 2.0 * joint >= settings.min_length:
                upper = hole.gaps[-1].upper if tall else gap.upper
                yield from _Fill(gap, filling, kinds, upper, joint, elevation, signs).stones(codes)


def _frame_stone(
    frame: FrameGap, joint: float, elevation: Elevation, codes: _FreeCodes
) -> Iterator[MissingStone]:
    """Propose a jamb that ends where the others do, or a sill."""
    gap = frame.gap
    beside = (gap.left, gap.right)
    sides = _sides(gap, gap.upper, joint)
    lines = [
        sides[k] if place is None else Line(np.array([place, 0.0]), _UPRIGHT)
        for k, place in enumerate((frame.start, frame.stop))
    ]
    outline = _quadrilateral(lines[0], lines[1], gap.lower, gap.upper)
    if not is_plausible(outline):
        return
    if frame.kind == "sill":
        evidence = f"gap of {gap.width:.3f} m under an opening, beyond its jambs on both sides"
    else:
        evidence = f"gap of {gap.width:.3f} m at an opening, beyond the line of its other jambs"
    names = (gap.left.block.code, gap.right.block.code)
    # a code next to that of the neighbour in the wall
    code = codes.after(*(names if frame.start is None else (names[1], names[0])))
    face = MissingFace(
        code,
        frame.kind,
        gap.course,
        gap.zone,
        outline,
        beside,
        depth_of_kind(frame.kind, beside, elevation, None),
        _sigma(*beside),
        0.0,
        f"{evidence}, in course {gap.course} between {names[0]} and {names[1]}",
    )
    yield MissingStone(stone_of(face, elevation), names, ())


def _sides(gap: CourseGap, upper: Line, joint: float) -> tuple[Line, Line]:
    """Return the sides of a stone in a gap: a joint away from its neighbours."""
    inside = np.array([gap.middle, 0.5 * (gap.lower.at_place(gap.middle) + upper.at_place(gap.middle))])
    left = gap.left.side(_RIGHT, _UPRIGHT) or Line(np.array([gap.start, inside[1]]), _UPRIGHT)
    right = gap.right.side(_LEFT, _UPRIGHT) or Line(np.array([gap.stop, inside[1]]), _UPRIGHT)
    return left.moved(inside, joint), right.moved(inside, joint)


def _quadrilateral(left: Line, right: Line, lower: Line, upper: Line) -> Array:
    """Return corners (4, 2), counter-clockwise from the lower left one."""
    pairs = ((left, lower), (right, lower), (right, upper), (left, upper))
    return np.array([meeting(first, second) for first, second in pairs])


def _is_tall(hole: Hole) -> bool:
    """Return whether two gaps above one another have the same ends: one stone, two courses high, is missing."""
    if len(hole.gaps) != 2 or hole.courses != 2:
        return False
    lower, upper = hole.gaps
    return abs(lower.start - upper.start) < _TALL and abs(lower.stop - upper.stop) < _TALL


@dataclass(frozen=True)
class _Fill:
    """A gap to be filled."""

    gap: CourseGap
    filling: Filling
    known: tuple[UsualKind, ...]
    upper: Line
    joint: float
    elevation: Elevation
    signs: tuple[str, ...]

    def stones(self, codes: _FreeCodes) -> Iterator[MissingStone]:
        """Yield the stones of the gap, from left to right."""
        gap, count = self.gap, len(self.filling.kinds)
        kinds, cuts = split(gap, self.filling, self.known, self.elevation)
        before, outlines = gap.left.block.code, list(self._outlines(cuts))
        if not all(map(is_plausible, outlines)):
            return
        for kind, outline in zip(kinds, outlines, strict=True):
            kind = self._kind(kind)
            code = codes.after(before, gap.right.block.code)
            names, before = (before, gap.right.block.code), code
            depth = depth_of_kind(kind, (gap.left, gap.right), self.elevation, gap.course)
            sigma, along = _sigma(gap.left, gap.right), _SPLIT_SIGMA if count > 1 else 0.0
            beside = (gap.left, gap.right)
            face = MissingFace(
                code, kind, gap.course, gap.zone, outline, beside, depth, sigma, along, self._evidence(kind)
            )
            yield MissingStone(stone_of(face, self.elevation), names, self._notes())

    def _kind(self, kind: str) -> str:
        """Return the kind by length; between a stone of an arch and one of the wall, a springer."""
        arch = [stone.block.kind in ("voussoir", "keystone") for stone in (self.gap.left, self.gap.right)]
        springers = any(stone.block.kind == "springer" for stone in self.elevation.stones)
        return "springer" if springers and any(arch) and not all(arch) else kind

    def _outlines(self, cuts: Sequence[float]) -> Iterator[Array]:
        first, last = _sides(self.gap, self.upper, self.joint)
        lines = [first]
        for cut in cuts:
            lines += [
                Line(np.array([cut + by, 0.0]), _UPRIGHT) for by in (-0.5 * self.joint, 0.5 * self.joint)
            ]
        lines.append(last)
        for line, next_line in zip(lines[::2], lines[1::2], strict=True):
            yield _quadrilateral(line, next_line, self.gap.lower, self.upper)

    def _evidence(self, kind: str) -> str:
        gap = self.gap
        return (
            f"gap of {gap.width:.3f} m in course {gap.course} between {gap.left.block.code} and "
            f"{gap.right.block.code}, with stones below and above; {kind} by its length "
            f"({self.filling.probability:.0%}); beds from its course, joints of {self.joint * 1e3:.0f} mm"
        )

    def _notes(self) -> tuple[str, ...]:
        notes = []
        if len(self.filling.kinds) > 1:
            notes.append(
                f"one of {len(self.filling.kinds)} in the gap: where they meet follows from usual lengths only"
            )
        if not self.filling.usual:
            notes.append("no stone of the facade is as long")
        if self.filling.probability < 0.8:
            notes.append("other stones are nearly as likely")
        if (self.gap.below == -2).all():
            notes.append("on the ground: it may be an opening")
        if self.signs:
            notes.append(f"beside {self.signs[0]}: it may be an opening")
        return tuple(notes)
