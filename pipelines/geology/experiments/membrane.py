"""Membrane around a sample between two level platens: a pressure on the disks at its sides."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.planar.measures.surface import sides_of


@dataclass(frozen=True)
class Membrane:
    """Pressure on the disks at the two sides of a sample, normal to the lines that join their centres.

    Both disks bear half of the force on the line between them: p times half the distances to the neighbours. At its
    ends a membrane goes on straight to the platen. The disks are found from the places of all at each step, so nothing
    is carried from one step to the next.

    Attributes
    ----------
    stones : codes of all disks
    radius : (nd,) in the order of the scene [m]
    pressure : p [Pa]
    thickness : of the slice [m]
    """

    stones: frozenset[str]
    radius: Array
    pressure: float
    thickness: float = 1.0
    course = None

    @property
    def until(self) -> float:
        """Time from which the pressure is constant [s]."""
        return 0.0

    def __call__(self, time: float, centre: Array, rotation: Array) -> tuple[Array, Array]:
        """Return the forces (nd, 3) on the disks [N], and no moments (nd, 3)."""
        place, count = centre[:, :2], len(centre)
        share = 0.5 * self.pressure * self.thickness
        disks, pushes = [], []
        for inward, side in zip((-1.0, 1.0), sides_of(place, self.radius), strict=True):
            line, ends = np.diff(place[side], axis=0), side[[0, -1]]
            push = share * np.column_stack([-line[:, 1], line[:, 0]])
            straight = np.column_stack([2.0 * share * inward * self.radius[ends], np.zeros(2)])
            disks += [side[:-1], side[1:], ends]
            pushes += [push, push, straight]
        body, given = np.concatenate(disks), np.vstack(pushes)
        force = np.zeros(centre.shape)
        for axis in range(2):
            force[:, axis] = np.bincount(body, given[:, axis], count)
        return force, np.zeros(centre.shape)
