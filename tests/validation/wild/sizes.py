"""The same structures at sizes and gravities far from a metre on Earth."""

import numpy as np

from mechanics.scene.shapes import bond, box, semicircular_arch, wall
from tests.validation.masonry import overhanging_stack
from tests.validation.wild.scene_list import Truth, falls, scene, slides, stands, tilted, wild
from tests.validation.wild.stones import ground, scaled, shifted, stack

ARCH = semicircular_arch(9, 0.2, 1.0)
"""t/r = 0.2 is nearly twice the least thickness of nine voussoirs (0.1015, linear program)."""


@stands
def stack_of_millimetres():
    """Five stones of 2 mm x 1.5 mm. No side load."""
    return scene([ground(0.1, 0.1), *stack(5, 2e-3, 1.5e-3)], duration=0.5)


@falls
def overhang_of_millimetres():
    """Eight stones of 5 mm with 1.1 of the harmonic overhang."""
    return scene(scaled(overhanging_stack(8, 1.1), 0.005), duration=0.5)


@stands
def arch_of_millimetres():
    """Nine voussoirs, mean radius 10 mm, t/r = 0.2."""
    return scene(scaled(ARCH, 0.01), duration=0.5)


@wild(Truth.STANDS, pace=3.0)
def stack_of_hundred_metres():
    """Five stones of 100 m x 60 m. No side load."""
    return scene([ground(1000, 100), *stack(5, 100.0, 60.0)], duration=30)


@wild(Truth.FALLS, pace=3.0)
def column_of_hundred_metres_tilted():
    """Three stones, 100 m wide and 300 m high, at λ = 0.37: they tip at 1/3 (11 %)."""
    return scene([ground(1000, 100), *stack(3, 100.0, 100.0)], 0.8, gravity=tilted(0.37), duration=60)


@wild(Truth.SLIDES, pace=3.0)
def slide_of_a_mountain():
    """A block of 100 m at tan α = 1.05 μ."""
    block = box("block", (-50, -50, 0), (50, 50, 30))
    return scene([ground(3000, 100), block], 0.4, gravity=tilted(0.42), duration=3)


@wild(Truth.STANDS, pace=30.0)
def arch_in_a_thousandth_of_gravity():
    """Nine voussoirs, t/r = 0.2, g = 0.00981 m/s²: forces scale, the line of thrust does not."""
    return scene(ARCH, gravity=tilted(0.0, g=9.81e-3), duration=60)


@wild(Truth.FALLS, pace=30.0)
def overhang_in_a_thousandth_of_gravity():
    """Eight stones with 1.1 of the harmonic overhang, g = 0.00981 m/s²."""
    return scene(overhanging_stack(8, 1.1), gravity=tilted(0.0, g=9.81e-3), duration=120)


@wild(Truth.FALLS, pace=10.0)
def stone_in_the_air_in_small_gravity():
    """A stone 1 m above nothing at g = 0.1 m/s²: it falls, slowly."""
    lone = shifted(stack(1, 0.4, 0.3)[0], (0, 0, 2.0), "air")
    return scene([ground(), *stack(2, 0.4, 0.3), lone], gravity=(0, 0, -0.1), duration=20)


@stands
def pebble_on_a_boulder():
    """A stone of 10 mm on one of 5 m: masses of 1 to 10⁸. No side load."""
    boulder = box("boulder", (-2.5, -2.5, 0), (2.5, 2.5, 4.0))
    return scene([ground(), boulder, box("pebble", (-0.005, -0.005, 4.0), (0.005, 0.005, 4.008))], duration=1)


@stands
def boulder_on_pebbles():
    """A stone of 2 m on four of 20 mm under its corners: each bears a quarter of the weight."""
    feet = [
        box(f"P{i}{j}", (x - 0.01, y - 0.01, 0), (x + 0.01, y + 0.01, 0.015))
        for i, x in enumerate((-0.9, 0.9))
        for j, y in enumerate((-0.9, 0.9))
    ]
    return scene([ground(), *feet, box("boulder", (-1, -1, 0.015), (1, 1, 1.015))], duration=1)


@falls
def thin_wall_pushed():
    """A wall of slates 10 mm thick and 0.6 m high, pushed out of plane by 0.025 of its weight: it tips at 1/60."""
    stones = wall(bond(3, 6), 0.3, 0.1, 0.01)
    return scene([ground(), *stones[1:]], gravity=tilted(0.025, (0.0, 1.0, 0.0)), duration=4)


@slides
def slate_that_slides():
    """A slate 5 mm thick and 0.5 m wide on a slope, tan α = 1.06 μ."""
    return scene(
        [ground(30), box("slate", (-0.25, -0.25, 0), (0.25, 0.25, 0.005))],
        0.5,
        gravity=tilted(0.53),
        duration=2,
    )


@stands
def far_from_the_origin():
    """A stack of five 2 km from the origin of the survey. No side load."""
    blocks = [ground(), *stack(5, 0.4, 0.3)]
    return scene([shifted(one, (1500.0, -1200.0, 300.0)) for one in blocks])


@stands
def unequal_stack():
    """Ten stones whose widths shrink from 2 m to 0.1 m: masses of 1 to 4000, centres in line."""
    widths = np.geomspace(2.0, 0.1, 10)
    blocks = [
        box(f"U{k}", (-w / 2, -w / 2, 0.2 * k), (w / 2, w / 2, 0.2 * k + 0.2)) for k, w in enumerate(widths)
    ]
    return scene([ground(), *blocks])
