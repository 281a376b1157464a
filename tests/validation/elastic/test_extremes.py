"""Soft, stiff, slender, nearly incompressible stones, short and long steps: in balance, or refused with a reason."""

import numpy as np
import pytest

from ground.errors import MomaError
from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Fidelity, Scene, SolverSettings, Start, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from tests.validation.elastic.elastic_blocks import base_force, elastic_box
from tests.validation.scenes import G, box, ground

DENSITY = 2000.0


def stands(name, blocks, step=1e-3, theta=1.0, *, friction=0.6, balance=1e-4):
    """In equilibrium from the start: within a few steps it says so, its support carries its weight, all is finite.

    Or it is refused by an error of the project, which says why. Returns the result, None if refused.
    """
    scene = Scene(
        name,
        tuple(blocks),
        contact=ContactSettings(DryJoint(friction)),
        time=TimeSettings(step, theta, 40 * step, start=Start.EQUILIBRIUM, balance_tolerance=balance),
        solver=SolverSettings(tolerance=1e-8),
    )
    try:
        result = simulate(scene)
    except MomaError:
        return None
    for body in result.bodies:
        assert np.isfinite(body.position).all()
        assert body.stress is None or np.isfinite(body.stress).all()
    assert result.outcome.rests
    assert base_force(result) == pytest.approx([0, 0, result.weight], rel=1e-6, abs=balance * result.weight)
    assert result.errors.balance < balance
    assert result.errors.natural_map < 1e-6
    return result


def two(first, second, element=Element.HEX8):
    half = 0.2
    return [
        ground(half=1.0),
        elastic_box("lower", [-half, -half, 0.0], [half, half, 0.3], first, 0.1, element),
        elastic_box("upper", [-half, -half, 0.3], [half, half, 0.6], second, 0.1, element),
    ]


def stone(young, poisson=0.2):
    return Material("stone", DENSITY, young, poisson)


def sinking(result, material):
    """How far the top has sunk over ρgH²/2E of a bar; between 1/3 and 1: friction at the base hinders its widening."""
    body = result.bodies[-1]
    height = body.reference[:, 2].max()
    top = np.isclose(body.reference[:, 2], height)
    return -body.displacement[top, 2].mean() / (DENSITY * G * height**2 / (2 * material.young))


@pytest.mark.parametrize(
    "element", [Element.HEX8, *(pytest.param(e, marks=pytest.mark.slow) for e in Element if e != "hex8")]
)
@pytest.mark.parametrize("poisson", [0.0, 0.2, 0.49])
@pytest.mark.parametrize("young", [1e6, 1e9, 1e12])
def test_stones_from_rubber_to_steel_and_beyond(young, poisson, element):
    """E from 1 MPa to 1 TPa, ν from 0 to 0.49: reaction = weight; the top sinks by ρgH²/2E if ν = 0, less if ν > 0."""
    material = stone(young, poisson)
    # at 1 MPa strains are 1 %: small strain knows the arms of forces no better, and an uneven mesh shows it
    soft = (young, poisson, element) == (1e6, 0.49, Element.TET4)
    result = stands("two", two(material, material, element), balance=3e-4 if soft else 1e-4)
    assert result is not None
    part = sinking(result, material)
    assert (
        part == pytest.approx(1.0, rel=0.03 if young == 1e6 else 0.01) if poisson == 0 else 0.5 < part < 1.01
    )


@pytest.mark.parametrize("step", [1e-5, 1e-4, 1e-3, 1e-2, 1e-1])
@pytest.mark.parametrize("theta", [0.5, 1.0])
def test_steps_from_ten_microseconds_to_a_tenth_of_a_second(step, theta):
    """A stack in equilibrium stays there whatever the step: reaction = weight."""
    assert stands("two", two(stone(1e10), stone(1e10)), step, theta) is not None


@pytest.mark.parametrize(("lower", "upper"), [(1e7, 1e10), (1e10, 1e7), (1e6, 1e12)])
def test_neighbours_of_very_different_stiffness(lower, upper):
    """Stiffness jumps of 1:1,000 and 1:1,000,000 between neighbours: in balance; sinking by the series."""
    soft, stiff = stone(lower, 0.0), stone(upper, 0.0)
    result = stands("two", two(soft, stiff))
    assert result is not None
    top = result.bodies[2]
    sunk = -top.displacement[np.isclose(top.reference[:, 2], 0.6), 2].mean()
    parts = DENSITY * G * (0.3 * 0.45 / lower + 0.3 * 0.15 / upper)
    assert sunk == pytest.approx(parts, rel=0.03 if lower == 1e6 else 0.01)


