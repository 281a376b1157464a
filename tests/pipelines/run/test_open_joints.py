"""Open joints: check, run and assess have one rule for the gap up to which a joint counts as closed."""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.limit.assembly import assembly
from mechanics.limit.dead_load import stands
from mechanics.limit.limit_load import limit_load
from mechanics.limit.live_loads import Acceleration
from mechanics.model.balls import ball
from mechanics.scene.scene import Fidelity, Scene, TimeSettings
from mechanics.scene.shapes import LIMESTONE, box
from mechanics.simulate import simulate
from pipelines.run.open_joints import open_joints, rigid_model

ALONG = Acceleration((1.0, 0.0, 0.0))


def lintel(gap, **fields):
    """Two piers 0.4 m wide, and a lintel that floats above them [m]."""
    blocks = (
        box("BASE", (-1, 0, -0.3), (2, 0.4, 0), fidelity=Fidelity.FIXED),
        box("P1", (0, 0, 0), (0.4, 0.4, 1)),
        box("P2", (0.8, 0, 0), (1.2, 0.4, 1)),
        box("L", (0, 0, 1 + gap), (1.2, 0.4, 1.4 + gap), **fields),
    )
    return Scene("lintel", blocks, time=TimeSettings(1e-3, duration=0.2))


def test_a_gap_of_a_thousandth_is_closed_for_all_and_a_wider_one_for_none():
    """The smaller stone is 0.4 m wide: 0.39 mm are closed, 0.41 mm are open."""
    closed, wide = lintel(0.39e-3), lintel(0.41e-3)
    (told,) = open_joints(*rigid_model(closed)).in_words()
    assert told.startswith(
        "gaps of up to 0.001 of the smaller stone's width count as closed: 2 of 4 joints have one"
    )
    (told,) = open_joints(*rigid_model(wide)).in_words()
    assert told.startswith("2 of 4 joints gape wider than 0.001")
    assert "P1 – L 0.41 mm" in told
    assert assembly(closed).gaping == 0
    assert assembly(wide).gaping == 8
    assert np.abs(simulate(closed).bodies[-1].displacement).max() < 1e-7
    fell = simulate(wide)
    assert fell.outcome is Outcome.EQUILIBRIUM
    assert fell.bodies[-1].displacement[:, 2] == pytest.approx(-0.41e-3, rel=1e-3)


def test_joints_without_gaps_are_not_spoken_of():
    found = open_joints(*rigid_model(lintel(0.0)))
    assert found.closed.all()
    assert found.in_words() == ()


def test_stones_in_flight_and_balls_keep_their_gaps():
    thrown = lintel(0.1e-3, velocity=(0.0, 0.0, -1e-3, 0.0, 0.0, 0.0))
    assert open_joints(*rigid_model(thrown)).closed.tolist() == [True, True, False, False]
    ground = lintel(0.0).blocks[0]
    above = ball("B", (0.0, 0.2, 0.1 + 0.1e-3), 0.1, LIMESTONE)
    assert not open_joints(*rigid_model(Scene("ball", (ground, above)))).closed.any()


def test_limit_loads_are_those_of_the_joints_on_which_stones_come_to_rest():
    """Where the lintel has come down by its gap, the load is that of the scene without one."""
    on = assembly(lintel(1e-3))
    assert np.isnan(limit_load(on, ALONG).multiplier)
    rested = assembly(replace(on.model.scene, blocks=stands(on).blocks))
    assert rested.gaping == 0
    whole = limit_load(assembly(lintel(0.0)), ALONG).multiplier
    assert limit_load(rested, ALONG).multiplier == pytest.approx(whole, rel=1e-4)
