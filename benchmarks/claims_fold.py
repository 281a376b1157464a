"""Claims of Renouf, Dubois & Alart (2006) about their fold."""

from collections.abc import Callable, Mapping
from itertools import pairwise

import numpy as np

from benchmarks.claims import CONSTANT, Claim, Finding, Run, mean_of, parts_of, single, strayed

_ALIKE = 0.9  # correlation of folds that are similar [-]
_BAND = 2.0  # shear of a band over the median along its layer [-]
_SLOW = "changes by less than 20 % from the first"


def _front_of_the_fold(runs: Mapping[float, Run]) -> Finding:
    run = runs[0.0]
    course, resolution = run.course, run.last["resolution"]
    seen = course["front [m]"] > 0
    rear, front = course["rear [m]"][seen], course["front [m]"][seen]
    straight = np.interp(rear, rear[[0, -1]], front[[0, -1]])
    away = float(np.abs(front - straight).max())
    wall = course["rear [m]"][-1] * np.array([0.4, 0.7, 1.0])
    numbers = {
        "wall": wall.tolist(),
        "front": np.interp(wall, rear, front).tolist(),
        "farthest from a straight line": [away],
        "resolution": [resolution],
    }
    return Finding((away - resolution) / resolution, numbers)


def _similar(runs: Mapping[float, Run]) -> Finding:
    found = runs[0.0].last["similar"]
    return Finding(found - _ALIKE, {"correlation": [found]})


def _emerged(runs: Mapping[float, Run]) -> Finding:
    before, after = (runs[0.0].last[name] for name in ("emerged before", "emerged"))
    return Finding(after - before, {"share": [before, after]})


def _band(runs: Mapping[float, Run]) -> Finding:
    found = runs[0.0].last["band"]
    return Finding(float(np.log(found / _BAND)), {"largest over median": [found]})


def _falls(cell: str, column: str) -> Callable[[Mapping[float, Run]], Finding]:
    def measure(runs: Mapping[float, Run]) -> Finding:
        parts = parts_of(runs[0.0].cells[cell], column, 0.0, 1.0)
        drops = [(one - other) / parts[0] for one, other in pairwise(parts)]
        return Finding(min(drops), {f"{column}, kPa": [1e-3 * part for part in parts]})

    return measure


def _constant(cell: str, column: str, end: float = 1.0) -> Callable[[Mapping[float, Run]], Finding]:
    def measure(runs: Mapping[float, Run]) -> Finding:
        parts = parts_of(runs[0.0].cells[cell], column, 0.0, end)
        return Finding(CONSTANT - strayed(parts), {f"{column}, kPa": [1e-3 * part for part in parts]})

    return measure


def _largest(column: str) -> Callable[[Mapping[float, Run]], Finding]:
    """Compare W3 and W4 with the other cells: stresses by the largest mean of a tenth of the run, λ at its end."""

    def measure(runs: Mapping[float, Run]) -> Finding:
        cells, unit = runs[0.0].cells, 1e-3 if column in "pq" else 1.0
        found = {
            name: unit
            * (
                max(parts_of(cells[name], column, 0.0, 1.0, 10))
                if column in "pq"
                else float(cells[name][column][-1])
            )
            for name in (f"W{number}" for number in range(1, 7))
        }
        others = max(value for name, value in found.items() if name not in ("W3", "W4"))
        return Finding(min(found["W3"], found["W4"]) / others - 1.0, single(found))

    return measure


def _doubled_length(runs: Mapping[float, Run]) -> Finding:
    found = float(runs[0.0].cells["W2"]["lambda_x"][-1])
    return Finding(CONSTANT - abs(found / 2.0 - 1.0), {"λx": [found]})


def _slowly(runs: Mapping[float, Run]) -> Finding:
    """W1 rises, and by less than W3 and W4."""
    change = {}
    for cell in ("W1", "W3", "W4"):
        parts = parts_of(runs[0.0].cells[cell], "p", 0.0, 1.0)
        change[cell] = parts[-1] / parts[0] - 1.0
    margin = min(change["W1"], change["W3"] - change["W1"], change["W4"] - change["W1"])
    return Finding(margin, single(change))


def _reaches(column: str) -> Callable[[Mapping[float, Run]], Finding]:
    def measure(runs: Mapping[float, Run]) -> Finding:
        one, other = (mean_of(runs[0.0].cells[cell], column, 0.75, 1.0) for cell in ("W5", "W1"))
        return Finding(CONSTANT - abs(one / other - 1.0), {"W5": [1e-3 * one], "W1": [1e-3 * other]})

    return measure


FOLD: tuple[Claim, ...] = (
    Claim(
        "fold",
        "similar folds",
        "layers 5, 6, 7 fold similarly (t = 200 s)",
        "rises of layers 5 and 7 along x are correlated by over 0.9",
        _similar,
    ),
    Claim(
        "fold",
        "front",
        "the front does not follow the rear wall by a straight line",
        "it strays from one by more than the length over which it is averaged",
        _front_of_the_fold,
        digits=1,
    ),
    Claim(
        "fold",
        "shear band",
        "a shear band below the fold, seen in layer 3 (t = 350 s)",
        "shear of layer 3 between wall and front: largest over twice the median, ln",
        _band,
    ),
    Claim(
        "fold",
        "emergence",
        "lower layers emerge at the surface",
        "of the disks that end between wall and front, the share of layers 1 to 8 among those at the surface grows",
        _emerged,
        digits=3,
    ),
    Claim(
        "fold",
        "W1",
        "stress of W1 increases slowly",
        "p of W1 grows, and by less than that of W3 and W4",
        _slowly,
    ),
    Claim(
        "fold",
        "W2 p",
        "stress of W2 decreases during the whole process: p",
        "each quarter's mean is below that before",
        _falls("W2", "p"),
        digits=0,
    ),
    Claim(
        "fold", "W2 q", "the same: q", "each quarter's mean is below that before", _falls("W2", "q"), digits=0
    ),
    Claim("fold", "W2 λx", "deformation of W2 reaches two along x", "λx within 20 % of 2", _doubled_length),
    Claim(
        "fold",
        "most stressed p",
        "W3 and W4 are the most stressed: p",
        "the smaller of both exceeds all others, by the largest mean of a tenth of the run",
        _largest("p"),
        digits=0,
    ),
    Claim("fold", "most stressed q", "the same: q", "as above", _largest("q"), digits=0),
    Claim(
        "fold",
        "dilatations",
        "large dilatations of W3 and W4",
        "λx of both exceeds that of all others at the end",
        _largest("lambda_x"),
    ),
    Claim(
        "fold",
        "W5 p",
        "efforts on W5 are constant in the first half: p",
        f"means of its four parts: {_SLOW}",
        _constant("W5", "p", 0.5),
        digits=0,
    ),
    Claim("fold", "W5 q", "the same: q", "as above", _constant("W5", "q", 0.5), digits=0),
    Claim(
        "fold",
        "W5 reaches p",
        "then they reach those of W1: p",
        "within 20 % in the last quarter",
        _reaches("p"),
        digits=0,
    ),
    Claim("fold", "W5 reaches q", "the same: q", "as above", _reaches("q"), digits=0),
    Claim(
        "fold",
        "W6 p",
        "efforts on W6 are constant: p",
        f"quarter means: {_SLOW}",
        _constant("W6", "p"),
        digits=0,
    ),
    Claim("fold", "W6 q", "the same: q", "as above", _constant("W6", "q"), digits=0),
)
"""Claims about the fold, in the order of the paper."""
