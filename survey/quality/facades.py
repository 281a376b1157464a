"""Facades: stones that face one way, and the elevation in which they are drawn and measured."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array, Bools
from survey.conventions import MAX_ITERATIONS, ONE_WAY

WIDEST = math.degrees(ONE_WAY)
"""Largest angle of a face from the mean direction of its facade [degrees]."""

LEVEL = 45.0
"""Inclination above which a face belongs to no facade: a floor, a soffit, a coping [degrees]."""


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
        """Project points (…, 3) orthogonally onto the wall plane, (…, 2)."""
        flat: Array = (points - self.origin) @ self.axes[:2].T
        return flat


@dataclass(frozen=True)
class Facade:
    """Stones that face one way.

    A round tower falls into facades of up to 60° each; distances along them are measured on the mean plane of
    each, which on an arc of ±30° are 5 % shorter than along the arc.

    Attributes
    ----------
    name : "facade 1" is the largest; "faces up" and "faces down" are the level ones
    members : (m,) indices of its stones, in the order given
    frame : mean plane: along the facade (level, to the right of the viewer), up, outward
    azimuth : direction that it faces, clockwise from the y axis of the survey's frame [degrees]; None if level
    area : of its faces together [m²]
    """

    name: str
    members: NDArray[np.intp]
    frame: WallPlane
    azimuth: float | None
    area: float


class Faced(Protocol):
    """Anything with a face, such as a stone."""

    @property
    def normal(self) -> Array:
        """Unit outward normal (3,) [-]."""

    @property
    def area(self) -> float:
        """Area of the face [m²]."""

    @property
    def outline(self) -> Array:
        """Outline of the face (nv, 3) [m]."""


def facades_of(stones: Sequence[Faced]) -> tuple[Facade, ...]:
    """Group stones by the direction that they face; see `find_facades`."""
    return find_facades(
        np.array([stone.normal for stone in stones]).reshape(-1, 3),
        np.array([stone.area for stone in stones]),
        np.array([stone.outline.mean(axis=0) for stone in stones]).reshape(-1, 3),
    )


def find_facades(normals: Array, areas: Array, centroids: Array) -> tuple[Facade, ...]:
    """Group faces by their direction.

    The direction of the largest total area makes the first facade: all faces within 30° of its area-weighted
    mean direction, in plan. The remaining faces make the next, and so on. Level faces stay apart.

    Parameters
    ----------
    normals : (n, 3) unit outward normals [-]
    areas : (n,) of the faces [m²]
    centroids : (n, 3) of the faces [m]

    Returns
    -------
    Facades, largest first, level ones last; every face belongs to one
    """
    if len(normals) == 0:
        return ()
    steep = np.degrees(np.arcsin(np.clip(normals[:, 2], -1.0, 1.0)))
    standing = np.flatnonzero(np.abs(steep) <= LEVEL)
    groups = sorted(_turns(normals, areas, standing), key=lambda rows: -float(areas[rows].sum()))
    facades = [
        _facade(f"facade {k}", rows, normals, areas, centroids) for k, rows in enumerate(groups, start=1)
    ]
    for name, rows in (
        ("faces up", np.flatnonzero(steep > LEVEL)),
        ("faces down", np.flatnonzero(steep < -LEVEL)),
    ):
        if len(rows):
            facades.append(_facade(name, rows, normals, areas, centroids))
    return tuple(facades)


def _turns(normals: Array, areas: Array, standing: NDArray[np.intp]) -> Iterable[NDArray[np.intp]]:
    """Split upright faces by their direction in plan."""
    level = normals[:, :2] / np.maximum(np.linalg.norm(normals[:, :2], axis=1), 1e-300)[:, None]
    left = standing
    while len(left):
        mine = _gather(level[left], areas[left])
        yield left[mine]
        left = left[~mine]


def _gather(level: Array, areas: Array) -> Bools:
    """Return the plan directions (n, 2) that belong to the facade of the largest area."""
    mean, mine = _peak(level, areas), np.ones(len(level), dtype=bool)
    for count in range(MAX_ITERATIONS):
        within = level @ mean >= np.cos(np.radians(WIDEST))
        if count > MAX_ITERATIONS // 2:
            within &= mine  # two faces that keep excluding each other: drop both
        if not within.any():
            break
        mean = areas[within] @ level[within]
        mean /= max(float(np.linalg.norm(mean)), 1e-300)
        if (within == mine).all():
            break
        mine = within
    if not mine.any() or mine.all():
        mine = level @ mean >= np.cos(np.radians(WIDEST))
    if not mine.any():
        mine[int(np.argmax(areas))] = True
    return mine


def _peak(level: Array, areas: Array) -> Array:
    """Return the direction with the most area about it: a smoothed histogram in steps of a degree."""
    angles = np.degrees(np.arctan2(level[:, 1], level[:, 0])) % 360.0
    mass = np.bincount(angles.astype(np.int64) % 360, weights=areas, minlength=360)
    offsets = np.arange(-180, 180)
    window = np.where(np.abs(offsets) <= WIDEST, np.cos(np.radians(offsets)), 0.0)
    around = np.fft.ifft(np.fft.fft(mass) * np.fft.fft(np.roll(window, -180))).real
    best = np.radians(int(np.argmax(around)) + 0.5)
    return np.array([np.cos(best), np.sin(best)])


def _facade(name: str, rows: NDArray[np.intp], normals: Array, areas: Array, centroids: Array) -> Facade:
    weights = areas[rows]
    mean = weights @ normals[rows]
    normal = mean / max(float(np.linalg.norm(mean)), 1e-300)
    first = centroids[rows[0]]  # relative to a place of the facade: no digits are lost 10⁶ m from the origin
    origin = first + weights @ (centroids[rows] - first) / weights.sum()
    standing = name.startswith("facade")
    azimuth = float(np.degrees(np.arctan2(normal[0], normal[1])) % 360.0) if standing else None
    return Facade(name, rows, upright_frame(normal, origin), azimuth, float(weights.sum()))


def upright_frame(normal: Array, origin: Array) -> WallPlane:
    """Return the frame of a viewer before a wall: along it to the right, up, towards the viewer.

    Parameters
    ----------
    normal : (3,) unit outward normal of the wall [-]
    origin : (3,) [m]
    """
    # up the wall if it stands; for a floor or a vault's soffit any direction in the plane serves
    upward = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    along = np.cross(upward, normal)
    along /= np.linalg.norm(along)
    return WallPlane(origin, np.array([along, np.cross(normal, along), normal]))
