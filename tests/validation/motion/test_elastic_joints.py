"""Elastic joints with the engine: vibrations, slides, bending and a published arch, against closed forms and 3DEC."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from benchmarks.tower import tower_scene
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.observers.equilibrium import displacement, seen_from_supports
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.static_start import static_start
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import ENERGY
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import (
    ContactSettings,
    Fidelity,
    Method,
    Placement,
    Scene,
    SolverSettings,
    Start,
    TimeSettings,
)
from mechanics.scene.shapes import prism, voussoir_arch
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from moma.errors import SolverError
from tests.validation.masonry import rectangle
from tests.validation.scenes import STONE, G, box, ground, tilted_gravity

STIFF = 1e8  # Pa/m
SLAB = 0.02  # height, so low that it does not rock
MASS = STONE.density * SLAB


def slab(velocity=(0.0,) * 6):
    return box("slab", [-0.5, -0.5, 0.0], [0.5, 0.5, SLAB], velocity=velocity)


def started(law, *blocks, gravity=(0.0, 0.0, -G), theta=0.5, step=1e-4, **contact):
    settings = ContactSettings(law, **contact)
    scene = Scene("springs", (ground(), *blocks), gravity, settings, TimeSettings(step, theta, 1.0))
    return Simulation(*build_model(scene))


def track(simulation, steps):
    """Displacement (steps, 3) of the first stone [m]."""
    start = simulation.start.centre[1]
    return np.array([(simulation.step(), simulation.state.centre[1] - start)[1] for _ in range(steps)])


def test_a_block_set_on_springs_vibrates_about_its_rest():
    """z = -(m g/k)(1 - cos ωt), to 1 % of its amplitude over six periods."""
    found = track(started(ElasticJoint(0.6, STIFF, STIFF), slab(), step=2e-5), 1000)[:, 2]
    time, omega = 2e-5 * np.arange(1, 1001), np.sqrt(STIFF / MASS)
    sunk = MASS * G / STIFF
    np.testing.assert_allclose(found, -sunk * (1 - np.cos(omega * time)), atol=0.01 * sunk)
    assert omega * time[-1] > 6 * np.pi


def test_a_push_along_the_joint_shears_its_springs():
    """x = v/ω sin ωt below the limit of friction: the joint neither slides nor forgets."""
    law = ElasticJoint(0.6, 10 * STIFF, STIFF, tension=1e6, shear=1e6)
    found = track(started(law, slab((1e-4, 0, 0, 0, 0, 0)), gravity=(0, 0, 0), step=4e-5), 500)[:, 0]
    time, omega = 4e-5 * np.arange(1, 501), np.sqrt(STIFF / MASS)
    np.testing.assert_allclose(found, 1e-4 / omega * np.sin(omega * time), atol=0.03e-4 / omega)


def test_dashpots_damp_by_pi_f_tau():
    damping = 0.05
    omega = np.sqrt(STIFF / MASS)
    law = ElasticJoint(0.6, STIFF, STIFF, 2 * damping / omega, tension=1e6, shear=1e6)
    found = track(started(law, slab((0, 0, 1e-4, 0, 0, 0)), gravity=(0, 0, 0), step=2e-5), 800)[:, 2]
    up = np.array([one.max() for one in np.split(found, np.flatnonzero(np.diff(np.sign(found)) > 0) + 1)])
    decrement = np.log(up[:-1] / up[1:])
    np.testing.assert_allclose(decrement[:3], 2 * np.pi * damping, rtol=0.03)


@pytest.mark.parametrize(("friction", "shear"), [(0.0, 0.0), (0.6, 1e6)])
def test_a_block_hangs_on_springs_as_strong_as_its_weight(friction, shear):
    """It sinks by m g/(k A) under a ceiling whose tension is 1.1 of its weight, and falls freely at 0.9, for any μ."""
    way = {}
    for share in (1.1, 0.9):
        law = ElasticJoint(friction, STIFF, STIFF, tension=share * MASS * G, shear=shear)
        up = started(law, slab(), gravity=(0.0, 0.0, G), theta=1.0, step=2e-3)
        way[share] = track(up, 100)[-1, 2]
    assert way[1.1] == pytest.approx(MASS * G / STIFF, rel=1e-3)
    assert way[0.9] == pytest.approx(G * 0.2**2 / 2, rel=0.03)


@pytest.mark.parametrize("friction", [0.6, 0.3])
def test_a_tilted_block_rests_on_stretched_springs_or_slides(friction):
    """Below the limit it shifts by F_T/(k_T A); above, it accelerates as a rigid one does."""
    gravity = tilted_gravity(25.0)
    simulation = started(
        ElasticJoint(friction, STIFF, STIFF / 2), slab(), gravity=gravity, theta=1.0, step=2e-3
    )
    found = track(simulation, 200)
    if friction == 0.6:
        assert found[-1, 0] == pytest.approx(MASS * gravity[0] / (STIFF / 2), rel=1e-3)
        assert found[-1, 2] == pytest.approx(MASS * gravity[2] / STIFF, rel=1e-3)
    else:
        speed = simulation.state.velocity[1, 0]
        assert speed == pytest.approx(0.4 * (gravity[0] + friction * gravity[2]), rel=0.01)


def test_a_spring_that_slid_pulls_no_further_than_its_limit():
    """A block that has slid to a halt, rests under no more than its friction, and does not come back."""
    law = ElasticJoint(0.3, STIFF, STIFF)
    simulation = started(law, slab((0.2, 0, 0, 0, 0, 0)), theta=1.0, step=1e-3)
    found = track(simulation, 200)[:, 0]
    assert found[-1] == pytest.approx(0.2**2 / (2 * 0.3 * G), rel=0.02)
    assert np.ptp(found[-50:]) < 0.3 * MASS * G / STIFF


@pytest.mark.parametrize(
    ("placement", "times"),
    [
        (Placement.CORNERS, 3.0),
        (Placement.CENTROID, 1.0),
        (Placement.INERTIA, 1.0),
        (Placement.AREA, 1 - 1 / 16),
    ],
)
def test_a_joint_bends_like_its_area_or_like_its_corners(placement, times):
    """Rotation M/(k I), I = b d³/12; springs at corners are three times as stiff, those of n cells 1 - 1/n² as."""
    law = ElasticJoint(0.6, STIFF, STIFF, tension=1e8, shear=1e8)
    height, push = 0.5, 100.0
    gravity = (push / (STONE.density * height), 0.0, 0.0)
    block = box("block", [-0.5, -0.5, 0.0], [0.5, 0.5, height])
    simulation = started(law, block, gravity=gravity, theta=1.0, step=0.05, placement=placement, spacing=0.25)
    track(simulation, 60)
    turn = np.arcsin(simulation.state.rotation[1] @ [0, 0, 1.0] @ np.array([1.0, 0, 0]))
    moment = push * (height / 2)
    assert turn == pytest.approx(moment / (times * STIFF / 12), rel=1e-3)


def test_stiffer_and_stiffer_joints_end_as_rigid_ones():
    """A stone that two others carry: the settlement goes as 1/k, and the forces become those of rigid joints."""
    stones = (box("a", [-1, -0.5, 0], [-0.5, 0.5, 1]), box("b", [0.5, -0.5, 0], [1, 0.5, 1]))
    blocks = (ground(), *stones, box("lintel", [-1, -0.5, 1], [1, 0.5, 1.4]))
    sunk = []
    for stiffness in (1e9, 1e11):
        law = ContactSettings(ElasticJoint(0.6, stiffness, stiffness))
        scene = Scene("gate", blocks, contact=law, time=TimeSettings(1e-2, 1.0, 1.0, start=Start.EQUILIBRIUM))
        result = simulate(scene)
        assert not any("gave way" in caution for caution in result.cautions)
        assert result.errors.reaction < 1e-6
        sunk.append(-result.bodies[3].displacement[:, 2].mean())
    below = STONE.density * (0.5 * 1.0 + 0.5 * 2.0 * 0.4) * G / 0.5
    assert sunk[0] == pytest.approx((below + STONE.density * 0.4 * 1.0 * G / 0.5) / 1e9, rel=1e-3)
    assert sunk[0] / sunk[1] == pytest.approx(100.0, rel=1e-2)


def kept(simulation, steps):
    """Work of the contacts plus what their springs hold, over the largest energy of the run: the most of all steps."""
    balance, most = EnergyBalance(simulation.model, simulation.start), 0.0
    for _ in range(steps):
        step = simulation.step()
        balance(step)
        most = max(most, (balance.contact + step.internal[:, ENERGY].sum()) / balance.reference)
    return most


def on_plinth(low, high, velocity, friction, **contact):
    """A block on the top of a plinth 2 m wide, on springs without dashpots."""
    law = ElasticJoint(friction, 1e9, 1e9)
    blocks = (
        box("plinth", [-1, -1, -1], [1, 1, 0], fidelity=Fidelity.FIXED),
        box("b", low, high, velocity=velocity),
    )
    scene = Scene("edge", blocks, contact=ContactSettings(law, **contact), time=TimeSettings(1e-3, 0.5, 1.0))
    return Simulation(*build_model(scene))


def test_a_block_that_slides_over_an_edge_gains_no_energy_from_its_springs():
    """From 0.6 of its area onto all of it, and from all of it to half; springs whose area grew made 3 mJ of each J."""
    onto = on_plinth([-1.4, -0.5, 0], [-0.4, 0.5, 0.2], (0.8, 0, 0, 0, 0, 0), 0.0)
    assert kept(onto, 600) < 1e-9
    assert onto.state.centre[1, 0] == pytest.approx(-0.9 + 0.48, abs=1e-3)
    assert kept(on_plinth([0, -0.5, 0], [1, 0.5, 0.2], (0.8, 0, 0, 0, 0, 0), 0.0), 600) < 1e-9


@pytest.mark.parametrize("placement", [Placement.CORNERS, Placement.CENTROID, Placement.AREA])
def test_a_block_that_rocks_gains_no_energy_from_its_springs(placement):
    """Corners that lift leave their area to the others, the point in the middle comes and goes: 11 mJ of each J."""
    velocity = (0.3, 0, 0, 0, 1.0, 0)
    rocks = on_plinth([-0.15, -0.15, 0], [0.15, 0.15, 0.6], velocity, 0.8, placement=placement, spacing=0.1)
    assert kept(rocks, 700) < 1e-9


@pytest.mark.slow
def test_a_shaken_tower_without_damping_stays_together():
    """Stones of a tower of 500 blocks flew metres within 0.25 s; with dashpots of τ = 2 ms they move by 15 to 30 mm."""
    law = ElasticJoint(0.6, 1e10, 5e9)
    solver = SolverSettings(tolerance=1e-5, velocity_tolerance=1e-2, max_iterations=5000)
    simulation = Simulation(*build_model(tower_scene(500, 5e-3, 60, solver, law)))
    assert kept(simulation, 70) < 1e-4
    seen = seen_from_supports(simulation.model, simulation.start, simulation.state)
    assert displacement(simulation.model, simulation.start, seen).max() < 0.04


@dataclass(frozen=True)
class HalfSine:
    """A half-sine pulse of the ground, as a force of inertia."""

    peak: float
    duration: float

    @property
    def until(self):
        return self.duration

    def __call__(self, time, gravity):
        inside = 0.0 <= time < self.duration
        push = self.peak * np.sin(np.pi * time / self.duration) if inside else 0.0
        return gravity - np.array([push, 0.0, 0.0])


def pulsed_arch(law, placement):
    """Seventeen voussoirs between radii of 3.75 and 4.25 m, under 0.15 g within 0.25 s."""
    stone = Material("stone", 2700.0, young=1e10, poisson=0.2)
    springers = [
        prism(name, rectangle((x, -0.5), (x + 0.5, 0.0)), 1.0, stone, fidelity=Fidelity.FIXED)
        for name, x in (("left", -4.25), ("right", 3.75))
    ]
    return Scene(
        "arch",
        (*springers, *voussoir_arch(17, (3.75, 4.25), 1.0, (0.0, np.pi), stone)),
        (0.0, 0.0, -10.0),
        ContactSettings(law, placement=placement),
        TimeSettings(1e-3, 0.5, 0.8),
        loads=Loads(gravity=(HalfSine(1.5, 0.25),)),
    )


def swing(law, placement=Placement.CORNERS):
    """Largest displacement of the crown across [mm], and its time [s]; every step is solved."""
    model, start = build_model(pulsed_arch(law, placement))
    told, rest = static_start(model, start, lambda _: None)
    assert told.found
    simulation = Simulation(model, start)
    simulation.take_over(rest)
    crown = 2 + 17 // 2
    begin, path = simulation.state.centre[crown, 0], []
    for _ in range(800):
        assert simulation.step().solution.converged
        path.append(simulation.state.centre[crown, 0] - begin)
    peak = int(np.abs(path).argmax())
    return 1e3 * abs(path[peak]), 1e-3 * (peak + 1)


PULSED = ElasticJoint(float(np.tan(np.radians(35.0))), 1e10, 1e10, damping_time=5e-4)


@pytest.mark.slow
def test_the_pulsed_arch_of_lemos_moves_as_in_3dec_where_joints_stay_closed():
    """Case K10: 3DEC's crown moves by 0.27 to 0.34 mm."""
    glued = replace(PULSED, tension=1e9, shear=1e9)
    assert swing(glued)[0] < 0.27 < 0.34 < swing(glued, Placement.CENTROID)[0]


