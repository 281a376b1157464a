"""TOML text: its contents, and the line of each key, which the standard reader does not report."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path as FilePath
from typing import Any

from ground.errors import UsageError

Path = tuple[str, ...]

_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"""'
    r"|'''.*?'''"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'"
    r"|\#[^\n]*"
    r"|\n"
    r"|[\[\]{}=]"
    r"|[^\s\[\]{}=\"'#]+"
    r"|.",
    re.DOTALL,
)


_TWICE = ("Cannot overwrite", "Cannot declare", "Cannot redefine", "Duplicate", "Cannot mutate")
"""Beginnings of the complaints of the standard reader about a key or table that was given before."""


def key_lines(text: str) -> dict[Path, int]:
    """Return the line numbers, from 1, of the tables and keys of a valid TOML text.

    Tables of an array are numbered: the keys under the second ``[[loads]]`` begin with ("loads", "1"). A key inside
    an inline table is on the line of the key of that table, so `line_of` falls back on it.
    """
    lines: dict[Path, int] = {}
    for line, path in _paths(text):
        for length in range(1, len(path) + 1):
            lines.setdefault(path[:length], line)
    return lines


def _paths(text: str) -> Iterator[tuple[int, Path]]:
    """Yield the line and the path of each header and key, in their order."""
    table: Path = ()
    counts: dict[Path, int] = {}
    for line, statement in _statements(text):
        if statement[0] == "[":
            header = _dotted("".join(statement).strip("[]"))
            table = _numbered(header, counts)
            if statement[:2] == ["[", "["]:
                counts[table] = counts.get(table, 0) + 1
                table = (*table, str(counts[table] - 1))
            yield line, table
        else:
            yield line, table + _dotted("".join(statement[: statement.index("=")]))


def _numbered(header: Path, counts: Mapping[Path, int]) -> Path:
    """Return the path of a header, with the number of the last table after each array above it."""
    path: Path = ()
    for name in header[:-1]:
        path = (*path, name)
        if path in counts:
            path = (*path, str(counts[path] - 1))
    return (*path, header[-1])


def line_of(lines: Mapping[Path, int], path: Path) -> int:
    """Return the line of a key, or of the nearest table or key that contains it; 1 if there is none."""
    while path:
        if path in lines:
            return lines[path]
        path = path[:-1]
    return 1


def _statements(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield (first line, tokens) of each header or assignment, without comments and outer space."""
    line, first, depth = 1, 1, 0
    tokens: list[str] = []
    for match in _TOKEN.finditer(text + "\n"):
        token = match.group()
        if token == "\n" and depth == 0:
            if tokens:
                yield first, tokens
            tokens = []
        elif not token.isspace() and not token.startswith("#"):
            if not tokens:
                first = line
            tokens.append(token)
            depth += (token in ("[", "{")) - (token in ("]", "}"))
        line += token.count("\n")


def _dotted(key: str) -> Path:
    """Return the path of a dotted, perhaps quoted, key: ``a."b.c"`` is (a, b.c)."""
    value: object = tomllib.loads(f"{key} = 0")
    path: list[str] = []
    while isinstance(value, dict):
        (name, value), *_ = value.items()
        path.append(name)
    return tuple(path)


def read_text(path: str | FilePath, error: type[UsageError], *, missing: str = "no such file") -> str:
    """Read the text of a file that a user wrote; a byte-order mark, with which some editors begin, is left out.

    Parameters
    ----------
    error, missing : class of the error, and its text where there is no such file

    Raises
    ------
    UsageError : as `error`
    """
    try:
        return FilePath(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise error(missing, where=str(path), remedy="check the path") from None
    except UnicodeDecodeError as fault:
        what = f"byte {fault.start} is not UTF-8"
        raise error(what, where=str(path), remedy="save the file as UTF-8") from None
    except OSError as fault:
        raise error(f"cannot be read: {fault.strerror}", where=str(path)) from None


def parse_toml(text: str, path: str, error: type[UsageError], remedy: str) -> dict[str, Any]:
    """Parse a TOML text.

    Parameters
    ----------
    path, error, remedy : place, class and remedy of the error if it is not TOML

    Raises
    ------
    UsageError : as `error`, at the line
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as complaint:
        message = str(complaint)
        place = re.search(r"\(at line (\d+), column \d+\)", message)
        line = int(place.group(1)) if place else max(1, len(text.rstrip().splitlines()))
        what = re.sub(r" \(at .*\)$", "", message)
        if message.startswith(_TWICE):
            raise error(_twice(text, line), where=f"{path}:{line}", remedy="keep one of them") from None
    except RecursionError:
        what, line = "lists or tables are nested too deeply", _fullest_line(text, "[{")
    except ValueError:
        what, line = "a number has thousands of digits", _fullest_line(text, "0123456789")
    raise error(f"not TOML: {what}", where=f"{path}:{line}", remedy=remedy) from None


def _twice(text: str, line: int) -> str:
    """Describe the key or table on a line that was given before."""
    earlier: list[tuple[int, Path]] = []
    for number, path in _paths(text):
        if number > line:
            break
        earlier.append((number, path))
    *before, (_, path) = earlier
    first = next((number for number, one in before if one[: len(path)] == path), None)
    name = ".".join(key for key in path if not key.isdecimal())
    return f"{name} is given twice" + ("" if first is None else f", first in line {first}")


def _fullest_line(text: str, characters: str) -> int:
    """Return the number of the line with most of these characters."""
    lines = text.splitlines()
    return 1 + max(range(len(lines)), key=lambda number: sum(map(lines[number].count, characters)))
