"""What error a run at a profile is expected to have: numbers measured on reference scenes, and the run's own estimates.

The estimates are those by which errors of different scenes become alike (docs/accuracy.md §12): of elastic stones the
error of their stress after Zienkiewicz and Zhu; of rigid ones the part of the joints that statics leaves free.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mechanics.results.result import Outcome, Result
from mechanics.scene.scene import Fidelity
from pipelines.results.quantities import QUANTITIES, Quantities, quantities
from pipelines.scene.file import SceneFile
from pipelines.tuning.measured_errors import COLLAPSE, ERRORS
from pipelines.tuning.overlay import overlay_record
from pipelines.tuning.profiles import profile_named

__all__ = [
    "BOUNDS",
    "TYPICAL",
    "Expected",
    "ProfileReport",
    "expected_errors",
    "loops",
    "measure",
    "profile_report",
]

TYPICAL = ("stone_von_mises_p99",)
"""Where errors are much alike from structure to structure: a typical error is told."""

BOUNDS = (
    "stone_von_mises_mean",
    "von_mises_mean",
    "von_mises_p99",
    "joint_forces",
    "support_reactions",
    "displacement",
    "stone_displacement",
    "settlement",
)
"""Others, where errors may cancel or forces are free: the largest is told that the reference scenes let expect."""

_MOVEMENTS = ("displacement", "stone_displacement", "settlement")
_FORCES = ("joint_forces", "support_reactions")
# what solver and balance leave, where statics decides all
_LEAST = 1e-4


@dataclass(frozen=True)
class Expected:
    """A relative error that is to be expected, and of what.

    Attributes
    ----------
    value : as `pipelines.results.quantities.differences` has it [-]
    of : the quantity in words
    bound : whether the error may well be less
    """

    value: float
    of: str
    bound: bool


@dataclass(frozen=True)
class ProfileReport:
    """A profile, and what it gave.

    Attributes
    ----------
    name, about : of the profile
    settings : that it has set
    expected : by quantity; empty if the scene has not come to rest, for which nothing was measured
    """

    name: str
    about: str
    settings: Mapping[str, Any]
    expected: Mapping[str, Expected]


def profile_report(name: str | None, scene: SceneFile, result: Result) -> ProfileReport | None:
    """What a run at a profile is told of it; None without one."""
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


def expected_errors(name: str, found: Quantities, free: float, *, rigid: bool) -> dict[str, Expected]:
    """The errors to expect of a run at a profile.

    Parameters
    ----------
    name : of the profile
    found : what the run gave
    free : part of its joints that statics leaves free, as `loops` has it
    rigid : whether some of its stones are
    """
    if found.outcome != Outcome.EQUILIBRIUM:
        return {}
    expected = {}
    for quantity in (*TYPICAL, *BOUNDS):
        value = _expected(name, quantity, found.stress_error, free, rigid)
        if value is not None:
            value = max(min(value, 1.0), _LEAST)
            expected[quantity] = Expected(value, QUANTITIES[quantity], quantity in BOUNDS)
    of = "load of collapse, if it is sought at this profile"
    return expected | {"collapse": Expected(COLLAPSE[name], of, bound=True)}


def _expected(name: str, quantity: str, stress_error: float | None, free: float, rigid: bool) -> float | None:
    """One expected error; None if there is nothing by which to tell it."""
    if stress_error is None and (not rigid or quantity not in (*_FORCES, *_MOVEMENTS)):
        return None
    # elastic stones of fast have the mesh of balanced
    elastic = ERRORS["balanced" if name == "fast" else name]
    if quantity in _FORCES:
        # a reaction is a force in a joint: where it is more exact, that is the structure's merit
        ratio = max((ERRORS["fast"] if rigid else elastic)[one][0] for one in _FORCES)
        return ratio * measure(quantity, None if rigid else stress_error, free)
    if quantity in _MOVEMENTS:
        ratio, _, _ = (ERRORS["fast"] if rigid else elastic)[quantity]
        return ratio * measure(quantity, None if rigid else stress_error, free)
    value = elastic[quantity][0] * measure(quantity, stress_error, free)
    if not rigid:
        return value
    # the forces on them are as wrong as rigid neighbours leave them
    forces = _expected(name, "joint_forces", stress_error, free, rigid)
    return value if forces is None else math.hypot(value, forces)


def measure(quantity: str, stress_error: float | None, free: float) -> float:
    """That to which the error of a quantity is in proportion, from scene to scene [-].

    Parameters
    ----------
    quantity : of TYPICAL or BOUNDS
    stress_error : of elastic stones, as Zienkiewicz and Zhu estimate it; None of rigid ones
    free : part of the joints that statics leaves free: no error of a model changes the forces in the others
    """
    if stress_error is None:
        # of forces of which a part is arbitrary, the root mean square goes with the root of that part
        return 1.0 if quantity in _MOVEMENTS else math.sqrt(free)
    return stress_error * (free if quantity in _FORCES else 1.0)


def loops(result: Result) -> float:
    """The part of the pressed joints that could be cut without any stone losing its last tie to the ground [-].

    A column has none; an arch one in as many as it has joints.
    """
    fixed = [body.fidelity is Fidelity.FIXED for body in result.bodies]
    pairs = {
        frozenset(-1 if fixed[body] else body for body in pair)
        for pair in result.joints.bodies[result.joints.pressed].tolist()
    }
    return max(0, len(pairs) - fixed.count(False)) / len(pairs) if pairs else 0.0
