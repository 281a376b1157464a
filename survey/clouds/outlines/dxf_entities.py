"""Entities of a DXF drawing: closed curves, texts, and what neither is, each with its layer; blocks are resolved."""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import Any

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array
from survey.conventions import LEAST, NEGLIGIBLE

_CLOSE = 0.002  # distance of the ends of a curve that counts as closed, of its longest side
_SAGITTA = LEAST  # by which arcs may differ from their chords [drawing units]
_DEEPEST = 16  # blocks within blocks
_CURVES = ("LWPOLYLINE", "POLYLINE", "SPLINE", "CIRCLE", "ELLIPSE")
_PIECES = (*_CURVES, "LINE", "ARC")
_SILENT = ("POINT", "ATTDEF", "VIEWPORT", "XLINE", "RAY")  # of which nobody makes a stone
_SAME_BOX = NEGLIGIBLE  # difference of two boxes that are of one stone, of their size


@dataclass(frozen=True)
class Curve:
    """A closed curve.

    Attributes
    ----------
    ring : (n, 3) corners in drawing units, not closed
    layer : its layer; in a block on layer 0, that of the insert
    where : kind, handle and layer, for messages
    label : number of the inserted label whose block it is of; None if of none
    block : name of that block; None if of none
    chained : whether it was drawn as single lines that meet at their ends
    """

    ring: Array
    layer: str
    where: str
    label: int | None = None
    block: str | None = None
    chained: bool = False


@dataclass(frozen=True)
class DrawnText:
    """A text, or the attributes of an inserted label.

    Attributes
    ----------
    places : where it may stand, in order of preference, each (3,) in drawing units
    lines : of it; none of a label
    values : attributes by tag
    mirrored : whether it is written from right to left
    """

    places: tuple[Array, ...]
    lines: tuple[str, ...]
    values: Mapping[str, str] = field(default_factory=dict)
    mirrored: bool = False


@dataclass
class Entities:
    """Entities of a drawing by their use.

    Attributes
    ----------
    curves : closed curves
    texts : texts and labels
    left : number of other entities by kind
    hidden : number of closed curves by layer that is frozen or off
    hidden_texts : number of texts and labels by layer that is frozen or off
    others : number of closed curves by layer that is shown, but was not named
    """

    curves: list[Curve] = field(default_factory=list)
    texts: list[DrawnText] = field(default_factory=list)
    left: Counter[str] = field(default_factory=Counter)
    hidden: Counter[str] = field(default_factory=Counter)
    hidden_texts: Counter[str] = field(default_factory=Counter)
    others: Counter[str] = field(default_factory=Counter)


def entities_of(drawing: Any, layers: Collection[str]) -> Entities:
    """Sort the entities of the model space.

    Parameters
    ----------
    drawing : of ezdxf
    layers : in lower case, on which outlines lie, which may be hidden; none: all that are shown
    """
    entities = Entities()
    off = {layer.dxf.name.lower() for layer in drawing.layers if layer.is_frozen() or layer.is_off()}
    off -= set(layers)
    hatches, pieces = list[Curve](), list[_Piece]()
    blocks = dict[int | None, str]()
    leaders = list[tuple[Array, Array]]()
    for entity, on, label in _resolved(drawing.modelspace(), count(), 0):
        kind = entity.dxftype()
        hidden = on.lower() in off or (not layers and bool(entity.dxf.get("invisible", 0)))
        if kind in ("TEXT", "MTEXT", "INSERT"):
            if kind == "INSERT" and label is None:  # deeper than blocks are followed
                entities.left[kind] += 1
            elif hidden:
                entities.hidden_texts[on] += 1
            else:
                entities.texts.append(_label(entity) if kind == "INSERT" else _text(entity))
            if kind == "INSERT":
                blocks[label] = entity.dxf.name
            continue
        if kind == "MULTILEADER" and not hidden and (text := _text_of_leader(entity)) is not None:
            entities.texts.append(text)
            continue
        if kind == "LEADER" and not hidden and len(entity.vertices) > 1:
            tip, *_, end = (np.array(tuple(vertex)) for vertex in entity.vertices)
            leaders.append((tip, end))
            continue
        if kind in _SILENT:
            continue
        where = f"{kind} {entity.dxf.handle or 'of a block'} on layer {on}"
        rings = _rings(entity)
        if layers and on.lower() not in layers:
            if not hidden and rings:
                entities.others[on] += len(rings)
        elif not rings and kind in _PIECES and not hidden and len(corners := _corners(entity)) > 1:
            pieces.append(_Piece(corners, on, kind, entity.dxf.handle or "of a block", label))
        elif not rings:
            entities.left[_open(kind)] += 1
        elif hidden:
            entities.hidden[on] += len(rings)
        else:
            found = hatches if kind == "HATCH" else entities.curves
            found.extend(Curve(ring, on, where, label, blocks.get(label)) for ring in rings)
    entities.texts = _led(entities.texts, leaders)
    chained, rest = _chained(pieces)
    entities.curves += chained
    entities.left.update(_open(piece.kind) for piece in rest)
    boxes = [_box(curve.ring) for curve in entities.curves]
    # the filling of an outline is not a second stone
    entities.curves += [hatch for hatch in hatches if not any(_alike(_box(hatch.ring), box) for box in boxes)]
    return entities


