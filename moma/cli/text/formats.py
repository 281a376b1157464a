"""Formats of rows and entities: tables for people, CSV and JSON for programs."""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from archmodel.quantities import units_of
from archmodel.store.run_record import without_rounding

USUAL_COLUMNS = (
    "code", "kind", "course", "depth", "length", "height", "volume", "rms", "rejected", "fidelity", "von_mises_p99",
    "displacement_max",
)  # fmt: skip
"""Columns of a table beside requested ones; CSV and JSON have every attribute."""

_UNITS = {
    **dict.fromkeys(("length", "height", "centroid", "value", "sigma", "offset", "height_sigma", "rms"), "m"),
    "area": "m²",
    "volume": "m³",
    "mass": "kg",
    "tilt_sigma": "rad",
    **units_of("stone", "course"),
}

_PLACES = frozenset({"x", "y", "z", "centroid", "offset"})


def shown_columns(
    names: Iterable[str], rows: Sequence[Mapping[str, object]], asked: Iterable[str] = ()
) -> list[str]:
    """Choose the columns of a table: those in which any row has a value, and those in `asked`."""
    wanted = {"code", *asked}
    return [name for name in names if name in wanted or any(row[name] is not None for row in rows)]


def as_table(columns: Mapping[str, str | None], rows: Sequence[Mapping[str, object]]) -> str:
    """Format rows as an aligned table; `columns` gives the unit of each column, None or "-" for none."""
    heads = [name if unit in (None, "-") else f"{name} [{unit}]" for name, unit in columns.items()]
    cells = [[_cell(row[name], name, unit) for name, unit in columns.items()] for row in rows]
    numeric = [
        all(isinstance(row[name], int | float | None) and not isinstance(row[name], bool) for row in rows)
        and bool(rows)
        for name in columns
    ]
    widths = [max(map(len, column)) for column in zip(heads, *cells, strict=True)]

    def line(texts: Sequence[str]) -> str:
        """Return the cells of a row, padded to the widths of their columns."""
        padded = (
            text.rjust(width) if right else text.ljust(width)
            for text, width, right in zip(texts, widths, numeric, strict=True)
        )
        return "  ".join(padded).rstrip()

    return "\n".join(map(line, [heads, ["─" * width for width in widths], *cells]))


def as_csv(columns: Iterable[str], rows: Iterable[Mapping[str, object]], *, spreadsheet: bool = False) -> str:
    """Format rows as CSV with a header line; unknown values are empty.

    Parameters
    ----------
    spreadsheet : with the mark of UTF-8, semicolons and decimal commas
    """
    from pipelines.results.table_csv import csv_text

    return csv_text(columns, rows, spreadsheet=spreadsheet).rstrip("\n")


def shorten(lines: Sequence[str], shown: int, margin: str = "", hint: str = "") -> list[str]:
    """Keep the first lines, and count the others."""
    rest = len(lines) - shown
    return [*lines[:shown], f"{margin}and {rest} more{hint}"] if rest > 0 else list(lines)


def some(names: Sequence[str], shown: int = 6) -> str:
    """List the first names in one line, and count the others."""
    return ", ".join(names[:shown]) + (f" and {len(names) - shown} more" if len(names) > shown else "")


def as_json(value: object) -> str:
    """Format a value as indented JSON, with escapes where standard output lacks a character: values stay exact."""
    text = json.dumps(value, indent=2, ensure_ascii=False, allow_nan=False)
    return text if _printable(text) else json.dumps(value, indent=2, allow_nan=False)


def as_geojson(collection: Mapping[str, Any]) -> str:
    """Format a FeatureCollection with one feature on each line."""
    features = (
        json.dumps(feature, ensure_ascii=not _printable(str(feature)), allow_nan=False)
        for feature in collection["features"]
    )
    return '{"type": "FeatureCollection", "features": [\n' + ",\n".join(features) + "\n]}"


def _printable(text: str) -> bool:
    """Tell whether the encoding of standard output has every character of a text."""
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        return False
    return True


def as_lines(value: Mapping[str, Any], indent: int = 0) -> str:
    """Format a nested mapping as indented lines, without empty or unknown values."""
    lines = []
    margin = "  " * indent
    for name, content in value.items():
        if content is None or content == [] or content == {}:
            continue
        label, unit = name.replace("_", " "), f" {_UNITS[name]}" if name in _UNITS else ""
        if isinstance(content, Mapping):
            lines += [f"{margin}{label}", as_lines(content, indent + 1)]
        elif isinstance(content, list) and isinstance(content[0], Mapping):
            lines.append(f"{margin}{label}")
            lines += [f"{margin}  - {as_lines(one, indent + 2).lstrip()}" for one in content]
        elif isinstance(content, list):
            lines.append(
                f"{margin}{label:<18} {'  '.join(_cell(one, name, _UNITS.get(name)) for one in content)}{unit}"
            )
        else:
            lines.append(f"{margin}{label:<18} {_cell(content, name, _UNITS.get(name))}{unit}")
    return "\n".join(lines)


def _cell(value: object, name: str, unit: str | None) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()  # as queries write it
    if name in _PLACES and isinstance(value, float):
        return f"{value:.3f}"  # to the millimetre, however far the origin is
    return (
        f"{without_rounding(value, unit) + 0.0:.4g}" if isinstance(value, float) else str(value)
    )  # -0.0 is 0
