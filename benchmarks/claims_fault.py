"""Claims of Renouf, Dubois & Alart (2006) about their fault."""

from collections.abc import Callable, Mapping
from statistics import fmean

import numpy as np

from benchmarks.claims import CONSTANT, Claim, Finding, Run, mean_of, parts_of, single
from mechanics.arrays import Array

_SMALL, _LARGEST = (0.0, 1e3, 1e4), 1e5  # γ of the paper [N]
_SEEN = 0.02  # change of λ that a curve of the paper shows [-]
_FIRST = 0.25  # share of the run that is its first phase, 10 of 40 s [-]
_FRONT, _LIMITS = "front ahead of the tip [m]", "limits, θ_l [°]"
_RADIUS = "radius of the crest [m]"
_ALL = (*_SMALL, _LARGEST)


def _label(gamma: float) -> str:
    return f"γ = {gamma:g} N"


def _by_gamma(
    value: Callable[[Run], float], margin: Callable[[Mapping[float, float]], float]
) -> Callable[[Mapping[float, Run]], Finding]:
    """Return the measure that compares one number of the runs of all γ."""

    def measure(runs: Mapping[float, Run]) -> Finding:
        found = {gamma: value(run) for gamma, run in sorted(runs.items())}
        return Finding(margin(found), single({_label(gamma): one for gamma, one in found.items()}))

    return measure


def _course(name: str) -> Callable[[Run], float]:
    """Return the mean of what the fault observes over the last quarter of the run."""
    return lambda run: mean_of(run.course, name, 0.75, 1.0)


def _dip(run: Run) -> float:
    return run.last["dip"]


def _limits(gammas: tuple[float, ...], sign: float) -> Callable[[Mapping[float, Run]], Finding]:
    def measure(runs: Mapping[float, Run]) -> Finding:
        found = {gamma: _course(_LIMITS)(runs[gamma]) for gamma in gammas}
        margin = min(sign * (found[gamma] / _dip(runs[gamma]) - 1.0) for gamma in gammas)
        return Finding(margin, single({_label(gamma): value for gamma, value in found.items()}))

    return measure


def _late_radii(run: Run) -> Array:
    """Return the radii of the crest in the last quarter, without instants at which there are too few places [m]."""
    time = run.course["time"]
    late = run.course[_RADIUS][time > 0.75 * time[-1]]
    return np.asarray(late[~np.isnan(late)])


def _flat(run: Run) -> float:
    """Return the share of the last quarter in which the crest is not bent."""
    late = _late_radii(run)
    return float(np.isinf(late).mean()) if len(late) else float("nan")


def _curvature(run: Run) -> float:
    """Return the thickness over the radius of the crest, mean of the last quarter; 0: flat [-]."""
    late = _late_radii(run)
    return float((run.last["thickness"] / late).mean()) if len(late) else float("nan")


def _two(column: str, begin: float, end: float) -> Callable[[Run], tuple[float, float]]:
    """Return the means over the first and the last tenth of a phase of W1; the first includes the first row."""

    def ends(run: Run) -> tuple[float, float]:
        tenth = 0.1 * (end - begin)
        cell = run.cells["W1"]
        return mean_of(cell, column, begin, begin + tenth), mean_of(cell, column, end - tenth, end)

    return ends


def _phase(
    column: str, begin: float, end: float, margin: Callable[[float], float]
) -> Callable[[Mapping[float, Run]], Finding]:
    """Return the measure of a growth within a phase, the worst of all γ."""

    def measure(runs: Mapping[float, Run]) -> Finding:
        margins, numbers = [], {}
        for gamma, run in sorted(runs.items()):
            first, last = _two(column, begin, end)(run)
            margins.append(margin(last / first - 1.0))
            numbers[_label(gamma)] = [1e-3 * first, 1e-3 * last]
        return Finding(min(margins), numbers)

    return measure


def _pressure(run: Run) -> float:
    return 1e-3 * mean_of(run.cells["W1"], "p", _FIRST, 1.0)


def _twice(found: Mapping[float, float]) -> float:
    ratio = found[_LARGEST] / fmean(found[gamma] for gamma in _SMALL)
    return CONSTANT - abs(ratio / 2.0 - 1.0)


def _falls_then_grows(runs: Mapping[float, Run]) -> Finding:
    margins, numbers = [], {}
    for gamma, run in sorted(runs.items()):
        parts = parts_of(run.cells["W1"], "lambda_x", 0.0, 1.0, 20)
        least = min(parts)
        margins.append(min(parts[0] - least, parts[-1] - least) - _SEEN)
        numbers[_label(gamma)] = [parts[0], least, parts[-1]]
    return Finding(min(margins), numbers)


def _name(name: str) -> Callable[[Run], float]:
    return lambda run: run.last[name]


