"""Order of units in time: equal ones merged, loops named, transitive reduction, levels.

Unit a is above b in the order if a chain of relations leads from a, the later, to b. Only those relations are drawn
that no longer chain implies.
"""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from archmodel.tables.stratigraphy import LATER
from ground.errors import UsageError


@dataclass(frozen=True)
class Link:
    """Stratigraphic relation by the codes of its units.

    Attributes
    ----------
    subject, relation, target : e.g. "103" "above" "102"
    author : whose opinion it is; None if not known
    """

    subject: str
    relation: str
    target: str
    author: str | None = None

    def __str__(self) -> str:
        return f"{self.subject} {self.relation} {self.target}"


@dataclass(frozen=True)
class Order:
    """Units in the order of time.

    Attributes
    ----------
    units : codes, each group of equal units by its first one, later ones first
    equal : codes of the units that are equal to each of these, itself included
    below : of each unit, the units that come directly before it: the transitive reduction
    earlier : of each unit, all that came before it, as bits by their places in `units`
    levels : of each unit, the length of the longest chain to a unit that nothing precedes
    beside : pairs that were built in one course of work, or at the same time
    redundant : number of relations that a longer chain implies
    """

    units: tuple[str, ...]
    equal: Mapping[str, tuple[str, ...]]
    below: Mapping[str, tuple[str, ...]]
    earlier: Mapping[str, int]
    levels: Mapping[str, int]
    beside: tuple[Link, ...]
    redundant: int

    def chain(self, unit: str, target: str) -> tuple[str, ...]:
        """Return the shortest chain of the reduction from a unit to an earlier one; () without any."""
        return _path(self.below, unit, target)


def check_order(links: Sequence[Link]) -> None:
    """Refuse relations by which a unit would be later than itself.

    Raises
    ------
    UsageError
        naming the loop
    """
    loop = find_loop(links)
    if loop:
        authors = {link.author for link in loop}
        remedy = 'take back the relation that is wrong ([[withdraw]] what = "relation")'
        if len(authors) > 1:
            names = ", ".join(sorted(author or "an unnamed author" for author in authors))
            remedy = f"these are opinions of {names}; see those of one author by --author NAME"
        raise UsageError(
            f"{loop[0].subject} would be later than itself: {', '.join(map(str, loop))}", remedy=remedy
        )


def find_loop(links: Sequence[Link]) -> tuple[Link, ...]:
    """Return the relations of a shortest loop through some unit, equal units taken as one; () without a loop."""
    merged = _merged(links)
    steps: dict[str, dict[str, Link]] = {}
    for link in links:
        if link.relation in LATER:
            first, second = merged.get(link.subject, link.subject), merged.get(link.target, link.target)
            steps.setdefault(first, {}).setdefault(second, link)
            steps.setdefault(second, {})
    below = {unit: tuple(targets) for unit, targets in steps.items()}
    rest = _cyclic(below)
    if not rest:
        return ()
    inside = {unit: tuple(target for target in below[unit] if target in rest) for unit in rest}
    # a walk downwards in what is left comes back to a unit of a loop
    unit, seen = next(iter(inside)), set[str]()
    while unit not in seen:
        seen.add(unit)
        unit = inside[unit][0]
    paths = ((target, *_path(inside, target, unit)[1:]) for target in inside[unit])
    nodes = (unit, *min((path for path in paths if path[-1] == unit), key=len))
    return tuple(steps[first][second] for first, second in pairwise(nodes))


