"""Stones that another program made: which side of the solid is the face, and how deep the stone is behind it."""

from dataclasses import replace

import numpy as np

from moma.errors import GeometryError
from survey.arrays import Array
from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import SurveyedBlock
from survey.faces.faces import Provenance, face_on
from survey.faces.planes import FaceFit
from survey.faces.shapes import FaceShape, ShapeKind
from survey.geometry.solids import Solid, area_vector
from survey.records.survey import BlockRecord, Extrusion, SolidRecord

__all__ = ["block_of_solid"]


_UPRIGHT = 0.9  # a side whose normal rises more steeply (sine) is a bed or a top, not a face
_ALIKE = 0.01  # sides whose areas differ by less may be the front and the back of one stone
_SHALLOWEST = 1e-6  # metres behind the face
_HAND = np.array([-0.11, -1.0, 0.013])  # where the front is then: square to as few walls as can be


def block_of_solid(record: SolidRecord, viewpoint: Array | None, path: str) -> SurveyedBlock:
    """The stone of a closed solid, with the side that is seen as its face.

    That is the side with the largest area as seen from the viewpoint; without one, the largest upright side. Of
    a front and a back that are as large it is, for all stones of a wall, the one on the same hand. The depth is
    how far the solid reaches behind it.

    Parameters
    ----------
    record : the solid
    viewpoint : (3,) where the observer stood [m]; None if not known
    path : of the file that it comes from, for the provenance

    Returns
    -------
    SurveyedBlock whose precision is not known

    Raises
    ------
    GeometryError
        if the sides are seen from inside, or nothing of the solid lies behind its face
    """
    side, normal = _visible_side(record, viewpoint)
    fit = _plane(side, normal)
    depth = float(((fit.centroid - record.vertices) @ normal).max())
    if not depth > _SHALLOWEST:
        raise GeometryError(
            f"it reaches {depth * 1e3:.2g} mm behind its largest side",
            remedy="look at the solid, or say where it is seen from",
        )
    measured = BlockRecord(
        code=record.code,
        kind=record.kind,
        course=record.course,
        vertices=side,
        points=np.empty((0, 3)),
        sigma=0.0,
        line=record.line,
    )
    shape = FaceShape(ShapeKind.UNTESTED, "the side of a solid")
    provenance = Provenance("solid", "; ".join((f"solid of {path}", *record.remarks)))
    corners = side - np.outer(fit.residuals, normal)
    face = face_on(fit, corners, shape, provenance, measured)
    return SurveyedBlock(
        code=record.code,
        kind=record.kind,
        course=record.course,
        face=replace(face, remarks=(*face.remarks, *record.remarks)),
        depth=Depth(depth, None, f"extent of the solid behind its face, {path}", "solid", record.line),
        extrusion=Extrusion(),
        solid=Solid(record.code, record.vertices, record.faces),
        vertex_sigma=np.full(record.vertices.shape, np.nan),
    )


def _visible_side(record: SolidRecord, viewpoint: Array | None) -> tuple[Array, Array]:
    """Corners (nv, 3) and outward normal (3,) of the side that is the face."""
    sides = [record.vertices[list(face)] for face in record.faces]
    vectors = np.array([area_vector(side) for side in sides])
    origin = record.vertices.mean(axis=0)
    volume = (
        sum(float((side[0] - origin) @ vector) for side, vector in zip(sides, vectors, strict=True)) / 3.0
    )
    if not volume > 0.0:
        raise GeometryError(
            f"its sides enclose {volume:.3g} m³",
            remedy="look for corners out of place, or sides seen from inside",
        )
    worth = _worth(vectors, sides, viewpoint)
    alike = np.flatnonzero(worth >= worth.max() - _ALIKE * abs(worth.max()))
    seen = int(alike[np.argmax(vectors[alike] @ _HAND)]) if viewpoint is None else int(worth.argmax())
    return sides[seen], vectors[seen] / np.linalg.norm(vectors[seen])


def _worth(vectors: Array, sides: list[Array], viewpoint: Array | None) -> Array:
    """How much each side is the face, by its area as it is seen."""
    areas: Array = np.linalg.norm(vectors, axis=1)
    if viewpoint is None:
        upright = np.abs(vectors[:, 2]) <= _UPRIGHT * areas
        return np.where(upright, areas, 0.0) if upright.any() else areas
    sight = viewpoint - np.array([side.mean(axis=0) for side in sides])
    out: Array = (vectors * sight).sum(axis=1) / np.linalg.norm(sight, axis=1)
    return out


def _plane(polygon: Array, normal: Array) -> FaceFit:
    """The plane of a side, without any precision."""
    centroid = polygon.mean(axis=0)
    residuals = (polygon - centroid) @ normal
    flat = polygon - centroid - np.outer(residuals, normal)
    _, singular, vectors = np.linalg.svd(flat, full_matrices=False)
    return FaceFit(
        normal=normal,
        offset=float(normal @ centroid),
        centroid=centroid,
        axes=vectors[:2],
        singular_values=singular,
        covariance=np.zeros((3, 3)),
        rms=float(np.sqrt((residuals**2).mean())),
        sigma0=float("nan"),
        redundancy=0,
        rejected=(),
        residuals=residuals,
        standardised=np.zeros(len(polygon)),
    )
