"""Elastic joints with the engine: vibrations, slides, bending and a published arch, against closed forms and 3DEC."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from benchmarks.tower import tower_scene
from ground.errors import SceneError, SolverError
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.observers.equilibrium import displacement, seen_from_supports
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.static_start import static_start
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import BOND, CRUSHED, ENERGY
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import (
    ContactSettings,
    Fidelity,
    LawRule,
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
        (Placement.AREA, 1 - 1 / 16 * (1 - 4 / 16)),
    ],
)
def test_a_joint_bends_like_its_area_or_like_its_corners(placement, times):
    """Rotation M/(k I), I = b d³/12; springs at corners are three times as stiff, those of n cells 1 - 1/n² as.

    The four cells at corners, whose corners bear a quarter, lack nothing.
    """
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


def test_a_block_that_rocks_crushes_and_cracks_gains_no_energy_from_its_joint():
    """Mortar that stiffens, softens and crushes; it is torn off and crushed at its edges within the first swing."""
    law = ElasticJoint(
        0.8, 1e9, 1e9, 0.0, 1e4, 2e4, None, 1.0, 4.0, 4e4, stiffening=0.5, reference_pressure=1e6
    )
    blocks = (
        box("plinth", [-1, -1, -1], [1, 1, 0], fidelity=Fidelity.FIXED),
        box("b", [-0.15, -0.15, 0], [0.15, 0.15, 0.6], velocity=(0.12, 0, 0, 0, 0.4, 0)),
    )
    contact = ContactSettings(law, placement=Placement.AREA, spacing=0.15)
    simulation = Simulation(
        *build_model(Scene("mortar", blocks, contact=contact, time=TimeSettings(1e-3, 0.5, 1.0)))
    )
    assert kept(simulation, 200) < 1e-9
    internal = simulation.step().internal
    assert internal[:, CRUSHED].max() > 0
    assert internal[:, BOND].min() == -1.0


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


# --- joints that crush, soften, and are of mortar ---


def driven(law, velocity, step=1e-3):
    """A slab of 1 m² on the ground, glued below a plate that moves: forces on the slab from below, balance and run.

    `velocity` is a history of the plate's.
    """
    plate = box("plate", [-0.5, -0.5, SLAB], [0.5, 0.5, 2 * SLAB], fidelity=Fidelity.FIXED)
    glue = LawRule(
        frozenset({"plate"}), frozenset({"slab"}), ElasticJoint(0.6, 1e12, 1e12, tension=1e9, shear=1e9)
    )
    contact = ContactSettings(law, (glue,), placement=Placement.AREA, spacing=0.3)
    loads = Loads(motions=(ImposedMotion(frozenset({"plate"}), velocity),))
    scene = Scene(
        "driven", (ground(), slab(), plate), (0, 0, 0), contact, TimeSettings(step, 1.0, 1.0), loads=loads
    )
    simulation = Simulation(*build_model(scene))
    balance, force, step = EnergyBalance(simulation.model, simulation.start), [], None
    for _ in range(round(velocity.time[-1] / scene.time.step)):
        step = simulation.step()
        balance(step)
        below = (step.contacts.bodies == 0).any(axis=1)
        up = np.where(step.contacts.bodies[below, 0] == 1, 1.0, -1.0)
        force.append(up @ step.force[below])
    return np.array(force), balance, step


def test_a_block_that_is_pressed_down_crushes_its_joint_at_its_strength():
    """k = 1 GPa/m, 2 MPa: 2 mm to the strength, 3 mm beyond; back by 1 mm the force has halved, and 3 mm remain."""
    law = ElasticJoint(0.6, 1e9, 5e8, compressive_strength=2e6)
    times, way = [0.0, 0.05, 0.2501, 0.2502, 0.29], [0.0, -0.02, -0.02, 0.02, 0.02]
    force, balance, step = driven(law, History(times, np.outer(way, [0, 0, 1.0])))
    np.testing.assert_allclose(force[155:249, 2], 2e6, rtol=0.01)
    moved = -0.02 * (0.025 + 0.2) + 0.02 * 0.04
    crushed = step.internal[:, CRUSHED].max()
    assert crushed == pytest.approx(0.0045 - 0.002, rel=0.02)
    assert force[-1, 2] == pytest.approx(1e9 * (-moved - crushed), rel=0.01)
    assert balance.error < 1e-9
    assert balance.contact + step.internal[:, ENERGY].sum() == pytest.approx(-2e6 * crushed, rel=0.02)


def test_a_bond_that_is_pulled_off_costs_its_energy_of_fracture():
    """50 J/m², in 300 steps of 2 µm, with the energy balance closed."""
    law = ElasticJoint(0.6, 1e10, 5e9, tension=3e5, shear=3e5, energy_tension=50.0, energy_shear=80.0)
    force, balance, step = driven(law, History([0.0, 0.3], np.outer([2e-3, 2e-3], [0, 0, 1.0])))
    assert -force[:, 2].min() == pytest.approx(3e5, rel=0.02)
    assert force[-1, 2] == 0.0
    assert -balance.contact - step.internal[:, ENERGY].sum() == pytest.approx(50.0, rel=0.02)
    assert balance.error < 1e-9


def test_a_block_pressed_off_its_middle_crushes_and_gaps_like_a_winkler_bed():
    """N = 0.4 f b L a quarter of L from the edge: crushed to L_c, then linear over a, then open; φ = f/(k a).

    N = f b (a/2 + L_c) and N L/4 = f b (L_c²/2 + a (L_c + a/3)/2) give a = √(24 n (1/4 - n/2)) L for n = 0.4.
    """
    strength, stiffness, share = 2e6, 1e9, 0.4
    press = share * 0.1 * strength
    law = ElasticJoint(0.6, stiffness, stiffness / 2, compressive_strength=strength)
    force = StoneForce(
        frozenset({"block"}), History([0.0, 1.0], np.outer([0, press], [0, 0, -1.0])), (0.25, 0.0, 0.1)
    )
    scene = Scene(
        "bed",
        (ground(), box("block", [-0.5, -0.05, 0.0], [0.5, 0.05, 0.2])),
        (0, 0, 0),
        ContactSettings(law, placement=Placement.AREA, spacing=0.025),
        TimeSettings(2e-2, 1.0, 2.0),
        loads=Loads(forces=(force,)),
    )
    simulation = Simulation(*build_model(scene))
    for _ in range(100):
        step = simulation.step()
        assert step.solution.converged
    elastic = np.sqrt(24 * share * (0.25 - share / 2))
    crushed = share - elastic / 2
    turn = np.arcsin(simulation.state.rotation[1, 0, 2])
    assert turn == pytest.approx(strength / (stiffness * elastic), rel=0.01)
    place, pressed = step.active.place[:, 0], step.impulse[:, 0] > 0
    assert place[pressed].min() == pytest.approx(0.5 - elastic - crushed, abs=0.025)
    assert place[step.internal[:, CRUSHED] > 0].min() == pytest.approx(0.5 - crushed, abs=0.025)
    pressure = step.force[:, 2] / step.contacts.area
    assert np.abs(pressure).max() == pytest.approx(strength, rel=1e-3)


def test_mortar_yields_by_its_local_thickness():
    """Slabs on 10 and 20 mm of E = 100 MPa sink by m g t/E; a pair without thickness is named."""
    stones = (slab(), box("other", [1.0, -0.5, 0.0], [2.0, 0.5, SLAB]))
    beds = {frozenset({"ground", "slab"}): 0.01, frozenset({"other", "ground"}): 0.02}
    law = ElasticJoint(0.6, mortar_young=1e8)
    simulation = started(law, *stones, theta=1.0, step=5e-3, thickness=beds)
    track(simulation, 60)
    sunk = simulation.start.centre[:, 2] - simulation.state.centre[:, 2]
    np.testing.assert_allclose(sunk[1:], MASS * G * np.array([0.01, 0.02]) / 1e8, rtol=1e-3)
    del beds[frozenset({"other", "ground"})]
    with pytest.raises(SceneError, match="no thickness of the mortar between ground and other"):
        track(started(law, *stones, thickness=beds), 1)
    with pytest.raises(SceneError, match="one code or two"):
        ContactSettings(law, thickness={frozenset({"ground", "slab", "roof"}): 0.01})


def test_points_over_the_area_need_their_spacing():
    with pytest.raises(SceneError, match="without spacing"):
        ContactSettings(placement=Placement.AREA)
