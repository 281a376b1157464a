"""Common entry to the readers of outlines, by the ending of the file."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ground.errors import SurveyError, UsageError
from ground.tables.numbers import FARTHEST
from survey.arrays import Array
from survey.clouds.outlines.annotations import is_annotated, read_annotations
from survey.clouds.outlines.coco import is_coco, load_json, read_coco
from survey.clouds.outlines.dxf import read_dxf
from survey.clouds.outlines.labels import outlines_of, read_labels
from survey.clouds.outlines.outline import Outline, WrongOutline, joined_names
from survey.clouds.outlines.plain import is_plain, read_plain_json, read_table
from survey.clouds.outlines.tracing import DENSE, few_corners
from survey.clouds.outlines.vector import read_vector, read_wkt_table, wkt_table
from survey.clouds.world import PixelPlace
from survey.conventions import NOTICEABLE
from survey.formats.fields import KIND, NUMBERED_ANEW
from survey.formats.tables.kinds import kind_of

PICTURES = (".png", ".tif", ".tiff", ".bmp")
"""Endings of label pictures."""

_VECTORS = (".gpkg", ".geojson", ".json", ".shp", ".fgb", ".kml", ".gml", ".sqlite")
_TABLES = (".csv", ".txt", ".xlsx", ".ods", ".xls")
_OF_FORMATS = ("layer", "label", "category")  # notes that readers make themselves
_LONGEST = 200  # characters of names in a remark
DRAWN = 0.005  # standard deviation of a drawn corner, where an outline states none [m]
SMOOTH = 1.5  # largest distance of the boundary of a mask from the sides of its outline [px]
_LIKELY = NOTICEABLE  # standard deviations of a drawn corner that a curve may differ from its sides


@dataclass(frozen=True)
class Drawing:
    """Outlines of stones in one file.

    Attributes
    ----------
    path : the file
    outlines : in metres of the wall's plane (n, 2) or of space (n, 3); in pixels where `pixels`
    pixels : whether coordinates are pixels because nothing says where the picture lies
    pixel : side of a pixel [m]; None if they were not traced from a picture or its place is not known
    size : columns and rows of the picture; None without one
    specks : pieces of a picture that were too small for a stone
    smallest : pieces of fewer pixels are specks
    left : what the file has besides, and was not read: (reason, text)
    wrong : features that are no outline of a stone
    names : of the attributes of its features; none of pictures and drawings
    """

    path: Path
    outlines: tuple[Outline, ...]
    pixels: bool = False
    pixel: float | None = None
    size: tuple[int, int] | None = None
    specks: int = 0
    smallest: int = 0
    left: tuple[tuple[str, str], ...] = ()
    wrong: tuple[WrongOutline, ...] = ()
    names: tuple[str, ...] = ()

    @property
    def remarks(self) -> tuple[str, ...]:
        """Names of the attributes that are kept as notes, because nothing says what they are."""
        names = dict.fromkeys(name for outline in self.outlines for name in outline.said.notes)
        kept = ", ".join(name for name in names if name not in _OF_FORMATS)[:_LONGEST]
        return (
            (f"kept as notes: {kept}; --fields says what an attribute is, e.g. code=Stein_Nr",)
            if kept
            else ()
        )


def read_outlines(
    path: Path,
    *,
    layer: str | None = None,
    chosen: Mapping[str, str] | None = None,
    sigma: float = DRAWN,
    smooth: float = SMOOTH,
    unit: float | None = None,
    kinds: Mapping[str, str] | None = None,
    keep_going: bool = False,
) -> Drawing:
    """Read outlines of stones.

    Parameters
    ----------
    path : GeoPackage, GeoJSON, Shapefile, DXF, a picture of labels, JSON of COCO, labelme or VIA, plain JSON or CSV
    layer : of a file with several, or sheet of a workbook; of a picture of classes, the number or colour of the
        stones; of annotations with several labels or categories, that of the stones
    chosen : names of attributes that the user has given, by meaning
    sigma : standard deviation of a drawn corner [m], to which curves are described by straight sides
    smooth : largest distance of the boundary of a mask from the sides of its outline [px]
    unit : length of the unit of coordinates [m]; None: as the file states, else metres
    kinds : kinds of stones by their abbreviation in lower case
    keep_going : features that are wrong are listed in `wrong`

    Raises
    ------
    UsageError
        if there is no such file or format, or a package is missing
    SurveyError
        naming the first feature that is wrong, unless they are to be listed, or no other is left
    """
    if not path.is_file():
        raise UsageError("no such file", where=str(path), remedy="name a file of outlines with --outlines")
    drawing = _read(path, layer, chosen or {}, smooth, unit, kinds or {})
    if not drawing.outlines and not drawing.wrong:
        raise SurveyError("has no outlines", where=str(path), remedy="draw each stone as a polygon")
    _check_numbers(drawing, chosen or {}, kinds or {})
    outlines, wrong = [], [*drawing.wrong]
    for outline in drawing.outlines:
        try:
            _check(outline)
            if drawing.pixel is None and not drawing.pixels:
                outline = _sparse(outline, _LIKELY * sigma)
            outlines.append(_of_kind(outline, kinds or {}))
        except SurveyError as error:
            wrong.append(WrongOutline(outline.number, outline.code, outline.corners, error))
    if wrong and not (keep_going and outlines):
        raise wrong[0].error
    return replace(drawing, outlines=tuple(outlines), wrong=tuple(wrong))


def _read(
    path: Path,
    layer: str | None,
    chosen: Mapping[str, str],
    smooth: float,
    unit: float | None,
    kinds: Mapping[str, str],
) -> Drawing:
    ending = path.suffix.lower()
    if ending == ".dxf":
        outlines, left = read_dxf(path, layer, chosen, unit, kinds)
        return Drawing(path, outlines, left=left)
    if ending in PICTURES:
        labels = read_labels(path, layer)
        size = labels.numbers.shape[1], labels.numbers.shape[0]
        placed = _placed(path, tuple(outlines_of(labels, smooth)), labels.places, size)
        return replace(placed, specks=labels.specks, smallest=labels.smallest)
    if ending == ".json" and is_coco(content := load_json(path)):
        return _placed(path, *read_coco(path, content, smooth, chosen, layer))
    if ending == ".json" and is_annotated(content):
        return _placed(path, *read_annotations(path, content, smooth, chosen, layer))
    if ending == ".json" and is_plain(content):
        return _scaled(Drawing(path, read_plain_json(path, content, chosen)), unit)
    as_text = wkt_table(path, layer) if ending in _TABLES else None
    if ending in _TABLES and as_text is None:
        outlines, names = read_table(path, chosen, unit, layer)
        return Drawing(path, outlines, names=names)
    if as_text is not None or ending in _VECTORS:
        features, names = (
            read_vector(path, layer, chosen, unit is not None)
            if as_text is None
            else read_wkt_table(path, as_text, chosen, unit is not None)
        )
        sound = tuple(feature for feature in features if isinstance(feature, Outline))
        wrong = tuple(feature for feature in features if isinstance(feature, WrongOutline))
        return _scaled(Drawing(path, sound, wrong=wrong, names=names), unit)
    if ending in (".jpg", ".jpeg"):
        what, remedy = "JPEG smears the edges of stones", "export the picture of stones as PNG or TIFF"
        raise UsageError(what, where=str(path), remedy=remedy)
    known = ", ".join((*_VECTORS, ".dxf", *_TABLES, *PICTURES))
    raise UsageError(
        f"unknown ending {ending!r}",
        where=str(path),
        remedy=f"outlines are read from {known} and the .json of COCO, labelme and VIA",
    )


def _scaled(drawing: Drawing, unit: float | None) -> Drawing:
    """Return outlines in metres."""
    if unit is None or unit == 1.0:
        return drawing
    return replace(
        drawing,
        outlines=tuple(replace(outline, corners=unit * outline.corners) for outline in drawing.outlines),
    )


def _check_numbers(drawing: Drawing, chosen: Mapping[str, str], kinds: Mapping[str, str]) -> None:
    """Refuse outlines that are numbered anew in each course, with all that the file leaves to be asked."""
    both = joined_names(drawing.outlines, drawing.names, chosen)
    if both is None:
        return
    others = "".join(f",{meaning}={name}" for meaning, name in chosen.items() if meaning != "code")
    words = dict.fromkeys(outline.said.kind for outline in drawing.outlines if outline.said.kind is not None)
    unknown = ",".join(f"{word}=ashlar" for word in words if KIND.fullmatch(kind_of(word, kinds)) is None)
    raise SurveyError(
        NUMBERED_ANEW,
        where=str(drawing.path),
        remedy=f'name stones by both: --fields "code={both}{others}"'
        + (f', and say what kinds stand for: --kinds "{unknown}"' if unknown else ""),
    )


def _of_kind(outline: Outline, kinds: Mapping[str, str]) -> Outline:
    """Return an outline whose kind is that of the word or abbreviation in the file."""
    if (text := outline.said.kind) is None:
        return outline
    kind = kind_of(text, kinds)
    if KIND.fullmatch(kind) is None:
        remedy = (
            f'say what it stands for, e.g. --kinds "{text[:40]}=ashlar", see moma schema; or name another attribute '
            "with --fields"
        )
        raise SurveyError(f"kind is {text!r}", where=outline.where, remedy=remedy)
    return replace(outline, said=replace(outline.said, kind=kind))


def _placed(
    path: Path,
    outlines: tuple[Outline, ...],
    places: PixelPlace | None,
    size: tuple[int, int] | None,
) -> Drawing:
    """Move outlines from pixels to metres, if it is known where the picture lies."""
    if places is None:
        return Drawing(path, outlines, True, None, size)
    moved = tuple(replace(outline, corners=places.place(outline.corners)) for outline in outlines)
    return Drawing(path, moved, False, places.pixel, size)


def _sparse(outline: Outline, tolerance: float) -> Outline:
    """Describe an outline of many corners by few."""
    corners = outline.corners
    if len(corners) <= DENSE or corners.shape[1] != 2:
        return outline
    return replace(outline, corners=few_corners(_dense(corners, tolerance), tolerance))


def _dense(corners: Array, step: float) -> Array:
    """Put further points on long sides, so that each side weighs by its length."""
    out = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, min(50, int(np.ceil(float(np.linalg.norm(b - a)) / step))))
        out.append(a + np.linspace(0.0, 1.0, count, endpoint=False)[:, None] * (b - a))
    return np.concatenate(out)


def _check(outline: Outline) -> None:
    corners = outline.corners
    if len(corners) < 3:
        raise SurveyError(f"{len(corners)} corners", where=outline.where, remedy="an outline has 3 or more")
    if not np.isfinite(corners).all() or np.abs(corners).max() > FARTHEST:
        raise SurveyError(
            "a coordinate is not finite, or too large", where=outline.where, remedy="draw it again"
        )
