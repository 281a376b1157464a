"""Order of easting and northing in a list of points: what in the list speaks for it, and what against it.

Exchanged axes mirror a wall, and no residual shows it. Four things tell the order apart from the words of the user:
words of the file's name and titles, coordinates of a national grid, places that the header file states, and the habits
of drawing corners counter-clockwise and of numbering stones from left to right, as seen from the station.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from ground.errors import SurveyError
from ground.tables.grids import exchanged_grid
from ground.units import DECI
from survey.arrays import Array
from survey.conventions import FARTHEST, MOST, TENTH
from survey.formats.tables.point_table import TableStone
from survey.geometry.solids import area_vector
from survey.records.survey import SurveyHead

ORDERS = {"pnezd": "northing first", "penzd": "easting first"}
"""Order of the two level coordinates by format."""

_WORDS = {"pnezd": ("pnezd", "pnez", "nez", "pneh", "neh"), "penzd": ("penzd", "penz", "enz", "penh", "enh")}
_SAME = DECI  # distance within which two lists place a station at one point: it is set up anew there [m]
_PAIRS = 6  # least pairs of neighbouring stones, and least corners' turns, for a habit: by chance 1 in 64
_HABIT = 1.0 - TENTH  # share of stones from which a habit is one: the others are slips
_LEVEL = MOST  # horizontal share of a face's area below which it lies: left and right are not a wall's [-]
_NUMBER = re.compile(r"(.*?)(\d+)([^\d]*)")


def exchanged_station(place: Array, elsewhere: Array) -> bool:
    """Return whether two lists have a station at one place if the axes of one are exchanged, and only then."""
    return _distance(place, elsewhere) > _SAME >= _distance(_turned(place), elsewhere)


def exchanged(places: Array, elsewhere: Array) -> bool:
    """Return whether places are out of reach of others, and within it if easting and northing are exchanged.

    Parameters
    ----------
    places, elsewhere : (n, 3), (m, 3) of one survey [m]
    """
    if not len(places) or not len(elsewhere):
        return False
    here, there = np.median(places, axis=0), np.median(elsewhere, axis=0)
    return _distance(here, there) > FARTHEST >= _distance(_turned(here), there)


def _turned(place: Array) -> Array:
    return np.array([place[1], place[0], place[2]])


def _distance(place: Array, elsewhere: Array) -> float:
    return float(np.linalg.norm(np.asarray(place) - np.asarray(elsewhere)))


def other_order(form: str) -> str:
    """Return the other of the two formats of `ORDERS`."""
    return next(order for order in ORDERS if order != form)


def order_in_words(text: str) -> str:
    """Return the format whose order a text states in a word such as ``PENZD``; empty if it states none, or both.

    >>> order_in_words("Nordwand_PENZD"), order_in_words("wall")
    ('penzd', '')
    """
    words = set(re.split(r"[^a-z]+", text.casefold()))
    stated = [order for order, spellings in _WORDS.items() if words & set(spellings)]
    return stated[0] if len(stated) == 1 else ""


@dataclass
class Outlines:
    """Habits of drawing and numbering the faces of a list, as seen from their stations.

    Attributes
    ----------
    turns : of each face, +1 if its corners run counter-clockwise, -1 if clockwise
    steps : from each stone to the next in number, +1 to the right, -1 to the left
    """

    turns: list[float] = field(default_factory=list)
    steps: list[float] = field(default_factory=list)
    _before: dict[str, tuple[int, Array]] = field(default_factory=dict)

    def add(self, code: str, corners: Array, viewpoint: Array) -> None:
        """Add a face; lying ones tell nothing.

        Parameters
        ----------
        code : of the stone
        corners : (n, 3) in the order measured [m]
        viewpoint : (3,) [m]
        """
        area, centre = area_vector(corners), corners.mean(axis=0)
        level, size = float(np.hypot(area[0], area[1])), float(np.linalg.norm(area))
        if size == 0.0 or level < _LEVEL * size:
            return
        turn = float(np.sign(area @ (viewpoint - centre)))
        self.turns.append(turn)
        match = _NUMBER.fullmatch(code)
        if match is None:
            return
        course, number = match[1] + "\0" + match[3], int(match[2])
        before = self._before.get(course)
        self._before[course] = number, centre
        if before is not None and abs(number - before[0]) == 1:
            right = turn * np.array([-area[1], area[0], 0.0])
            self.steps.append(float(np.sign(right @ (centre - before[1])) * (number - before[0])))

    def habit(self) -> int:
        """Return 1 if nearly all run counter-clockwise and from left to right, -1 if the other way, 0 otherwise."""
        if min(len(self.turns), len(self.steps)) < _PAIRS:
            return 0
        for sign in (1, -1):
            if all(np.mean(np.array(seen) == sign) >= _HABIT for seen in (self.turns, self.steps)):
                return sign
        return 0


def outlines_of(stones: Iterable[TableStone], head: SurveyHead) -> Outlines:
    """Return how faces are drawn and numbered, where their station is clear."""
    outlines = Outlines()
    for stone in stones:
        try:
            viewpoint = head.viewpoint(stone.station)
        except SurveyError:  # told when the stone is made
            continue
        if viewpoint is not None and stone.error is None:
            outlines.add(stone.code, np.array(stone.vertices).reshape(-1, 3), viewpoint)
    return outlines


def both_orders(form: str, names: Sequence[str], codes: str | None) -> str:
    """Return the options for either order of the axes.

    Parameters
    ----------
    form : format of a list; empty for a table with names of columns
    names : of the columns of x and y in such a table
    codes : template of the descriptions, where the user gave none
    """
    if not form:
        x, y = names
        return f'give --columns "x={y},y={x}" if {x} is the northing, or --columns "x={x},y={y}" if it is the easting'
    other = other_order(form)
    easting, northing = (3, 2) if form == "pnezd" else (2, 3)
    theirs, ours = (ORDERS[order].removesuffix(" first") for order in (other, form))
    return (
        f"give --format {other} if the {theirs} comes first; if the {ours} does, say so by the numbers of the columns: "
        f'--format csv --columns "name=1,x={easting},y={northing},z=4,description=5"'
        + (f' --codes "{codes}"' if codes else "")
    )


@dataclass(frozen=True)
class AxisEvidence:
    """Evidence of a list for and against the order of its axes.

    Attributes
    ----------
    form : format it is read as, `pnezd` or `penzd`; empty for a table with names of columns
    words : name of the file, and titles
    places : (n, 3) of corners [m]
    outlines : habits of their drawing
    stated : (m, 3) places that the header file states [m]
    """

    form: str
    words: Sequence[str]
    places: Array
    outlines: Outlines
    stated: Array

    def against(self) -> Iterator[str]:
        """Iterate over what speaks for the other order, in words."""
        for text in self.words if self.form else ():
            if order_in_words(text) not in ("", self.form):
                yield f"{text[:60]!r} says {order_in_words(text).upper()}"
        if grid := exchanged_grid(self.places):
            yield f"coordinates are those of {grid} only with the axes exchanged"
        if exchanged(self.places, self.stated):
            yield f"stations of the header file are over {FARTHEST:g} m away unless the axes are exchanged"
        if self.outlines.habit() < 0:
            yield "seen from the station, corners run clockwise and numbers rise from right to left, as in a mirror"

    def speaks_for(self) -> bool:
        """Return whether anything speaks for the order as it is read."""
        return (
            any(order_in_words(text) == self.form for text in self.words)
            or bool(exchanged_grid(self.places[:, [1, 0, 2]]))
            or exchanged(self.places[:, [1, 0, 2]], self.stated)
            or self.outlines.habit() > 0
        )
