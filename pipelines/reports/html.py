"""Self-contained HTML pages, their tables, and the format of the numbers in them."""

import base64
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from archmodel.quantities import quantities_of
from archmodel.store.run_record import without_rounding
from pipelines.reports.page.elevation import elevation
from pipelines.reports.page.inline import languages_packed, script, style, viewer_html
from pipelines.reports.page.languages import catalogues
from pipelines.reports.page.model import Model
from pipelines.reports.page.paper import contents, sealed, title_block
from pipelines.results.wall_axes import WallAxes

T = TypeVar("T")

Picture = dict[str, str]
"""Caption and base64 content of a PNG."""

MAX_ROWS = 300  # rows of a table; the result as JSON has them all
_LONGEST = 32  # characters of a number with its precision and unit; a longer cell is a sentence


@dataclass(frozen=True)
class Table:
    """Headings and rows of a table, and how many rows there are with those that the page leaves out."""

    head: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    count: int


def table_of(
    bearer: str | tuple[str, ...],
    items: Sequence[T],
    cells: Callable[[T], Mapping[str, str]],
    most: int | None = None,
) -> Table:
    """Return a table with a row for each item.

    Parameters
    ----------
    bearer : of the quantities of the columns, as in `archmodel.quantities`; beside these there are those of *row*
    items : what the rows are about
    cells : gives the texts of a row by the names of their quantities, the same names for all items
    most : rows that are shown; None: all
    """
    quantities = quantities_of("row", *((bearer,) if isinstance(bearer, str) else bearer))
    rows = [cells(item) for item in items[:most]]
    names = tuple(rows[0]) if rows else ()
    assert all(row.keys() == rows[0].keys() for row in rows), "rows of one table have the same names"
    head = tuple(quantities[name].heading for name in names)
    return Table(head, [tuple(row[name] for name in names) for row in rows], len(items))


def write_page(path: Path, template: str, model: Model | None = None, **values: object) -> None:
    """Fill a template of `pipelines/reports/templates` with plain values; escape every text among them.

    Parameters
    ----------
    path : of the page
    template : its name
    model : content of the page's viewer and of its elevation; None: it has neither
    values : of the template
    """
    path.write_text(page_text(template, model, **values), encoding="utf-8")


def render(template: str, **values: object) -> str:
    """Fill a template with plain values, without a viewer; escape every text among them."""
    return _templates().get_template(template).render(values)


def page_text(template: str, model: Model | None = None, **values: object) -> str:
    """Return a page; arguments as of `write_page`."""
    versions = values.get("versions") or f"MOMA {values.get('version', '')}"
    own = {
        "viewer": None if model is None else viewer_html(model),
        "elevation": None if model is None else elevation(model),
        "title_block": title_block(str(values["name"]), versions),  # type: ignore[arg-type]
        "languages": {tag: catalogue["name"] for tag, catalogue in catalogues().items()},
        "languages_packed": languages_packed(),
        "viewer_style": style(),
        "viewer_script": script(),
    }
    return sealed(contents(_templates().get_template(template).render(own | values)))


def picture(path: Path, caption: str) -> Picture:
    """Read a PNG for embedding in a page."""
    return {"caption": caption, "content": base64.b64encode(path.read_bytes()).decode("ascii")}


def direction_text(axes: WallAxes | None, vector: Sequence[float]) -> str:
    """Name a direction along the axes x, y, z and, where a wall has its own, along these."""
    size = float(np.linalg.norm(vector)) or 1.0
    text = f"({', '.join(f'{one / size + 0.0:.3g}' for one in vector)})"
    return text if axes is None else f"{axes.direction(np.array(vector))}, {text}"


def input_rows(summary: Mapping[str, Any]) -> list[tuple[str, list[str]]]:
    """Return the lines of each input of a result, by title, and the versions of the programs."""
    rows = [(title, lines) for title, lines in summary.get("inputs", {}).items() if lines]
    if "versions" in summary:
        rows.append(
            ("Versions", [", ".join(f"{name} {version}" for name, version in summary["versions"].items())])
        )
    return rows


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
    return "–" if pascals is None else f"{pascals / 1e6:z.4f} MPa"  # four decimals round 50 Pa to 0


def kilopascals(pascals: float) -> str:
    """Format a pressure given in pascals."""
    return f"{without_rounding(pascals, 'Pa') / 1e3:z.4g} kPa"


def kilonewtons(newtons: float) -> str:
    """Format a force given in newtons."""
    return f"{newtons / 1e3:z.2f} kN"


def millimetres(metres: float, least: float = 0.0) -> str:
    """Format a length given in metres; a smaller one than `least` [m], the tolerance, as such."""
    if abs(metres) < least:
        return f"0 within {least * 1e3:.1g} mm"
    return f"{without_rounding(metres, 'm') * 1e3:z.4g} mm"


def residual_cells(residual: Sequence[float]) -> dict[str, str]:
    """Format the residuals of a control point along x, y and z [m], by the names of their quantities."""
    return {f"residual_{axis}": f"{1e3 * value:z.1f} mm" for axis, value in zip("xyz", residual, strict=True)}


def percent(part: float) -> str:
    """Format a fraction."""
    return f"{100.0 * part:z.1f} %"


def ratio(value: float | None) -> str:
    """Format a ratio; a dash if it is not known."""
    return "–" if value is None or not np.isfinite(value) else f"{value:z.3g}"


def in_words(value: float, unit: str | None, least: float = 0.0) -> str:
    """Format a value by its unit; a smaller length than `least` [m] as such."""
    if unit == "m":
        return millimetres(value, least)
    return {"N": kilonewtons, "Pa": megapascals}.get(unit or "", ratio)(value)


def scientific(value: float | int | None) -> str:
    """Format a small number, or a count."""
    if value is None or not np.isfinite(value):
        return "not known"
    return str(value) if isinstance(value, int) else f"{value:.1e}"
