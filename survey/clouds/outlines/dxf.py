"""Outlines in DXF drawings: closed polylines, whose codes are texts inside them or their layers; read with ezdxf."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from moma.errors import SurveyError
from survey.arrays import Array
from survey.clouds.extras import optional
from survey.clouds.outlines.outline import Attributes, Outline, made_code
from survey.geometry.polygons import inside
from survey.geometry.solids import area_vector

__all__ = ["read_dxf"]

_CLOSE = 0.002  # distance of the ends of a polyline that counts as closed, of its longest side
_SAGITTA = 0.001  # by which arcs may differ from their chords [drawing units]
_UNITS = {1: 0.0254, 2: 0.3048, 4: 0.001, 5: 0.01, 6: 1.0, 14: 0.1}  # $INSUNITS: length of a unit [m]


def read_dxf(path: Path, layer: str | None, chosen: Mapping[str, str]) -> tuple[Outline, ...]:
    """Read the closed polylines of a drawing.

    The code of a stone is the text that lies inside its outline; without texts, the layer where every stone has one of
    its own; otherwise its number. Lengths are in the drawing's unit, if it states one, else in metres.

    Parameters
    ----------
    path : the file
    layer : on which outlines lie; None: all
    chosen : {"code": "layer"} or {"code": "text"}, to choose one

    Raises
    ------
    UsageError
        if ezdxf is not installed
    SurveyError
        if it is not a drawing, or has no closed polyline
    """
    ezdxf = optional("ezdxf", "DXF files")
    try:
        drawing = ezdxf.readfile(path)
    except Exception as error:  # ezdxf raises OSError or its own classes
        what = f"cannot be read as DXF: {' '.join(str(error).split())[:120]}"
        raise SurveyError(what, where=str(path), remedy="save it as DXF R2000 or later") from error
    unit = _UNITS.get(int(drawing.header.get("$INSUNITS", 0)), 1.0)
    rings, texts, open_lines = [], [], 0
    for entity in drawing.modelspace():
        kind = entity.dxftype()
        if kind in ("TEXT", "MTEXT"):
            place = entity.dxf.insert
            text = entity.plain_text() if kind == "MTEXT" else entity.dxf.text
            texts.append((np.array([place.x, place.y, place.z]) * unit, " ".join(text.split())))
        if kind in ("LWPOLYLINE", "POLYLINE") and layer in (None, entity.dxf.layer):
            corners = _corners(entity) * unit
            if _is_closed(entity, corners):
                rings.append((corners, entity.dxf.layer, entity.dxf.handle))
            else:
                open_lines += 1
    if not rings:
        what = f"no closed polyline{'' if layer is None else f' on layer {layer}'}, {open_lines} open ones"
        raise SurveyError(what, where=str(path), remedy="draw each stone as a closed polyline")
    rings = [(_flat(ring), layer_, handle) for ring, layer_, handle in rings]
    return tuple(_coded(rings, texts, chosen.get("code"), path))


def _corners(entity: Any) -> Array:
    """Return the corners (n, 3) of a polyline, arcs by chords."""
    if entity.dxftype() == "POLYLINE" and entity.is_3d_polyline:
        return np.array([tuple(one.dxf.location) for one in entity.vertices], dtype=np.float64)
    if entity.has_arc:
        from ezdxf.path import make_path

        return np.array([tuple(one) for one in make_path(entity).flattening(_SAGITTA)], dtype=np.float64)
    if entity.dxftype() == "LWPOLYLINE":
        return np.array([tuple(one) for one in entity.vertices_in_wcs()], dtype=np.float64)
    return np.array([tuple(one) for one in entity.points_in_wcs()], dtype=np.float64)


def _is_closed(entity: Any, corners: Array) -> bool:
    if len(corners) < 3:
        return False
    closed = entity.closed if entity.dxftype() == "LWPOLYLINE" else entity.is_closed
    return bool(closed) or float(np.linalg.norm(corners[0] - corners[-1])) <= _CLOSE * float(
        np.ptp(corners, axis=0).max()
    )


def _flat(ring: Array) -> Array:
    """Drop a last corner that repeats the first, and heights that are all zero."""
    if len(ring) > 3 and np.linalg.norm(ring[0] - ring[-1]) <= _CLOSE * np.ptp(ring, axis=0).max():
        ring = ring[:-1]
    return ring[:, :2] if not ring[:, 2].any() else ring


def _coded(
    rings: list[tuple[Array, str, str]], texts: list[tuple[Array, str]], chosen: str | None, path: Path
) -> Iterator[Outline]:
    layers = [layer for _, layer, _ in rings]
    by_layer = chosen == "layer" or (chosen is None and not texts and len(set(layers)) == len(layers) > 1)
    for number, (ring, layer, handle) in enumerate(rings, start=1):
        within = [text for place, text in texts if _is_inside(place, ring)]
        said, doubts = Attributes(notes={"layer": layer} if layer != "0" else {}), []
        name = layer if by_layer else within[0] if within else f"S{number}"
        if not by_layer and len(within) > 1:
            doubts.append(("texts", f"{len(within)} texts inside: {', '.join(within[:4])}"))
        where = f"{path}, polyline {handle} on layer {layer}"
        code = made_code(name) or f"S{number}"
        yield Outline(number, code, ring, replace(said, code=code), where, tuple(doubts))


def _is_inside(place: Array, ring: Array) -> bool:
    """Return whether a text lies in an outline, both seen along the axis that the outline faces most."""
    axes = [0, 1]
    if ring.shape[1] == 3:
        axes = [k for k in range(3) if k != int(np.argmax(np.abs(area_vector(ring))))]
    return bool(inside(place[None, axes], ring[:, axes])[0])
