"""Structures a little inside and a little outside their limit of equilibrium."""

import numpy as np

from mechanics.scene.scene import Fidelity
from mechanics.scene.shapes import bond, box, column, semicircular_arch, voussoir_arch, wall
from tests.validation.masonry import overhanging_stack
from tests.validation.wild.scene_list import falls, scene, slides, stands, tilted
from tests.validation.wild.stones import fixed, ground, hexahedron, stack

LEAST_THICKNESS = {9: 0.101525, 21: 0.106695}
"""Least t/r of a semicircular arch of so many voussoirs, by the linear program at μ = 0.8."""


def drum_limit(sides, slender):
    """λ = 2 a/H at which a prism of `sides` corners on a circle of diameter D tips over its edge, a = D/2 cos(π/n)."""
    return np.cos(np.pi / sides) / slender


# Two drums, 2 m high on a circle of 1 m: they tip at λ = cos(π/6)/2 = 0.433; here 0.95 of it.
@stands("drums_of_6_sides_inside", 6, 0.95)
# The same at 1.05.
@falls("drums_of_6_sides_outside", 6, 1.05)
# Two drums of 16 sides: λ = cos(π/16)/2 = 0.490; here 0.95 of it.
@stands("drums_of_16_sides_inside", 16, 0.95)
# The same at 1.05.
@falls("drums_of_16_sides_outside", 16, 1.05)
# Two drums of 24 sides: λ = cos(π/24)/2 = 0.496; here 0.95 of it.
@stands("drums_of_24_sides_inside", 24, 0.95)
def _drum(sides, part):
    """One drum of diameter 1, height 2, pushed over an edge: along π/n, as the first corner lies on x."""
    angle = np.pi / sides
    towards = (np.cos(angle), np.sin(angle), 0.0)
    base, *drums = column(2, 1.0, 1.0, sides=sides)
    pull = tilted(part * drum_limit(sides, 2.0), towards)
    return scene([base, *drums], 0.9, gravity=pull, duration=2.0)


@slides
def slide_just_above_friction():
    """A block on a slope, tan α = 1.04 μ."""
    return scene(
        [ground(30), box("block", (-0.3, -0.2, 0), (0.3, 0.2, 0.2))], 0.5, gravity=tilted(0.52), duration=2
    )


@stands
def rest_just_below_friction():
    """A block on a slope, tan α = 0.96 μ; it tips at 0.6/0.2."""
    return scene(
        [ground(30), box("block", (-0.3, -0.2, 0), (0.3, 0.2, 0.2))], 0.5, gravity=tilted(0.48), duration=2
    )


@slides
def stack_that_slides_on_its_ground():
    """Three stones on a slope, tan α = 1.05 μ: they slide together, as all joints have the same μ; they tip at 0.8."""
    return scene([ground(30), *stack(3, 0.4, 0.15)], 0.45, gravity=tilted(0.4725), duration=2)


@slides
def slide_that_creeps():
    """A block at tan α = 1.03 μ in a tenth of gravity: a = 0.009 · 0.981 m/s², 18 mm and 18 mm/s after 2 s."""
    slope = tilted(0.309, g=0.981)
    return scene([ground(30), box("block", (-0.3, -0.2, 0), (0.3, 0.2, 0.2))], 0.3, gravity=slope, duration=2)


@stands
def overhang_inside():
    """Eight stones whose k-th from the top overhangs by 0.95 L/(2k): 1.0 is the limit."""
    return scene(overhanging_stack(8, 0.95))


@falls
def overhang_outside():
    """The same with 1.05."""
    return scene(overhanging_stack(8, 1.05))


# Four stones in steps of 0.95 L/5: their centre of mass is at 2.5 s from the table's edge less L/2.
@stands("corbel_inside", 0.95)
# The same in steps of 1.05 L/5.
@falls("corbel_outside", 1.05)
def _corbel(part, count=4):
    """Stones of 1 m that each reach out by s; all of them tip about the table's edge at s = 1/(n + 1)."""
    s = part / (count + 1)
    table = fixed("table", (-2.0, -0.2, -0.3), (0.5, 0.2, 0.0))
    stones = [
        box(f"C{k}", (-0.5 + k * s, -0.2, 0.2 * (k - 1)), (0.5 + k * s, 0.2, 0.2 * k))
        for k in range(1, count + 1)
    ]
    return scene([table, *stones])


# A corbel of 1 m that reaches out by 0.57 m, with 0.3 m of the same stone on its tail. About the table's edge it
# turns out by 1 · (0.57 - 0.5) = 0.070, the weight back by 0.3 · (0.43 - 0.15) = 0.084.
@stands("lapped_corbel_inside", 0.57, 0.3)
# The same 0.6 m out: it turns out by 0.1, and back by 0.3 · (0.4 - 0.15) = 0.075.
@falls("lapped_corbel_outside", 0.6, 0.3)
def _half_lapped(lap, load):
    """A stone of 1 m that reaches over its table by `lap`, held by a stone of `load` m on its other end."""
    table = fixed("table", (-2.0, -0.2, -0.3), (0.0, 0.2, 0.0))
    corbel = box("corbel", (lap - 1.0, -0.2, 0.0), (lap, 0.2, 0.2))
    return scene([table, corbel, box("weight", (lap - 1.0, -0.2, 0.2), (lap - 1.0 + load, 0.2, 0.4))])


