"""Balls: thrown bodies, and benchmarks of rolling with closed forms."""

from collections.abc import Sequence

import numpy as np

from ground.errors import SceneError
from mechanics.scene.scene import Block, Fidelity
from mechanics.stones.materials import Material
from mechanics.stones.polyhedra import MassProperties


def ball(
    code: str,
    centre: Sequence[float],
    radius: float,
    material: Material,
    fidelity: Fidelity = Fidelity.RIGID,
    velocity: tuple[float, ...] = (0.0,) * 6,
) -> Block:
    """Return a ball of a radius [m] about a centre (3,) [m]; contacts are those of the sphere, pictures show facets.

    Raises
    ------
    SceneError : if the radius is not positive
    """
    if not radius > 0:
        raise SceneError(f"radius = {radius!r}", where=f"stone {code}", remedy="give metres greater than 0")
    from trimesh.creation import icosphere  # a quarter of a second, which few scenes need

    facets = icosphere(subdivisions=2, radius=radius)
    return Block(
        code,
        np.asarray(facets.vertices) + np.asarray(centre, dtype=float),
        tuple(tuple(int(v) for v in face) for face in facets.faces),
        material,
        fidelity,
        velocity=velocity,
        radius=radius,
    )


def ball_properties(block: Block) -> MassProperties:
    """Return volume, centre and inertia of the sphere that a block stands for."""
    assert block.radius is not None
    volume = 4.0 / 3.0 * np.pi * block.radius**3
    inertia = 0.4 * volume * block.radius**2 * np.eye(3)
    return MassProperties(volume, block.vertices.mean(axis=0), inertia)
