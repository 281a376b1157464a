"""Small drawings in the manner of yEd, in the palette of the Extended Matrix 1.5."""

from pathlib import Path

from archmodel.stratigraphy.palette import UNIT_KINDS

_SPACES = "xmlns='http://graphml.graphdrawing.org/xmlns' xmlns:y='http://www.yworks.com/xml/graphml'"
_KEYS = (
    "<key id='d4' for='node' attr.name='url' attr.type='string'/>"
    "<key id='d5' for='node' attr.name='description' attr.type='string'/>"
    "<key id='d6' for='node' yfiles.type='nodegraphics'/><key id='d10' for='edge' yfiles.type='edgegraphics'/>"
)


def shape(number: str, kind: str, name: str, text: str = "", fill: str = "") -> str:
    """Box of a unit."""
    form, border, style, paper = UNIT_KINDS[kind]
    return (
        f"<node id='{number}'><data key='d5'><![CDATA[{text}]]></data><data key='d6'><y:ShapeNode>"
        f"<y:Geometry x='0' y='40' width='90' height='30'/><y:Fill color='{fill or paper}'/>"
        f"<y:BorderStyle color='{border}' type='{style}' width='4.0'/><y:NodeLabel>{name}</y:NodeLabel>"
        f"<y:Shape type='{form}'/></y:ShapeNode></data></node>"
    )


def group(number: str, colour: str, name: str, inside: str) -> str:
    """Group with a coloured name."""
    label = f"<y:NodeLabel backgroundColor='{colour}'>{name}</y:NodeLabel>"
    frame = "<y:Geometry x='0' y='40' width='90' height='30'/>"
    return (
        f"<node id='{number}' yfiles.foldertype='group'><data key='d6'><y:ProxyAutoBoundsNode><y:Realizers active='0'>"
        f"<y:GroupNode>{frame}{label}</y:GroupNode><y:GroupNode>{frame}{label}</y:GroupNode></y:Realizers>"
        f"</y:ProxyAutoBoundsNode></data><graph id='{number}:' edgedefault='directed'>{inside}</graph></node>"
    )


def artifact(number: str, kind: str, name: str) -> str:
    """Property or document."""
    settings = (
        f"<y:StyleProperties><y:Property name='com.yworks.bpmn.type' value='{kind}'/></y:StyleProperties>"
    )
    inside = f"<y:NodeLabel>{name}</y:NodeLabel>{settings}"
    return f"<node id='{number}'><data key='d6'><y:GenericNode>{inside}</y:GenericNode></data></node>"


def other(number: str, kind: str, name: str, inside: str = "") -> str:
    """Node of another kind."""
    drawn = f"<y:{kind}><y:NodeLabel>{name}</y:NodeLabel>{inside}</y:{kind}>"
    return f"<node id='{number}'><data key='d6'>{drawn}</data></node>"


def line(source: str, target: str, style: str, label: str = "") -> str:
    """Line between two nodes."""
    words = f"<y:EdgeLabel visible='false'>{label}</y:EdgeLabel>" if label else ""
    drawn = f"<y:PolyLineEdge><y:LineStyle type='{style}'/>{words}</y:PolyLineEdge>"
    return f"<edge id='{source}{target}' source='{source}' target='{target}'><data key='d10'>{drawn}</data></edge>"


def drawing(path: Path, *parts: str) -> Path:
    """File with these nodes and lines."""
    body = f"<graph id='G' edgedefault='directed'>{''.join(parts)}</graph>"
    path.write_text(f"<graphml {_SPACES}>{_KEYS}{body}</graphml>", encoding="utf-8")
    return path
