"""Expected errors of a run at a profile, from measurements on reference scenes and the run's own estimates.

The estimates scale errors of different scenes to each other (docs/accuracy.md §12): for elastic stones the error of
their stress after Zienkiewicz and Zhu; for rigid ones the fraction of joints that statics leaves undetermined.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mechanics.dynamics.outcome import Outcome
from mechanics.results.result import Result
from mechanics.scene.scene import Fidelity
from pipelines.results.quantities import QUANTITIES, Quantities, quantities
from pipelines.scene.file import SceneFile
from pipelines.tuning.measured_errors import COLLAPSE, ERRORS
from pipelines.tuning.overlay import overlay_record
from pipelines.tuning.profiles import profile_named

TYPICAL = ("stone_von_mises_p99",)
"""Quantities whose errors hardly vary between structures: a typical error is given."""

BOUNDS = (
    *("stone_von_mises_mean", "von_mises_mean", "von_mises_p99", "joint_forces", "support_reactions"),
    *("displacement", "stone_displacement", "settlement"),
)
"""Quantities whose errors may cancel, or whose forces are undetermined: an upper bound is given."""

_MOVEMENTS = ("displacement", "stone_displacement", "settlement")
_FORCES = ("joint_forces", "support_reactions")
_MIN_ERROR = 1e-4  # expected relative error from solver and balance alone, where statics determines all [-]


@dataclass(frozen=True)
class Expected:
    """An expected relative error of one quantity.

    Attributes
    ----------
    value : as `pipelines.results.quantities.differences` defines it [-]
    of : the quantity in words
    bound : the error may well be less
    """

    value: float
    of: str
    bound: bool


@dataclass(frozen=True)
class ProfileReport:
    """A profile and the errors to expect at it.

    Attributes
    ----------
    name, about : of the profile
    settings : those of the profile
    expected : by quantity; empty if the scene has not come to rest, for which no measurements exist
    """

    name: str
    about: str
    settings: Mapping[str, Any]
    expected: Mapping[str, Expected]


def profile_report(name: str | None, scene: SceneFile, result: Result) -> ProfileReport | None:
    """Return the report on the profile of a run; None without one."""
    if name is None:
        return None
    profile, found = profile_named(name), quantities(result)
    rigid = any(body.fidelity is Fidelity.RIGID for body in result.bodies)
    return ProfileReport(
        name,
        profile.about,
        overlay_record(profile.overlay(scene.time)),
        expected_errors(name, found, loops(result), rigid=rigid),
    )


def expected_errors(
    name: str, quantities_found: Quantities, free: float, *, rigid: bool
) -> dict[str, Expected]:
    """Return the errors to expect of a run at a profile.

    Parameters
    ----------
    name : of the profile
    quantities_found : quantities of the run
    free : fraction of its joints that statics leaves undetermined, see `loops`
    rigid : some of its stones are rigid
    """
    if not Outcome(quantities_found.outcome).rests:
        return {}
    expected = {}
    for quantity in (*TYPICAL, *BOUNDS):
        value = _expected(name, quantity, quantities_found.stress_error, free, rigid)
        if value is not None:
            value = max(min(value, 1.0), _MIN_ERROR)
            expected[quantity] = Expected(value, QUANTITIES[quantity], quantity in BOUNDS)
    of = "load of collapse, if it is sought at this profile"
    return expected | {"collapse": Expected(COLLAPSE[name], of, bound=True)}


def _expected(name: str, quantity: str, stress_error: float | None, free: float, rigid: bool) -> float | None:
    """Return one expected error; None without an estimate to scale it by."""
    if stress_error is None and (not rigid or quantity not in (*_FORCES, *_MOVEMENTS)):
        return None
    # elastic stones in fast have the mesh of balanced
    elastic = ERRORS["balanced" if name == "fast" else name]
    if quantity in _FORCES:
        # a reaction is a force in a joint; where it was more accurate, that is due to the structure
        ratio = max((ERRORS["fast"] if rigid else elastic)[force][0] for force in _FORCES)
        return ratio * measure(quantity, None if rigid else stress_error, free)
    if quantity in _MOVEMENTS:
        ratio, _, _ = (ERRORS["fast"] if rigid else elastic)[quantity]
        return ratio * measure(quantity, None if rigid else stress_error, free)
    value = elastic[quantity][0] * measure(quantity, stress_error, free)
    if not rigid:
        return value
    # the forces on them carry the error of rigid neighbours
    forces = _expected(name, "joint_forces", stress_error, free, rigid)
    return value if forces is None else math.hypot(value, forces)


def measure(quantity: str, stress_error: float | None, free: float) -> float:
    """Return the measure to which the error of a quantity is proportional from scene to scene [-].

    Parameters
    ----------
    quantity : of TYPICAL or BOUNDS
    stress_error : of elastic stones, as Zienkiewicz and Zhu estimate it; None for rigid ones
    free : fraction of joints that statics leaves undetermined: model errors do not change the forces in the others
    """
    if stress_error is None:
        # where a fraction of the forces is arbitrary, the root mean square grows with the root of that fraction
        return 1.0 if quantity in _MOVEMENTS else math.sqrt(free)
    return stress_error * (free if quantity in _FORCES else 1.0)


def loops(result: Result) -> float:
    """Return the fraction of pressed joints that could be cut without disconnecting a stone from the ground [-].

    It is zero for a column, and one over the number of joints for an arch.
    """
    fixed = [body.fidelity is Fidelity.FIXED for body in result.bodies]
    pairs = {
        frozenset(-1 if fixed[body] else body for body in pair)
        for pair in result.joints.bodies[result.joints.pressed].tolist()
    }
    return max(0, len(pairs) - fixed.count(False)) / len(pairs) if pairs else 0.0
