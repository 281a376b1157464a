"""Proposals of unseen stones: missing ones and the core of walls, from the database and optionally recorded in it."""

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.database.session import open_database
from archmodel.query.api import find
from archmodel.store.hypotheses import store_hypotheses
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stones import load_stones
from archmodel.tables.entities import Entity, Infill, Joint, RibSegment, Support, WebStone
from archmodel.tables.hierarchy import names_below
from ground.errors import UsageError
from mechanics.arrays import Array
from pipelines.ingest.records import stone_record, surveyed_block
from pipelines.ingest.relate import relate
from survey.conventions import FARTHEST, PER_MILLE
from survey.extrusion.imported_solids import block_of_solid
from survey.faces.faces import Provenance
from survey.geometry.solids import Solid, volume_of
from survey.geometry.watertight import triangulate
from survey.joints.close import close_joints
from survey.records.survey import SolidRecord
from survey.unseen.core.facings import facing_stone
from survey.unseen.core.propose import InfillProposal, propose_infill
from survey.unseen.core.settings import InfillSettings
from survey.unseen.missing.propose import propose_missing
from survey.unseen.missing.settings import MissingSettings

_PROPOSAL_DIFFERENCE = (
    PER_MILLE  # largest difference of equal proposals, in position [m] and relative volume [-]
)

_SIZE = ("code", "kind", "course", "zone", "length", "height", "depth")
# kinds that are no stones, and those of vaults, which stand in no facing; their subkinds, too
_NO_STONES = (Infill, Joint, Support)
_OF_VAULTS = (RibSegment, WebStone)

Facings = tuple[str, str]
"""Expressions for the stones of the two facings of a wall."""


@dataclass(frozen=True)
class Recording:
    """Provenance of proposals that are recorded.

    Attributes
    ----------
    author : person responsible for them; None if unknown
    source : grounds; None: those of the proposals themselves
    """

    author: str | None = None
    source: str | None = None


@dataclass(frozen=True)
class Proposal:
    """Hypothetical stone, or part of the core.

    Attributes
    ----------
    code, kind, course, zone : as of any entity
    length, height, depth, volume : its size [m], [m³]
    outline : (nv, 3) corners of its face [m]
    evidence : its grounds, in words
    depth_source : grounds of its depth
    notes : reservations
    """

    code: str
    kind: str
    course: int | None
    zone: str | None
    length: float
    height: float
    depth: float
    volume: float
    outline: tuple[tuple[float, float, float], ...]
    evidence: str
    depth_source: str
    notes: tuple[str, ...]


@dataclass(frozen=True)
class ProposalReport:
    """Proposals, and what was recorded of them.

    Attributes
    ----------
    what : "missing" or "infill"
    stones : number of stones considered
    proposals : in order, without those already in the database
    entry : number of the act of recording; None if nothing was recorded
    related : number of the act in which relations were computed; None if none changed
    """

    what: str
    stones: int
    proposals: tuple[Proposal, ...]
    entry: int | None
    related: int | None


def propose_stones(
    url: str,
    where: Sequence[str] = (),
    recording: Recording | None = None,
) -> ProposalReport:
    """Propose the stones that are missing in the survey.

    Parameters
    ----------
    url : of the database
    where : expressions; only stones between two that satisfy all of them are proposed
    recording : record the proposals; None: change nothing
    """
    settings = MissingSettings()
    with (
        open_database(url, create=False) as database,
        database.session(read_only=recording is None) as session,
    ):
        records = _stones(session, ())
        chosen = {record.code for record in _stones(session, where)} if where else None
        blocks = [surveyed_block(record) for record in records]
        missing = propose_missing(blocks, settings, taken=_codes(session))
        kept = _beside(chosen, [(stone.block.code, stone.beside) for stone in missing])
        pairs = [(stone_record(stone.block), stone.notes) for stone in missing if stone.block.code in kept]
        return _report("missing", session, len(records), pairs, asdict(settings), recording)


def propose_core(
    url: str,
    where: Sequence[str] = (),
    settings: InfillSettings | None = None,
    recording: Recording | None = None,
    *,
    facings: Facings | None = None,
) -> ProposalReport:
    """Propose the core of walls with two facings.

    Parameters
    ----------
    url : of the database
    where : expressions; only stones that satisfy all of them count
    settings : shape of the core, and limits for recognising facings
    recording : record the proposals; None: change nothing
    facings : two facings of one wall; None: recognise them

    Raises
    ------
    UsageError
        if an expression for a facing names no stone, or a stone is in both
    """
    settings = settings or InfillSettings()
    with (
        open_database(url, create=False) as database,
        database.session(read_only=recording is None) as session,
    ):
        records = _stones(session, where)
        blocks = [surveyed_block(record) for record in records]
        closed = close_joints(blocks).solids
        vaults = names_below(*_OF_VAULTS)
        stones = [
            facing_stone(block, solid)
            for block, solid in zip(blocks, closed, strict=True)
            if block.kind not in vaults
        ]
        named = None if facings is None else _named(session, where, facings)
        infill_proposals = propose_infill(stones, settings, facings=named, taken=_codes(session))
        measured = _measured(session, find(session, "infill"))
        new = [proposal for proposal in infill_proposals if not _is_known(proposal, measured)]
        pairs: list[tuple[StoneRecord, tuple[str, ...]]] = [(core_record(proposal), ()) for proposal in new]
        given = {**asdict(settings), "facings": None if facings is None else list(facings)}
        return _report("infill", session, len(records), pairs, given, recording)


