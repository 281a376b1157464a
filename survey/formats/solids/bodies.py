"""Closed stones with planar faces, from the polygons of a file of solids.

Nothing is repaired: corners are the same only where their coordinates are. Three things are inferred from neighbouring
polygons: which of them make one body, which side of each is outside, and how a polygon that is not plane is folded.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from moma.errors import GeometryError, SurveyError
from survey.arrays import Array
from survey.formats.fields import FARTHEST
from survey.formats.solids.body_groups import body_groups, signed_volume
from survey.formats.solids.flat_faces import merge_flat, rounding
from survey.formats.solids.scanned_stone import is_scanned, plane_faces
from survey.geometry.folds import fold, warp
from survey.geometry.solids import Solid
from survey.geometry.watertight import check_watertight

__all__ = ["ClosedBody", "RawBody", "check_coordinates", "closed_bodies", "compact"]

Polygon = tuple[int, ...]

_COARSEST = 1e-3  # a third of the precision of a measured point [m]


@dataclass(frozen=True)
class RawBody:
    """The polygons of a file under one name.

    Attributes
    ----------
    name : as the file has it
    vertices : (nv, 3) [m]
    polygons : vertex indices of each
    line : of the file, on which it begins; 0 in a binary file
    end : the line after it
    resolution : rounding of the file's numbers [m]
    error : the first error in its lines; None if there is none
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
    """A closed stone, and the changes made to its faces.

    Attributes
    ----------
    solid : under the name of all bodies of the file's object
    folded : number of polygons that are not plane and were cut along folds
    doubled : number of duplicate faces of the file's object
    scanned : of a scan, how its plane faces were recognised, or why not, in words; otherwise empty
    """

    solid: Solid
    folded: int = 0
    doubled: int = 0
    scanned: str = ""


def closed_bodies(
    raw: RawBody, flat: float = 0.0, planes: float = 0.0
) -> Iterator[ClosedBody | GeometryError]:
    """Make the closed bodies of one name, each with its planar faces counter-clockwise seen from outside.

    Parameters
    ----------
    raw : with finite vertices and valid indices
    flat : distance of corners from their mean plane within which a polygon counts as plane [m]; rounding to a few
        digits is always allowed for
    planes : distance of the facets of a scan from a plane within which they are one face [m]; 0: every facet is kept

    Returns
    -------
    For each body the solid, or the error
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
            found = None
            if planes > 0.0 and is_scanned(vertices, outward):
                check_watertight(_solid(raw.name, vertices, outward))
                found = plane_faces(raw.name, vertices, outward, planes)
            if found is not None and found.solid is not None:
                yield ClosedBody(found.solid, doubled=doubled, scanned=found.text)
            else:
                body = _closed(raw, vertices, outward, flat)
                yield replace(body, doubled=doubled, scanned="" if found is None else found.text)
        except GeometryError as error:
            yield error


def _welded(raw: RawBody) -> tuple[Array, list[Polygon]]:
    """Merge corners with the same coordinates and duplicate faces."""
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
                "a face has fewer than three corners, or one of them twice",
                remedy="export it without such faces",
            )
        start = renumbered.index(min(renumbered))
        polygons[renumbered[start:] + renumbered[:start]] = None
    return vertices, list(polygons)


def _closed(raw: RawBody, vertices: Array, polygons: list[Polygon], flat: float) -> ClosedBody:
    """Make the solid with the largest possible plane faces, and check that it is closed."""
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
    merged = _solid(raw.name, vertices, merge_flat(vertices, pieces, used, flat + raw.resolution))
    with np.errstate(all="ignore"):  # a body without volume is an error below, not a warning
        try:
            check_watertight(merged)
        except GeometryError:  # perhaps an outline that cannot be cut into ears: try the original polygons
            merged = _solid(raw.name, vertices, pieces)
            check_watertight(merged)
    return ClosedBody(merged, folded)


def _solid(name: str, vertices: Array, polygons: Sequence[Polygon]) -> Solid:
    used, renumbered = compact(polygons)
    return Solid(name, vertices[used], tuple(renumbered))


def compact(polygons: Sequence[Polygon]) -> tuple[list[int], list[Polygon]]:
    """Return the vertices that polygons use, in order, and the polygons renumbered to these."""
    used = sorted({i for polygon in polygons for i in polygon})
    new = {old: k for k, old in enumerate(used)}
    return used, [tuple(new[i] for i in polygon) for polygon in polygons]


def check_coordinates(points: Array, what: str, where: str) -> None:
    """Check that points (n, 3) are finite and within reach of a site [m].

    Raises
    ------
    SurveyError
        if they are not
    """
    if not (np.abs(points) <= FARTHEST).all():
        raise SurveyError(
            f"a {what} is not finite, or beyond {FARTHEST:g} m",
            where=where,
            remedy="coordinates are in metres",
        )
