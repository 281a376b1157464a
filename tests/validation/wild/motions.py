"""Stones in motion: rocking that comes back or not, slides that stop, stones thrown, dropped and kicked."""

from dataclasses import replace

import numpy as np

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.shapes import bond, box, column, wall
from tests.validation.scenes import moved, rotation
from tests.validation.wild.scene_list import G, falls, rests, scene
from tests.validation.wild.stones import fixed, ground, shifted, stack, turning


def _block(width, height, depth=0.5):
    """A block on x = -width … 0: its right bottom edge is the y axis."""
    return box("block", (-width, -depth / 2, 0.0), (0.0, depth / 2, height))


def limit_spin(width, height):
    """Rate about its bottom edge with which an upright block just overturns [rad/s].

    ½ I ω² = m g R (1 - cos α), with I = 4/3 m R², R the half diagonal and α = atan(width/height) (Housner 1963).
    """
    half = 0.5 * np.hypot(width, height)
    return np.sqrt(1.5 * G * (1 - np.cos(np.arctan(width / height))) / half)


# A block of 0.25 m x 1 m turned about its edge at 0.9 of the rate that overturns it: 0.81 of the energy.
@rests("rocking_below_housners_limit", 0.25, 1.0, 0.9)
# The same at 1.1 of that rate: 1.21 of the energy, and no impact before the top.
@falls("rocking_above_housners_limit", 0.25, 1.0, 1.1)
# A block of 0.5 m x 0.8 m at 0.85 of its rate: its corner moves by more than half its width on the way.
@rests("rocking_of_a_squat_block", 0.5, 0.8, 0.85)
def _kicked(width, height, part, duration=4.0):
    spin = np.array([0.0, part * limit_spin(width, height), 0.0])
    return scene(
        [ground(), turning(_block(width, height), (0, 0, 0), spin)], 1.0, duration=duration, motion=True
    )


# Let go at 0.9 of the angle of its balance: it falls back, and each impact takes energy.
@rests("let_go_inside_its_edge", 0.9)
# Let go at 1.1 of the angle of its balance: the centre of mass is beyond the edge.
@falls("let_go_outside_its_edge", 1.1)
def _leaning(part):
    """A block of 0.25 m x 1 m let go at `part` of the angle atan 0.25 at which its centre is over its edge."""
    block = moved(_block(0.25, 1.0), rotation([0, 1, 0], part * np.degrees(np.arctan(0.25))))
    return scene([ground(), replace(block, velocity=(0.0,) * 6)], 1.0, duration=4.0, motion=True)


def column_barrier(count, width, height):
    """Least energy that topples a stack of equal drums by hinges on one side, over the weight of a drum [m].

    Drum i turned by φ has potential energy V_i(φ) = a_i (cos φ - 1) + ½ b sin φ per weight, a_i = (n - i + ½) h, as it
    lifts all above it: the angles separate. They cannot decrease upwards, so as drum i passes the top of V_i at φ*_i
    each drum above has at least V_j(φ*_i); the barrier is the least over i.
    """
    arm = (count - np.arange(1, count + 1) + 0.5) * height
    top = np.arctan(0.5 * width / arm)

    def energy(j, angle):
        return arm[j] * (np.cos(angle) - 1) + 0.5 * width * np.sin(angle)

    return min(energy(i, top[i]) + sum(energy(j, top[i]) for j in range(i + 1, count)) for i in range(count))


# Drums of 0.5 m, 0.5 m high, with half the energy of the least barrier of all ways to hinge.
@rests("rocking_column_of_three_drums", 3, 0.5, 0.5, 0.5)
# Drums 0.5 m wide and 0.15 m high with 0.6 of the energy of the least barrier: the top moves by more than half the
# height of a drum, fast, and comes back.
@rests("rocking_column_of_ten_flat_drums", 10, 0.5, 0.15, 0.6)
def _rocking_column(count, width, height, part):
    """A column of square drums that turns as one about its right edge with `part` of the energy of the barrier."""
    drums = [
        box(f"drum {k + 1}", (-width, -width / 2, k * height), (0.0, width / 2, (k + 1) * height))
        for k in range(count)
    ]
    # ½ I ω² of the whole column about its edge: I = m/3 (b² + H²) n, per weight of a drum
    whole = count * height
    inertia = count * (width**2 + whole**2) / 3 / G
    rate = np.sqrt(2 * part * column_barrier(count, width, height) / inertia)
    spin = np.array([0.0, rate, 0.0])
    return scene(
        [ground(), *(turning(one, (0, 0, 0), spin) for one in drums)], 0.8, duration=4.0, motion=True
    )


