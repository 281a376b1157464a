"""Quantities of interest of a run, by which two runs of one scene can be compared, rigid or not, on any mesh.

None of them refers to nodes, since meshes differ. Stresses and displacements are those of a whole stone, forces those
of a whole joint or support, since forces at single points of a hyperstatic structure are not unique.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from mechanics.arrays import Array
from mechanics.results.result import BodyResult, Result
from mechanics.scene.scene import Fidelity
from pipelines.results.stone_values import stress_statistics
from survey.conventions import SAME

QUANTITIES: Mapping[str, str] = {
    "outcome": "1 if the scene ends otherwise, else 0",
    "von_mises_max": "largest Von Mises stress",
    "von_mises_p99": "Von Mises stress exceeded in 1 % of the volume",
    "von_mises_mean": "mean Von Mises stress",
    "stone_von_mises_p99": "the same of each stone: exceeded in 1 % of its volume",
    "stone_von_mises_mean": "mean Von Mises stress of each stone",
    "support_reactions": "vertical reaction of each fixed stone",
    "joint_forces": "resultant between each two stones",
    "displacement": "largest displacement",
    "stone_displacement": "mean displacement of each stone",
    "settlement": "how far the stone that sank most has sunk: the crown of an arch",
    "natural_map": "η, how far contacts are from their laws",
    "penetration": "deepest overlap over the smallest stone's size",
    "balance": "unbalanced force of a stone over its weight",
    "reaction": "vertical reaction of all supports against weight and loads",
    "energy": "energy that no term of the balance explains",
}
"""Quantities and their meanings. The last five have a true value of zero: they are errors themselves."""

_OWN_ERRORS = ("natural_map", "penetration", "balance", "reaction", "energy")
_NO_MOVEMENT = SAME  # of the size of a stone [-]; overlaps of rigid stones at rest are smaller


@dataclass(frozen=True)
class StoneQuantities:
    """One stone that is not fixed.

    Attributes
    ----------
    volume : of the stone [m³]
    displacement : (3,) mean over its volume; for a rigid stone, over its corners [m]
    von_mises_max, von_mises_p99, von_mises_mean : None if rigid [Pa]
    stress_error : relative error of its stress as Zienkiewicz & Zhu (1987) estimate it; None if rigid [-]
    """

    volume: float
    displacement: tuple[float, ...]
    von_mises_max: float | None = None
    von_mises_p99: float | None = None
    von_mises_mean: float | None = None
    stress_error: float | None = None


@dataclass(frozen=True)
class Quantities:
    """Quantities of interest of a run.

    Attributes
    ----------
    outcome : of the run
    size : of a typical stone: cube root of the median volume [m]
    von_mises_max, von_mises_p99, von_mises_mean : over all deformable stones; None if none deforms [Pa]
    stones : by code, those that are not fixed
    support_reactions : of each fixed stone on the stones that it supports, against gravity [N]
    joint_forces : (3,) resultant on the first of two stones, by their codes as "first|second" in alphabetical order [N]
    displacement : largest of all points [m]
    settlement : of the stone that sank most [m]
    errors : those of mechanics.results.result.Errors that are measured against zero; None where unknown [-]
    """

    outcome: str
    size: float
    von_mises_max: float | None
    von_mises_p99: float | None
    von_mises_mean: float | None
    stones: Mapping[str, StoneQuantities]
    support_reactions: Mapping[str, float]
    joint_forces: Mapping[str, tuple[float, ...]]
    displacement: float
    settlement: float
    errors: Mapping[str, float | None]

    @property
    def stress_error(self) -> float | None:
        """Estimated error of the stress of all stones, weighted by volume and squared stress [-]."""
        weighted = [
            (stone.stress_error, stone.volume * stone.von_mises_mean**2)
            for stone in self.stones.values()
            if stone.stress_error is not None and stone.von_mises_mean is not None
        ]
        total = sum(weight for _, weight in weighted)
        if total == 0.0:
            return None
        return math.sqrt(sum(error**2 * weight for error, weight in weighted) / total)

    def as_record(self) -> dict[str, Any]:
        """Return plain numbers and texts, for JSON; `quantities_from` reads them."""
        return asdict(self)


def quantities(result: Result) -> Quantities:
    """Compute the quantities of interest of a result."""
    stress = stress_statistics(result)
    moving = [body for body in result.bodies if body.fidelity is not Fidelity.FIXED]
    forces = _joint_forces(result)
    return Quantities(
        outcome=str(result.outcome),
        size=float(np.median([body.volume for body in moving])) ** (1 / 3) if moving else 0.0,
        von_mises_max=None if stress is None else stress.max,
        von_mises_p99=None if stress is None else stress.p99,
        von_mises_mean=None if stress is None else stress.mean,
        stones={body.code: _stone(body) for body in moving},
        support_reactions=_support_reactions(result),
        joint_forces={
            f"{first}|{second}": tuple(force.tolist()) for (first, second), force in forces.items()
        },
        displacement=max(float(np.linalg.norm(body.displacement, axis=1).max()) for body in result.bodies),
        settlement=float(result.history.settlement[-1]),
        errors={name: _known(getattr(result.errors, name)) for name in _OWN_ERRORS},
    )


def quantities_from(record: Mapping[str, Any]) -> Quantities:
    """Read the quantities that `Quantities.as_record` returned."""
    stones = {
        code: StoneQuantities(**stone | {"displacement": tuple(stone["displacement"])})
        for code, stone in record["stones"].items()
    }
    joints = {pair: tuple(force) for pair, force in record["joint_forces"].items()}
    return Quantities(**{**record, "stones": stones, "joint_forces": joints})


def differences(compared: Quantities, reference: Quantities) -> dict[str, float | None]:
    """Compute the relative error of each of QUANTITIES; None where one of the two runs does not give it.

    With the values a of a run and b of the reference: |a - b| / |b| for single numbers; Σ|a - b| / Σ|b| for the
    reactions; √(Σ‖a - b‖² / Σ‖b‖²) for joints, and likewise for stones, weighted by volume. The last five are the
    run's own errors, whatever those of the reference. Stresses are compared over the stones that deform in both runs;
    the p99 of all is known only if those are the same stones. Reference movements below 10⁻⁶ of a stone's size count
    as that.
    """
    both = [
        (compared.stones[code], stone) for code, stone in reference.stones.items() if code in compared.stones
    ]
    stressed = [(a, b) for a, b in both if a.von_mises_max is not None and b.von_mises_max is not None]
    ours, theirs = [a for a, _ in stressed], [b for _, b in stressed]
    alike = _stressed(compared) == _stressed(reference)
    still = _NO_MOVEMENT * reference.size
    return {
        "outcome": float(compared.outcome != reference.outcome),
        "von_mises_max": _apart(_largest(ours), _largest(theirs)),
        "von_mises_p99": _apart(compared.von_mises_p99, reference.von_mises_p99) if alike else None,
        "von_mises_mean": _apart(_mean(ours), _mean(theirs)),
        "stone_von_mises_p99": _field_apart(stressed, "von_mises_p99"),
        "stone_von_mises_mean": _field_apart(stressed, "von_mises_mean"),
        "support_reactions": _reactions_apart(compared.support_reactions, reference.support_reactions),
        "joint_forces": _forces_apart(compared.joint_forces, reference.joint_forces),
        "displacement": _apart(compared.displacement, reference.displacement, still),
        "stone_displacement": _field_apart(both, "displacement", still),
        "settlement": _apart(compared.settlement, reference.settlement, still),
        **compared.errors,
    }


def _stone(body: BodyResult) -> StoneQuantities:
    moved = np.average(body.displacement, axis=0, weights=body.node_volume)
    values = body.values
    return StoneQuantities(
        volume=body.volume,
        displacement=tuple(moved.tolist()),
        von_mises_max=None if values is None else values.von_mises_max,
        von_mises_p99=None if values is None else values.von_mises_p99,
        von_mises_mean=None if values is None else values.von_mises_mean,
        stress_error=None if values is None else _known(values.error),
    )


def _support_reactions(result: Result) -> dict[str, float]:
    """Compute the force of each fixed stone on those that it supports, against gravity, or along z without it [N]."""
    gravity = np.array(result.scene.gravity)
    size = float(np.linalg.norm(gravity))
    up = -gravity / size if size > 0.0 else np.array([0.0, 0.0, 1.0])
    lift = result.contacts.force @ up
    count = len(result.bodies)
    first, second = result.contacts.bodies.reshape(-1, 2).T
    # the force acts on the first, which the second supports
    total = np.bincount(second, lift, count) - np.bincount(first, lift, count)
    return {
        body.code: float(total[number])
        for number, body in enumerate(result.bodies)
        if body.fidelity is Fidelity.FIXED
    }


def _joint_forces(result: Result) -> dict[tuple[str, str], Array]:
    """Compute the resultant of the contacts between each two stones, on the one whose code comes first [N]."""
    codes = [body.code for body in result.bodies]
    total: dict[tuple[str, str], Array] = defaultdict(lambda: np.zeros(3))
    for (first, second), force in zip(result.contacts.bodies.tolist(), result.contacts.force, strict=True):
        first_code, second_code = codes[first], codes[second]
        if first_code < second_code:
            total[first_code, second_code] += force
        else:
            total[second_code, first_code] -= force
    return dict(sorted(total.items()))


def _known(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def _number(value: float | None) -> float:
    return math.nan if value is None else value


def _apart(value: float | None, reference: float | None, least: float = 0.0) -> float | None:
    if value is None or reference is None:
        return None
    scale = max(abs(reference), least)
    return abs(value - reference) / scale if scale > 0.0 else None


def _stressed(of: Quantities) -> set[str]:
    return {code for code, stone in of.stones.items() if stone.von_mises_max is not None}


def _largest(stones: Iterable[StoneQuantities]) -> float | None:
    return max((_number(stone.von_mises_max) for stone in stones), default=None)


def _mean(stones: Iterable[StoneQuantities]) -> float | None:
    """Return the mean stress of stones, weighted by volume."""
    weighted = [(_number(stone.von_mises_mean), stone.volume) for stone in stones]
    volume = sum(weight for _, weight in weighted)
    return sum(mean * weight for mean, weight in weighted) / volume if volume > 0.0 else None


def _field_apart(
    pairs: list[tuple[StoneQuantities, StoneQuantities]], name: str, least: float = 0.0
) -> float | None:
    """Return the difference of a value of each stone over the value, both as root mean squares over the volume."""
    if not pairs:
        return None
    values, true = (
        np.array([getattr(pair[side], name) for pair in pairs], dtype=float).reshape(len(pairs), -1)
        for side in (0, 1)
    )
    volume = np.array([reference.volume for _, reference in pairs])
    apart, scale = (
        float(np.sqrt(np.average((field**2).sum(axis=1), weights=volume))) for field in (values - true, true)
    )
    scale = max(scale, least)
    return apart / scale if scale > 0.0 else None


def _reactions_apart(reactions: Mapping[str, float], reference: Mapping[str, float]) -> float | None:
    scale = sum(map(abs, reference.values()))
    return (
        sum(abs(reactions.get(code, 0.0) - force) for code, force in reference.items()) / scale
        if scale
        else None
    )


def _forces_apart(
    forces: Mapping[str, tuple[float, ...]], reference: Mapping[str, tuple[float, ...]]
) -> float | None:
    """Return the relative difference of joint forces; in a run where two stones do not touch, their force is zero."""
    none = (0.0, 0.0, 0.0)
    true = {pair: np.array(reference.get(pair, none)) for pair in {*forces, *reference}}
    scale = sum(float(force @ force) for force in true.values())
    apart = sum(
        float(np.sum((np.array(forces.get(pair, none)) - force) ** 2)) for pair, force in true.items()
    )
    return math.sqrt(apart / scale) if scale > 0.0 else None
