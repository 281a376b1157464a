"""The whole stratigraphy of a database: order, dates, contradictions; and its drawing by the ending of a file."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from sqlalchemy.orm import Session

from archmodel.query.dated import load_dates
from archmodel.stratigraphy.dates import Bounds, Contradiction, Dated, contradictions, date_bounds
from archmodel.stratigraphy.draw_graphml import write_graphml
from archmodel.stratigraphy.graphml import DrawnUnit
from archmodel.stratigraphy.order import Link, Order, order_of
from archmodel.stratigraphy.stored import load_drawn, load_links, load_stones, load_units, with_years
from ground.errors import UsageError
from pipelines.draw.stratigraphy.drawing import matrix_svg
from pipelines.draw.stratigraphy.layout import layout_of

_STYLE = (
    "body{font-family:sans-serif;margin:1.5em}.matrix{overflow:auto;border:1px solid #ccc;max-height:80vh}"
    "td,th{text-align:left;vertical-align:top;padding:.2em .8em}tr:target{background:#fff3b0}"
    ".wrong{color:#c00000}"
)


def matrix_page(
    order: Order,
    links: Sequence[Link],
    dates: Mapping[str, Dated],
    bounds: Mapping[str, Bounds],
    stones: Mapping[str, Sequence[str]],
    wrong: Sequence[Contradiction],
) -> str:
    """Return the page; boxes of the drawing lead to the rows of their units."""
    doubtful = {code for contradiction in wrong for code in (contradiction.unit, contradiction.target)}
    relations: dict[str, list[str]] = {}
    for link in links:
        author = f" ({link.author})" if link.author else ""
        for code in dict.fromkeys((link.subject, link.target)):
            relations.setdefault(code, []).append(f"{link}{author}")
    rows = []
    for unit in order.units:
        for code in order.equal[unit]:
            anchor = f' id="unit-{escape(code)}"'
            years = bounds[unit]
            cells = (
                code,
                str(dates.get(code, "")),
                "" if years.begins is None else f"{years.begins} ({years.begins_by})",
                "" if years.ends is None else f"{years.ends} ({years.ends_by})",
                "; ".join(relations.get(code, ())),
                ", ".join(stones.get(code, ())),
            )
            rows.append(f"<tr{anchor}>{''.join(f'<td>{escape(cell)}</td>' for cell in cells)}</tr>")
    head = "".join(
        f"<th>{name}</th>" for name in ("unit", "phase", "not before", "not after", "relations", "stones")
    )
    items = "".join(f'<li class="wrong">{escape(contradiction.text)}</li>' for contradiction in wrong)
    count = f"{len(wrong)} contradictions of matrix and dates" if wrong else "Matrix and dates agree"
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>Stratigraphy</title>'
        f"<style>{_STYLE}</style></head><body><h1>Stratigraphy</h1><p>{count}.</p><ul>{items}</ul>"
        f'<div class="matrix">{matrix_svg(order, dates, doubtful, linked=True)}</div>'
        f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></body></html>\n"
    )


@dataclass(frozen=True)
class Matrix:
    """Stratigraphy at one time, of one author or of all.

    Attributes
    ----------
    order : units in the order of time
    links : relations that are stated
    dates : phases of units
    bounds : years that absolute dates, phases and matrix allow, by the first of equal units
    stones : members of units
    contradictions : of matrix and dates
    drawn : kinds, descriptions and absolute dates of units
    """

    order: Order
    links: tuple[Link, ...]
    dates: Mapping[str, Dated]
    bounds: Mapping[str, Bounds]
    stones: Mapping[str, tuple[str, ...]]
    contradictions: tuple[Contradiction, ...]
    drawn: Mapping[str, DrawnUnit]

    def as_values(self) -> dict[str, object]:
        """Return plain values for JSON."""
        units = [
            {
                "unit": unit,
                "equal_to": list(self.order.equal[unit][1:]),
                "level": self.order.levels[unit],
                "later_than": list(self.order.below[unit]),
                "phase": next((self.dates[c].phase for c in self.order.equal[unit] if c in self.dates), None),
                "not_before": self.bounds[unit].begins,
                "not_before_by": self.bounds[unit].begins_by,
                "not_after": self.bounds[unit].ends,
                "not_after_by": self.bounds[unit].ends_by,
                "stones": [stone for code in self.order.equal[unit] for stone in self.stones.get(code, ())],
            }
            for unit in self.order.units
        ]
        return {
            "units": units,
            "relations": [vars(link) for link in self.links],
            "redundant": self.order.redundant,
            "contradictions": [vars(contradiction) for contradiction in self.contradictions],
        }


def study(session: Session, author: str | None = None) -> Matrix:
    """Order the units of a database.

    Parameters
    ----------
    author : only relations that this author states; None: all

    Raises
    ------
    UsageError
        if nothing is known of the stratigraphy, or relations form a loop
    """
    links, units = tuple(load_links(session, author)), load_units(session)
    if not links and not units:
        who = "" if author is None else f" by {author}"
        remedy = 'record relations: moma record LIST.csv --author NAME --source "…"'
        raise UsageError(f"no stratigraphy is recorded{who}", remedy=remedy)
    order = order_of(units, links)
    codes = [code for group in order.equal.values() for code in group]
    phases, drawn = load_dates(session, codes), load_drawn(session)
    dates = with_years(phases, drawn)
    return Matrix(
        order,
        links,
        phases,
        date_bounds(order, dates),
        load_stones(session, codes),
        contradictions(order, links, dates),
        drawn,
    )


def draw(matrix: Matrix, path: Path) -> str:
    """Return the drawing for a file: SVG, a page, or GraphML.

    Raises
    ------
    UsageError
        for another ending
    """
    wrong = matrix.contradictions
    match path.suffix.lower():
        case ".svg":
            doubtful = {code for pair in wrong for code in (pair.unit, pair.target)}
            return matrix_svg(matrix.order, matrix.dates, doubtful)
        case ".html":
            return matrix_page(matrix.order, matrix.links, matrix.dates, matrix.bounds, matrix.stones, wrong)
        case ".graphml":
            places = {key: x for key, x in layout_of(matrix.order).across.items() if isinstance(key, str)}
            return write_graphml(matrix.order, matrix.links, places, matrix.dates, matrix.drawn)
    raise UsageError(
        f"{path.name} is no drawing", where="--out", remedy="name a file that ends in .svg, .html or .graphml"
    )
