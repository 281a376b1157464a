"""Deposition alone: a sample at rest in its box."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.planar.scene import Wall
from mechanics.scene.loads.load import Loads
from pipelines.geology.experiments.experiment import Setup
from pipelines.geology.observe import Fields


@dataclass(frozen=True)
class Deposition:
    """`[deposit]`: a level sample, which rests."""

    length: Annotated[float, Setting("Length of the sample.", "m", above=0)]
    height: Annotated[float, Setting("Height of the sample.", "m", above=0)]

    @property
    def highest(self) -> float:
        """Height of the sample [m]."""
        return self.height

    def top(self, x: Array) -> Array:
        """Return the height of the sample at places along x [m]."""
        return np.full(len(x), self.height)

    def setup(self, step: float, duration: float) -> Setup:
        """Return the box."""
        roof = 2.0 * self.height
        return Setup(
            (
                Wall("floor", (-0.1 * self.length, 0.0), (1.1 * self.length, 0.0)),
                Wall("left", (0.0, -0.1 * self.height), (0.0, roof)),
                Wall("right", (self.length, -0.1 * self.height), (self.length, roof)),
            ),
            Loads(),
        )

    def phases(self, duration: float) -> Mapping[str, tuple[float, float]]:
        """Return the one phase of the run."""
        return {"rest": (0.0, duration)}

    def measures(
        self, start: Array, radius: Array, instants: Sequence[Fields], whole: Mapping[str, Array]
    ) -> Mapping[str, float]:
        """Return nothing beyond the rows of the whole sample."""
        return {}
