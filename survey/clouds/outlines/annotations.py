"""Outlines that people draw on a picture with labelme or with the VGG Image Annotator (VIA), in their JSON.

Both count pixels from the upper left corner of the picture, x to the right and y downwards. Labels that differ are the
codes of stones; labels that repeat are classes.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ground.errors import SurveyError, UsageError
from survey.arrays import Array
from survey.clouds.outlines.classes import class_of_stones
from survey.clouds.outlines.outline import Attributes, Outline, attributes_of, made_code
from survey.clouds.outlines.tracing import DENSE, few_corners
from survey.clouds.world import PixelPlace, world_of
from survey.formats.tables.kinds import KINDS, kind_of

_ARC = 32  # corners of a circle or an ellipse, which are then described by fewer
_REMEDY = "draw each stone as a polygon, or export COCO"


@dataclass(frozen=True)
class _Shape:
    ring: Array  # (n, 2) [px] from the corner of the picture
    values: Mapping[str, Any]
    where: str


def is_annotated(content: object) -> bool:
    """Return whether JSON is of labelme or of VIA."""
    return _is_labelme(content) or _via_images(content) is not None


def _is_labelme(content: object) -> bool:
    return isinstance(content, Mapping) and isinstance(content.get("shapes"), list)


def _via_images(content: object) -> list[Mapping[str, Any]] | None:
    """Return the pictures of VIA's annotations, or of its project; None if it is neither."""
    if not isinstance(content, Mapping):
        return None
    images = content.get("_via_img_metadata", content)
    listed = list(images.values()) if isinstance(images, Mapping) else []
    fits = bool(listed) and all(
        isinstance(image, Mapping) and {"filename", "regions"} <= set(image) for image in listed
    )
    return listed if fits else None


def read_annotations(
    path: Path, content: Any, tolerance: float, chosen: Mapping[str, str], label: str | None = None
) -> tuple[tuple[Outline, ...], PixelPlace | None, tuple[int, int] | None]:
    """Read the outlines of one picture.

    Parameters
    ----------
    path : the file
    content : its JSON, for which `is_annotated` holds
    tolerance : largest distance of a curve from the sides of its outline [px]
    chosen : names of attributes that the user has given, by meaning
    label : of the stones, where there are several classes; None: all

    Returns
    -------
    outlines in pixels, the place of the picture's pixels if a world file lies beside the JSON, and its width and
    height if the file or the picture beside it says

    Raises
    ------
    UsageError
        if there are several pictures, or several classes of which none is chosen
    SurveyError
        naming the shape that is wrong
    """
    size: tuple[int, int] | None = None
    if _is_labelme(content):
        name = Path(str(content.get("imagePath") or path.name).replace("\\", "/")).name
        if content.get("imageWidth") and content.get("imageHeight"):
            size = int(content["imageWidth"]), int(content["imageHeight"])
        shapes = list(_of_labelme(path, content["shapes"]))
    else:
        images = [image for image in _via_images(content) or () if image["regions"]]
        if len(images) > 1:
            names = ", ".join(str(image["filename"]) for image in images[:5])
            raise UsageError(
                f"outlines on {len(images)} pictures: {names}",
                where=str(path),
                remedy="give a file for each picture",
            )
        name = Path(str(images[0]["filename"]).replace("\\", "/")).name if images else path.name
        shapes = list(_of_via(path, images[0]["regions"] if images else ()))
    outlines = tuple(_outlines(path, shapes, tolerance, chosen, label))
    places = world_of(path.with_name(name)) or world_of(path)
    return outlines, places, size or _size_of(path.with_name(name))


def _size_of(picture: Path) -> tuple[int, int] | None:
    """Return the width and height of a picture; None if there is none."""
    from PIL import Image

    try:
        with Image.open(picture) as photograph:
            return int(photograph.size[0]), int(photograph.size[1])
    except OSError:
        return None


