"""Critical taper of a wedge without cohesion (Dahlen 1984).

With the internal friction angle φ and that of the base
φ_b, a wedge that is at failure everywhere and slides on its base has the slopes α of its surface and β of its base with

    α + β = ψ_b - ψ_0,   ψ_b = ½ asin(sin φ_b / sin φ) - ½ φ_b,   ψ_0 = ½ asin(sin α / sin φ) - ½ α

where ψ_b and ψ_0 are the angles of the largest principal stress from the base and from the surface.
"""

import numpy as np
from scipy.optimize import brentq

from ground.errors import SceneError


def critical_slope(internal: float, basal: float, base_slope: float = 0.0) -> float:
    """Return the least surface slope α with which a wedge slides on its base without deforming within [rad].

    Parameters
    ----------
    internal, basal : friction angles φ and φ_b ≤ φ [rad]
    base_slope : β, towards the wall that pushes positive [rad]

    Raises
    ------
    SceneError : without 0 < φ_b ≤ φ, or where no slope is critical

    >>> round(float(np.degrees(critical_slope(np.radians(30.0), np.radians(10.0)))), 2)
    3.44
    """
    if not 0.0 < basal <= internal:
        raise SceneError(
            f"internal = {internal:g} and basal = {basal:g} rad",
            where="critical taper",
            remedy="give 0 < basal ≤ internal",
        )
    at_base = 0.5 * (np.arcsin(np.sin(basal) / np.sin(internal)) - basal)

    def excess(slope: float) -> float:
        """Return the excess of the taper's angle over that at the base [rad]."""
        return float(base_slope + 0.5 * slope + 0.5 * np.arcsin(np.sin(slope) / np.sin(internal)) - at_base)

    if excess(-internal) > 0.0 or excess(internal) < 0.0:
        raise SceneError("no slope is critical", where="critical taper", remedy="let the base slope less")
    return float(brentq(excess, -internal, internal))
