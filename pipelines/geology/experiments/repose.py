"""Heap of disks: the wall beside a deposit disappears, and what is left has an angle of repose.

On a smooth floor disks roll away from under the heap, whose slope then says little of them. On a rough one the heap
is what remains on a table whose lowest disks are glued to it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.planar.measures.surface import profile, slope
from mechanics.planar.scene import Wall
from mechanics.scene.loads.load import Loads
from pipelines.geology.experiments.deposition import Deposition
from pipelines.geology.experiments.experiment import Setup
from pipelines.geology.observe import Fields

_FLANK = (0.15, 0.75)  # part of the height of the heap between which its flank is straight [-]
_FLOOR = 20.0  # length of the floor over that of the deposit [-]


@dataclass(frozen=True)
class Repose(Deposition):
    """`[repose]`: a deposit between two walls, of which the right one is gone as the run begins."""

    rough: Annotated[
        bool,
        Setting("Its lowest disks are glued to a floor that ends with it; false: a smooth floor goes on."),
    ] = True

    def setup(self, step: float, duration: float) -> Setup:
        """Return the floor, the wall that stays, and the ground below a floor that ends."""
        end = self.length if self.rough else _FLOOR * self.length
        walls: tuple[Wall, ...] = (
            Wall("floor", (-0.1 * self.length, 0.0), (end, 0.0)),
            Wall("left", (0.0, -0.1 * self.height), (0.0, 2.0 * self.height)),
        )
        if self.rough:
            ground = Wall(
                "ground", (-_FLOOR * self.length, -self.height), (_FLOOR * self.length, -self.height)
            )
            walls = (*walls, ground)
        return Setup(walls, Loads(), rough=self.rough)

    def phases(self, duration: float) -> Mapping[str, tuple[float, float]]:
        """Return the one phase of the run."""
        return {"collapse": (0.0, duration)}

    def measures(
        self, start: Array, radius: Array, instants: Sequence[Fields], whole: Mapping[str, Array]
    ) -> Mapping[str, float]:
        """Return the slope of the flank, the run-out and the fastest disk at the end."""
        last = instants[-1]
        place = last.position[: len(start), :2]
        here = place[:, 1] > 0.0
        end = self.length if self.rough else float(place[:, 0].max())
        places = np.arange(0.0, end, radius.mean())
        height = profile(place[here], radius[here], places)
        part = height / np.nanmax(height)
        flank = np.where((part > _FLANK[0]) & (part < _FLANK[1]), height, np.nan)
        return {
            "angle of repose [°]": -float(np.degrees(slope(places, flank))),
            "run-out over length [-]": float((place[:, 0] + radius).max()) / self.length - 1.0,
            "fastest disk [m/s]": float(np.hypot(*last.velocity[: len(start), :2][here].T).max()),
        }
