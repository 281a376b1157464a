"""Rigid bodies in arrays: inertia and free flight."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.model._kernels import fly


@dataclass(frozen=True)
class RigidInertia:
    """Inertia of all bodies; fixed, driven and deformable ones have zero inverses.

    Attributes
    ----------
    mass : (nb,) [kg]
    inverse_mass : (nb,) [1/kg]
    inertia : (nb, 3, 3) about the centre of mass, body axes [kg m²]
    inverse_inertia : (nb, 3, 3) [1/(kg m²)]
    """

    mass: Array
    inverse_mass: Array
    inertia: Array
    inverse_inertia: Array

    @property
    def moving(self) -> Bools:
        """(nb,) bodies that impulses move."""
        moving: Bools = self.inverse_mass > 0
        return moving


def inverse_inertia_world(inertia: RigidInertia, rotation: Array) -> Array:
    """Return R I⁻¹ Rᵀ of every body (nb, 3, 3) [1/(kg m²)]."""
    return rotation @ inertia.inverse_inertia @ rotation.transpose(0, 2, 1)


def free_flight(
    inertia: RigidInertia, centre: Array, rotation: Array, velocity: Array, duration: float
) -> tuple[Array, Array, Array]:
    """Return centres, rotations and velocities of the rigid bodies after a flight without forces.

    Angular momentum and energy are conserved to rounding for any duration; the attitude is accurate to second order in
    substeps of at most 0.1 rad. Bodies with zero inverse mass are unchanged.
    """
    moving = inertia.moving
    turned, spin = fly(
        rotation,
        np.ascontiguousarray(velocity[:, 3:]),
        inertia.inertia,
        inertia.inverse_inertia,
        moving,
        duration,
    )
    moved = np.where(moving[:, None], centre + duration * velocity[:, :3], centre)
    return moved, turned, np.hstack([velocity[:, :3], spin])
