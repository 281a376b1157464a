"""Spectrum at a height z of a building, of circular 7/2019, C7.2.3, by its first mode.

    a_Z = S_e(T_1, ξ_1) |γ ψ(z)| √(1 + 0.0004 ξ_1²)                                       [C7.2.7]
    S_eZ(T, ξ) = f a_Z / (1 + (f - 1) x),    f = 1.1 η(ξ)/√ξ_1                            [C7.2.6]

with x = (1 - T/(a T_1))^1.6 below a T_1, 0 up to b T_1 and (T/(b T_1) - 1)^1.2 beyond; S_eZ ≥ S_e(T, ξ) for T > T_1
[C7.2.5]. The circular states ξ_1 in per cent. In f it is taken as a ratio here: f is the resonance of the mechanism
with the building, 4.9 at 5 %, and as a percentage it would be 0.5, less than a rigid mechanism has.
"""

from collections.abc import Mapping

import numpy as np

from pipelines.scene.site import Site, damping_factor

__all__ = ["floor_acceleration", "floor_displacement", "floor_spectrum"]


def floor_acceleration(site: Site, gravity: float) -> float:
    """Return the largest acceleration a_Z at the height of the mechanism [m/s²]."""
    felt = site.acceleration(site.period or 0.0, gravity, site.damping)
    return felt * site.participation * site.shape * float(np.sqrt(1.0 + 0.0004 * site.damping**2))


def floor_spectrum(
    site: Site, period: float, damping: float, gravity: float, rules: Mapping[str, float]
) -> float:
    """Return S_eZ(T, ξ) at the height of the mechanism [m/s²].

    Parameters
    ----------
    period, damping : T [s] and ξ [%] of the mechanism
    rules : `first` and `last`, a and b of the range of resonance; `peak`, 1.1; exponents `rise` and `fall`
    """
    building = site.period or 0.0
    first, last = rules["first"] * building, rules["last"] * building
    peak = rules["peak"] * damping_factor(damping) / float(np.sqrt(site.damping / 100.0))
    off = 0.0
    if period < first:
        off = (1.0 - period / first) ** rules["rise"]
    elif period > last:
        off = (period / last - 1.0) ** rules["fall"]
    found = peak * floor_acceleration(site, gravity) / (1.0 + (peak - 1.0) * off)
    return max(found, site.acceleration(period, gravity, damping)) if period > building else found


def floor_displacement(
    site: Site, period: float, damping: float, gravity: float, rules: Mapping[str, float]
) -> float:
    """Return the displacement S_eZ T²/4π² that a mechanism is to bear; beyond b T_1 no less than at resonance [m].

    Parameters as `floor_spectrum`; [C8.7.1.12].
    """
    found = floor_spectrum(site, period, damping, gravity, rules) * (period / (2.0 * np.pi)) ** 2
    building = site.period or 0.0
    last = rules["last"] * building
    if period <= last:
        return float(found)
    least = floor_spectrum(site, building, damping, gravity, rules) * (last / (2.0 * np.pi)) ** 2
    return float(max(found, least))
