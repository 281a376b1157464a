"""An elastic bar pulled along a rigid foundation with friction: how far the slip reaches (F15)."""

import numpy as np
import pytest

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.gravity import GravityRamp
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, LawRule, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from tests.validation.elastic.elastic_blocks import elastic_box
from tests.validation.scenes import G, box, ground

# μq = 2 kN/m and P = 0.4 m · μq, in the proportions of F15: q = ρ g A. Friction at the foot bends the bar and shifts
# μq h/2 of its weight from the end of the slip to its beginning: 0.6 % of P here, 2.5 % for a bar of 4 cm
LENGTH, SIDE, THICK, FRICTION, YOUNG = 1.0, 0.04, 0.01, 0.5, 1e9
AREA = SIDE * THICK
WEIGHT = 4000.0
BAR = Material("bar", density=WEIGHT / (G * AREA), young=YOUNG, poisson=0.0)
# as light as it can be: it only takes the pull
HEAD = Material("head", density=100.0, young=YOUNG, poisson=0.0)
PULL = 0.4 * FRICTION * WEIGHT


def pulled(times, parts, duration, size=SIDE):
    """The bar lies on the ground, its end at x = 0 is bonded to a rigid head in the air that is pulled along -x."""
    half = SIDE / 2
    blocks = (
        ground(half=2.0),
        elastic_box("bar", [0.0, -half, 0.0], [LENGTH, half, THICK], BAR, size),
        box("head", [-SIDE, -half, THICK / 4], [0.0, half, THICK], HEAD),
    )
    glue = MortarJoint(0.6, 16 * PULL / AREA, 16 * PULL / AREA)
    rules = (LawRule(frozenset({"bar"}), frozenset({"head"}), glue),)
    # in the plane of the foundation, so that it does not tip the bar
    history = History(times, np.outer(np.array(parts) * PULL, [-1.0, 0.0, 0.0]))
    force = StoneForce(frozenset({"head"}), history, arm=(0.0, 0.0, -5 / 8 * THICK))
    scene = Scene(
        "pull",
        blocks,
        contact=ContactSettings(DryJoint(FRICTION), rules=rules),
        time=TimeSettings(1e-2, 1.0, duration, stop_at_equilibrium=False),
        solver=SolverSettings(tolerance=1e-8),
        loads=Loads(gravity=(GravityRamp(0.3),), forces=(force,)),
    )
    return simulate(scene)


def sections(result):
    """x (k,) of the sections of the bar, and its mean displacement along -x in each (k,) [m]."""
    body = result.bodies[1]
    x = np.unique(np.round(body.reference[:, 0], 9))
    u = np.array([-body.displacement[np.isclose(body.reference[:, 0], one), 0].mean() for one in x])
    return x, u


def mobilised(result):
    """Friction on the bar along x over the pressure, section by section (k,)."""
    bodies, point = result.contacts.bodies, result.contacts.point
    sign = np.select([(bodies == [1, 0]).all(axis=1), (bodies == [0, 1]).all(axis=1)], [1.0, -1.0])
    force = sign[:, None] * result.contacts.force
    x, _ = sections(result)
    at = np.abs(point[:, :1] - x).argmin(axis=1)
    along, up = (np.bincount(at, force[:, k], len(x)) for k in (0, 2))
    return np.divide(along, up, out=np.zeros_like(up), where=up > 0)


def test_slip_reaches_as_far_as_friction_holds_the_pull():
    """u = P²/(2EAμq) (1 - x/l)² up to l = P/μq = 0.4 m, at rest beyond: u₀ and slip length within 3 %."""
    result = pulled([0.0, 0.4, 1.4], [0.0, 0.0, 1.0], 1.6)
    x, u = sections(result)
    reach, end = PULL / (FRICTION * WEIGHT), PULL**2 / (2 * YOUNG * AREA * FRICTION * WEIGHT)
    assert u[0] == pytest.approx(end, rel=0.03)
    exact = end * np.maximum(1 - x / reach, 0.0) ** 2
    assert np.abs(u - exact).max() < 0.03 * end
    # √u falls linearly to zero at the end of the slip
    slope, start = np.polyfit(x[exact > 0.05 * end], np.sqrt(u[exact > 0.05 * end]), 1)
    assert -start / slope == pytest.approx(reach, rel=0.03)
    ratio = mobilised(result)
    # its very end may lift off under the pull
    assert ratio[(x > SIDE / 2) & (x < reach - SIDE)] == pytest.approx(FRICTION, rel=0.02)
    # the free end keeps a little of its swing when gravity came
    idle = (x > reach + 2 * SIDE) & (x < LENGTH - 2 * SIDE)
    assert np.abs(ratio[idle]).max() < 0.1 * FRICTION


@pytest.mark.slow
def test_friction_keeps_half_of_the_slip_after_unloading():
    """Unloaded, u₀/2 is left: friction turns its sign up to half the slip length. Within 3 %. Closed form."""
    result = pulled([0.0, 0.4, 1.4, 1.5, 2.5], [0.0, 0.0, 1.0, 1.0, 0.0], 2.7)
    x, u = sections(result)
    end = PULL**2 / (2 * YOUNG * AREA * FRICTION * WEIGHT)
    assert u[0] == pytest.approx(end / 2, rel=0.03)
    middle = np.isclose(x, 0.2, atol=1e-6)
    assert u[middle] == pytest.approx(end / 4, abs=0.03 * end)
