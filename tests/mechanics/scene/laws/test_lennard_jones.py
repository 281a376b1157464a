"""The non-smooth Lennard-Jones law: a constant pull within a distance."""

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.laws.lennard_jones import LennardJones
from tests.mechanics.scene.laws.one_contact import Block, approach

LAW = LennardJones(friction=0.5, force=10.0, distance=1e-3)


def test_the_pull_acts_within_the_distance_and_not_beyond():
    terms = LAW.terms(approach([-1e-4, 0.0, 0.5e-3, 1e-3, 1.001e-3]))
    np.testing.assert_allclose(terms.adhesion, 1e-3 * np.array([10.0, 10.0, 10.0, 10.0, 0.0]))  # h γ
    assert not terms.cohesion.any()
    np.testing.assert_allclose(terms.bias, np.array([0.0, 0.0, 0.5e-3, 1e-3, 1.001e-3]) / 1e-3)


@pytest.mark.parametrize("theta", [0.5, 0.75, 1.0])
@pytest.mark.parametrize("speed", [0.2, -0.2])
def test_in_the_step_that_crosses_the_distance_the_pull_acts_for_the_path_within(theta, speed):
    """Path of 2e-4 m, of which 0.5e-4 m lie within d_w."""
    inner, step = 1e-3 - 0.5e-4, 1e-3
    start = inner if speed > 0 else inner + 2e-4
    contacts = approach([start + step * (1 - theta) * speed], speed, step=step, theta=theta)
    assert LAW.terms(contacts).adhesion[0] == pytest.approx(step * 10.0 * 0.25, rel=1e-9)


def test_an_open_contact_feels_the_full_pull_and_a_closed_one_presses():
    """One step from rest: free at a gap, the block gets -hγ/m; closed, r̃_N = hγ and so r_N = 0."""
    falling = Block(LAW, mass=2.0, theta=1.0, place=np.array([0.9e-3, 0.0])).advance()
    assert falling.impulse[0] == pytest.approx(-1e-3 * 10.0)
    assert falling.velocity[0] == pytest.approx(-1e-3 * 10.0 / 2.0)
    resting = Block(LAW, mass=2.0, theta=1.0, force=(0.0, 4.0)).advance()
    assert resting.velocity.tolist() == [0.0, 0.0]  # γ presses it on: μγ = 5 N holds 4 N
    assert resting.impulse[0] == pytest.approx(0.0, abs=1e-18)
    sliding = Block(LAW, mass=2.0, theta=1.0, force=(0.0, 6.0)).advance(100)
    assert sliding.velocity[1] == pytest.approx(0.1 * (6.0 - 5.0) / 2.0, rel=1e-9)


@pytest.mark.parametrize(("theta", "step"), [(0.5, 1e-4), (1.0, 1e-5)])
@pytest.mark.parametrize("speed", [0.198, 0.202, 0.25, 0.4])
def test_two_unit_masses_part_above_the_speed_of_escape(theta, step, speed):
    """½ m_r v² = γ d_w: v = 0.2 m/s for γ = 10 N, d_w = 1 mm, m_r = 0.5 kg; work 0.01 J, within 1 %.

    With θ = 1 the one-step error h γ/m_r is kept below the tolerance by the step.
    """
    pair = Block(LAW, mass=0.5, step=step, theta=theta, velocity=np.array([speed, 0.0]))
    pair.advance(round(0.05 / step))
    if speed < 0.2:
        assert pair.place[0] <= 1e-3
        return
    assert pair.place[0] > 1e-3
    assert -pair.work == pytest.approx(0.01, rel=0.01)
    assert speed**2 - pair.velocity[0] ** 2 == pytest.approx(0.04, rel=0.01)


def test_contacts_are_watched_up_to_the_distance():
    assert LAW.reach == 1e-3


@pytest.mark.parametrize("name", ["force", "distance"])
def test_impossible_parameters_are_refused_by_name(name):
    with pytest.raises(SceneError, match=f"Lennard-Jones law: {name} = 0.0; give a number greater than 0"):
        LennardJones(**{"friction": 0.5, "force": 1.0, "distance": 1.0} | {name: 0.0})
    with pytest.raises(SceneError, match="friction = -1"):
        LennardJones(friction=-1.0, force=1.0, distance=1.0)
