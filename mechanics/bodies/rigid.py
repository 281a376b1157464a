"""Rigid bodies, all at once in arrays: free velocity, motion, and the exponential map."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["RigidInertia", "inverse_inertia_world", "rigid_free_velocity", "rotation_exp"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RigidInertia:
    """Inertia of all bodies; fixed and deformable ones have zero inverses.

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


def inverse_inertia_world(inertia: RigidInertia, rotation: Array) -> Array:
    """R I⁻¹ Rᵀ of every body (nb, 3, 3) [1/(kg m²)]."""
    return rotation @ inertia.inverse_inertia @ rotation.transpose(0, 2, 1)


def rigid_free_velocity(
    inertia: RigidInertia, rotation: Array, velocity: Array, gravity: Array, step: float
) -> Array:
    """Velocity (nb, 6) at the end of the step without contact: gravity and the gyroscopic moment -ω × I ω."""
    moving = inertia.inverse_mass > 0
    free = velocity.copy()
    free[moving, :3] += step * gravity
    omega = velocity[:, 3:, None]
    momentum = rotation @ (inertia.inertia @ (rotation.transpose(0, 2, 1) @ omega))
    moment = -np.cross(omega[..., 0], momentum[..., 0])
    spin = (inverse_inertia_world(inertia, rotation) @ moment[..., None])[..., 0]
    free[:, 3:] += step * spin
    return free


def rotation_exp(vector: Array) -> Array:
    """Rotation matrices (n, 3, 3) of the rotation vectors (n, 3) [rad] (Rodrigues), accurate near zero."""
    angle = np.linalg.norm(vector, axis=-1)[:, None, None]
    x, y, z = vector.T
    zero = np.zeros_like(x)
    skew = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)
    # sinc(t/π) = sin t / t, and (1 - cos t)/t² = ½ (sin(t/2)/(t/2))²
    turned: Array = np.eye(3) + np.sinc(angle / np.pi) * skew
    turned += 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (skew @ skew)
    return turned
