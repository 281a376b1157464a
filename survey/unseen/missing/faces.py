"""Conversion of a missing stone's outline in the elevation to a stone in space, with its evidence."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from survey.arrays import Array
from survey.conventions import CORNERS, WIDEST_JOINT
from survey.extrusion.depth import Depth
from survey.extrusion.extrusion import SurveyedBlock, extrude
from survey.faces.common_planes import PlaneEstimate, common_plane
from survey.faces.faces import Provenance, face_on
from survey.faces.planes import FaceFit
from survey.faces.shapes import FaceShape, ShapeKind
from survey.records.survey import BlockRecord
from survey.unseen.missing.sides import Elevation, FlatStone

_ENOUGH = CORNERS  # least number of faces for a common plane


@dataclass(frozen=True)
class MissingFace:
    """Hypothesis of a missing stone, in the elevation.

    Attributes
    ----------
    code, kind, course, zone : as of any stone
    outline : (nv, 2) counter-clockwise [m]
    beside : its neighbours
    depth : with the evidence
    sigma : standard deviation of a corner in the plane of the facade [m]
    along_sigma : additional standard deviation along the facade, where two missing stones meet [m]
    evidence : evidence of outline and kind, in words
    """

    code: str
    kind: str
    course: int | None
    zone: str | None
    outline: Array
    beside: tuple[FlatStone, ...]
    depth: Depth
    sigma: float
    along_sigma: float
    evidence: str


def stone_of(face: MissingFace, elevation: Elevation) -> SurveyedBlock:
    """Put the outline on the common plane of the neighbouring faces, and extrude it by the depth."""
    frame = elevation.frame
    flat = frame.origin + face.outline @ frame.axes[:2]
    plane = _plane(flat, face.beside, elevation)
    lift = ((plane.centroid - flat) @ plane.normal) / float(frame.axes[2] @ plane.normal)
    corners = flat + lift[:, None] * frame.axes[2]
    text = f"{face.evidence}; in {plane.text}"
    record = BlockRecord(
        code=face.code,
        kind=face.kind,
        course=face.course,
        vertices=corners,
        points=np.empty((0, 3)),
        sigma=face.sigma,
        zone=face.zone,
    )
    shape = FaceShape(ShapeKind.UNTESTED, "nobody has seen it")
    made = face_on(_fit(plane, corners), corners, shape, Provenance("hypothesis", text), record)
    block = extrude(made, face.depth)
    along = face.along_sigma * np.abs(frame.axes[0])
    return replace(block, vertex_sigma=np.hypot(block.vertex_sigma, along))


def is_plausible(outline: Array) -> bool:
    """Return whether corners (4, 2) make a stone: convex, counter-clockwise, no side shorter than 5 cm."""
    run = np.roll(outline, -1, axis=0) - outline
    after = np.roll(run, -1, axis=0)
    turns = run[:, 0] * after[:, 1] - run[:, 1] * after[:, 0]
    return bool((turns > 0.0).all() and (np.hypot(run[:, 0], run[:, 1]) >= WIDEST_JOINT).all())


def _plane(corners: Array, beside: Sequence[FlatStone], elevation: Elevation) -> PlaneEstimate:
    """Return the common plane of the faces near an outline, or of all of the facade, or that of a neighbour."""
    faces = [stone.block.face for stone in elevation.stones]
    around = elevation.neighbours
    neighbours = around.near(corners, elevation.frame.axes[2])
    place = corners.mean(axis=0)
    if len(neighbours) >= _ENOUGH:
        text = f"the plane of {', '.join(around.codes[i] for i in neighbours.tolist())}"
        return common_plane(around.fits(neighbours), place).face_at(place, text)
    if len(faces) >= _ENOUGH:
        return common_plane([face.fit for face in faces], place).face_at(place, "the plane of the facade")
    fit = beside[0].block.face.fit
    return PlaneEstimate(
        fit.centroid, fit.normal, fit.axes, fit.covariance, fit.rms, f"the plane of {beside[0].block.code}"
    )


def _fit(plane: PlaneEstimate, corners: Array) -> FaceFit:
    """Return the predicted plane as a fit without residuals, with its covariance at the middle of the corners."""
    middle = corners.mean(axis=0)
    carry = np.eye(3)
    carry[2, :2] = plane.axes @ (middle - plane.centroid)
    nothing = np.empty(0)
    return FaceFit(
        normal=plane.normal,
        offset=float(plane.normal @ plane.centroid),
        centroid=middle,
        axes=plane.axes,
        singular_values=np.full(3, np.nan),
        covariance=carry @ plane.covariance @ carry.T,
        rms=plane.scatter,
        sigma0=float("nan"),
        redundancy=0,
        rejected=(),
        residuals=nothing,
        standardised=nothing,
    )