def _stones(session: Session, where: Sequence[str]) -> list[StoneRecord]:
    """Load the measured stones, including hypotheses, without the core."""
    found, without = find(session, "entity", where), names_below(*_NO_STONES)
    return _measured(session, [entity for entity in found if entity.kind not in without])


def _measured(session: Session, entities: Sequence[Entity]) -> list[StoneRecord]:
    return load_stones(session, [entity for entity in entities if entity.volume is not None])


def _codes(session: Session) -> set[str]:
    return set(session.scalars(select(Entity.code)))


def _named(session: Session, where: Sequence[str], facings: Facings) -> tuple[set[str], set[str]]:
    """Find the codes of the stones of two facings."""
    codes = []
    for expression in facings:
        some = {record.code for record in _stones(session, [*where, expression])}
        if not some:
            raise UsageError(
                f"no stone satisfies {expression!r}", where="--facings", remedy="try it with: moma query"
            )
        codes.append(some)
    return codes[0], codes[1]


def _beside(chosen: Collection[str] | None, found: Sequence[tuple[str, tuple[str, str]]]) -> set[str]:
    """Find the codes of the proposals between two chosen stones, or beside such proposals."""
    codes: set[str] = set()
    for code, beside in found:
        if chosen is None or all(code in chosen or code in codes for code in beside):
            codes.add(code)
    return codes


def _report(
    what: str,
    session: Session,
    stones: int,
    pairs: Sequence[tuple[StoneRecord, tuple[str, ...]]],
    settings: dict[str, object],
    recording: Recording | None,
) -> ProposalReport:
    entry = related = None
    if recording is not None and pairs:
        name = f"moma propose {what}"
        made, numbers = store_hypotheses(
            session,
            name,
            [record for record, _ in pairs],
            recording.source or f"{name}: each stone says on what it rests",
            author=recording.author,
            settings=settings,
        )
        entry = made.id
        related = relate(session, only=numbers).entry
    return ProposalReport(what, stones, tuple(_proposal(*pair) for pair in pairs), entry, related)


def _proposal(record: StoneRecord, notes: tuple[str, ...]) -> Proposal:
    return Proposal(
        **{name: getattr(record, name) for name in _SIZE},
        volume=volume_of(Solid(record.code, record.solid_vertices, record.solid_faces)),
        outline=tuple((x, y, z) for x, y, z in record.outline.tolist()),
        evidence=record.provenance_text,
        depth_source=record.depth_source,
        notes=notes,
    )


def core_record(proposal: InfillProposal) -> StoneRecord:
    """Make the record of a part of the core: kind infill, its face being the side towards the first facing."""
    solid = proposal.solid
    record = SolidRecord(proposal.code, "infill", proposal.course, solid.vertices, solid.faces)
    viewpoint = solid.vertices.mean(axis=0) + FARTHEST * proposal.normal
    block = block_of_solid(record, viewpoint, "the proposal")
    face = replace(block.face, provenance=Provenance("hypothesis", proposal.evidence))
    depth = replace(block.depth, source=f"hypothesis: {proposal.evidence}")
    return stone_record(replace(block, face=face, depth=depth))


def _is_known(proposal: InfillProposal, known_records: Sequence[StoneRecord]) -> bool:
    """Return True if a part of the core is already in the database, or another part shares its middle."""
    middle = proposal.solid.vertices.mean(axis=0)
    low, high = proposal.solid.vertices.min(axis=0), proposal.solid.vertices.max(axis=0)
    for record in known_records:
        corners = record.solid_vertices
        if (corners.min(axis=0) >= high).any() or (corners.max(axis=0) <= low).any():
            continue
        solid = Solid(record.code, corners, record.solid_faces)
        near = float(np.abs(corners.mean(axis=0) - middle).max()) < _PROPOSAL_DIFFERENCE
        if near and abs(volume_of(solid) / proposal.volume - 1.0) < _PROPOSAL_DIFFERENCE:
            return True
        if _contains(solid, middle) or _contains(proposal.solid, corners.mean(axis=0)):
            return True
    return False


def _contains(solid: Solid, point: Array) -> bool:
    """Test a point for being in a closed solid, by the solid angle of its faces: 4π inside, 0 outside."""
    if (point < solid.vertices.min(axis=0)).any() or (point > solid.vertices.max(axis=0)).any():
        return False
    a, b, c = np.moveaxis(solid.vertices[triangulate(solid)] - point, 1, 0)
    la, lb, lc = (np.linalg.norm(vectors, axis=1) for vectors in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=1)
    scale = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    return abs(2.0 * float(np.arctan2(volume, scale).sum())) > 2.0 * np.pi
