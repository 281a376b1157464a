"""The matrix as a page that needs no network: the drawing, contradictions, and each unit with its stones."""

from collections.abc import Mapping, Sequence
from html import escape

from archmodel.stratigraphy.dates import Bounds, Contradiction, Dated
from archmodel.stratigraphy.order import Link, Order
from pipelines.draw.stratigraphy.drawing import matrix_svg

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
