"""Thrust of a quadripartite rib vault, beside the sliced vault of Ungewitter and Mohrmann (1890) and Heyman (1995).

Each web is cut into arches of the breadth of a seat, parallel to its wall. An arch stands on the seats of two ribs,
from which its line of thrust rises to the crown; its horizontal thrust and its weight go to the ribs, those of the
breadth beside the wall to the springers. The two webs of a rib together push it along its own plane, with √2 times the
thrust of either. The boss presses the rib so that its line of thrust, from boss to springer, is in balance with these
pushes and the weights.

Where the lines run within the stones is a choice. Through the upper third of arches and ribs at the crown, and through
their lower third at the springing, the thrust is the least within the middle third. Lines through the middle of all
joints, and from the upper edge at the crown to the lower at the springing, are the ends between which it may vary.
"""

import math
from itertools import pairwise

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.limit.assembly import assembly
from mechanics.limit.thrust import thrust
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import (
    Block,
    ContactSettings,
    Fidelity,
    Method,
    Scene,
    SolverSettings,
    Start,
    TimeSettings,
)
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from mechanics.stones.polyhedra import mass_properties
from survey.joints.close import close_joints
from synthetic.buildings.ribs import RibVaultShape, rib_vault

STONE = Material("stone", density=2350.0, young=12e9, poisson=0.2)
GAMMA = STONE.density * 9.81  # N/m³
MIDDLE, THIRDS, EDGES = (1 / 2, 1 / 2), (2 / 3, 1 / 3), (1.0, 0.0)
"""Heights of the line of thrust over the soffit at crown and springing, as parts of the thickness [-]."""


@pytest.fixture(scope="module")
def vault():
    return rib_vault()


def slices(shape, line):
    """Thrust and weight [N], middle y and foot (x, z) [m] of half an arch of each breadth, from the springer up."""
    beds, t = shape.beds(), shape.thickness
    crown, seat = line
    # stones are wedges between two beds; half the one at the crown is as wide as at half its height
    corners = [
        np.array(
            [
                [one.x + s * one.up[0], one.z + s * one.up[2]]
                for one, s in zip((a, b, b, a), (0, 0, t, t), strict=True)
            ]
        )
        for a, b in pairwise(beds)
    ]
    areas, middles = zip(*(polygon(one) for one in corners), strict=True)
    half = beds[-1].x + 0.5 * t * beds[-1].up[0]
    areas, middles = [*areas, t * half], [*middles, 0.5 * half]
    top = beds[-1].z + crown * t
    ends = [shape.half, *(bed.end for bed in beds)]
    out = []
    for k, bed in enumerate(beds):
        x, z = bed.x + seat * t * bed.up[0], bed.z + seat * t * bed.up[2]
        breadth = ends[k] - ends[k + 1]
        weight = GAMMA * breadth * sum(areas[k:])
        moment = GAMMA * breadth * sum(a * (x - m) for a, m in zip(areas[k:], middles[k:], strict=True))
        out.append((moment / (top - z), weight, 0.5 * (ends[k] + ends[k + 1]), x, z))
    return out


def polygon(corners):
    """Area and abscissa of the centroid of a polygon (n, 2)."""
    (x, z), (u, w) = corners.T, np.roll(corners, -1, axis=0).T
    cross = x * w - u * z
    return abs(cross.sum()) / 2, ((x + u) * cross).sum() / (3 * cross.sum())


def by_hand(vault, line):
    """Thrust on a springer along its rib, and weight on it [N]."""
    shape = vault.shape
    beds, solids = shape.beds(), {solid.code: solid for solid in vault.building.solids}

    def place(bed, share):
        """Distance from the axis and height of a place in the rib's joint, at a part of its height."""
        out = share * shape.height - shape.drop
        return (bed.x + bed.end) / math.sqrt(2) + out * math.hypot(*bed.rise[:2]), bed.z + out * bed.rise[2]

    (u0, z0), (_, top) = place(beds[0], line[1]), place(beds[-1], line[0])
    own = [(f"R1-{k:02d}", 1.0) for k in range(1, len(beds))] + [("B", 0.25)]
    weight = moment = 0.0
    for code, share in own:
        solid = solids[code]
        mass = mass_properties((solid.vertices - vault.foot) @ vault.axes.T, solid.faces)
        # a quarter of the boss hangs on the rib's last joint
        reach = place(beds[-1], 0.5)[0] if code == "B" else math.hypot(*mass.centroid[:2])
        weight += share * GAMMA * mass.volume
        moment += share * GAMMA * mass.volume * (u0 - reach)
    (wall, borne, *_), *others = slices(shape, line)
    for push, load, y, x, z in others:
        weight += 2 * load
        moment += 2 * load * (u0 - (x + y) / math.sqrt(2)) - math.sqrt(2) * push * (z - z0)
    boss = moment / (top - z0)
    assert boss > 0 or line is MIDDLE
    return boss + math.sqrt(2) * (wall + sum(push for push, *_ in others)), weight + 2 * borne


