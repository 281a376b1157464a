"""Live loads: what is multiplied by λ until the stones move."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array, Ints
from mechanics.limit.assembly import RigidAssembly
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Scene


class LiveLoad(Protocol):
    """A load of which λ times is added to the dead load."""

    def __call__(self, on: RigidAssembly) -> Array:
        """Return force and moment (6 n,) about their centres of all free stones at λ = 1 [N, N m]."""

    def applied(self, on: RigidAssembly, multiplier: float) -> Scene:
        """Return the assembly's scene with λ times the load, which acts from the start and stays."""

    def __str__(self) -> str:
        """Return a short name with what λ = 1 means."""


def _unit(direction: tuple[float, float, float], what: str) -> Array:
    vector = np.asarray(direction, dtype=float)
    length = float(np.linalg.norm(vector))
    if vector.shape != (3,) or not np.isfinite(length) or length == 0:
        raise SceneError(
            f"direction = {list(direction)}", where=what, remedy="give three numbers, not all zero"
        )
    return np.asarray(vector / length)


@dataclass(frozen=True)
class Acceleration:
    """Force on each stone along a direction, λ times its weight: an earthquake's push, or a table tilted by atan λ.

    Downwards on some stones, it is more weight of these.

    Attributes
    ----------
    direction : (3,) of any length
    stones : codes of those on which it acts; none: on all
    """

    direction: tuple[float, float, float]
    stones: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        _unit(self.direction, "acceleration")

    def __call__(self, on: RigidAssembly) -> Array:
        """Return the load (6 n,) at λ = 1 [N, N m]."""
        size = float(np.linalg.norm(on.model.gravity(0.0)))
        if size == 0:
            raise SceneError(
                "a share of the weight where nothing has weight",
                where=str(self),
                remedy="give the scene gravity",
            )
        load = np.zeros((len(on.model.mass), 6))
        load[:, :3] = on.model.mass[:, None] * size * _unit(self.direction, "acceleration")
        if self.stones:
            others = np.ones(len(load), dtype=bool)
            others[_free(on, self.stones, str(self))] = False
            load[others] = 0.0
        return load[on.free].ravel()

    def applied(self, on: RigidAssembly, multiplier: float) -> Scene:
        """Return the scene with λ times the load: as a part of gravity where it acts on all stones."""
        if self.stones:
            return _with_forces(on, multiplier * self(on))
        push = multiplier * float(np.linalg.norm(on.model.gravity(0.0))) * _unit(self.direction, "")
        x, y, z = (np.asarray(on.model.scene.gravity) + push).tolist()
        return replace(on.model.scene, gravity=(x, y, z))

    def __str__(self) -> str:
        x, y, z = _unit(self.direction, "acceleration")
        some = f" of {', '.join(sorted(self.stones))}" if self.stones else ""
        return f"acceleration{some} along ({x:.3g}, {y:.3g}, {z:.3g}), in units of gravity"


@dataclass(frozen=True)
class SpreadForce:
    """Force on several stones together, spread over them as their weight is.

    Attributes
    ----------
    stones : their codes
    force : (3,) of all at λ = 1 [N]
    """

    stones: frozenset[str]
    force: tuple[float, float, float]

    def __call__(self, on: RigidAssembly) -> Array:
        """Return the load (6 n,) at λ = 1 [N, N m].

        Raises
        ------
        SceneError : there is no such stone, or it is fixed
        """
        _unit(self.force, str(self))
        bodies = _free(on, self.stones, str(self))
        load = np.zeros((len(on.model.mass), 6))
        load[bodies, :3] = on.model.mass[bodies, None] / on.model.mass[bodies].sum() * np.asarray(self.force)
        return load[on.free].ravel()

    def applied(self, on: RigidAssembly, multiplier: float) -> Scene:
        """Return the scene with λ times the load."""
        return _with_forces(on, multiplier * self(on))

    def __str__(self) -> str:
        return f"force on {', '.join(sorted(self.stones))}, in units of {np.linalg.norm(self.force):g} N"


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

    def __call__(self, on: RigidAssembly) -> Array:
        """Return the load (6 n,) at λ = 1 [N, N m].

        Raises
        ------
        SceneError : there is no such stone, or it is fixed
        """
        where = f"force on {self.stone}"
        body = int(_free(on, (self.stone,), where)[0])
        _unit(self.force, where)
        load, row = np.zeros((len(on.free), 6)), int(np.searchsorted(on.free, body))
        load[row, :3] = self.force
        if self.point is not None:
            load[row, 3:] = np.cross(np.asarray(self.point) - on.state.centre[body], self.force)
        return load.ravel()

    def applied(self, on: RigidAssembly, multiplier: float) -> Scene:
        """Return the scene with λ times the load."""
        return _with_forces(on, multiplier * self(on))

    def __str__(self) -> str:
        return f"force on {self.stone}, in units of {np.linalg.norm(self.force):g} N"


def _free(on: RigidAssembly, codes: Collection[str], where: str) -> Ints:
    """Return the bodies with these codes, all of which may move.

    Raises
    ------
    SceneError : there is no such stone, or it is fixed
    """
    bodies = on.rows(sorted(codes), where)
    for body in bodies[on.model.fixed[bodies]]:
        raise SceneError(
            f"{on.model.scene.blocks[body].code} is fixed", where=where, remedy="give stones that may move"
        )
    return bodies


def levers(load: Array) -> tuple[Ints, Array, Array]:
    """Return the rows (k,) of a load (n, 6) in which there is a force, it (k, 3), and where it has its moment (k, 3).

    That is the nearest place to the centre of mass; what of the moment is along the force is left out.
    """
    pushed = np.flatnonzero(load[:, :3].any(axis=1))
    force, moment = load[pushed, :3], load[pushed, 3:]
    return pushed, force, np.cross(force, moment) / np.einsum("ni,ni->n", force, force)[:, None]


def _with_forces(on: RigidAssembly, load: Array) -> Scene:
    """Return the scene with forces on its stones that are a load (6 n,), each at a place of its stone."""
    scene, forces = on.model.scene, list[StoneForce]()
    for row, force, (x, y, z) in zip(*levers(load.reshape(-1, 6)), strict=True):
        stone = frozenset({scene.blocks[on.free[row]].code})
        forces.append(StoneForce(stone, History.constant(force), (float(x), float(y), float(z))))
    loads = replace(scene.loads, forces=(*scene.loads.forces, *forces))
    return replace(scene, loads=loads)
