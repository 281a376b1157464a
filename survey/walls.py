"""The mean plane of a wall, and the sides of its stones as lines in that plane."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from moma.errors import GeometryError
from survey.blocky import BlockyStone

__all__ = ["Sides", "WallPlane", "sides_of", "upright_frame", "wall_plane"]

Array = NDArray[np.float64]

_STEEPEST = np.cos(np.radians(30.0))  # a face turned farther from the wall belongs to another wall


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


@dataclass(frozen=True)
class Sides:
    """The four sides of all stones, side k of stone i from corner k to the next.

    Attributes
    ----------
    start, stop : (n, 4, 2) ends in the wall plane [m]
    outward : (n, 4, 2) unit normals away from the stone [-]
    sound : (n, 4, 2) whether start and stop were measured on the face
    """

    start: Array
    stop: Array
    outward: Array
    sound: NDArray[np.bool_]


def wall_plane(stones: Sequence[BlockyStone]) -> WallPlane:
    """Find the mean plane of a wall from the planes of its faces, weighted by area.

    Raises
    ------
    GeometryError
        naming a stone whose face is turned more than 30° from the mean
    """
    areas = np.array([_area(stone.corners) for stone in stones])
    normals = np.array([stone.face.fit.normal for stone in stones])
    mean = areas @ normals
    normal = mean / max(float(np.linalg.norm(mean)), 1e-300)
    turned = normals @ normal
    if turned.min() < _STEEPEST:
        odd = stones[int(turned.argmin())]
        angle = float(np.degrees(np.arccos(np.clip(turned.min(), -1.0, 1.0))))
        raise GeometryError(
            f"its face is turned {angle:.0f}° from the wall's mean plane",
            where=f"stone {odd.code}",
            remedy="close the joints of one wall at a time",
        )
    return upright_frame(normal, np.concatenate([stone.corners for stone in stones]).mean(axis=0))


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


def sides_of(stones: Sequence[BlockyStone], wall: WallPlane) -> Sides:
    """Project the stones' quadrilaterals on the wall plane."""
    start = wall.flatten(np.array([stone.corners for stone in stones]))
    stop = np.roll(start, -1, axis=1)
    run = stop - start
    run /= np.linalg.norm(run, axis=2)[:, :, None]
    sound = np.array([stone.sound[:4] for stone in stones])
    return Sides(
        start=start,
        stop=stop,
        outward=np.stack([run[:, :, 1], -run[:, :, 0]], axis=2),
        sound=np.stack([sound, np.roll(sound, -1, axis=1)], axis=2),
    )


def _area(corners: Array) -> float:
    return 0.5 * float(np.linalg.norm(np.cross(corners[2] - corners[0], corners[3] - corners[1])))