def scene(vault, solids, mesh_size=None, method=Method.AUTO):
    soft = Fidelity.RIGID if mesh_size is None else Fidelity.DEFORMABLE
    blocks = tuple(
        Block(one.code, one.vertices - vault.foot, one.faces, STONE, Fidelity.FIXED)
        if one.code in vault.building.base
        else Block(one.code, one.vertices - vault.foot, one.faces, STONE, soft, mesh_size=mesh_size)
        for one in solids
    )
    return Scene(
        "rib vault",
        blocks,
        contact=ContactSettings(DryJoint(0.6)),
        time=TimeSettings(step=5e-3, theta=1.0, duration=0.2, relaxation=True, start=Start.EQUILIBRIUM),
        solver=SolverSettings(method=method),
    )


def pushes(vault, solids, **how):
    """Thrust and weight on each springer [N], of a vault that rests with each step solved."""
    result = simulate(scene(vault, solids, **how))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.unconverged_steps == 0
    assert result.reaction == pytest.approx(result.weight, rel=1e-6 if not how else 2e-5)
    contacts, codes = result.contacts, [body.code for body in result.bodies]
    out = []
    for code in vault.building.base:
        at = codes.index(code)
        sign = (contacts.bodies[:, 1] == at).astype(float) - (contacts.bodies[:, 0] == at)
        force = sign @ contacts.force
        out.append((math.hypot(*force[:2]), force[2]))
    return np.array(out).T


def test_the_weights_of_the_slices_are_those_of_the_stones(vault):
    """All but the springers."""
    fixed = set(vault.building.base)
    volumes = [
        mass_properties(one.vertices - vault.foot, one.faces).volume
        for one in vault.building.solids
        if one.code not in fixed
    ]
    assert 4 * by_hand(vault, THIRDS)[1] == pytest.approx(GAMMA * sum(volumes), rel=2e-3)


def test_the_thrust_is_that_of_the_sliced_vault(vault):
    """Within a tenth for lines in the middle third; all four springers alike, as the bay is."""
    (least, weight), (middle, _), (most, _) = (by_hand(vault, line) for line in (EDGES, THIRDS, MIDDLE))
    push, borne = pushes(vault, vault.building.solids)
    print(f"\nby hand {least:.0f}, {middle:.0f}, {most:.0f} N; simulated {push.round()} N")
    assert push == pytest.approx(np.full(4, middle), rel=0.10)
    assert push == pytest.approx(np.full(4, push.mean()), rel=0.005)
    assert borne == pytest.approx(np.full(4, weight), rel=0.01)


def test_so_it_is_with_the_joints_of_the_survey_closed(vault):
    push, borne = pushes(vault, close_joints(vault.building.blocks()).solids)
    middle, weight = by_hand(vault, THIRDS)
    print(f"\nby hand {middle:.0f} N; simulated from the survey {push.round()} N")
    assert push == pytest.approx(np.full(4, middle), rel=0.10)
    assert borne == pytest.approx(np.full(4, weight), rel=0.02)


def test_other_solvers_find_other_thrusts_between_the_lines_at_the_edges_and_in_the_middle(vault):
    """Forces between rigid stones are not unique: the hand calculation says how far they may differ."""
    least, most = by_hand(vault, EDGES)[0], by_hand(vault, MIDDLE)[0]
    found = [
        pushes(vault, vault.building.solids, method=one)[0].mean()
        for one in (Method.NSGS, Method.INTERIOR_POINT)
    ]
    print(f"\nbetween {least:.0f} and {most:.0f} N: {np.round(found)}")
    assert (np.array(found) > least).all()
    assert (np.array(found) < most).all()


def test_limit_analysis_allows_more_on_either_side(vault):
    """With friction and the ends of courses against the ribs webs can do more than arches side by side."""
    on = assembly(scene(vault, vault.building.solids))
    way = np.array([1.0, 1.0, 0.0]) @ vault.axes
    found = thrust(on, [vault.building.base[0]], tuple(way.tolist()))
    print(f"\nleast {found.least.value:.0f}, greatest {found.greatest.value:.0f} N")
    assert found.least.value < by_hand(vault, EDGES)[0]
    assert found.greatest.value > by_hand(vault, MIDDLE)[0]


@pytest.mark.slow
def test_elastic_stones_push_as_the_sliced_vault():
    """Their forces are unique, all but what friction holds."""
    vault = rib_vault(RibVaultShape(segments=5))
    push, _ = pushes(vault, vault.building.solids, mesh_size=0.3)
    print(f"\nby hand {by_hand(vault, THIRDS)[0]:.0f} N; elastic {push.round()} N")
    assert push == pytest.approx(np.full(4, by_hand(vault, THIRDS)[0]), rel=0.10)
