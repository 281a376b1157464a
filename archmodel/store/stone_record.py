"""Plain values of a stone that go into the database and come out of it, without SQLAlchemy."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from archmodel.arrays import Array


@dataclass(frozen=True)
class StoneRecord:
    """One surveyed stone: measured, fitted, extruded.

    Every field is stored in the column of its name, and means what `tables.entities.Entity` or
    `tables.surveys.Measurement` says of that column.

    Attributes
    ----------
    kind : name of a kind of the hierarchy, e.g. "header"
    course, zone, station, photograph : None if it belongs to none, or the survey does not say
    hypothesis : it is thought to be there, for the reasons that `provenance_text` gives
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
    joint: Array | None = None
    evidence: tuple[Mapping[str, object], ...] = ()
    rejected_vertices: tuple[int, ...] = ()
    shape: str = "plane"
    shape_text: str = ""
    direction: Array | None = None
    tail: float = 1.0
    remarks: tuple[str, ...] = ()
    hypothesis: bool = False
