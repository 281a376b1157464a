"""Reverse fault in the basement, whose propagation folds the cover (Renouf, Dubois & Alart 2006)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from mechanics.arrays import Array
from mechanics.planar.measures.surface import front, rise
from mechanics.planar.measures.trishear import Trishear, trishear_fit
from mechanics.planar.scene import Wall
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.stones.settings import Setting
from moma.errors import SceneError
from pipelines.geology.experiments.experiment import Setup
from pipelines.geology.observe import Fields

__all__ = ["Fault"]

_FIRST_PHASE = 0.25  # of the paper's run, 10 of 40 s [-]
_APICAL = "trishear: apical angle [°]"
_RATIO = "trishear: propagation to slip [-]"
_RISEN = 0.1  # rise of the surface over that of the basement, at the front of the fold [-]


@dataclass(frozen=True)
class Fault:
    """`[fault]`: the basement left of the fault rises along it, and with it the wall at the left.

    The paper's 15,000 disks of 0.13 to 0.26 m fill 150 × 15 m, not the 300 × 30 m that it states; its cell (85, 7.5, 6)
    lies in the middle of that height, 10 m ahead of a fault in the middle of that length.
    """

    length: Annotated[float, Setting("Length of the cover.", "m", above=0)]
    thickness: Annotated[float, Setting("Thickness of the cover.", "m", above=0)]
    tip: Annotated[float, Setting("Place of the fault's tip at the start, along the base.", "m", above=0)]
    dip: Annotated[float, Setting("Angle of the fault from the base.", "°", above=0, below=90)]
    speed: Annotated[float, Setting("Of the moving basement, along the fault.", "m/s", above=0)]

    def __post_init__(self) -> None:
        if self.tip >= self.length:
            raise SceneError(
                f"tip = {self.tip:g} is not within the length of {self.length:g} m", where="fault"
            )

    @property
    def highest(self) -> float:
        """Height of the sample [m]."""
        return self.thickness

    def top(self, x: Array) -> Array:
        """Return the height of the sample at places along x [m]."""
        return np.full(len(x), self.thickness)

    def setup(self, step: float, duration: float) -> Setup:
        """Return the walls, and the motion of the basement left of the fault."""
        angle = np.radians(self.dip)
        along = np.array([np.cos(angle), np.sin(angle)])
        slip = self.speed * duration
        if slip * along[0] > 0.9 * (self.length - self.tip):
            raise SceneError(
                f"the tip goes {slip * along[0]:g} m of the {self.length - self.tip:g} m ahead of it",
                where="fault",
                remedy="take fewer steps",
            )
        roof = 4.0 * self.thickness + slip
        tip = np.array([self.tip, 0.0])
        root = tip - 1.1 * slip * along
        walls = (
            Wall("footwall", (self.tip, 0.0), (1.1 * self.length, 0.0)),
            Wall("hanging wall", (-0.1 * self.length - slip, 0.0), (self.tip, 0.0)),
            Wall("fault", (float(root[0]), float(root[1])), (self.tip, 0.0)),
            Wall("left", (0.0, -0.1 * self.thickness), (0.0, roof)),
            Wall("right", (self.length, -0.1 * self.thickness), (self.length, roof)),
        )
        velocity = self.speed * along
        rise = ImposedMotion(
            frozenset({"hanging wall", "fault", "left"}),
            History.constant([float(velocity[0]), float(velocity[1]), 0.0]),
        )
        return Setup(walls, Loads(motions=(rise,)))

    def phases(self, duration: float) -> Mapping[str, tuple[float, float]]:
        """Return the paper's two phases, as parts of the run [s]."""
        middle = _FIRST_PHASE * duration
        return {"first": (0.0, middle), "second": (middle, duration)}

    def trishear(self, measures: Mapping[str, float]) -> Trishear:
        """Return the trishear that these measures tell of."""
        half = 0.5 * float(np.radians(measures[_APICAL]))
        return Trishear((self.tip, 0.0), float(np.radians(self.dip)), half, measures[_RATIO])

    def measures(
        self, start: Array, radius: Array, instants: Sequence[Fields], whole: Mapping[str, Array]
    ) -> Mapping[str, float]:
        """Return the front of the fold, and the trishear that comes nearest to the motion of the disks, and how near.

        The front is the farthest place whose surface has risen by a tenth of the rise of the basement, ahead of where
        the fault's tip was at the start.
        """
        last = instants[-1]
        slip = self.speed * last.time
        fit = trishear_fit(
            start, last.position[: len(start), :2], (self.tip, 0.0), float(np.radians(self.dip)), slip
        )
        # parts of two disks
        where, risen = rise(start, last.position[: len(start), :2], radius, self.length, 4.0 * radius.mean())
        ahead = front(where, risen, _RISEN * slip * np.sin(np.radians(self.dip))) - self.tip
        return {
            "slip [m]": slip,
            "front ahead of the tip [m]": ahead,
            _APICAL: 2.0 * float(np.degrees(fit.model.half_angle)),
            _RATIO: fit.model.ratio,
            "trishear: residual over slip [-]": fit.relative,
            "trishear: share of the motion explained [-]": fit.explained,
        }
