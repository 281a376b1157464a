"""Seismic action at a site, and the place of a mechanism within its building."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.stones.settings import check_settings

_USUAL = 5.0  # damping of the code's spectrum [%]
_MIN_DAMPING_FACTOR = 0.55  # of the factor of damping η [-]
_LAST, _LASTED = 1.6, 4.0  # T_D = 1.6 + 4 ag/g [s]


def damping_factor(damping: float) -> float:
    """Return η = √(10/(5 + ξ)) ≥ 0.55 for a damping ξ [%]."""
    return max(float(np.sqrt(10.0 / (5.0 + damping))), _MIN_DAMPING_FACTOR)


@dataclass(frozen=True)
class Site:
    """Elastic spectrum of the Italian code (NTC 3.2.3.2), and the knowledge of the building.

    Attributes
    ----------
    height : of the mechanism's hinge above the ground; 0: the mechanism begins at the ground
    """

    ag: Annotated[float, Setting("Largest ground acceleration on rock, ag.", "g", above=0)]
    f0: Annotated[float, Setting("Amplification F0 of the spectrum.", "-", at_least=1)]
    tc_star: Annotated[float, Setting("Tc*, from which the period TC follows.", "s", above=0)]
    soil: Annotated[float, Setting("S, soil times topography.", "-", above=0)] = 1.0
    cc: Annotated[float, Setting("CC of the soil: TC = CC Tc*.", "-", at_least=1)] = 1.0
    confidence: Annotated[float, Setting("Factor of confidence FC.", "-", at_least=1)] = 1.35
    behaviour: Annotated[
        float | None, Setting("Behaviour factor q; if not given, that of the code.", "-", at_least=1)
    ] = None
    height: Annotated[float, Setting("Height Z of the hinge above the ground.", "m", at_least=0)] = 0.0
    building_height: Annotated[
        float | None, Setting("Height H of the building; needed where `height` is not 0.", "m", above=0)
    ] = None
    period: Annotated[
        float | None,
        Setting("First period T1 of the building; needed where `height` is not 0.", "s", above=0),
    ] = None
    storeys: Annotated[int, Setting("Storeys N, for γ = 3 N/(2 N + 1).", at_least=1)] = 1
    damping: Annotated[
        float,
        Setting("Equivalent damping ξ1 of the building, for floor spectra.", "%", at_least=1, at_most=50),
    ] = _USUAL

    def __post_init__(self) -> None:
        check_settings("site", self)
        if self.height > 0 and (self.building_height is None or self.period is None):
            raise SceneError(
                "a mechanism above the ground",
                where="site",
                remedy="give building_height and period, or height = 0",
            )

    @property
    def shape(self) -> float:
        """Return ψ(Z) = Z/H of the building's first mode [-]."""
        return 0.0 if self.building_height is None else self.height / self.building_height

    @property
    def participation(self) -> float:
        """Return γ = 3 N/(2 N + 1) [-]."""
        return 3.0 * self.storeys / (2.0 * self.storeys + 1.0)

    def acceleration(self, period: float, gravity: float, damping: float = _USUAL) -> float:
        """Return Se(T) for a damping [%], with η = √(10/(5 + ξ)) ≥ 0.55 [m/s²]."""
        eta = damping_factor(damping)
        corner = self.cc * self.tc_star
        first, last = corner / 3.0, _LAST + _LASTED * self.ag
        plateau = self.ag * gravity * self.soil * eta * self.f0
        if period < first:
            part = period / first
            return plateau * (part + (1.0 - part) / (eta * self.f0))
        if period < corner:
            return plateau
        if period < last:
            return plateau * corner / period
        return plateau * corner * last / period**2

    def displacement(self, period: float, gravity: float, damping: float = _USUAL) -> float:
        """Return SDe(T) = Se(T) (T/2π)² for a damping [%] [m]."""
        return self.acceleration(period, gravity, damping) * float((period / (2.0 * np.pi)) ** 2)
