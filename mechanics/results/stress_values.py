"""Summary of the stress of one stone: extreme tension and compression, and utilisation of its strengths.

Stress is positive in tension. Principal stresses are σ1 ≥ σ2 ≥ σ3.
"""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.stones.elasticity.tensors import principal, von_mises
from mechanics.stones.materials import Material

_NO_TENSION = (
    1e-3  # of a stone's root mean square stress [-]: tension below it is rounding of forces and stresses
)


@dataclass(frozen=True)
class StressValues:
    """Stress of one stone, from the recovered stress of its nodes.

    Attributes
    ----------
    von_mises_max : largest nodal value [Pa]
    von_mises_p99 : exceeded in 1 % of the volume [Pa]
    von_mises_mean : volume mean [Pa]
    principal_tension : largest σ1; negative if the stone is pressed everywhere in every direction [Pa]
    tension_point, tension_direction : (3,) its place [m] and direction, a unit vector [-]
    principal_compression : smallest σ3 [Pa]
    compression_point, compression_direction : (3,) of it
    mean_pressure : volume mean of -tr σ / 3 [Pa]
    tension_zone : part of the volume with σ1 above `tension_threshold` [-]
    tension_threshold : estimated error of the stress, below which tension is not significant [Pa]
    overstressed_zone : part of the volume with σ1 above the tensile strength; None without it [-]
    utilisation_tension, utilisation_compression : σ1/f_t and -σ3/f_c (Rankine), largest; None without the strength [-]
    error : relative error of the stress in the energy norm, as Zienkiewicz & Zhu (1987) estimate it [-]
    """

    von_mises_max: float
    von_mises_p99: float
    von_mises_mean: float
    principal_tension: float
    tension_point: Array
    tension_direction: Array
    principal_compression: float
    compression_point: Array
    compression_direction: Array
    mean_pressure: float
    tension_zone: float
    tension_threshold: float
    overstressed_zone: float | None
    utilisation_tension: float | None
    utilisation_compression: float | None
    error: float

    @property
    def utilisation(self) -> float | None:
        """The larger of the two utilisations that are known [-]."""
        known = [one for one in (self.utilisation_tension, self.utilisation_compression) if one is not None]
        return max(known, default=None)

    @property
    def governing(self) -> str | None:
        """The stress of the larger utilisation: "tension" or "compression"."""
        if self.utilisation is None:
            return None
        return "tension" if self.utilisation == self.utilisation_tension else "compression"


def stress_values(
    stress: Array, point: Array, volume: Array, material: Material, error: float
) -> StressValues:
    """Sum up the stress of one stone.

    A stress field with the relative error η is wrong by about η times its root mean square. Tension below that, or
    below a thousandth of the root mean square, does not count as a tension zone.

    Parameters
    ----------
    stress : (n, 6) of the nodes, xx, yy, zz, xy, yz, zx in world axes [Pa]
    point : (n, 3) of the nodes [m]
    volume : (n,) of each node [m³]
    material : of the stone, with its strengths
    error : η, relative error of the stress [-]
    """
    values, directions = principal(stress)
    equivalent = von_mises(stress)
    first, last = int(values[:, 0].argmax()), int(values[:, 2].argmin())
    threshold = max(error, _NO_TENSION) * float(np.sqrt(np.average((values**2).sum(axis=1), weights=volume)))
    tensile, compressive = material.tensile_strength, material.compressive_strength
    return StressValues(
        von_mises_max=float(equivalent.max()),
        von_mises_p99=volume_quantile(equivalent, volume, 0.99),
        von_mises_mean=float(np.average(equivalent, weights=volume)),
        principal_tension=float(values[first, 0]),
        tension_point=point[first],
        tension_direction=directions[first, 0],
        principal_compression=float(values[last, 2]),
        compression_point=point[last],
        compression_direction=directions[last, 2],
        mean_pressure=-float(np.average(values.mean(axis=1), weights=volume)),
        tension_zone=_share(values[:, 0] > threshold, volume),
        tension_threshold=threshold,
        overstressed_zone=None if tensile is None else _share(values[:, 0] > tensile, volume),
        utilisation_tension=None if tensile is None else max(float(values[first, 0]) / tensile, 0.0),
        utilisation_compression=None
        if compressive is None
        else max(-float(values[last, 2]) / compressive, 0.0),
        error=error,
    )


def utilisation(principal_stress: Array, material: Material) -> Array:
    """Return max(σ1/f_t, -σ3/f_c, 0) of principal stresses (n, 3) for the known strengths; NaN without any [-]."""
    parts = []
    if material.tensile_strength is not None:
        parts.append(principal_stress[:, 0] / material.tensile_strength)
    if material.compressive_strength is not None:
        parts.append(-principal_stress[:, 2] / material.compressive_strength)
    if not parts:
        return np.full(len(principal_stress), np.nan)
    result: Array = np.maximum(np.max(parts, axis=0), 0.0)
    return result


def volume_quantile(values: Array, volume: Array, part: float) -> float:
    """Return the smallest of the values (n,) that at least this part of the volume (n,) does not exceed."""
    order = np.argsort(values)
    below = np.cumsum(volume[order]) / volume.sum()
    return float(values[order][min(int(np.searchsorted(below, part)), len(values) - 1)])


def _share(where: Bools, volume: Array) -> float:
    return float(volume[where].sum() / volume.sum())
