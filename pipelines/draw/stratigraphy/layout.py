"""Places of the units of a matrix: rows by level, later ones on top, few crossings.

Chains that pass a row without a unit in it get a place there, so that their lines run between the boxes. Rows are
ordered by the means of their neighbours' places (barycentres), downwards and upwards in turn.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from archmodel.stratigraphy.order import Order

SWEEPS = 4
"""Passes over all rows; more of them change little."""

PASSING = 0.3
"""Room of a passing line beside that of a box."""

Key = str | tuple[str, str, int]
"""A unit; or a line from one unit to another where it passes a row."""


@dataclass(frozen=True)
class Layout:
    """Places of units and of lines.

    Attributes
    ----------
    across : place of each unit and of each passing line along its row, in widths of a box
    rows : units and passing lines of each row, in their order; the first is on top
    lines : of each relation that is drawn, the units and passing lines that it leads through, downwards
    width : of all, in widths of a box
    """

    across: Mapping[Key, float]
    rows: Sequence[Sequence[Key]]
    lines: Sequence[Sequence[Key]]
    width: float


def layout_of(order: Order) -> Layout:
    """Place the units of an order."""
    height = 1 + max(order.levels.values(), default=0)
    rows: list[list[Key]] = [[] for _ in range(height)]
    for unit in order.units:
        rows[height - 1 - order.levels[unit]].append(unit)
    lines: list[list[Key]] = []
    for unit, targets in order.below.items():
        for target in targets:
            top, bottom = height - 1 - order.levels[unit], height - 1 - order.levels[target]
            passing: list[Key] = [(unit, target, row) for row in range(top + 1, bottom)]
            for row, key in enumerate(passing, start=top + 1):
                rows[row].append(key)
            lines.append([unit, *passing, target])
    above, below = _neighbours(lines)
    for sweep in range(SWEEPS):
        _sweep(rows, above if sweep % 2 == 0 else below, downwards=sweep % 2 == 0)
    across = _across(rows, above, below)
    first = min(across.values(), default=0.0)
    placed = {key: x - first for key, x in across.items()}
    return Layout(placed, rows, lines, 1.0 + max(placed.values(), default=0.0))


def _neighbours(lines: Sequence[Sequence[Key]]) -> tuple[dict[Key, list[Key]], dict[Key, list[Key]]]:
    above: dict[Key, list[Key]] = {}
    below: dict[Key, list[Key]] = {}
    for line in lines:
        for upper, lower in pairwise(line):
            below.setdefault(upper, []).append(lower)
            above.setdefault(lower, []).append(upper)
    return above, below


def _sweep(rows: Sequence[list[Key]], neighbours: Mapping[Key, Sequence[Key]], downwards: bool) -> None:
    """Order each row by the mean place of its neighbours in the row before."""
    place = {key: float(k) for row in rows for k, key in enumerate(row)}
    for row in rows if downwards else reversed(rows):
        means = {
            key: sum(place[neighbour] for neighbour in neighbours[key]) / len(neighbours[key])
            if neighbours.get(key)
            else place[key]
            for key in row
        }
        row.sort(key=means.__getitem__)
        place.update((key, float(k)) for k, key in enumerate(row))


def _across(
    rows: Sequence[Sequence[Key]], above: Mapping[Key, Sequence[Key]], below: Mapping[Key, Sequence[Key]]
) -> dict[Key, float]:
    """Return places along the rows near the means of the neighbours, without overlaps."""
    across: dict[Key, float] = {}
    for row in rows:
        x = 0.0
        for key in row:
            across[key] = x
            x += _room(key)
    for sweep in range(SWEEPS):
        neighbours = (above, below)[sweep % 2]
        for row in rows if sweep % 2 == 0 else reversed(rows):
            wanted = [
                sum(across[neighbour] for neighbour in neighbours[key]) / len(neighbours[key])
                if neighbours.get(key)
                else across[key]
                for key in row
            ]
            across.update(zip(row, _apart(row, wanted), strict=True))
    return across


def _apart(row: Sequence[Key], wanted: Sequence[float]) -> list[float]:
    """Return places at least a box apart, halfway between pushing all to the right and to the left."""
    right, left = list(wanted), list(wanted)
    for k in range(1, len(row)):
        right[k] = max(wanted[k], right[k - 1] + _gap(row[k - 1], row[k]))
    for k in range(len(row) - 2, -1, -1):
        left[k] = min(wanted[k], left[k + 1] - _gap(row[k], row[k + 1]))
    return [(a + b) / 2.0 for a, b in zip(right, left, strict=True)]


def _room(key: Key) -> float:
    return 1.0 if isinstance(key, str) else PASSING


def _gap(first: Key, second: Key) -> float:
    return (_room(first) + _room(second)) / 2.0
