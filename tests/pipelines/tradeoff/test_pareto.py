"""Front, reference and recommendation of a study, against their definitions."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechanics.scene.scene import Method
from mechanics.stones.meshing.elements import Element
from pipelines.results.quantities import QUANTITIES, Quantities, StoneQuantities
from pipelines.tradeoff.grid import Variant
from pipelines.tradeoff.pareto import ErrorReference, Judged, cheapest, front, judge, models_of_interest
from pipelines.tradeoff.store import Measured, Status
from pipelines.tuning.overlay import Overlay

costs = st.floats(1e-3, 1e4)
errors = st.floats(0.0, 10.0)
points = st.lists(st.tuples(costs, errors), max_size=30)


def beats(one, other):
    return one[0] <= other[0] and one[1] <= other[1] and one != other


@given(points)
def test_the_front_is_what_no_other_beats(listed):
    chosen = front(listed)
    on_it = {listed[number] for number in chosen}
    assert on_it == {one for one in listed if not any(beats(other, one) for other in listed)}
    assert len(on_it) == len(chosen)


@given(points)
def test_along_the_front_costs_rise_and_errors_fall(listed):
    along = [listed[number] for number in front(listed)]
    for one, following in pairwise(along):
        assert one[0] < following[0]
        assert one[1] > following[1]


@given(points, st.integers(0, 29))
def test_what_is_added_behind_the_front_changes_nothing(listed, which):
    if not listed:
        return
    cost, error = listed[which % len(listed)]
    worse = (cost * 2.0, error + 1.0)
    assert [listed[one] for one in front(listed)] == [
        [*listed, worse][one] for one in front([*listed, worse])
    ]


def judged(listed):
    """Runs with these costs and errors of one quantity; each is (cost, error, outcome differs)."""
    return [
        Judged(
            Measured(str(number), Overlay(), Status.DONE, cost, 600.0, cpu=cost),
            dict.fromkeys(QUANTITIES) | {"von_mises_p99": error, "outcome": float(other)},
        )
        for number, (cost, error, other) in enumerate(listed)
    ]


def reference(name, error):
    return ErrorReference(name, dict.fromkeys(QUANTITIES) | {"von_mises_p99": error}, "other", 2.0, 0.1)


@given(
    st.lists(st.tuples(costs, errors, st.booleans()), min_size=1, max_size=20), errors, st.floats(1e-3, 20.0)
)
def test_the_recommendation_is_the_cheapest_that_is_surely_good_enough(listed, own, asked):
    runs = [*judged(listed), *judged([])]
    found = cheapest(runs, reference("none of them", own), "von_mises_p99", asked)
    valid = {str(n): (cost, error + own) for n, (cost, error, other) in enumerate(listed) if not other}
    if not valid:
        assert found is None
        return
    good = {name: cost for name, (cost, bound) in valid.items() if bound <= asked}
    assert found.holds == bool(good)
    assert found.error == valid[found.name][1]
    if good:
        assert valid[found.name][0] == min(good.values())
    else:
        assert found.error == min(bound for _, bound in valid.values())


@given(st.lists(st.tuples(costs, errors, st.just(False)), min_size=1, max_size=20), st.floats(1e-3, 5.0))
def test_who_asks_for_less_never_pays_more(listed, asked):
    runs = judged(listed)
    strict, lax = (cheapest(runs, reference("-", 0.0), "von_mises_p99", one) for one in (asked, 2.0 * asked))
    if strict.holds:
        assert runs[int(lax.name)].run.cpu <= runs[int(strict.name)].run.cpu


def test_a_method_is_not_changed_for_times_that_differ_by_chance():
    slow, fast = judged([(1.1, 0.01, False), (1.0, 0.01, False)])
    other = replace(fast, run=replace(fast.run, overlay=Overlay(method=Method.NSGS)))
    for time, name in ((1.1, "0"), (1.5, "1")):
        runs = [replace(slow, run=replace(slow.run, cpu=time)), other]
        assert cheapest(runs, reference("-", 0.0), "von_mises_p99", 0.05).name == name


def test_the_reference_is_no_better_than_its_own_estimate():
    runs = judged([(1.0, 0.02, False), (9.0, 0.03, False)])
    assert cheapest(runs, reference("1", 0.03), "von_mises_p99", 0.04).name == "1"  # 0.02 + 0.03 is too much
    assert cheapest(runs, reference("1", 0.03), "von_mises_p99", 0.06).name == "0"


def test_an_error_that_nobody_knows_is_not_recommended():
    runs = judged([(1.0, None, False), (2.0, 0.01, False)])
    assert cheapest(runs, reference("1", None), "von_mises_p99", 0.5) is None
    assert cheapest(runs, reference("1", 0.01), "von_mises_p99", 0.5).name == "1"


def quantities_of(stress, eta=1e-7, outcome="equilibrium"):
    """Of a scene of one stone."""
    stone = StoneQuantities(1.0, (0.0, 0.0, -1e-4), stress, stress, stress, None if stress is None else 0.1)
    return Quantities(
        outcome=outcome,
        size=1.0,
        von_mises_max=stress,
        von_mises_p99=stress,
        von_mises_mean=stress,
        stones={"A": stone},
        support_reactions={"F": 1e3},
        joint_forces={"A|F": (0.0, 0.0, 1e3)},
        displacement=1e-4,
        settlement=1e-4,
        errors={
            "natural_map": eta,
            "penetration": 0.0,
            "balance": 1e-5,
            "reaction": 1e-6,
            "energy": None,
        },
    )


def setting(name, element=None, edge=1.0, step=1e-3, tolerance=1e-6, points=4, varied=None):
    coarse = math.inf if element is None else (edge / element.order) ** element.order
    overlay = Overlay(element=element, cells=1.0 / edge)
    return Variant(name, overlay, 1e3, element, edge, coarse, step, tolerance, points, varied)


def study(*listed):
    """Settings and runs, each of a setting, a cost and a stress."""
    settings = {one.name: one for one, _, _ in listed}
    runs = {
        one.name: Measured(
            one.name, one.overlay, Status.DONE, cost, 600.0, cpu=cost, quantities=quantities_of(stress)
        )
        for one, cost, stress in listed
    }
    return settings, runs


COARSE = setting("t10/1", Element.TET10, 1.0)
FINE = setting("t10/2", Element.TET10, 0.5)
LINEAR = setting("t4/2", Element.TET4, 0.5)
LOOSE = replace(FINE, name="t10/2 loose", tolerance=1e-4, varied="t10/2")
STIFF = setting("rigid")


def test_the_finest_mesh_is_the_reference_whatever_it_costs():
    settings, runs = study((COARSE, 5.0, 0.9), (FINE, 20.0, 1.0), (LINEAR, 90.0, 0.7), (LOOSE, 3.0, 1.01))
    found, rows = judge(settings, runs)
    assert (found.name, found.partner, found.ratio) == ("t10/2", "t10/1", 2.0)
    assert found.errors["von_mises_p99"] == pytest.approx(0.1)  # |0.9 - 1| / (2 - 1)
    by_name = {one.run.name: one.errors["von_mises_p99"] for one in rows}
    assert by_name == {
        "t10/1": pytest.approx(0.1),
        "t10/2": pytest.approx(0.1),  # its own, estimated
        "t4/2": pytest.approx(0.3),
        "t10/2 loose": pytest.approx(0.01),
    }


def test_the_estimate_is_that_of_richardson():
    third = setting("t10/3", Element.TET10, 1.0 / 3.0)
    found, _ = judge(*study((FINE, 20.0, 1.02), (third, 60.0, 1.0)))
    assert found.ratio == pytest.approx(1.5)
    assert found.errors["von_mises_p99"] == pytest.approx(
        0.04
    )  # errors e/2 and e/3 are apart by half the latter
    # of a quantity whose error is exactly of the first order it is the very error
    true, slope = 2.0, 0.3
    found, _ = judge(*study((FINE, 1.0, true + slope / 2.0), (third, 2.0, true + slope / 3.0)))
    assert found.errors["von_mises_p99"] == pytest.approx((slope / 3.0) / (true + slope / 3.0))


def test_a_variant_of_the_same_mesh_tells_nothing_of_the_error_of_the_mesh():
    found, _ = judge(*study((FINE, 20.0, 1.0), (LOOSE, 3.0, 1.01)))
    assert found.partner == ""
    assert found.errors["von_mises_p99"] is None
    assert found.errors["natural_map"] == 1e-7


def test_another_step_tells_less_of_a_mesh_than_another_element():
    slow = replace(FINE, name="h 5 ms", step=5e-3, varied="t10/2")
    found, _ = judge(*study((FINE, 20.0, 1.0), (slow, 3.0, 1.0), (LINEAR, 9.0, 0.7)))
    assert (found.name, found.partner, found.ratio) == ("t10/2", "t4/2", 2.0)
    found, _ = judge(*study((FINE, 20.0, 1.0), (slow, 3.0, 1.0)))
    assert (found.partner, found.ratio) == ("h 5 ms", 5.0)


def test_a_run_without_stress_is_never_the_reference_of_those_with():
    settings, runs = study((STIFF, 1.0, None), (COARSE, 2.0, 1.0))
    found, rows = judge(settings, runs)
    assert found.name == "t10/1"
    assert found.partner == ""
    assert {one.run.name: one.errors["von_mises_p99"] for one in rows}["rigid"] is None


def test_rigid_runs_are_judged_by_step_then_tolerance():
    tight = replace(STIFF, name="tight", tolerance=1e-8, varied="rigid")
    small = replace(STIFF, name="small step", step=5e-4, varied="rigid")
    found, _ = judge(*study((STIFF, 1.0, None), (tight, 2.0, None), (small, 2.0, None)))
    assert (found.name, found.partner, found.ratio) == ("small step", "tight", 2.0)
    found, _ = judge(*study((STIFF, 1.0, None), (tight, 2.0, None)))
    assert (found.name, found.partner) == ("tight", "rigid")


def test_runs_that_failed_or_were_stopped_are_not_judged():
    settings, runs = study((COARSE, 5.0, 0.9), (FINE, 20.0, 1.0))
    runs["t10/2"] = Measured("t10/2", FINE.overlay, Status.STOPPED, 30.0, 600.0, "stopped")
    found, rows = judge(settings, runs)
    assert found.name == "t10/1"
    assert len(rows) == 1
    assert judge(settings, {}) == (None, ())


def test_variants_are_of_interest_of_models_on_the_front_alone():
    listed = [(STIFF, 1.0, None), (COARSE, 5.0, 0.9), (LINEAR, 90.0, 0.7), (FINE, 20.0, 1.0)]
    third = setting("t10/3", Element.TET10, 1.0 / 3.0)
    assert models_of_interest(*study(*listed, (third, 50.0, 1.01)), "von_mises_p99") == {"t10/1", "t10/2"}
