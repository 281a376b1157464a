"""Stratigraphy as GraphML in the manner of the Extended Matrix 1.5, as yEd draws it.

Stratigraphic units are rectangles with a red border; a line leads from the later unit to the earlier one, a double line
joins units of one time. The name of a relation stands as the label of its line. Nodes of other shapes (documents,
extractors, properties, the table of epochs) are no units, and lines of other styles no stratigraphy: they are counted.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as etree

from archmodel.stratigraphy.order import Link, Order
from archmodel.tables.stratigraphy import DEFINITIONS, INVERSE, SYMMETRIC
from ground.errors import UsageError

__all__ = ["GraphmlStratigraphy", "read_graphml", "write_graphml"]

_G, _Y = "http://graphml.graphdrawing.org/xmlns", "http://www.yworks.com/xml/graphml"
_SHAPES = frozenset({"rectangle", "parallelogram", "hexagon", "ellipse", "octagon"})
"""Shapes of units: real ones, virtual ones, series of them, special finds."""

_STYLES: Mapping[str, str] = {"line": "later_than", "double_line": "contemporary_with"}
"""Relations of lines without the name of one, by style."""

_BORDER, _FILL = "#9B3333", "#F0F0F0"  # of a stratigraphic unit, by the rules of the Extended Matrix
_WIDTH, _HEIGHT, _STEP = 90.0, 30.0, 60.0  # of nodes, and between rows, in yEd's units
_LARGEST = 1 << 28  # bytes


@dataclass(frozen=True)
class GraphmlStratigraphy:
    """Units and relations of a file.

    Attributes
    ----------
    units : labels of the units, in the order of the file
    links : relations between them
    ignored : number of nodes and lines that are no stratigraphy
    """

    units: tuple[str, ...]
    links: tuple[Link, ...]
    ignored: int


def read_graphml(path: Path) -> GraphmlStratigraphy:
    """Read units and relations.

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
    ignored = 0
    for node in root.iter(f"{{{_G}}}node"):
        name = _unit(node)
        if name is None:
            ignored += 1
            continue
        names[node.get("id", "")] = name
    if not names:
        remedy = "draw units as rectangles with the name as label, as in the palette of the Extended Matrix"
        raise UsageError("no stratigraphic units", where=where, remedy=remedy)
    links = []
    for edge in root.iter(f"{{{_G}}}edge"):
        link = _link(edge, names)
        if link is None:
            ignored += 1
        else:
            links.append(link)
    return GraphmlStratigraphy(tuple(dict.fromkeys(names.values())), tuple(dict.fromkeys(links)), ignored)


def _unit(node: etree.Element) -> str | None:
    """Return the label of a unit; None for a node that is something else."""
    shape = node.find(f"./{{{_G}}}data/{{{_Y}}}ShapeNode")
    if shape is None or node.find(f"./{{{_G}}}graph") is not None:
        return None
    kind, label = shape.find(f"{{{_Y}}}Shape"), shape.find(f"{{{_Y}}}NodeLabel")
    name = " ".join("".join(label.itertext()).split()) if label is not None else ""
    return name if name and kind is not None and kind.get("type") in _SHAPES else None


def _link(edge: etree.Element, names: Mapping[str, str]) -> Link | None:
    subject, target = names.get(edge.get("source", "")), names.get(edge.get("target", ""))
    drawn = next(iter(edge.findall(f"./{{{_G}}}data/*")), None)
    if subject is None or target is None or subject == target:
        return None
    if drawn is None:
        return Link(subject, "later_than", target)
    label, style = drawn.find(f"{{{_Y}}}EdgeLabel"), drawn.find(f"{{{_Y}}}LineStyle")
    named = "_".join("".join(label.itertext()).split()) if label is not None else ""
    if named in DEFINITIONS:
        return Link(subject, named, target)
    inverse = next((name for name, inverse_name in INVERSE.items() if inverse_name == named), None)
    if inverse is not None:
        return Link(target, inverse, subject)
    relation = _STYLES.get("line" if style is None else style.get("type", "line"))
    return None if relation is None else Link(subject, relation, target)


def write_graphml(order: Order, links: tuple[Link, ...] | list[Link], places: Mapping[str, float]) -> str:
    """Return GraphML with all relations that are stated, units placed as in the drawing.

    Parameters
    ----------
    places : place of the first of equal units along its row, in widths of a box
    """
    etree.register_namespace("", _G)
    etree.register_namespace("y", _Y)
    root = etree.Element(f"{{{_G}}}graphml")
    for number, (target, kind) in enumerate((("node", "nodegraphics"), ("edge", "edgegraphics"))):
        etree.SubElement(root, f"{{{_G}}}key", {"id": f"d{number}", "for": target, "yfiles.type": kind})
    graph = etree.SubElement(root, f"{{{_G}}}graph", {"id": "G", "edgedefault": "directed"})
    numbers = {code: f"n{k}" for k, code in enumerate(_codes(order))}
    top = max(order.levels.values(), default=0)
    for unit, group in order.equal.items():
        for k, code in enumerate(group):
            x = places.get(unit, 0.0) * 2.0 * _WIDTH + k * _WIDTH
            _add_node(graph, numbers[code], code, x, (top - order.levels[unit]) * _STEP)
    for k, link in enumerate(links):
        _add_edge(graph, f"e{k}", numbers, link)
    etree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + etree.tostring(root, encoding="unicode") + "\n"


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
