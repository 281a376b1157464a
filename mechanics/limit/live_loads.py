"""Live loads: what is multiplied by λ until the stones move."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mechanics.arrays import Array
from mechanics.limit.assembly import Assembly
from moma.errors import SceneError

__all__ = ["Acceleration", "LiveLoad", "PointForce"]


class LiveLoad(Protocol):
    """A load of which λ times is added to the dead load."""

    def __call__(self, on: Assembly) -> Array:
        """Return force and moment (6 n,) about their centres of all free stones at λ = 1 [N, N m]."""

    def __str__(self) -> str:
        """Return a short name with what λ = 1 means."""


def _unit(direction: tuple[float, float, float], what: str) -> Array:
    given = np.asarray(direction, dtype=float)
    length = float(np.linalg.norm(given))
    if given.shape != (3,) or not np.isfinite(length) or length == 0:
        raise SceneError(
            f"direction = {list(direction)}", where=what, remedy="give three numbers, not all zero"
        )
    return np.asarray(given / length)


@dataclass(frozen=True)
class Acceleration:
    """Force on each stone along a direction, λ times its weight: an earthquake's push, or a table tilted by atan λ.

    Attributes
    ----------
    direction : (3,) of any length
    """

    direction: tuple[float, float, float]

    def __post_init__(self) -> None:
        _unit(self.direction, "acceleration")

    def __call__(self, on: Assembly) -> Array:
        """Return the load (6 n,) at λ = 1 [N, N m]."""
        size = float(np.linalg.norm(on.model.gravity(0.0)))
        if size == 0:
            raise SceneError(
                "a share of the weight where nothing has weight",
                where=str(self),
                remedy="give the scene gravity",
            )
        load = np.zeros((len(on.free), 6))
        load[:, :3] = on.model.mass[on.free, None] * size * _unit(self.direction, "acceleration")
        return load.ravel()

    def __str__(self) -> str:
        x, y, z = _unit(self.direction, "acceleration")
        return f"acceleration along ({x:.3g}, {y:.3g}, {z:.3g}), in units of gravity"


@dataclass(frozen=True)
class PointForce:
    """Force on one stone, at a place that moves with it.

    Attributes
    ----------
    stone : its code
    force : (3,) at λ = 1 [N]
    point : (3,) where it acts [m]; None: at the stone's centre of mass
    """

    stone: str
    force: tuple[float, float, float]
    point: tuple[float, float, float] | None = None

    def __call__(self, on: Assembly) -> Array:
        """Return the load (6 n,) at λ = 1 [N, N m].

        Raises
        ------
        SceneError : there is no such stone, or it is fixed
        """
        codes = [block.code for block in on.model.scene.blocks]
        where = f"force on {self.stone}"
        if self.stone not in codes:
            raise SceneError("no such stone", where=where, remedy="give the code of a stone of the scene")
        body = codes.index(self.stone)
        if on.model.fixed[body]:
            raise SceneError("the stone is fixed", where=where, remedy="give a stone that may move")
        _unit(self.force, where)
        load, row = np.zeros((len(on.free), 6)), int(np.searchsorted(on.free, body))
        load[row, :3] = self.force
        if self.point is not None:
            load[row, 3:] = np.cross(np.asarray(self.point) - on.state.centre[body], self.force)
        return load.ravel()

    def __str__(self) -> str:
        return f"force on {self.stone}, in units of {np.linalg.norm(self.force):g} N"
