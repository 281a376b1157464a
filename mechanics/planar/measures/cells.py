"""Cells: groups of disks that are chosen by place at the start, and followed through the motion."""

from dataclasses import dataclass

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array, Ints

_MIN_CELL_DISKS = 5  # disks of a cell: fewer have no mean deformation


@dataclass(frozen=True)
class Cell:
    """A circle at the start; its disks stay its disks, as W(x, y, r) of Renouf, Dubois & Alart (2006).

    Attributes
    ----------
    name : its name, unique in a run
    centre : (x, y) [m]
    radius : [m]
    """

    name: str
    centre: tuple[float, float]
    radius: float

    def __post_init__(self) -> None:
        where = f"cell {self.name!r}"
        if not self.radius > 0:
            raise SceneError(f"radius = {self.radius!r}", where=where, remedy="give metres greater than 0")
        if not np.isfinite([*self.centre, self.radius]).all():
            raise SceneError("has a value that is not finite", where=where, remedy="give numbers")


@dataclass(frozen=True)
class Shape:
    """A cell's shape now over that at the start.

    Attributes
    ----------
    extent : λx and λy, max - min of x and of y of its disks' centres over that at the start (Renouf, Dubois & Alart
        2006, eq. 11) [-]
    spread : standard deviations of x and y of its disks over those at the start [-]
    gradient : F (2, 2), the linear map that comes nearest to the motion of its disks [-]
    turned : angle of the rotation in F = R U, counter-clockwise [rad]
    volume : det F - 1 [-]
    shear : ln of the ratio of the principal stretches of F [-]
    centre : (2,) mean place [m]
    """

    extent: Array
    spread: Array
    gradient: Array
    turned: float
    volume: float
    shear: float
    centre: Array


def members(cell: Cell, centre: Array) -> Ints:
    """Return the disks of a cell, by their centres (nd, 2) at the start.

    Raises
    ------
    SceneError : the cell has too few disks, as one outside the sample has
    """
    away = np.linalg.norm(centre - np.array(cell.centre), axis=1)
    disks = np.flatnonzero(away <= cell.radius)
    if len(disks) < _MIN_CELL_DISKS:
        raise SceneError(
            f"holds {len(disks)} disks",
            where=f"cell {cell.name!r}",
            remedy=f"place it within the sample, with a radius that holds {_MIN_CELL_DISKS} or more",
        )
    return disks


def layer_members(layer: Ints) -> dict[str, Ints]:
    """Return the disks of each layer by its name, from below; a layer with too few disks is left out.

    Parameters
    ----------
    layer : (nd,) number of the layer of each disk, 0 at the base

    >>> {name: len(disks) for name, disks in layer_members(np.array([0] * 20 + [1] * 30 + [2])).items()}
    {'layer 1': 20, 'layer 2': 30}
    """
    count = np.bincount(layer)
    return {
        f"layer {number + 1}": np.flatnonzero(layer == number)
        for number in np.flatnonzero(count >= _MIN_CELL_DISKS)
    }


def shape_of(start: Array, now: Array) -> Shape:
    """Compare a cell's places (n, 2) now with those at the start.

    λ is not objective: a rigid turn by 45° makes the extents of a square √2 times as large, and it follows the two
    outermost disks alone. `gradient` is objective, and made of all disks.

    Examples
    --------
    Simple shear by 1 keeps the area and the height. It doubles the width of a square, and spreads its points by √2:

    >>> square = np.array([(x, y) for x in range(3) for y in range(3)], dtype=float)
    >>> sheared = shape_of(square, square @ np.array([[1.0, 0.0], [1.0, 1.0]]))
    >>> sheared.extent.round(6).tolist(), sheared.spread.round(6).tolist(), round(abs(sheared.volume), 6)
    ([2.0, 1.0], [1.414214, 1.0], 0.0)
    """
    before, after = start - start.mean(axis=0), now - now.mean(axis=0)
    gradient = np.linalg.lstsq(before, after, rcond=None)[0].T
    (left, stretch, right) = np.linalg.svd(gradient)
    rotation = left @ right
    return Shape(
        extent=np.ptp(now, axis=0) / np.ptp(start, axis=0),
        spread=after.std(axis=0) / before.std(axis=0),
        gradient=gradient,
        turned=float(np.arctan2(rotation[1, 0], rotation[0, 0])),
        volume=float(np.linalg.det(gradient)) - 1.0,
        shear=float(np.log(stretch[0] / stretch[1])) if stretch[1] > 0 else np.inf,
        centre=now.mean(axis=0),
    )
