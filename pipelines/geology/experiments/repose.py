"""Heap of disks: the wall beside a deposit disappears, and what is left has an angle of repose."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.planar.measures.surface import profile, slope
from mechanics.planar.scene import Wall
from mechanics.scene.loads.load import Loads
from pipelines.geology.experiments.deposition import Deposition
from pipelines.geology.experiments.experiment import Setup
from pipelines.geology.observe import Fields

__all__ = ["Repose"]

_FLANK = (0.15, 0.75)  # part of the height of the heap between which its flank is straight [-]
_FLOOR = 20.0  # length of the floor over that of the deposit [-]


@dataclass(frozen=True)
class Repose(Deposition):
    """`[repose]`: a deposit between two walls, of which the right one is gone as the run begins."""

    def setup(self, step: float, duration: float) -> Setup:
        """Return the floor and the wall that stays."""
        walls = (
            Wall("floor", (-0.1 * self.length, 0.0), (_FLOOR * self.length, 0.0)),
            Wall("left", (0.0, -0.1 * self.height), (0.0, 2.0 * self.height)),
        )
        return Setup(walls, Loads())

    def phases(self, duration: float) -> Mapping[str, tuple[float, float]]:
        """Return the one phase of the run."""
        return {"collapse": (0.0, duration)}

    def measures(
        self, start: Array, radius: Array, instants: Sequence[Fields], whole: Mapping[str, Array]
    ) -> Mapping[str, float]:
        """Return the slope of the flank, the run-out and the fastest disk at the end."""
        last = instants[-1]
        place = last.position[: len(start), :2]
        places = np.arange(0.0, float(place[:, 0].max()), radius.mean())
        height = profile(place, radius, places)
        part = height / np.nanmax(height)
        flank = np.where((part > _FLANK[0]) & (part < _FLANK[1]), height, np.nan)
        return {
            "angle of repose [°]": -float(np.degrees(slope(places, flank))),
            "run-out over length [-]": float((place[:, 0] + radius).max()) / self.length - 1.0,
            "fastest disk [m/s]": float(np.hypot(*last.velocity[: len(start), :2].T).max()),
        }
