"""Linear elastic materials."""

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.stones.settings import check_settings
from mechanics.stones.validation import LARGEST

# tensor components of the six stresses and strains, in the order xx, yy, zz, xy, yz, zx
_FIRST, _SECOND = (0, 1, 2, 0, 1, 2), (0, 1, 2, 1, 2, 0)
Triple = tuple[float, float, float]
_ORTHONORMAL = 1e-6  # largest difference of a product of axes from 0 or 1
_WORLD_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Orthotropy:
    """Elasticity with three planes of symmetry, as of bedded stone or of homogenised masonry.

    ν_ij is minus the strain along j over that along i under a stress along i. The axes are unit vectors.
    """

    young: Annotated[Triple, Setting("Young's moduli E₁, E₂, E₃ along three axes.", "Pa", above=0)]
    shear: Annotated[Triple, Setting("Shear moduli G₁₂, G₂₃, G₃₁.", "Pa", above=0)]
    poisson: Annotated[
        Triple, Setting("Ratios ν₁₂, ν₂₃, ν₃₁; ν_ij: contraction along j under a stress along i.", "-")
    ]
    axes: Annotated[
        tuple[Triple, ...],
        Setting(
            "The three axes, at right angles, in the initial state of the scene. Their lengths do not matter.",
            "-",
        ),
    ] = _WORLD_AXES


@dataclass(frozen=True)
class Material:
    """A linear elastic material.

    >>> limestone = Material("limestone", density=2350.0, young=12e9, poisson=0.2)
    >>> round(float(limestone.stiffness[3, 3]) / 1e9, 12)  # the shear modulus [GPa]
    5.0

    Attributes
    ----------
    name : as in the scene
    poisson : linear elements are too stiff above about 0.4; quadratic ones are not
    tensile_strength, compressive_strength : None if not known
    orthotropy : replaces young and poisson; None: isotropic
    """

    name: str
    density: Annotated[float, Setting("Density ρ.", "kg/m³", above=0)]
    young: Annotated[float, Setting("Young's modulus E; only deformable stones use it.", "Pa", above=0)]
    poisson: Annotated[float, Setting("Poisson's ratio ν.", "-", at_least=0, below=0.5)]
    mass_damping: Annotated[
        float,
        Setting(
            "α of Rayleigh's damping V = α M + β K of deformable stones; it also slows their motion as a whole.",
            "1/s",
            at_least=0,
        ),
    ] = 0.0
    stiffness_damping: Annotated[
        float, Setting("β of Rayleigh's damping; it slows their deformation alone.", "s", at_least=0)
    ] = 0.0
    tensile_strength: Annotated[
        float | None,
        Setting("Tensile strength; without it, no utilisation in tension.", "Pa", above=0, infinite=True),
    ] = None
    compressive_strength: Annotated[
        float | None,
        Setting(
            "Compressive strength, positive; without it, no utilisation in compression.",
            "Pa",
            above=0,
            infinite=True,
        ),
    ] = None
    orthotropy: Orthotropy | None = None

    def __post_init__(self) -> None:
        check_settings(f"material {self.name!r}", self)
        if self.orthotropy is not None:
            _check_orthotropy(self.orthotropy, f"material {self.name!r}")

    @cached_property
    def stiffness(self) -> Array:
        """C (6, 6) of σ = C ε, order xx, yy, zz, xy, yz, zx, shear strains γ = 2ε, scene axes [Pa]; read-only."""
        if self.orthotropy is None:
            stiffness = _isotropic(self.young, self.poisson)
        else:
            principal = np.linalg.inv(_compliance(self.orthotropy)).astype(np.float64)
            stiffness = _turned(principal, np.array(self.orthotropy.axes, dtype=float))
        stiffness.flags.writeable = False
        return stiffness


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
