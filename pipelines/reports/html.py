"""Self-contained HTML pages, and the format of the numbers in them."""

import base64
from functools import cache
from pathlib import Path

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

__all__ = [
    "Picture",
    "kilopascals",
    "megapascals",
    "millimetres",
    "percent",
    "picture",
    "ratio",
    "scientific",
    "write_page",
]

Picture = dict[str, str]
"""Caption and base64 content of a PNG."""

_LONGEST = 32  # characters of a number with its precision and unit; a longer cell is a sentence


def write_page(path: Path, template: str, **values: object) -> None:
    """Fill a template of `pipelines/reports/templates` with plain values; escape every text among them."""
    path.write_text(_templates().get_template(template).render(values), encoding="utf-8")


def picture(path: Path, caption: str) -> Picture:
    """Read a PNG for embedding in a page."""
    return {"caption": caption, "content": base64.b64encode(path.read_bytes()).decode("ascii")}


@cache
def _templates() -> Environment:
    environment = Environment(
        autoescape=True,
        keep_trailing_newline=True,
        loader=PackageLoader("pipelines.reports"),
        lstrip_blocks=True,
        trim_blocks=True,
        undefined=StrictUndefined,
    )
    environment.tests["quantity"] = _is_quantity
    return environment


def _is_quantity(cell: str) -> bool:
    """Return True for a short cell that begins with a digit."""
    return cell.lstrip("+-")[:1].isdigit() and len(cell) <= _LONGEST


def megapascals(pascals: float | None) -> str:
    """Format a stress given in pascals."""
    return "–" if pascals is None else f"{pascals / 1e6:.4f} MPa"


def kilopascals(pascals: float) -> str:
    """Format a pressure given in pascals."""
    return f"{pascals / 1e3:.4g} kPa"


def millimetres(metres: float) -> str:
    """Format a length given in metres."""
    return f"{metres * 1e3:.4g} mm"


def percent(part: float) -> str:
    """Format a fraction."""
    return f"{100.0 * part:.1f} %"


def ratio(value: float | None) -> str:
    """Format a ratio; a dash if it is not known."""
    return "–" if value is None or not np.isfinite(value) else f"{value:.3g}"


def scientific(value: float | int | None) -> str:
    """Format a small number, or a count."""
    if value is None or not np.isfinite(value):
        return "not known"
    return str(value) if isinstance(value, int) else f"{value:.1e}"
