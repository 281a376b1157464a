"""Table of the laws between stones."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.dynamics.outcome import Outcome
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import SLIDING, STATE
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.laws.table import law_table
from mechanics.scene.scene import LawRule
from mechanics.simulate import simulate
from tests.mechanics.scene.laws.one_contact import approach
from tests.mechanics.shapes import brick, ground, scene

STONES = ("ground", "a", "b", "c", "d")


def table(*rules, general=None):
    masks = [tuple(np.array([code in group for code in STONES]) for group in rule[:2]) for rule in rules]
    laws = [rule[2] for rule in rules]
    return law_table(
        general or DryJoint(0.1), [(*m, law) for m, law in zip(masks, laws, strict=True)], len(STONES)
    )


def law_between(of, one, other):
    return of.laws[of.of(np.array([[STONES.index(one), STONES.index(other)]]))[0]]


def test_where_no_rule_speaks_the_general_law_holds():
    laws = table(("a", "b", DryJoint(0.7)))
    assert law_between(laws, "a", "c").friction == 0.1
    assert law_between(laws, "a", "a").friction == 0.1
    assert law_between(table(), "a", "b").friction == 0.1


def test_a_rule_holds_both_ways_round():
    laws = table((("a", "b"), ("c",), DryJoint(0.7)))
    for one, other in (("a", "c"), ("c", "a"), ("b", "c"), ("c", "b")):
        assert law_between(laws, one, other).friction == 0.7
    assert law_between(laws, "a", "b").friction == 0.1


def test_a_group_may_meet_itself():
    laws = table((("a", "b", "c"), ("a", "b", "c"), DryJoint(0.7)))
    assert law_between(laws, "a", "b").friction == 0.7
    assert law_between(laws, "c", "ground").friction == 0.1


def test_of_two_rules_for_one_pair_the_later_holds():
    wide, narrow = (STONES, STONES, DryJoint(0.5)), (("a",), ("b",), DryJoint(0.7))
    assert law_between(table(wide, narrow), "b", "a").friction == 0.7
    assert law_between(table(narrow, wide), "b", "a").friction == 0.5
    assert law_between(table(wide, narrow), "b", "c").friction == 0.5


def mixed_contacts():
    """Six contacts of three laws in any order, their numbers all different."""
    law = np.array([2, 0, 1, 0, 2, 1])
    state = np.arange(6.0 * STATE).reshape(6, STATE) / 100
    contacts = approach(
        np.linspace(-0.001, 0.002, 6), state=state, area=np.arange(1.0, 7), size=np.arange(2.0, 8), first=True
    )
    return law, contacts


def only(contacts, row):
    names = ("gap", "speed", "area", "size", "compliance", "state", "first")
    return replace(contacts, **{name: getattr(contacts, name)[row : row + 1] for name in names})


def test_every_contact_is_stated_by_its_own_law_and_asked_after_by_it():
    general, second, third = DryJoint(0.1, 0.05), DryJoint(0.7), MortarJoint(0.6, 1e5, 2e5)
    laws = table(("a", "b", second), ("a", "c", third), general=general)
    law, contacts = mixed_contacts()
    terms = laws.terms(law, contacts)
    rng = np.random.default_rng(0)
    impulse, velocity = np.abs(rng.normal(size=(6, 3))), rng.normal(size=(6, 3))
    after = laws.after(law, contacts, impulse, velocity)
    for row, index in enumerate(law):
        one = (general, second, third)[index]
        alone = one.terms(only(contacts, row))
        for name in ("bias", "friction", "cohesion", "adhesion"):
            assert getattr(terms, name)[row] == getattr(alone, name)[0]
        own = one.after(only(contacts, row), impulse[row : row + 1], velocity[row : row + 1])
        np.testing.assert_array_equal(after[row], own[0])
    assert terms.adhesion[law == 2].min() > 0
    assert not terms.adhesion[law != 2].any()
    assert after[:, SLIDING].any()


# --- in a scene ---


def two_on_a_slope(*rules):
    """Two bricks side by side on a slope of tan α = 0.4, in gravity's axes."""
    slope = np.arctan(0.4)
    one = scene(
        ground(), brick("a", (-1, 0, 0), (-0.4, 0.4, 0.2)), brick("b", (-1, 1, 0), (-0.4, 1.4, 0.2)),
        gravity=(9.81 * np.sin(slope), 0, -9.81 * np.cos(slope)), friction=0.6, step=2e-3, duration=0.2,
        stop_at_equilibrium=False,
    )  # fmt: skip
    return replace(one, contact=replace(one.contact, rules=rules))


def test_one_stone_slides_and_its_neighbour_stays_by_their_rules():
    icy = LawRule(frozenset({"b"}), frozenset({"ground"}), DryJoint(0.1))
    result = simulate(two_on_a_slope(icy))
    paths = [float(body.displacement[:, 0].mean()) for body in result.bodies]
    slope, t, h = np.arctan(0.4), 0.2, 2e-3
    a = 9.81 * (np.sin(slope) - 0.1 * np.cos(slope))
    assert abs(paths[1]) < 1e-6
    assert paths[2] == pytest.approx(a * (t**2 + h * t) / 2, rel=1e-3)  # θ = 1 runs ahead by a h t/2
    assert result.outcome is not Outcome.COLLAPSED


def test_a_rule_that_names_a_stranger_is_refused():
    stray = LawRule(frozenset({"b", "bb"}), frozenset({"ground", "Ground"}), DryJoint(0.1))
    with pytest.raises(SceneError, match=r"a law names Ground, bb.*give codes of blocks of the scene"):
        build_model(two_on_a_slope(stray))
