"""Extrusion: a face moved into the wall by the stone's depth, with the precision of its corners."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import STEEPEST
from survey.extrusion._kernels import FacePlane, HiddenSide, corner_deviations
from survey.extrusion.depth import Depth
from survey.faces.faces import Face
from survey.geometry.solids import Solid
from survey.records.survey import Extrusion

_STRAIGHT = Extrusion()
_FLATTEST = np.cos(STEEPEST)  # a direction farther from the normal leaves a sliver, not a stone


@dataclass(frozen=True)
class SurveyedBlock:
    """A measured stone with its hidden side.

    Attributes
    ----------
    code, kind, course : as in the survey
    face : its visible face
    depth : its depth, with the evidence
    extrusion : direction and size of its hidden side
    solid : between the face and the hidden face; the nv visible corners first, then the hidden ones
    vertex_sigma : (2 nv, 3) standard deviations of the solid's corners along x, y and z [m]; NaN where that of the
        depth is not known
    """

    code: str
    kind: str
    course: int | None
    face: Face
    depth: Depth
    extrusion: Extrusion
    solid: Solid
    vertex_sigma: Array


def extrude(face: Face, depth: Depth, extrusion: Extrusion = _STRAIGHT) -> SurveyedBlock:
    """Give a face its hidden side.

    Parameters
    ----------
    face : visible face
    depth : along the direction of extrusion
    extrusion : direction, and size of the tail; by default square to the face and as large as the face

    Returns
    -------
    SurveyedBlock whose solid has the nv visible corners first, then the nv hidden ones, in the same order

    Raises
    ------
    GeometryError
        if the direction does not lead from the face into the wall
    """
    hidden = hidden_side(face.outline, face.fit.normal, depth.value, extrusion)
    return SurveyedBlock(
        code=face.code,
        kind=face.kind,
        course=face.course,
        face=face,
        depth=depth,
        extrusion=extrusion,
        solid=prism(face.code, face.outline, hidden),
        vertex_sigma=_vertex_sigma(face, depth, extrusion, hidden),
    )


def hidden_side(corners: Array, normal: Array, depth: float, extrusion: Extrusion) -> Array:
    """Return the hidden corners (nv, 3) behind visible ones: mean + tail · (corner - mean) + depth · direction [m]."""
    hidden = corners + depth * _direction(normal, extrusion)
    if extrusion.tail != 1.0:
        hidden -= (1.0 - extrusion.tail) * (corners - corners.mean(axis=0))
    return hidden


def prism(code: str, front: Array, back: Array) -> Solid:
    """Join two polygons of equal count, the front counter-clockwise seen from outside, to a closed solid."""
    return Solid(code, np.concatenate([front, back]), _prism_faces(len(front)))


@lru_cache
def _prism_faces(count: int) -> tuple[tuple[int, ...], ...]:
    sides = tuple((j, i, i + count, j + count) for i, j in ((i, (i + 1) % count) for i in range(count)))
    return (tuple(range(count)), tuple(range(2 * count - 1, count - 1, -1)), *sides)


def _direction(normal: Array, extrusion: Extrusion) -> Array:
    """Return the unit vector from the face into the wall."""
    if extrusion.direction is None:
        return -normal
    direction: Array = extrusion.direction / np.linalg.norm(extrusion.direction)
    if not -(direction @ normal) >= _FLATTEST:
        angle = float(np.degrees(np.arccos(np.clip(-(direction @ normal), -1.0, 1.0))))
        raise GeometryError(
            f"its direction of extrusion is {angle:.0f}° from square to its face",
            remedy="give a direction that leads from the face into the wall, less than 60° from square",
        )
    return direction


def _vertex_sigma(face: Face, depth: Depth, extrusion: Extrusion, hidden: Array) -> Array:
    """Propagate the independent errors of corner, plane and depth to first order.

    In the plane a corner is as precise as it was measured; square to it, it is as precise as the plane is
    there: tilts θ and height η of the plane raise the place (u₁, u₂) by η + θ₁ u₁ + θ₂ u₂. Behind the face,
    a hidden corner moves along by the error of the depth, and, where the direction is square to the face, by
    depth · θ as the normal turns.
    """
    fit = face.fit
    behind = HiddenSide(
        corners=hidden,
        direction=_direction(fit.normal, extrusion),
        square_to_face=extrusion.direction is None,
        tail=extrusion.tail,
        depth=depth.value,
        depth_variance=np.nan if depth.sigma is None else depth.sigma**2,
    )
    plane = FacePlane(fit.normal, fit.centroid, fit.axes, fit.covariance)
    deviations = face.record.lateral_sigmas(fit.normal)[list(face.corner_of)]
    out: Array = corner_deviations(face.outline, deviations, plane, behind)
    return out
