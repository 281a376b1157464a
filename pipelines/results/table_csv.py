"""CSV that spreadsheets show as text: no cell of a survey becomes a formula."""

import csv
import io
from collections.abc import Iterable, Mapping

_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def inert(value: object) -> object:
    """Return a value of a cell; texts that a spreadsheet would take as formulas with an apostrophe before them."""
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value


def csv_text(
    columns: Iterable[str], rows: Iterable[Mapping[str, object]], *, spreadsheet: bool = False
) -> str:
    """Format rows with a header line; unknown values are empty.

    Parameters
    ----------
    spreadsheet : with the mark of UTF-8, semicolons and decimal commas, as spreadsheets open them in most of Europe
    """
    names, out = list(columns), io.StringIO()
    writer = csv.writer(out, delimiter=";" if spreadsheet else ",", lineterminator="\n")
    writer.writerow(names)
    cell = _local if spreadsheet else inert
    writer.writerows([cell(row[name]) for name in names] for row in rows)
    return f"\ufeff{out.getvalue()}" if spreadsheet else out.getvalue()


def _local(value: object) -> object:
    """Return a value of a cell with a decimal comma."""
    return str(value).replace(".", ",") if isinstance(value, float) else inert(value)
