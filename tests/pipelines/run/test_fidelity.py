"""Model of each stone by lists, outputs and the ring, on any graph of neighbours."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechanics.scene.scene import Fidelity
from pipelines.run.fidelity import Wishes, modelled, neighbours
from survey.joints.report import StoneJoint

FIXED, RIGID, DEFORMABLE = Fidelity.FIXED, Fidelity.RIGID, Fidelity.DEFORMABLE
CODES = tuple("ABCDEFGHIJ")
ROW = {one: {*CODES[max(n - 1, 0) : n], *CODES[n + 1 : n + 2]} for n, one in enumerate(CODES)}
"""Ten stones side by side."""


def said(wishes):
    """Return the model of each stone of the row as one letter, and the reasons by code."""
    found = modelled(CODES, ROW, wishes)
    letters = "".join(str(found[one].fidelity)[0] for one in CODES)
    return letters, {code: one.reason for code, one in found.items()}


def test_stones_are_rigid_unless_an_output_needs_their_stress():
    assert said(Wishes({"A": FIXED}, None))[0] == "frrrrrrrrr"
    letters, reasons = said(Wishes({"A": FIXED}, None, frozenset("E"), ring=2))
    assert letters == "frdddddrrr"
    assert reasons["A"] == "support: named in [bodies] fixed"
    assert reasons["B"] == "no output needs its stress"
    assert reasons["C"] == "within 2 joints of E"
    assert reasons["D"] == "within 1 joint of E"
    assert reasons["E"] == "stress asked for by [output] stress"


def test_a_picture_of_stress_wants_that_of_all_stones_unless_some_are_named():
    letters, reasons = said(Wishes({"A": FIXED, "C": RIGID}, None, pictures=("error",)))
    assert letters == "fdrddddddd"
    assert reasons["B"] == "picture error of [output] shows the stress of all stones"
    assert reasons["C"] == "named in [bodies] rigid"
    assert said(Wishes({}, None, frozenset("A"), pictures=("error",), ring=0))[0] == "drrrrrrrrr"
    assert said(Wishes({}, None, frozenset(), pictures=("error",)))[0] == "rrrrrrrrrr"


def test_lists_go_first_and_a_default_leaves_nothing_to_outputs():
    lists = {"D": RIGID, "J": DEFORMABLE}
    assert said(Wishes(lists, None, frozenset("E"), ring=1))[0] == "rrrrddrrrd"
    assert said(Wishes(lists, RIGID, frozenset("E"), ring=1))[0] == "rrrrrrrrrd"
    letters, reasons = said(Wishes(lists, DEFORMABLE, frozenset("E"), ring=1))
    assert letters == "dddrdddddd"
    assert reasons["A"] == 'default = "deformable" in [bodies]'


def test_a_stone_under_a_force_stays_rigid_unless_its_own_stress_is_asked_for():
    letters, reasons = said(Wishes({}, None, frozenset("E"), pushed=frozenset("EF"), ring=1))
    assert letters == "rrrddrrrrr"  # that E is deformable is refused where the force is given
    assert "forces act on rigid stones" in reasons["F"]
    assert said(Wishes({}, None, pictures=("von_mises",), pushed=frozenset("F")))[0] == "dddddrdddd"


def test_a_fixed_or_rigid_stone_whose_stress_is_asked_for_has_no_ring():
    assert said(Wishes({"E": FIXED}, None, frozenset("E"), ring=1))[0] == "rrrrfrrrrr"
    assert said(Wishes({"E": RIGID}, None, frozenset("E"), ring=1))[0] == "rrrrrrrrrr"


def test_stress_is_of_those_who_are_asked_or_of_all_that_deform():
    def stressed(wishes):
        return {code for code, one in modelled(CODES, ROW, wishes).items() if one.stress}

    assert stressed(Wishes({"A": FIXED}, None, frozenset("ABC"))) == {"B", "C"}
    assert stressed(Wishes({"A": FIXED, "J": DEFORMABLE}, None)) == {"J"}
    assert stressed(Wishes({"J": DEFORMABLE}, RIGID, frozenset("A"))) == set()
    assert stressed(Wishes({"A": FIXED}, DEFORMABLE)) == set("BCDEFGHIJ")


def test_a_joint_makes_two_stones_neighbours_closed_or_not():
    def joint(first, second, left_open=""):
        return StoneJoint(
            (first, second), -1, 0.01, 0.0, 0.1, np.zeros(3), np.array([0.0, 0.0, 1.0]), left_open
        )

    found = neighbours([joint("A", "B"), joint("C", "B", "too wide"), joint("B", "A")])
    assert found == {"A": {"B"}, "B": {"A", "C"}, "C": {"B"}}


@st.composite
def scenes(draw):
    """Return neighbours of up to ten stones, and requests about them."""
    pairs = draw(st.sets(st.tuples(st.sampled_from(CODES), st.sampled_from(CODES)), max_size=25))
    graph: dict[str, set[str]] = {}
    for one, other in pairs:
        graph.setdefault(one, set()).add(other)
        graph.setdefault(other, set()).add(one)
    named = draw(st.dictionaries(st.sampled_from(CODES), st.sampled_from(Fidelity), max_size=6))
    stress = draw(st.frozensets(st.sampled_from(CODES), max_size=3))
    pushed = draw(st.frozensets(st.sampled_from(CODES), max_size=2))
    return graph, Wishes(named, None, stress, (), pushed, draw(st.integers(0, 4)))


@given(scenes())
def test_the_ring_is_all_that_is_so_many_joints_away(scene):
    """Compare with distances from powers of the adjacency matrix without fixed stones."""
    graph, wishes = scene
    near = np.array([[other in graph.get(one, ()) for other in CODES] for one in CODES])
    open_ = np.array([wishes.named.get(code) is not FIXED for code in CODES])
    near &= open_[:, None] & open_[None, :]
    region = np.array(
        [code in wishes.stress and wishes.named.get(code, DEFORMABLE) is DEFORMABLE for code in CODES]
    )
    reached = region.copy()
    distance = np.where(region, 0, 99)
    for step in range(1, wishes.ring + 1):
        reached |= near[reached].any(axis=0)
        distance[reached & (distance == 99)] = step
    found = modelled(CODES, graph, wishes)
    assert list(found) == list(CODES)
    for code, away, own in zip(CODES, distance.tolist(), region.tolist(), strict=True):
        model = found[code]
        if code in wishes.named:
            assert (model.fidelity, model.ring) == (wishes.named[code], 0)
        elif own:
            assert (model.fidelity, model.ring) == (DEFORMABLE, 0)
        else:
            soft = away < 99 and code not in wishes.pushed
            assert (model.fidelity, model.ring) == ((DEFORMABLE, away) if soft else (RIGID, 0))
            assert ("joint" in model.reason) == soft
        assert model.stress == own


@pytest.mark.parametrize("ring", [0, 1, 9])
def test_a_wider_ring_never_makes_a_stone_stiffer(ring):
    letters, _ = said(Wishes({"C": FIXED}, None, frozenset("F"), ring=ring))
    assert letters == {0: "rrfrrdrrrr", 1: "rrfrdddrrr", 9: "rrfddddddd"}[ring]
