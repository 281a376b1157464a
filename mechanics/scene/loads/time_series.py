"""Quantities that change with time, linearly between given instants."""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ground.errors import SceneError
from mechanics.arrays import Array

_TIME_ROUNDING = 1e-9  # of its span, by which rounding may place a time outside a history that ends [-]


class Outside(StrEnum):
    """Values of a history before its first instant and after its last."""

    HOLD = "hold"
    ERROR = "error"


@dataclass(frozen=True, eq=False)
class History:
    """A scalar or a vector, piecewise linear in time.

    Attributes
    ----------
    time : (n,) increasing instants [s]; a single one makes a constant
    value : (n,) or (n, k) at these instants, in the unit of the quantity
    outside : before and after them, *hold* the first and the last value, or *error*
    """

    time: Array
    value: Array
    outside: Outside = Outside.HOLD

    def __post_init__(self) -> None:
        for name in ("time", "value"):
            array = np.array(getattr(self, name), dtype=np.float64)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if self.time.ndim != 1 or self.value.ndim not in (1, 2) or not len(self.time):
            raise _wrong(
                "time and value are not lists", "give one value, or one row of values, for each time"
            )
        if len(self.time) != len(self.value):
            what = f"value has {len(self.value)} entries for {len(self.time)} times"
            raise _wrong(what, "give one for each time")
        finite = np.isfinite(self.time) & np.isfinite(self.value.reshape(len(self.time), -1)).all(axis=1)
        if not finite.all():
            raise _wrong(f"entry {int(np.argmin(finite)) + 1} is not finite", "give numbers")
        still = np.flatnonzero(np.diff(self.time) <= 0)
        if len(still):
            at = int(still[0])
            what = f"time {self.time[at + 1]:g} s comes after {self.time[at]:g} s"
            raise _wrong(what, "give increasing times; a jump needs two instants close together")

    @classmethod
    def constant(cls, value: ArrayLike) -> "History":
        """Return a history with the same value at all times."""
        return cls(np.zeros(1), np.asarray(value, dtype=np.float64)[None])

    @classmethod
    def trapezoid(cls, start: float, duration: float, area: ArrayLike, ramp: float = 0.1) -> "History":
        """Return a rise from zero to a plateau and a fall back to zero, with the integral `area`.

        The rise and the fall take the part `ramp` of the duration each, so that a velocity has no jumps.
        """
        if not (duration > 0 and start >= 0):
            raise _wrong(
                f"start = {start:g} s, duration = {duration:g} s", "give a start ≥ 0 and a duration > 0"
            )
        plateau = np.asarray(area, dtype=np.float64) / (duration * (1 - ramp))
        shape = np.array([0.0, 1.0, 1.0, 0.0])
        time = start + duration * np.array([0.0, ramp, 1 - ramp, 1.0])
        return cls(time, np.multiply.outer(shape, plateau))

    @property
    def components(self) -> int:
        """Number of components of a value: k, or 1 for a scalar."""
        return 1 if self.value.ndim == 1 else self.value.shape[1]

    @property
    def until(self) -> float:
        """Time from which it is constant [s]; 0 for a constant."""
        return float(self.time[-1]) if len(self.time) > 1 else 0.0

    def __call__(self, time: float) -> Array:
        """Return the value () or (k,) at `time` [s].

        Raises
        ------
        SceneError : outside the given instants, where the history is to end there
        """
        place = self._inside(time)
        before = int(np.searchsorted(self.time, place, side="right")) - 1
        value: Array = self.value[before]
        if before + 1 < len(self.time):
            part = (place - self.time[before]) / (self.time[before + 1] - self.time[before])
            value = value + part * (self.value[before + 1] - value)
        return value

    def integral(self, time: float) -> Array:
        """Return ∫ value dt () or (k,) from 0 to `time` [s], exactly.

        Raises
        ------
        SceneError : as for the value itself
        """
        if len(self.time) == 1 and self.outside is Outside.HOLD:
            return np.asarray(time * self.value[0])
        area: Array = self._antiderivative(time) - self._antiderivative(0.0)
        return area

    def _antiderivative(self, time: float) -> Array:
        """Return ∫ value dt from the first instant to `time` [s]."""
        place = self._inside(time)
        before = int(np.searchsorted(self.time, place, side="right")) - 1
        within = self._sums[before] + (place - self.time[before]) * (self.value[before] + self(place)) / 2
        # outside the given instants the value of the first or last one holds
        held: Array = within + (time - place) * self(place)
        return held

    @cached_property
    def _sums(self) -> Array:
        """∫ value dt from the first instant to each (n,) or (n, k)."""
        width = np.diff(self.time).reshape(-1, *[1] * (self.value.ndim - 1))
        areas = width * (self.value[1:] + self.value[:-1]) / 2
        return np.concatenate([np.zeros_like(self.value[:1]), np.cumsum(areas, axis=0)])

    def _inside(self, time: float) -> float:
        """Return the instant nearest to `time` within the history [s]."""
        first, last = float(self.time[0]), float(self.time[-1])
        slack = _TIME_ROUNDING * max(last - first, abs(last))
        if self.outside is Outside.ERROR and not first - slack <= time <= last + slack:
            what = f"t = {time:g} s lies outside {first:g} s to {last:g} s"
            raise _wrong(what, "give the history for the whole run, or let it hold its last value")
        return min(max(time, first), last)


def _wrong(what: str, remedy: str) -> SceneError:
    return SceneError(what, where="history", remedy=remedy)
