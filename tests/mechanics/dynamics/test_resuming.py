"""A run that goes on from what it carried takes the same steps, to the last bit."""

from copy import deepcopy
from dataclasses import fields, is_dataclass, replace
from itertools import pairwise

import numpy as np
import pytest

from mechanics.carried import Carrier
from mechanics.dynamics.contact_search import ContactSearch
from mechanics.dynamics.outcome import Outcome
from mechanics.model.deformable import Compliance
from mechanics.scene.laws.bonds import BROKEN
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import BOND
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import (
    ContactSettings,
    Fidelity,
    LawRule,
    Method,
    Scene,
    Start,
    TimeSettings,
)
from mechanics.simulate import simulate
from mechanics.solvers.choice import choose_solver
from tests.mechanics.dynamics.test_stopping import between_walls
from tests.mechanics.shapes import brick, ground, scene
from tests.validation.statics.test_imperfect_vaults import barrel, warped

G = 9.81


def copied(carried):
    """A copy of each value by itself, as from a file: what was one object becomes two."""
    if isinstance(carried, dict):
        return {name: copied(value) for name, value in carried.items()}
    return deepcopy(carried)


class Kept:
    """An archive in memory: every checkpoint, copied as a file would."""

    def __init__(self, every=1, earlier=None):
        self.every, self.kept, self._earlier, self.frames = every, {}, earlier, []

    def earlier(self):
        return copied(self._earlier)

    def begin(self, bodies, frames):
        self.frames, self._grows = list(frames), frames

    def frame(self):
        self.frames.append(self._grows[-1])

    def checkpoint(self, step, carried):
        self.kept[step] = copied(carried)


def leaves(value, path=""):
    """Every number, text and array of a result, by its path; times of the machine are left out."""
    if path.endswith("wall_time"):
        return
    if is_dataclass(value):
        for one in fields(value):
            yield from leaves(getattr(value, one.name), f"{path}.{one.name}")
    elif isinstance(value, dict):
        for name, one in value.items():
            yield from leaves(one, f"{path}[{name}]")
    elif isinstance(value, tuple | list):
        for index, one in enumerate(value):
            yield from leaves(one, f"{path}[{index}]")
    else:
        yield path, np.asarray(value).tobytes() if isinstance(value, np.ndarray) else repr(value)


def assert_same_bits(one, other):
    first, second = dict(leaves(one)), dict(leaves(other))
    assert [path for path in first | second if first.get(path) != second.get(path)] == []


def pillar(count, fidelity=Fidelity.RIGID, **more):
    return [brick(f"S{k}", (0, 0, k), (1, 1, k + 1), fidelity, **more) for k in range(count)]


def tilted(degrees):
    angle = np.radians(degrees)
    return (G * float(np.sin(angle)), 0.0, -G * float(np.cos(angle)))


def shaking(peak, period, duration):
    time = np.arange(0.0, duration, 1e-3)
    velocity = np.outer(peak * np.sin(2 * np.pi * time / period), [1.0, 0.0, 0.0])
    return Loads(motions=(ImposedMotion(frozenset({"ground"}), History(time, velocity)),))


def shaken():
    """A stack on a shaken base, of which one joint is mortared and breaks."""
    blocks = (ground(), *pillar(3))
    rules = (LawRule(frozenset({"S0"}), frozenset({"S1"}), MortarJoint(0.3, 4e3, 4e3)),)
    return Scene(
        "shaken",
        blocks,
        contact=ContactSettings(DryJoint(0.6), rules),
        time=TimeSettings(1e-3, 0.5, 0.12, stop_at_equilibrium=False),
        loads=shaking(0.5, 0.1, 0.2),
        frame_every=7,
        series=("S0", "S1"),
    )


def on_springs():
    """A stack on a shaken base, whose joints yield, slide and open."""
    rules = (LawRule(frozenset({"S0"}), frozenset({"S1"}), DryJoint(0.3)),)
    return replace(
        shaken(), name="on springs", contact=ContactSettings(ElasticJoint(0.4, 1e8, 5e7, 1e-4), rules)
    )


def sleepers():
    """Stones that fall asleep, and are hit by one that falls."""
    blocks = (ground(), *pillar(2), brick("hit", (0.3, 0.3, 2.06), (0.7, 0.7, 2.4)))
    return Scene("sleepers", blocks, time=TimeSettings(1e-3, 0.5, 0.2, stop_at_equilibrium=False, sleep=1e-3))


def soft():
    """Elastic stones, over which a third slides, so that ever other nodes touch."""
    row = [
        brick(f"S{k}", (k, 0, 0), (k + 1, 1, 1), Fidelity.DEFORMABLE, mesh_size=0.3 + 0.1 * k)
        for k in range(2)
    ]
    slab = brick("slab", (0.1, 0.2, 1), (0.7, 0.8, 1.2), velocity=(4.0, 0, 0, 0, 0, 0))
    return scene(ground(), *row, slab, friction=0.3, step=1e-2, theta=0.5, duration=0.3)


def refuted():
    """Stones that ADMM holds between two walls: their rests do not last without its forces, and the run goes on."""
    return between_walls(Method.ADMM, 2)


def relaxed():
    return scene(
        ground(), *pillar(3, Fidelity.DEFORMABLE), gravity=tilted(8), step=5e-3, duration=1.0, relaxation=True
    )


