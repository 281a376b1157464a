"""Between the survey pillar's stones and the records that the database keeps of them."""

import numpy as np
from numpy.typing import NDArray

from archmodel.records import StoneRecord
from survey.depth import Depth
from survey.extrusion import SurveyedBlock, extrude
from survey.faces import Face, Provenance, face_on, outline_face
from survey.planes import FaceFit
from survey.records import BlockRecord, Extrusion, SolidRecord
from survey.shapes import FaceShape, ShapeKind
from survey.solid_blocks import block_of_solid

__all__ = ["stone_record", "surveyed_block"]

Array = NDArray[np.float64]


def stone_record(block: SurveyedBlock) -> StoneRecord:
    """What the database keeps of a stone."""
    face, fit, record = block.face, block.face.fit, block.face.record
    return StoneRecord(
        code=block.code,
        kind=block.kind,
        course=block.course,
        line=record.line,
        vertices=record.vertices,
        points=record.points,
        sigma=record.sigma,
        normal=fit.normal,
        offset=fit.offset,
        centroid=fit.centroid,
        axes=fit.axes,
        covariance=fit.covariance,
        rms=fit.rms,
        redundancy=fit.redundancy,
        rejected=face.rejected_points,
        outline=face.outline,
        depth=block.depth.value,
        depth_sigma=block.depth.sigma,
        depth_source=block.depth.source,
        solid_vertices=block.solid.vertices,
        solid_faces=block.solid.faces,
        vertex_sigma=block.vertex_sigma,
        notes=record.notes,
        zone=record.zone,
        depth_origin=block.depth.origin,
        provenance=face.provenance.source,
        provenance_text=face.provenance.text,
        station=record.station,
        photograph=record.photograph,
        image=record.image,
        sigmas=record.sigmas,
        names=record.names,
        rejected_vertices=face.rejected_vertices,
        shape=str(face.shape.kind),
        shape_text=face.shape.text,
        direction=block.extrusion.direction,
        tail=block.extrusion.tail,
        remarks=face.remarks,
    )


def surveyed_block(stone: StoneRecord) -> SurveyedBlock:
    """The stone as the survey pillar knows it, from what the database keeps of it.

    A face that was measured in space is fitted anew: from the same measurements it is the same face, and the
    database need not keep what follows from others of its columns.
    """
    # any point on the stored side of the plane tells which side is outside
    outside = stone.outline.mean(axis=0) + 100.0 * stone.normal
    if stone.provenance == "solid":
        solid = SolidRecord(
            stone.code, stone.kind, stone.course, stone.solid_vertices, stone.solid_faces, stone.line
        )
        return block_of_solid(solid, outside, "")
    measured = _block_record(stone)
    face = outline_face(measured, outside) if stone.provenance == "points" else _lifted_face(stone, measured)
    depth = Depth(stone.depth, stone.depth_sigma, stone.depth_source, "stone", stone.line)
    return extrude(face, depth, Extrusion(stone.direction, stone.tail))


def _block_record(stone: StoneRecord) -> BlockRecord:
    return BlockRecord(
        code=stone.code,
        kind=stone.kind,
        course=stone.course,
        vertices=stone.vertices,
        points=stone.points,
        sigma=stone.sigma,
        line=stone.line,
        notes=stone.notes,
        zone=stone.zone,
        station=stone.station,
        photograph=stone.photograph,
        image=stone.image,
        sigmas=stone.sigmas,
        names=stone.names,
    )


def _lifted_face(stone: StoneRecord, measured: BlockRecord) -> Face:
    """A face whose plane was found elsewhere: its corners lie on it, and nothing was measured twice."""
    fit = FaceFit(
        normal=stone.normal,
        offset=stone.offset,
        centroid=stone.centroid,
        axes=stone.axes,
        singular_values=np.zeros(3),
        covariance=stone.covariance,
        rms=stone.rms,
        sigma0=float("nan"),
        redundancy=0,
        rejected=(),
        residuals=np.empty(0),
        standardised=np.empty(0),
    )
    shape = FaceShape(ShapeKind.UNTESTED, stone.shape_text)
    return face_on(fit, stone.vertices, shape, Provenance("photograph", stone.provenance_text), measured)
