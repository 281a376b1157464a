"""Tables of a report, and how it writes numbers."""

import io
from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

__all__ = ["kilopascals", "megapascals", "millimetres", "percent", "ratio", "scientific", "table"]

_LONGEST = 32  # characters of a number with its precision and unit; a longer cell is a sentence


def table(rows: Iterable[Sequence[str]], head: Sequence[str] = ()) -> str:
    """An HTML table; the first cell of each row is its heading, short cells that begin with a digit are numbers."""
    out = io.StringIO()
    out.write("<table>")
    if head:
        out.write("<tr>" + "".join(f"<th>{escape(name)}</th>" for name in head) + "</tr>")
    for first, *rest in rows:
        cells = "".join(
            f'<td class="number">{escape(cell)}</td>' if _is_number(cell) else f"<td>{escape(cell)}</td>"
            for cell in rest
        )
        out.write(f"<tr><th>{escape(first)}</th>{cells}</tr>")
    out.write("</table>")
    return out.getvalue()


def _is_number(cell: str) -> bool:
    return cell.lstrip("+-")[:1].isdigit() and len(cell) <= _LONGEST


def megapascals(pascals: float | None) -> str:
    """A stress."""
    return "–" if pascals is None else f"{pascals / 1e6:.4f} MPa"


def kilopascals(pascals: float) -> str:
    """A pressure."""
    return f"{pascals / 1e3:.4g} kPa"


def millimetres(metres: float) -> str:
    """A length."""
    return f"{metres * 1e3:.4g} mm"


def percent(part: float) -> str:
    """A part of a whole."""
    return f"{100.0 * part:.1f} %"


def ratio(value: float | None) -> str:
    """A ratio that may not be known."""
    return "–" if value is None or not np.isfinite(value) else f"{value:.3g}"


def scientific(value: float | int | None) -> str:
    """A small number, or a count."""
    if value is None or not np.isfinite(value):
        return "not known"
    return str(value) if isinstance(value, int) else f"{value:.1e}"
