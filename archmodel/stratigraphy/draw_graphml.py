"""Stratigraphy written as GraphML for yEd, in the manner of the Extended Matrix 1.5."""

from collections.abc import Iterator, Mapping, Sequence
from xml.etree import ElementTree as etree

from archmodel.stratigraphy.dates import Dated
from archmodel.stratigraphy.graphml import ABSOLUTE, WRITTEN_BY, DrawnUnit
from archmodel.stratigraphy.order import Link, Order
from archmodel.stratigraphy.palette import UNIT_KINDS, G, Y
from archmodel.tables.stratigraphy import SYMMETRIC

_WIDTH, _HEIGHT, _STEP = 90.0, 30.0, 60.0  # of nodes, and between rows, in yEd's units
_HEADER = _HEIGHT  # of the table
_KEYS = (
    ("d0", {"for": "node", "attr.name": "url", "attr.type": "string"}),
    ("d1", {"for": "node", "attr.name": "description", "attr.type": "string"}),
    ("d2", {"for": "node", "yfiles.type": "nodegraphics"}),
    ("d3", {"for": "edge", "attr.name": "description", "attr.type": "string"}),
    ("d4", {"for": "edge", "yfiles.type": "edgegraphics"}),
    ("d5", {"for": "graph", "attr.name": "Description", "attr.type": "string"}),
)
"""Keys of data, as yEd declares them."""

_ARTIFACT = "com.yworks.bpmn.Artifact.withShadow"
_ANNOTATION = {
    "class": "com.yworks.yfiles.bpmn.view.BPMNTypeEnum",
    "name": "com.yworks.bpmn.type",
    "value": "ARTIFACT_TYPE_ANNOTATION",
}
"""Configuration and type of a property, as yEd declares them."""


def write_graphml(
    order: Order,
    links: Sequence[Link],
    places: Mapping[str, float],
    dates: Mapping[str, Dated] | None = None,
    drawn: Mapping[str, DrawnUnit] | None = None,
) -> str:
    """Return GraphML with all relations that are stated, units placed as in the drawing.

    Parameters
    ----------
    places : place of the first of equal units along its row, in widths of a box
    dates : phases of units: they lie in a table of swimlanes, the latest phase on top, the others below it
    drawn : kinds and descriptions of units; those that are missing are stratigraphic units without description
    """
    etree.register_namespace("", G)
    etree.register_namespace("y", Y)
    root = etree.Element(f"{{{G}}}graphml")
    for key, settings in _KEYS:
        etree.SubElement(root, f"{{{G}}}key", {"id": key, **settings})
    graph = etree.SubElement(root, f"{{{G}}}graph", {"id": "G", "edgedefault": "directed"})
    etree.SubElement(graph, f"{{{G}}}data", {"key": "d5"}).text = WRITTEN_BY
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
                within, box = graph if epoch is None else inside, (drawn or {}).get(code, DrawnUnit())
                _draw_unit(_add_node(within, numbers[code], (x, row)), code, box)
                _add_dates(graph, within, numbers[code], (x, row), box)
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
    group = etree.SubElement(graph, f"{{{G}}}node", {"id": "n0", "yfiles.foldertype": "group"})
    data = etree.SubElement(group, f"{{{G}}}data", {"key": "d2"})
    table = etree.SubElement(data, f"{{{Y}}}TableNode", {"configuration": "YED_TABLE_NODE"})
    frame = etree.SubElement(table, f"{{{Y}}}Geometry")
    heading = etree.SubElement(table, f"{{{Y}}}NodeLabel", {"modelName": "internal", "modelPosition": "t"})
    heading.text = "Matrix"
    rows = etree.Element(f"{{{Y}}}Rows")
    total = _HEADER
    for number, (epoch, height) in enumerate(epochs):
        years = ";".join(
            f"{key}:{year}"
            for key, year in (("start", epoch.begins), ("end", epoch.ends))
            if year is not None
        )
        label = etree.SubElement(table, f"{{{Y}}}NodeLabel", {"rotationAngle": "270.0"})
        label.text = f"{epoch.phase} [{years}]" if years else epoch.phase
        model = etree.SubElement(label, f"{{{Y}}}LabelModel")
        etree.SubElement(model, f"{{{Y}}}RowNodeLabelModel", {"offset": "3.0"})
        parameter = etree.SubElement(label, f"{{{Y}}}ModelParameter")
        settings = {"horizontalPosition": "0.0", "id": f"row_{number}", "inside": "true"}
        etree.SubElement(parameter, f"{{{Y}}}RowNodeLabelModelParameter", settings)
        etree.SubElement(rows, f"{{{Y}}}Row", {"id": f"row_{number}", "height": f"{height:g}"})
        total += height
    width = (max(places.values(), default=0.0) + 1.0) * 2.0 * _WIDTH
    for key, value in (("x", -_STEP), ("y", 0.0), ("width", width + _STEP), ("height", total)):
        frame.set(key, f"{value:g}")
    content = etree.SubElement(table, f"{{{Y}}}Table")
    etree.SubElement(content, f"{{{Y}}}Insets", {"top": f"{_HEADER:g}"})
    columns = etree.SubElement(content, f"{{{Y}}}Columns")
    etree.SubElement(columns, f"{{{Y}}}Column", {"id": "column_0", "width": f"{width:g}"})
    content.append(rows)
    return etree.SubElement(group, f"{{{G}}}graph", {"id": "n0:", "edgedefault": "directed"})


