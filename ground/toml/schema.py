"""Keys of TOML tables, and their check: unknown, missing and wrong values are reported by name and line."""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import date
from difflib import get_close_matches
from enum import Enum
from math import isfinite
from typing import Any, NoReturn

from ground.errors import SceneError
from ground.toml.lines import Path, line_of


class _Required(Enum):
    REQUIRED = "required"


REQUIRED = _Required.REQUIRED

# whole numbers of TOML are unbounded; from here on they are not taken for floating-point ones
_HUGE = int(sys.float_info.max)


class ValueKind(Enum):
    """Type of the value of a key, in the words of an error message."""

    NUMBER = "a number"
    INTEGER = "a whole number"
    BOOLEAN = "true or false"
    TEXT = "a text in quotes"
    TEXTS = "a list of texts in quotes"
    STONES = "a list of codes or expressions in quotes"
    GROUPS = "two lists of codes or expressions in quotes"
    VECTOR = "a list of three numbers"
    NUMBERS = "a list of numbers"
    ROWS = "a list of lists of three numbers"
    HISTORY = "a number or a table { time = […], value = […] }"
    VECTOR_HISTORY = "a list of three numbers or a table { time = […], value = [[…], …] }"
    DATE = "a date without quotes, e.g. 2024-05-31"
    YEAR = 'a year, or a date in quotes such as "circa 1400", "../1400", "1380/1420", "14XX"'
    TABLE = "a table { name = value, … }"


@dataclass(frozen=True)
class Key:
    """One key of a table.

    Attributes
    ----------
    name : as written in the file
    kind : type of its value
    doc : meaning, one sentence
    unit : of the value; "-" for a ratio
    default : used when the key is absent; REQUIRED if it must be given; None if absence has its own meaning
    above, at_least, below, at_most : bounds of a number
    choices : texts or numbers allowed; any if empty
    """

    name: str
    kind: ValueKind
    doc: str
    unit: str = ""
    default: object = REQUIRED
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    choices: tuple[str | int, ...] = ()


@dataclass(frozen=True)
class TomlDocument:
    """Path and line numbers of a TOML text, so that errors can name them.

    Attributes
    ----------
    path : as the user gave it
    lines : line of each key
    """

    path: str
    lines: Mapping[Path, int] = field(default_factory=dict)

    def where(self, *path: str) -> str:
        """Return ``file:line`` of a key."""
        return f"{self.path}:{line_of(self.lines, path)}"

    def fail(self, what: str, *path: str, remedy: str | None = None) -> NoReturn:
        """Raise a SceneError at a key."""
        raise SceneError(what, where=self.where(*path), remedy=remedy)

    @contextmanager
    def at(self, *path: str) -> Iterator[None]:
        """Make a SceneError raised in the with-block name this key, unless it names a place in the file."""
        try:
            yield
        except SceneError as error:
            if (error.where or "").startswith(f"{self.path}:"):
                raise
            self.fail(error.what, *path, remedy=error.remedy)


def check_table(
    document: TomlDocument, table: Path, given: Mapping[str, object], keys: Iterable[Key], title: str = ""
) -> dict[str, object]:
    """Return the values of all keys of one table, with defaults filled in.

    Parameters
    ----------
    table : its path
    given : its contents
    title : name of the table in messages; by default its header

    Raises
    ------
    SceneError : at the first key that is unknown, missing or wrong

    >>> friction = Key("friction", ValueKind.NUMBER, "Coulomb's coefficient μ.", "-", 0.6, at_least=0)
    >>> check_table(TomlDocument("scene.toml"), ("contact",), {"friction": 1}, [friction])
    {'friction': 1.0}
    >>> check_table(TomlDocument("scene.toml"), ("contact",), {"frictoin": 1}, [friction])
    Traceback (most recent call last):
    ground.errors.SceneError: scene.toml:1: unknown key 'frictoin' in [contact]; did you mean 'friction'?
    """
    known = {key.name: key for key in keys}
    title = title or f"[{'.'.join(table)}]"
    for name in given:
        if name not in known:
            document.fail(f"unknown key {name!r} in {title}", *table, name, remedy=nearest(name, known))
    values: dict[str, object] = {}
    for name, key in known.items():
        if name in given:
            values[name] = _checked(document, (*table, name), given[name], key)
        elif key.default is REQUIRED:
            document.fail(f"{title} has no {name!r}", *table, remedy=f"give {name}: {_expected(key)}")
        else:
            values[name] = key.default
    return values


