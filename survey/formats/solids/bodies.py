"""Closed stones with planar faces, from the polygons of a file of solids.

Faces without area are dropped; a surface that is not closed is repaired within a tolerance (`survey.geometry.repair`),
and what was done is remarked; closed ones stay as they are. Three things are inferred from neighbouring polygons: which
of them make one body, which side of each is outside, and how a polygon that is not plane is folded.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ground.errors import GeometryError, SurveyError
from ground.tables.numbers import FARTHEST
from survey.arrays import Array
from survey.conventions import JOINT, LEAST
from survey.formats.solids.body_groups import body_groups, signed_volume
from survey.formats.solids.flat_faces import merge_flat, rounding
from survey.formats.solids.scanned_stone import is_scanned, plane_faces
from survey.geometry.folds import fold, warp
from survey.geometry.repair.polygons import is_flat_line, simple_polygons, without_repeats
from survey.geometry.repair.repair import Repaired, holes_of, open_edges, repair
from survey.geometry.solids import Solid
from survey.geometry.watertight import check_watertight

Polygon = tuple[int, ...]

_COARSEST = LEAST  # a third of the precision of a measured point [m]
_TOLERANCE = 1e-5  # of repairs, over the size of the body
_MORE = (10.0, 100.0, 1000.0)  # times the tolerance, with which a repair is tried to advise on it
_MAX_ADVISED_TOLERANCE = JOINT  # largest tolerance that is advised [m]


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
    kind : of the stone, where the file states it; None: it does not
    """

    name: str
    vertices: Array
    polygons: Sequence[Polygon]
    line: int = 0
    end: int = 0
    resolution: float = 0.0
    error: SurveyError | None = None
    kind: str | None = None


@dataclass(frozen=True)
class ClosedBody:
    """A closed stone, and the changes made to its faces.

    Attributes
    ----------
    solid : under the name of all bodies of the file's object
    folded : number of polygons that are not plane and were cut along folds
    doubled : number of duplicate faces of the file's object
    repairs : of the file's object, what was done, in words
    scanned : of a scan, how its plane faces were recognised, or why not, in words; otherwise empty
    """

    solid: Solid
    folded: int = 0
    doubled: int = 0
    repairs: tuple[str, ...] = ()
    scanned: str = ""


def closed_bodies(
    raw: RawBody, flat: float = 0.0, planes: float = 0.0, tolerance: float | None = None
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
        vertices, polygons, doubled, dropped = _welded(raw)
        repairs = (f"{dropped} faces without area dropped",) if dropped else ()
        if open_edges(polygons):
            if tolerance is None:
                tolerance = _TOLERANCE * float(np.linalg.norm(np.ptp(vertices, axis=0)))
            repaired = _repaired(vertices, polygons, max(tolerance, raw.resolution if tolerance else 0.0))
            polygons, repairs = repaired.polygons, (*repairs, *repaired.deeds)
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
            flattened = None
            if planes > 0.0 and is_scanned(vertices, outward):
                check_watertight(_solid(raw.name, vertices, outward))
                flattened = plane_faces(raw.name, vertices, outward, planes)
            if flattened is not None and flattened.solid is not None:
                yield ClosedBody(flattened.solid, doubled=doubled, repairs=repairs, scanned=flattened.text)
            else:
                body = _closed(raw, vertices, outward, flat)
                text = "" if flattened is None else flattened.text
                yield replace(body, doubled=doubled, repairs=repairs, scanned=text)
        except GeometryError as error:
            yield error


def _repaired(vertices: Array, polygons: list[Polygon], tolerance: float) -> Repaired:
    """Close a surface within the tolerance.

    Raises
    ------
    GeometryError
        if it cannot be closed, with the largest hole, and the tolerance that would do
    """
    edges = len(open_edges(polygons))
    found = repair(vertices, polygons, tolerance) if tolerance > 0.0 else None
    if found is not None and not found.left:
        return found
    least = max(tolerance, _TOLERANCE * float(np.linalg.norm(np.ptp(vertices, axis=0))))
    for wider in (least, *(least * more for more in _MORE)):
        if (
            wider <= max(_MAX_ADVISED_TOLERANCE, tolerance)
            and (wider > tolerance)
            and not repair(vertices, polygons, wider).left
        ):
            remedy = f"close it, or give --repair {wider:.1g}, which would"
            break
    else:
        remedy = "close it there"
    hole = (found.left if found is not None else holes_of(vertices, polygons))[0]
    raise GeometryError(f"the solid is not closed: {edges} edges have one face; {hole.text}", remedy=remedy)


def _welded(raw: RawBody) -> tuple[Array, list[Polygon], int, int]:
    """Merge corners with the same coordinates; drop duplicate faces and faces without area, and count them."""
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
    doubled, dropped = 0, 0
    for polygon in raw.polygons:
        ring = tuple(new[i] for i in polygon)
        parts = [ring]
        if len(set(ring)) < len(ring) or len(ring) < 3:
            ring = without_repeats(ring)
            parts = simple_polygons(vertices, ring) if len(ring) > 2 else []
        if not parts or (len(parts) == 1 and is_flat_line(vertices, parts[0])):
            dropped += 1
            continue
        for one in parts:
            start = one.index(min(one))
            turned = one[start:] + one[:start]
            doubled += turned in polygons
            polygons[turned] = None
    if not polygons:
        raise GeometryError("none of its faces has an area", remedy="export closed surfaces")
    return vertices, list(polygons), doubled, dropped


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
    used = np.unique(np.concatenate([np.array(piece) for piece in pieces]))
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
