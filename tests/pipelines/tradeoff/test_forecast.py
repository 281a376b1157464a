"""Choice of the next run of a study, in a world where the time of each run is known beforehand."""

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechanics.stones.meshing.elements import Element
from pipelines.tradeoff.forecast import Forecast, left_out, next_run
from pipelines.tradeoff.grid import Variant
from pipelines.tradeoff.store import Measured, Status
from pipelines.tuning.overlay import Overlay

GIB = 2**30


def model(name, element, unknowns):
    return Variant(name, Overlay(element=element), unknowns, element, 1.0, 1.0, 1e-3, 1e-6, 4)


def variant(of, name, effort=1.0):
    return Variant(
        name, Overlay(tolerance=1e-4), of.unknowns, of.element, 1.0, 1.0, 1e-3, 1e-4, 4, of.name, effort
    )


LADDER = [
    model(f"{element} {n}", element, 1e3 * n**3)
    for element in (Element.TET4, Element.HEX20)
    for n in (1, 2, 3, 4, 6)
]
SETTINGS = [*LADDER, *(variant(one, f"{one.name} loose") for one in LADDER)]


@dataclass
class World:
    """Runs take a constant plus a power of their unknowns, which the forecast does not know."""

    rate: float
    power: float
    start: float = 1.0
    memory: float = 1e6

    def run(self, choice, budget):
        setting = choice.setting
        work = self.rate * (setting.unknowns / 1e3) ** self.power
        elapsed = self.start + work * (2.0 if work < 5.0 else 1.0)
        if elapsed > choice.limit:
            return Measured(
                setting.name, setting.overlay, Status.STOPPED, choice.limit, budget, wall=choice.limit
            )
        return Measured(
            setting.name,
            setting.overlay,
            Status.DONE,
            elapsed,
            budget,
            cpu=work,
            wall=work,
            memory=int(GIB + self.memory * (setting.unknowns / 1e3) ** 1.3),
        )


def carried_out(world, budget, ended=None, memory=16.0 * GIB):
    """Return the runs within a budget, in their order."""
    ended = dict(ended or {})
    settings = {one.name: one for one in SETTINGS}
    order = []
    while True:
        left = budget - sum(one.elapsed for one in ended.values())
        forecast = Forecast(settings, ended)
        over = {n for n, one in ended.items() if one.status is not Status.STOPPED or one.budget >= budget}
        choice = next_run(forecast, over, {one.name for one in LADDER}, left, budget, memory)
        if choice is None:
            return order, ended, forecast, left
        assert 0.0 < choice.limit <= left
        order.append(choice.setting.name)
        ended[choice.setting.name] = world.run(choice, budget)


worlds = st.builds(World, rate=st.floats(1e-3, 100.0), power=st.floats(0.5, 3.0), start=st.floats(0.1, 10.0))


@given(worlds, st.floats(10.0, 3600.0))
def test_no_study_takes_longer_than_its_budget(world, budget):
    order, ended, _, _ = carried_out(world, budget)
    assert sum(one.elapsed for one in ended.values()) <= budget * (1.0 + 1e-9)
    assert len(order) == len(set(order))
    assert order  # the first is always tried


@given(worlds, st.floats(10.0, 1000.0))
def test_a_study_that_goes_on_does_what_an_unbroken_one_does(world, budget):
    order, ended, _, _ = carried_out(world, budget)
    half = {name: ended[name] for name in order[: len(order) // 2]}
    again, _, _, _ = carried_out(world, budget, half)
    assert again == order[len(order) // 2 :]
    assert carried_out(world, budget, ended)[0] == []


@given(worlds, st.floats(10.0, 300.0))
def test_more_time_gives_runs_that_were_stopped_another_chance(world, budget):
    _, ended, _, _ = carried_out(world, budget)
    stopped = {name for name, one in ended.items() if one.status is Status.STOPPED}
    order, _, _, _ = carried_out(world, 1e9, ended)
    assert stopped <= set(order)


def test_cheap_ones_come_first_and_the_forecast_learns():
    world = World(rate=0.2, power=1.7)
    order, ended, forecast, _ = carried_out(world, 600.0)
    models = [name for name in order if "loose" not in name]
    assert models[0].endswith(" 1")
    assert models.index("tet4 1") < models.index("tet4 2") < models.index("tet4 3")
    known = Forecast(forecast.settings, {name: one for name, one in ended.items() if name != "hex20 3"})
    work = 0.2 * 27.0**1.7
    assert known.seconds(forecast.settings["hex20 3"]) == pytest.approx(1.0 + work, rel=0.3)


def test_a_run_without_precedent_has_a_share_of_the_budget():
    choice = next_run(Forecast({one.name: one for one in SETTINGS}, {}), (), (), 600.0, 600.0, GIB)
    assert choice.limit == pytest.approx(200.0)
    assert choice.setting.unknowns == 1e3


def test_what_does_not_fit_the_memory_is_not_begun():
    world = World(rate=1e-3, power=1.0, memory=1e8)
    order, ended, forecast, left = carried_out(world, 600.0, memory=3.0 * GIB)
    assert "tet4 1" in order
    assert "hex20 6" not in order
    reason = left_out(forecast, forecast.settings["hex20 6"], left, 3.0 * GIB)
    assert "GiB of memory" in reason
    assert all(one.memory < 3.0 * GIB for one in ended.values())


def test_reasons_say_what_is_missing():
    settings = {one.name: one for one in SETTINGS}
    nothing = Forecast(settings, {})
    assert "of which there is no result" in left_out(nothing, settings["tet4 1 loose"], 10.0, GIB)
    slow = Measured("tet4 1", LADDER[0].overlay, Status.DONE, 50.0, 60.0, cpu=50.0, wall=50.0)
    some = Forecast(settings, {"tet4 1": slow})
    assert "s of the budget are left for it" in left_out(some, settings["tet4 2"], 10.0, GIB)
    assert left_out(some, settings["tet4 2"], 0.0, GIB) == "the budget is spent"
    assert "not on the front" in left_out(some, settings["tet4 1 loose"], 600.0, GIB)


def test_variants_are_forecast_by_what_they_vary():
    base = Measured("tet4 1", LADDER[0].overlay, Status.DONE, 21.0, 60.0, cpu=20.0, wall=20.0)
    twice = variant(LADDER[0], "tight", effort=2.0)
    forecast = Forecast({"tet4 1": LADDER[0], "tight": twice}, {"tet4 1": base})
    assert forecast.seconds(twice) == pytest.approx(41.0)
    failed = Measured("tet4 1", LADDER[0].overlay, Status.FAILED, 1.0, 60.0)
    assert Forecast({"tet4 1": LADDER[0]}, {"tet4 1": failed}).seconds(twice) is None
