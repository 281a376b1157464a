"""Joints with stiffness: what their springs hold while areas change, joints close, open and slide."""

import numpy as np
import pytest

from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import BOND, ENERGY, SPRING, STATE
from tests.mechanics.scene.laws.one_contact import approach

STIFF, MASS, G = 1e6, 100.0, 9.81
DRY = ElasticJoint(0.5, STIFF, 0.5 * STIFF)
GLUED = ElasticJoint(0.5, STIFF, 0.5 * STIFF, tension=2e3, shear=2e3)


def stretched(stretch, law=DRY, area=1.0):
    """Internal variables of contacts whose springs have stretches (n, 3) at closed gaps."""
    stretch = np.atleast_2d(np.asarray(stretch, dtype=float))
    state = np.zeros((len(stretch), STATE))
    state[:, SPRING] = stretch
    state[:, ENERGY] = 0.5 * area * (stretch**2 @ [law.normal_stiffness, *[law.shear_stiffness] * 2])
    return state


def shifts(state, pair=None, **given):
    """Shift of u (n, 3) by the springs of contacts at rest: 2 x/h with θ = ½, for a stretch x."""
    pair = np.arange(len(state)) if pair is None else np.array(pair)
    contacts = approach(np.zeros(len(state)), state=state, pair=pair, **given)
    terms = DRY.terms(contacts)
    return 0.25e-3 * np.column_stack([terms.bias, terms.springs.shift])


def test_springs_whose_area_grows_hold_what_they_held():
    stretch = [[-1e-3, 2e-4, -1e-4]]
    np.testing.assert_allclose(shifts(stretched(stretch)), stretch)
    np.testing.assert_allclose(shifts(stretched(stretch), area=4.0), 0.5 * np.array(stretch))


def test_springs_whose_area_shrinks_keep_their_stretch():
    stretch = [[-1e-3, 2e-4, -1e-4]]
    np.testing.assert_allclose(shifts(stretched(stretch), area=0.3), stretch)


def test_an_area_that_moves_from_point_to_point_of_a_pair_changes_no_even_stretch():
    """Of one pair; as two pairs, the first holds what it held with half of its area."""
    stretch = np.tile([-1e-3, 2e-4, 0.0], (2, 1))
    state, area = stretched(stretch, area=0.5), np.array([0.9, 0.1])
    np.testing.assert_allclose(shifts(state, [0, 0], area=area), stretch)
    np.testing.assert_allclose(
        shifts(state, [0, 1], area=area), stretch * np.sqrt([[0.5 / 0.9], [1.0]]), rtol=1e-12
    )


def test_a_contact_that_is_found_overlapping_begins_without_stretch():
    contacts = approach([-1e-3, 1e-3])
    np.testing.assert_allclose(0.25e-3 * DRY.terms(contacts).bias, [0.0, 1e-3], atol=1e-18)


@pytest.mark.parametrize("law", [DRY, GLUED], ids=["dry", "glued"])
@pytest.mark.parametrize("step", [1e-3, 1e-2, 1e-1])
def test_no_step_gives_energy_to_a_mass_that_bounces_and_slides(law, step):
    """Steps of 0.1 to 10 over the frequency √(k A/m); the area is another one in each, in the second half."""
    rng = np.random.default_rng(1)
    gap, velocity, state = 2e-2, np.array([0.0, 0.4, -0.2]), np.zeros((1, STATE))
    if law is GLUED:
        gap, velocity, state[0, BOND] = 0.0, np.array([0.1, 0.02, 0.0]), 1.0
    energy, pressed = [], 0
    for number in range(600):
        area = 1.0 if number < 300 else float(rng.uniform(0.1, 2.0))
        contact = approach(
            [gap + 0.5 * step * velocity[0]], velocity[0], state, velocity[None, 1:], area=area, step=step
        )
        terms = law.terms(contact)
        free, yields = velocity - [step * G, 0.0, 0.0], 1 / MASS + terms.springs.compliance[0]
        # the joint feels r = r̃ - s n, both in W and in E
        free_of = free[0] - terms.adhesion[0] * yields[0]
        shifted = np.zeros(3)
        shifted[0] = max(0.0, -(free_of + terms.bias[0]) / yields[0])
        shifted[1:] = -(free[1:] + terms.springs.shift[0]) / yields[1:]
        limit = terms.friction[0] * shifted[0] + terms.cohesion[0]
        shifted[1:] *= min(1.0, limit / max(np.linalg.norm(shifted[1:]), 1e-300))
        after = free + (shifted - [terms.adhesion[0], 0.0, 0.0]) / MASS
        state = law.after(contact, shifted[None], after[None])
        gap, velocity = gap + step * 0.5 * (velocity[0] + after[0]), after
        energy.append(0.5 * MASS * velocity @ velocity + MASS * G * gap + state[0, ENERGY])
        pressed += shifted[0] > 0
    assert pressed > 10
    assert np.diff(energy).max() < 1e-9 * energy[0]