@pytest.mark.slow
def test_the_pulsed_arch_of_lemos_moves_as_in_3dec():
    """Case K10: 3DEC's crown moves by 15.7 to 16.9 mm at 0.51 to 0.54 s.

    It does not say how many points carry a joint: springs at the corners are stiffer in bending, those of the whole
    area softer. Rigid joints let the crown move too little.
    """
    corners, corners_at = swing(PULSED)
    whole, whole_at = swing(PULSED, Placement.CENTROID)
    assert 0.8 * 15.73 < corners < 15.73 < 16.87 < whole
    assert 0.45 < corners_at < 0.514 < 0.543 < whole_at
    assert swing(DryJoint(PULSED.friction))[0] < 0.8 * 15.73


def test_sweeps_are_for_rigid_joints_and_refuse_springs():
    scene = Scene(
        "springs",
        (ground(), slab()),
        contact=ContactSettings(ElasticJoint(0.6, STIFF, STIFF)),
        solver=SolverSettings(method=Method.NSGS),
    )
    with pytest.raises(SolverError, match="nsgs is for rigid joints"):
        Simulation(*build_model(scene))


@pytest.mark.parametrize("method", [Method.ADMM, Method.INTERIOR_POINT, Method.NEWTON])
def test_other_methods_agree(method):
    """Ten steps of a sliding block: the same path as the automatic choice to 10⁻⁶ of it."""
    law = ElasticJoint(0.3, STIFF, STIFF)
    scene = started(law, slab((0.2, 0, 0, 0, 0, 0)), step=1e-3).model.scene
    paths = [
        track(Simulation(*build_model(replace(scene, solver=SolverSettings(method=one, tolerance=1e-8)))), 10)
        for one in (Method.AUTO, method)
    ]
    np.testing.assert_allclose(paths[1], paths[0], atol=1e-6 * np.abs(paths[0]).max())
