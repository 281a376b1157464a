"""A report as one page that needs no other file."""

import base64
import io
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

import numpy as np

__all__ = [
    "figure",
    "kilopascals",
    "megapascals",
    "millimetres",
    "page",
    "percent",
    "ratio",
    "scientific",
    "table",
]

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 60rem; }
body { margin: 2rem auto; padding: 0 1rem; }
h1 { margin-bottom: 0; } h2 { margin-top: 2.2rem; } .lead { font-size: 1.15rem; color: #444; }
figure { margin: 1.5rem 0; } img, svg { max-width: 100%; height: auto; } figcaption { color: #555; }
table { border-collapse: collapse; }
th, td { padding: .3rem .9rem .3rem 0; text-align: left; vertical-align: top; }
td.number { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; }
.wide { overflow-x: auto; } .wide table { font-size: .85rem; }
tr + tr { border-top: 1px solid #ddd; } .warning { background: #fff3d6; padding: .6rem 1rem; }
"""


def page(title: str, body: Iterable[str]) -> str:
    """A whole HTML page around the elements of its body."""
    head = [
        '<!doctype html><html lang="en"><head><meta charset="utf-8">',
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head><body>",
    ]
    return "\n".join([*head, *body, "</body></html>"]) + "\n"


def figure(picture: Path, caption: str) -> str:
    """A PNG with its caption, the picture itself in the page."""
    content = base64.b64encode(picture.read_bytes()).decode("ascii")
    return (
        f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{content}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


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
