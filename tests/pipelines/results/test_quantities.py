"""Quantities by which two runs of a scene are compared, on results whose numbers are known."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.scene import Fidelity
from pipelines.results.quantities import QUANTITIES, Quantities, differences, quantities, quantities_from
from tests.pipelines.results_by_hand import deformable_body, result_of, rigid_body

WEIGHT = 1000.0


def stress(factor):
    return lambda points: factor * 1e6 * (points[:, 2] - 1.0)


def stack(factor=1.0, size=0.5, sunk=0.002, rigid=False, lift=WEIGHT, outcome=Outcome.EQUILIBRIUM):
    """A fixed stone, a stone of 2 m³ on it with a stress that is linear in height, and a rigid one of 1 m³."""
    shift = (0.0, 0.0, -sunk)
    middle = (
        rigid_body("B", (0, 0, 1), (1, 1, 3), shift=shift)
        if rigid
        else deformable_body("B", (0, 0, 1), (1, 1, 3), stress(factor), size=size, shift=shift, error=0.1)
    )
    return result_of(
        [
            rigid_body("C", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
            middle,
            rigid_body("A", (0, 0, 3), (1, 1, 4), shift=shift),
        ],
        pairs=((1, 0), (2, 1)),
        forces=((0.0, 0.0, lift), (0.0, 0.0, 0.3 * lift)),
        outcome=outcome,
    )


def test_a_run_does_not_differ_from_itself():
    one = quantities(stack())
    apart = differences(one, one)
    assert list(apart) == list(QUANTITIES)
    own = ("natural_map", "penetration", "balance", "reaction", "energy")
    assert all(value == 0.0 for name, value in apart.items() if name not in own)
    assert [apart[name] for name in own] == [1e-7, 2e-6, 3e-5, 4e-4, None]  # NaN in the result is not known


def test_the_numbers_are_those_of_the_stones_as_a_whole():
    found = quantities(stack())
    assert found.size == pytest.approx(1.5 ** (1 / 3))
    assert found.von_mises_max == pytest.approx(2e6)
    assert found.von_mises_mean == pytest.approx(1e6)
    assert found.stones["B"].displacement == pytest.approx((0.0, 0.0, -0.002))
    assert found.stones["A"].von_mises_mean is None
    assert set(found.stones) == {"A", "B"}
    assert found.displacement == pytest.approx(0.002)
    assert found.settlement == pytest.approx(1e-5)  # that of the last step
    assert found.stress_error == pytest.approx(0.1)


def test_reactions_and_resultants_have_the_sign_of_what_bears():
    found = quantities(stack())
    assert found.support_reactions == {"C": pytest.approx(WEIGHT)}
    # contacts are (candidate B, antagonist C) and (A, B); the first of two stones is that of the alphabet
    assert found.joint_forces["B|C"] == pytest.approx((0.0, 0.0, WEIGHT))
    assert found.joint_forces["A|B"] == pytest.approx((0.0, 0.0, 0.3 * WEIGHT))
    turned = stack()
    swapped = replace(
        turned,
        contacts=replace(
            turned.contacts, bodies=turned.contacts.bodies[:, ::-1], force=-turned.contacts.force
        ),
    )
    assert quantities(swapped) == found


def test_reactions_are_against_gravity_wherever_it_points():
    result = stack()
    sideways = replace(result, scene=replace(result.scene, gravity=(-9.81, 0.0, 0.0)))
    force = result.contacts.force[:, [2, 1, 0]]
    pushed = replace(sideways, contacts=replace(result.contacts, force=force))
    assert quantities(pushed).support_reactions == {"C": pytest.approx(WEIGHT)}
    weightless = replace(result, scene=replace(result.scene, gravity=(0.0, 0.0, 0.0)))
    assert quantities(weightless).support_reactions == {"C": pytest.approx(WEIGHT)}


@pytest.mark.parametrize("factor", [0.9, 1.25])
def test_stresses_that_differ_by_a_factor_differ_by_that_on_every_mesh(factor):
    reference = quantities(stack(size=0.25))
    apart = differences(quantities(stack(factor, size=0.25)), reference)
    for name in ("von_mises_max", "von_mises_p99", "von_mises_mean", "stone_von_mises_mean"):
        assert apart[name] == pytest.approx(abs(factor - 1.0)), name
    coarse = differences(quantities(stack(factor, size=0.5)), reference)
    # a linear field has the same mean and maximum on every mesh, whatever its nodes
    assert coarse["von_mises_max"] == pytest.approx(abs(factor - 1.0))
    assert coarse["stone_von_mises_mean"] == pytest.approx(abs(factor - 1.0))


def test_a_rigid_run_has_no_stress_but_all_the_rest():
    apart = differences(quantities(stack(rigid=True, sunk=0.001)), quantities(stack()))
    assert [name for name, value in apart.items() if value is None] == [
        *("von_mises_max", "von_mises_p99", "von_mises_mean", "stone_von_mises_p99"),
        *("stone_von_mises_mean", "energy"),
    ]
    assert apart["displacement"] == pytest.approx(0.5)
    assert apart["stone_displacement"] == pytest.approx(0.5)
    assert apart["support_reactions"] == pytest.approx(0.0)


def test_only_stones_that_deform_in_both_are_compared_by_stress():
    found, reference = quantities(stack(0.5)), quantities(stack())
    more = replace(
        reference,
        stones={**reference.stones, "A": replace(reference.stones["B"], von_mises_max=9e9)},
        von_mises_max=9e9,
    )
    apart = differences(found, more)
    assert apart["von_mises_max"] == pytest.approx(0.5)
    assert apart["von_mises_mean"] == pytest.approx(0.5)
    assert apart["von_mises_p99"] is None  # of other stones, and not to be had of these alone


def test_the_mean_stress_of_stones_counts_their_volume():
    """2 m³ at 1 MPa beside 1 m³ at 4 MPa, 2 MPa on average, against 1 MPa in both."""
    found = quantities(stack())
    other = replace(found.stones["B"], volume=1.0)
    reference, even = (
        replace(found, stones={**found.stones, "A": replace(other, von_mises_mean=mean)})
        for mean in (4e6, 1e6)
    )
    assert differences(even, reference)["von_mises_mean"] == pytest.approx(0.5)


def test_movements_within_the_overlaps_of_rigid_stones_are_none():
    found, reference = quantities(stack(rigid=True, sunk=3e-8)), quantities(stack(rigid=True, sunk=1e-8))
    apart = differences(found, reference)
    assert apart["displacement"] == pytest.approx(2e-8 / (1e-6 * reference.size))


def test_another_outcome_and_a_joint_that_parted_count():
    reference = quantities(stack())
    fallen = replace(quantities(stack(outcome=Outcome.COLLAPSED)), joint_forces={"B|C": (0.0, 0.0, WEIGHT)})
    apart = differences(fallen, reference)
    assert apart["outcome"] == 1.0
    assert apart["joint_forces"] == pytest.approx(0.3 / math.hypot(1.0, 0.3))
    new = replace(reference, joint_forces={**reference.joint_forces, "A|C": (WEIGHT, 0.0, 0.0)})
    assert differences(new, reference)["joint_forces"] == pytest.approx(1.0 / math.hypot(1.0, 0.3))


def test_nothing_to_compare_with_is_no_number():
    nothing = replace(quantities(stack(0.0, sunk=0.0, lift=0.0)), size=0.0, displacement=0.0, settlement=0.0)
    apart = differences(quantities(stack()), nothing)
    for name in ("von_mises_max", "von_mises_p99", "stone_von_mises_mean", "support_reactions"):
        assert apart[name] is None, name
    for name in ("joint_forces", "displacement", "stone_displacement", "settlement"):
        assert apart[name] is None, name


@given(lift=st.floats(-1e6, 1e6), sunk=st.floats(0.0, 1.0), rigid=st.booleans(), factor=st.floats(0.0, 1e3))
def test_records_are_json_and_read_back_the_same(lift, sunk, rigid, factor):
    found = quantities(stack(factor, lift=lift, sunk=sunk, rigid=rigid))
    again = quantities_from(json.loads(json.dumps(found.as_record(), allow_nan=False)))
    assert isinstance(again, Quantities)
    assert again == found


def test_a_stone_that_turns_about_its_middle_has_not_moved_as_a_whole():
    result = stack()
    body = result.bodies[1]
    centre = np.average(body.reference, axis=0, weights=body.node_volume)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = replace(body, position=(body.reference - centre) @ turn.T + centre)
    found = quantities(replace(result, bodies=(result.bodies[0], turned, result.bodies[2])))
    assert found.stones["B"].displacement == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert found.displacement > 0.5


def test_reactions_that_push_and_pull_differ_by_the_sum_of_their_sizes():
    """|1 − 3| + |−2 + 4| = 4 of 3 + 4 = 7, although the references add up to −1."""
    one = quantities(stack())
    found = replace(one, support_reactions={"A": 1.0, "B": -2.0})
    reference = replace(one, support_reactions={"A": 3.0, "B": -4.0})
    assert differences(found, reference)["support_reactions"] == pytest.approx(4.0 / 7.0)
    # a support that a run does not have bears nothing there
    alone = replace(one, support_reactions={"A": 3.0})
    assert differences(alone, reference)["support_reactions"] == pytest.approx(4.0 / 7.0)
