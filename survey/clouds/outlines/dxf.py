"""Outlines in DXF drawings: closed curves, whose codes are texts or labels inside them, or their layers."""

import shlex
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError
from ground.units import LENGTHS
from survey.arrays import Array
from survey.clouds.extras import optional
from survey.clouds.outlines.dxf_entities import Curve, DrawnText, Entities, entities_of
from survey.clouds.outlines.outline import Outline, attributes_of, made_code
from survey.conventions import GROUP, LISTED
from survey.formats.tables.kinds import KINDS, kind_of
from survey.geometry.polygons import inside
from survey.geometry.solids import area_vector

_UNITS = {
    "Millimeters": "mm",
    "Centimeters": "cm",
    "Decimeters": "dm",
    "Meters": "m",
    "Inches": "in",
    "Feet": "ft",
    "USSurveyFeet": "us-ft",
}
"""Units of length by their names in ezdxf."""
_FRAMED = GROUP  # texts of other outlines within an outline that is no stone


def read_dxf(
    path: Path,
    layer: str | None,
    chosen: Mapping[str, str],
    unit: float | None = None,
    kinds: Mapping[str, str] | None = None,
) -> tuple[tuple[Outline, ...], tuple[tuple[str, str], ...]]:
    """Read the closed curves of a drawing: polylines, splines, circles, ellipses and hatches, also in blocks.

    The code of a stone is the text or label that lies inside its outline; without texts, the layer where every stone
    has one of its own; otherwise its number. Lengths are in the drawing's unit, if it states one, else in metres.

    Parameters
    ----------
    path : the file
    layer : on which outlines lie, or several with commas between them; None: all that are shown
    chosen : {"code": "layer"} or {"code": "text"}, to choose one, or the tag of an attribute by meaning
    unit : length of the drawing's unit [m]; None: as it states
    kinds : kinds of stones by their abbreviation in lower case

    Returns
    -------
    outlines, and what was left out: (reason, text)

    Raises
    ------
    UsageError
        if ezdxf is not installed
    SurveyError
        if it is not a drawing, has no closed curve, or states a unit that is not known
    """
    drawing, entities = _opened(path, layer)
    scale = unit or _stated_unit(drawing, path)
    if not entities.curves:
        raise _empty(path, layer, entities)
    drawn = _without_symbols(entities.curves)
    curves = [replace(curve, ring=_flat(curve.ring * scale)) for curve in drawn]
    texts = [replace(text, places=tuple(scale * place for place in text.places)) for text in entities.texts]
    left = list(_left_out(entities, len(entities.curves) - len(drawn)))
    labels, around = _labelled(curves, texts)
    stones = [k for k, curve in enumerate(curves) if not curve.chained or _is_stone(k, labels, around, texts)]
    left += _astray(texts, labels, len(curves) - len(stones))
    return tuple(_coded(curves, stones, labels, around, chosen, kinds or {}, path)), tuple(left)


def _stated_unit(drawing: Any, path: Path) -> float:
    """Return the length of a drawing's unit [m]; a metre where it states none."""
    code = int(drawing.header.get("$INSUNITS", 0))
    name = {int(unit): unit.name for unit in optional("ezdxf.enums", "DXF files").InsertUnits}.get(code, "")
    if code and name not in _UNITS:
        raise SurveyError(
            f"its unit has the number {code} ($INSUNITS), which is none of masonry",
            where=str(path),
            remedy="state the unit of its lengths, e.g. --unit m",
        )
    return LENGTHS[_UNITS[name]] if code else 1.0


def _opened(path: Path, layer: str | None) -> tuple[Any, Entities]:
    """Return a drawing and its entities."""
    ezdxf = optional("ezdxf", "DXF files")
    try:
        drawing = ezdxf.readfile(path)
        entities = entities_of(drawing, _layers(layer))
    except Exception as error:  # ezdxf raises OSError or its own classes
        what = f"cannot be read as DXF: {' '.join(str(error).split())[:120]}"
        raise SurveyError(what, where=str(path), remedy="save it as DXF R2000 or later") from error
    if 2 * sum(text.mirrored for text in entities.texts) > len(entities.texts):
        raise SurveyError(
            "most of its texts are mirrored: it shows the wall as in a mirror, or from behind",
            where=str(path),
            remedy="mirror the drawing back; if its outlines are as seen from outside, set its texts upright",
        )
    return drawing, entities


