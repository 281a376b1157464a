"""Stratigraphy as GraphML in the manner of the Extended Matrix 1.5, as yEd draws it.

Stratigraphic units are rectangles with a red border; a line leads from the later unit to the earlier one, a double line
joins units of one time. The name of a relation stands as the label of its line. Nodes of other shapes (documents,
extractors, properties) are no units, and lines of other styles no stratigraphy: they are counted.

Epochs are the rows of a table of swimlanes (`archmodel.stratigraphy.epochs`).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree as etree

from archmodel.stratigraphy.dates import Dated
from archmodel.stratigraphy.epochs import lane_of, lanes_of
from archmodel.stratigraphy.order import Link, Order
from archmodel.tables.stratigraphy import DEFINITIONS, INVERSE, SYMMETRIC
from ground.errors import UsageError

__all__ = ["GraphmlStratigraphy", "read_graphml", "write_graphml"]

_G, _Y = "http://graphml.graphdrawing.org/xmlns", "http://www.yworks.com/xml/graphml"
_SHAPES = frozenset({"rectangle", "roundrectangle", "parallelogram", "hexagon", "ellipse", "octagon"})
"""Shapes of units: real and documentary ones, virtual ones, series of them, special finds."""

_STYLES: Mapping[str, str] = {"line": "later_than", "double_line": "contemporary_with"}
"""Relations of lines without the name of one, by style."""

_BORDER, _FILL = "#9B3333", "#F0F0F0"  # of a stratigraphic unit, by the rules of the Extended Matrix
_WIDTH, _HEIGHT, _STEP = 90.0, 30.0, 60.0  # of nodes, and between rows, in yEd's units
_HEADER = _HEIGHT  # of the table
_LARGEST = 1 << 28  # bytes


@dataclass(frozen=True)
class GraphmlStratigraphy:
    """Units and relations of a file.

    Attributes
    ----------
    units : labels of the units, in the order of the file
    links : relations between them
    ignored : number of nodes and lines that are no stratigraphy
    epochs : those of the table of swimlanes that have units, the latest first; with years where the label has them
    epoch_of : name of the epoch of each unit that lies in a row
    """

    units: tuple[str, ...]
    links: tuple[Link, ...]
    ignored: int
    epochs: tuple[Dated, ...] = ()
    epoch_of: Mapping[str, str] = field(default_factory=dict)


def read_graphml(path: Path, named: Callable[[str], str | None] = lambda text: None) -> GraphmlStratigraphy:
    """Read units, relations and epochs.

    Parameters
    ----------
    named : relation that a word names, in whatever language; None: none

    Raises
    ------
    UsageError
        if the file is not GraphML, has no units, or two units of one name
    """
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
    if root.tag != f"{{{_G}}}graphml":
        raise UsageError("not GraphML", where=where, remedy="save the matrix as GraphML by yEd")
    names: dict[str, str] = {}
    lanes = [lane for table in root.iter(f"{{{_Y}}}TableNode") for lane in lanes_of(table)]
    epoch_of: dict[str, str] = {}
    ignored = 0
    for node in root.iter(f"{{{_G}}}node"):
        name = _unit(node)
        if name is None:
            ignored += 1
            continue
        names[node.get("id", "")] = name
        if (lane := lane_of(node, lanes)) is not None:
            epoch_of.setdefault(name, lane.epoch.phase)
    if not names:
        remedy = "draw units as rectangles with the name as label, as in the palette of the Extended Matrix"
        raise UsageError("no stratigraphic units", where=where, remedy=remedy)
    links = []
    for edge in root.iter(f"{{{_G}}}edge"):
        link = _link(edge, names, named)
        if link is None:
            ignored += 1
        else:
            links.append(link)
    used = set(epoch_of.values())
    return GraphmlStratigraphy(
        tuple(dict.fromkeys(names.values())),
        tuple(dict.fromkeys(links)),
        ignored,
        tuple(dict.fromkeys(lane.epoch for lane in lanes if lane.epoch.phase in used)),
        epoch_of,
    )


def _unit(node: etree.Element) -> str | None:
    """Return the label of a unit; None for a node that is something else."""
    shape = node.find(f"./{{{_G}}}data/{{{_Y}}}ShapeNode")
    if shape is None or node.find(f"./{{{_G}}}graph") is not None:
        return None
    kind, label = shape.find(f"{{{_Y}}}Shape"), shape.find(f"{{{_Y}}}NodeLabel")
    name = " ".join("".join(label.itertext()).split()) if label is not None else ""
    return name if name and kind is not None and kind.get("type") in _SHAPES else None


def _link(edge: etree.Element, names: Mapping[str, str], named: Callable[[str], str | None]) -> Link | None:
    """Return the relation of a line; None for one that is no stratigraphy."""
    subject, target = names.get(edge.get("source", "")), names.get(edge.get("target", ""))
    drawn = next(iter(edge.findall(f"./{{{_G}}}data/*")), None)
    if subject is None or target is None or subject == target:
        return None
    if drawn is None:
        return Link(subject, "later_than", target)
    label, style = drawn.find(f"{{{_Y}}}EdgeLabel"), drawn.find(f"{{{_Y}}}LineStyle")
    words = " ".join("".join(label.itertext()).split()) if label is not None else ""
    name = words.replace(" ", "_")
    if name not in (*DEFINITIONS, *INVERSE.values()):
        name = named(words) or ""
    if name in DEFINITIONS:
        return Link(subject, name, target)
    inverse = next((relation for relation, inverse_name in INVERSE.items() if inverse_name == name), None)
    if inverse is not None:
        return Link(target, inverse, subject)
    relation = _STYLES.get("line" if style is None else style.get("type", "line"))
    return None if relation is None else Link(subject, relation, target)


def write_graphml(
    order: Order, links: Sequence[Link], places: Mapping[str, float], dates: Mapping[str, Dated] | None = None
) -> str:
    """Return GraphML with all relations that are stated, units placed as in the drawing.

    Parameters
    ----------
    places : place of the first of equal units along its row, in widths of a box
    dates : phases of units: they lie in a table of swimlanes, the latest phase on top, the others below it
    """
    etree.register_namespace("", _G)
    etree.register_namespace("y", _Y)
    root = etree.Element(f"{{{_G}}}graphml")
    for number, (target, kind) in enumerate((("node", "nodegraphics"), ("edge", "edgegraphics"))):
        etree.SubElement(root, f"{{{_G}}}key", {"id": f"d{number}", "for": target, "yfiles.type": kind})
    graph = etree.SubElement(root, f"{{{_G}}}graph", {"id": "G", "edgedefault": "directed"})
    numbers = {code: f"n{k}" for k, code in enumerate(_codes(order), start=1)}
    lanes = _rows(order, dates or {})
    heights = [_STEP * len({order.levels[unit] for unit in units}) for _, units in lanes]
    epochs = [(epoch, height) for (epoch, _), height in zip(lanes, heights, strict=True) if epoch is not None]
    inside = _add_table(graph, epochs, places) if epochs else graph
    y = _HEADER if epochs else 0.0
    for (epoch, units), height in zip(lanes, heights, strict=True):
        levels = sorted({order.levels[unit] for unit in units}, reverse=True)
        for unit in units:
            for k, code in enumerate(order.equal[unit]):
                x = places.get(unit, 0.0) * 2.0 * _WIDTH + k * _WIDTH
                row = y + (levels.index(order.levels[unit]) + 0.25) * _STEP
                _add_node(graph if epoch is None else inside, numbers[code], code, x, row)
        y += height
    for k, link in enumerate(links):
        _add_edge(graph, f"e{k}", numbers, link)
    etree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + etree.tostring(root, encoding="unicode") + "\n"


def _rows(order: Order, dates: Mapping[str, Dated]) -> list[tuple[Dated | None, list[str]]]:
    """Return the units of each phase, the latest first; those without one come last."""
    rows: dict[Dated | None, list[str]] = {}
    for unit in order.units:
        epoch = next((dates[code] for code in order.equal[unit] if code in dates), None)
        rows.setdefault(epoch, []).append(unit)

    def begin(row: tuple[Dated | None, list[str]]) -> tuple[bool, float]:
        """Return the place of a row: by the year in which it begins, or else by the latest of its units."""
        epoch, units = row
        year = None if epoch is None else epoch.begins if epoch.begins is not None else epoch.ends
        levels = max(order.levels[unit] for unit in units)
        return epoch is None, -float(levels if year is None else year)

    return sorted(rows.items(), key=begin)


def _add_table(
    graph: etree.Element, epochs: Sequence[tuple[Dated, float]], places: Mapping[str, float]
) -> etree.Element:
    """Add the table of swimlanes, each with its height, as a group; return the graph within it."""
    group = etree.SubElement(graph, f"{{{_G}}}node", {"id": "n0", "yfiles.foldertype": "group"})
    data = etree.SubElement(group, f"{{{_G}}}data", {"key": "d0"})
    table = etree.SubElement(data, f"{{{_Y}}}TableNode", {"configuration": "YED_TABLE_NODE"})
    frame = etree.SubElement(table, f"{{{_Y}}}Geometry")
    rows = etree.Element(f"{{{_Y}}}Rows")
    total = _HEADER
    for number, (epoch, height) in enumerate(epochs):
        years = ";".join(
            f"{key}:{year}"
            for key, year in (("start", epoch.begins), ("end", epoch.ends))
            if year is not None
        )
        label = etree.SubElement(table, f"{{{_Y}}}NodeLabel", {"rotationAngle": "270.0"})
        label.text = f"{epoch.phase} [{years}]" if years else epoch.phase
        model = etree.SubElement(label, f"{{{_Y}}}LabelModel")
        etree.SubElement(model, f"{{{_Y}}}RowNodeLabelModel", {"offset": "3.0"})
        parameter = etree.SubElement(label, f"{{{_Y}}}ModelParameter")
        settings = {"horizontalPosition": "0.0", "id": f"row_{number}", "inside": "true"}
        etree.SubElement(parameter, f"{{{_Y}}}RowNodeLabelModelParameter", settings)
        etree.SubElement(rows, f"{{{_Y}}}Row", {"id": f"row_{number}", "height": f"{height:g}"})
        total += height
    width = (max(places.values(), default=0.0) + 1.0) * 2.0 * _WIDTH
    for key, value in (("x", -_STEP), ("y", 0.0), ("width", width + _STEP), ("height", total)):
        frame.set(key, f"{value:g}")
    content = etree.SubElement(table, f"{{{_Y}}}Table")
    etree.SubElement(content, f"{{{_Y}}}Insets", {"top": f"{_HEADER:g}"})
    columns = etree.SubElement(content, f"{{{_Y}}}Columns")
    etree.SubElement(columns, f"{{{_Y}}}Column", {"id": "column_0", "width": f"{width:g}"})
    content.append(rows)
    return etree.SubElement(group, f"{{{_G}}}graph", {"id": "n0:", "edgedefault": "directed"})


def _codes(order: Order) -> Iterator[str]:
    for group in order.equal.values():
        yield from group


def _add_node(graph: etree.Element, number: str, code: str, x: float, y: float) -> None:
    node = etree.SubElement(graph, f"{{{_G}}}node", {"id": number})
    shape = etree.SubElement(etree.SubElement(node, f"{{{_G}}}data", {"key": "d0"}), f"{{{_Y}}}ShapeNode")
    place = {"x": f"{x:.1f}", "y": f"{y:.1f}", "width": f"{_WIDTH:g}", "height": f"{_HEIGHT:g}"}
    etree.SubElement(shape, f"{{{_Y}}}Geometry", place)
    etree.SubElement(shape, f"{{{_Y}}}Fill", {"color": _FILL, "transparent": "false"})
    etree.SubElement(shape, f"{{{_Y}}}BorderStyle", {"color": _BORDER, "type": "line", "width": "4.0"})
    etree.SubElement(shape, f"{{{_Y}}}NodeLabel").text = code
    etree.SubElement(shape, f"{{{_Y}}}Shape", {"type": "rectangle"})


def _add_edge(graph: etree.Element, number: str, numbers: Mapping[str, str], link: Link) -> None:
    ends = {"id": number, "source": numbers[link.subject], "target": numbers[link.target]}
    edge = etree.SubElement(graph, f"{{{_G}}}edge", ends)
    line = etree.SubElement(etree.SubElement(edge, f"{{{_G}}}data", {"key": "d1"}), f"{{{_Y}}}PolyLineEdge")
    style = "double_line" if link.relation in SYMMETRIC else "line"
    etree.SubElement(line, f"{{{_Y}}}LineStyle", {"color": "#000000", "type": style, "width": "1.0"})
    etree.SubElement(line, f"{{{_Y}}}Arrows", {"source": "none", "target": "none"})
    etree.SubElement(line, f"{{{_Y}}}EdgeLabel").text = link.relation
