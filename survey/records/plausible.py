"""Sizes and properties that stones have, and the unit that a value outside was probably given in.

Each range has two parts: what is usual, beyond which a value is doubted, and what is possible, beyond which it is not
that of a stone. Both are in SI units, and come from handbooks of building stone and from the largest stones ever moved.
"""

import math
import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from ground.units import CENTI, FOOT, GIGA, GRAVITY, INCH, KILO, LENGTHS, MEGA, MILLI, POUND, PSI
from survey.arrays import Array
from survey.conventions import SOME


@dataclass(frozen=True)
class Range:
    """Range of a quantity.

    Attributes
    ----------
    quantity : its name
    unit : its SI unit; empty for a number
    usual : smallest and largest value that needs no second look
    possible : smallest and largest value that a stone can have
    reason : evidence
    units : other units in which people give it, and their conversion to the SI unit
    """

    quantity: str
    unit: str
    usual: tuple[float, float]
    possible: tuple[float, float]
    reason: str
    units: tuple[tuple[str, Callable[[float], float]], ...] = ()


def _scaled(size: float) -> Callable[[float], float]:
    return lambda value: value * size


def _tangent(degrees: float) -> float:
    return math.tan(math.radians(degrees)) if 0.0 < degrees < 90.0 else math.nan


def _range(quantity: str, unit: str, **units: float | Callable[[float], float]) -> Range:
    """Return the range of a quantity of `plausible.toml`, with other units by name: their size, or a conversion."""
    table = _RANGES[quantity]
    others = ((name, _scaled(size) if isinstance(size, float) else size) for name, size in units.items())
    return Range(
        quantity, unit, tuple(table["usual"]), tuple(table["possible"]), table["reason"], tuple(others)
    )


_RANGES = tomllib.loads(files(__package__).joinpath("plausible.toml").read_text(encoding="utf-8"))
LENGTH = _range("length", "m", millimetres=MILLI, centimetres=CENTI, feet=FOOT, inches=INCH)
DENSITY = _range(
    "density",
    "kg/m³",
    **{"g/cm³ (t/m³)": KILO, "kN/m³": KILO / GRAVITY, "lb/ft³": POUND / (FOOT * FOOT * FOOT)},
)
YOUNG = _range("young", "Pa", **{"GPa": GIGA, "MPa (N/mm²)": MEGA, "kPa": KILO, "psi": PSI})
POISSON = _range("poisson", "")
FRICTION = _range("friction", "", degrees=_tangent, **{"per cent": CENTI})


_METRIC = ("mm", "cm")
_UNITS = {name: LENGTHS[name] for name in (*_METRIC, "ft", "in")}
_MANY = 1000  # stones of which it is asked on what they stand
_LOWER = SOME  # of its height: how much lower the centre of the stones is on which another stands [-]


def lies_on_its_side(boxes: Array) -> bool:
    """Return whether solids stand on others along y, but not along z: the axes of another program.

    Parameters
    ----------
    boxes : (n, 6) lower and upper corner of each [m]
    """
    along_y, along_z = (_standing(boxes, axis) for axis in (1, 2))
    flat = np.ptp(boxes.reshape(-1, 2, 3), axis=(0, 1))
    thin = flat[2] < min(flat[0], flat[1])
    return along_y > 0 and (along_z == 0 or (bool(thin) and along_y > 3 * along_z))


def _standing(boxes: Array, axis: int) -> int:
    """Count the solids, of at most a thousand, that stand on others along an axis.

    One does so if a way over boxes that meet, each lower than the one before, leads down by a part of its height: from
    the crown of a vault it is longer than from a stone of a course.
    """
    centre = 0.5 * (boxes[:, axis] + boxes[:, 3 + axis])
    some = np.linspace(0, len(boxes) - 1, min(len(boxes), _MANY)).astype(int)
    return sum(_stands(boxes, centre, int(k), axis) for k in some)


def _stands(boxes: Array, centre: Array, first: int, axis: int) -> bool:
    enough = centre[first] - _LOWER * (boxes[first, 3 + axis] - boxes[first, axis])
    body = first
    while centre[body] >= enough:
        lower, upper = boxes[body, :3], boxes[body, 3:]
        reach = 0.01 * (upper - lower)
        meets = ((boxes[:, :3] <= upper + reach) & (boxes[:, 3:] >= lower - reach)).all(axis=1)
        lowest = int(np.where(meets, centre, np.inf).argmin())
        # what rounding alone lowers leads nowhere
        if centre[lowest] >= centre[body] - reach[axis]:
            return False
        body = lowest
    return True


@dataclass(frozen=True)
class Doubt:
    """A value outside the usual range.

    Attributes
    ----------
    text : the value, the usual range, and the likely unit
    impossible : no stone has such a value
    """

    text: str
    impossible: bool


def doubt_of(value: float, of: Range) -> Doubt | None:
    """Compare a value in SI units with its range; None if it is usual.

    Examples
    --------
    >>> doubt_of(2350.0, DENSITY)
    >>> print(doubt_of(2.2, DENSITY).text.partition("; ")[2])
    in g/cm³ (t/m³) it would be 2200 kg/m³
    """
    if of.usual[0] <= value <= of.usual[1]:
        return None
    impossible = not of.possible[0] <= value <= of.possible[1]
    unit = f" {of.unit}" if of.unit else ""
    found = "is not that of a stone" if impossible else "is unusual"
    text = f"{of.quantity} {value:.4g}{unit} {found}: {of.reason}"
    for name, meant in of.units if impossible else ():
        if of.usual[0] <= meant(value) <= of.usual[1]:
            text = f"{text}; in {name} it would be {meant(value):.4g}{unit}"
            break
    return Doubt(text, impossible)


def question_of_unit(lengths: Sequence[float], what: str) -> tuple[str, str] | None:
    """Ask for the unit of the lengths of stones of a file, most of which are not usual in metres.

    Parameters
    ----------
    lengths : of the stones, as if they were in metres
    what : they are called, in the plural

    Returns
    -------
    the question, and its answers; None if the lengths are usual, or usual in no unit

    Examples
    --------
    >>> print(*question_of_unit([41.0, 54.0, 60.0, 1.0], "outlines"), sep="; ")
    3 of 4 outlines have the size of stones in cm, not metres; give --unit cm, or --unit m if they are that large; the \
usual one would be 0.475 m long in cm, 0.0475 m in mm, 1.21 m in in
    """
    low, high = LENGTH.usual
    odd = [length for length in lengths if not low <= length <= high]
    if 2 * len(odd) <= len(lengths):
        return None
    usual = float(np.median(lengths))
    sizes = {unit: scale * usual for unit, scale in _UNITS.items() if low <= scale * usual <= high}
    metric = [unit for unit in _METRIC if unit in sizes]
    if not sizes:
        return None
    middle = math.sqrt(low * high)  # on a scale of ratios
    unit = min(metric or sizes, key=lambda name: abs(math.log(sizes[name] / middle)))
    order = [unit, *(name for name in sizes if name != unit)]
    would = ", ".join(f"{sizes[name]:.3g} m{' long' if name == unit else ''} in {name}" for name in order)
    return (
        f"{len(odd)} of {len(lengths)} {what} have the size of stones in {unit}, not metres",
        f"give --unit {unit}, or --unit m if they are that large; the usual one would be {would}",
    )
