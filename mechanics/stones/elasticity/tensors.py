"""Stress tensors: components, Von Mises, principal values."""

import numpy as np

from mechanics.arrays import Array


def von_mises(stress: Array) -> Array:
    """Return σ_vm = sqrt(½[(σxx-σyy)²+(σyy-σzz)²+(σzz-σxx)²] + 3(σxy²+σyz²+σzx²)) of stress (…, 6) [Pa].

    >>> von_mises(np.array([[5e6, 0, 0, 0, 0, 0], [2e6, 2e6, 2e6, 0, 0, 0]])).tolist()
    [5000000.0, 0.0]
    """
    xx, yy, zz, xy, yz, zx = np.moveaxis(stress, -1, 0)
    result: Array = np.sqrt(
        0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) + 3.0 * (xy**2 + yz**2 + zx**2)
    )
    return result


def principal(stress: Array) -> tuple[Array, Array]:
    """Return principal stresses (…, 3) [Pa] of stress (…, 6), largest first, and unit directions (…, 3, 3) in rows.

    Directions have no sense; where two values are equal, any direction in their plane is one.
    """
    values, vectors = np.linalg.eigh(from_voigt(stress))
    return values[..., ::-1], np.swapaxes(vectors, -1, -2)[..., ::-1, :]


def to_voigt(tensor: Array) -> Array:
    """Take a symmetric tensor (…, 3, 3) to (…, 6) in the order xx, yy, zz, xy, yz, zx."""
    voigt: Array = tensor[..., [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]]
    return voigt


def from_voigt(voigt: Array) -> Array:
    """Take (…, 6) to the symmetric tensor (…, 3, 3)."""
    tensor: Array = voigt[..., [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]
    return tensor
