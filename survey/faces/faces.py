"""The visible face of a stone: its plane, and its outline on that plane."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.faces.outline import OutlineMeasures, level_direction, measure_outline, outline_polygon
from survey.faces.planes import FaceFit, fit_plane, with_shared_errors
from survey.faces.roughness import rough_sigmas
from survey.faces.shapes import FaceShape, judge_shape
from survey.geometry.solids import area_vector
from survey.records.survey import BlockRecord

Source = Literal["points", "photograph", "solid", "hypothesis"]
"""Kinds of evidence for a face."""


@dataclass(frozen=True)
class Provenance:
    """The origin of a face.

    Attributes
    ----------
    source : points measured in space, a photograph, or an imported solid; a hypothesis is a face that nobody has
        seen
    text : the same in words, with names
    """

    source: Source
    text: str


_POINTS = Provenance("points", "points measured on the face")
_MARKS = Provenance("points", "points marked on oriented photographs")


@dataclass(frozen=True)
class Face:
    """The visible face of one stone.

    Attributes
    ----------
    code, kind, course : as in the survey
    fit : the plane
    outline : (nv, 3) the measured corners moved onto the plane, counter-clockwise seen from outside [m]
    shape : verdict on whether one plane describes the face
    measures : its size
    provenance : its origin
    record : the stone as measured
    corner_of : (nv,) index of the measured corner of each corner of the outline
    rejected_points : indices of `BlockRecord.points` that the fit left out
    rejected_vertices : indices of `outline` whose measured corners lie off the plane: broken or eroded
        corners
    remarks : changes that made the outline a polygon, in words
    """

    code: str
    kind: str
    course: int | None
    fit: FaceFit
    outline: Array
    shape: FaceShape
    measures: OutlineMeasures
    provenance: Provenance
    record: BlockRecord
    corner_of: tuple[int, ...]
    rejected_points: tuple[int, ...] = ()
    rejected_vertices: tuple[int, ...] = ()
    remarks: tuple[str, ...] = ()


def outline_face(record: BlockRecord, observer: Array | None) -> Face:
    """Fit the plane of a stone's face and put its corners on it.

    Plane and normal come from the points *and* the corners together: corners lie farthest apart, so they carry
    a third of the information on the tilt of a small face. An eroded or bevelled corner that fell behind the
    face is left out by the same test as any other outlier, so it does not tilt the plane. Indices of
    `fit.residuals` and `fit.rejected` count the points first, then the corners.

    Parameters
    ----------
    record : one stone of a survey, measured in space
    observer : (3,) viewpoint [m]; None: the corners run counter-clockwise seen from outside

    Returns
    -------
    Face

    Raises
    ------
    GeometryError
        if the stone has no plane, or its corners no outline
    """
    try:
        return _measured_face(record, observer)
    except GeometryError as error:
        raise error.at(f"stone {record.code} (line {record.line})") from error


def _measured_face(record: BlockRecord, observer: Array | None) -> Face:
    if len(record.vertices) < 3:
        raise GeometryError(f"it has {len(record.vertices)} corners", remedy="measure 3 corners or more")
    measured = np.concatenate([record.points.reshape(-1, 3), record.vertices])
    sigma = rough_sigmas(record)
    fit = fit_plane(measured, sigma, _outside(record.vertices) if observer is None else observer)
    if record.joint is not None:
        fit = with_shared_errors(fit, measured, sigma, record.joint, record.roughness)
    corners = record.vertices - np.outer(fit.residuals[len(record.points) :], fit.normal)
    shape = judge_shape(fit, measured, sigma)
    return face_on(
        fit, corners, shape, _MARKS if record.evidence else _POINTS, record, keep_order=observer is None
    )


def face_on(
    fit: FaceFit,
    corners: Array,
    shape: FaceShape,
    provenance: Provenance,
    record: BlockRecord,
    *,
    keep_order: bool = False,
) -> Face:
    """Make the face of a stone from its known plane and its corners on that plane.

    Parameters
    ----------
    fit : the plane
    corners : (n, 3) in the order of the record, on the plane [m]
    shape, provenance, record : as in Face
    keep_order : refuse an outline that crosses itself, because the order of the corners defined the outer side

    Raises
    ------
    GeometryError
        if the corners have no outline
    """
    axes = fit.axes * [[1.0], [_handedness(fit)]]
    outline = outline_polygon((corners - fit.centroid) @ axes.T, record.sigma, keep_order=keep_order)
    count = len(record.points)
    broken = {i - count for i in fit.rejected if i >= count}
    return Face(
        code=record.code,
        kind=record.kind,
        course=record.course,
        fit=fit,
        outline=corners[list(outline.source)],
        shape=shape,
        measures=measure_outline(outline.corners, level_direction(fit.normal, axes)),
        provenance=provenance,
        record=record,
        corner_of=outline.source,
        rejected_points=tuple(i for i in fit.rejected if i < count),
        rejected_vertices=tuple(k for k, i in enumerate(outline.source) if i in broken),
        remarks=_remarks(outline.merged, outline.reordered),
    )


def _handedness(fit: FaceFit) -> float:
    """Return 1 if the axes and the normal of a plane are right-handed, otherwise -1."""
    (ax, ay, az), (bx, by, bz) = fit.axes.tolist()
    nx, ny, nz = fit.normal.tolist()
    turn = nx * (ay * bz - az * by) + ny * (az * bx - ax * bz) + nz * (ax * by - ay * bx)
    return 1.0 if turn > 0.0 else -1.0


def _remarks(merged: tuple[int, ...], reordered: bool) -> tuple[str, ...]:
    out = []
    if merged:
        out.append(f"corners {', '.join(str(i + 1) for i in merged)} were measured twice and are left out")
    if reordered:
        out.append("the corners were not listed in order around the face and have been put in order")
    return tuple(out)


def _outside(vertices: Array) -> Array:
    """Return a point in front of a face whose corners run counter-clockwise."""
    towards = area_vector(vertices)
    out: Array = vertices.mean(axis=0) + towards / max(float(np.linalg.norm(towards)), 1e-300)
    return out