def _resolved(
    entities: Any, numbers: Iterator[int], depth: int, layer: str | None = None, label: int | None = None
) -> Iterator[tuple[Any, str, int | None]]:
    """Yield entities with their layers, and the inserted label that they are of; those of blocks at their places.

    An insert comes itself only where it is a label, with its own number, or lies too deep, with none.
    """
    for entity in entities:
        name = str(entity.dxf.get("layer", "0"))
        on = layer if layer is not None and name == "0" else name
        if entity.dxftype() != "INSERT":
            yield entity, on, label
            continue
        within = label
        if any(attribute.dxf.text.strip() for attribute in entity.attribs):
            within = next(numbers)
            yield entity, on, within
        if depth == _DEEPEST:
            yield entity, on, None
            continue
        for one in entity.multi_insert() if entity.mcount > 1 else (entity,):
            yield from _resolved(one.virtual_entities(), numbers, depth + 1, on, within)


def _text(entity: Any) -> DrawnText:
    if entity.dxftype() == "MTEXT":
        behind = entity.dxf.extrusion.z < 0.0
        lines = (" ".join(line.split()) for line in entity.plain_text(split=True))
        return DrawnText((_vector(entity.dxf.insert),), tuple(filter(None, lines)), mirrored=behind)
    mirrored = entity.is_backward != (entity.dxf.extrusion.z < 0.0)
    line = " ".join(entity.dxf.text.split())
    return DrawnText((_place(entity),), (line,) if line else (), mirrored=mirrored)


def _text_of_leader(entity: Any) -> DrawnText | None:
    """Return the text of a multileader, which stands where its arrows point; None if it has none."""
    content = entity.context.mtext
    if content is None:
        return None
    from ezdxf.tools.text import plain_mtext

    lines = (" ".join(str(line).split()) for line in plain_mtext(content.default_content, split=True))
    tips = [
        _vector(line.vertices[0])
        for leader in entity.context.leaders
        for line in leader.lines
        if line.vertices
    ]
    return DrawnText((*tips, _vector(content.insert)), tuple(filter(None, lines)))


def _led(texts: Sequence[DrawnText], leaders: Sequence[tuple[Array, Array]]) -> list[DrawnText]:
    """Return texts and labels, of which those at the end of a leader stand where its arrow points."""
    moved = list(texts)
    for tip, end in leaders if texts else ():
        away = [min(float(np.linalg.norm(place - end)) for place in text.places) for text in texts]
        k = int(np.argmin(away))
        moved[k] = replace(moved[k], places=(tip, *moved[k].places))
    return moved


def _label(insert: Any) -> DrawnText:
    """Return the attributes of an inserted label, which may stand beside the stone that it was inserted in."""
    values = {
        attribute.dxf.tag: " ".join(attribute.dxf.text.split())
        for attribute in insert.attribs
        if attribute.dxf.text.strip()
    }
    places = (*map(_place, insert.attribs), _place(insert))
    return DrawnText(places, (), values)


def _place(entity: Any) -> Array:
    """Return where a text or insert stands; it says so in axes of its own, which are turned in a mirrored drawing."""
    return _vector(entity.ocs().to_wcs(entity.dxf.insert))


def _vector(point: Any) -> Array:
    return np.array([point.x, point.y, point.z])


def _rings(entity: Any) -> list[Array]:
    """Return the closed curves (n, 3) of an entity, none if it has no such."""
    kind = entity.dxftype()
    if kind == "HATCH":
        from ezdxf.path import from_hatch

        paths = (np.array([tuple(one) for one in path.flattening(_SAGITTA)]) for path in from_hatch(entity))
        rings = [_opened(path) for path in paths if len(path) > 3]
        boxes = [_box(ring) for ring in rings]
        # a boundary within another of the same hatch is a hole
        return [
            ring for ring, box in zip(rings, boxes, strict=True) if not any(_within(box, o) for o in boxes)
        ]
    if kind not in _CURVES or (kind == "POLYLINE" and not (entity.is_2d_polyline or entity.is_3d_polyline)):
        return []
    corners = _corners(entity)
    return [_opened(corners)] if len(corners) >= 3 and _is_closed(entity, corners) else []


