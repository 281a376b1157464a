"""The critical taper of Dahlen (1984), beside Mohr's circle of the same wedge."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.planar.measures.taper import critical_slope


def friction_on_base(internal, surface, base):
    """tan φ_b on a plane below the surface of a wedge that fails: Mohr's circle through the stress at a given depth.

    With z down from the surface, σ_zz = ρ g z cos α, τ = ρ g z sin α; of two circles at failure the larger one, which
    is that of a wedge that is pushed.
    """
    normal, shear = np.cos(surface), np.sin(surface)
    # (normal - p)² + shear² = (p sin φ)²
    a, b, c = np.cos(internal) ** 2, -2.0 * normal, normal**2 + shear**2
    p = (-b + np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a)
    turn = 2.0 * (surface + base)
    away = normal - p
    on_base = p + away * np.cos(turn) + shear * np.sin(turn)
    along = shear * np.cos(turn) - away * np.sin(turn)
    return abs(along) / on_base


@pytest.mark.parametrize(("internal", "basal", "base"), [(30, 10, 0), (30, 25, 0), (36, 16, 3), (20, 5, -1)])
def test_the_base_of_a_critical_wedge_is_about_to_slide(internal, basal, base):
    internal, basal, base = np.radians([internal, basal, base])
    surface = critical_slope(internal, basal, base)
    assert friction_on_base(internal, surface, base) == pytest.approx(np.tan(basal), rel=1e-9)


def test_a_base_stronger_than_the_wedge_is_refused():
    with pytest.raises(SceneError, match="basal"):
        critical_slope(0.3, 0.4)