def _layers(named: str | None) -> frozenset[str]:
    """Return the layers that are named, in lower case: several with commas between them, or one with commas in it."""
    whole = (named or "").strip().lower()
    return frozenset(name.strip() for name in (whole, *whole.split(",")) if name.strip())


def _without_symbols(curves: Sequence[Curve]) -> list[Curve]:
    """Return the curves without those that inserted labels are drawn with: most stand in the outline of a stone.

    A label may be the stone itself, with its number. Then a curve around it is that of no stone, and holds other
    labels too.
    """
    others = [curve for curve in curves if curve.label is None]
    low, high = (
        np.array([end(curve.ring, axis=0) for curve in others]).reshape(-1, 3) for end in (np.min, np.max)
    )
    size = (high - low).max(axis=1, initial=0.0)[:, None]
    areas = np.array([_area(curve.ring) for curve in others])
    around: dict[int, int] = {}
    for k, curve in enumerate(curves):
        if curve.label is None:
            continue
        middle = curve.ring.mean(axis=0)
        near = ((middle > low - size) & (middle < high + size)).all(axis=1) & (areas > _area(curve.ring))
        holders = [i for i in np.flatnonzero(near).tolist() if _is_inside(middle, others[i].ring)]
        if holders:
            around[k] = min(holders, key=lambda i: float(areas[i]))
    held: dict[int, set[int | None]] = {}
    for k, holder in around.items():
        held.setdefault(holder, set()).add(curves[k].label)
    inside = {k for k, holder in around.items() if len(held[holder]) < _FRAMED}
    of_blocks = Counter(curve.block for curve in curves if curve.label is not None)
    symbols = Counter(curves[k].block for k in inside)
    return [
        curve
        for k, curve in enumerate(curves)
        if k not in inside and (curve.label is None or 2 * symbols[curve.block] <= of_blocks[curve.block])
    ]


def _astray(
    texts: Sequence[DrawnText], labels: Mapping[int, Sequence[DrawnText]], unnamed: int
) -> Iterator[tuple[str, str]]:
    """Yield what was left out of curves of single lines, `unnamed` of which have no text, and labels of no stone."""
    inside = {id(text) for some in labels.values() for text in some}
    outside = [next(iter(text.values.values())) for text in texts if text.values and id(text) not in inside]
    if outside:
        yield "texts", f"{len(outside)} labels stand in no outline: {', '.join(outside[:LISTED])}"
    if unnamed:
        yield "left out", f"{unnamed} closed curves of single lines, without a text of their own"


def _empty(path: Path, layer: str | None, entities: Entities) -> SurveyError:
    what = f"no closed curve{'' if layer is None else f' on layer {layer}'}"
    if entities.left:
        what += f", but {_listed(entities.left)}"
    remedy = "draw each stone as a closed polyline"
    if entities.hidden:
        what += f"; {_listed(entities.hidden)} on layers that are frozen or off"
        remedy = f"show the layer, or name it, e.g. --layer {next(iter(entities.hidden))}"
    return SurveyError(what, where=str(path), remedy=remedy)


def _left_out(entities: Entities, symbols: int) -> Iterator[tuple[str, str]]:
    if symbols:
        yield "left out", f"{symbols} closed curves of labels, which stand in the outlines of stones"
    if entities.hidden_texts:
        yield (
            "hidden",
            f"texts on layers that are frozen or off are left out: {_listed(entities.hidden_texts)}",
        )
    if entities.left:
        yield "left out", f"{_listed(entities.left)}: neither closed curves nor texts"
    if entities.others:
        yield "left out", f"outlines on layers that --layer does not name: {_listed(entities.others)}"
    if entities.hidden:
        yield "hidden", f"outlines on layers that are frozen or off are left out: {_listed(entities.hidden)}"


def _listed(counts: Counter[str]) -> str:
    return ", ".join(f"{count} {name}" for name, count in sorted(counts.items()))


def _flat(ring: Array) -> Array:
    """Drop heights that are all zero."""
    return ring[:, :2] if not ring[:, 2].any() else ring


def _labelled(
    curves: Sequence[Curve], texts: Sequence[DrawnText]
) -> tuple[dict[int, list[DrawnText]], Counter[int]]:
    """Return the texts in each curve, by its place, and the number of those in it that are in a smaller one, too."""
    areas = [_area(curve.ring) for curve in curves]
    smallest = sorted(range(len(curves)), key=lambda k: areas[k])
    labels: dict[int, list[DrawnText]] = {}
    around: Counter[int] = Counter()
    for text in texts:
        holders = next((h for place in text.places if (h := _holders(place, curves, smallest))), [])
        if holders:
            labels.setdefault(holders[0], []).append(text)
            around.update(holders[1:])
    return labels, around


