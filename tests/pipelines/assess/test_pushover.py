"""Loading tests of scenes: the band about a curve, the mechanism in words, the first line and its cautions."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from ground.errors import UsageError
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.rig import Rig
from mechanics.scene.scene import LawRule
from pipelines.assess.pushover.band import Band, banded, varied
from pipelines.assess.pushover.findings import doubts_of, headline_of, mechanism_of
from pipelines.assess.pushover.push import _beside, _rig, read_curve
from tests.mechanics.limit.test_loading_test import scene, slippery


@pytest.fixture(scope="module")
def test():
    """A block that slides below a beam."""
    return slippery(0.002)


def test_the_band_adds_squares_and_has_its_level_on_both_sides(test):
    """Friction raises the force by 3 %, density by 4 %: together by 5 %; 90 % lie within 1.645 of that."""
    raised = {"friction": 1.03, "density": 1.04}
    found = banded(
        test, dict.fromkeys(raised, 0.1), 0.9, lambda name, _: replace(test, force=raised[name] * test.force)
    )
    half = norm.ppf(0.95) * 0.05
    assert found.half_width == pytest.approx(half * found.force)
    assert found.strength == pytest.approx(half * test.force.max())
    assert found.parts["density"] == pytest.approx(0.04 * test.force.max())
    place, low, high = found.curve.T
    assert place[-1] == pytest.approx(0.002)
    assert (low[-1], high[-1]) == pytest.approx(test.force[-1] * np.array([1.0 - half, 1.0 + half]))


@pytest.mark.parametrize(
    ("turning", "words"),
    [
        (1.02, "rocks"),
        (0.85, "rocks"),
        (0.84, "rocks (84 %) and slides"),
        (0.71, "rocks (71 %) and slides"),
        (0.16, "rocks (16 %) and slides"),
        (0.14, "slides in its joints"),
        (-0.01, "slides in its joints"),
    ],
)
def test_rocking_and_sliding_are_named_alone_from_a_share_of_85_percent(turning, words):
    assert mechanism_of(turning) == words


@pytest.mark.parametrize(
    ("changed", "disturbed", "first"),
    [
        ({}, 0, None),
        ({"unsolved": 2}, 2, None),  # of 200 steps: too few to count
        ({"unsolved": 5}, 0, "5 of 200 steps were not solved to the tolerance"),
        ({}, 9, "in 9 of 200 steps stones gathered speed: their forces are not those of rest"),
        ({"energy_error": 0.02}, 0, "energy does not balance by 2 %"),
        ({"stopped": True, "unsolved": 5}, 0, "it was stopped before its end"),
    ],
)
def test_the_gravest_doubt_comes_first(changed, disturbed, first):
    sound = {"force": np.zeros(200), "stopped": False, "unsolved": 0, "energy_error": 0.0}
    sound["calm"] = np.arange(200) >= disturbed
    assert next(iter(doubts_of(SimpleNamespace(**sound | changed))), None) == first


RIG = Rig((1.0, 0.0, 0.0), 1.1, 40e3)


def test_a_vertical_force_varies_in_the_rig_and_density_in_every_stone():
    stones = scene(DryJoint(0.5))
    same, rig = varied(stones, RIG, "load", 1.1)
    assert (same, rig.load) == (stones, pytest.approx(44e3))
    heavier, rig = varied(stones, RIG, "density", 0.9)
    assert rig == RIG
    assert [block.material.density for block in heavier.blocks] == pytest.approx([1800.0])


def test_a_parameter_of_joints_varies_in_all_laws_that_have_it_and_changes_nothing_else():
    springs = ElasticJoint(0.6, 1e10, 4e9, compressive_strength=2e6)
    stones = scene(DryJoint(0.5), rules=(LawRule(frozenset({"block"}), frozenset({"block"}), springs),))
    rubbed, rig = varied(stones, RIG, "friction", 1.2)
    assert rig == RIG
    assert rubbed.contact.law.friction == pytest.approx(0.6)
    assert rubbed.contact.rules[0].law == replace(springs, friction=1.2 * 0.6)
    stiffer, _ = varied(stones, RIG, "stiffness", 1.5)
    law = stiffer.contact.rules[0].law
    assert (law.normal_stiffness, law.shear_stiffness, law.friction) == pytest.approx((1.5e10, 6e9, 0.6))
    assert stiffer.contact.law == DryJoint(0.5)
    crushed, _ = varied(stones, RIG, "compressive_strength", 0.5)
    assert crushed.contact.rules[0].law == replace(springs, compressive_strength=1e6)


def test_fracture_energy_varies_with_the_strength_so_that_a_bond_softens_as_far():
    bond = CohesiveZone(0.6, tension=1e5, energy_tension=20.0, shear=2e5, energy_shear=80.0)
    stones = scene(bond)
    found = varied(stones, RIG, "tension", 0.8)[0].contact.law
    assert (found.tension, found.energy_tension) == pytest.approx((8e4, 16.0))
    assert (found.shear, found.energy_shear) == (2e5, 80.0)


def test_the_headline_tells_both_strengths_the_band_and_the_mechanism():
    test = SimpleNamespace(strength=(12340.0, -9876.0), turning=0.95)
    assert headline_of(test, None) == "bears 12.34 kN and -9.876 kN; it rocks"
    band = Band(0.9, np.zeros(1), np.zeros(1), np.zeros(1), 1230.0, {})
    forwards = SimpleNamespace(strength=(12340.0, 0.0), turning=0.05)
    assert headline_of(forwards, band) == "bears 12.34 kN ± 1.2 kN (90 % band); it slides in its joints"
    assert headline_of(SimpleNamespace(strength=(0.0, 0.0), turning=1.0), None) == "bears nothing; it rocks"


def test_a_measured_curve_is_read_in_millimetres_and_kilonewtons(tmp_path):
    path = tmp_path / "curve.csv"
    path.write_text("displacement,force,remark\nmm,kN\n0,0\n1.5,2.5,first crack\n2.0,\n2.5,NaN\n3,2\n")
    assert read_curve(path) == pytest.approx(np.array([[0.0, 0.0], [1.5e-3, 2.5e3], [3e-3, 2e3]]))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0,0\n1,two\n", "no two numbers"),
        ("displacement,force\n", "no measured points"),
        ("1\n2\n", "no measured"),
    ],
)
def test_a_measured_curve_that_says_nothing_is_refused_with_its_place(tmp_path, text, words):
    path = tmp_path / "curve.csv"
    path.write_text(text)
    with pytest.raises(UsageError, match=words) as raised:
        read_curve(path)
    assert str(raised.value.where) == (f"{path}:2" if "two" in text else str(path))
    with pytest.raises(UsageError, match="cannot be read"):
        read_curve(tmp_path / "absent.csv")


@pytest.mark.parametrize(
    ("measured", "borne", "ratios"),
    [
        ([0.0, 8e3, -5e3], (10e3, -4e3), (1.25, 0.8)),
        ([0.0, 8e3, 5e3], (10e3, -4e3), (1.25, None)),
        ([1e3, 8e3], (0.0, 0.0), (None, None)),
        ([-1e3, -8e3], (6e3, -6e3), (None, 0.75)),
    ],
)
def test_what_was_predicted_stands_over_what_was_measured(measured, borne, ratios):
    points = np.column_stack([np.arange(len(measured)), measured])
    found = _beside(SimpleNamespace(strength=borne), points)
    assert tuple(found["ratio"].values()) == pytest.approx(ratios)
    assert found["strength"] == {"forwards": max(measured), "backwards": min(*measured, 0.0)}


def test_the_rig_is_described_in_its_units():
    asked = SimpleNamespace(rig=RIG, to=(0.01, -0.02), scatter={"friction": 0.15})
    head, push, scatter = _rig(asked)
    assert "vertical force 40 kN, pushed at 1.1 m" in head
    assert push == "push along (1, 0, 0) to 10, -20 mm in turn"
    assert scatter == "coefficients of variation: friction 15 %"
    assert "no scatter" in _rig(SimpleNamespace(rig=RIG, to=(0.01,), scatter={}))[2]
