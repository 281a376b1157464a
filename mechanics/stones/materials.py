"""Linear elastic materials."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechanics.arrays import Array
from mechanics.stones.validation import LARGEST, sane
from moma.errors import SceneError

__all__ = ["Material", "Orthotropy", "fourth_order"]


# tensor components of the six stresses and strains, in the order xx, yy, zz, xy, yz, zx
_FIRST, _SECOND = (0, 1, 2, 0, 1, 2), (0, 1, 2, 1, 2, 0)
_ORTHONORMAL = 1e-6  # largest difference of a product of axes from 0 or 1
_WORLD_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Orthotropy:
    """Elasticity with three planes of symmetry, as of bedded stone or of homogenised masonry.

    Attributes
    ----------
    young : E₁, E₂, E₃ along the axes [Pa]
    shear : shear moduli G₁₂, G₂₃, G₃₁ [Pa]
    poisson : ν₁₂, ν₂₃, ν₃₁ [-]; ν_ij is minus the strain along j over that along i under a stress along i
    axes : unit vectors of the three axes in the scene's initial state, right angles between them [-]
    """

    young: tuple[float, float, float]
    shear: tuple[float, float, float]
    poisson: tuple[float, float, float]
    axes: tuple[tuple[float, float, float], ...] = _WORLD_AXES


@dataclass(frozen=True)
class Material:
    """A linear elastic material.

    >>> limestone = Material("limestone", density=2350.0, young=12e9, poisson=0.2)
    >>> round(float(limestone.stiffness[3, 3]) / 1e9, 12)  # the shear modulus [GPa]
    5.0

    Attributes
    ----------
    name : as in the scene
    density : ρ [kg/m³]
    young : Young's modulus E [Pa]; not used by rigid blocks
    poisson : Poisson's ratio ν [-], 0 ≤ ν < 0.5; above about 0.4 linear elements are too stiff: use quadratic ones
    mass_damping, stiffness_damping : α [1/s] and β [s] of Rayleigh's damping V = α M + β K
    tensile_strength, compressive_strength : both positive [Pa]; None: unknown
    orthotropy : replaces young and poisson; None: isotropic
    """

    name: str
    density: float
    young: float
    poisson: float
    mass_damping: float = 0.0
    stiffness_damping: float = 0.0
    tensile_strength: float | None = None
    compressive_strength: float | None = None
    orthotropy: Orthotropy | None = None

    def __post_init__(self) -> None:
        for quantity, ok, remedy in (
            ("density", sane(self.density), "give kg/m³ greater than 0"),
            ("young", sane(self.young), "give pascals greater than 0"),
            ("poisson", 0 <= self.poisson < 0.5, "give a ratio from 0 up to, but not including, 0.5"),
            ("mass_damping", 0 <= self.mass_damping <= LARGEST, "give 1/s, 0 or greater"),
            ("stiffness_damping", 0 <= self.stiffness_damping <= LARGEST, "give seconds, 0 or greater"),
            ("tensile_strength", _unknown_or_positive(self.tensile_strength), "give pascals greater than 0"),
            (
                "compressive_strength",
                _unknown_or_positive(self.compressive_strength),
                "give pascals greater than 0",
            ),
        ):
            if not ok:
                raise SceneError(
                    f"{quantity} = {getattr(self, quantity)!r}",
                    where=f"material {self.name!r}",
                    remedy=remedy,
                )
        if self.orthotropy is not None:
            _check_orthotropy(self.orthotropy, f"material {self.name!r}")

    @cached_property
    def stiffness(self) -> Array:
        """C (6, 6) of σ = C ε, order xx, yy, zz, xy, yz, zx, shear strains γ = 2ε, scene axes [Pa]; read-only."""
        if self.orthotropy is None:
            stiffness = _isotropic(self.young, self.poisson)
        else:
            own = np.linalg.inv(_compliance(self.orthotropy)).astype(np.float64)
            stiffness = _turned(own, np.array(self.orthotropy.axes, dtype=float))
        stiffness.flags.writeable = False
        return stiffness


def _unknown_or_positive(strength: float | None) -> bool:
    return strength is None or strength > 0


def _isotropic(young: float, poisson: float) -> Array:
    shear = young / (2 * (1 + poisson))
    stiffness = np.diag([2 * shear] * 3 + [shear] * 3)
    stiffness[:3, :3] += young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    return stiffness


def _compliance(orthotropy: Orthotropy) -> Array:
    """Return C⁻¹ (6, 6) in the axes of the material [1/Pa] (Ting 1996, §2.4)."""
    young, poisson = orthotropy.young, orthotropy.poisson
    compliance = np.diag([1.0 / modulus for modulus in (*young, *orthotropy.shear)])
    for i, j, ratio, modulus in zip((0, 1, 2), (1, 2, 0), poisson, young, strict=True):
        compliance[i, j] = compliance[j, i] = -ratio / modulus
    return compliance


def fourth_order(stiffness: Array) -> Array:
    """Return the tensor c_ijkl (3, 3, 3, 3) of a matrix C (6, 6), order xx, yy, zz, xy, yz, zx."""
    number = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])
    tensor: Array = stiffness[number[:, :, None, None], number]
    return tensor


def _turned(stiffness: Array, axes: Array) -> Array:
    """Return the matrix C in the axes in which the rows of `axes` are given."""
    turned = np.einsum("ijkl,ia,jb,kc,ld->abcd", fourth_order(stiffness), axes, axes, axes, axes)
    voigt = turned[_FIRST, _SECOND][:, _FIRST, _SECOND]
    result: Array = 0.5 * (voigt + voigt.T)
    return result


def _check_orthotropy(orthotropy: Orthotropy, where: str) -> None:
    for quantity, least, remedy in (
        ("young", 0.0, "give three values in pascals greater than 0"),
        ("shear", 0.0, "give three values in pascals greater than 0"),
        ("poisson", -np.inf, "give three ratios"),
    ):
        values = getattr(orthotropy, quantity)
        if len(values) != 3 or not all(least < value <= LARGEST for value in values):
            raise SceneError(f"orthotropy {quantity} = {values!r}", where=where, remedy=remedy)
    axes = np.array(orthotropy.axes, dtype=float)
    if axes.shape != (3, 3) or not np.allclose(axes @ axes.T, np.eye(3), rtol=0, atol=_ORTHONORMAL):
        raise SceneError(
            f"orthotropy axes = {orthotropy.axes!r}",
            where=where,
            remedy="give three unit vectors at right angles",
        )
    # scaled by the moduli, so that the bound means the same for every material
    scale = np.sqrt(np.array([*orthotropy.young, *orthotropy.shear]))
    least = float(np.linalg.eigvalsh(_compliance(orthotropy) * np.outer(scale, scale))[0])
    if not least > 0:
        raise SceneError(
            f"orthotropy poisson = {orthotropy.poisson!r}: some strain would release energy",
            where=where,
            remedy="give smaller ratios: |ν_ij| < √(E_i/E_j) and 1 - Σ ν_ij ν_ji - 2 ν₁₂ ν₂₃ ν₃₁ > 0",
        )
