"""Records of proposed parts of the core of a wall."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from archmodel.store.stone_record import StoneRecord
from pipelines.arrays import Array
from pipelines.ingest.records import stone_record
from survey.extrusion.imported_solids import block_of_solid
from survey.faces.faces import Provenance
from survey.geometry.solids import Solid, volume_of
from survey.geometry.watertight import triangulate
from survey.records.survey import SolidRecord
from survey.unseen.core.propose import InfillProposal

__all__ = ["core_record", "is_known", "record_volume"]


_FAR = 1000.0  # distance of the viewpoint in front of the wall [m], large enough to see it squarely
_SAME = 1e-3  # largest difference of equal proposals, in position [m] and relative volume [-]


def core_record(proposal: InfillProposal) -> StoneRecord:
    """Make the record of a part of the core: kind infill, its face being the side towards the first facing."""
    solid = proposal.solid
    record = SolidRecord(proposal.code, "infill", proposal.course, solid.vertices, solid.faces)
    viewpoint = solid.vertices.mean(axis=0) + _FAR * proposal.normal
    block = block_of_solid(record, viewpoint, "the proposal")
    face = replace(block.face, provenance=Provenance("hypothesis", proposal.evidence))
    depth = replace(block.depth, source=f"hypothesis: {proposal.evidence}")
    return stone_record(replace(block, face=face, depth=depth))


def record_volume(record: StoneRecord) -> float:
    """Compute the volume of a recorded stone [m³]."""
    return volume_of(Solid(record.code, record.solid_vertices, record.solid_faces))


def is_known(proposal: InfillProposal, known: Sequence[StoneRecord]) -> bool:
    """Return True if a part of the core is already in the database, or another part shares its middle."""
    middle = proposal.solid.vertices.mean(axis=0)
    low, high = proposal.solid.vertices.min(axis=0), proposal.solid.vertices.max(axis=0)
    for record in known:
        corners = record.solid_vertices
        if (corners.min(axis=0) >= high).any() or (corners.max(axis=0) <= low).any():
            continue
        other = Solid(record.code, corners, record.solid_faces)
        near = float(np.abs(corners.mean(axis=0) - middle).max()) < _SAME
        if near and abs(volume_of(other) / proposal.volume - 1.0) < _SAME:
            return True
        if _contains(other, middle) or _contains(proposal.solid, corners.mean(axis=0)):
            return True
    return False


def _contains(solid: Solid, point: Array) -> bool:
    """Test a point for being in a closed solid, by the solid angle of its faces: 4π inside, 0 outside."""
    if (point < solid.vertices.min(axis=0)).any() or (point > solid.vertices.max(axis=0)).any():
        return False
    a, b, c = np.moveaxis(solid.vertices[triangulate(solid)] - point, 1, 0)
    la, lb, lc = (np.linalg.norm(one, axis=1) for one in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=1)
    scale = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    return abs(2.0 * float(np.arctan2(volume, scale).sum())) > 2.0 * np.pi
