"""Imported solids: the visible side of each, and the depth of the stone behind it."""

from dataclasses import replace

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import PER_CENT, TENTH, TOUCHING
from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import SurveyedBlock
from survey.faces.faces import Provenance, face_on
from survey.faces.planes import FaceFit
from survey.faces.shapes import FaceShape, ShapeKind
from survey.geometry.solids import Solid, area_vector
from survey.records.survey import BlockRecord, Extrusion, SolidRecord

_UPRIGHT = 1.0 - TENTH  # slope (sine) of a normal beyond which the side is a bed or a top, not a face
_ALIKE = PER_CENT  # relative difference of areas below which two sides may be front and back of one stone
_HAND = np.array([-0.11, -1.0, 0.013])  # side taken as the front then; aligned with hardly any wall


def block_of_solid(record: SolidRecord, viewpoint: Array | None, path: str) -> SurveyedBlock:
    """Make a stone of a closed solid, with its visible side as the face.

    The face is the side with the largest area as seen from the viewpoint; without one, the largest upright side. Of
    a front and a back of equal area it is the one on the same hand for all stones of a wall. The depth is the
    extent of the solid behind it.

    Parameters
    ----------
    record : the solid
    viewpoint : (3,) position of the observer [m]; None if not known
    path : of the source file, for the provenance

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
    if not depth > TOUCHING:
        raise GeometryError(
            f"it reaches {depth * 1e3:.2g} mm behind its largest side",
            remedy="check the solid, or give its viewpoint",
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
    """Return corners (nv, 3) and outward normal (3,) of the visible side."""
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
    areas = _visible_areas(vectors, sides, viewpoint)
    alike = np.flatnonzero(areas >= areas.max() - _ALIKE * abs(areas.max()))
    seen = int(alike[np.argmax(vectors[alike] @ _HAND)]) if viewpoint is None else int(areas.argmax())
    return sides[seen], vectors[seen] / np.linalg.norm(vectors[seen])


def _visible_areas(vectors: Array, sides: list[Array], viewpoint: Array | None) -> Array:
    """Return the area of each side as seen from the viewpoint, without one its area if it is upright [m²]."""
    areas: Array = np.linalg.norm(vectors, axis=1)
    if viewpoint is None:
        upright = np.abs(vectors[:, 2]) <= _UPRIGHT * areas
        return np.where(upright, areas, 0.0) if upright.any() else areas
    sight = viewpoint - np.array([side.mean(axis=0) for side in sides])
    out: Array = (vectors * sight).sum(axis=1) / np.linalg.norm(sight, axis=1)
    return out


def _plane(polygon: Array, normal: Array) -> FaceFit:
    """Fit the plane of a side, without precision."""
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
