"""Shares, correlations, reaches and words of studies by hand."""

from types import SimpleNamespace

import numpy as np
import pytest

from ground.errors import SceneError
from pipelines.assess.questions import parse_question
from pipelines.assess.study import actions, estimates, gradient, prepare, summary
from pipelines.assess.study.inputs.distributions import Distribution
from pipelines.assess.study.inputs.moved import MovedStones
from pipelines.assess.study.inputs.unknowns import Unknown, Unknowns
from pipelines.assess.study.methods.failure import Failure
from pipelines.assess.study.methods.first_order import FirstOrder
from pipelines.assess.study.quantities import live_load
from pipelines.assess.study.settings import Acts, InputTable, InputType, QuantityTable, Shape

SPREAD = Distribution(Shape.NORMAL, 0.0, 2.0)


def unknown(number, stones=(), part="common", label=""):
    return Unknown(number, label or f"input {number}", SPREAD, stones, part, Acts.CHANGE)


def problem():
    """Friction; depths with a rule and scatter; densities with scatter; corners of a face."""
    each = (
        unknown(0),
        unknown(1, ("A", "B"), label="rule"),
        unknown(1, ("A",), "scatter"),
        unknown(1, ("B",), "scatter"),
        unknown(2, ("A", "B")),
        unknown(2, ("B",), "scatter"),
        unknown(3, ("A",), "0 x"),
        unknown(3, ("A",), "0 y"),
    )
    inputs = (
        InputTable(InputType.FRICTION, name="mortar"),
        InputTable(InputType.DEPTH),
        InputTable(InputType.DENSITY),
        InputTable(InputType.POINT),
    )
    models = [SimpleNamespace(record=SimpleNamespace(code=code)) for code in "ABC"]
    return SimpleNamespace(unknowns=Unknowns(each), inputs=inputs, models=models, dimension=len(each))


SLOPE = np.array([2.0, 3.0, 1.0, 0.0, 1.0, 2.0, 1.0, -2.0])
"""Of which the squares add up to 24."""


def test_what_could_be_measured_takes_away_the_variance_of_its_unknowns():
    found = {action.text: action for action in actions.actions(problem(), SLOPE)}
    shares = {text: action.share * 24.0 for text, action in found.items()}
    assert shares == pytest.approx(
        {
            "sliding tests of friction (mortar)": 4.0,
            # of one observation of what A has in common with B and its own, and so of both alike
            "core through A: its depth": (3.0 + 1.0) ** 2 / 2.0,
            "core through B: its depth": (3.0 + 0.0) ** 2 / 2.0,
            "weigh samples of stone": 1.0,
            "weigh samples of stone: B": (1.0 + 2.0) ** 2 / 2.0,
            "more points on A": 1.0 + 4.0,
        }
    )
    assert found["core through A: its depth"].stone == "A"
    assert found["sliding tests of friction (mortar)"].stone == ""
    assert [action.share for action in actions.actions(problem(), SLOPE)] == sorted(
        (action.share for action in found.values()), reverse=True
    )
    # what takes nothing away is no action
    assert actions.actions(problem(), np.eye(8)[0])[0].text.startswith("sliding")
    assert len(actions.actions(problem(), np.eye(8)[0])) == 1


def test_shares_of_inputs_and_of_their_parts_add_up_to_one():
    about = problem()
    by_input = actions.shares_by_input(about, SLOPE**2)
    assert {name: 24.0 * share for name, share in by_input.items()} == pytest.approx(
        {"mortar": 4.0, "depth": 10.0, "density": 5.0, "point": 5.0}
    )
    groups = actions.shares_by_group(about, SLOPE**2)
    assert sum(groups.values()) == pytest.approx(1.0)
    assert 24.0 * groups["rule"] == pytest.approx(9.0)
    assert 24.0 * groups["depth, of each stone"] == pytest.approx(1.0)
    assert set(actions.shares_by_input(about, np.zeros(8)).values()) == {0.0}


