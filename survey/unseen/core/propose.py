"""Proposals for the core between the two facings of a wall, from the hidden sides of the stones.

The stones of both facings are known with their depths; the space between their hidden sides is core. It is made of
convex blocks, cut at the joints of both facings (`survey.unseen.core.blocks`), or of one continuum for each storey
(`survey.unseen.core.storeys`). Stones that go through the wall, and headers whose tails meet, have no core behind
them; nor has an opening, or a hole where a stone is missing.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from ground.errors import UsageError
from survey.arrays import Array
from survey.geometry.solids import Solid, volume_of
from survey.unseen.core.blocks import core_blocks
from survey.unseen.core.facings import FacingStone, FacingWall, find_walls, wall_between
from survey.unseen.core.settings import InfillSettings, InfillShape
from survey.unseen.core.storeys import core_storeys


@dataclass(frozen=True)
class InfillProposal:
    """An unseen part of the core of a wall.

    Attributes
    ----------
    code : its name, e.g. I1-05-03: third block of course 5 of wall 1; or I1-S2: second storey of wall 1
    solid : closed; convex if it is a block
    course : number of the course of a block; None if it belongs to none, or for a storey
    normal : (3,) of the first facing, towards the observer [-]
    volume : [m³]
    evidence : evidence, in words
    """

    code: str
    solid: Solid
    course: int | None
    normal: Array
    volume: float
    evidence: str


def propose_infill(
    stones: Sequence[FacingStone],
    settings: InfillSettings | None = None,
    *,
    facings: tuple[Collection[str], Collection[str]] | None = None,
    taken: Collection[str] = (),
) -> tuple[InfillProposal, ...]:
    """Propose the core of all walls with two facings.

    Parameters
    ----------
    stones : with the solids that the core meets
    settings : make of the core, and tolerances
    facings : codes of the stones of the two facings of one wall; None: facings are detected
    taken : codes that proposals must not have

    Returns
    -------
    Proposals, wall by wall from below

    Raises
    ------
    GeometryError
        if given facings do not face opposite ways
    UsageError
        if one of them is empty, or a stone is in both
    """
    settings = settings or InfillSettings()
    walls = find_walls(stones, settings) if facings is None else (_given(stones, facings),)
    proposals: list[InfillProposal] = []
    number = 0
    for wall in walls:
        number += 1
        while any(code.startswith(f"I{number}-") for code in taken):
            number += 1
        make = _blocks if settings.shape is InfillShape.BLOCKS else _storeys
        proposals += make(wall, f"I{number}", settings)
    return tuple(proposals)


def _given(stones: Sequence[FacingStone], facings: tuple[Collection[str], Collection[str]]) -> FacingWall:
    first, second = (set(codes) for codes in facings)
    if first & second:
        raise UsageError(
            f"stone {min(first & second)} is in both facings", remedy="name each stone in one facing only"
        )
    front, back = ([stone for stone in stones if stone.code in codes] for codes in (first, second))
    if not front or not back:
        raise UsageError("a facing has no stones", remedy="name stones of both sides of the wall")
    return wall_between(front, back)


def _blocks(wall: FacingWall, name: str, settings: InfillSettings) -> list[InfillProposal]:
    count: dict[int | None, int] = {}
    proposals = []
    for block in core_blocks(wall, settings):
        count[block.course] = count.get(block.course, 0) + 1
        course = "00" if block.course is None else f"{block.course:02d}"
        front, back = block.between
        text = f"core between the hidden sides of {front} and {back}, which follow from their depths"
        code = f"{name}-{course}-{count[block.course]:02d}"
        proposals.append(_proposal(code, block.solid, block.course, wall, text))
    return proposals


def _storeys(wall: FacingWall, name: str, settings: InfillSettings) -> list[InfillProposal]:
    storeys = core_storeys(wall, settings)
    proposals = []
    for k, storey in enumerate(storeys):
        before = sum(earlier.number == storey.number for earlier in storeys[:k])
        code = f"{name}-S{storey.number}" + (f"-{before + 1}" if before else "")
        where = "" if storey.courses is None else f" of courses {storey.courses[0]} to {storey.courses[1]}"
        text = (
            f"core between the hidden sides{where} of {len(wall.front)} and {len(wall.back)} stones of two facings, "
            f"which follow from their depths; depths within {settings.level * 1e3:.0f} mm are taken as one"
        )
        proposals.append(_proposal(code, storey.solid, None, wall, text))
    return proposals


def _proposal(code: str, local: Solid, course: int | None, wall: FacingWall, text: str) -> InfillProposal:
    """Convert a solid from the wall's frame to that of the site."""
    vertices = wall.frame.origin + local.vertices @ wall.frame.axes
    solid = Solid(code, vertices, local.faces)
    return InfillProposal(code, solid, course, wall.frame.axes[2], volume_of(local), text)
