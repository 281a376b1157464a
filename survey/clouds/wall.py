"""The frame of a wall: where the plane of an orthophoto stands in space.

A place (s, t) of the plane is the point origin + s · right + t · up. It is written as TOML:

    origin = [12.4, 38.25, 0.0]
    right = [0.99255, 0.12187, 0.0]
    up = [0.0, 0.0, 1.0]          # optional; the default is as upright as `right` allows

Two points on the foot of a wall, from left to right, state an upright wall: s begins at the first, t is the height z.
"""

import math
import tomllib
from pathlib import Path

import numpy as np

from ground.errors import SurveyError, UsageError
from survey.arrays import Array
from survey.conventions import PER_MILLE
from survey.quality.facades import WallPlane

Wall = WallPlane
"""Frame of a wall: origin, and axes to the right, up and outwards."""

_SQUARE = PER_MILLE  # cosine between axes up to which they were rounded, not meant to be oblique
_EXAMPLE = "write: origin = [X, Y, Z], right = [DX, DY, DZ], up = [DX, DY, DZ]"


def read_wall(text: str) -> Wall:
    """Read a frame from a file, or from two points on the foot of an upright wall.

    Parameters
    ----------
    text : path of a TOML file, or "X,Y X,Y"

    Raises
    ------
    UsageError
        if it is neither
    SurveyError
        if the frame is not one

    Examples
    --------
    >>> read_wall("2,1 6,1").axes.tolist()
    [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]
    """
    path = Path(text)
    if path.is_file():
        return _of_file(path)
    foot = _numbers(text)
    if foot is None:
        remedy = 'name a file, or two points on the foot of the wall from left to right: "X,Y X,Y"'
        raise UsageError(f"{text!r} is no file", where="--wall", remedy=remedy)
    along = foot[2:] - foot[:2]
    length = float(np.hypot(*along))
    if not length > 0.0:
        raise UsageError("both points are the same", where="--wall", remedy="give the two ends of the wall")
    return _frame(np.array([*foot[:2], 0.0]), np.array([*along / length, 0.0]), None, "--wall")


def wall_lines(wall: Wall) -> str:
    """Write a frame as TOML, to every digit."""
    rows = {"origin": wall.origin, "right": wall.axes[0], "up": wall.axes[1]}
    lines = [f"{name} = [{', '.join(repr(float(one) + 0.0) for one in row)}]" for name, row in rows.items()]
    return "\n".join(
        ["# frame of a wall: the place (s, t) of its plane is origin + s right + t up", *lines, ""]
    )


def _numbers(text: str) -> Array | None:
    try:
        values = [float(word) for point in text.split() for word in point.split(",")]
    except ValueError:
        return None
    return np.array(values) if len(values) == 4 and len(text.split()) == 2 else None


def _of_file(path: Path) -> Wall:
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise SurveyError(f"cannot be read as TOML: {error}", where=str(path), remedy=_EXAMPLE) from error
    if unknown := set(content) - {"origin", "right", "up"}:
        raise SurveyError(f"unknown key {sorted(unknown)[0]!r}", where=str(path), remedy=_EXAMPLE)
    vectors: dict[str, Array] = {}
    for name in ("origin", "right", "up"):
        value = content.get(name)
        if value is None and name == "up":
            continue
        numbers = value if isinstance(value, list) else []
        if len(numbers) != 3 or not all(
            type(number) in (int, float) and math.isfinite(number) for number in numbers
        ):
            raise SurveyError(f"{name} is {value!r}", where=str(path), remedy=_EXAMPLE)
        vectors[name] = np.array(numbers, dtype=np.float64)
    return _frame(vectors["origin"], vectors["right"], vectors.get("up"), str(path))


def _frame(origin: Array, right: Array, up: Array | None, where: str) -> Wall:
    if not np.linalg.norm(right) > 0.0 or (up is not None and not np.linalg.norm(up) > 0.0):
        raise SurveyError("a direction without length", where=where, remedy=_EXAMPLE)
    right = right / np.linalg.norm(right)
    if up is None:
        up = np.array([0.0, 0.0, 1.0]) - right[2] * right
        if np.linalg.norm(up) < 0.1:
            raise SurveyError("right is upright, and up is missing", where=where, remedy=_EXAMPLE)
    up = up / np.linalg.norm(up)
    if abs(float(up @ right)) > _SQUARE:
        angle = float(np.degrees(np.arccos(up @ right)))
        raise SurveyError(f"{angle:.2f}° between right and up", where=where, remedy="they must be square")
    up = up - (up @ right) * right
    up /= np.linalg.norm(up)
    return Wall(origin, np.array([right, up, np.cross(right, up)]))