def test_the_share_of_a_stone_is_that_of_its_best_measurement():
    about = problem()
    found = actions.shares_by_stone(about, actions.actions(about, SLOPE))
    assert {code: 24.0 * share for code, share in found.items()} == pytest.approx(
        {"A": 8.0, "B": 4.5, "C": 0.0}
    )


def correlation(inputs, matrix):
    return SimpleNamespace(inputs=inputs, matrix=np.array(matrix))


def test_correlated_inputs_share_their_common_unknowns_alone():
    about = problem()
    made = prepare._correlated(
        about.unknowns.each, about.inputs, [correlation((0, 2), [[1.0, 0.6], [0.6, 1.0]])]
    )
    assert made.correlated.tolist() == [0, 4]
    assert made.root @ made.root.T == pytest.approx(np.array([[1.0, 0.6], [0.6, 1.0]]))
    two = prepare._correlated(
        about.unknowns.each,
        about.inputs,
        [correlation((0,), [[1.0]]), correlation((1, 2), [[1.0, -0.3], [-0.3, 1.0]])],
    )
    assert two.correlated.tolist() == [0, 1, 4]
    assert two.root @ two.root.T == pytest.approx(np.array([[1, 0, 0], [0, 1, -0.3], [0, -0.3, 1]]))
    with pytest.raises(SceneError, match="'point' has 0 common unknowns"):
        prepare._correlated(about.unknowns.each, about.inputs, [correlation((0, 3), np.eye(2))])


def test_a_change_of_a_stone_reaches_those_on_its_planes_and_what_was_cut_for_it():
    joints = [
        SimpleNamespace(plane=0, stones=("A", "B")),
        SimpleNamespace(plane=0, stones=("B", "C")),
        SimpleNamespace(plane=1, stones=("D", "E")),
        SimpleNamespace(plane=-1, stones=("A", "E")),
    ]
    assembled = SimpleNamespace(
        scene=SimpleNamespace(blocks=[SimpleNamespace(code=code) for code in "ABCDE"]),
        closing=SimpleNamespace(joints=joints),
    )
    made = MovedStones((), {}, (), (), None, assembled)
    # D and C touch without a common plane; A and B touch on theirs
    found = made.reach([("A",), ("E",), ("B", "D")], np.array([[0, 1], [2, 3]]))
    reached = ["".join("ABCDE"[k] for k in np.flatnonzero(row)) for row in found]
    assert reached == ["ABCD", "CDE", "ABCDE"]


def shared(powers, steps, both=False, bodies=((0, 1), (1, 2))):
    """Derivatives by two unknowns that each change one of three stones, of powers by body and by contact."""
    on = SimpleNamespace(contacts=SimpleNamespace(bodies=np.array(bodies)), free=np.array([0, 1, 2]))
    at = SimpleNamespace(limited=SimpleNamespace(on=on))
    start = (np.zeros(3), np.zeros(2))

    def power(at_, moves):
        scale = sum(np.sign(list(moves.values()))) / len(moves)
        return tuple(scale * np.array(part) for part in powers)

    patch = pytest.MonkeyPatch()
    patch.setattr(gradient, "_power", power)
    try:
        reach = np.array([[True, False, False], [False, False, True]])
        return gradient._shared(at, start, [0, 1], reach, np.array(steps), lambda moves: moves, both, 0.0)
    finally:
        patch.undo()


@pytest.mark.parametrize("both", [False, True])
def test_each_unknown_has_the_change_of_its_stone_and_of_its_contacts(both):
    # the first stone changes by 3, its contact by 1; the third by -2, its contact by 0.5
    found = shared(([3.0, 0.0, -2.0], [1.0, 0.5]), (0.5, 0.1), both)
    assert found == pytest.approx([4.0 / 0.5, -1.5 / 0.1])


def test_what_changes_besides_tells_that_unknowns_cannot_be_told_apart():
    assert shared(([3.0, 0.2, -2.0], [1.0, 0.5]), (0.5, 0.1)) is None


def told(**failure):
    return {
        "failure": {"above": False, "level": 0.3, "probability": 0.0123, "low": 0.01, "high": 0.015, "index": 2.25,
                    "index_low": 2.17, "index_high": 2.33} | failure,
        "quantity": "bound", "bound": True, "means": {}, "cautions": [], "actions": [],
    }  # fmt: skip


