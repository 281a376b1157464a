"""Stratigraphy as GraphML in the manner of the Extended Matrix 1.5, as yEd draws it.

Units are boxes in the shapes and borders of the palette (`archmodel.stratigraphy.palette`); a line leads from the later
unit to the earlier one, a double line joins units of one time. The name of a relation stands as the label of its line.
What else is drawn (documents, extractors, properties, comments, lines of other styles) is counted by its kind. The
properties `absolute_time_start` and `absolute_time_end` of a unit, joined to it by a line, alone or in a group of
paradata, are its dates.

Epochs are the rows of a table of swimlanes, from top to bottom: a unit is of the epoch in whose row its middle lies.
The label of a row is its name, which years may follow: ``Phase I [start:1180;end:1210]``. Groups may be units that have
parts.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from xml.etree import ElementTree as etree

from archmodel.stratigraphy.dates import Dated
from archmodel.stratigraphy.edtf import year_bounds
from archmodel.stratigraphy.order import Link
from archmodel.stratigraphy.palette import COMMON, G, Y, box_of, label_of, line_kind
from archmodel.tables.stratigraphy import DEFINITIONS, INVERSE
from ground.errors import UsageError

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


WRITTEN_BY = "written by MOMA"
"""Description of the drawings that this program writes, which yEd keeps."""

_STYLES: Mapping[str, str] = {"line": "later_than", "double_line": "contemporary_with"}
"""Relations of lines without the name of one, by style."""

ABSOLUTE = ("absolute_time_start", "absolute_time_end")
"""Properties that date a unit, from the earliest to the latest year, as texts that `year_bounds` reads."""

_LARGEST = 1 << 28  # bytes
_INTERVAL = "absolute_time"  # both ends in one text
_COMMENT = ("«", "#")  # begin lines of a description that comment on it


@dataclass(frozen=True)
class DrawnUnit:
    """Content of the box of a unit.

    Attributes
    ----------
    kind : one of `archmodel.stratigraphy.palette.UNIT_KINDS`
    title : its description; None: none
    epoch : name of the epoch in whose row it lies; None: in none
    parent : name of the unit in whose group it lies; None: in none
    begins, ends : its absolute dates, as `ABSOLUTE`; None: none stated
    """

    kind: str = COMMON
    title: str | None = None
    epoch: str | None = None
    parent: str | None = None
    begins: str | None = None
    ends: str | None = None


@dataclass(frozen=True)
class GraphmlStratigraphy:
    """Units and relations of a file.

    Attributes
    ----------
    units : by name, in the order of the file
    links : relations between them
    ignored : number of nodes and lines that are no stratigraphy, by kind in words
    epochs : the labelled rows of the table of swimlanes, the latest first; with years where the label has them
    own : this program wrote it
    """

    units: Mapping[str, DrawnUnit]
    links: tuple[Link, ...]
    ignored: Mapping[str, int] = field(default_factory=dict)
    epochs: tuple[Dated, ...] = ()
    own: bool = False


def read_graphml(path: Path, named: Callable[[str], str | None] = lambda text: None) -> GraphmlStratigraphy:
    """Read units, relations and epochs.

    Parameters
    ----------
    named : relation that a word names, in whatever language; None: none

    Raises
    ------
    UsageError
        if the file is not GraphML, or has no units
    """
    root = _root(path)
    reader = _Reader(root)
    reader.read_nodes(root, None, "")
    if not reader.units:
        remedy = "draw units as rectangles with the name as label, as in the palette of the Extended Matrix"
        raise UsageError("no stratigraphic units", where=str(path), remedy=remedy)
    links = dict.fromkeys(link for edge in root.iter(f"{{{G}}}edge") if (link := reader.link(edge, named)))
    reader.count_dates()
    epochs = dict.fromkeys(lane.epoch for lane in reader.lanes)
    own = any(data.text == WRITTEN_BY for data in root.findall(f"./{{{G}}}graph/{{{G}}}data"))
    return GraphmlStratigraphy(reader.units, tuple(links), dict(reader.ignored), tuple(epochs), own)


def _root(path: Path) -> etree.Element:
    """Parse the file; without a document type, which could make it grow or read other files."""
    where = str(path)
    try:
        if path.stat().st_size > _LARGEST:
            raise UsageError(f"more than {_LARGEST} bytes", where=where, remedy="export the matrix alone")
        text = path.read_bytes()
        if b"<!DOCTYPE" in text or b"<!ENTITY" in text:
            raise UsageError("XML with a document type", where=where, remedy="save it again by yEd")
        root = etree.fromstring(text)
    except (OSError, etree.ParseError) as error:
        raise UsageError(f"cannot be read: {error}", where=where, remedy="save it again by yEd") from error
    if root.tag != f"{{{G}}}graphml":
        raise UsageError("not GraphML", where=where, remedy="save the matrix as GraphML by yEd")
    return root


class _Reader:
    """Units of a drawing by the numbers of their nodes, and counts of all else."""

    def __init__(self, root: etree.Element) -> None:
        self.lanes: list[Lane] = [
            lane for table in root.iter(f"{{{Y}}}TableNode") for lane in lanes_of(table)
        ]
        self.units: dict[str, DrawnUnit] = {}
        self.names: dict[str, str] = {}
        self.ignored: Counter[str] = Counter()
        self._dates: dict[str, dict[int, list[tuple[str, str]]]] = {}
        self._undated: dict[int, str] = {}
        self._described = {
            key.get("id")
            for key in root.findall(f"{{{G}}}key")
            if (key.get("for"), key.get("attr.name")) == ("node", "description")
        }

    def read_nodes(self, element: etree.Element, parent: str | None, group: str) -> None:
        """Read the nodes of the graphs within an element; those within a unit's group are parts of it."""
        for node in element.findall(f"./{{{G}}}graph/{{{G}}}node"):
            box, number = box_of(node), node.get("id", "")
            inside = parent
            if box is not None and box.is_unit:
                self._add(node, box.name, box.kind, parent)
                inside = box.name
            elif box is not None and not (
                box.kind == "properties" and self._add_dates(node, box.name, group)
            ):
                self.ignored[f"{box.kind} ({box.name[:40]})" if box.kind == "properties" else box.kind] += 1
            self.read_nodes(node, inside, number)

    def _add_dates(self, node: etree.Element, name: str, group: str) -> bool:
        """Keep the dates that a property states, by its node and the group around it; False if it states none."""
        key = name.rpartition(".")[2].strip().lower().replace(" ", "_")
        text = self._title(node) or ""
        if key not in (*ABSOLUTE, _INTERVAL):
            return False
        try:
            first, last = year_bounds(key, text)
        except UsageError:
            return False
        if key == _INTERVAL:
            years = zip(ABSOLUTE, (first, last), strict=True)
            dates = [(end, str(year)) for end, year in years if year is not None]
        else:
            dates = [(key, text)]
        entry = len(self._undated)
        self._undated[entry] = name
        for place in {node.get("id", ""), group} - {""}:
            self._dates.setdefault(place, {})[entry] = dates
        return True

    def count_dates(self) -> None:
        """Count the dates that no line joins to a unit."""
        self.ignored.update(f"properties ({name[:40]})" for name in self._undated.values())

    def _date(self, unit: str, number: str) -> bool:
        """Date a unit by a property or a group of such; False if the node is neither."""
        stated = self._dates.get(number)
        for entry, dates in (stated or {}).items():
            self._undated.pop(entry, None)
            for end, text in dates:
                key = "begins" if end == ABSOLUTE[0] else "ends"
                self.units[unit] = replace(self.units[unit], **{key: text})
        return stated is not None

    def _add(self, node: etree.Element, name: str, kind: str, parent: str | None) -> None:
        self.names[node.get("id", "")] = name
        if name in self.units:
            self.ignored["further boxes of units that are drawn twice"] += 1
            return
        lane = lane_of(node, self.lanes)
        epoch = None if lane is None else lane.epoch.phase
        self.units[name] = DrawnUnit(kind, self._title(node), epoch, None if parent == name else parent)

    def _title(self, node: etree.Element) -> str | None:
        """Return the description of a node without its comments."""
        texts = (
            data.text or "" for data in node.findall(f"{{{G}}}data") if data.get("key") in self._described
        )
        lines = (line.strip() for text in texts for line in text.splitlines())
        return " ".join(line for line in lines if line and not line.startswith(_COMMENT)) or None

    def link(self, edge: etree.Element, named: Callable[[str], str | None]) -> Link | None:
        """Return the relation of a line; None for one that is no stratigraphy, which is counted."""
        ends = edge.get("source", ""), edge.get("target", "")
        subject, target = (self.names.get(end) for end in ends)
        if (subject is None) != (target is None) and self._date(
            subject or target or "", ends[subject is not None]
        ):
            return None
        drawn = next(iter(edge.findall(f"./{{{G}}}data/*")), None)
        line = None if drawn is None else drawn.find(f"{{{Y}}}LineStyle")
        style = "line" if line is None else line.get("type", "line")
        if subject is None or target is None:
            self.ignored[line_kind(style, between_units=False)] += 1
            return None
        if subject == target:
            self.ignored["lines from a unit to itself"] += 1
            return None
        name = _relation_name(label_of(None if drawn is None else drawn.find(f"{{{Y}}}EdgeLabel")), named)
        if name in DEFINITIONS:
            return Link(subject, name, target)
        inverse = next((relation for relation, other in INVERSE.items() if other == name), None)
        if inverse is not None:
            return Link(target, inverse, subject)
        if style not in _STYLES:
            self.ignored[line_kind(style, between_units=True)] += 1
            return None
        return Link(subject, _STYLES[style], target)


def _relation_name(words: str, named: Callable[[str], str | None]) -> str:
    """Return the relation that a label names; "" for none."""
    name = words.replace(" ", "_")
    return name if name in (*DEFINITIONS, *INVERSE.values()) else named(words) or ""