def _codes(order: Order) -> Iterator[str]:
    for group in order.equal.values():
        yield from group


def _add_node(graph: etree.Element, number: str, corner: tuple[float, float]) -> etree.Element:
    """Add a node with its frame; return its drawing."""
    node = etree.SubElement(graph, f"{{{G}}}node", {"id": number})
    shape = etree.SubElement(etree.SubElement(node, f"{{{G}}}data", {"key": "d2"}), f"{{{Y}}}ShapeNode")
    place = {
        "x": f"{corner[0]:.1f}",
        "y": f"{corner[1]:.1f}",
        "width": f"{_WIDTH:g}",
        "height": f"{_HEIGHT:g}",
    }
    etree.SubElement(shape, f"{{{Y}}}Geometry", place)
    return node


def _draw_unit(node: etree.Element, code: str, unit: DrawnUnit) -> None:
    """Draw a unit by its kind, with its description."""
    form, border, style, fill = UNIT_KINDS[unit.kind]
    shape = node.find(f"./{{{G}}}data/{{{Y}}}ShapeNode")
    assert shape is not None
    if unit.title is not None:
        described = etree.Element(f"{{{G}}}data", {"key": "d1"})
        described.text = unit.title
        node.insert(0, described)
    ink = "#FFFFFF" if fill == "#000000" else "#000000"
    etree.SubElement(shape, f"{{{Y}}}Fill", {"color": fill, "transparent": "false"})
    etree.SubElement(shape, f"{{{Y}}}BorderStyle", {"color": border, "type": style, "width": "4.0"})
    etree.SubElement(shape, f"{{{Y}}}NodeLabel", {"textColor": ink}).text = code
    etree.SubElement(shape, f"{{{Y}}}Shape", {"type": form})


def _add_dates(
    graph: etree.Element, within: etree.Element, number: str, corner: tuple[float, float], unit: DrawnUnit
) -> None:
    """Add the absolute dates of a unit as properties below its box, each with a dashed line from it."""
    for k, (name, text) in enumerate(zip(ABSOLUTE, (unit.begins, unit.ends), strict=True)):
        if text is None:
            continue
        node = etree.SubElement(within, f"{{{G}}}node", {"id": f"{number}p{k}"})
        etree.SubElement(node, f"{{{G}}}data", {"key": "d1"}).text = text
        data = etree.SubElement(node, f"{{{G}}}data", {"key": "d2"})
        drawn = etree.SubElement(data, f"{{{Y}}}GenericNode", {"configuration": _ARTIFACT})
        width, height = 0.5 * _WIDTH, 0.5 * _HEIGHT
        place = {"x": corner[0] + k * width, "y": corner[1] + _HEIGHT, "width": width, "height": height}
        etree.SubElement(drawn, f"{{{Y}}}Geometry", {key: f"{value:.1f}" for key, value in place.items()})
        etree.SubElement(drawn, f"{{{Y}}}NodeLabel").text = name
        style = etree.SubElement(drawn, f"{{{Y}}}StyleProperties")
        etree.SubElement(style, f"{{{Y}}}Property", _ANNOTATION)
        ends = {"id": f"{number}e{k}", "source": number, "target": f"{number}p{k}"}
        edge = etree.SubElement(graph, f"{{{G}}}edge", ends)
        line = etree.SubElement(etree.SubElement(edge, f"{{{G}}}data", {"key": "d4"}), f"{{{Y}}}PolyLineEdge")
        etree.SubElement(line, f"{{{Y}}}LineStyle", {"color": "#000000", "type": "dashed", "width": "1.0"})


def _add_edge(graph: etree.Element, number: str, numbers: Mapping[str, str], link: Link) -> None:
    ends = {"id": number, "source": numbers[link.subject], "target": numbers[link.target]}
    edge = etree.SubElement(graph, f"{{{G}}}edge", ends)
    line = etree.SubElement(etree.SubElement(edge, f"{{{G}}}data", {"key": "d4"}), f"{{{Y}}}PolyLineEdge")
    style = "double_line" if link.relation in SYMMETRIC else "line"
    etree.SubElement(line, f"{{{Y}}}LineStyle", {"color": "#000000", "type": style, "width": "1.0"})
    etree.SubElement(line, f"{{{Y}}}Arrows", {"source": "none", "target": "none"})
    etree.SubElement(line, f"{{{Y}}}EdgeLabel").text = link.relation
