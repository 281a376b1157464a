"""Conversion between surveyed stones and the records of the database."""

import math
import unicodedata
from collections.abc import Iterable
from dataclasses import fields, replace
from typing import Any, get_args

import numpy as np

from archmodel.store.stone_record import StoneRecord
from survey.clouds.outlines.outline import PROPOSED
from survey.extrusion.depth import Depth, Origin
from survey.extrusion.extrusion import SurveyedBlock, extrude
from survey.faces.faces import Face, Provenance, Source, face_on, outline_face
from survey.faces.planes import FaceFit
from survey.faces.shapes import FaceShape, ShapeKind
from survey.geometry.solids import Solid
from survey.records.survey import BlockRecord, Extrusion
from survey.registration.site_frame import SiteTransform

_STONE = ("code", "kind", "course")
# measured in the one, resolved for every stone in the other
_DEPTH = ("depth", "depth_sigma", "depth_source", "depth_origin")
_MEASURED = tuple(
    one.name
    for one in fields(BlockRecord)
    if one.name in {field.name for field in fields(StoneRecord)}.difference(_STONE, _DEPTH)
)
_PLANE = ("normal", "offset", "centroid", "axes", "covariance", "rms", "redundancy")
"""Names that stones and their records share: of the stone, of its BlockRecord, of its FaceFit."""


def stone_record(block: SurveyedBlock) -> StoneRecord:
    """Convert a surveyed stone to its record; letters of its texts get their composed form (NFC)."""
    face, fit, record = block.face, block.face.fit, block.face.record
    stone = StoneRecord(
        **_values(block, _STONE),
        **_values(record, _MEASURED),
        **_values(fit, _PLANE),
        **_values(face.measures, ("length", "height", "area")),
        rejected=face.rejected_points,
        outline=face.outline,
        depth=block.depth.value,
        depth_sigma=block.depth.sigma,
        depth_source=block.depth.source,
        solid_vertices=block.solid.vertices,
        solid_faces=block.solid.faces,
        vertex_sigma=block.vertex_sigma,
        depth_origin=block.depth.origin,
        provenance=face.provenance.source,
        provenance_text=face.provenance.text,
        rejected_vertices=face.rejected_vertices,
        shape=str(face.shape.kind),
        shape_text=face.shape.text,
        direction=block.extrusion.direction,
        tail=block.extrusion.tail,
        remarks=face.remarks,
        hypothesis=face.provenance.source == "hypothesis" or record.notes.get("evidence") == PROPOSED,
    )
    notes = {_composed(key): _composed(text) for key, text in stone.notes.items()}
    zone = None if stone.zone is None else _composed(stone.zone)
    return replace(stone, code=_composed(stone.code), zone=zone, notes=notes)


def surveyed_block(stone: StoneRecord) -> SurveyedBlock:
    """Restore a surveyed stone from its record.

    A face that was measured in space is fitted again: from the same measurements it is the same face, and the
    database need not keep what follows from others of its columns.
    """
    measured = BlockRecord(**_values(stone, (*_STONE, *_MEASURED)))
    depth = Depth(stone.depth, stone.depth_sigma, stone.depth_source, _origin(stone), stone.line)
    extrusion = Extrusion(stone.direction, stone.tail)
    if stone.provenance == "points":
        # any point on the stored side of the plane defines the outside
        outside = stone.outline.mean(axis=0) + 100.0 * stone.normal
        return extrude(outline_face(measured, outside), depth, extrusion)
    face = _kept_face(stone, measured)
    if stone.provenance == "photograph":
        return extrude(face, depth, extrusion)
    return SurveyedBlock(
        **_values(stone, _STONE),
        face=face,
        depth=depth,
        extrusion=extrusion,
        solid=Solid(stone.code, stone.solid_vertices, stone.solid_faces),
        vertex_sigma=stone.vertex_sigma,
    )


def _origin(stone: StoneRecord) -> Origin:
    return next(arg for arg in get_args(Origin) if arg == stone.depth_origin)


def _source(stone: StoneRecord) -> Source:
    return next(arg for arg in get_args(Source) if arg == stone.provenance)


def _kept_face(stone: StoneRecord, measured: BlockRecord) -> Face:
    """Restore a face whose plane was not fitted to its corners: its neighbours' plane, or the side of a solid."""
    residuals = (stone.vertices - stone.centroid) @ stone.normal
    on_solid = stone.provenance in ("solid", "hypothesis")
    fit = FaceFit(
        **_values(stone, _PLANE),
        singular_values=np.full(3, np.nan),
        sigma0=float("nan"),
        rejected=stone.rejected,
        residuals=residuals if on_solid else np.empty(0),
        standardised=np.zeros(len(residuals)) if on_solid else np.empty(0),
    )
    # a lifted corner lies on the plane to within rounding, and stays where it is
    corners = stone.vertices - np.outer(residuals, stone.normal) if on_solid else stone.vertices
    face = face_on(
        fit,
        corners,
        FaceShape(ShapeKind(stone.shape), stone.shape_text),
        Provenance(_source(stone), stone.provenance_text),
        measured,
    )
    return replace(face, remarks=stone.remarks)


def frame_record(transform: SiteTransform | None) -> dict[str, Any] | None:
    """Describe the transform with its precision and the residuals of its control points; None without one."""
    if transform is None:
        return None
    points = zip(transform.names, transform.residuals.tolist(), transform.standardised.tolist(), strict=True)
    return {
        "rotation": transform.rotation.tolist(),
        "scale": transform.scale,
        "survey_centre": transform.survey_centre.tolist(),
        "site_centre": transform.site_centre.tolist(),
        "covariance": transform.covariance.tolist(),
        "sigma0": _finite(transform.sigma0),
        "redundancy": transform.redundancy,
        "scale_test": _finite(transform.scale_test),
        "control": [
            {
                "name": name,
                "residual": residual,
                "standardised": _finite(standardised),
                "rejected": name in transform.rejected,
            }
            for name, residual, standardised in points
        ],
    }


def _values(source: object, names: Iterable[str]) -> dict[str, Any]:
    return {name: getattr(source, name) for name in names}


def _composed(text: str) -> str:
    return unicodedata.normalize("NFC", text)


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
