"""Expected cost of a run: amounts counted by hand, and known rates."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.cost import KINDS, Case, fitted
from mechanics.results.forecast.cost import expected_cost, machine_slowness, measures
from mechanics.results.forecast.cost_rates import RATES, Rate
from mechanics.results.forecast.plan import Amounts, plan
from mechanics.scene.loads.gravity import GravityRamp
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import Fidelity, Scene, Start, TimeSettings
from tests.validation.scenes import box, ground


def cubes(fidelity, count=1, **time):
    size = 0.5 if fidelity is Fidelity.DEFORMABLE else None
    stones = [
        box(str(k), (k * 2.0, 0.0, 0.0), (k * 2.0 + 1.0, 1.0, 1.0), fidelity=fidelity, mesh_size=size)
        for k in range(count)
    ]
    return Scene("cubes", (ground(20.0), *stones), time=TimeSettings(**time))


def test_amounts_of_rigid_cubes():
    assert plan(cubes(Fidelity.RIGID, 3)).amounts == Amounts(stones=4, contacts=12)


def test_amounts_of_equal_deformable_cubes_that_touch_only_the_ground():
    """One front for each cube, of three pivots for each contact, and nothing beside it: k² numbers, ⅔ k³ operations."""
    needs = plan(cubes(Fidelity.DEFORMABLE, 3))
    own = needs.amounts
    assert own.nodes == needs.meshes.nodes == 3 * own.distinct_nodes
    pivots = 3 * own.contacts // 3
    assert own.fronts == 3
    assert own.factor == 3 * pivots**2
    assert own.flops == pytest.approx(3 * 2 / 3 * pivots**3)
    assert own.blocks == 3 * pivots**2


def test_seconds_scale_with_the_machine_and_add_up():
    scene = cubes(Fidelity.RIGID, 5, start=Start.EQUILIBRIUM)
    needs = plan(scene)
    one, slow = expected_cost(needs, scene), expected_cost(needs, scene, slowness=3.0)
    assert np.array(slow.seconds) == pytest.approx(3.0 * np.array(one.seconds))
    assert slow.longest == pytest.approx(3.0 * one.longest)
    assert slow.memory == one.memory
    assert sum(one.by_stage.values()) == pytest.approx(one.seconds[1])
    assert set(one.by_stage) == {"mesh", "start", "stress", "steps"}
    low, likely, high = one.seconds
    assert low < likely < high
    assert likely <= one.longest


def test_more_stones_and_finer_meshes_cost_more():
    sizes = [plan(cubes(Fidelity.RIGID, count)).amounts for count in (2, 8)]
    costs = [
        expected_cost(plan(cubes(kind, count)), cubes(kind, count))
        for kind in (Fidelity.RIGID, Fidelity.DEFORMABLE)
        for count in (2, 8)
    ]
    assert sizes[0].contacts < sizes[1].contacts
    assert costs[0].seconds[1] < costs[1].seconds[1] < costs[3].seconds[1]
    assert costs[0].memory < costs[1].memory
    assert costs[2].memory < costs[3].memory


@pytest.mark.parametrize(
    ("time", "steps"),
    [
        ({"stop_at_equilibrium": False, "duration": 0.5}, (500, 500, 500)),
        ({"duration": 0.002}, (2, 2, 2)),
        ({"start": Start.EQUILIBRIUM}, (5, 6, 40)),
        ({"relaxation": True, "step": 1e-2}, (5, 20, 80)),
    ],
)
def test_steps_are_known_or_lie_in_a_range(time, steps):
    scene = cubes(Fidelity.RIGID, **time)
    assert expected_cost(plan(scene), scene).steps == steps


def test_no_run_ends_before_its_loads_do():
    scene = cubes(Fidelity.RIGID, start=Start.EQUILIBRIUM)
    scene = replace(scene, loads=Loads(gravity=(GravityRamp(0.3),)))
    assert expected_cost(plan(scene), scene).steps == (305, 306, 340)


def test_rates_are_found_again_from_times_that_they_made():
    truth = {"stones": 2e-3, "contacts": 3e-5}
    work = [measures(Amounts(stones, contacts)) for stones, contacts in ((10, 40), (50, 900), (400, 2000))]
    seconds = np.array([Rate(truth, 1.0, 1.0)(one) for one in work])
    rate = fitted(work, seconds, ("one", "stones", "contacts"))
    assert rate.per == pytest.approx(truth, rel=1e-2)


def test_the_spread_holds_most_of_what_was_measured():
    rng = np.random.default_rng(1)
    work = [measures(Amounts(int(n), 4 * int(n))) for n in rng.integers(10, 1000, 60)]
    noise = np.exp(rng.normal(0.0, 0.5, 60))
    seconds = np.array([1e-3 * one["stones"] for one in work]) * noise
    rate = fitted(work, seconds, ("stones",))
    ratio = seconds / [rate(one) for one in work]
    assert rate.per["stones"] == pytest.approx(1e-3, rel=0.3)
    assert np.mean((ratio < rate.above) & (ratio > 1 / rate.below)) > 0.75
    assert max(rate.below, rate.above) < 2.5


def test_every_stage_has_a_rate_and_a_spread():
    for rate in RATES.values():
        assert rate.per
        assert all(value > 0 for value in rate.per.values())
        assert min(rate.below, rate.above) >= 1.2


def test_this_machine_is_of_this_age():
    assert 0.05 < machine_slowness() < 50.0


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_scenes_that_are_measured_stand_on_something(kind):
    needs = plan(Case(kind, 30).scene())
    assert not needs.loose
    assert 15 <= sum(needs.bodies.values()) <= 80


def test_what_sleep_would_save_is_told_where_it_can():
    scene = cubes(Fidelity.RIGID, 20, stop_at_equilibrium=False)
    cost = expected_cost(plan(scene), scene)
    assert cost.asleep is not None
    assert cost.asleep < cost.seconds[1]
    for other in (
        cubes(Fidelity.RIGID, 2),
        cubes(Fidelity.RIGID, 2, stop_at_equilibrium=False, relaxation=True),
        cubes(Fidelity.DEFORMABLE, 1, stop_at_equilibrium=False),
    ):
        assert expected_cost(plan(other), other).asleep is None


@pytest.mark.parametrize(
    ("time", "words"),
    [
        ({"stop_at_equilibrium": False, "duration": 0.5}, "how many iterations"),
        ({"duration": 0.004}, "how many iterations"),  # shorter than any rest
        ({"duration": 0.04, "step": 1e-2, "relaxation": True}, ""),
        ({"start": Start.EQUILIBRIUM}, "whether it begins in equilibrium"),
        ({"relaxation": True}, "when it rests"),
        ({}, "when it rests"),
    ],
)
def test_where_the_end_cannot_be_known_it_is_said_and_the_range_reaches_to_contacts_that_never_converge(
    time, words
):
    scene = cubes(Fidelity.RIGID, 20, **time)
    cost = expected_cost(plan(scene), scene)
    assert cost.unknown.startswith(words)
    assert bool(cost.unknown) == bool(words)
    easy = replace(scene, solver=replace(scene.solver, max_iterations=1))
    harder = replace(scene, solver=replace(scene.solver, max_iterations=10**6))
    low, _, high = expected_cost(plan(easy), easy).seconds
    assert (expected_cost(plan(harder), harder).seconds[2] > 10.0 * high) == bool(words)
    assert low == expected_cost(plan(harder), harder).seconds[0]
