"""The visible face of a stone: its plane, and its outline on that plane."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from moma.errors import GeometryError
from survey.planes import FaceFit, fit_plane
from survey.records import BlockRecord

__all__ = ["Face", "outline_face"]

Array = NDArray[np.float64]

_SMALLEST_EDGE = 1e-3  # metres: nearer corners are one corner measured twice


@dataclass(frozen=True)
class Face:
    """The visible face of one stone.

    Attributes
    ----------
    code, kind, course : as in the survey
    fit : the plane
    outline : (nv, 3) the measured corners moved onto the plane, counter-clockwise seen from outside [m]
    rejected_points : indices of `BlockRecord.points` that the fit left out
    rejected_vertices : indices of `outline` whose measured corners lie off the plane: broken or eroded
        corners
    """

    code: str
    kind: str
    course: int | None
    fit: FaceFit
    outline: Array
    rejected_points: tuple[int, ...] = ()
    rejected_vertices: tuple[int, ...] = ()


def outline_face(record: BlockRecord, observer: Array | None) -> Face:
    """Fit the plane of a stone's face and put its corners on it.

    Plane and normal come from the points *and* the corners together: corners lie farthest apart, so they hold
    a
    third of what is known of the tilt of a small face. An eroded or bevelled corner that fell behind the face
    is
    left out by the same test as any other blunder, so it does not tilt the plane. Indices of `fit.residuals`
    and
    `fit.rejected` count the points first, then the corners.

    Parameters
    ----------
    record : one stone of a survey
    observer : (3,) where the surveyor stood [m]; None: the corners are taken as counter-clockwise from
        outside

    Returns
    -------
    Face

    Raises
    ------
    GeometryError
        if the stone has no plane, or its outline crosses itself
    """
    where = f"stone {record.code} (line {record.line})"
    measured = np.vstack([record.points.reshape(-1, 3), record.vertices])
    try:
        fit = fit_plane(measured, record.sigma, _outside(record) if observer is None else observer)
    except GeometryError as error:
        raise GeometryError(error.what, where=where, remedy=error.remedy) from error
    outline = record.vertices - np.outer(fit.residuals[len(record.points) :], fit.normal)
    count = len(record.points)
    broken = [i - count for i in fit.rejected if i >= count]
    if _area_vector(outline) @ fit.normal < 0.0:
        outline = outline[::-1]
        broken = [len(outline) - 1 - i for i in broken]
    _check_outline(outline, fit, where)
    return Face(
        code=record.code,
        kind=record.kind,
        course=record.course,
        fit=fit,
        outline=np.ascontiguousarray(outline),
        rejected_points=tuple(i for i in fit.rejected if i < count),
        rejected_vertices=tuple(sorted(broken)),
    )


def _outside(record: BlockRecord) -> Array:
    """Some point in front of the face, if its corners run counter-clockwise."""
    out: Array = record.vertices.mean(axis=0) + _area_vector(record.vertices)
    return out


def _area_vector(polygon: Array) -> Array:
    """Area times normal of a polygon in space, counter-clockwise about the normal [m²]."""
    centred = polygon - polygon.mean(axis=0)
    out: Array = 0.5 * np.cross(centred, np.roll(centred, -1, axis=0)).sum(axis=0)
    return out


def _check_outline(outline: Array, fit: FaceFit, where: str) -> None:
    flat = (outline - fit.centroid) @ fit.axes.T
    edges = np.roll(flat, -1, axis=0) - flat
    lengths = np.linalg.norm(edges, axis=1)
    if lengths.min() < _SMALLEST_EDGE:
        corner = int(lengths.argmin()) + 1
        raise GeometryError(
            f"corner {corner} and the next are {lengths.min() * 1e3:.2f} mm apart",
            where=where,
            remedy="list every corner once",
        )
    count = len(flat)
    for i in range(count):
        for j in range(i + 2, count - (i == 0)):
            if _crosses(flat[i], edges[i], flat[j], edges[j]):
                raise GeometryError(
                    f"the outline crosses itself at edges {i + 1} and {j + 1}",
                    where=where,
                    remedy="list the corners in order around the face",
                )


def _crosses(p: Array, u: Array, q: Array, v: Array) -> bool:
    """Whether segments p + [0, 1] u and q + [0, 1] v have a point in common; parallel ones are taken
    apart."""
    denominator = u[0] * v[1] - u[1] * v[0]
    if abs(denominator) < 1e-15:
        return False
    w = q - p
    s = (w[0] * v[1] - w[1] * v[0]) / denominator
    t = (w[0] * u[1] - w[1] * u[0]) / denominator
    return bool(0.0 <= s <= 1.0 and 0.0 <= t <= 1.0)
