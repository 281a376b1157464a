"""Wedge pushed by a wall over its base, as sandboxes are (Buiter et al. 2016)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.planar.measures.surface import profile
from mechanics.planar.measures.surface import slope as slope_of
from mechanics.planar.measures.thrusts import thrusts_of
from mechanics.planar.scene import Wall
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from pipelines.geology.experiments.experiment import Setup
from pipelines.geology.observe import Fields
from survey.conventions import MOST

_END = 0.15
_MIDDLE = (_END, 1.0 - _END)  # part of the wedge, along its base, over which its slope is measured [-]
_BASE, _WALL = 0, 1  # numbers of the base and of the wall that pushes, after the disks
_LATE = MOST  # of the run, whose means are those of the forces on wall and base [-]
_SLIDES = MOST  # speed over that of the wall, of disks that slide over the base [-]
_TOE = 2.0  # height of the surface over the mean radius, behind which the wedge ends [-]
_ALONE = 9  # places of a running mean of the height, one each mean radius
_RISEN = _TOE  # rise of the surface over the mean radius, at the front of what a push has built [-]
_ROOM = 1.5  # length of the base over that of the wedge and the push [-]


@dataclass(frozen=True)
class Wedge:
    """`[wedge]`: a surface that sinks away from the wall that pushes, with a level layer before it, or none."""

    height: Annotated[float, Setting("Height beside the wall.", "m", above=0)]
    slope: Annotated[float, Setting("Slope of the surface.", "°", at_least=0, below=90)]
    push: Annotated[float, Setting("Way of the wall.", "m", above=0)]
    layer: Annotated[float, Setting("Thickness of the layer before the wedge; 0: none.", "m", at_least=0)] = (
        0.0
    )
    layer_length: Annotated[float, Setting("Length of that layer.", "m", at_least=0)] = 0.0
    box: Annotated[
        bool, Setting("A wall that stays ends the layer, as in a sandbox; false: it ends freely.")
    ] = False

    def __post_init__(self) -> None:
        if self.layer >= self.height and self.slope > 0:
            raise SceneError(
                f"layer = {self.layer:g} m is not lower than the wedge, {self.height:g} m", where="wedge"
            )
        if self.slope == 0 and self.layer_length == 0:
            raise SceneError("slope = 0 needs a layer", where="wedge", remedy="give layer and layer_length")
        if self.box and self.push > 0.9 * self.length:
            raise SceneError(
                f"push = {self.push:g} m of {self.length:g} m between two walls",
                where="wedge",
                remedy="push less",
            )

    @property
    def _foot(self) -> float:
        """Length of the part with a slope [m]."""
        return (self.height - self.layer) / np.tan(np.radians(self.slope)) if self.slope else 0.0

    @property
    def length(self) -> float:
        """Length of the box in which the sample is deposited [m]."""
        return float(self._foot + self.layer_length)

    @property
    def highest(self) -> float:
        """Height beside the wall [m]."""
        return self.height

    def top(self, x: Array) -> Array:
        """Return the height of the sample at places along x [m]."""
        height: Array = np.maximum(self.height - np.tan(np.radians(self.slope)) * x, self.layer)
        return height

    def setup(self, step: float, duration: float) -> Setup:
        """Return the base and the wall, which goes its way within the run."""
        walls: tuple[Wall, ...] = (
            Wall("base", (-0.1 * self.length, 0.0), (_ROOM * (self.length + self.push), 0.0)),
            Wall("left", (0.0, -0.1 * self.height), (0.0, 3.0 * self.height)),
        )
        if self.box:
            walls = (
                *walls,
                Wall("right", (self.length, -0.1 * self.height), (self.length, 3.0 * self.height)),
            )
        speed = History.constant([self.push / duration, 0.0, 0.0])
        return Setup(walls, Loads(motions=(ImposedMotion(frozenset({"left"}), speed),)))

    def phases(self, duration: float) -> Mapping[str, tuple[float, float]]:
        """Return the one phase of the run."""
        return {"push": (0.0, duration)}

    def measures(
        self, start: Array, radius: Array, instants: Sequence[Fields], whole: Mapping[str, Array]
    ) -> Mapping[str, float]:
        """Return what sandboxes are compared by: slopes, thrusts, and the force on the wall; and the local shear.

        The slope at the end is that of the wedge up to where it ends then: at its toe, at the layer before it, or,
        without a slope at the start, where what the push has built goes over into the layer. Thrusts are found in the
        layer.
        """
        last = instants[-1]
        inner = np.isfinite(last.shear)
        now = last.position[: len(start), :2]
        built = self._front(start, now, radius) - self.push
        reach = self._reach(now, radius, self.push) if self.slope else built
        level = self.layer if self.slope else self.height
        thrusts = thrusts_of(start, now, last.shear, radius, level)
        return {
            "slope at the start [°]": self._slope(start, radius, 0.0, self._reach(start, radius, 0.0)),
            "slope [°]": self._slope(now, radius, self.push, reach),
            "highest [m]": float((now[:, 1] + radius).max()),
            "thrusts": float(len(thrusts.place)),
            "spacing of thrusts [m]": thrusts.spacing,
            "dip of thrusts [°]": float(np.degrees(np.mean(thrusts.dip))) if len(thrusts.dip) else np.nan,
            "force on the wall [N/m]": self._wall_force(instants),
            "friction angle of the base [°]": self._basal(instants),
            "local shear, median [-]": float(np.median(last.shear[inner])),
            "local shear, 95 % [-]": float(np.quantile(last.shear[inner], 0.95)),
        }

    def _reach(self, place: Array, radius: Array, shift: float) -> float:
        """Return the length of the wedge from the wall on; without a slope or a toe, that of the start."""
        if self.slope and not self.layer:
            return self._toe(place, radius) - shift
        return self._foot or self.length

    def _front(self, start: Array, now: Array, radius: Array) -> float:
        places = np.arange(0.0, self.length, radius.mean())
        risen = profile(now, radius, places) - profile(start, radius, places)
        return float(places[np.nan_to_num(risen) > _RISEN * radius.mean()].max(initial=self.push))

    def _toe(self, place: Array, radius: Array) -> float:
        """Return the place up to which a wedge without a layer before it is higher than a disk."""
        places = np.arange(0.0, _ROOM * (self.length + self.push), radius.mean())
        height = np.nan_to_num(profile(place, radius, places))
        # disks that have left the toe lie alone
        high = np.convolve(height, np.full(_ALONE, 1.0 / _ALONE), "same") > _TOE * radius.mean()
        return float(places[high].max(initial=self.push))

    def _basal(self, instants: Sequence[Fields]) -> float:
        """Return the friction angle of the base where disks slide over it, of the forces in the late instants [°]."""
        force = np.zeros(2)
        for frame in self._late(instants):
            count = len(frame.pressure)
            slides = frame.velocity[:, 0] > _SLIDES * frame.velocity[count + _WALL, 0]
            force += frame.force[(frame.bodies[:, 1] == count + _BASE) & slides[frame.bodies[:, 0]]].sum(
                axis=0
            )
        return float(np.degrees(np.arctan2(-force[0], force[1]))) if force.any() else np.nan

    @staticmethod
    def _late(instants: Sequence[Fields]) -> list[Fields]:
        return [instant for instant in instants if instant.time >= _LATE * instants[-1].time]

    def _wall_force(self, instants: Sequence[Fields]) -> float:
        """Return the mean over the late instants of the force that disks press on the wall with."""
        pressed = [
            frame.force_normal[frame.bodies[:, 1] == len(frame.pressure) + _WALL].sum()
            for frame in self._late(instants)
        ]
        return float(np.mean(pressed))

    def _slope(self, place: Array, radius: Array, shift: float, length: float) -> float:
        low, high = _MIDDLE
        places = np.arange(shift + low * length, shift + high * length, radius.mean())
        return -float(np.degrees(slope_of(places, profile(place, radius, places))))
