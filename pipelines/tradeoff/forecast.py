"""Forecast of time and memory of runs from those that have ended, and choice of the next run."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from pipelines.tradeoff.grid import Variant
from pipelines.tradeoff.store import Measured, Status
from pipelines.tradeoff.worker import SHORT
from survey.conventions import LARGELY

_USUAL_POWER = 1.5  # of the unknowns, by which time grows, until it has been measured
_POWERS = (1.0, 2.5)  # bounds of the measured power: sparse factors of walls and of solid masonry
_MEMORY_POWER = 1.3  # of the unknowns, by which memory grows
_START = 3.0  # start of a process and reading of its input, until it has been measured [s]
_MODELS_SHARE = LARGELY  # share of the budget for models of the stones, before their variants
_PATIENCE = 2.0  # a run is stopped when it takes this many times as long as expected,
_LEAST_SHARE = 1.0 / 6.0  # but not before this share of the budget is spent on it
_UNKNOWN_SHARE = 1.0 / 3.0  # share of the budget for a run without a forecast


@dataclass(frozen=True)
class Forecast:
    """Expected cost of runs, from those that have ended.

    Attributes
    ----------
    settings : of the study, by name
    ended : runs, by the name of their setting
    """

    settings: Mapping[str, Variant]
    ended: Mapping[str, Measured]

    def seconds(self, setting: Variant) -> float | None:
        """Return the expected time of the process from start to end [s]; None if there is no run to infer it from."""
        start = self._start()
        if setting.varied is not None:
            base = self.ended.get(setting.varied)
            if base is None or base.status is not Status.DONE:
                return None
            return start + _twice(setting.effort * base.wall)
        nearest = self._nearest(setting)
        if nearest is None:
            return None
        near_setting = self.settings[nearest.name]
        grown: float = (setting.unknowns / near_setting.unknowns) ** self._power()
        return start + _twice(grown * setting.effort / near_setting.effort * max(nearest.wall, 1e-3))

    def memory(self, setting: Variant) -> float | None:
        """Return the expected memory of the process [bytes]; None if there is no run to infer it from."""
        nearest = self.ended.get(setting.varied) if setting.varied is not None else self._nearest(setting)
        if nearest is None or nearest.memory == 0:
            return None
        grown: float = (setting.unknowns / self.settings[nearest.name].unknowns) ** _MEMORY_POWER
        # compiled kernels, whatever the mesh
        least = min(run.memory for run in self.ended.values() if run.memory)
        return least + grown * (nearest.memory - least)

    def _start(self) -> float:
        """Return the time of a process besides its work [s]."""
        spent = [
            ended.elapsed - _twice(ended.wall) for ended in self.ended.values() if ended.status is Status.DONE
        ]
        return max(float(np.median(spent)), 0.5) if spent else _START

    def _nearest(self, setting: Variant) -> Measured | None:
        """Return the run with the nearest number of unknowns, of the same element type if there is one.

        A stopped run only bounds the time of the same element type with more unknowns.
        """
        alike, others = [], []
        for ended in self.ended.values():
            ended_setting = self.settings[ended.name]
            if ended_setting.varied is not None or (ended_setting.element is None) != (
                setting.element is None
            ):
                continue
            if ended_setting.element is setting.element:
                if ended.status is Status.DONE or (
                    ended.status is Status.STOPPED and ended_setting.unknowns <= setting.unknowns
                ):
                    alike.append(ended)
            elif ended.status is Status.DONE:
                others.append(ended)
        return min(alike or others, key=lambda one: self._apart(setting, one), default=None)

    def _apart(self, setting: Variant, run: Measured) -> float:
        return abs(math.log(setting.unknowns / self.settings[run.name].unknowns))

    def _power(self) -> float:
        """Return the power of the unknowns by which time grows, from pairs of runs with one element type."""
        slopes = []
        for first in self.ended.values():
            for second in self.ended.values():
                a, b = self.settings[first.name], self.settings[second.name]
                both = (
                    first.status is Status.DONE
                    and second.status is Status.DONE
                    and a.varied is b.varied is None
                )
                same = a.element is b.element is not None
                if both and same and b.unknowns > 1.5 * a.unknowns and first.wall > 0.0 and second.wall > 0.0:
                    slopes.append(math.log(second.wall / first.wall) / math.log(b.unknowns / a.unknowns))
        return float(np.clip(np.median(slopes), *_POWERS)) if slopes else _USUAL_POWER


@dataclass(frozen=True)
class Choice:
    """The next run.

    Attributes
    ----------
    setting : of the run
    limit : time after which it is stopped [s]
    """

    setting: Variant
    limit: float


def next_run(
    forecast: Forecast,
    begun: Collection[str],
    worth: Collection[str],
    left: float,
    budget: float,
    memory: float,
) -> Choice | None:
    """Choose the cheapest run that fits: models first, until their share of the budget is spent, then variants.

    Parameters
    ----------
    forecast : of this study
    begun : names of runs that are not to be started again
    worth : names of models whose variants are of interest
    left : remaining time of the budget [s]
    budget : of the study [s]
    memory : that a run may take [bytes]

    Time that the variants leave goes to the models again, so that the reference is as fine as possible.
    """
    waiting = [setting for setting in forecast.settings.values() if setting.name not in begun]
    models = [setting for setting in waiting if setting.varied is None]
    variants = [
        setting for setting in waiting if setting.varied in worth and forecast.seconds(setting) is not None
    ]
    of_models = left - (1.0 - _MODELS_SHARE) * budget
    for candidates, time in ((models, of_models), (variants, left), (models, left)):
        for candidate in sorted(candidates, key=lambda candidate: _order(forecast, candidate)):
            if _refusal(forecast, candidate, time, memory) == "":
                return Choice(candidate, min(_patience(forecast.seconds(candidate), budget), left))
    return None


def left_out(forecast: Forecast, setting: Variant, left: float, memory: float) -> str:
    """Return the reason for which a setting was not run."""
    base = forecast.ended.get(setting.varied or "")
    if setting.varied is not None and (base is None or base.status is not Status.DONE):
        return f"a variant of {setting.varied!r}, of which there is no result"
    return (
        _refusal(forecast, setting, left, memory)
        or f"a variant of {setting.varied!r}, which is not on the front"
    )


def _refusal(forecast: Forecast, setting: Variant, left: float, memory: float) -> str:
    expected, needed = forecast.seconds(setting), forecast.memory(setting)
    if needed is not None and needed > memory:
        return f"would take about {needed / 2**30:.1f} GiB of memory, there are {memory / 2**30:.1f}"
    if left <= 0.0:
        return "the budget is spent"
    if expected is not None and expected > left:
        return f"would take about {expected:.0f} s, {left:.0f} s of the budget are left for it"
    return ""


def _order(forecast: Forecast, setting: Variant) -> tuple[float, float]:
    expected = forecast.seconds(setting)
    return (0.0 if expected is None else expected, setting.effort * setting.unknowns)


def _patience(expected: float | None, budget: float) -> float:
    if expected is None:
        return _UNKNOWN_SHARE * budget
    return max(_PATIENCE * expected, _LEAST_SHARE * budget)


def _twice(seconds: float) -> float:
    """Return the time of work that is done twice if it is short, see `pipelines.tradeoff.worker`."""
    return 2.0 * seconds if seconds < SHORT else seconds
