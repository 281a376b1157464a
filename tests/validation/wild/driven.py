"""Supports that move: shaken, lowered, moved away, tilted."""

import numpy as np

from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.gravity import TiltingTable
from mechanics.scene.loads.ground_motion import Component, GroundMotion
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import settlement
from mechanics.scene.shapes import box
from tests.validation.wild.scene_list import G, falls, rests, scene
from tests.validation.wild.stones import fixed, ground, stack

WIDTH, HEIGHT = 0.4, 1.0


# Two periods of 0.5 s with 0.8 of the acceleration g b/h that lifts an edge (West 1882); friction holds.
@rests("shaken_below_wests_limit", 0.8 * np.sin(2 * np.pi * np.linspace(0.0, 2.0, 201)))
# 1.5 s with twice g b/h, then 3 s back with g b/h: seen from the ground, gravity leans beyond the edge by 17°. The
# block turns by θ'' > p² (0.8 - 0.4) cos α, p² = 3 g/(4 R) = 13.7 1/s²: it lies on its side after 0.8 s.
@falls("shaken_off_its_feet", np.concatenate([np.full(300, 2.0), np.full(600, -1.0)]))
def _shaken(acceleration):
    """A block on ground that accelerates by these samples, 5 ms apart, in parts of West's g b/h [-]."""
    record = Accelerogram(5e-3, G * WIDTH / HEIGHT * acceleration, "pulse", "made")
    motion = GroundMotion(frozenset({"ground"}), (Component((1.0, 0.0, 0.0), record),))
    block = box("block", (-WIDTH / 2, -0.2, 0.0), (WIDTH / 2, 0.2, HEIGHT))
    return scene([ground(), block], 1.0, motion=True, loads=Loads(motions=(motion,)), duration=4.0)


# The right pier goes down by 20 mm: the beam turns by 1/50, a thirty-fifth of μ, and slides less than a mm.
@rests("pier_that_settles", (0.0, 0.0, -0.02))
# The right pier moves away by 30 mm: whichever end slides, its bearing of 40 mm keeps 10 mm.
@rests("pier_that_moves_a_little", (0.03, 0.0, 0.0))
# The right pier moves away by 100 mm, more than both bearings together: the beam is shorter than the gap.
@falls("pier_that_moves_away", (0.10, 0.0, 0.0))
def _beam(motion):
    """A beam of 1 m with bearings of 40 mm on two piers, of which the right one moves by (3,) [m] within 1 s."""
    piers = (
        fixed("left", (-0.8, -0.15, 0), (-0.46, 0.15, 0.5)),
        fixed("right", (0.46, -0.15, 0), (0.8, 0.15, 0.5)),
    )
    loads = Loads(motions=(settlement({"right"}, motion, 1.0),))
    return scene([*piers, box("beam", (-0.5, -0.15, 0.5), (0.5, 0.15, 0.7))], loads=loads, duration=3.0)


# A column of 0.4 m x 1.2 m on a table that tilts to 17°, tan 0.306; it tips at 1/3 and slides at 0.7.
@rests("table_tilted_inside", 17.0)
# The same to 20.5°, tan 0.374.
@falls("table_tilted_outside", 20.5)
def _tilted(degrees):
    table = TiltingTable.at_rate_degrees((0.0, 1.0, 0.0), 20.0, degrees)
    return scene([ground(), *stack(3, 0.4, 0.4)], 0.7, loads=Loads(gravity=(table,)), duration=3.0)
