"""Masks of segmentation programs in COCO's JSON: polygons, and run lengths plain or compressed, each with its score."""

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ground.errors import SurveyError, UsageError
from survey.clouds.outlines.classes import class_of_stones
from survey.clouds.outlines.labels import outline_of_mask
from survey.clouds.outlines.outline import Attributes, Outline, attributes_of, made_code
from survey.clouds.outlines.tracing import few_corners
from survey.clouds.world import PixelPlace, world_of
from survey.formats.tables.kinds import KINDS, kind_of
from survey.geometry.polygons import ring_area

_REMEDY = "give annotations with a segmentation, as COCO describes them"


def is_coco(content: object) -> bool:
    """Return whether JSON is annotations or results of COCO, and not e.g. GeoJSON."""
    if isinstance(content, list):
        return bool(content) and isinstance(content[0], dict) and "segmentation" in content[0]
    return isinstance(content, dict) and "annotations" in content


def read_coco(
    path: Path, content: Any, tolerance: float, chosen: Mapping[str, str], category: str | None = None
) -> tuple[tuple[Outline, ...], PixelPlace | None, tuple[int, int] | None]:
    """Read the masks of one picture.

    Parameters
    ----------
    path : the file
    content : its JSON: a dataset, or a list of results
    tolerance : largest distance of the boundary of a mask from the sides of its outline [px]
    chosen : names of attributes that the user has given, by meaning
    category : of the stones, where there are several; None: all

    Returns
    -------
    outlines in pixels, the place of the picture's pixels if a world file lies beside the JSON, and its width and
    height if the file says

    Raises
    ------
    UsageError
        if there are masks of several pictures, or several categories of which none is chosen
    SurveyError
        if an annotation cannot be read
    """
    annotations = content if isinstance(content, list) else content["annotations"]
    head = {} if isinstance(content, list) else content
    images = {image.get("id"): image for image in head.get("images", [])}
    shown = {annotation.get("image_id") for annotation in annotations}
    if len(shown) > 1:
        names = ", ".join(
            str(images.get(image, {}).get("file_name", image)) for image in sorted(shown, key=str)[:5]
        )
        raise UsageError(
            f"masks of {len(shown)} pictures: {names}", where=str(path), remedy="give a file for each picture"
        )
    image = images.get(next(iter(shown), None), {})
    size = (
        (int(image["width"]), int(image["height"]))
        if {"width", "height"} <= set(image)
        else _size(annotations)
    )
    kinds = {category.get("id"): str(category.get("name")) for category in head.get("categories", [])}
    classes = [_category(annotation, kinds) for annotation in annotations]
    stones = class_of_stones(path, Counter(name for name in classes if name), category, "categories")
    annotations = [one for one, name in zip(annotations, classes, strict=True) if stones in (None, name)]
    outlines = tuple(_outlines(path, annotations, kinds, tolerance, chosen))
    name = Path(str(image.get("file_name", path.name))).name
    places = world_of(path.with_name(name)) or world_of(path)
    return outlines, places, size


def _size(annotations: list[Any]) -> tuple[int, int] | None:
    """Return the columns and rows of the picture that run lengths state; None if none do, or they differ."""
    masks = (annotation.get("segmentation") for annotation in annotations)
    sizes = {
        tuple(mask["size"]) for mask in masks if isinstance(mask, dict) and len(mask.get("size", ())) == 2
    }
    if len(sizes) != 1:
        return None
    rows, columns = sizes.pop()
    return int(columns), int(rows)


def _category(annotation: Mapping[str, Any], names: Mapping[Any, str]) -> str:
    """Return the name of the category of an annotation, else its number; nothing if it has none."""
    number = annotation.get("category_id")
    return "" if number is None else names.get(number, str(number))


def _outlines(
    path: Path,
    annotations: list[Any],
    kinds: Mapping[Any, str],
    tolerance: float,
    chosen: Mapping[str, str],
) -> Iterator[Outline]:
    for number, annotation in enumerate(annotations, start=1):
        where = f"{path}, annotation {annotation.get('id', number)}"
        values = {
            name: value
            for name, value in (annotation | annotation.get("attributes", {})).items()
            if isinstance(value, str | int | float)
            and name not in ("area", "iscrowd", "image_id", "category_id")
        }
        if annotation.get("category_id") in kinds:
            values["category"] = kinds[annotation["category_id"]]
        attributes = attributes_of(values, chosen, where)
        if attributes.kind is None and kind_of(name := _category(annotation, kinds), {}) in KINDS:
            attributes = replace(attributes, kind=name)
        code = made_code(attributes.code or "") or f"S{number:03d}"
        if code.isdigit():
            code = f"S{int(code):03d}"
        segmentation = annotation.get("segmentation")
        if isinstance(segmentation, dict):
            mask, column = mask_columns(segmentation, where)
            outline = outline_of_mask(number, mask, (column, 0), tolerance, where, attributes)
            if outline is None:
                raise SurveyError("the mask is empty", where=where, remedy="leave it out")
            yield Outline(number, code, outline.corners, attributes, where, outline.doubts)
        elif isinstance(segmentation, list) and segmentation:
            yield _polygon(number, code, segmentation, attributes, tolerance, where)
        else:
            raise SurveyError("has no segmentation", where=where, remedy=_REMEDY)


