"""CSV that spreadsheets show as text: no cell of a survey becomes a formula."""

import csv
import io
from collections.abc import Iterable, Mapping

__all__ = ["csv_text", "inert"]

_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def inert(value: object) -> object:
    """Return a value of a cell; texts that a spreadsheet would take as formulas with an apostrophe before them."""
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value


def csv_text(columns: Iterable[str], rows: Iterable[Mapping[str, object]]) -> str:
    """Format rows with a header line; unknown values are empty."""
    names, out = list(columns), io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([inert(row[name]) for name in names] for row in rows)
    return out.getvalue()