def _is_stone(
    k: int, labels: Mapping[int, Sequence[DrawnText]], around: Mapping[int, int], texts: Sequence[DrawnText]
) -> bool:
    """Return whether a curve of single lines is an outline: of the others of a drawing, frames and tables are."""
    return around[k] < _FRAMED and (k in labels or not texts)


def _coded(
    curves: Sequence[Curve],
    stones: Sequence[int],
    labels: Mapping[int, Sequence[DrawnText]],
    around: Mapping[int, int],
    chosen: Mapping[str, str],
    kinds: Mapping[str, str],
    path: Path,
) -> Iterator[Outline]:
    layers = [curves[k].layer for k in stones]
    wanted = chosen.get("code")
    by_layer = wanted == "layer" or (wanted is None and not labels and len(set(layers)) == len(layers) > 1)
    tags = {meaning: name for meaning, name in chosen.items() if name not in ("layer", "text")}
    for number, k in enumerate(stones, start=1):
        curve = curves[k]
        where = f"{path}, {curve.where}"
        if around[k] >= _FRAMED:
            _refuse_frame(curve, around[k], [curves[i].layer for i in labels if around[i] < _FRAMED], where)
        yield _outline(number, curve, labels.get(k, ()), by_layer, tags, kinds, where)


def _refuse_frame(curve: Curve, count: int, layers: Sequence[str], where: str) -> None:
    stones = [layer for layer in dict.fromkeys(layers) if layer != curve.layer]
    remedy = (
        f"leave it out with --layer {shlex.quote(','.join(stones))}"
        if 2 * layers.count(curve.layer) < len(layers)
        else "put it on another layer, and name those of the stones with --layer"
    )
    raise SurveyError(f"the outline holds {count} texts of other outlines", where=where, remedy=remedy)


def _outline(
    number: int,
    curve: Curve,
    texts: Sequence[DrawnText],
    by_layer: bool,
    tags: Mapping[str, str],
    kinds: Mapping[str, str],
    where: str,
) -> Outline:
    values = {tag: text for one in texts for tag, text in one.values.items()}
    attributes = attributes_of(values, {m: name for m, name in tags.items() if name in values}, where)
    lines = [line for text in texts for line in text.lines]
    of_kind = [line for line in lines if line.lower() in kinds or kind_of(line, kinds) in KINDS]
    if len(set(of_kind)) == 1 and attributes.kind is None:  # a word for a kind beside the number, or alone
        attributes = replace(attributes, kind=of_kind[0])
        texts = [
            replace(text, lines=tuple(line for line in text.lines if line not in of_kind)) for text in texts
        ]
    names = [
        " ".join(text.lines) or attributes.code or next(iter(text.values.values()), "") for text in texts
    ]
    names = [name for name in names if name]
    name = curve.layer if by_layer else names[0] if names else f"S{number}"
    doubts = []
    if not by_layer and len(names) > 1:
        doubts.append(("texts", f"{len(names)} texts inside: {', '.join(names[:4])}"))
    code = made_code(name) or f"S{number}"
    notes = dict(attributes.notes) | ({"layer": curve.layer} if curve.layer != "0" else {})
    return Outline(
        number, code, curve.ring, replace(attributes, code=code, notes=notes), where, tuple(doubts)
    )


def _holders(place: Array, curves: Sequence[Curve], smallest: Sequence[int]) -> list[int]:
    return [k for k in smallest if _is_inside(place, curves[k].ring)]


def _area(ring: Array) -> float:
    return float(np.linalg.norm(area_vector(_in_space(ring))))


def _in_space(ring: Array) -> Array:
    return ring if ring.shape[1] == 3 else np.column_stack([ring, np.zeros(len(ring))])


def _is_inside(place: Array, ring: Array) -> bool:
    """Return whether a text lies in an outline, both seen along the axis that the outline faces most."""
    axes = [0, 1]
    if ring.shape[1] == 3:
        axes = [k for k in range(3) if k != int(np.argmax(np.abs(area_vector(ring))))]
    return bool(inside(place[None, axes], ring[:, axes])[0])
