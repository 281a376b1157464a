"""Rows of a building document, checked and converted to rows of tables."""

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from archmodel.exchange.sections import Section
from archmodel.exchange.values import Mismatch, quoted
from archmodel.query.grammar import parse
from archmodel.tables.hierarchy import Kind, kinds_below
from archmodel.tables.registered import Canon, RegisteredKind
from ground.errors import ExchangeError, QueryError


@dataclass(frozen=True, slots=True)
class Row:
    """A row and its place in the document.

    Attributes
    ----------
    values : by column; every column, null as None
    labels : the codes and names of what it refers to, by key, as far as the document says them
    later : references to rows of the same table that may not be there yet, by column; None in `values`
    document, path, line : its place
    """

    values: dict[str, Any]
    labels: dict[str, str]
    later: dict[str, Any]
    document: str
    path: str
    line: int

    def wrong(self, what: str, path: str = "", remedy: str | None = None) -> ExchangeError:
        """Return an error at this row, or within it."""
        return ExchangeError(what, where=f"{self.document}:{self.line} {self.path}{path}", remedy=remedy)


class RowReader:
    """Reader of the rows of one section.

    Parameters
    ----------
    section : the section
    document : its name, for errors
    kinds : names of the kinds that the document registers; filled from their section, which declares them before
        those of entities and structures are read
    absent : values of columns that a document of an older layout does not have
    """

    def __init__(
        self, section: Section, document: str, kinds: set[str], absent: Mapping[str, Any] | None = None
    ) -> None:
        self._section, self._document = section, document
        self._registered = kinds
        self._labels = {label.name for label in section.labels}
        self._fields = [
            (field.name, field.value.decode, field.required, field.within) for field in section.fields
        ]
        self._absent = absent or {}
        self._last: tuple[Any, ...] | None = None
        column = section.mapper.polymorphic_on
        self._kind = None if column is None else str(column.key)
        self._kinds = _known(section, kinds)

    def read(self, given: Any, index: int, line: int) -> Row:
        """Return the row at this index of the section, at this line.

        Raises
        ------
        ExchangeError
            if it is not a row of this table, or not after the one before it
        """
        row = Row({}, {}, {}, self._document, f"$.tables.{self._section.name}[{index}]", line)
        if type(given) is not dict:
            raise row.wrong(f"is {quoted(given)}, expected an object")
        for name, decode, required, within in self._fields:
            value = given.pop(name, self._absent.get(name))
            if value is None:
                if required:
                    raise row.wrong("is missing or null", f".{name}", "give a value")
                row.values[name] = None
                continue
            try:
                row.values[name] = decode(value)
            except Mismatch as wrong:
                raise row.wrong(wrong.what, f".{name}{wrong.path}") from None
            if within:
                row.later[name] = row.values[name]
        if given:
            self._take_labels(row, given)
        self._check_order(row)
        self._check_kind(row)
        return row

    def _take_labels(self, row: Row, rest: dict[str, Any]) -> None:
        for name, value in rest.items():
            if name not in self._labels:
                known = [field.name for field in self._section.fields] + sorted(self._labels)
                raise row.wrong(f"unknown key {name[:40]!a}", remedy=nearest(name, known))
            if type(value) is not str:
                raise row.wrong(f"is {quoted(value)}, expected a text", f".{name}")
            row.labels[name] = value

    def _check_order(self, row: Row) -> None:
        """Refuse rows that are not in the order of their keys; so none comes twice."""
        key = tuple(row.values[name] for name in self._section.key)
        if self._last is not None and key <= self._last:
            names = ", ".join(self._section.key)
            what = f"{names} {quoted_key(key)} comes after {quoted_key(self._last)}"
            raise row.wrong(what, remedy=f"sort the rows by {names}, each once")
        self._last = key
        # What refers to an earlier row can be stored as it is.
        for name, target in [*row.later.items()]:
            if target < key[0]:
                del row.later[name]
            else:
                row.values[name] = None

    def _check_kind(self, row: Row) -> None:
        if self._section.table is RegisteredKind.__table__:
            _check_registered(row)
            self._registered.add(row.values["name"])
        elif self._section.table is Canon.__table__:
            _check_proportions(row, "proportions")
            return
        if self._kind is None:
            return
        kind = row.values[self._kind]
        if kind not in self._kinds:
            remedy = nearest(kind, sorted(self._kinds))
            raise row.wrong(f"is {quoted(kind)}, which is no kind", f".{self._kind}", remedy)


def _known(section: Section, registered: set[str]) -> frozenset[str]:
    """Return the kinds of a table's rows: those built in, and those of its hierarchy that the document registers."""
    root = section.mapper.class_
    if not issubclass(root, Kind):
        return frozenset(map(str, section.mapper.polymorphic_map))
    return frozenset(
        name for name, cls in kinds_below(root).items() if cls.__users__ is None or name in registered
    )


def _check_registered(row: Row) -> None:
    """Refuse a registered kind that queries could not name, or with proportions that they could not parse."""
    name = row.values["name"]
    if not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", name):
        raise row.wrong(
            f"is {quoted(name)}, which is not the name of a kind", ".name", "as corner_merlon, say"
        )
    _check_proportions(row, "canon")


def _check_proportions(row: Row, key: str) -> None:
    """Refuse canonical proportions that queries could not parse."""
    try:
        if row.values[key] is not None:
            parse(row.values[key])
    except QueryError as error:
        raise row.wrong(str(error), f".{key}") from None


def quoted_key(key: tuple[Any, ...]) -> str:
    """Return a key as an error quotes it."""
    return ", ".join(quoted(part) for part in key)


def nearest(name: str, known: Sequence[str]) -> str:
    """Return the remedy for an unknown name: the known one that is most like it, or all."""
    near = difflib.get_close_matches(name[:40], known, n=1)
    return f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
