"""Order, counts and shares of what a query finds; computed here, so that every database orders texts alike."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.query.api import attributes, find_rows
from archmodel.tables.entities import Entity
from archmodel.tables.knowledge import MasonMark
from ground.errors import UsageError

Row = Mapping[str, object]

MARK = "mark"
"""The attribute of which a stone can have several values, each of which counts."""


@dataclass(frozen=True)
class Tally:
    """Counts of groups of entities.

    Attributes
    ----------
    units : of the columns by name; None for texts
    rows : one for each group: its values, ``count``, and of shares the sum and the ``share`` of the whole, 0 to 1
    notes : limits of the answer, in words
    """

    units: Mapping[str, str | None]
    rows: Sequence[dict[str, object]]
    notes: tuple[str, ...] = ()


def sorted_rows(rows: Sequence[dict[str, object]], names: Sequence[str]) -> list[dict[str, object]]:
    """Sort rows by attributes, the first of which counts most; what is not known comes last.

    Parameters
    ----------
    names : of attributes in the rows; ``-depth``: the largest first

    >>> [row["depth"] for row in sorted_rows([{"depth": None}, {"depth": 0.4}, {"depth": 0.5}], ["-depth"])]
    [0.5, 0.4, None]
    """
    ordered = list(rows)
    for name in reversed(names):
        key = name.removeprefix("-")
        valued = [row for row in ordered if row[key] is not None]
        valued.sort(key=lambda row: row[key], reverse=name != key)  # type: ignore[arg-type, return-value]
        ordered = valued + [row for row in ordered if row[key] is None]
    return ordered


def count_by(
    session: Session,
    kind: str,
    where: Sequence[str] = (),
    by: Sequence[str] = (),
    *,
    share_of: str | None = None,
    only_in: str | None = None,
    run: int | None = None,
) -> Tally:
    """Count entities by the values of attributes, in the order of the values.

    Parameters
    ----------
    kind, where, run : as of `archmodel.query.api.find_rows`
    by : names of the attributes; each mason mark of a stone counts
    share_of : number whose sum and share are wanted too, e.g. area
    only_in : expression; only groups in which it is true of every entity are listed

    Raises
    ------
    UsageError
        if `share_of` is no number
    QueryError
        if an expression cannot be understood
    """
    attribute_of = {attribute.name: attribute for attribute in attributes(session, kind)}
    names = list(dict.fromkeys(["code", *by, *([share_of] if share_of else [])]))
    rows = find_rows(session, kind, where, run, names)
    if share_of is not None and not attribute_of[share_of.partition("@")[0]].is_number:
        raise UsageError(f"{share_of} is no number", remedy="name one, e.g. --share-of area")
    if MARK in by and kind_has_marks(attribute_of):
        rows = _with_each_mark(session, rows)
    groups: dict[tuple[object, ...], list[Row]] = {}
    for row in rows:
        groups.setdefault(tuple(row[name] for name in by), []).append(row)
    notes: list[str] = []
    if only_in is not None:
        groups = _only_in(session, (kind, where, run), only_in, groups, notes)
    counted = [
        {**dict(zip(by, values, strict=True)), "count": len(members)} for values, members in groups.items()
    ]
    units: dict[str, str | None] = {name: attribute_of[name.partition("@")[0]].unit for name in by} | {
        "count": "-"
    }
    if share_of is not None:
        _add_shares(counted, list(groups.values()), _total(rows, share_of), share_of)
        unknown = len({row["code"] for row in rows if row[share_of] is None})
        notes += [f"{share_of} of {unknown} is not known, and does not count"] if unknown else []
        units |= {share_of: attribute_of[share_of.partition("@")[0]].unit, "share": "-"}
    return Tally(units, sorted_rows(counted, by), tuple(notes))


def kind_has_marks(attribute_names: Mapping[str, object]) -> bool:
    """Return whether these are attributes of entities, which can have marks."""
    return MARK in attribute_names


def _with_each_mark(session: Session, rows: Sequence[dict[str, object]]) -> list[dict[str, object]]:
    """Repeat the row of an entity for each of its mason marks."""
    marked = (
        select(Entity.code, MasonMark.sign)
        .join(Entity, Entity.id == MasonMark.entity_id)
        .where(MasonMark.superseded_id.is_(None))
        .distinct()
    )
    signs: dict[object, list[str]] = {}
    for code, sign in session.execute(marked):
        signs.setdefault(code, []).append(str(sign))
    none: list[str | None] = [None]
    return [{**row, MARK: sign} for row in rows for sign in sorted(signs.get(row["code"], [])) or none]


def _only_in(
    session: Session,
    asked: tuple[str, Sequence[str], int | None],
    expression: str,
    groups: Mapping[tuple[object, ...], list[Row]],
    notes: list[str],
) -> dict[tuple[object, ...], list[Row]]:
    """Keep the groups in which an expression is true of every entity; note those in which it is not known of some."""
    kind, where, run = asked

    def codes(*more: str) -> set[object]:
        """Return the codes of the stones that fulfil further conditions."""
        return {row["code"] for row in find_rows(session, kind, [*where, *more], run, ["code"])}

    true, false = codes(expression), codes(f"not ({expression})")
    chosen: dict[tuple[object, ...], list[Row]] = {}
    for values, members in groups.items():
        inside = {row["code"] for row in members}
        if inside <= true:
            chosen[values] = members
        elif inside & true and not inside & false:
            named = ", ".join("none" if value is None else str(value) for value in values)
            notes.append(f"{named}: not known of {len(inside - true)}")
    return chosen


def _total(rows: Sequence[Row], name: str) -> float:
    """Sum a number over entities, each once."""
    values = {row["code"]: row[name] for row in rows}
    return sum(float(value) for value in values.values() if isinstance(value, int | float))


def _add_shares(
    counted: Sequence[dict[str, object]], groups: Sequence[Sequence[Row]], total: float, name: str
) -> None:
    """Add the sum of a number over each group, and its share of the total."""
    for row, members in zip(counted, groups, strict=True):
        amount = _total(members, name)
        row |= {name: amount, "share": amount / total if total else None}
