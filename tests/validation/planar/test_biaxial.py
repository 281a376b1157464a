"""Biaxial compression of a hexagonal packing between platens: case G1."""

import numpy as np
import pytest

from mechanics.planar.run import PlanarRun
from mechanics.planar.scene import Disk, PlanarScene, PlanarTime, Wall
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import LawRule
from tests.mechanics.solvers.cone_program import ConeProgram

RADIUS, COLUMNS, ROWS = 1.0, 7, 9
SIDE = 1e3  # confining pressure [Pa]
MOVES = 1e-5  # of the top, that is sliding [m/s]; an excess force of 0.2 % makes it faster in a step


def first_sliding(friction, expected, step=1e-2, steps=40):
    """The stress ratio at which the top first sinks, as its force grows from 0.96 to 1.04 times the one expected.

    Rows of 6 and 7 disks in turns, smooth platens all around. Side platens touch the long rows alone. Short rows are
    first and last: so each disk has contacts on both sides of a line of symmetry, and the packing is stressed evenly.
    """
    disks = tuple(
        Disk(
            f"{row}-{column}",
            (2.0 * RADIUS * column + RADIUS * (1 - row % 2), np.sqrt(3.0) * RADIUS * row),
            RADIUS,
            density=10.0,
        )
        for row in range(ROWS)
        for column in range(COLUMNS - 1 + row % 2)
    )
    high, wide = np.sqrt(3.0) * RADIUS * (ROWS - 1), 2.0 * RADIUS * (COLUMNS - 1)
    low, top, far = -RADIUS, high + RADIUS, wide + RADIUS
    walls = (
        Wall("floor", (-9.0, low), (wide + 9.0, low)),
        Wall("top", (-9.0, top), (wide + 9.0, top), mass=1e3),
        Wall("left", (-RADIUS, low - 9.0), (-RADIUS, top + 9.0), mass=1e3),
        Wall("right", (far, low - 9.0), (far, top + 9.0), mass=1e3),
    )
    ratios, times = expected * np.array([0.96, 1.04]), np.array([0.0, steps * step])
    press = History(times, np.column_stack([0 * ratios, -SIDE * wide * ratios, 0 * ratios]))
    sides = {
        code: History.constant([sign * SIDE * high, 0.0, 0.0])
        for code, sign in (("left", 1.0), ("right", -1.0))
    }
    codes = frozenset(disk.code for disk in disks)
    scene = PlanarScene(
        "biaxial",
        disks,
        walls,
        gravity=(0.0, 0.0),
        law=DryJoint(friction=friction),
        rules=(LawRule(frozenset(wall.code for wall in walls), codes, DryJoint(friction=0.0)),),
        time=PlanarTime(step, 1.0, steps * step, stop_at_equilibrium=False),
        loads=Loads(forces=tuple(StoneForce(frozenset({c}), f) for c, f in (("top", press), *sides.items()))),
    )
    # at the edge of sliding, errors of iterations move the disks
    run = PlanarRun(scene, ConeProgram(1e-8, 1e-8))
    while not run.done:
        last = run.step()
        speed = -last.after.velocity[len(disks) + 1, 1]
        if speed > MOVES:
            break
    return np.interp(last.after.time, times, ratios), speed


@pytest.mark.parametrize(
    ("friction", "ratio"), [(0.0, 3.000), (0.1, 3.838), (0.2, 5.120), (0.3, 7.327), (0.4, 12.02)]
)
def test_a_hexagonal_packing_slides_at_the_ratio_of_its_contacts(friction, ratio):
    """σ1/σ2 = √3 tan(60° + φμ) (Rowe 1962); within 1 %."""
    found, speed = first_sliding(friction, ratio)
    assert speed > MOVES
    assert found == pytest.approx(ratio, rel=0.01)