def from_equilibrium():
    stones = *pillar(2, Fidelity.DEFORMABLE), brick("S2", (0, 0, 2), (1, 1, 3))
    times = {"step": 1e-3, "theta": 0.5, "duration": 0.02, "stop_at_equilibrium": False}
    return scene(ground(), *stones, start=Start.EQUILIBRIUM, **times)


def yielding():
    """Warped stones whose joints must give way."""
    return warped(barrel(9, 2))


SCENES = {
    one.__name__: one
    for one in (shaken, on_springs, sleepers, soft, relaxed, refuted, yielding, from_equilibrium)
}


def instants(archive):
    """An early, a middle and the last checkpoint."""
    steps = sorted(archive.kept)
    return sorted({steps[min(2, len(steps) - 1)], steps[2 * len(steps) // 3], steps[-1]})


@pytest.mark.parametrize("name", SCENES)
def test_a_resumed_run_ends_with_the_same_bits_and_so_does_one_resumed_again(name):
    one, archive = SCENES[name](), Kept()
    whole = simulate(one, archive=archive)
    assert_same_bits(whole, simulate(one))
    assert archive.frames == list(whole.frames)
    assert sorted(archive.kept) == list(range(1, whole.steps))
    for step in instants(archive):
        again = Kept(every=5, earlier=archive.kept[step])
        assert_same_bits(whole, simulate(one, archive=again))
        if again.kept:
            assert_same_bits(whole, simulate(one, archive=Kept(0, again.kept[max(again.kept)])))


def test_the_scenes_do_what_they_are_for():
    """Bonds break, stones sleep and wake, elastic stones are condensed in parts, and a rest is refuted."""
    kept = {}
    for name, one in SCENES.items():
        archive = Kept()
        simulate(one(), archive=archive)
        kept[name] = [archive.kept[step]["simulation"] for step in sorted(archive.kept)]
    bonds = [one["_memory"]["_values"][:, 6 + BOND].min(initial=1.0) for one in kept["shaken"]]
    assert bonds[0] == 0.0
    assert bonds[-1] == BROKEN
    asleep = [int(one["_sleepers"]["asleep"].sum()) for one in kept["sleepers"]]
    assert any(before > after for before, after in pairwise(asleep))
    assert any(condensed[:, 1].max() > 0 for condensed in kept["soft"][-1]["condensed"])
    assert kept["refuted"][-1]["_freed"]
    assert any(one["_joints"].value > 0 for one in kept["yielding"])


def test_an_interrupted_run_goes_on_as_if_nothing_had_been():
    one = SCENES["shaken"]()
    stopped = Kept(0)
    count = iter(range(100))
    part = simulate(one, stop=lambda: next(count) == 40, archive=stopped)
    assert part.outcome is Outcome.INTERRUPTED
    assert list(stopped.kept) == [41]
    # the last frame of what was stopped belongs to no whole run
    assert part.frames[-1].time not in [frame.time for frame in stopped.kept[41]["log"]["frames"]]
    assert_same_bits(simulate(one), simulate(one, archive=Kept(0, stopped.kept[41])))


# attributes of objects that keep what they make: functions of the scene, of a configuration, of an order of nodes
KEEPERS = {
    ContactSearch: {"_clock", "_compliance", "_detector", "_elastic_scale", "_every_step", "_last", "recess"},
    Compliance: {
        "_batch", "_condensed", "_duration", "_factor", "_modes", "_nodes", "_order", "_projector", "_stone", "_whole",
    },
}  # fmt: skip


def immutable(one):
    """Numbers, or tuples and frozen records of these."""
    if isinstance(one, tuple):
        return all(map(immutable, one))
    if is_dataclass(one):
        return type(one).__dataclass_params__.frozen and all(map(immutable, vars(one).values()))
    return isinstance(one, int | float | None)


@pytest.mark.parametrize("name", SCENES)
def test_every_attribute_that_changes_is_carried(name, monkeypatch):
    """A new attribute must be named as carried or as rebuilt, or a resumed run would silently begin without it."""
    made = []
    monkeypatch.setattr("mechanics.simulate._Run.carried", lambda run: made.append(run) or {})
    stop = iter([False, False, True])
    simulate(SCENES[name](), stop=lambda: next(stop), archive=Kept(0))
    carriers, seen = [*made], []
    while carriers:
        one = carriers.pop()
        seen.append(type(one).__name__)
        assert set(vars(one)) == {*one.CARRIED, *one.REBUILT}, type(one).__name__
        assert not {*one.CARRIED} & {*one.REBUILT}
        carriers += [
            value for key, value in vars(one).items() if isinstance(value, Carrier) and key not in seen
        ]
        carriers = [value for value in carriers if type(value).__name__ not in seen]
    expected = {"_Run", "Log", "Watch", "Simulation", "Memory", "Sleepers", "Relaxation", "EnergyBalance"}
    assert expected | {"Observer", "PeakTracker"} <= set(seen)
    simulation = made[0].simulation
    for keeper in (simulation._detect, *simulation._compliance):
        assert set(vars(keeper)) == KEEPERS[type(keeper)]
    # solvers remember nothing of their own
    assert immutable(choose_solver(simulation.model.scene.solver))
