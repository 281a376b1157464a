"""A rigid ball on an elastic block: Hertz's pressure, Cattaneo's and Mindlin's slip (Johnson 1985, chapters 4 and 7).

The block stands on four corners, is several contact radii wide and finely meshed about the contact alone. Closed forms
are those of the half-space; where the block's size matters the text says how it is allowed for.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from mechanics.contact.contacts import material_points
from mechanics.dynamics.simulation import Simulation
from mechanics.model.balls import ball
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import (
    Block,
    ContactSettings,
    Fidelity,
    LawRule,
    Scene,
    SolverSettings,
    TimeSettings,
)
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.mesh import solid_mesh, with_middle_nodes
from mechanics.stones.meshing.meshers.mesher import Meshed
from tests.validation.scenes import CORNERS, FACES, G, box

YOUNG, RADIUS, FORCE = 1e9, 1.0, 1e6
FEET = frozenset({"foot00", "foot01", "foot10", "foot11"})


@dataclass(frozen=True)
class Hertz:
    """A rigid sphere on an elastic half-space under a force P: radius a, peak pressure p0 and approach δ."""

    force: float
    poisson: float

    @property
    def stiffness(self):
        """E* = E/(1 - ν²) [Pa]."""
        return YOUNG / (1.0 - self.poisson**2)

    @property
    def radius(self):
        """a = (3 P R/4 E*)^⅓ [m]."""
        return (0.75 * self.force * RADIUS / self.stiffness) ** (1 / 3)

    @property
    def peak(self):
        """p0 = 3 P/2πa² [Pa]."""
        return 1.5 * self.force / (np.pi * self.radius**2)

    @property
    def approach(self):
        """δ = a²/R [m]."""
        return self.radius**2 / RADIUS

    def pressure(self, r):
        """p0 √(1 - r²/a²) [Pa]."""
        return self.peak * np.sqrt(np.maximum(1.0 - (r / self.radius) ** 2, 0.0))

    def sinking(self, r):
        """How far the surface sinks at r > a [m] (Johnson, eq. 3.42a)."""
        a = self.radius
        inner = (2 * a**2 - r**2) * np.arcsin(a / r) + r * a * np.sqrt(1 - (a / r) ** 2)
        return self.peak / (2 * self.stiffness * a) * inner


def graded(fine, extent, length, ratio):
    """0 … length: equal cells of size `fine` up to `extent`, then cells that grow by up to `ratio`."""
    cells = round(extent / fine)
    rest, count = length - cells * fine, 1
    while fine * sum(ratio**k for k in range(1, count + 1)) < rest:
        count += 1
    low, high = 1.0, ratio
    for _ in range(60):
        q = (low + high) / 2
        low, high = (q, high) if fine * sum(q**k for k in range(1, count + 1)) < rest else (low, q)
    grown = cells * fine + np.cumsum(fine * q ** np.arange(1, count + 1))
    grown[-1] = length
    return np.concatenate([fine * np.arange(cells + 1), grown])


def lattice(x, y, z, block):
    """Hexahedra between given planes, of the block's kind of element."""
    nodes = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    stride = np.array([len(y) * len(z), len(z), 1])
    first = np.stack(np.meshgrid(*(np.arange(len(c) - 1) for c in (x, y, z)), indexing="ij"), axis=-1)
    steps = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
    cells = (first.reshape(-1, 3) @ stride)[:, None] + steps @ stride
    mesh = solid_mesh(Element.HEX8, nodes, cells, block.vertices, block.faces, block.code)
    return mesh if block.element is Element.HEX8 else with_middle_nodes(mesh, block.element)


def block_on_feet(monkeypatch, a, per_radius, width, poisson, element):
    """A block that is 2 `width` a wide, with `per_radius` cells over a in its middle, and what it stands on."""
    fine, half = a / per_radius, width * a
    side = graded(fine, 1.2 * a, half, 3.0)
    x = np.concatenate([-side[:0:-1], side])
    z = -graded(fine, 2 * fine, half, 1.8)[::-1]
    monkeypatch.setattr(
        "mechanics.model.stone_meshes.meshed_block",
        lambda block, contact: Meshed(lattice(x, x, z, block), "lattice", ()),
    )
    soft = Material("soft", density=2000.0, young=YOUNG, poisson=poisson)
    corners = np.array([-half, -half, -half]) + CORNERS * [2 * half, 2 * half, half]
    cell = x[1] - x[0]
    feet = [
        box(f"foot{i}{j}", [p, q, -half - 0.1], [p + cell, q + cell, -half], fidelity=Fidelity.FIXED)
        for i, p in enumerate((-half, half - cell))
        for j, q in enumerate((-half, half - cell))
    ]
    return Block("block", corners, FACES, soft, Fidelity.DEFORMABLE, fine, element), feet


