"""Plain values that go into the database and come out of it; no SQLAlchemy here."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from archmodel.arrays import Array

__all__ = ["StoneRecord"]


@dataclass(frozen=True)
class StoneRecord:
    """One stone as the survey gives it: measured, fitted, extruded.

    Attributes
    ----------
    code : unique within its survey
    kind : name of a kind of the hierarchy, e.g. "header"
    course : number of its course, counted from the ground; None if it belongs to none
    line : line of the survey file where its record begins
    vertices : (nv, 3) measured face corners, in order [m]
    points : (np, 3) measured points on the face [m]
    sigma : standard deviation of a measured coordinate [m]
    normal : (3,) unit normal of the fitted plane, towards the observer
    offset : signed distance of the plane from the origin [m]
    centroid : (3,) mean of the accepted points, on the plane [m]
    axes : (2, 3) unit directions in the plane
    covariance : (3, 3) of two tilts [rad] and the height at the centroid [m]; tilt i turns the normal towards
        -axes[i]
    rms : root mean square of the residuals [m]
    redundancy : number of accepted points minus 3
    rejected : indices into `points` of those left out as blunders
    outline : (nv, 3) the corners moved onto the plane, counter-clockwise seen from outside [m]
    length, height : extents of the outline along its level direction and square to it [m]
    area : of the outline [m²]
    depth, depth_sigma, depth_source : how deep the stone is [m], how sure, and by what evidence
    solid_vertices, solid_faces : the extruded stone [m]
    vertex_sigma : (nv, 3) standard deviations of `solid_vertices` [m]; NaN where not known
    notes : observations of the surveyor, e.g. {"edge": "eroded"}
    zone : part of the building; None if not said
    depth_origin : stone, rule (of course or zone), kind, structure or solid
    provenance, provenance_text : points, photograph, solid or hypothesis; the same in words
    station, photograph : names of those that saw it; None if not said
    image : (nv, 2) corners on the photograph [px]
    sigmas : (np + nv,) standard deviations of the points, then of the corners [m]; None: all `sigma`
    names : of the points, then of the corners, as the instrument numbers them; () if they have none
    rejected_vertices : indices into `outline` of broken or eroded corners
    shape, shape_text : plane, bevelled, curved, rough or untested; the same in words, with numbers
    direction : (3,) of the extrusion; None: square to the face
    tail : size of the hidden face over that of the visible one
    remarks : what was changed to make the outline a polygon
    hypothesis : nobody has seen it; it is thought to be there, for the reasons that `provenance_text` gives
    """

    code: str
    kind: str
    course: int | None
    line: int
    vertices: Array
    points: Array
    sigma: float
    normal: Array
    offset: float
    centroid: Array
    axes: Array
    covariance: Array
    rms: float
    redundancy: int
    rejected: tuple[int, ...]
    outline: Array
    length: float
    height: float
    area: float
    depth: float
    depth_sigma: float | None
    depth_source: str
    solid_vertices: Array
    solid_faces: tuple[tuple[int, ...], ...]
    vertex_sigma: Array
    notes: Mapping[str, str] = field(default_factory=dict)
    zone: str | None = None
    depth_origin: str = "stone"
    provenance: str = "points"
    provenance_text: str = ""
    station: str | None = None
    photograph: str | None = None
    image: Array = field(default_factory=lambda: np.empty((0, 2)))
    sigmas: Array | None = None
    names: tuple[str, ...] = ()
    rejected_vertices: tuple[int, ...] = ()
    shape: str = "plane"
    shape_text: str = ""
    direction: Array | None = None
    tail: float = 1.0
    remarks: tuple[str, ...] = ()
    hypothesis: bool = False
