"""The matrix of Harris as SVG: later units on top, a line for each relation that no chain implies."""

from collections.abc import Collection, Mapping
from html import escape
from itertools import pairwise

from archmodel.stratigraphy.dates import Dated
from archmodel.stratigraphy.order import Order
from pipelines.draw.stratigraphy.layout import Key, Layout, layout_of

LETTER, LINE, MARGIN = 7.5, 24.0, 20.0  # px: width of a letter of 12 px, height of a box, margin
CHANNEL, TRACKS = 36.0, 5  # px between rows; heights at which lines turn
LONGEST = 24  # letters of a label
FILLS = ("#f3e3c3", "#cfe3d4", "#d3dcee", "#ecd3dd", "#e6e6c9", "#dcd3ec", "#c9e6e4", "#f0d9cc")
"""Colours of phases, in the order in which they come; they repeat."""


def matrix_svg(
    order: Order, dates: Mapping[str, Dated], doubtful: Collection[str] = (), linked: bool = False
) -> str:
    """Draw a matrix.

    Parameters
    ----------
    order : of the units
    dates : phases of the units, which colour them, the earliest first
    doubtful : codes of units that contradict their dates, drawn with a red border
    linked : whether each box leads to the anchor ``unit-CODE`` of the page around it
    """
    labels = {unit: " = ".join(group) for unit, group in order.equal.items()}
    letters = min(LONGEST, max(map(len, labels.values()), default=1))
    box = LETTER * letters + 2 * LETTER
    step, placed = box + 2 * LETTER, layout_of(order)
    across = {key: MARGIN + box / 2 + x * step for key, x in placed.across.items()}
    down = {key: MARGIN + row * (LINE + CHANNEL) for row, keys in enumerate(placed.rows) for key in keys}
    by_years = sorted(dates.values(), key=lambda date: (date.begins is None, date.begins or 0))
    phases = list(dict.fromkeys(date.phase for date in by_years))
    width = 2 * MARGIN + placed.width * step
    height = 2 * MARGIN + len(placed.rows) * (LINE + CHANNEL) + (LINE if phases else 0.0)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" '
        f'width="{width:.0f}" height="{height:.0f}" font-family="sans-serif" font-size="12">',
        f'<rect width="{width:.0f}" height="{height:.0f}" fill="#ffffff"/>',
        f'<path d="{_lines(placed, across, down)}" fill="none" stroke="#333333"/>',
    ]
    for link in order.beside:
        x1, y1, x2, y2 = across[link.subject], down[link.subject], across[link.target], down[link.target]
        parts.append(
            f'<path d="M{x1:.1f} {y1 + LINE:.1f}L{x2:.1f} {y2 + LINE:.1f}" stroke="#777777" stroke-width="2" '
            f'stroke-dasharray="4 3"><title>{escape(str(link))}</title></path>'
        )
    for unit, label in labels.items():
        date = next((dates[code] for code in order.equal[unit] if code in dates), None)
        fill = "#ffffff" if date is None else FILLS[phases.index(date.phase) % len(FILLS)]
        consistent = not set(order.equal[unit]) & set(doubtful)
        parts.append(
            _box(
                unit,
                label,
                (across[unit] - box / 2, down[unit], box),
                fill,
                consistent,
                linked,
                str(date or ""),
            )
        )
    parts += [
        f'<rect x="{MARGIN + k * step:.1f}" y="{height - MARGIN - LINE:.1f}" width="12" height="12" '
        f'fill="{FILLS[k % len(FILLS)]}" stroke="#333333"/>'
        f'<text x="{MARGIN + k * step + 18:.1f}" y="{height - MARGIN - LINE + 11:.1f}">{escape(phase[:LONGEST])}</text>'
        for k, phase in enumerate(phases)
    ]
    return "\n".join([*parts, "</svg>\n"])


def _box(
    unit: str,
    label: str,
    place: tuple[float, float, float],
    fill: str,
    consistent: bool,
    linked: bool,
    title: str,
) -> str:
    x, y, width = place
    border = 'stroke="#333333"' if consistent else 'stroke="#c00000" stroke-width="3"'
    short = label if len(label) <= LONGEST else label[: LONGEST - 1] + "…"
    text = (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{LINE:.0f}" fill="{fill}" {border}/>'
        f'<text x="{x + width / 2:.1f}" y="{y + 16:.1f}" text-anchor="middle">{escape(short)}</text>'
        f"<title>{escape(f'{label} {title}'.strip())}</title>"
    )
    return f'<a href="#unit-{escape(unit)}">{text}</a>' if linked else f"<g>{text}</g>"


def _lines(placed: Layout, across: Mapping[Key, float], down: Mapping[Key, float]) -> str:
    """Return the path of all lines: down, across in the channel between two rows, down."""
    track = {
        key: (k % TRACKS + 1) * CHANNEL / (TRACKS + 1) for keys in placed.rows for k, key in enumerate(keys)
    }
    parts = []
    for line in placed.lines:
        for upper, lower in pairwise(line):
            start = down[upper] + (LINE if isinstance(upper, str) else 0.0)
            turn = down[upper] + LINE + track[upper]
            parts.append(f"M{across[upper]:.1f} {start:.1f}V{turn:.1f}H{across[lower]:.1f}V{down[lower]:.1f}")
    return "".join(parts)
