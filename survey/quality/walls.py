"""The frame in which one stands before a wall."""

from dataclasses import dataclass

import numpy as np

from survey.arrays import Array

__all__ = ["WallPlane", "upright_frame"]


@dataclass(frozen=True)
class WallPlane:
    """Frame of the wall's mean plane.

    Attributes
    ----------
    origin : (3,) mean of the stones' corners [m]
    axes : (3, 3) rows: along the wall (level, if the wall stands), up, outward normal [-]
    """

    origin: Array
    axes: Array

    def flatten(self, points: Array) -> Array:
        """Project points (…, 3) square onto the wall plane, (…, 2)."""
        flat: Array = (points - self.origin) @ self.axes[:2].T
        return flat


def upright_frame(normal: Array, origin: Array) -> WallPlane:
    """The frame in which one stands before a wall: along it to the right, up, towards the viewer.

    Parameters
    ----------
    normal : (3,) unit outward normal of the wall [-]
    origin : (3,) [m]
    """
    # up the wall where it stands; for a floor or a vault's soffit any direction in the plane serves
    upward = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    along = np.cross(upward, normal)
    along /= np.linalg.norm(along)
    return WallPlane(origin, np.array([along, np.cross(normal, along), normal]))