def tables_of(
    document: TomlDocument, given: Mapping[str, Any], name: str, path: Path = ()
) -> list[tuple[Path, dict[str, Any]]]:
    """Return the path and the contents of each table [[name]]; none where there is no such array.

    Parameters
    ----------
    given : the table that has the array
    path : its path

    Raises
    ------
    SceneError : it is no array of tables
    """
    tables = given.get(name, [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        header = ".".join((*(step for step in path if not step.isdecimal()), name))
        document.fail(
            f"{name!r} is not a list of tables", *path, name, remedy=f"write [[{header}]] above each"
        )
    return [((*path, name, str(index)), table) for index, table in enumerate(tables)]


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the remedy for an unknown name: the nearest known ones, or all of them."""
    names = sorted(known)
    close = get_close_matches(name, names, n=2, cutoff=0.6)
    if close:
        return "did you mean " + " or ".join(repr(one) for one in close) + "?"
    return "known here: " + ", ".join(names[:20]) + (", …" if len(names) > 20 else "")


def _checked(document: TomlDocument, path: Path, value: object, key: Key) -> object:
    typed = _typed(value, key.kind)
    if typed is None:
        document.fail(
            f"{path[-1]} = {_shown(value)} is not {key.kind.value}", *path, remedy=f"give {_expected(key)}"
        )
    for number in _numbers(typed):
        if not _within(number, key):
            document.fail(
                f"{path[-1]} = {_shown(value)} is out of range", *path, remedy=f"give {_expected(key)}"
            )
    if key.choices and typed not in key.choices:
        document.fail(
            f"{path[-1]} = {_shown(value)} is unknown",
            *path,
            remedy=nearest(str(value), map(str, key.choices)),
        )
    return typed


def _typed(value: object, kind: ValueKind) -> object | None:
    """Return the value as the type of its kind, or None if it is of another."""
    match kind:
        case ValueKind.NUMBER:
            return float(value) if _is_number(value) else None  # type: ignore[arg-type]
        case ValueKind.INTEGER:
            return value if isinstance(value, int) and not isinstance(value, bool) else None
        case ValueKind.BOOLEAN:
            return value if isinstance(value, bool) else None
        case ValueKind.TEXT:
            return value if isinstance(value, str) and value.strip() else None
        case ValueKind.TEXTS:
            return _list_of(value, lambda entry: entry if isinstance(entry, str) and entry.strip() else None)
        case ValueKind.STONES:
            return _typed(value, ValueKind.TEXTS) or None
        case ValueKind.GROUPS:
            groups = _list_of(
                value, lambda entry: _typed([entry] if isinstance(entry, str) else entry, ValueKind.STONES)
            )
            return groups if groups is not None and len(groups) == 2 else None
        case ValueKind.NUMBERS:
            return _list_of(value, lambda entry: _typed(entry, ValueKind.NUMBER))
        case ValueKind.VECTOR:
            vector = _typed(value, ValueKind.NUMBERS)
            return vector if isinstance(vector, tuple) and len(vector) == 3 else None
        case ValueKind.ROWS:
            return _list_of(value, lambda entry: _typed(entry, ValueKind.VECTOR))
        case ValueKind.HISTORY | ValueKind.VECTOR_HISTORY:
            constant = ValueKind.NUMBER if kind is ValueKind.HISTORY else ValueKind.VECTOR
            return value if isinstance(value, dict) else _typed(value, constant)
        case ValueKind.DATE:
            return value if type(value) is date else None
        case ValueKind.YEAR:
            return value if isinstance(value, str) else _typed(value, ValueKind.INTEGER)
        case ValueKind.TABLE:
            return value if isinstance(value, dict) else None


def _list_of(value: object, typed: Callable[[object], object | None]) -> tuple[object, ...] | None:
    """Return all entries of a list as `typed` gives them, or None if it gives None for any."""
    entries = [typed(one) for one in value] if isinstance(value, list) else [None]
    return None if any(entry is None for entry in entries) else tuple(entries)


def _numbers(typed: object) -> Iterator[int | float]:
    """Yield all numbers in a value; its bounds are those of each."""
    if isinstance(typed, tuple):
        for one in typed:
            yield from _numbers(one)
    elif isinstance(typed, (int, float)) and not isinstance(typed, bool):
        yield typed


def _is_number(value: object) -> bool:
    if isinstance(value, bool):
        return False
    return isinstance(value, float) or (isinstance(value, int) and abs(value) < _HUGE)


def _within(number: float, key: Key) -> bool:
    return (
        isfinite(number)
        and (key.above is None or number > key.above)
        and (key.at_least is None or number >= key.at_least)
        and (key.below is None or number < key.below)
        and (key.at_most is None or number <= key.at_most)
    )


def _expected(key: Key) -> str:
    """Return the expected value in words: type, unit and bounds."""
    if key.choices:
        return " or ".join(
            f'"{choice}"' if isinstance(choice, str) else str(choice) for choice in key.choices
        )
    bounds = [
        f"{words} {bound:g}"
        for words, bound in (
            ("greater than", key.above),
            ("at least", key.at_least),
            ("less than", key.below),
            ("at most", key.at_most),
        )
        if bound is not None
    ]
    unit = f" [{key.unit}]" if key.unit else ""
    return " and ".join([f"{key.kind.value}{unit}", *bounds]).replace(" and ", ", ", 1)


def _shown(value: object) -> str:
    text = repr(value).lower() if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:57] + "…"