@dataclass(frozen=True)
class _Piece:
    """A curve that is not closed: its places (n, 3), layer, kind, handle, and the label that it is of."""

    places: Array
    layer: str
    kind: str
    handle: str
    label: int | None


def _open(kind: str) -> str:
    return f"open {kind}" if kind in _CURVES else kind


def _chained(pieces: Sequence[_Piece]) -> tuple[list[Curve], list[_Piece]]:
    """Join pieces of one layer that meet at their ends, two at each, to closed curves; return also the others."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    curves, rest = list[Curve](), list[_Piece]()
    for layer in dict.fromkeys((piece.layer, piece.label) for piece in pieces):
        some = [piece for piece in pieces if (piece.layer, piece.label) == layer]
        ends = np.array([piece.places[k] for piece in some for k in (0, -1)])
        lengths = [float(np.linalg.norm(piece.places[0] - piece.places[-1])) for piece in some]
        pairs = cKDTree(ends).query_pairs(_CLOSE * float(np.median(lengths)), output_type="ndarray")
        meeting = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(ends), len(ends)))
        _, nodes = connected_components(meeting, directed=False)
        two = np.bincount(nodes) == 2  # ends in each node
        along = coo_array((np.ones(len(some)), nodes.reshape(-1, 2).T), shape=(len(two), len(two)))
        _, groups = connected_components(along, directed=False)
        closed = np.ones(groups.max() + 1, np.bool_)
        np.logical_and.at(closed, groups, two)
        members: dict[int, list[int]] = {}
        for k in range(len(some)):
            members.setdefault(int(groups[nodes[2 * k]]), []).append(k)
        for group, of_group in members.items():
            if closed[group] and len(ring := _walked(some, of_group, nodes)) >= 3:
                first = some[of_group[0]]
                where = f"{len(of_group)} {first.kind} from {first.handle} on layer {first.layer}"
                curves.append(Curve(ring, first.layer, where, first.label, chained=True))
            else:
                rest += [some[k] for k in of_group]
    return curves, rest


def _walked(pieces: Sequence[_Piece], members: Sequence[int], nodes: NDArray[np.signedinteger]) -> Array:
    """Return the places (n, 3) of pieces that form a closed curve, in order."""
    open_pieces, ring = list(members[1:]), [pieces[members[0]].places[:-1]]
    end = nodes[2 * members[0] + 1]
    while open_pieces:
        k = next(k for k in open_pieces if end in nodes[2 * k : 2 * k + 2])
        forwards = nodes[2 * k] == end
        places = pieces[k].places if forwards else pieces[k].places[::-1]
        ring.append(places[:-1])
        end = nodes[2 * k + 1] if forwards else nodes[2 * k]
        open_pieces.remove(k)
    return np.concatenate(ring)


def _corners(entity: Any) -> Array:
    """Return the corners (n, 3) of a curve, arcs by chords."""
    kind = entity.dxftype()
    if kind == "LINE":
        return np.array([tuple(entity.dxf.start), tuple(entity.dxf.end)])
    if kind == "POLYLINE" and entity.is_3d_polyline:
        return np.array([tuple(vertex.dxf.location) for vertex in entity.vertices], dtype=np.float64)
    if kind in ("LWPOLYLINE", "POLYLINE") and not entity.has_arc:
        points = entity.vertices_in_wcs() if kind == "LWPOLYLINE" else entity.points_in_wcs()
        return np.array([tuple(point) for point in points], dtype=np.float64)
    from ezdxf.path import make_path

    return np.array([tuple(one) for one in make_path(entity).flattening(_SAGITTA)], dtype=np.float64)


def _is_closed(entity: Any, corners: Array) -> bool:
    kind = entity.dxftype()
    closed = kind == "CIRCLE" or (
        entity.is_closed if kind == "POLYLINE" else kind in ("LWPOLYLINE", "SPLINE") and entity.closed
    )
    return bool(closed) or _meets(corners)


def _meets(corners: Array) -> bool:
    return float(np.linalg.norm(corners[0] - corners[-1])) <= _CLOSE * float(np.ptp(corners, axis=0).max())


def _opened(ring: Array) -> Array:
    """Drop a last corner that repeats the first."""
    return ring[:-1] if len(ring) > 3 and _meets(ring) else ring


def _box(ring: Array) -> Array:
    return np.concatenate([ring.min(axis=0)[:2], ring.max(axis=0)[:2]])


def _alike(one: Array, second: Array) -> bool:
    size = float((second[2:] - second[:2]).max())
    return bool(np.abs(one - second).max() <= _SAME_BOX * size)


def _within(inner: Array, outer: Array) -> bool:
    return bool((inner[:2] > outer[:2]).all() and (inner[2:] < outer[2:]).all())