@rests
def kicked_stacks():
    """Three stacks side by side, not bonded, whose top stones get 0.2 m/s: they slide at most v²/(2 μ g) = 3 mm."""
    stacks = []
    for k in range(3):
        for one in stack(4, 0.4, 0.25):
            place = shifted(one, (0.5 * k, 0, 0), f"{k}{one.code}")
            stacks.append(place if one.code != "S4" else replace(place, velocity=(0.2, 0.1, 0, 0, 0, 0)))
    return scene([ground(), *stacks], motion=True)


@falls
def kicked_stone_off_its_stack():
    """The top stone of a stack, 0.4 m wide, leaves at 2.5 m/s: friction would stop it after v²/(2 μ g) = 0.91 m at
    μ = 0.35, and its centre passes the edge after 0.2 m."""
    stones = stack(3, 0.4, 0.3)
    return scene(
        [ground(), *stones[:2], replace(stones[2], velocity=(2.5, 0, 0, 0, 0, 0))], 0.35, motion=True
    )


@rests
def slide_that_stops():
    """A block at 2 m/s on level ground: it stops after v²/(2 μ g) = 0.68 m, more than its width; it does not tip."""
    block = box("block", (-0.3, -0.2, 0), (0.3, 0.2, 0.2), velocity=(2.0, 0, 0, 0, 0, 0))
    return scene([ground(), block], 0.3, motion=True)


@falls
def slide_off_the_edge():
    """A block at 2 m/s whose centre is 0.3 m from the edge of its table: it would stop after 0.68 m."""
    block = box("block", (-0.6, -0.2, 0), (0.0, 0.2, 0.2), velocity=(2.0, 0, 0, 0, 0, 0))
    return scene([fixed("table", (-3.0, -1.0, -0.5), (0.0, 1.0, 0.0)), block], 0.3, motion=True)


@rests
def thrown_upward():
    """A block thrown up with 2 m/s: it rises v²/(2 g) = 0.20 m, and lands flat after 0.41 s, without restitution."""
    block = box("block", (-0.3, -0.2, 0), (0.3, 0.2, 0.3), velocity=(0, 0, 2.0, 0, 0, 0))
    return scene([ground(), *[block]], motion=True)


@rests
def dropped_by_little():
    """A block dropped flat from 30 mm, a tenth of its height: it lands on its face without restitution."""
    return scene([ground(), box("block", (-0.3, -0.2, 0.03), (0.3, 0.2, 0.33))], motion=True)


@rests
def bouncing():
    """A block dropped flat from 30 mm with e = 0.4: bounces shorten as e, so it rests after (1 + 2 e/(1 - e)) 78 ms."""
    block = box("block", (-0.3, -0.3, 0.03), (0.3, 0.3, 0.23))
    return scene([ground(), block], law=DryJoint(0.6, restitution=0.4), motion=True)


@rests
def slide_along_a_wall():
    """A stone on a wall in running bond that starts at 0.5 m/s: it stops after v²/(2 μ g) = 18 mm.

    It weighs a third of a stone of the wall, each of which bears on two others.
    """
    stones = wall(bond(3, 4), 0.5, 0.25, 0.3)
    slider = box("slider", (0.6, -0.1, 1.0), (0.9, 0.1, 1.2), velocity=(0.5, 0, 0, 0, 0, 0))
    return scene([ground(), *stones[1:], slider], 0.7, motion=True)


@falls
def column_kicked_over():
    """Three drums as one block of 0.3 m x 1.5 m, kicked at twice the rate that overturns the block: 4 times the energy.

    Hinges between the drums cannot hold the centre of mass back, which needs 0.15 m and moves at 2.0 m/s at first.
    """
    _, *drums = column(3, 0.3 * np.sqrt(2), 0.5, sides=4)
    turned = [moved(one, rotation([0, 0, 1], 45)) for one in drums]
    spin = np.array([0.0, 2 * limit_spin(0.3, 1.5), 0.0])
    return scene([ground(), *(turning(one, (0.15, 0, 0), spin) for one in turned)], 1.0, motion=True)