@pytest.mark.parametrize(
    ("size", "element"), [(0.05, Element.HEX8), (0.1, Element.HEX20), (0.1, Element.TET10)]
)
def test_a_slender_stone_stands(size, element):
    """1:20, upright: its top sinks by ρgH²/2E within 1 %, and it does not lean."""
    material = stone(1e9, 0.0)
    result = stands(
        "slender",
        [ground(), elastic_box("needle", [-0.05, -0.05, 0], [0.05, 0.05, 2], material, size, element)],
    )
    assert result is not None
    assert sinking(result, material) == pytest.approx(1.0, rel=0.01)
    assert np.abs(result.bodies[1].displacement[:, :2]).max() < 1e-3 * DENSITY * G * 2**2 / (
        2 * material.young
    )


@pytest.mark.parametrize("element", [Element.HEX20, pytest.param(Element.TET10, marks=pytest.mark.slow)])
def test_a_slender_lintel_bends(element):
    """1:20 on two rigid piers, no friction: it sags as Timoshenko's beam, 5qL⁴/384EI + qL²/8κGA.

    L lies between the inner and the outer edges of its bearings of 3 cm, 1.94 and 2 m: a mesh of 0.1 m puts the force
    in between.
    """
    span, over, height = 1.94, 0.03, 0.1
    material = stone(1e9, 0.0)
    half, end = span / 2, span / 2 + over
    blocks = [
        ground(half=3.0),
        box("left", [-end - 0.2, -0.1, 0.0], [-half, 0.1, 0.2], fidelity=Fidelity.FIXED),
        box("right", [half, -0.1, 0.0], [end + 0.2, 0.1, 0.2], fidelity=Fidelity.FIXED),
        elastic_box("lintel", [-end, -0.05, 0.2], [end, 0.05, 0.2 + height], material, 0.1, element),
    ]
    result = stands("lintel", blocks, friction=0.0)
    assert result is not None
    body = result.bodies[3]
    low = np.isclose(body.reference[:, 2], 0.2)
    middle = low & np.isclose(body.reference[:, 0], 0.0)
    sag = -body.displacement[middle, 2].mean()
    load, stiffness = DENSITY * G * height, material.young * height**3 / 12  # per depth

    def beam(length):
        # G = E/2, shear coefficient 5/6
        shear = load * length**2 / 8 / (5 / 6 * material.young / 2 * height)
        return 5 * load * length**4 / (384 * stiffness) + shear

    assert beam(span) < sag < beam(span + 2 * over)


def test_a_stone_without_support_falls():
    """No equilibrium: it falls by ½ g t² + ½ g h t, as θ = 1 has it, and never claims to rest."""
    block = elastic_box("stone", [-0.1, -0.1, 1.0], [0.1, 0.1, 1.2], stone(1e10), 0.1)
    time = TimeSettings(1e-3, 1.0, 0.3, start=Start.EQUILIBRIUM)
    result = simulate(Scene("fall", (ground(), block), time=time))
    assert result.outcome is not Outcome.EQUILIBRIUM
    fallen = -result.bodies[1].displacement[:, 2].mean()
    assert fallen == pytest.approx(0.5 * G * result.time * (result.time + 1e-3), rel=1e-3)


def test_a_stone_beyond_the_edge_of_its_support_topples():
    """Its centre of mass lies 5 cm outside: it turns over the edge as the rigid one does, within 5 %."""
    low, high = [-0.25, -0.1, 0.0], [0.15, 0.1, 0.2]
    table = box("table", [0.0, -1, -0.5], [1.0, 1, 0.0], fidelity=Fidelity.FIXED)
    angles = []
    for block in (elastic_box("stone", low, high, stone(1e9), 0.05), box("stone", low, high, stone(1e9))):
        start = Start.EQUILIBRIUM if block.fidelity is Fidelity.DEFORMABLE else Start.REST
        time = TimeSettings(1e-3, 1.0, 0.2, start=start, stop_at_equilibrium=False)
        result = simulate(Scene("topple", (table, block), contact=ContactSettings(DryJoint(0.6)), time=time))
        assert result.outcome is not Outcome.EQUILIBRIUM
        body = result.bodies[1]
        ends = [body.position[np.isclose(body.reference[:, 0], x)].mean(axis=0) for x in (low[0], high[0])]
        along = ends[1] - ends[0]
        angles.append(np.arcsin(along[2] / np.linalg.norm(along)))
    assert angles[1] > 0.05
    assert angles[0] == pytest.approx(angles[1], rel=0.05)


@pytest.mark.parametrize(
    "bad", [{"young": 0.0}, {"young": -1e9}, {"poisson": 0.5}, {"poisson": 0.6}, {"density": 0.0}]
)
def test_materials_that_cannot_be_are_refused(bad):
    """With the quantity, its value and a remedy."""
    values = {"density": 2000.0, "young": 1e9, "poisson": 0.2} | bad
    with pytest.raises(MomaError, match=next(iter(bad))):
        Material("stone", **values)
