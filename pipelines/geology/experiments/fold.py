"""Forced fold: a wall pushes a basin that thins away from it (Renouf, Dubois & Alart 2006)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.planar.measures.surface import front, rise
from mechanics.planar.scene import Wall
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from pipelines.geology.experiments.experiment import Setup
from pipelines.geology.observe import Fields
from survey.conventions import TENTH

_RISEN = TENTH  # rise of the surface over its largest rise, at the front [-]
_AVERAGING_LENGTH = 20.0  # lengths over which it is averaged, over the mean radius [-]


@dataclass(frozen=True)
class Fold:
    """`[fold]`: the sample is `deep` high beside the wall, slopes from `deep_length` to `slope_end`, and then is flat.

    The paper gives L, D, d, H and h without a drawing of the start; with this reading the area holds its 43,000 disks
    at a share of 0.82, and all of its cells lie within the sample.
    """

    length: Annotated[float, Setting("Length L of the sample.", "m", above=0)]
    deep: Annotated[float, Setting("Height H beside the wall that pushes.", "m", above=0)]
    thickness: Annotated[float, Setting("Height h away from it.", "m", above=0)]
    deep_length: Annotated[float, Setting("Length d of the high part.", "m", above=0)]
    slope_end: Annotated[float, Setting("Distance D at which the slope ends.", "m", above=0)]
    speed: Annotated[float, Setting("Of the wall at the left.", "m/s", above=0)]

    def __post_init__(self) -> None:
        if not self.deep_length < self.slope_end < self.length:
            raise SceneError(
                f"deep_length = {self.deep_length:g}, slope_end = {self.slope_end:g}, length = {self.length:g}",
                where="fold",
                remedy="give deep_length < slope_end < length",
            )

    @property
    def highest(self) -> float:
        """Largest height of the sample [m]."""
        return max(self.deep, self.thickness)

    def top(self, x: Array) -> Array:
        """Return the height of the sample at places along x [m]."""
        return np.interp(x, [self.deep_length, self.slope_end], [self.deep, self.thickness])

    def setup(self, step: float, duration: float) -> Setup:
        """Return the walls, and the motion of the left one; it is there from the first step on."""
        if self.speed * duration > 0.9 * self.length:
            raise SceneError(
                f"the wall goes {self.speed * duration:g} m, the sample is {self.length:g} m long",
                where="fold",
                remedy="take fewer steps",
            )
        roof = 4.0 * self.highest
        walls = (
            Wall("floor", (-0.1 * self.length, 0.0), (1.1 * self.length, 0.0)),
            Wall("left", (0.0, -0.1 * self.thickness), (0.0, roof)),
            Wall("right", (self.length, -0.1 * self.thickness), (self.length, roof)),
        )
        push = ImposedMotion(frozenset({"left"}), History.constant([self.speed, 0.0, 0.0]))
        return Setup(walls, Loads(motions=(push,)))

    def phases(self, duration: float) -> Mapping[str, tuple[float, float]]:
        """Return the one phase of the run."""
        return {"shortening": (0.0, duration)}

    def observables(self, start: Array, now: Array, radius: Array, time: float) -> Mapping[str, float]:
        """Return the places of the wall at the rear and of the front, and the largest height.

        The front is the farthest place at which the surface has risen by more than a tenth of its largest rise, and by
        two mean radii, over lengths of ten disks.
        """
        mean = float(radius.mean())
        where, risen = rise(start, now, radius, self.length, _AVERAGING_LENGTH * mean)
        least = max(_RISEN * float(risen.max()), 2.0 * mean)
        return {
            "rear [m]": self.speed * time,
            "front [m]": front(where, risen, least) if risen.max() > least else 0.0,
            "highest [m]": float((now[:, 1] + radius).max()),
        }

    def measures(
        self, start: Array, radius: Array, instants: Sequence[Fields], whole: Mapping[str, Array]
    ) -> Mapping[str, float]:
        """Return how far the wall went, how high the sample rose, and how far its front has come."""
        last = instants[-1]
        seen = self.observables(start, last.position[: len(start), :2], radius, last.time)
        return {
            "shortening [m]": seen["rear [m]"],
            **{name: seen[name] for name in ("highest [m]", "front [m]")},
        }
