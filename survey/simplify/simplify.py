"""Simplification of a surveyed stone to the simplest solid true to it, with a report of the changes.

A stone whose face was measured becomes a hexahedron if its face has four sides (`survey.simplify.squaring`), a wedge
if it has three, a prism if it has more. An imported solid becomes one of these if its faces are so within rounding
(`survey.simplify.flattening`). Any other stone stays as surveyed, with the reason.
"""

from dataclasses import dataclass

from survey.arrays import Bools
from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import SurveyedBlock
from survey.faces.faces import Face
from survey.geometry.solids import Solid
from survey.records.survey import Extrusion
from survey.simplify.from_imported_solid import simplify_solid
from survey.simplify.from_measured_face import simplify_face
from survey.simplify.result import BlockShape, Simplified
from survey.simplify.squaring import SimplifyBounds

_BOUNDS = SimplifyBounds()


@dataclass(frozen=True)
class BlockyStone:
    """A stone as the simplest solid that is true to it.

    Attributes
    ----------
    code, kind, course : as in the survey
    face : measured face on which it is based
    depth : its depth, with the evidence
    extrusion : construction of its hidden side
    solid : closed, with planar faces. A hexahedron, wedge or prism has the visible corners first, counter-clockwise
        seen from outside, then the hidden ones in the same order
    sound : (n,) whether the place of each visible corner of the solid, or of each corner of an imported POLYHEDRON, is
        known: measured, or restored; False: worn, and left where it was measured
    shape : shape of the solid
    report : changes
    """

    code: str
    kind: str
    course: int | None
    face: Face
    depth: Depth
    extrusion: Extrusion
    solid: Solid
    sound: Bools
    shape: BlockShape
    report: Simplified


def simplify(block: SurveyedBlock, bounds: SimplifyBounds = _BOUNDS) -> BlockyStone:
    """Make the simplest solid true to a surveyed block.

    Parameters
    ----------
    block : a stone with its measured face of three or more corners, or with an imported solid
    bounds : largest changes

    Returns
    -------
    BlockyStone. Its solid is closed, with planar faces, and convex except for a POLYHEDRON; one that needs no change
    is that of the block. The first visible corner is the one nearest to the first of the face.

    Raises
    ------
    GeometryError
        if the stone is flat: its face has fewer than three corners that stand out, or nothing lies behind it
    """
    measured = block.face.provenance.source in ("points", "photograph")
    simple = simplify_face(block, bounds) if measured else simplify_solid(block, bounds)
    return BlockyStone(
        code=block.code,
        kind=block.kind,
        course=block.course,
        face=block.face,
        depth=block.depth,
        extrusion=block.extrusion,
        solid=simple.solid,
        sound=simple.sound,
        shape=simple.shape,
        report=simple.report,
    )
