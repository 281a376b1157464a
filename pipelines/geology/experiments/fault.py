"""Reverse fault in the basement, whose propagation folds the cover (Renouf, Dubois & Alart 2006)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.planar.measures.limits import crest_radius, shear_limits
from mechanics.planar.measures.surface import front, profile, rise
from mechanics.planar.measures.trishear import TrishearFit, trishear_fit
from mechanics.planar.measures.trishear_gain import trishear_gain
from mechanics.planar.scene import Wall
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from pipelines.geology.experiments.experiment import Setup
from pipelines.geology.observe import Fields
from survey.conventions import FEW, MOST, TENTH

_FIRST_PHASE = 0.25  # of the paper's run, 10 of 40 s [-]
_SLIP = "slip [m]"
_FRONT = "front ahead of the tip [m]"
_OBSERVED = (_FRONT, "left limit [°]", "right limit [°]", "limits, θ_l [°]", "radius of the crest [m]")
_APICAL = "trishear: apical angle [°]"
_RATIO = "trishear: propagation to slip [-]"
_RISEN = TENTH  # rise of the surface over that of the basement, at the front of the fold [-]
_CREST = (MOST, 1.0 - FEW)  # rise of the surface over that of the basement, between which its crest bends [-]
_AVERAGING_LENGTH = (
    4.0  # lengths over which the surface is averaged, over the mean radius: those of two disks [-]
)
_SLIPPED = 2.0  # slip over the mean radius, before which a fault has no zone of shear to measure [-]


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

    def trishear(self, start: Array, last: Fields) -> TrishearFit | None:
        """Fit a trishear to the motion since the start; None in a run without slip."""
        slip = self.speed * last.time
        now = last.position[: len(start), :2]
        if slip <= 0:
            return None
        return trishear_fit(start, now, (self.tip, 0.0), float(np.radians(self.dip)), slip)

    def observables(self, start: Array, now: Array, radius: Array, time: float) -> Mapping[str, float]:
        """Return the front of the fold, the limits of the sheared zone, and the radius of the surface's crest.

        The front is the farthest place whose surface has risen by a tenth of the rise of the basement, ahead of where
        the fault's tip was at the start. θ_l is the mean angle of both limits. Nothing but the slip is known before two
        mean radii of slip.
        """
        slip, angle = self.speed * time, float(np.radians(self.dip))
        if slip < _SLIPPED * radius.mean():
            return {_SLIP: slip, **dict.fromkeys(_OBSERVED, float("nan"))}
        where, risen = rise(start, now, radius, self.length, _AVERAGING_LENGTH * float(radius.mean()))
        uplift = slip * np.sin(angle)
        share = (now - start) @ np.array([np.cos(angle), np.sin(angle)]) / slip
        limits = shear_limits(now, share)
        crest = (risen > _CREST[0] * uplift) & (risen < _CREST[1] * uplift) & (where > self.tip)
        found = (
            front(where, risen, _RISEN * uplift) - self.tip,
            float(np.degrees(limits.left)),
            float(np.degrees(limits.right)),
            float(np.degrees(limits.mean)),
            crest_radius(where[crest], profile(now, radius, where[crest])),
        )
        return {_SLIP: slip, **dict(zip(_OBSERVED, found, strict=True))}

    def measures(
        self, start: Array, radius: Array, instants: Sequence[Fields], whole: Mapping[str, Array]
    ) -> Mapping[str, float]:
        """Return what is observed at the end, and the trishear that comes nearest to the motion of the disks.

        Its gain is over the best plain fault, among disks that move by 5 to 95 % of the slip. Angle and P/S are left
        out where the motion does not determine them, and all of it in a run without slip.
        """
        last = instants[-1]
        now = last.position[: len(start), :2]
        seen = dict(self.observables(start, now, radius, last.time))
        fit = self.trishear(start, last)
        if fit is None or not np.isfinite(seen[_FRONT]):
            return {_SLIP: seen[_SLIP]}
        gain = trishear_gain(fit, start, now, seen[_SLIP], 2.0 * float(radius.mean()))
        seen["trishear: residual over slip [-]"] = fit.relative
        if gain is None:
            return seen
        seen["trishear: gain over a plain fault [-]"] = gain.gain
        seen["trishear: gain, from [-]"], seen["trishear: gain, to [-]"] = gain.interval
        for name, value, unit, limits in (
            (_APICAL, fit.model.half_angle, 2.0 * float(np.degrees(1.0)), gain.half_angles),
            (_RATIO, fit.model.ratio, 1.0, gain.ratios),
        ):
            if limits is not None:
                kind, _, symbol = name.rpartition(" ")
                seen[name] = unit * value
                seen[f"{kind}, from {symbol}"], seen[f"{kind}, to {symbol}"] = (
                    unit * limit for limit in limits
                )
        return seen
