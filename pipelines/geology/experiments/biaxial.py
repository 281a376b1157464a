"""Biaxial compression between smooth platens, or within a membrane: the friction angle of the sample."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

import numpy as np

from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.planar.scene import Wall
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from pipelines.geology.experiments.experiment import Setup
from pipelines.geology.observe import Fields
from survey.conventions import MOST, PER_CENT, TENTH

_LATE = MOST  # of the run, whose mean is that of large strain [-]
_PEAK = PER_CENT  # vertical strain over which the largest ratio is a mean [-]
_MASS = TENTH  # of a side platen, over that of the sample if it were water [-]


class SampleSides(StrEnum):
    """Sides of the sample: platens or a membrane."""

    RIGID = "rigid"
    FLEXIBLE = "flexible"


@dataclass(frozen=True)
class Biaxial:
    """`[biaxial]`: the top sinks at a constant speed, the sides press with a constant pressure; nothing weighs.

    Rigid platens press with a constant force, pressure times `height` at the start; a flexible membrane follows the
    sides, and presses with a constant pressure.
    """

    width: Annotated[float, Setting("Width of the sample.", "m", above=0)]
    height: Annotated[float, Setting("Height of the sample.", "m", above=0)]
    pressure: Annotated[float, Setting("Of the sides.", "Pa", above=0)]
    strain: Annotated[float, Setting("Vertical strain at the end.", "-", above=0, below=0.9)] = 0.2
    walls: Annotated[
        SampleSides, Setting("Sides: platens that stay straight, or a membrane that follows the disks.")
    ] = SampleSides.RIGID

    @property
    def length(self) -> float:
        """Width of the box in which the sample is deposited [m]."""
        return self.width

    @property
    def highest(self) -> float:
        """Height of the sample [m]."""
        return self.height

    def top(self, x: Array) -> Array:
        """Return the height of the sample at places along x [m]."""
        return np.full(len(x), self.height)

    def setup(self, step: float, duration: float) -> Setup:
        """Return the platens; those at the sides have a mass, and press with their force whatever their place."""
        out, mass = 0.5 * self.width, _MASS * 1000.0 * self.width * self.height
        sink = ImposedMotion(
            frozenset({"top"}), History.constant([0.0, -self.strain * self.height / duration, 0.0])
        )
        floor = Wall("floor", (-out, 0.0), (self.width + out, 0.0))
        top = Wall("top", (-out, self.height), (self.width + out, self.height))
        if self.walls is SampleSides.FLEXIBLE:
            smooth = frozenset({"floor", "top"})
            return Setup(
                (floor, top), Loads(motions=(sink,)), smooth=smooth, weightless=True, membrane=self.pressure
            )
        walls = (
            floor,
            top,
            Wall("left", (0.0, -out), (0.0, self.height + out), mass),
            Wall("right", (self.width, -out), (self.width, self.height + out), mass),
        )
        force = self.pressure * self.height
        loads = Loads(
            forces=tuple(
                StoneForce(frozenset({code}), History.constant([sign * force, 0.0, 0.0]))
                for code, sign in (("left", 1.0), ("right", -1.0))
            ),
            motions=(sink,),
        )
        return Setup(walls, loads, smooth=frozenset(wall.code for wall in walls), weightless=True)

    def phases(self, duration: float) -> Mapping[str, tuple[float, float]]:
        """Return the one phase of the run."""
        return {"compression": (0.0, duration)}

    def measures(
        self, start: Array, radius: Array, instants: Sequence[Fields], whole: Mapping[str, Array]
    ) -> Mapping[str, float]:
        """Return the friction angle at large strain and at its peak, of the mean stress of the sample."""
        late = whole["time"] >= _LATE * whole["time"][-1]
        ratio = np.clip(whole["q"] / whole["p"], 0.0, 1.0)
        angle = np.degrees(np.arcsin(ratio[late]))
        rows = min(len(ratio), max(1, round(_PEAK / self.strain * len(ratio))))
        return {
            "friction angle [°]": float(angle.mean()),
            "its standard deviation [°]": float(angle.std()),
            "sin φ [-]": float(ratio[late].mean()),
            "sin φ, peak [-]": float(np.convolve(ratio, np.full(rows, 1.0 / rows), "valid").max()),
        }
