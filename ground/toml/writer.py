"""Tables as TOML text that reads back to the same values."""

import json
from collections.abc import Iterator, Mapping
from typing import Any


def toml_text(tables: Mapping[str, Any]) -> str:
    """Return tables, arrays of tables and values as TOML.

    >>> print(toml_text({"title": "wall", "time": {"step": 0.01}, "loads": [{"stones": ["A"], "at": {"x": 1.0}}]}))
    title = "wall"
    <BLANKLINE>
    [time]
    step = 0.01
    <BLANKLINE>
    [[loads]]
    stones = ["A"]
    at = { x = 1.0 }
    <BLANKLINE>
    """
    return "\n".join(_lines(tables)) + "\n"


def _lines(tables: Mapping[str, Any]) -> Iterator[str]:
    # values before tables, as those after a header would belong to it
    for name, table in tables.items():
        if not isinstance(table, Mapping) and not is_table_array(table):
            yield f"{_key(name)} = {_value(table)}"
    for name, table in tables.items():
        if (
            isinstance(table, Mapping)
            and all(isinstance(inner, Mapping) for inner in table.values())
            and table
        ):
            for inner, content in table.items():
                yield from _table(f"[{_key(name)}.{_key(inner)}]", content)
        elif isinstance(table, Mapping):
            yield from _table(f"[{_key(name)}]", table)
        elif is_table_array(table):
            for content in table:
                yield from _table(f"[[{_key(name)}]]", content)


def _table(header: str, content: Mapping[str, Any]) -> Iterator[str]:
    yield ""
    yield header
    for name, value in content.items():
        yield f"{_key(name)} = {_value(value)}"


def _value(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(name)} = {_value(one)}" for name, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_value, value)) + "]"
    if isinstance(value, str | bool | int | float):
        # the strings of JSON are strings of TOML
        return json.dumps(value, ensure_ascii=False)
    return str(value.isoformat())


def _key(name: str) -> str:
    plain = name.replace("_", "").replace("-", "")
    return name if plain.isascii() and plain.isalnum() else json.dumps(name, ensure_ascii=False)


def is_table_array(value: Any) -> bool:
    """Return whether a value is what [[name]] gives: tables in a list, one at least."""
    return isinstance(value, list) and bool(value) and all(isinstance(one, Mapping) for one in value)
