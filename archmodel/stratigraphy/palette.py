"""Palette of the Extended Matrix 1.5 in yEd: the kinds of units by shape, border and fill, and what else is drawn.

The kind of a unit stands in its box alone: shape, colour of the border, dashes. Groups are units that have parts, or
activities, branches of time and evidence, by the colour behind their name.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree as etree

G, Y = "http://graphml.graphdrawing.org/xmlns", "http://www.yworks.com/xml/graphml"
"""Namespaces of GraphML and of yEd's drawings."""

COMMON = "US"
"""Kind of a unit of which nothing else is said."""

_RED, _ORANGE, _BLUE, _GREEN, _GOLD, _BRONZE = (
    "#9B3333",
    "#D86400",
    "#248FE7",
    "#31792D",
    "#D8BD30",
    "#B19F61",
)

UNIT_KINDS: Mapping[str, tuple[str, str, str, str]] = {
    # kind: shape, border, style of the border, fill
    "US": ("rectangle", _RED, "line", "#FFFFFF"),
    "serSU": ("ellipse", _RED, "line", "#FFFFFF"),
    "USD": ("roundrectangle", _ORANGE, "line", "#FFFFFF"),
    "serUSD": ("ellipse", _ORANGE, "line", "#FFFFFF"),
    "USVs": ("parallelogram", _BLUE, "line", "#000000"),
    "serUSVs": ("ellipse", _BLUE, "line", "#000000"),
    "USVn": ("hexagon", _GREEN, "line", "#000000"),
    "serUSVn": ("ellipse", _GREEN, "line", "#000000"),
    "SF": ("octagon", _GOLD, "line", "#FFFFFF"),
    "VSF": ("octagon", _BRONZE, "line", "#000000"),
    "RSF": ("octagon", _RED, "line", "#FFFFFF"),
    "TSU": ("roundrectangle", _RED, "dashed", "#FFFFFF"),
}
"""Kinds of units: stratigraphic, documentary, virtual (structural or not), their series, finds, transformations."""

_OF_SHAPE = {"rectangle": "US", "roundrectangle": "USD", "parallelogram": "USVs", "hexagon": "USVn"} | {
    "ellipse": "serSU", "octagon": "SF",
}  # fmt: skip
_OF_GROUP = {_RED: "US", _ORANGE: "USD", _BRONZE: "VSF"}
_GROUPS = {"#FFCC99": "groups of paradata", "#CCFFFF": "activities", "#99CC00": "time branches"}
_PAPERS = frozenset({"#FFCC00", "#FFFF00", "#FFFF99"})
"""Fills of yEd's notes."""

_BORDERS = frozenset(border for _, border, _, _ in UNIT_KINDS.values())
_LINES = {
    "dotted": "lines of change (dotted)",
    "dashed": "lines of provenance (dashed)",
    "dashed_dotted": "lines of contrast (dashed and dotted)",
}
_BPMN = {"ARTIFACT_TYPE_ANNOTATION": "properties", "ARTIFACT_TYPE_DATA_OBJECT": "documents"}


@dataclass(frozen=True)
class Box:
    """Identity of a node of a drawing.

    Attributes
    ----------
    kind : of a unit, one of UNIT_KINDS; else the plural of what it is, to be counted
    name : label
    is_unit : whether it is a stratigraphic unit
    """

    kind: str
    name: str
    is_unit: bool = False


def label_of(element: etree.Element | None) -> str:
    """Return the text of a label with single spaces; "" without one."""
    return "" if element is None else " ".join("".join(element.itertext()).split())


def box_of(node: etree.Element) -> Box | None:
    """Return what a node is; None for a table of swimlanes."""
    drawn = next(iter(node.findall(f"./{{{G}}}data/*")), None)
    if drawn is None:
        return Box("nodes without a drawing", "")
    what = drawn.tag.removeprefix(f"{{{Y}}}")
    group = drawn if what == "GroupNode" else drawn.find(f".//{{{Y}}}GroupNode")
    if what == "TableNode":
        return None
    if group is not None or node.find(f"./{{{G}}}graph") is not None:
        return _group(drawn if group is None else group)
    name = label_of(drawn.find(f"{{{Y}}}NodeLabel"))
    if what == "ShapeNode":
        return _shape(drawn, name)
    if what == "GenericNode":
        types = (value.get("value", "") for value in drawn.iter(f"{{{Y}}}Property"))
        kind = next((_BPMN[value] for value in types if value in _BPMN), "other nodes")
        return Box(kind, name)
    if what == "SVGNode":
        first = name.partition(".")[0]
        return Box({"D": "extractors", "C": "combiners"}.get(first, "nodes of continuity"), name)
    return Box("pictures" if what == "ImageNode" else "other nodes", name)


def _group(drawn: etree.Element) -> Box:
    """Return what a group is, by the colour behind its name."""
    label = drawn.find(f"{{{Y}}}NodeLabel")
    colour = "" if label is None else label.get("backgroundColor", "").upper()
    name = label_of(label)
    if colour in _OF_GROUP and name:
        return Box(_OF_GROUP[colour], name, is_unit=True)
    return Box(_GROUPS.get(colour, "groups"), name)


def _shape(drawn: etree.Element, name: str) -> Box:
    """Return what a shape is: a unit, a note, a node of continuity, or something else."""
    shape, fill, border = (drawn.find(f"{{{Y}}}{tag}") for tag in ("Shape", "Fill", "BorderStyle"))
    form = "" if shape is None else shape.get("type", "")
    colour = "" if border is None else border.get("color", "").upper()
    style = "line" if border is None else border.get("type", "line")
    paper = "" if fill is None else fill.get("color", "").upper()
    if form == "diamond":
        return Box("nodes of continuity", name)
    if form not in _OF_SHAPE or not name:
        return Box("shapes without a name" if not name else f"shapes ({form[:20] or 'of no type'})", name)
    if paper in _PAPERS and colour not in _BORDERS:
        return Box("comments", name)
    exact = (kind for kind, drawn_as in UNIT_KINDS.items() if drawn_as[:3] == (form, colour, style))
    return Box(next(exact, _OF_SHAPE[form]), name, is_unit=True)


def line_kind(style: str, between_units: bool) -> str:
    """Return the plural of a line that is no stratigraphy, to be counted."""
    if style in _LINES:
        return _LINES[style]
    return f"lines ({style[:20]})" if between_units else "lines to what is no unit"
