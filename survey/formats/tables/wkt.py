"""Outlines as well-known text: POLYGON Z, closed LINESTRING Z, and MULTIPOLYGON Z of one polygon."""

import re

import numpy as np

from ground.errors import SurveyError
from ground.tables.numbers import FARTHEST, shown
from survey.arrays import Array

FLAT = (
    "export outlines with z (PolygonZ, 3D); outlines in the plane of a wall are read by --outlines FILE, with --depth "
    "or with --cloud"
)
"""Remedy for outlines in two dimensions."""

_WKT = re.compile(
    r"\s*(?:SRID=\d+;)?\s*(MULTIPOLYGON|POLYGON|LINEARRING|LINESTRING|MULTILINESTRING)\s*(ZM|Z|M)?\s*(\(.*\))\s*",
    re.IGNORECASE | re.DOTALL,
)
_RING = re.compile(r"\(([^()]*)\)")


def is_wkt(text: str) -> bool:
    """Return whether a text is an outline as well-known text."""
    return _WKT.fullmatch(text) is not None


def outline_of(text: str, where: str) -> Array:
    """Read the corners (n, 3) of one outline, without the first one again at the end, in the unit of the file.

    Raises
    ------
    SurveyError
        if it is not one ring in space
    """
    match = _WKT.fullmatch(text)
    if match is None:
        raise SurveyError(
            f"{shown(text)} is not an outline",
            where=where,
            remedy="write e.g. POLYGON Z ((0 0 0, 1 0 0, 1 0 1))",
        )
    if (match[2] or "").upper() == "M":
        raise SurveyError(f"{match[1]} M has measures instead of z", where=where, remedy=FLAT)
    rings = _RING.findall(match[3])
    corners = [[word.split() for word in ring.split(",")] for ring in rings]
    return ring_of(corners, where)


def ring_of(rings: "list[list[list[str]]] | list[list[list[float]]]", where: str) -> Array:
    """Return the corners (n, 3) of the only ring of an outline.

    Raises
    ------
    SurveyError
        if there are several, or it is not one in space
    """
    if len(rings) != 1:
        raise SurveyError(
            f"an outline of {len(rings)} rings",
            where=where,
            remedy="draw one ring around each stone, without holes",
        )
    (ring,) = rings
    sizes = {len(corner) for corner in ring}
    if sizes == {2}:
        raise SurveyError("an outline in two dimensions, without z", where=where, remedy=FLAT)
    if not sizes <= {3, 4}:
        raise SurveyError(
            f"corners of {', '.join(map(str, sorted(sizes)))} numbers",
            where=where,
            remedy="give x, y and z of each",
        )
    try:
        corners = np.array([[float(value) for value in corner[:3]] for corner in ring], dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise SurveyError("a coordinate is not a number", where=where, remedy="give x, y and z") from None
    if not (np.abs(corners) <= FARTHEST).all():
        raise SurveyError(
            f"a corner is not finite, or beyond {FARTHEST:g} m",
            where=where,
            remedy="coordinates are in metres",
        )
    return corners[:-1] if len(corners) > 1 and (corners[0] == corners[-1]).all() else corners