def _outlines(
    path: Path, shapes: list[_Shape], tolerance: float, chosen: Mapping[str, str], label: str | None
) -> Iterator[Outline]:
    outlines = [(shape, attributes_of(shape.values, chosen, shape.where)) for shape in shapes]
    counts = Counter(said.code for _, said in outlines)
    classes = max(counts.values(), default=0) > 1
    if classes:
        outlines = _of_class(path, outlines, counts, label)
    for number, (one, attributes) in enumerate(outlines, start=1):
        code = f"S{number:03d}" if classes else made_code(attributes.code or "") or f"S{number:03d}"
        if classes:
            kind = attributes.kind or (
                attributes.code if attributes.code and kind_of(attributes.code, {}) in KINDS else None
            )
            notes = dict(attributes.notes) | ({"label": attributes.code} if attributes.code else {})
            attributes = replace(attributes, code=code, kind=kind, notes=notes)
        # both count from the corner of the first pixel, not from its middle
        ring = one.ring - 0.5
        corners = few_corners(ring, tolerance) if len(ring) > DENSE else ring
        yield Outline(number, f"S{int(code):03d}" if code.isdigit() else code, corners, attributes, one.where)


def _of_class(
    path: Path, outlines: list[tuple[_Shape, Attributes]], counts: Counter[str | None], label: str | None
) -> list[tuple[_Shape, Attributes]]:
    """Return the shapes of the class of stones."""
    names = {str(key): count for key, count in counts.items()}
    stones = class_of_stones(path, names, label, "labels")
    return outlines if stones is None else [outline for outline in outlines if str(outline[1].code) == stones]


def _of_labelme(path: Path, shapes: list[Any]) -> Iterator[_Shape]:
    for number, shape in enumerate(shapes, start=1):
        where = f"{path}, shape {number}"
        try:
            kind, points = (
                str(shape.get("shape_type", "polygon")),
                np.array(shape["points"], dtype=np.float64),
            )
            label = str(shape.get("label") or "")
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise SurveyError("a shape without points", where=where, remedy=_REMEDY) from error
        flags = {name: str(value) for name, value in (shape.get("flags") or {}).items()}
        values = flags | ({"label": label} if label else {})
        if kind == "rectangle" and points.shape == (2, 2):
            yield _Shape(_box(*points[0], *points[1]), values, where)
        elif kind == "circle" and points.shape == (2, 2):
            radius = float(np.linalg.norm(points[1] - points[0]))
            yield _Shape(_ellipse(float(points[0, 0]), float(points[0, 1]), radius, radius), values, where)
        elif kind == "polygon" and points.ndim == 2 and points.shape[1:] == (2,) and len(points) >= 3:
            yield _Shape(points, values, where)
        else:
            raise SurveyError(f"a shape of type {kind!r} is no outline", where=where, remedy=_REMEDY)


def _of_via(path: Path, regions: Any) -> Iterator[_Shape]:
    listed = list(regions.values()) if isinstance(regions, Mapping) else list(regions)
    for number, region in enumerate(listed, start=1):
        where = f"{path}, region {number}"
        try:
            shape, said = region["shape_attributes"], region.get("region_attributes") or {}
            yield _Shape(
                _via_ring(shape), {k: v for k, v in said.items() if isinstance(v, str | int | float)}, where
            )
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise SurveyError("a region that is no outline", where=where, remedy=_REMEDY) from error


def _via_ring(shape: Mapping[str, Any]) -> Array:
    kind = shape["name"]
    if kind == "rect":
        x, y = float(shape["x"]), float(shape["y"])
        return _box(x, y, x + float(shape["width"]), y + float(shape["height"]))
    if kind in ("circle", "ellipse"):
        across, up = (shape["r"],) * 2 if kind == "circle" else (shape["rx"], shape["ry"])
        return _ellipse(float(shape["cx"]), float(shape["cy"]), float(across), float(up))
    if kind not in ("polygon", "polyline"):
        raise ValueError(kind)
    ring = np.column_stack([shape["all_points_x"], shape["all_points_y"]]).astype(np.float64)
    if len(ring) > 1 and np.array_equal(ring[0], ring[-1]):
        ring = ring[:-1]
    elif kind == "polyline":
        raise ValueError("open")
    if len(ring) < 3:
        raise ValueError(len(ring))
    return ring


def _box(left: float, top: float, right: float, bottom: float) -> Array:
    return np.array([(left, top), (right, top), (right, bottom), (left, bottom)])


def _ellipse(x: float, y: float, across: float, up: float) -> Array:
    turn = np.linspace(0.0, 2.0 * np.pi, _ARC, endpoint=False)
    return np.column_stack([x + across * np.cos(turn), y + up * np.sin(turn)])
