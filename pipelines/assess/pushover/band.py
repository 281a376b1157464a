"""A band about a capacity curve: what the scatter of materials and load makes of it, to first order.

Each parameter is raised by its standard deviation in a test of its own. With the differences Δ_i of the force at a
displacement, and parameters that are independent and normal, the force scatters by √ΣΔ_i² about the curve of the
means. A level p then has the half-width z √ΣΔ_i², z the quantile of (1+p)/2.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
from scipy.stats import norm

from mechanics.arrays import Array
from mechanics.limit.loading_test import LoadingTest
from mechanics.scene.laws.law import Law
from mechanics.scene.rig import Rig
from mechanics.scene.scene import Scene

_POINTS = 100  # of the band
_LAWS: Mapping[str, tuple[str, ...]] = {
    "friction": ("friction", "dynamic_friction"),
    "stiffness": ("normal_stiffness", "shear_stiffness", "mortar_young"),
    "tension": ("tension", "energy_tension"),
    "shear": ("shear", "energy_shear"),
    "compressive_strength": ("compressive_strength",),
}  # fields of laws by the names of what scatters


@dataclass(frozen=True)
class Band:
    """Band about a curve.

    Attributes
    ----------
    level : probability within it [-]
    displacement, force, half_width : (n,) on the first branch of the curve [m], [N]
    strength : half-width of the largest force [N]
    parts : change of the largest force by one standard deviation of each parameter [N]
    """

    level: float
    displacement: Array
    force: Array
    half_width: Array
    strength: float
    parts: Mapping[str, float]

    @property
    def curve(self) -> Array:
        """Displacement, least and largest force (n, 3) [m], [N]."""
        return np.column_stack(
            [self.displacement, self.force - self.half_width, self.force + self.half_width]
        )


def varied(scene: Scene, rig: Rig, name: str, factor: float) -> tuple[Scene, Rig]:
    """Return scene and rig with one of `pipelines.scene.pushover.SCATTER` times a factor."""
    if name == "load":
        return scene, replace(rig, load=factor * rig.load)
    if name == "density":
        blocks = tuple(
            replace(block, material=replace(block.material, density=factor * block.material.density))
            for block in scene.blocks
        )
        return replace(scene, blocks=blocks), rig
    contact = scene.contact
    rules = tuple(replace(rule, law=_law(rule.law, name, factor)) for rule in contact.rules)
    return replace(scene, contact=replace(contact, law=_law(contact.law, name, factor), rules=rules)), rig


def _law(law: Law, name: str, factor: float) -> Law:
    assert is_dataclass(law)
    present = {field.name: getattr(law, field.name) for field in fields(law) if field.name in _LAWS[name]}
    changed: Any = replace(
        law, **{key: factor * value for key, value in present.items() if value is not None}
    )
    scaled: Law = changed
    return scaled


def banded(
    mean: LoadingTest,
    scatter: Mapping[str, float],
    level: float,
    tested: Callable[[str, float], LoadingTest],
) -> Band:
    """Return the band about a curve.

    Parameters
    ----------
    mean : the curve
    scatter : coefficients of variation by name [-]
    level : probability within the band [-]
    tested : test with one parameter times a factor
    """
    first = mean.first_branch
    places = np.linspace(0.0, float(np.abs(mean.displacement[:first]).max()), _POINTS)
    places *= np.sign(mean.displacement[first - 1])
    variance, square = np.zeros(_POINTS), 0.0
    force, parts = mean.at(places), dict[str, float]()
    for name, variation in scatter.items():
        shifted = tested(name, 1.0 + variation)
        variance += (shifted.at(places) - force) ** 2
        parts[name] = float(np.abs(shifted.force[:first]).max() - np.abs(mean.force[:first]).max())
        square += parts[name] ** 2
    z = float(norm.ppf(0.5 * (1.0 + level)))
    return Band(level, places, force, z * np.sqrt(variance), z * float(np.sqrt(square)), parts)
