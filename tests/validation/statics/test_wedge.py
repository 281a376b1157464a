"""A rock wedge on two planes, and a bar between two walls: nothing hangs by stresses that no load causes.

Two planes of dip and dip direction 40°/130° and 60°/220° carry a wedge between them; it can only slide along their line
of intersection, of plunge ψ. Across that line the normal forces balance W cos ψ,

    N_A n_A + N_B n_B = -W_across,     so it slides where     W sin ψ > tan φ (N_A + N_B)

and the critical angle of friction is 33.36° (Hoek & Bray 1981). Nothing else is needed for its balance; but planes that
are pressed apart would clamp the wedge at any angle, if a solver left such forces behind.
"""

from dataclasses import replace

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Fidelity, Scene, TimeSettings
from mechanics.scene.shapes import prism
from mechanics.simulate import simulate
from tests.validation.scenes import G, box

STEPS = [1e-2, 5e-3, 2e-3, 1e-3]


def upward(dip, direction):
    """Normal of a plane, x to the east and y to the north."""
    dip, direction = np.radians([dip, direction])
    return np.array([np.sin(dip) * np.sin(direction), np.sin(dip) * np.cos(direction), np.cos(dip)])


PLANES = upward(40.0, 130.0), upward(60.0, 220.0)
LINE = np.cross(*PLANES)
LINE *= -np.sign(LINE[2]) / np.linalg.norm(LINE)
PLUNGE = np.arcsin(-LINE[2])
# n_A N_A + n_B N_B, over W
ACROSS = np.array([0.0, 0.0, 1.0]) - LINE * LINE[2]
NORMAL = np.linalg.lstsq(np.column_stack(PLANES), ACROSS, rcond=None)[0]
CRITICAL = np.arctan(np.sin(PLUNGE) / NORMAL.sum())


def wedge(degrees, step, relaxation=False, duration=2.0):
    """The wedge in a trough of two fixed slabs; drawn across the line of intersection, which is then turned to LINE."""
    up = ACROSS / np.linalg.norm(ACROSS)
    turn = np.column_stack([np.cross(LINE, up), LINE, up])
    across = [(turn.T @ normal)[[0, 2]] for normal in PLANES]
    # along each plane, upwards
    along = [np.array([n[1], -n[0]]) * np.sign(-n[0]) for n in across]
    outlines = {"wedge": [np.zeros(2), *(a / a[1] for a in along)]}
    for name, n, a in zip("AB", across, along, strict=True):
        outlines[name] = [np.zeros(2), 3.0 * a, 3.0 * a - n, -n]
    blocks = []
    for name, outline in outlines.items():
        (x1, z1), (x2, z2) = outline[1] - outline[0], outline[2] - outline[1]
        corners = outline if x1 * z2 > x2 * z1 else outline[::-1]
        block = prism(name, [tuple(corner) for corner in corners], 3.0 if name == "wedge" else 12.0)
        fidelity = Fidelity.RIGID if name == "wedge" else Fidelity.FIXED
        blocks.append(replace(block, vertices=block.vertices @ turn.T, fidelity=fidelity))
    return Scene(
        "wedge",
        tuple(blocks),
        contact=ContactSettings(DryJoint(float(np.tan(np.radians(degrees))))),
        time=TimeSettings(step, 1.0, duration, relaxation=relaxation, collapse_displacement=0.02),
    )


def test_the_critical_angle_is_that_of_limit_equilibrium():
    assert np.degrees(CRITICAL) == pytest.approx(33.357, abs=1e-3)


@pytest.mark.parametrize("relaxation", [False, True], ids=["motion", "relaxation"])
@pytest.mark.parametrize("step", STEPS)
def test_a_wedge_slides_below_the_critical_angle_and_rests_above_it(step, relaxation):
    assert simulate(wedge(33.5, step, relaxation)).outcome is Outcome.EQUILIBRIUM
    duration = 0.25 if step < 5e-3 else 2.0
    below = simulate(wedge(33.2, step, relaxation, duration))
    assert below.outcome in (Outcome.MOVING, Outcome.COLLAPSED)
    assert np.linalg.norm(below.bodies[0].displacement.mean(axis=0)) > 1e-3 * (duration / 0.25) ** 2


@pytest.mark.parametrize("step", STEPS)
def test_a_wedge_slides_as_fast_as_friction_lets_it(step):
    """a = g (sin ψ - tan φ (N_A + N_B)/W); the implicit scheme is ahead by half a step."""
    result = simulate(wedge(28.0, step, duration=0.2))
    pull = G * (np.sin(PLUNGE) - np.tan(np.radians(28.0)) * NORMAL.sum())
    way = 0.5 * pull * 0.2 * (0.2 + step)
    np.testing.assert_allclose(result.bodies[0].displacement.mean(axis=0), way * LINE, atol=0.01 * way)


@pytest.mark.parametrize("relaxation", [False, True], ids=["motion", "relaxation"])
@pytest.mark.parametrize("step", STEPS)
def test_a_bar_between_two_upright_walls_falls(step, relaxation):
    """It touches both, and nothing presses it against them: ½ g t² after 0.1 s; the scheme is ahead by half a step."""
    blocks = (
        replace(box("left", (-1.1, 0.0, -1.0), (-0.9, 1.0, 1.4)), fidelity=Fidelity.FIXED),
        box("bar", (-0.9, 0.0, -0.2), (0.9, 1.0, 0.6)),
        replace(box("right", (0.9, 0.0, -1.0), (1.1, 1.0, 1.4)), fidelity=Fidelity.FIXED),
    )
    time = TimeSettings(step, 1.0, 0.1, relaxation=relaxation, collapse_displacement=0.5)
    result = simulate(Scene("bar", blocks, contact=ContactSettings(DryJoint(0.84)), time=time))
    fallen = 0.5 * G * 0.1 * (0.1 + step)
    assert result.outcome is Outcome.MOVING
    np.testing.assert_allclose(result.bodies[1].displacement[:, 2], -fallen, rtol=1e-3)
