"""The line of thrust, from the resultants of the joints: in a semicircular arch just above its least thickness.

At the least thickness an arch has but one state of equilibrium (Milankovitch 1907; Heyman 1995): its thrust touches the
extrados at the springings and at the crown and the intrados in between, where 27 voussoirs have a joint at 33.3° (a
continuous arch: at 35.5°). Contact points: sharp corners of straight-faced voussoirs.
"""

import numpy as np
import pytest

from mechanics.stones.polyhedra import mass_properties
from tests.validation.masonry import semicircular_arch
from tests.validation.statics.verdict import hold, report, stands

# the least t/R of 27 voussoirs is 0.10672; a little more, so that it stands, and its state is all but unique
COUNT, THICKNESS = 27, 0.1075


@pytest.fixture(scope="module")
def arch():
    result = hold(semicircular_arch(COUNT, THICKNESS), 0.7)
    assert stands(result), report(result)
    return result


def line(result):
    """Where the resultants pass between intrados (-1) and extrados (1), joint after joint from the right springing."""
    place = result.joints.centre_of_pressure[:, [0, 2]]
    angle = np.degrees(np.arctan2(np.maximum(place[:, 1], 0.0), place[:, 0]))
    order = np.argsort(angle)
    return (np.linalg.norm(place, axis=1)[order] - 1.0) / (THICKNESS / 2), order


def test_the_thrust_touches_extrados_and_intrados_where_the_hinges_are(arch):
    height, order = line(arch)
    assert len(order) == COUNT + 1
    np.testing.assert_allclose(height, height[::-1], atol=1e-3)  # symmetric
    assert (np.abs(height) < 1 + 1e-6).all()
    # joints at 0°, 33.3° and, next to the crown, which a voussoir covers, at 86.7°
    assert height[0] > 0.98
    assert height[5] < -0.98
    assert height[13] > 0.95
    between = np.delete(np.arange(14), [0, 4, 5, 6, 13])
    assert (np.abs(height[between]) < 0.9).all()


def test_eccentricities_are_those_of_rectangles(arch):
    """e is edge t/2, and kern 6 e/t."""
    joints, (height, order) = arch.joints, line(arch)
    np.testing.assert_allclose(joints.edge[order], np.abs(height), atol=2e-3)
    np.testing.assert_allclose(joints.kern, 3 * joints.edge, rtol=1e-6)
    # the thrust stays in the plane of the arch
    np.testing.assert_allclose(joints.centre_of_pressure[:, 1], 0.0, atol=1e-4 * THICKNESS)


def test_the_resultants_of_a_voussoir_balance_its_weight(arch):
    """Forces, and moments about the origin."""
    joints = arch.joints
    count = len(arch.bodies)
    force, moment = np.zeros((count, 3)), np.zeros((count, 3))
    turning = joints.moment + np.cross(joints.centroid, joints.force)
    for side, sign in ((0, 1.0), (1, -1.0)):
        np.add.at(force, joints.bodies[:, side], sign * joints.force)
        np.add.at(moment, joints.bodies[:, side], sign * turning)
    for number, body in enumerate(arch.bodies):
        if body.fidelity == "fixed":
            continue
        weight = body.mass * np.array(arch.scene.gravity)
        centre = mass_properties(body.position, body.faces).centroid
        np.testing.assert_allclose(force[number], -weight, atol=1e-3 * np.linalg.norm(weight))
        np.testing.assert_allclose(
            moment[number], -np.cross(centre, weight), atol=1e-3 * np.linalg.norm(weight) * THICKNESS
        )
