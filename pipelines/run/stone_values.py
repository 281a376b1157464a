"""Numbers of a result, by stone and over the scene: what tables, database and reports show."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from archmodel.store.run_record import StoneResult
from mechanics.results.contact_result import JointResult
from mechanics.results.result import BodyResult, Result
from mechanics.results.stress_values import StressValues, volume_quantile
from pipelines.arrays import Array, Ints

__all__ = ["StressStatistics", "stone_results", "stress_statistics"]


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
    """Statistics of the Von Mises stress; None if no stone deforms."""
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


def stone_results(result: Result) -> tuple[StoneResult, ...]:
    """What goes back to the database, one per stone, in the scene's order."""
    force = np.linalg.norm(result.contacts.force, axis=1)
    largest = _largest(result.contacts.bodies, force, len(result.bodies))
    of_joints = _joint_values(result.joints, len(result.bodies))
    return tuple(
        StoneResult(
            code=body.code,
            fidelity=str(body.fidelity),
            von_mises_max=None if body.values is None else body.values.von_mises_max,
            von_mises_mean=None if body.values is None else body.values.von_mises_mean,
            displacement_max=float(np.linalg.norm(body.displacement, axis=1).max()),
            contact_force_max=None if np.isnan(largest[number]) else float(largest[number]),
            values=_values(body, {name: float(one[number]) for name, one in of_joints.items()}),
        )
        for number, body in enumerate(result.bodies)
    )


def _values(body: BodyResult, of_joints: Mapping[str, float]) -> dict[str, float]:
    """The named values of a stone, those that are known; archmodel.store.run_record.STONE_VALUES says what they are."""
    values: dict[str, float | None] = {"volume": body.volume, "mass": body.mass, **of_joints}
    if body.values is not None:
        values |= _stresses(body.values)
    return {name: value for name, value in values.items() if value is not None and np.isfinite(value)}


def _stresses(stress: StressValues) -> dict[str, float | None]:
    return {
        "von_mises_p99": stress.von_mises_p99,
        "principal_tension": stress.principal_tension,
        "principal_compression": stress.principal_compression,
        "mean_pressure": stress.mean_pressure,
        "tension_zone": stress.tension_zone,
        "overstressed_zone": stress.overstressed_zone,
        "utilisation": stress.utilisation,
        "utilisation_tension": stress.utilisation_tension,
        "utilisation_compression": stress.utilisation_compression,
        "stress_error": stress.error,
    }


def _joint_values(joints: JointResult, count: int) -> dict[str, Array]:
    """(nb,) the worst of the joints of each stone; NaN where it has none of which there is something to say."""
    return {
        f"joint_{name}": _largest(joints.bodies, getattr(joints, attribute), count)
        for name, attribute in (
            ("pressure", "pressure_max"),
            ("kern", "kern"),
            ("opening", "opening"),
            ("sliding", "sliding"),
            ("friction_use", "friction_use"),
        )
    }


def _largest(bodies: Ints, values: Array, count: int) -> Array:
    """Largest of the values (n,) of the pairs of bodies (n, 2) that each body (count,) is in; NaN without one."""
    largest = np.full(count, -np.inf)
    known = np.isfinite(values)
    for side in (0, 1):
        np.maximum.at(largest, bodies[known, side], values[known])
    return np.where(np.isfinite(largest), largest, np.nan)