def _less(found: Mapping[float, float]) -> float:
    """Return by how much the number of the largest γ is below that without cohesion, over that."""
    return 1.0 - found[_LARGEST] / found[0.0]


def _more(found: Mapping[float, float]) -> float:
    return -_less(found)


FAULT: tuple[Claim, ...] = (
    Claim(
        "fault",
        "limits, small γ",
        "θ_l is larger than θ = 30° for small γ",
        "θ_l of γ = 0 and 10³ N, last quarter, over θ, minus 1",
        _limits((0.0, 1e3), 1.0),
        (0.0, 1e3),
        0,
    ),
    Claim(
        "fault",
        "limits, largest γ",
        "θ_l is smaller than θ for the largest",
        "1 minus θ_l over θ",
        _limits((_LARGEST,), -1.0),
        (_LARGEST,),
        0,
    ),
    Claim(
        "fault",
        "limits fall",
        "θ_l decreases with γ",
        "largest γ against none",
        _by_gamma(_course(_LIMITS), _less),
        _ALL,
        0,
    ),
    Claim(
        "fault",
        "flat",
        "the free surface's radius is infinite for γ = 0 and 10³ N",
        "the crest is not bent in most of the last quarter",
        _by_gamma(_flat, lambda found: min(found.values()) - 0.5),
        (0.0, 1e3),
    ),
    Claim(
        "fault",
        "radius",
        "it decreases with γ",
        "thickness over radius, largest γ minus none",
        _by_gamma(_curvature, lambda found: found[_LARGEST] - found[0.0]),
        _ALL,
    ),
    Claim(
        "fault",
        "front",
        "the front recedes with γ",
        "largest γ against none, last quarter",
        _by_gamma(_course(_FRONT), _less),
        _ALL,
        1,
    ),
    Claim(
        "fault",
        "blocks",
        "blocks detach at the largest γ",
        "share of the disks in blocks that came off at the surface: largest γ minus the most of the others",
        _by_gamma(_name("detached"), lambda found: found[_LARGEST] - max(found[gamma] for gamma in _SMALL)),
        _ALL,
        4,
    ),
    Claim(
        "fault",
        "sheared area",
        "the sheared area decreases with γ",
        "share of the disks that move by 5 to 95 % of the slip",
        _by_gamma(_name("sheared"), _less),
        _ALL,
        3,
    ),
    Claim(
        "fault",
        "trishear",
        "trishear is best without cohesion",
        "residual, largest γ over none, minus 1",
        _by_gamma(_name("residual"), _more),
        _ALL,
        3,
    ),
    Claim(
        "fault",
        "p grows",
        "W1: p grows quickly in the first 10 s",
        "by more than 20 % from the first to the last second, for every γ [kPa]",
        _phase("p", 0.0, _FIRST, lambda growth: growth - CONSTANT),
        _ALL,
        0,
    ),
    Claim(
        "fault",
        "q stays",
        "while q stays",
        "by less than 20 %, for every γ [kPa]",
        _phase("q", 0.0, _FIRST, lambda growth: CONSTANT - abs(growth)),
        _ALL,
        0,
    ),
    Claim(
        "fault",
        "p stays",
        "then p stays",
        "by less than 20 % from the first to the last tenth of 10 to 40 s [kPa]",
        _phase("p", _FIRST, 1.0, lambda growth: CONSTANT - abs(growth)),
        _ALL,
        0,
    ),
    Claim(
        "fault",
        "q grows",
        "and q grows slowly",
        "it grows from the first to the last tenth of 10 to 40 s [kPa]",
        _phase("q", _FIRST, 1.0, lambda growth: growth),
        _ALL,
        0,
    ),
    Claim(
        "fault",
        "p alike",
        "p is similar for the three smaller γ",
        "within 20 % [kPa]",
        _by_gamma(_pressure, lambda found: CONSTANT - (max(found.values()) / min(found.values()) - 1.0)),
        _SMALL,
        1,
    ),
    Claim(
        "fault",
        "p twice",
        "p is twice as high at the largest γ",
        "2 times the mean of the others within 20 %, mean stress [kPa]",
        _by_gamma(_pressure, _twice),
        _ALL,
        1,
    ),
    Claim(
        "fault",
        "p twice, pushed",
        "the same, if p is of the reactions r + γ alone",
        "as above [kPa]",
        _by_gamma(_name("pushed"), _twice),
        _ALL,
        1,
    ),
    Claim(
        "fault", "λx", "λx falls, then grows", "both by more than 0.02, for every γ", _falls_then_grows, _ALL
    ),
    Claim(
        "fault",
        "λy",
        "λy grows with γ",
        "largest γ minus none, at the end",
        _by_gamma(
            lambda run: float(run.cells["W1"]["lambda_y"][-1]), lambda found: found[_LARGEST] - found[0.0]
        ),
        _ALL,
    ),
)
"""Claims about the fault, in the order of the paper."""
