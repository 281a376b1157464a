"""Numbers of a result, by stone and over the scene: what tables, database and reports show."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from archmodel.records import StoneResult
from mechanics.result import BodyResult, Result
from mechanics.scene import Fidelity

__all__ = ["StressStatistics", "node_volumes", "stone_results", "stress_statistics"]

Array = NDArray[np.float64]


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


def node_volumes(body: BodyResult) -> Array:
    """(n,) volume that each node stands for: a quarter of every tetrahedron around it [m³]."""
    corners = body.reference[body.cells]
    edges = corners[:, 1:] - corners[:, :1]
    quarter = np.abs(np.linalg.det(edges)) / 24.0
    return np.bincount(
        body.cells.ravel(), weights=np.repeat(quarter, 4), minlength=len(body.reference)
    ).astype(np.float64)


def stress_statistics(result: Result) -> StressStatistics | None:
    """Statistics of the Von Mises stress; None if no stone deforms."""
    stressed = [(body.von_mises, node_volumes(body)) for body in result.bodies if body.von_mises is not None]
    if not stressed:
        return None
    values = np.concatenate([value for value, _ in stressed])
    volumes = np.concatenate([volume for _, volume in stressed])
    order = np.argsort(values)
    below = np.cumsum(volumes[order]) / volumes.sum()
    p99 = values[order][min(int(np.searchsorted(below, 0.99)), len(values) - 1)]
    return StressStatistics(float(values.max()), float(p99), float(np.average(values, weights=volumes)))


def stone_results(result: Result) -> tuple[StoneResult, ...]:
    """What goes back to the database, one per stone, in the scene's order."""
    largest = _largest_contact_forces(result)
    return tuple(
        StoneResult(
            code=body.code,
            fidelity=str(body.fidelity),
            von_mises_max=None if body.von_mises is None else float(body.von_mises.max()),
            von_mises_mean=_mean_stress(body),
            displacement_max=float(np.linalg.norm(body.displacement, axis=1).max()),
            contact_force_max=None if np.isnan(force) else float(force),
            values={"volume": body.volume, "mass": body.mass},
        )
        for body, force in zip(result.bodies, largest, strict=True)
    )


def _mean_stress(body: BodyResult) -> float | None:
    if body.von_mises is None or body.fidelity is not Fidelity.DEFORMABLE:
        return None
    return float(np.average(body.von_mises, weights=node_volumes(body)))


def _largest_contact_forces(result: Result) -> Array:
    """(nb,) largest force of one contact point of each body [N]; NaN without a contact."""
    force = np.linalg.norm(result.contacts.force, axis=1)
    largest = np.full(len(result.bodies), -np.inf)
    for side in (0, 1):
        np.maximum.at(largest, result.contacts.bodies[:, side], force)
    return np.where(np.isfinite(largest), largest, np.nan)
