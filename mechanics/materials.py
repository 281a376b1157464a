"""Isotropic elastic materials."""

from dataclasses import dataclass

from moma.errors import SceneError

__all__ = ["Material"]


@dataclass(frozen=True)
class Material:
    """An isotropic, linear elastic material.

    Attributes
    ----------
    name : as in the scene
    density : ρ [kg/m³]
    young : Young's modulus E [Pa]; not used by rigid blocks
    poisson : Poisson's ratio ν [-], 0 ≤ ν < 0.5
    mass_damping, stiffness_damping : α [1/s] and β [s] of Rayleigh's damping V = α M + β K
    tensile_strength, compressive_strength : both positive [Pa]; None: not known
    """

    name: str
    density: float
    young: float
    poisson: float
    mass_damping: float = 0.0
    stiffness_damping: float = 0.0
    tensile_strength: float | None = None
    compressive_strength: float | None = None

    def __post_init__(self) -> None:
        for quantity, ok, remedy in (
            ("density", self.density > 0, "give kg/m³ greater than 0"),
            ("young", self.young > 0, "give pascals greater than 0"),
            ("poisson", 0 <= self.poisson < 0.5, "give a ratio from 0 up to, but not including, 0.5"),
        ):
            if not ok:
                raise SceneError(
                    f"{quantity} = {getattr(self, quantity)!r}",
                    where=f"material {self.name!r}",
                    remedy=remedy,
                )