def _polygon(
    number: int, code: str, parts: list[Any], attributes: Attributes, tolerance: float, where: str
) -> Outline:
    try:
        # COCO counts from the corner of the first pixel, not from its middle
        rings = [np.array(part, dtype=np.float64).reshape(-1, 2) - 0.5 for part in parts]
    except (TypeError, ValueError) as error:
        raise SurveyError("a polygon cannot be read", where=where, remedy=_REMEDY) from error
    rings = [ring for ring in rings if len(ring) >= 3]
    if not rings:
        raise SurveyError("a polygon of fewer than three corners", where=where, remedy="leave it out")
    areas = [abs(ring_area(ring)) for ring in rings]
    best = int(np.argmax(areas))
    doubts = []
    if areas[best] < 0.95 * sum(areas):
        share = areas[best] / sum(areas)
        doubts.append(
            ("in pieces", f"{len(rings)} pieces; the largest, with {share:.0%} of the area, is taken")
        )
    ring = rings[best]
    dense = len(ring) > 12
    return Outline(
        number, code, few_corners(ring, tolerance) if dense else ring, attributes, where, tuple(doubts)
    )


def mask_columns(coded: Mapping[str, Any], where: str) -> tuple[NDArray[np.bool_], int]:
    """Decode a mask of run lengths, plain or compressed: its columns with pixels, and the number of the first.

    A picture has thousands of others.

    Parameters
    ----------
    coded : {"size": [height, width], "counts": numbers or a string}
    where : for messages

    Raises
    ------
    SurveyError
        if the runs do not fill the picture

    Examples
    --------
    >>> columns, first = mask_columns({"size": [2, 3], "counts": [1, 2, 3]}, "")
    >>> columns.astype(int).tolist(), first
    ([[0, 1], [1, 0]], 0)
    """
    try:
        height, width = (int(one) for one in coded["size"])
        counts = coded["counts"]
        runs = _uncompressed(counts) if isinstance(counts, str) else [int(count) for count in counts]
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise SurveyError("run lengths that cannot be read", where=where, remedy=_REMEDY) from error
    if sum(runs) != height * width or min(runs, default=0) < 0:
        what = f"run lengths of {sum(runs)} pixels for a picture of {width} × {height}"
        raise SurveyError(what, where=where, remedy=_REMEDY)
    ends = np.cumsum(runs, dtype=np.int64)
    inside = np.flatnonzero((np.arange(len(runs)) % 2 == 1) & (np.array(runs) > 0))
    if not len(inside):
        return np.zeros((height, 0), dtype=np.bool_), 0
    first, last = int((ends[inside[0]] - runs[inside[0]]) // height), int((ends[inside[-1]] - 1) // height)
    columns = np.zeros((last + 1 - first) * height, dtype=np.bool_)
    for k in inside:
        columns[ends[k] - runs[k] - first * height : ends[k] - first * height] = True
    return columns.reshape(-1, height).T, first


def _uncompressed(text: str) -> list[int]:
    """Decode COCO's string of numbers in base 32, least digit first; later ones are differences to the last but one."""
    runs: list[int] = []
    place = 0
    while place < len(text):
        value, shift, more = 0, 0, True
        while more:
            digit = ord(text[place]) - 48
            value |= (digit & 0x1F) << shift
            more = bool(digit & 0x20)
            place, shift = place + 1, shift + 5
            if not more and digit & 0x10:
                value |= -1 << shift
        runs.append(value + runs[-2] if len(runs) > 2 else value)
    return runs


def load_json(path: Path) -> Any:
    """Read a JSON file.

    Raises
    ------
    SurveyError
        if it is damaged
    """
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise SurveyError(
            f"cannot be read as JSON: {error}", where=str(path), remedy="export it again"
        ) from error
