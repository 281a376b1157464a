"""Relative and absolute dates of units, and where the matrix contradicts the years of phases.

A unit cannot be older than what it lies on: the latest beginning among the units below it is its terminus post quem.
What lies on it cannot be older than it: the earliest end among the units above is its terminus ante quem.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from archmodel.stratigraphy.order import Link, Order
from archmodel.tables.stratigraphy import SYMMETRIC


@dataclass(frozen=True)
class Dated:
    """Phase of a unit.

    Attributes
    ----------
    phase : its name; empty: of none
    begins, ends : years; None if not known
    """

    phase: str
    begins: int | None
    ends: int | None

    def __str__(self) -> str:
        years = "–".join("?" if year is None else str(year) for year in (self.begins, self.ends))
        return ", ".join(
            [*([f"phase {self.phase}"] if self.phase else []), *([years] if years != "?–?" else [])]
        )


@dataclass(frozen=True)
class Bounds:
    """Years between which a unit came about, by its own phase and by those of units above and below.

    Attributes
    ----------
    begins, begins_by : earliest year, and the unit whose phase says so; None if nothing does
    ends, ends_by : latest year, and the unit whose phase says so
    """

    begins: int | None = None
    begins_by: str | None = None
    ends: int | None = None
    ends_by: str | None = None


@dataclass(frozen=True)
class Contradiction:
    """Two units whose relation and dates cannot both be right.

    Attributes
    ----------
    unit, target : the later and the earlier by the matrix; or two of the same time
    chain : units that lead from one to the other
    text : in words
    """

    unit: str
    target: str
    chain: tuple[str, ...]
    text: str


def date_bounds(order: Order, dates: Mapping[str, Dated]) -> Mapping[str, Bounds]:
    """Return the years of each unit that its phase and the matrix allow, by the first code of equal units."""
    earliest = _spread(order.units[::-1], order.below, _begins(order, dates), max)
    above: dict[str, list[str]] = {unit: [] for unit in order.units}
    for unit, targets in order.below.items():
        for target in targets:
            above[target].append(unit)
    latest = _spread(order.units, above, _ends(order, dates), min)
    nothing = (None, None)
    return {
        unit: Bounds(*(earliest.get(unit) or nothing), *(latest.get(unit) or nothing)) for unit in order.units
    }


def contradictions(
    order: Order, links: Sequence[Link], dates: Mapping[str, Dated]
) -> tuple[Contradiction, ...]:
    """Return where phases and matrix contradict each other.

    Each unit whose phase ended before a unit below it began is named once, with the latest of those; so are equal,
    bonded and contemporary units whose phases exclude each other, and those of which one is above the other.
    """
    found = []
    begins, ends = _begins(order, dates), _ends(order, dates)
    earliest = _spread(order.units[::-1], order.below, begins, max, itself=False)
    for unit in order.units:
        before, after = earliest.get(unit), ends.get(unit)
        if before is None or after is None or after[0] >= before[0]:
            continue
        group = next(code for code in order.units if before[1] in order.equal[code])
        chain = order.chain(unit, group)
        text = f"{_named(after[1], dates)} lies later than {_named(before[1], dates)}: {' > '.join(chain)}"
        found.append(Contradiction(after[1], before[1], chain, text))
    return (*found, *_same_time(order, links, dates))


def _same_time(order: Order, links: Sequence[Link], dates: Mapping[str, Dated]) -> list[Contradiction]:
    """Return the pairs of one time whose dates exclude each other, or of which one is above the other."""
    found = []
    for link in links:
        first, second = dates.get(link.subject), dates.get(link.target)
        if link.relation not in SYMMETRIC or first is None or second is None:
            continue
        if _excludes(first, second) or _excludes(second, first):
            pair = f"{_named(link.subject, dates)} and {_named(link.target, dates)}"
            text = f"{pair}: they are {link.relation.replace('_', ' ')}, and their years exclude each other"
            found.append(Contradiction(link.subject, link.target, (), text))
    for link in order.beside:
        for first_code, second_code in ((link.subject, link.target), (link.target, link.subject)):
            if chain := order.chain(first_code, second_code)[1:]:
                steps = " > ".join((first_code, *chain))
                text = f"{link}, but one is later than the other: {steps}"
                found.append(Contradiction(first_code, second_code, (first_code, *chain), text))
    return found


def _excludes(early: Dated, late: Dated) -> bool:
    return early.ends is not None and late.begins is not None and early.ends < late.begins


def _named(code: str, dates: Mapping[str, Dated]) -> str:
    return f"{code} ({dates[code]})"


_Year = tuple[int, str]


def _begins(order: Order, dates: Mapping[str, Dated]) -> dict[str, _Year]:
    years = {
        unit: [(year, code) for code in group if code in dates and (year := dates[code].begins) is not None]
        for unit, group in order.equal.items()
    }
    return {unit: max(values) for unit, values in years.items() if values}


def _ends(order: Order, dates: Mapping[str, Dated]) -> dict[str, _Year]:
    years = {
        unit: [(year, code) for code in group if code in dates and (year := dates[code].ends) is not None]
        for unit, group in order.equal.items()
    }
    return {unit: min(values) for unit, values in years.items() if values}


def _spread(
    sequence: Sequence[str],
    neighbours: Mapping[str, Sequence[str]],
    years: Mapping[str, _Year],
    choose: Callable[[Sequence[_Year]], _Year],
    itself: bool = True,
) -> dict[str, _Year]:
    """Carry years along chains, units in an order in which their neighbours come first."""
    with_own: dict[str, _Year] = {}
    without: dict[str, _Year] = {}
    for unit in sequence:
        carried = [with_own[target] for target in neighbours[unit] if target in with_own]
        if carried:
            without[unit] = choose(carried)
        values = [*carried, *([years[unit]] if unit in years else [])]
        if values:
            with_own[unit] = choose(values)
    return with_own if itself else without
