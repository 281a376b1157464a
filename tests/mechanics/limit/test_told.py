"""What programmes, runs and curves tell of limit states, from numbers that a test gives."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.limit import facade_case
from mechanics.dynamics.outcome import Outcome
from mechanics.limit.assembly import assembly
from mechanics.limit.confirm import Confirmation, ConfirmationRun, likeness
from mechanics.limit.limit_load import Flow, Mechanism, limit_load
from mechanics.limit.live_loads import Acceleration
from mechanics.limit.pushover import Pushover, pushover
from mechanics.limit.thrust import thrust
from mechanics.scene.scene import Fidelity
from tests.mechanics.limit.test_loading_test import slippery
from tests.mechanics.shapes import brick, ground, scene


def test_joints_that_bear_stay_closed_as_a_support_yields_and_the_others_open():
    """A beam of 3.5 m on two posts of 0.5 m: as P yields it leans on its outer edge, and on the inner one of Q."""
    posts = [
        brick(code, (x, 0, -1), (x + 0.5, 0.5, 0), Fidelity.FIXED) for code, x in (("P", 0.0), ("Q", 3.0))
    ]
    on = assembly(scene(*posts, brick("beam", (0, 0, 0), (3.5, 0.5, 0.4))))
    found = thrust(on, ["P"], (0.0, 0.0, -1.0))
    for extreme, share, way in ((found.least, 1.25 / 3.0, -1.0), (found.greatest, 1.75 / 3.0, 1.0)):
        assert extreme.value / on.weight == pytest.approx(share, rel=1e-6)
        bears = extreme.force[:, 0] > 1e-3 * on.weight
        assert bears.sum() == 4
        assert (extreme.mechanism.opening == ~bears).all()
        assert not extreme.mechanism.sliding.any()
        support, beam = extreme.mechanism.velocity[on.rows(["P", "beam"], "")]
        assert support == pytest.approx([0, 0, way, 0, 0, 0], abs=1e-6)
        assert beam[2] == pytest.approx(way * share, rel=1e-4)


def run(multiplier, outcome):
    return ConfirmationRun(multiplier, outcome, 10, 0, np.zeros((1, 3)))


@pytest.mark.parametrize(
    ("held", "lost", "agrees"),
    [(0.49, 0.51, True), (0.4, 0.51, False), (0.49, 0.6, False), (0.0, 0.2, False)],
)
def test_runs_agree_with_a_candidate_where_they_hold_and_lose_next_to_it(held, lost, agrees):
    assert Confirmation(held, lost, ()).agrees(0.5) == agrees


def test_the_collapse_is_that_of_the_least_load_that_collapses():
    """What still moves at the end of its time has not collapsed."""
    trials = (
        run(0.8, Outcome.COLLAPSED),
        run(0.4, Outcome.MOVING),
        run(0.6, Outcome.COLLAPSED),
        run(0.3, Outcome.EQUILIBRIUM),
    )
    assert Confirmation(0.3, 0.4, trials).collapse.multiplier == 0.6
    assert Confirmation(0.3, 0.4, trials[1::2]).collapse is None


def curve(multiplier, inertia=0.0):
    places = np.arange(1.0, 1.0 + len(multiplier))
    return Pushover(
        "a", np.array([1.0, 0, 0]), places, np.array(multiplier), np.full(len(places), inertia), 0.1, 1.0, "", 10, 0
    )  # fmt: skip


def test_a_load_is_lost_after_its_peak_and_not_on_the_way_to_it():
    rising = curve([0.1, 0.2, 0.6, 1.0, 0.6, 0.2])
    assert rising.peak == 1.0
    assert rising.falls_to(0.5) == pytest.approx(5.25)
    assert rising.falls_to(0.1) == np.inf
    assert np.isnan(curve([0.1, 0.2], inertia=0.1).peak)
    assert curve([0.1, 0.2], inertia=0.1).falls_to(0.1) == np.inf


def test_the_load_that_sets_stones_in_motion_is_none_that_they_bear():
    """A block that tips bears tan(α - θ); in the first interval of its curve 7 ‰ of the load make it move."""
    wide, high, push = 0.3, 0.6, Acceleration((1.0, 0.0, 0.0))
    on = assembly(scene(ground(), brick("a", (0, 0, 0), (wide, 1, high))))
    found, seen = limit_load(on, push), []
    # led as if the limit were 15 % higher, which takes fewer steps to motion
    known = replace(found, multiplier=1.15 * found.multiplier)
    told = pushover(on, push, known, wide / 2, 20, progress=seen.append, stop=lambda: len(seen) > 0)
    slope, radius = np.arctan(wide / high), np.hypot(wide, high) / 2
    assert told.inertia == pytest.approx([3.5e-3], rel=0.1)
    tipped = slope - np.arcsin(np.sin(slope) - told.displacement / radius)
    assert told.multiplier == pytest.approx(np.tan(slope - tipped), abs=4e-3)


def test_what_moves_in_collapse_and_mechanism_alike_is_a_part_of_what_moves_in_either():
    """Of two equal stones one moves in the mechanism, and both, or the other alone, in the collapse."""
    on = assembly(scene(ground(), brick("a", (0, 0, 0), (1, 1, 1)), brick("b", (2, 0, 0), (3, 1, 1))))
    velocity, along = np.zeros((3, 6)), np.array([1.0, 0.0, 0.0])
    velocity[1, :3] = along
    none = np.zeros(len(on.contacts), dtype=bool)
    mechanism = Mechanism(velocity, np.array([0.0, 1.0, 0.0]), none, none)
    for moves, common in (([0, 1, 0], 1.0), ([0, 1, 1], 0.5), ([0, 0, 1], 0.0)):
        found = likeness(on, mechanism, np.outer(moves, along))
        assert found.common == pytest.approx(common)
        assert found.collapse == pytest.approx(sum(moves) / 2)


def test_the_higher_of_two_candidates_is_told_with_the_lower_beside_it():
    """Of a façade of four courses with return walls, pushed out: 0.61 and 0.56."""
    one = facade_case(4, 4, 2, 0.7, "out")
    found = limit_load(one.assembly(), one.live, Flow.COULOMB)
    assert found.converged
    assert found.lower.converged
    assert found.lowest is found.lower
    assert found.multiplier > 1.03 * found.lowest.multiplier
    assert found.lowest.multiplier == pytest.approx(0.557, rel=0.02)


@pytest.fixture(scope="module")
def slid():
    """A test of a block that slides below a beam."""
    return slippery(0.002)


def test_the_stiffness_is_the_secant_at_three_tenths_of_the_strength(slid):
    """Between 1 kN at 1 mm and 5 kN at 2 mm the force passes 3 kN at 1.5 mm."""
    test = replace(slid, displacement=1e-3 * np.arange(1.0, 5.0), force=1e3 * np.array([1.0, 5.0, 10.0, 9.0]))
    assert test.stiffness == pytest.approx(3e3 / 1.5e-3)


def test_steps_that_gather_speed_do_not_count_for_the_strength(slid):
    """Inertia of 2 % of the largest force is too much, of 0.5 % is not."""
    force = 1e3 * np.array([1.0, 5.0, 10.0, 9.0])
    test = replace(slid, force=force, inertia=np.array([0.0, 50.0, 200.0, -50.0]))
    assert test.calm.tolist() == [True, True, False, True]
    assert test.strength == (9e3, 0.0)
    assert replace(test, inertia=np.array([0.0, 0.0, 0.0, -200.0])).strength == (10e3, 0.0)