def weighing(force, volume):
    """A material of which a volume [m³] weighs a force [N]."""
    return Material("heavy", force / (G * volume), YOUNG, 0.3)


def indentation(block, feet, stone, alert, friction=0.0, **more):
    """The scene of a stone on a block; a gap of `alert` [m] is in reach."""
    size = min(np.ptp(block.vertices[:, 2]), np.ptp(stone.vertices[:, 2]))
    standing = LawRule(frozenset({"block"}), FEET, DryJoint(0.5))
    contact = ContactSettings(DryJoint(friction), (standing,), alert_distance=alert / size)
    return Scene("indentation", (block, stone, *feet), contact=contact, **more)


def pressed(monkeypatch, per_radius, *, width=4.0, poisson=0.3, friction=0.0, element=Element.HEX8, **more):
    """A ball that touches a block with `per_radius` cells over the contact radius a; the block is 2 `width` a wide."""
    a = Hertz(FORCE, poisson).radius
    block, feet = block_on_feet(monkeypatch, a, per_radius, width, poisson, element)
    heavy = weighing(FORCE, 4 / 3 * np.pi * RADIUS**3)
    stone = ball("ball", (0, 0, RADIUS), RADIUS, heavy, more.pop("ball", Fidelity.RIGID))
    return indentation(block, feet, stone, 0.15 * a**2, friction, **more)


@dataclass(frozen=True)
class Patch:
    """The contacts under the ball: place, area, pressure and traction along x by a and p0 of the half-space."""

    hertz: Hertz
    r: np.ndarray
    area: np.ndarray
    pressure: np.ndarray
    traction: np.ndarray


def patch(bodies, point, normal, area, force, poisson):
    """The patch under the ball, and Hertz's solution for the force that it carries."""
    on = (bodies == [0, 1]).all(axis=1)
    point, normal, area, force = point[on], normal[on], area[on], force[on]
    hertz = Hertz(float(-force[:, 2].sum()), poisson)
    push = np.einsum("ci,ci->c", force, normal)
    x = point[:, :2] / hertz.radius
    return Patch(
        hertz,
        np.linalg.norm(x, axis=1),
        area / hertz.radius**2,
        push / area / hertz.peak,
        (force - push[:, None] * normal)[:, 0] / area / hertz.peak,
    )


def radius_of(found):
    """The radius that gives Hertz's pressure its mean square distance, ⟨r²⟩ = ⅖ a², over a."""
    load = found.pressure * found.area
    return float(np.sqrt(2.5 * (load @ found.r**2) / load.sum()))


@pytest.mark.parametrize(
    ("cells", "width", "allowed"), [(4, 3.0, 0.05), pytest.param(6, 4.0, 0.03, marks=pytest.mark.slow)]
)
def test_a_ball_presses_as_hertz_says(monkeypatch, cells, width, allowed):
    """F11: E = 1 GPa, ν = 0.3, R = 1 m, P = 1 MN: a = 88.044 mm, p0 = 61.594 MPa, δ = 7.7518 mm."""
    time = TimeSettings(step=0.05, duration=3.0, relaxation=True)
    scene = pressed(monkeypatch, cells, width=width, time=time, solver=SolverSettings(tolerance=1e-6))
    result = simulate(scene)
    assert result.outcome.rests
    c = result.contacts
    found = patch(c.bodies, c.point, c.normal, c.area, c.force, 0.3)
    exact = found.hertz
    assert exact.force == pytest.approx(FORCE, rel=1e-4)
    assert (exact.radius, exact.peak) == pytest.approx((0.088044, 61.594e6), rel=1e-4)
    assert found.pressure.max() == pytest.approx(1.0, abs=allowed)
    assert radius_of(found) == pytest.approx(1.0, abs=allowed)
    # within one cell of the edge the pressure falls steeply; inside it is Hertz's
    inner = found.r < 1.0 - 1.0 / cells
    error = found.pressure - np.sqrt(np.maximum(1.0 - found.r**2, 0.0))
    assert np.abs(error[inner]).max() < allowed
    assert approach(result, exact.radius, exact.sinking) == pytest.approx(exact.approach, rel=0.05)