def order_of(units: Iterable[str], links: Sequence[Link]) -> Order:
    """Order units in time.

    Parameters
    ----------
    units : codes of those that may be in no relation
    links : relations between units

    Raises
    ------
    UsageError
        naming the loop, if there is one
    """
    check_order(links)
    merged = _merged(links)
    codes = dict.fromkeys([*units, *(code for link in links for code in (link.subject, link.target))])
    equal: dict[str, tuple[str, ...]] = {}
    for code in codes:
        first = merged.get(code, code)
        equal[first] = (*equal.get(first, ()), code)
    steps: dict[str, dict[str, None]] = {unit: {} for unit in equal}
    for link in links:
        if link.relation in LATER:
            steps[merged.get(link.subject, link.subject)][merged.get(link.target, link.target)] = None
    sequence = _sorted({unit: tuple(targets) for unit, targets in steps.items()})
    place = {unit: k for k, unit in enumerate(sequence)}
    below, earlier, redundant = _reduced(sequence, steps, place)
    levels: dict[str, int] = {}
    for unit in reversed(sequence):
        levels[unit] = 1 + max((levels[target] for target in below[unit]), default=-1)
    beside = tuple(
        Link(merged.get(link.subject, link.subject), link.relation, merged.get(link.target, link.target))
        for link in links
        if link.relation in ("bonded_with", "contemporary_with")
    )
    return Order(tuple(sequence), equal, below, earlier, levels, tuple(dict.fromkeys(beside)), redundant)


def _reduced(
    sequence: Sequence[str], steps: Mapping[str, Mapping[str, None]], place: Mapping[str, int]
) -> tuple[dict[str, tuple[str, ...]], dict[str, int], int]:
    """Return the transitive reduction, all earlier units as bits, and the number of steps that were left out."""
    below: dict[str, tuple[str, ...]] = {}
    earlier: dict[str, int] = {}
    redundant = 0
    for unit in reversed(sequence):
        direct, reach = [], 0
        # the latest first: what a later one reaches is implied
        for target in sorted(steps[unit], key=place.__getitem__):
            if reach >> place[target] & 1:
                redundant += 1
                continue
            direct.append(target)
            reach |= earlier[target] | 1 << place[target]
        below[unit], earlier[unit] = tuple(direct), reach
    return below, earlier, redundant


def _merged(links: Iterable[Link]) -> dict[str, str]:
    """Return the first of the units that are equal to each unit that is equal to any."""
    parents: dict[str, str] = {}

    def root(code: str) -> str:
        """Return the code by which a group of contemporaries is known."""
        while parents.setdefault(code, code) != code:
            parents[code] = parents[parents[code]]
            code = parents[code]
        return code

    for link in links:
        if link.relation == "equal_to":
            first, second = sorted((root(link.subject), root(link.target)))
            parents[second] = first
    return {code: root(code) for code in list(parents)}


def _counts(below: Mapping[str, Sequence[str]]) -> dict[str, int]:
    counts = dict.fromkeys(below, 0)
    for targets in below.values():
        for target in targets:
            counts[target] += 1
    return counts


def _sorted(below: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the units, later ones first; those of a loop, and what only they reach, are left out."""
    counts = _counts(below)
    free = deque(unit for unit, count in counts.items() if not count)
    sequence = []
    while free:
        unit = free.popleft()
        sequence.append(unit)
        for target in below[unit]:
            counts[target] -= 1
            if not counts[target]:
                free.append(target)
    return sequence


def _cyclic(below: Mapping[str, Sequence[str]]) -> dict[str, None]:
    """Return the units of loops and between them: all of them have a unit above and one below among them."""
    rest = dict.fromkeys(below)
    for unit in _sorted(below):
        del rest[unit]
    above: dict[str, list[str]] = {unit: [] for unit in rest}
    for unit in rest:
        for target in below[unit]:
            if target in rest:
                above[target].append(unit)
    for unit in _sorted(above):
        del rest[unit]
    return rest


def _path(below: Mapping[str, Sequence[str]], start: str, end: str) -> tuple[str, ...]:
    """Return the units of a shortest chain downwards, both ends included."""
    before: dict[str, str | None] = {start: None}
    queue = deque([start])
    while queue:
        unit = queue.popleft()
        if unit == end:
            break
        for target in below.get(unit, ()):
            if target not in before:
                before[target] = unit
                queue.append(target)
    if end not in before:
        return ()
    path: list[str] = []
    step: str | None = end
    while step is not None:
        path.append(step)
        step = before[step]
    return tuple(reversed(path))