def test_the_headline_has_the_probability_and_what_to_measure_next():
    assert summary._headline(told()) == (
        "P(bound below 0.3) = 0.0123 (0.01 to 0.015), β = 2.25 (2.17 to 2.33); P AT LEAST, as stones hold no more than "
        "the bound"
    )
    above = told(above=True) | {
        "cautions": ["it is late", "more"],
        "actions": [{"text": "weigh it", "share": 0.42}],
    }
    assert summary._headline(above).endswith(
        "β = 2.25 (2.17 to 2.33); measure next: weigh it, which takes away 42 % of the variance; but it is late"
    )
    none = told() | {"failure": None, "means": {"bound": {"value": 0.36, "sigma": 0.02}}}
    assert summary._headline(none) == "bound: mean 0.36, standard deviation 0.02"
    assert summary._headline(none | {"means": {}}) == "bound: no probability was asked for"


def test_a_first_order_that_is_not_good_enough_is_told_by_how_much():
    linear = {"linear": False, "departure": 0.37, "along": "depth of A", "sides": []}
    estimates = SimpleNamespace(
        subset=None, designs=[], linear=None, gradient=None, weights=None, values={}, indices=None
    )
    (text,) = summary._cautions(estimates, {"linear": linear, "faults": []})
    assert "along depth of A the quantity departs from it by 37 % of a standard deviation" in text
    side = {"along": "depth", "below": 0.5, "above": 0.25}
    fault = {"count": 4, "reason": "it fell"}
    found = summary._cautions(
        estimates, {"linear": linear | {"linear": True, "sides": [side]}, "faults": [fault]}
    )
    assert "the derivative by depth is 0.5 below its mean and 0.25 above" in found[0]
    assert found[1].startswith("4 samples have no answer, as the first: it fell")


@pytest.mark.parametrize(
    ("level", "above", "share"), [(0.3, False, 0.00135), (0.38, True, 0.1587), (0.36, False, 0.5)]
)
def test_a_first_order_prediction_fails_as_a_normal_one_does(level, above, share):
    """Of the mean 0.36 and the standard deviation 0.02: three, one and no standard deviations off."""
    linear = FirstOrder(0.36, 0.02, np.array([0.012, 0.016]), 0.0, -1, 1)
    found = estimates._first_order(
        SimpleNamespace(dimension=2), "bound", linear, Failure("bound", level, above)
    )
    assert found.probability.low_value == pytest.approx(share, rel=1e-3)
    assert (found.probability.low, found.probability.high) == (0.0, 1.0)
    assert found.means["bound"].value == 0.36
    assert estimates._first_order(SimpleNamespace(dimension=2), "bound", linear, None).probability is None


def test_levels_of_a_curve_go_from_the_least_to_the_largest_value():
    found = estimates._levels(np.array([0.2, np.nan, 0.6, 0.3]))
    assert (found[0], found[-1]) == (0.2, 0.6)
    assert np.diff(found) == pytest.approx(np.full(len(found) - 1, 0.4 / (len(found) - 1)))
    assert estimates._levels(np.array([np.nan])) == ()


def test_further_design_points_are_sought_along_what_stones_have_in_common():
    assert estimates._starts(problem()) == [0, 1, 4]


@pytest.mark.parametrize(
    ("words", "direction"),
    [("horizontal x", (np.cos(0.3), np.sin(0.3), 0.0)), ("horizontal y", (-np.sin(0.3), np.cos(0.3), 0.0))],
)
def test_a_push_turns_about_the_vertical_and_a_force_does_not(words, direction):
    table = QuantityTable("bound", load=words)
    assert live_load(table, 0.3).direction == pytest.approx(direction)
    assert live_load(table).direction == parse_question(words).live.direction
    force = QuantityTable("bound", load="force A 1 0 0")
    assert live_load(force, 0.3).force == (1.0, 0.0, 0.0)
    with pytest.raises(SceneError, match="does not grow"):
        live_load(QuantityTable("bound", load="thickness"))
