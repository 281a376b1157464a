"""Cautions about what a loading test starts from: stiffness of dry joints, the step, and the pressure."""

from collections.abc import Iterator

import numpy as np

from mechanics.limit.loading_test import softening_step
from mechanics.scene.laws.law import Law
from mechanics.scene.rig import Rig
from mechanics.scene.scene import Scene
from mechanics.stones.polyhedra import mass_properties
from survey.conventions import SAME

# stiffness of dry joints above all that were measured in a first loading, 5.9 to 12.9 GPa/m up to 1.25 MPa [Pa/m]
_STIFF_DRY = 15e9
# mean pressure above which measured dry walls lost force after their peak [Pa]
_PRESSED_DRY = 0.5e6
# of lengths and forces, over themselves [-]
_SIZE_ROUNDING = SAME


def rig_cautions(stones: Scene, rig: Rig, step: float | None) -> list[str]:
    """Return the cautions about what the test starts from.

    Parameters
    ----------
    stones : their laws
    rig : with the vertical force
    step : way of one step, if one is asked for [m]
    """
    resolved = softening_step(stones)
    cautions = list(_stiff_joints(stones))
    if step is not None and step > resolved * (1.0 + _SIZE_ROUNDING):
        cautions.append(
            f"steps of {1e3 * step:.3g} mm are too long for the softening of bonds, whose whole way is 2 G/c: forces "
            f"after the first crack depend on them; leave step out, or give {1e3 * resolved:.3g} mm at most"
        )
    pressure = _mean_pressure(stones, rig)
    if all(_is_dry(law) for law in _laws(stones)) and pressure > _PRESSED_DRY * (1.0 + _SIZE_ROUNDING):
        cautions.append(
            f"dry joints under {1e-6 * pressure:.3g} MPa on average: loss of force after the peak is not modelled "
            f"(above {1e-6 * _PRESSED_DRY:g} MPa, measured forces fall by 25 to 45 % by 15 to 25 mm)"
        )
    return cautions


def _laws(stones: Scene) -> tuple[Law, ...]:
    """Return the laws that joints of the scene have: those of rules, and the general one where rules leave joints."""
    return (*dict.fromkeys(rule.law for rule in stones.contact.rules),) or (stones.contact.law,)


def _is_dry(law: Law) -> bool:
    """Return whether joints of a law hold neither tension nor shear without pressure."""
    return not any(getattr(law, name, 0.0) > 0 for name in ("tension", "shear", "cohesion"))


def _stiff_joints(stones: Scene) -> Iterator[str]:
    for law in _laws(stones):
        stiffness = law.normal_stiffness
        if _is_dry(law) and stiffness is not None and stiffness > _STIFF_DRY:
            yield (
                f"dry joints of {1e-9 * stiffness:.3g} GPa/m: in first loading 5.9 to 12.9 GPa/m were measured "
                "under 0.15 to 1.25 MPa, and moduli of loading cycles are several times too stiff for a first push"
            )


def _mean_pressure(stones: Scene, rig: Rig) -> float:
    """Return the vertical force of the rig over the mean horizontal section of the stones [Pa]."""
    heights = np.concatenate([block.vertices[:, 2] for block in stones.blocks])
    volume = sum(mass_properties(block.vertices, block.faces, block.code).volume for block in stones.blocks)
    return float(rig.load * np.ptp(heights) / volume)
