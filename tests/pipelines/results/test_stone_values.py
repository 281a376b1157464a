"""Values of joints by stone: each stone has the worst of its joints, and slivers say nothing of pressure and kern."""

from dataclasses import replace

import numpy as np
import pytest

from pipelines.results.stone_values import stone_results
from tests.pipelines.results_by_hand import result_of, rigid_body


@pytest.fixture
def tower():
    """Four stones on top of each other, with three joints of kern 0.6, 1.2 and 1.8 under 3, 2 and 1 kN."""
    bodies = [rigid_body(f"S{k}", (0, 0, k), (1, 1, k + 1)) for k in range(4)]
    pairs, forces = ((1, 0), (2, 1), (3, 2)), ((0, 0, 3000.0), (0, 0, 2000.0), (0, 0, 1000.0))
    return result_of(bodies, pairs=pairs, forces=forces)


def values(result, name):
    return [stone.values.get(name) for stone in stone_results(result)]


def test_each_stone_has_the_worst_of_its_joints(tower):
    assert values(tower, "joint_kern") == pytest.approx([0.6, 1.2, 1.8, 1.8])
    assert values(tower, "joint_pressure") == pytest.approx([4500.0, 4500.0, 3000.0, 1500.0])
    assert values(tower, "joint_sliding") == pytest.approx([1e-3, 2e-3, 3e-3, 3e-3])


def test_pressure_and_kern_of_slivers_are_left_out_but_not_how_far_they_slid(tower):
    joints = replace(tower.joints, sliver=np.array([False, False, True]))
    found = replace(tower, joints=joints)
    assert values(found, "joint_kern") == [pytest.approx(0.6), pytest.approx(1.2), pytest.approx(1.2), None]
    assert values(found, "joint_pressure") == [4500.0, 4500.0, 3000.0, None]
    assert values(found, "joint_sliding") == pytest.approx([1e-3, 2e-3, 3e-3, 3e-3])
