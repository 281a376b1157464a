"""From the polygons of a file of solids to closed stones with planar faces.

Nothing is repaired: corners are the same only where their coordinates are. What is decided is what the polygons leave
open and their neighbours settle: which of them make one body, which side of each is outside, and how a polygon that is
not plane is folded.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from moma.errors import GeometryError, SurveyError
from survey.arrays import Array
from survey.formats.solids.body_groups import body_groups, signed_volume
from survey.formats.solids.flat_faces import merge_flat, rounding
from survey.geometry.folds import fold, warp
from survey.geometry.solids import Solid
from survey.geometry.watertight import check_watertight

__all__ = ["ClosedBody", "RawBody", "closed_bodies"]

Polygon = tuple[int, ...]

_COARSEST = 1e-3  # metres: a third of what a point is measured to


@dataclass(frozen=True)
class RawBody:
    """What a file gives under one name.

    Attributes
    ----------
    name : as the file has it
    vertices : (nv, 3) [m]
    polygons : vertex indices of each
    line : of the file, on which it begins; 0 in a binary file
    end : the line behind it
    resolution : of the file's numbers: distances that it cannot tell from nothing [m]
    error : why it cannot be read; None if it can
    """

    name: str
    vertices: Array
    polygons: Sequence[Polygon]
    line: int = 0
    end: int = 0
    resolution: float = 0.0
    error: SurveyError | None = None


@dataclass(frozen=True)
class ClosedBody:
    """A closed stone, and what was settled of its faces.

    Attributes
    ----------
    solid : under the name of all bodies of the file's object
    folded : how many polygons that are not plane were cut along folds
    doubled : how many faces of the file's object were there twice
    """

    solid: Solid
    folded: int = 0
    doubled: int = 0


def closed_bodies(raw: RawBody, flat: float = 0.0) -> Iterator[ClosedBody | GeometryError]:
    """Make the closed bodies of one name, each with its planar faces counter-clockwise seen from outside.

    Parameters
    ----------
    raw : its vertices finite, its indices valid
    flat : a polygon whose corners lie no farther from its mean plane is taken for plane [m]; at least what rounding to
        a few digits does to one

    Returns
    -------
    For each body the solid, or why it is not one
    """
    try:
        vertices, polygons = _welded(raw)
        doubled = len(raw.polygons) - len(polygons)
        groups = body_groups(vertices, polygons)
        volumes = [signed_volume(vertices, group) for group in groups]
        if groups and min(volumes) < 0.0 < max(volumes) and set().union(*groups) <= set(polygons):
            raise GeometryError(
                "some of its bodies are inside out",
                remedy="export without cavities, all faces seen from outside",
            )
    except GeometryError as error:
        yield error
        return
    for group, volume in zip(groups, volumes, strict=True):
        outward = group if volume >= 0.0 else [one[::-1] for one in group]
        try:
            yield replace(_closed(raw, vertices, outward, flat), doubled=doubled)
        except GeometryError as error:
            yield error


def _welded(raw: RawBody) -> tuple[Array, list[Polygon]]:
    """Corners with the same coordinates become one; a face that is there twice counts once."""
    if not raw.polygons:
        raise GeometryError("it has no faces", remedy="export closed surfaces")
    if raw.resolution > _COARSEST:
        raise GeometryError(
            f"its coordinates are rounded to {raw.resolution:.2g} m",
            remedy="export them in double precision, or about an origin near the building",
        )
    _, first, indices = np.unique(raw.vertices + 0.0, axis=0, return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))  # in the order of the file
    vertices, new = raw.vertices[np.sort(first)], rank[indices.reshape(-1)].tolist()
    polygons: dict[Polygon, None] = {}
    for polygon in raw.polygons:
        renumbered = tuple(new[i] for i in polygon)
        if len(set(renumbered)) < max(len(renumbered), 3):
            raise GeometryError(
                "a face has less than three corners, or one of them twice",
                remedy="export it without such faces",
            )
        start = renumbered.index(min(renumbered))
        polygons[renumbered[start:] + renumbered[:start]] = None
    return vertices, list(polygons)


def _closed(raw: RawBody, vertices: Array, polygons: list[Polygon], flat: float) -> ClosedBody:
    """The solid with faces as large as planes allow, if it is closed."""
    pieces: list[Polygon] = []
    folded = 0
    for polygon in polygons:
        corners = vertices[list(polygon)]
        tolerance = flat + rounding(corners, raw.resolution)
        if len(polygon) == 3 or warp(corners) <= tolerance:
            pieces.append(polygon)
        else:
            pieces += fold(vertices, polygon, tolerance)
            folded += 1
    used = np.unique(np.concatenate([np.array(one) for one in pieces]))
    merged = _compact(raw.name, vertices, merge_flat(vertices, pieces, used, flat + raw.resolution))
    with np.errstate(all="ignore"):  # a body without volume is found, and not warned of
        try:
            check_watertight(merged)
        except (
            GeometryError
        ):  # an outline that cannot be cut into ears; the polygons as they came can say more
            merged = _compact(raw.name, vertices, pieces)
            check_watertight(merged)
    return ClosedBody(merged, folded)


def _compact(name: str, vertices: Array, polygons: Sequence[Polygon]) -> Solid:
    """The solid with the corners that it uses."""
    used = sorted({i for polygon in polygons for i in polygon})
    new = {old: k for k, old in enumerate(used)}
    return Solid(name, vertices[used], tuple(tuple(new[i] for i in polygon) for polygon in polygons))
