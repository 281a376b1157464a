"""Values of a result by stone, by joint and over the scene, for tables, database and reports."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from archmodel.quantities import quantities_of
from archmodel.store.run_record import StoneResult
from mechanics.arrays import Array, Ints
from mechanics.results.contact_result import JointResult
from mechanics.results.result import BodyResult, Peaks, Result
from mechanics.results.stress_values import volume_quantile

_STRESSES = (
    *("principal_tension", "principal_compression", "mean_pressure", "tension_zone"),
    *("overstressed_zone", "utilisation", "utilisation_tension", "utilisation_compression"),
)

_OF_WHOLE_JOINTS = ("pressure_mean", "pressure_max", "kern")


@dataclass(frozen=True)
class StressStatistics:
    """Von Mises stress over all deformable stones.

    Attributes
    ----------
    max : largest nodal value [Pa]
    p99 : exceeded in 1 % of the deformable stones' volume [Pa]
    mean : volume mean [Pa]
    """

    max: float
    p99: float
    mean: float


def stress_statistics(result: Result) -> StressStatistics | None:
    """Compute statistics of the Von Mises stress; None if no stone deforms."""
    stressed = [
        (body.von_mises, body.node_volume)
        for body in result.bodies
        if body.von_mises is not None and body.node_volume is not None
    ]
    if not stressed:
        return None
    values = np.concatenate([value for value, _ in stressed])
    volumes = np.concatenate([volume for _, volume in stressed])
    return StressStatistics(
        float(values.max()),
        volume_quantile(values, volumes, 0.99),
        float(np.average(values, weights=volumes)),
    )


def joint_values(
    joints: JointResult, origin: Array | float = 0.0, *, slivers: bool = True
) -> dict[str, NDArray[Any]]:
    """Return the values (nj,) of joints by name, as in `archmodel.quantities`; NaN where not known.

    Parameters
    ----------
    joints : of a result
    origin : (3,) of the scene, in the frame of the site [m]
    slivers : False: without their pressures and kern, which say nothing of the masonry
    """
    normal = np.einsum("ji,ji->j", joints.force, joints.frame[:, 0])
    shear = np.linalg.norm(joints.force - normal[:, None] * joints.frame[:, 0], axis=1)
    values = {name: getattr(joints, name) for name in quantities_of("joint") if hasattr(joints, name)}
    values |= dict(zip("xyz", (joints.centroid + origin).T, strict=True))
    values |= {"force_normal": normal, "force_shear": shear}
    values["eccentricity"] = np.linalg.norm(joints.eccentricity, axis=1)
    if not slivers:
        values |= {name: np.where(joints.sliver, np.nan, values[name]) for name in _OF_WHOLE_JOINTS}
    return values


def stone_results(result: Result) -> tuple[StoneResult, ...]:
    """Return the results for the database, one per stone, in the order of the scene."""
    force = np.linalg.norm(result.contacts.force, axis=1)
    largest = _largest(result.contacts.bodies, force, len(result.bodies))
    further = _joint_values(result.joints, len(result.bodies)) | _peak_values(result.peaks)
    return tuple(
        StoneResult(
            code=body.code,
            fidelity=str(body.fidelity),
            von_mises_p99=None if body.values is None else body.values.von_mises_p99,
            von_mises_max=None if body.values is None else body.values.von_mises_max,
            von_mises_mean=None if body.values is None else body.values.von_mises_mean,
            displacement_max=float(np.linalg.norm(body.displacement, axis=1).max()),
            contact_force_max=None if np.isnan(largest[number]) else float(largest[number]),
            values=_values(body, {name: float(values[number]) for name, values in further.items()}),
        )
        for number, body in enumerate(result.bodies)
    )


def _values(body: BodyResult, further: Mapping[str, float]) -> dict[str, float]:
    """Return the known values of a stone by name; `archmodel.quantities` explains them."""
    values: dict[str, float | None] = {"volume": body.volume, "mass": body.mass, **further}
    if body.values is not None:
        values |= {name: getattr(body.values, name) for name in _STRESSES}
        values["stress_error"] = body.values.error
    return {name: value for name, value in values.items() if value is not None and np.isfinite(value)}


def _joint_values(joints: JointResult, count: int) -> dict[str, Array]:
    """Return the worst value (nb,) over the joints of each stone; NaN where none is known.

    Pressure and kern of slivers are left out.
    """
    whole = np.where(joints.sliver, np.nan, 1.0)
    values = {
        "pressure": joints.pressure_max * whole,
        "kern": joints.kern * whole,
        "opening": joints.opening,
        "sliding": joints.sliding,
        "friction_use": joints.friction_use,
    }
    return {f"joint_{name}": _largest(joints.bodies, value, count) for name, value in values.items()}


def _peak_values(peaks: Peaks | None) -> dict[str, Array]:
    """Return the largest values (nb,) of each stone during the run; NaN where not known."""
    if peaks is None:
        return {}
    return {
        "displacement_peak": peaks.displacement.value,
        "displacement_peak_time": peaks.displacement.time,
        "relative_displacement_peak": peaks.relative.value,
        "joint_opening_peak": peaks.opening.value,
        "joint_sliding_peak": peaks.sliding.value,
        "joint_pressure_peak": peaks.pressure.value,
        "von_mises_peak": peaks.von_mises.value,
    }


def _largest(bodies: Ints, values: Array, count: int) -> Array:
    """Return the largest value (n,) over the pairs of bodies (n, 2) that each body (count,) is in; NaN without one."""
    largest = np.full(count, -np.inf)
    finite = np.isfinite(values)
    for side in (0, 1):
        np.maximum.at(largest, bodies[finite, side], values[finite])
    return np.where(np.isfinite(largest), largest, np.nan)
