"""Plain values that go into the database and come out of it; no SQLAlchemy here."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["STONE_VALUES", "RunRecord", "StoneRecord", "StoneResult"]

Array = NDArray[np.float64]

STONE_VALUES: Mapping[str, tuple[str, str]] = {
    "von_mises_p99": ("Pa", "Von Mises stress that 1 % of its volume exceeds"),
    "principal_tension": ("Pa", "largest principal stress, positive in tension"),
    "principal_compression": ("Pa", "smallest principal stress, negative in compression"),
    "mean_pressure": ("Pa", "mean pressure over its volume"),
    "tension_zone": ("-", "part of its volume in tension, beyond what the error of the stress explains"),
    "overstressed_zone": ("-", "part of its volume with tension above the tensile strength"),
    "utilisation": ("-", "largest stress over strength, in tension or compression"),
    "utilisation_tension": ("-", "largest tension over the tensile strength"),
    "utilisation_compression": ("-", "largest compression over the compressive strength"),
    "stress_error": ("-", "estimated relative error of its stress"),
    "joint_pressure": ("Pa", "largest pressure in its joints"),
    "joint_kern": ("-", "largest of its joints: up to 1, the resultant is within the kern"),
    "joint_opening": ("m", "largest opening of its joints"),
    "joint_sliding": ("m", "largest sliding in its joints since the start"),
    "joint_friction_use": ("-", "largest part of friction and cohesion that a joint of it uses"),
}
"""Unit and meaning of the named values of a stone's result that can be asked for."""


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
    covariance : (3, 3) of two tilt angles [rad] and the offset [m]
    rms : root mean square of the residuals [m]
    redundancy : number of accepted points minus 3
    rejected : indices into `points` of those left out as blunders
    outline : (nv, 3) the corners moved onto the plane, counter-clockwise seen from outside [m]
    depth, depth_sigma, depth_source : how deep the stone is [m], how sure, and by what evidence
    solid_vertices, solid_faces : the extruded stone [m]
    notes : observations of the surveyor, e.g. {"edge": "eroded"}
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
    covariance: Array
    rms: float
    redundancy: int
    rejected: tuple[int, ...]
    outline: Array
    depth: float
    depth_sigma: float | None
    depth_source: str
    solid_vertices: Array
    solid_faces: tuple[tuple[int, ...], ...]
    notes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class StoneResult:
    """What a run computed for one stone.

    Attributes
    ----------
    code : the stone
    fidelity : fixed, rigid or deformable
    von_mises_max, von_mises_mean : [Pa]; None if the stone was rigid
    displacement_max : [m]
    contact_force_max : largest force of one contact point [N]
    values : further named numbers; those of STONE_VALUES can be asked for
    """

    code: str
    fidelity: str
    von_mises_max: float | None
    von_mises_mean: float | None
    displacement_max: float
    contact_force_max: float | None
    values: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class RunRecord:
    """One simulation run.

    Attributes
    ----------
    scene : its name
    scene_text : the scene file as it was run
    outcome : equilibrium, moving or collapsed
    summary : the contents of summary.json
    version : version of MOMA
    results : one per stone of the scene
    """

    scene: str
    scene_text: str
    outcome: str
    summary: Mapping[str, object]
    version: str
    results: tuple[StoneResult, ...]
