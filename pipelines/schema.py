"""What a TOML table may hold, and its check: what is unknown, missing or wrong, by name and line."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from enum import Enum
from math import isfinite
from typing import NoReturn

from moma.errors import SceneError
from pipelines.toml_lines import Path, line_of

__all__ = ["REQUIRED", "Document", "Key", "Kind", "check_table", "nearest"]


class _Required(Enum):
    REQUIRED = "required"


REQUIRED = _Required.REQUIRED


class Kind(Enum):
    """What the value of a key is; the value says it in the words of an error message."""

    NUMBER = "a number"
    INTEGER = "a whole number"
    BOOLEAN = "true or false"
    TEXT = "a text in quotes"
    TEXTS = "a list of texts in quotes"
    VECTOR = "a list of three numbers"


@dataclass(frozen=True)
class Key:
    """One key of a table.

    Attributes
    ----------
    name : as written in the file
    kind : type of its value
    doc : what it means, one sentence
    unit : of the value; "-" for a ratio
    default : used when the key is absent; REQUIRED if it must be given; None if absence has its own meaning
    above, at_least, below, at_most : bounds of a number
    choices : the texts allowed; any if empty
    """

    name: str
    kind: Kind
    doc: str
    unit: str = ""
    default: object = REQUIRED
    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    choices: tuple[str, ...] = ()


@dataclass(frozen=True)
class Document:
    """A TOML text that was read, so that errors can name file and line.

    Attributes
    ----------
    path : as the user gave it
    lines : line of each key
    """

    path: str
    lines: Mapping[Path, int] = field(default_factory=dict)

    def where(self, *path: str) -> str:
        """``file:line`` of a key."""
        return f"{self.path}:{line_of(self.lines, path)}"

    def fail(self, what: str, *path: str, remedy: str | None = None) -> NoReturn:
        """Raise a SceneError at a key."""
        raise SceneError(what, where=self.where(*path), remedy=remedy)


def check_table(
    document: Document, table: Path, given: Mapping[str, object], keys: Iterable[Key]
) -> dict[str, object]:
    """Values of all keys of one table, defaults filled in; raises SceneError at the first that is wrong."""
    known = {key.name: key for key in keys}
    title = f"[{'.'.join(table)}]"
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


def nearest(name: str, known: Iterable[str]) -> str:
    """The remedy for an unknown name: the nearest known ones, or all of them."""
    names = sorted(known)
    close = get_close_matches(name, names, n=2, cutoff=0.6)
    if close:
        return "did you mean " + " or ".join(repr(one) for one in close) + "?"
    return "known here: " + ", ".join(names[:20]) + (", …" if len(names) > 20 else "")


def _checked(document: Document, path: Path, value: object, key: Key) -> object:
    typed = _typed(value, key.kind)
    if typed is None:
        document.fail(
            f"{path[-1]} = {_shown(value)} is not {key.kind.value}", *path, remedy=f"give {_expected(key)}"
        )
    numbers = typed if isinstance(typed, tuple) else (typed,)
    for number in numbers:
        if isinstance(number, (int, float)) and not isinstance(number, bool) and not _within(number, key):
            document.fail(
                f"{path[-1]} = {_shown(value)} is out of range", *path, remedy=f"give {_expected(key)}"
            )
    if key.choices and typed not in key.choices:
        document.fail(
            f"{path[-1]} = {_shown(value)} is unknown", *path, remedy=nearest(str(value), key.choices)
        )
    return typed


def _typed(value: object, kind: Kind) -> object | None:
    """The value as the type of its kind, or None if it is another one."""
    match kind:
        case Kind.NUMBER:
            return float(value) if _is_number(value) else None  # type: ignore[arg-type]
        case Kind.INTEGER:
            return value if isinstance(value, int) and not isinstance(value, bool) else None
        case Kind.BOOLEAN:
            return value if isinstance(value, bool) else None
        case Kind.TEXT:
            return value if isinstance(value, str) and value.strip() else None
        case Kind.TEXTS:
            fits = isinstance(value, list) and all(isinstance(one, str) and one.strip() for one in value)
            return tuple(value) if fits else None  # type: ignore[arg-type]
        case Kind.VECTOR:
            fits = isinstance(value, list) and len(value) == 3 and all(_is_number(one) for one in value)
            return tuple(float(one) for one in value) if fits else None  # type: ignore[attr-defined]


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _within(number: float, key: Key) -> bool:
    return (
        isfinite(number)
        and (key.above is None or number > key.above)
        and (key.at_least is None or number >= key.at_least)
        and (key.below is None or number < key.below)
        and (key.at_most is None or number <= key.at_most)
    )


def _expected(key: Key) -> str:
    """What to write, in words: type, unit and bounds."""
    if key.choices:
        return " or ".join(f'"{choice}"' for choice in key.choices)
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
