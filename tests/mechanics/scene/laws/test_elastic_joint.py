"""Joints with stiffness: what their springs hold while areas change, joints close, open, slide, crush and soften."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.laws.closure import Closure
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import BOND, CRUSHED, ENERGY, REST, SPRING, STATE
from tests.mechanics.scene.laws.driven import Driven
from tests.mechanics.scene.laws.one_contact import approach

STIFF, MASS, G = 1e6, 100.0, 9.81
DRY = ElasticJoint(0.5, STIFF, 0.5 * STIFF)
GLUED = ElasticJoint(0.5, STIFF, 0.5 * STIFF, tension=2e3, shear=2e3)
SOFTENS = replace(GLUED, energy_tension=8.0, energy_shear=8.0)
CRUSHES = replace(DRY, compressive_strength=5e3)
STIFFENS = replace(DRY, stiffening=0.5, reference_pressure=5e3)
ALL = replace(SOFTENS, compressive_strength=5e3, stiffening=0.3, reference_pressure=5e3)


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


@pytest.mark.parametrize(
    "law",
    [DRY, GLUED, SOFTENS, CRUSHES, STIFFENS, ALL],
    ids=["dry", "glued", "softens", "crushes", "stiffens", "all"],
)
@pytest.mark.parametrize("step", [1e-3, 1e-2, 1e-1])
def test_no_step_gives_energy_to_a_mass_that_bounces_and_slides(law, step):
    """Steps of 0.1 to 10 over the frequency √(k A/m); the area is another one in each, in the second half."""
    rng = np.random.default_rng(1)
    gap, velocity, state = 2e-2, np.array([0.0, 0.4, -0.2]), np.zeros((1, STATE))
    if law.bonded:
        gap, velocity, state[0, BOND] = 0.0, np.array([0.1, 0.02, 0.0]), 1.0
    energy, pressed = [], 0
    for number in range(300):
        area = 1.0 if number < 150 else float(rng.uniform(0.1, 2.0))
        contact = approach(
            [gap + 0.5 * step * velocity[0]], velocity[0], state, velocity[None, 1:], area=area, step=step
        )
        crushing = law.crushing(contact)
        for _ in range(5):
            contact = replace(contact, crushing=crushing)
            terms = law.terms(contact)
            free, yields = velocity - [step * G, 0.0, 0.0], 1 / MASS + terms.springs.compliance[0]
            # the joint feels r = r̃ - s n, both in W and in E
            free_of = free[0] - terms.adhesion[0] * yields[0]
            shifted = np.zeros(3)
            shifted[0] = max(0.0, -(free_of + terms.bias[0]) / yields[0])
            shifted[1:] = -(free[1:] + terms.springs.shift[0]) / yields[1:]
            limit = terms.friction[0] * shifted[0] + terms.cohesion[0]
            shifted[1:] *= min(1.0, limit / max(np.linalg.norm(shifted[1:]), 1e-300))
            crushing = law.crushing(contact, shifted[None])
        after = free + (shifted - [terms.adhesion[0], 0.0, 0.0]) / MASS
        state = law.after(contact, shifted[None], after[None])
        gap, velocity = gap + step * 0.5 * (velocity[0] + after[0]), after
        energy.append(0.5 * MASS * velocity @ velocity + MASS * G * gap + state[0, ENERGY])
        pressed += shifted[0] > 0
    assert pressed > 10
    assert np.diff(energy).max() < 1e-9 * energy[0]


# --- crushing ---


@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_a_joint_crushes_at_its_strength_unloads_elastically_and_keeps_its_set(theta):
    """k = 1 GPa/m, 2 MPa: full at 2 mm; of 5 mm, 3 mm remain, also after it was open and when it closes again."""
    joint = Driven(ElasticJoint(0.5, 1e9, 5e8, compressive_strength=2e6), theta=theta)
    np.testing.assert_allclose(joint.path(np.linspace(0, -5e-3, 501)[1:])[220:], -2e6, rtol=1e-4)
    assert joint.state[0, CRUSHED] == pytest.approx(3e-3, rel=1e-3) == -joint.state[0, REST]
    assert -joint.work == pytest.approx(0.5 * 2e6 * 2e-3 + 2e6 * 3e-3, rel=0.01)
    joint.path([-4.5e-3])
    assert joint.path([-4.5e-3])[0] == pytest.approx(-1.5e6, rel=1e-3)
    assert joint.path(np.linspace(-4.5e-3, -1e-3, 101)[1:])[-1] == 0.0
    joint.path(np.linspace(-1e-3, -3.5e-3, 101)[1:])
    assert joint.path([-3.5e-3])[0] == pytest.approx(-0.5e6, rel=1e-3)


def test_a_joint_gives_back_only_what_its_springs_hold():
    joint = Driven(ElasticJoint(0.5, 1e9, 5e8, compressive_strength=2e6))
    joint.path(np.linspace(0, -5e-3, 101)[1:])
    joint.path(np.linspace(-5e-3, 0, 101)[1:])
    assert -joint.work == pytest.approx(2e6 * 3e-3, rel=1e-3)
    assert joint.held == 0.0


# --- stiffness that grows with pressure ---


def power_law(closure, stiffness=1e9, n=0.5, reference=1e6):
    """p = k(p) y, with k = k_N (p/p_ref)ⁿ above a hundredth of p_ref, and what it is there below."""
    floor = 1e-2 * reference
    low = stiffness * 1e-2**n
    return np.where(
        low * closure < floor, low * closure, (stiffness * closure / reference**n) ** (1 / (1 - n))
    )


@pytest.mark.parametrize("n", [0.25, 0.5])
@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_stiffness_grows_with_pressure_loading_and_unloading(n, theta):
    joint = Driven(ElasticJoint(0.5, 1e9, 5e8, stiffening=n, reference_pressure=1e6), theta=theta)
    way = np.linspace(0, 4e-3, 401)
    # the force of a step is that of its mean
    middle = way[:-1] + theta * np.diff(way)
    np.testing.assert_allclose(-joint.path(-way[1:])[100:], power_law(middle, n=n)[100:], rtol=0.01)
    back = middle[::-1] if theta == 0.5 else way[:-1][::-1]
    np.testing.assert_allclose(-joint.path(-way[::-1][1:])[:-60], power_law(back, n=n)[:-60], rtol=0.01)
    stored = np.trapezoid(power_law(way, n=n), way)
    assert -0.02 * stored < joint.work <= 0.0
    assert joint.held == 0.0


def test_the_shear_force_stays_as_the_pressure_rises_and_springs_gain_nothing_as_it_falls():
    joint = Driven(ElasticJoint(0.9, 1e9, 5e8, stiffening=0.5, reference_pressure=1e6))
    joint.path(np.linspace(0, -1e-3, 201)[1:])
    shear = joint.path(np.linspace(0, -2e-4, 51)[1:], 1)[-1]
    # k_T is that at 1 MPa
    assert shear == pytest.approx(-5e8 * 2e-4, rel=0.02)
    held, work = joint.held, joint.work
    joint.path(np.linspace(-1e-3, -2e-3, 201)[1:])
    assert joint.path([-2e-4], 1)[0] == pytest.approx(shear, rel=0.02)
    joint.path(np.linspace(-2e-3, -1e-3, 201)[1:])
    assert shear < joint.path([-2e-4], 1)[0] < 0.5 * shear
    assert joint.held - held <= work - joint.work


# --- mortar by its modulus ---


def test_stiffness_is_the_modulus_of_mortar_over_its_thickness():
    """Of 10, 20 mm, and of pairs without thickness: 15 mm."""
    law = ElasticJoint(0.5, mortar_young=1e9, mortar_poisson=0.25, thickness=0.015)
    contact = approach(np.zeros(3), thickness=np.array([0.01, 0.02, 0.0]))
    stiffness = 1e9 / np.array([0.01, 0.02, 0.015])
    springs = law.terms(contact).springs
    expected = ElasticJoint(0.5, 1.0, 1.0).terms(approach(np.zeros(3))).springs.compliance
    np.testing.assert_allclose(springs.compliance[:, 0], expected[:, 0] / stiffness)
    np.testing.assert_allclose(springs.compliance[:, 1:], expected[:, 1:] / (stiffness / 2.5)[:, None])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "there is neither"),
        ({"normal_stiffness": 1e9}, "there is one of them"),
        ({"mortar_young": 1e9, "shear_stiffness": 1e9}, "there is mortar_young"),
        ({"normal_stiffness": 1e9, "shear_stiffness": 1e9, "mortar_young": 1e9}, "beside stiffness"),
        ({"normal_stiffness": 1e9, "shear_stiffness": 1e9, "thickness": 0.01}, "without mortar_young"),
        ({"mortar_young": 1e9, "stiffening": 0.5}, "stiffening and reference_pressure"),
        ({"mortar_young": 1e9, "reference_pressure": 1e5}, "stiffening and reference_pressure"),
        ({"mortar_young": 1e9, "stiffening": 1.0, "reference_pressure": 1e5}, "stiffening = 1"),
        ({"mortar_young": 1e9, "shear": 1e5, "energy_shear": 10.0}, "softens by"),
        ({"mortar_young": 1e9, "tension": 1e5, "shear": 1e5, "energy_shear": 10.0}, "softens by"),
    ],
)
def test_what_does_not_go_together_is_refused(given, message):
    with pytest.raises(SceneError, match=message):
        ElasticJoint(0.5, **given)


# --- bonds that soften ---

TOUGH = ElasticJoint(0.0, 1e10, 5e9, tension=3e5, shear=3e5, energy_tension=50.0, energy_shear=80.0)


@pytest.mark.parametrize("theta", [0.5, 1.0])
@pytest.mark.parametrize(("axis", "energy"), [(0, 50.0), (1, 80.0)])
def test_opening_and_sliding_cost_their_energies_and_lose_tension_linearly(theta, axis, energy):
    """c = 0.3 MPa, to 0 over 2 G/c, where the springs in series are slack again."""
    joint, full = Driven(TOUGH, theta=theta, first=True), 2 * energy / 3e5
    way = np.linspace(0, 1.2 * full, 241)
    force = np.abs(joint.path(way[1:], axis))
    assert -joint.work == pytest.approx(energy, rel=0.02)
    assert joint.state[0, BOND] < 1e-3
    stretch, middle = 3e5 / (1e10 if axis == 0 else 5e9), (way[1:] + way[:-1]) / 2
    softening = 3e5 * np.clip((full - middle) / (full - stretch), 0, 1)
    np.testing.assert_allclose(
        force[middle > 1.2 * stretch], softening[middle > 1.2 * stretch], atol=0.02 * 3e5
    )


def test_a_damaged_bond_closes_along_a_line_to_no_force_and_presses_as_before():
    joint = Driven(TOUGH, first=True)
    peak = joint.path(np.linspace(0, 1.5e-4, 101)[1:])[-1]
    back = joint.path(np.linspace(1.5e-4, 0, 101)[1:])
    np.testing.assert_allclose(back[5:], peak * np.linspace(1, 0, 101)[1:][5:], atol=0.02 * peak)
    assert joint.path(np.linspace(0, -1e-4, 201)[1:])[-1] == pytest.approx(-1e6, rel=0.01)
    again = joint.path(np.linspace(-1e-4, 1.5e-4, 501)[1:])
    assert again[-1] == pytest.approx(peak, rel=0.02)
    assert joint.path(np.linspace(1.5e-4, 4e-4, 201)[1:])[-1] == 0.0
    assert -joint.work == pytest.approx(50.0, rel=0.03)


def test_in_mixed_mode_the_parts_of_both_energies_add_up_to_one():
    """A third of the shear energy first, the rest by opening; friction costs nothing without pressure."""
    joint = Driven(TOUGH, first=True)
    joint.path(np.linspace(0, 3e-4, 201)[1:], 1)
    slid = -joint.work - joint.held
    joint.path(np.linspace(0, 4e-4, 401)[1:])
    opened = -joint.work - slid
    assert 0.2 < slid / 80.0 < 0.9
    assert slid / 80.0 + opened / 50.0 == pytest.approx(1.0, abs=0.03)


def test_a_bond_whose_springs_hold_more_than_it_costs_breaks_at_its_strength():
    """½ c²/k = 150 J/m² against 50: nothing is left beyond a stretch of c/k."""
    joint = Driven(replace(TOUGH, normal_stiffness=3e8), first=True)
    force = joint.path(np.linspace(0, 2e-3, 401)[1:])
    assert force.max() == pytest.approx(3e5, rel=0.01)
    assert (force[203:] == 0).all()


@dataclass(frozen=True)
class Hyperbola(Closure):
    """p = k y/(1 - y/V), as Bandis, Lumsden & Barton (1983) measured it on joints of rock."""

    most: float = 1e-3
    linear = False

    def pressure(self, closure):
        return self.stiffness * closure / (1.0 - closure / self.most)

    def tangent(self, closure):
        return self.stiffness / (1.0 - closure / self.most) ** 2

    def energy(self, closure):
        share = closure / self.most
        return -self.stiffness * self.most**2 * (share + np.log1p(-share))

    def at_energy(self, energy):
        known = np.linspace(0.0, 0.999 * self.most, 10_001)
        return np.interp(energy, self.energy(known), known)

    def stiffer(self, pressure):
        return 1.0 + pressure / (self.stiffness * self.most)


class ClosingJoint(ElasticJoint):
    def _closure(self, contacts):
        return Hyperbola(self._stiff(contacts)[0])


def test_a_closure_of_another_shape_takes_one_class():
    joint = Driven(ClosingJoint(0.5, 1e9, 5e8))
    way = np.linspace(0, 8e-4, 801)
    middle = 0.5 * (way[1:] + way[:-1])
    expected = 1e9 * middle / (1.0 - middle / 1e-3)
    np.testing.assert_allclose(-joint.path(-way[1:])[20:], expected[20:], rtol=1e-3)
    np.testing.assert_allclose(-joint.path(-way[::-1][1:])[:-20], expected[::-1][:-20], rtol=1e-3)
    # what it took it gave back, but for the steps
    assert -1e-3 * expected.sum() * (way[1] - way[0]) < joint.work <= 0.0
    assert joint.held == 0.0
