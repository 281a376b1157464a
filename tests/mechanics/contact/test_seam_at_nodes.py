"""Two stones side by side that meet at a node of the mesh above them, but for rounding."""

import numpy as np
import pytest

from mechanics.scene.scene import Fidelity
from mechanics.stones.meshing.elements import Element
from tests.mechanics.shapes import brick, detected, scene

SOFT = Fidelity.DEFORMABLE


@pytest.mark.parametrize("element", [Element.HEX8, Element.TET4, Element.TET10])
@pytest.mark.parametrize("off", [0.0, 1.4e-17, -1.4e-17, 4.2e-17, 1e-15, -1e-15, 1e-13, -1e-13])
def test_rounding_makes_no_points_without_area(element, off):
    """Each point carries a part of the bed that is a part of a facet, and all of them the whole bed."""
    seam = -0.1 + off
    lower = [
        brick("left", (-0.3, -0.25, 0.0), (seam, 0.25, 0.3), SOFT, mesh_size=0.3, element=element),
        brick("right", (seam, -0.25, 0.0), (0.3, 0.25, 0.3), SOFT, mesh_size=0.21, element=element),
    ]
    upper = brick("upper", (-0.3, -0.25, 0.3), (0.3, 0.25, 0.6), SOFT, mesh_size=0.2, element=element)
    _, _, contacts = detected(scene(*lower, upper))
    pairs = np.sort(contacts.bodies, axis=1)
    for first, width in ((0, 0.2), (1, 0.4)):
        area = contacts.area[(pairs == (first, 2)).all(axis=1)]
        assert area.sum() == pytest.approx(width * 0.5, rel=1e-9)
        assert area.min() > 1e-4