def approach(result, a, sinking):
    """How far a stone sinks below a ring of the surface, plus how far the half-space sinks there.

    The ring, 1.6 to 2.5 a wide, goes along with what the block as a whole does: its size does not matter.
    """
    block, stone = result.bodies[:2]
    r = np.linalg.norm(block.reference[:, :2], axis=1)
    ring = (block.reference[:, 2] > -1e-9) & (r > 1.6 * a) & (r < 2.5 * a)
    sunk = -stone.displacement[:, 2].mean()
    return sunk - (-block.displacement[ring, 2] - sinking(r[ring])).mean()


def driven(monkeypatch, cells, friction, poisson, goal, state=None):
    """The last of ten steps in which a driven ball moves by `goal` (3,) [m], from a state or from above the block."""
    h = 0.05
    velocity = np.zeros((4, 3))
    velocity[1:3] = np.array(goal) / (8 * h)
    motion = ImposedMotion(frozenset({"ball"}), History(h * np.array([0, 1, 8, 9]), velocity))
    scene = pressed(
        monkeypatch, cells, poisson=poisson, friction=friction, ball=Fidelity.FIXED,
        loads=Loads(motions=(motion,)), time=TimeSettings(step=h), solver=SolverSettings(tolerance=1e-7),
    )  # fmt: skip
    model, start = build_model(scene)
    simulation = Simulation(model, start if state is None else replace(state, time=0.0))
    for _ in range(10):
        step = simulation.step()
        assert step.solution.natural_map < 1e-5
    return step


@pytest.mark.slow
def test_a_ball_drawn_aside_slips_in_the_annulus_of_cattaneo_and_mindlin(monkeypatch):
    """F13: c/a = (1 - Q/μP)^⅓, and q = μ p0 [√(1 - r²/a²) - c/a √(1 - r²/c²)]; c/a = 0.7937 for Q = ½ μP.

    They hold where pressure and traction do not act on one another, that is for ν = ½ or small friction: so the ball is
    pressed without friction, and then drawn with μ = 0.1. It is driven by about as much as makes Q = ½ μP; Q is that
    of the contacts.
    """
    friction, poisson = 0.1, 0.3
    exact = Hertz(FORCE, poisson)
    state = driven(monkeypatch, 4, 0.0, poisson, (0.0, 0.0, -exact.approach)).after
    shear = YOUNG / (2 * (1 + poisson))
    mindlin = 3 * (2 - poisson) * friction * FORCE / (16 * shear * exact.radius) * (1 - 0.5 ** (2 / 3))
    step = driven(monkeypatch, 4, friction, poisson, (1.3 * mindlin, 0.0, 0.0), state)
    c = step.contacts
    point = material_points(c, step.after).mean(axis=1)
    found = patch(c.bodies, point, c.frame[:, 0], c.area, step.force, poisson)
    drawn = abs(found.traction @ found.area) / (friction * found.pressure @ found.area)
    assert 0.45 < drawn < 0.55
    stick = (1 - drawn) ** (1 / 3)
    assert fitted_stick(found, friction) == pytest.approx(stick, abs=0.1 * (1 - stick))


def cattaneo(r, stick, friction):
    """Traction over p0 at r, over a, with no slip within `stick`."""
    whole, core = (np.sqrt(np.maximum(1 - (r / radius) ** 2, 0)) for radius in (1.0, stick))
    return friction * (whole - stick * core)


def fitted_stick(found, friction):
    """The stick radius over a whose tractions are nearest to those found, by least squares over the area."""

    def misfit(stick):
        return found.area @ (np.abs(found.traction) - cattaneo(found.r, stick, friction)) ** 2

    return minimize_scalar(misfit, bounds=(0.3, 1.0), method="bounded").x
