"""Entities of a DXF drawing: closed curves, texts, and what neither is, each with its layer; blocks are resolved."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import numpy as np

from survey.arrays import Array

__all__ = ["Curve", "DrawnText", "Entities", "entities_of"]

_CLOSE = 0.002  # distance of the ends of a curve that counts as closed, of its longest side
_SAGITTA = 0.001  # by which arcs may differ from their chords [drawing units]
_DEEPEST = 16  # blocks within blocks
_CURVES = ("LWPOLYLINE", "POLYLINE", "SPLINE", "CIRCLE", "ELLIPSE")
_SILENT = ("POINT", "ATTDEF", "VIEWPORT", "XLINE", "RAY")  # of which nobody makes a stone
_BACKWARD = 2  # bit of the flag of a text that is written from right to left (DXF, group 71)
_SAME_BOX = 0.02  # difference of two boxes that are of one stone, of their size


@dataclass(frozen=True)
class Curve:
    """A closed curve.

    Attributes
    ----------
    ring : (n, 3) corners in drawing units, not closed
    layer : its layer; in a block on layer 0, that of the insert
    where : kind, handle and layer, for messages
    label : number of the inserted label whose block it is of; None if of none
    """

    ring: Array
    layer: str
    where: str
    label: int | None = None


@dataclass(frozen=True)
class DrawnText:
    """A text, or the attributes of an inserted label.

    Attributes
    ----------
    places : where it may stand, in order of preference, each (3,) in drawing units
    text : it, or ""
    values : attributes by tag
    mirrored : whether it is written from right to left
    """

    places: tuple[Array, ...]
    text: str
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
    """

    curves: list[Curve] = field(default_factory=list)
    texts: list[DrawnText] = field(default_factory=list)
    left: Counter[str] = field(default_factory=Counter)
    hidden: Counter[str] = field(default_factory=Counter)
    hidden_texts: Counter[str] = field(default_factory=Counter)


def entities_of(drawing: Any, layer: str | None) -> Entities:
    """Sort the entities of the model space.

    Parameters
    ----------
    drawing : of ezdxf
    layer : on which outlines lie, which may be hidden; None: all that are shown
    """
    entities = Entities()
    off = {layer.dxf.name.lower() for layer in drawing.layers if layer.is_frozen() or layer.is_off()}
    off -= {"" if layer is None else layer.lower()}
    hatches = list[Curve]()
    for entity, on, label in _resolved(drawing.modelspace(), count(), 0):
        kind = entity.dxftype()
        hidden = on.lower() in off or (layer is None and bool(entity.dxf.get("invisible", 0)))
        if kind in ("TEXT", "MTEXT", "INSERT"):
            if kind == "INSERT" and label is None:  # deeper than blocks are followed
                entities.left[kind] += 1
            elif hidden:
                entities.hidden_texts[on] += 1
            else:
                entities.texts.append(_label(entity) if kind == "INSERT" else _text(entity))
            continue
        if kind in _SILENT or (layer is not None and on.lower() != layer.lower()):
            continue
        where = f"{kind} {entity.dxf.handle or 'of a block'} on layer {on}"
        rings = _rings(entity)
        if not rings:
            entities.left[f"open {kind}" if kind in _CURVES else kind] += 1
        elif hidden:
            entities.hidden[on] += len(rings)
        else:
            found = hatches if kind == "HATCH" else entities.curves
            found.extend(Curve(ring, on, where, label) for ring in rings)
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
        return DrawnText(
            (_vector(entity.dxf.insert),), " ".join(entity.plain_text().split()), mirrored=behind
        )
    mirrored = bool(entity.dxf.text_generation_flag & _BACKWARD) != (entity.dxf.extrusion.z < 0.0)
    return DrawnText((_place(entity),), " ".join(entity.dxf.text.split()), mirrored=mirrored)


def _label(insert: Any) -> DrawnText:
    """Return the attributes of an inserted label, which may stand beside the stone that it was inserted in."""
    values = {
        attribute.dxf.tag: " ".join(attribute.dxf.text.split())
        for attribute in insert.attribs
        if attribute.dxf.text.strip()
    }
    places = (*map(_place, insert.attribs), _place(insert))
    return DrawnText(places, "", values)


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


def _corners(entity: Any) -> Array:
    """Return the corners (n, 3) of a curve, arcs by chords."""
    kind = entity.dxftype()
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
