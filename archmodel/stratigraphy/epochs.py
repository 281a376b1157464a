"""Epochs of a drawing by yEd: the rows of a table of swimlanes, from top to bottom.

A unit is of the epoch in whose row its middle lies. The label of a row is its name, which years may follow:
``Phase I [start:1180;end:1210]``.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree as etree

from archmodel.stratigraphy.dates import Dated
from archmodel.stratigraphy.palette import G, Y, label_of

_YEARS = re.compile(r"\[([^\[\]]*)\]\s*$")
_YEAR = re.compile(r"(start|end)\s*:\s*(-?\d+)")


@dataclass(frozen=True)
class Lane:
    """Row of a table: the epoch, and its upper and lower edge in yEd's units."""

    epoch: Dated
    top: float
    bottom: float


def lanes_of(table: etree.Element) -> Iterator[Lane]:
    """Yield the labelled rows of a table, downwards."""
    frame, insets = table.find(f"{{{Y}}}Geometry"), table.find(f"{{{Y}}}Table/{{{Y}}}Insets")
    labels: dict[str, str] = {}
    for label in table.findall(f"{{{Y}}}NodeLabel"):
        row = label.find(f".//{{{Y}}}RowNodeLabelModelParameter")
        if row is not None:
            labels[row.get("id", "")] = label_of(label)
    top = _number(frame, "y") + _number(insets, "top")
    for row in table.iter(f"{{{Y}}}Row"):
        bottom = top + _number(row, "height")
        if label_text := labels.get(row.get("id", "")):
            yield Lane(_epoch(label_text), top, bottom)
        top = bottom


def _epoch(label: str) -> Dated:
    """Parse the label of a row."""
    years = _YEARS.search(label)
    if years is None:
        return Dated(label, None, None)
    bounds = {key: int(year) for key, year in _YEAR.findall(years[1])}
    return Dated(label[: years.start()].strip() or label, bounds.get("start"), bounds.get("end"))


def lane_of(node: etree.Element, lanes: Sequence[Lane]) -> Lane | None:
    """Return the row in which the middle of a node lies."""
    frame = node.find(f"./{{{G}}}data//{{{Y}}}Geometry")
    if frame is None:
        return None
    middle = _number(frame, "y") + 0.5 * _number(frame, "height")
    return next((lane for lane in lanes if lane.top <= middle < lane.bottom), None)


def _number(element: etree.Element | None, name: str) -> float:
    """Return a number of an element; 0 without it."""
    text = "" if element is None else element.get(name, "")
    try:
        return float(text)
    except ValueError:
        return 0.0