# 1.05 of the least thickness of 21 voussoirs (linear program).
@stands("arch_of_21_above_its_least_thickness", 21, 1.05)
# 0.95 of it.
@falls("arch_of_21_below_its_least_thickness", 21, 0.95)
# 1.05 of the least thickness of 9 voussoirs (linear program).
@stands("arch_of_9_above_its_least_thickness", 9, 1.05)
# 0.95 of it.
@falls("arch_of_9_below_its_least_thickness", 9, 0.95)
def _arch(count, part):
    return scene(semicircular_arch(count, part * LEAST_THICKNESS[count], 1.0, 0.3), 0.8)


PANEL_LIMIT = 0.39833
"""λ of the panel of 3 x 12 stones at μ = 0.6 (associative linear program; MOMA's tests of statics state it, too)."""


# 42 stones at 0.9 of the associative limit; with 0.9 of the friction the limit is still 0.99 of it.
@stands("wall_tilted_inside", 0.9)
# 1.04 of the associative limit, which is an upper bound.
@falls("wall_tilted_outside", 1.04)
def _panel(part):
    return scene(
        wall(bond(3, 12, halves_first=True), 0.2, 0.1, 0.1),
        0.6,
        gravity=tilted(part * PANEL_LIMIT),
        duration=2,
    )


@stands
def pyramid():
    """4 + 3 + 2 + 1 stones, each on the middle of two: vertical loads through bearings of half a stone."""
    stones = [
        box(
            f"P{k}-{i}",
            (0.5 * i + 0.25 * k, -0.15, 0.25 * k),
            (0.5 * i + 0.25 * k + 0.5, 0.15, 0.25 * k + 0.25),
        )
        for k in range(4)
        for i in range(4 - k)
    ]
    return scene([ground(), *stones])


def buttressed(width, height=1.0):
    """An arch of 11 voussoirs, t/r = 0.25, on two piers that stand free [m]."""
    inner, outer, half = 0.875, 1.125, 0.15
    piers = [
        box("right", (inner, -half, 0.0), (inner + width, half, height)),
        box("left", (-inner - width, -half, 0.0), (-inner, half, height)),
    ]
    arch = voussoir_arch(11, (inner, outer), 2 * half, centre=(0.0, height))
    return [ground(), *piers, *arch]


@stands
def arch_on_wide_piers():
    """Piers 0.28 m wide; the least width is between 0.24 and 0.25 m (linear program)."""
    return scene(buttressed(0.28))


@falls
def arch_on_narrow_piers():
    """Piers 0.22 m wide."""
    return scene(buttressed(0.22))


def dome(rings=3, segments=8, radius=1.0, thickness=0.2, top=np.pi / 3, skip=0):
    """Rings of a spherical dome from the springing up to the elevation `top`, on a fixed ring; all faces are planar."""
    lift = np.linspace(0.0, top, rings + 1)
    azimuth = 2 * np.pi * np.arange(segments + 1) / segments
    blocks = []

    def corner(r, elevation, a):
        return [r * np.cos(elevation) * np.cos(a), r * np.cos(elevation) * np.sin(a), r * np.sin(elevation)]

    inner, outer = radius - thickness / 2, radius + thickness / 2
    for k in range(rings):
        for i in range(segments):
            a, b = azimuth[i], azimuth[i + 1]
            corners = [
                corner(r, e, x)
                for e in lift[k : k + 2]
                for r, x in ((outer, a), (outer, b), (inner, b), (inner, a))
            ]
            blocks.append(hexahedron(f"D{k + 1}-{i + 1}", corners))
    base = fixed("base", (-outer - 0.1, -outer - 0.1, -0.3), (outer + 0.1, outer + 0.1, 0.0))
    return [base, *blocks[: len(blocks) - skip]]


@stands
def dome_with_an_oculus():
    """Three rings of eight stones, t/r = 0.2, open at the top: the rings bear compression (linear program, μ = 0.3)."""
    return scene(dome())


@falls
def dome_with_a_gap_in_its_upper_ring():
    """The same less three stones of its upper ring, μ = 0.1: the others slide down (linear program, at 0.3 too)."""
    return scene(dome(skip=3), 0.1)


@stands
def elastic_lintel():
    """An elastic lintel of 1.2 m on two piers, with a rigid stone on it: the bearings are 0.2 m, E = 10 GPa."""
    piers = (
        fixed("left", (-0.8, -0.15, 0), (-0.4, 0.15, 0.5)),
        fixed("right", (0.4, -0.15, 0), (0.8, 0.15, 0.5)),
    )
    lintel = box("lintel", (-0.6, -0.15, 0.5), (0.6, 0.15, 0.8), fidelity=Fidelity.DEFORMABLE, mesh_size=0.3)
    return scene([*piers, lintel, box("load", (-0.25, -0.15, 0.8), (0.25, 0.15, 1.1))], duration=1)


@falls
def elastic_cantilever():
    """An elastic stone that reaches out over its table by 0.6 of its length."""
    table = fixed("table", (-2.0, -0.2, -0.3), (0.0, 0.2, 0.0))
    stone = box("stone", (-0.4, -0.2, 0.0), (0.6, 0.2, 0.3), fidelity=Fidelity.DEFORMABLE, mesh_size=0.3)
    return scene([table, stone], duration=2)


@stands
def elastic_stack():
    """Three stones, the middle one elastic. No side load."""
    low, middle, high = stack(3, 0.4, 0.3)
    soft = box(
        "soft",
        *(middle.vertices.min(axis=0), middle.vertices.max(axis=0)),
        fidelity=Fidelity.DEFORMABLE,
        mesh_size=0.3,
    )
    return scene([ground(), low, soft, high], duration=1)
