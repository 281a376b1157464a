"""Blocks and scenes of the validation cases."""

import numpy as np

from mechanics.materials import Material
from mechanics.scene import Block, Fidelity

FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=float
)
STONE = Material("stone", density=2400.0, young=10e9, poisson=0.2)
G = 9.81


def box(code, low, high, material=STONE, fidelity=Fidelity.RIGID, mesh_size=None, velocity=(0.0,) * 6):
    """An axis-parallel block from corner `low` to corner `high` [m]."""
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    return Block(code, low + CORNERS * (high - low), FACES, material, fidelity, mesh_size, velocity)


def ground(half=5.0, depth=1.0):
    """A fixed block whose top is z = 0."""
    return box("ground", [-half, -half, -depth], [half, half, 0.0], fidelity=Fidelity.FIXED)


def tilted_gravity(degrees):
    """Gravity as a plane tilted by an angle about y feels it; x points down the slope."""
    angle = np.radians(degrees)
    return (G * float(np.sin(angle)), 0.0, -G * float(np.cos(angle)))
