"""Arrays of tables of a scene file: each table checked by its type, with its time series read."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from ground.toml.lines import Path
from ground.toml.schema import Key, TomlDocument, ValueKind, check_table, tables_of
from mechanics.scene.loads.accelerogram import Accelerogram
from mechanics.scene.loads.ground_motion import braking_time
from mechanics.scene.loads.tables import read_history
from mechanics.scene.loads.time_series import History

# alternative to time and value in the inline table of a time series
_FILE = Key(
    "file", ValueKind.TEXT, "Text file with a column of times and one of values, or three.", default=None
)


@dataclass(frozen=True)
class ArrayTable:
    """One table of an array.

    Attributes
    ----------
    path : its position, for messages: ("loads", "0")
    type : one of those of the array
    values : of all its keys except `type`, defaults filled in, time series read
    groups : key, and codes or expressions, of each group of stones that it names
    """

    path: Path
    type: str
    values: Mapping[str, Any]
    groups: tuple[tuple[str, tuple[str, ...]], ...]


def read_entries(
    document: TomlDocument,
    tables: Mapping[str, Any],
    name: str,
    types: Mapping[str, tuple[Key, ...]],
    common: tuple[Key, ...] = (),
) -> tuple[ArrayTable, ...]:
    """Check all tables [[name]]; an array of a single type has no key `type`."""
    return tuple(
        _entry(document, path, table, types, common) for path, table in tables_of(document, tables, name)
    )


def describe(entry: ArrayTable, groups: Mapping[Path, Sequence[frozenset[str]]]) -> str:
    """Return an entry in words: its type, its stones, and the values that it gives."""
    stones = " and ".join(f"{len(codes)} stones" for codes in groups[entry.path])
    values = ", ".join(
        f"{name} {_shown(value)}"
        for name, value in entry.values.items()
        if value not in (None, ()) and name not in {key for key, _ in entry.groups}
    )
    return f"{entry.type}{f', {stones}' if stones else ''}: {values}"


def _shown(value: Any) -> str:
    """Return a value in a few words."""
    match value:
        case tuple() | list():
            return f"({', '.join(map(_shown, value))})"
        case History() if len(value.time) == 1:
            return _shown(value.value[0].tolist())
        case History():
            return f"from {value.time[0]:g} s to {value.time[-1]:g} s"
        case Accelerogram():
            rest = f"{value.velocity[-1]:.2g} m/s, {value.displacement[-1]:.2g} m"
            braking = braking_time(value)
            rest += f", brakes for {braking:.3g} s" * (braking > value.dt)
            peak = f"peak {value.peak:.3g} m/s² at {value.time[np.abs(value.acceleration).argmax()]:.4g} s"
            return f"{value.name!r} ({value.duration:g} s, {peak}, ends with {rest})"
        case float():
            return f"{value:g}"
        case _:
            return str(value).lower() if isinstance(value, bool) else str(value)


def file_beside(document: TomlDocument, name: str) -> FilePath:
    """Return the path of a file that a scene names, relative to the scene file."""
    return FilePath(document.path).parent / name


def _entry(
    document: TomlDocument,
    path: Path,
    table: Mapping[str, Any],
    types: Mapping[str, tuple[Key, ...]],
    common: tuple[Key, ...],
) -> ArrayTable:
    title, entry = f"[[{path[0]}]]", dict(table)
    kind = next(iter(types))
    if len(types) > 1:
        which = Key("type", ValueKind.TEXT, "Type.", choices=tuple(types))
        kind = str(
            check_table(document, path, {k: v for k, v in table.items() if k == "type"}, [which], title)[
                "type"
            ]
        )
        entry.pop("type")
        title = f"[[{path[0]}]] of type {kind!r}"
    keys = (*types[kind], *common)
    values = check_table(document, path, entry, keys, title)
    for key in keys:
        if key.kind in (ValueKind.HISTORY, ValueKind.VECTOR_HISTORY) and values[key.name] is not None:
            values[key.name] = _history(document, (*path, key.name), values[key.name], key)
    return ArrayTable(path, kind, values, tuple(_groups(keys, values)))


def _groups(keys: Iterable[Key], values: Mapping[str, Any]) -> Iterable[tuple[str, tuple[str, ...]]]:
    for key in keys:
        if key.kind is ValueKind.STONES:
            yield key.name, values[key.name]
        elif key.kind is ValueKind.GROUPS:
            for group in values[key.name]:
                yield key.name, group


def _history(document: TomlDocument, path: Path, value: Any, key: Key) -> History:
    """Return the time series of a constant, of { time, value }, or of { file }."""
    if not isinstance(value, dict):
        return History.constant(value)
    vector = key.kind is ValueKind.VECTOR_HISTORY
    title = f"{key.name} = {{ … }}"
    if "file" in value:
        checked = check_table(document, path, value, [_FILE], title)
        parts = ("x", "y", "z") if vector else (key.name,)
        columns = ", ".join(["time [s]", *(f"{part} [{key.unit}]" for part in parts)])
        return read_history(file_beside(document, str(checked["file"])), columns)
    values = Key("value", ValueKind.ROWS if vector else ValueKind.NUMBERS, "Values.", key.unit)
    time = Key("time", ValueKind.NUMBERS, "Instants.", "s", at_least=0)
    checked = check_table(document, path, value, [time, values], title)
    with document.at(*path):
        return History(checked["time"], checked["value"])  # type: ignore[arg-type]
