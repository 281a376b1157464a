"""Rotations of a camera: by ω, φ, κ, and by a small rotation vector.

The columns of R are the camera's axes, R = R₁(ω) R₂(φ) R₃(κ), so that q = Rᵀ(X - X₀). A correction δ is a rotation
about the camera's own axes, R exp([δ]×).
"""

import numpy as np

from survey.arrays import Array


def from_angles(omega: float, phi: float, kappa: float) -> Array:
    """Return R of three angles [rad].

    >>> from_angles(0.0, 0.0, np.pi / 2).round(9)[:, 0].tolist()
    [0.0, 1.0, 0.0]
    """
    (co, cp, ck), (so, sp, sk) = np.cos([omega, phi, kappa]), np.sin([omega, phi, kappa])
    return np.array(
        [
            [cp * ck, -cp * sk, sp],
            [co * sk + so * sp * ck, co * ck - so * sp * sk, -so * cp],
            [so * sk - co * sp * ck, so * ck + co * sp * sk, co * cp],
        ]
    )


def angles(rotation: Array) -> Array:
    """Return ω, φ, κ [rad] of a rotation, φ between -90° and 90°."""
    omega = np.arctan2(-rotation[1, 2], rotation[2, 2])
    phi = np.arcsin(np.clip(rotation[0, 2], -1.0, 1.0))
    kappa = np.arctan2(-rotation[0, 1], rotation[0, 0])
    return np.array([omega, phi, kappa])


def angle_slopes(rotation: Array) -> Array:
    """Return the derivative of ω, φ, κ by the rotation vector δ, (3, 3)."""
    _, phi, kappa = angles(rotation)
    cp, sp, ck, sk = np.cos(phi), np.sin(phi), np.cos(kappa), np.sin(kappa)
    # δ of a change of the angles: columns are the axes of the three rotations, in the camera's axes
    axes = np.array([[cp * ck, sk, 0.0], [-cp * sk, ck, 0.0], [sp, 0.0, 1.0]])
    return np.linalg.inv(axes)


def turned(rotations: Array, by: Array) -> Array:
    """Turn cameras by rotation vectors about their own axes.

    Parameters
    ----------
    rotations : (n, 3, 3)
    by : (n, 3) [rad]

    Returns
    -------
    (n, 3, 3) R exp([δ]×), by Rodrigues' formula
    """
    angle = np.linalg.norm(by, axis=1)
    cross = np.zeros((len(by), 3, 3))
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -by[:, 2], by[:, 1], -by[:, 0]
    cross -= cross.transpose(0, 2, 1)
    # sin(a)/a and (1 - cos(a))/a² by sinc, which is sound at zero
    first = np.sinc(angle / np.pi)
    second = 0.5 * np.sinc(0.5 * angle / np.pi) ** 2
    turn: Array = np.eye(3) + first[:, None, None] * cross + second[:, None, None] * (cross @ cross)
    out: Array = rotations @ turn
    return out
