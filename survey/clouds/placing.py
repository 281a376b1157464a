"""Outlines in space: the plane of each, and the line of sight along which points are looked for."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ground.errors import SurveyError, UsageError
from survey.arrays import Array
from survey.clouds.outlines.outline import Outline
from survey.clouds.wall import Wall
from survey.conventions import STEEPEST, TOUCHING
from survey.geometry.polygons import ring_area
from survey.geometry.solids import area_vector
from survey.records.survey import Station

_UPRIGHT = math.cos(STEEPEST)  # upward component of its normal below which a wall is upright


@dataclass(frozen=True)
class PlacedOutline:
    """An outline in its own plane.

    Attributes
    ----------
    outline : as drawn
    origin : (3,) a place in the middle of it [m]
    axes : (3, 3) rows: two in its plane, the third along the line of sight, towards the viewer where one is known
    ring : (n, 2) corners along the first two axes [m]
    heights : (n,) corners along the third [m]
    area : inside the ring [m²]
    """

    outline: Outline
    origin: Array
    axes: Array
    ring: Array
    heights: Array
    area: float

    @property
    def corners(self) -> Array:
        """Corners in space, (n, 3) [m]."""
        out: Array = self.origin + self.ring @ self.axes[:2] + np.outer(self.heights, self.axes[2])
        return out


def place_outlines(
    outlines: Sequence[Outline], wall: Wall | None, stations: Sequence[Station]
) -> tuple[PlacedOutline, ...]:
    """Place outlines in space.

    Parameters
    ----------
    outlines : in the plane of a wall (n, 2), or in space (n, 3)
    wall : its frame
    stations : from which stones were seen; an outline in space faces the station that is nearest in front of or behind
        it. Without any, its corners run counter-clockwise seen from outside

    Raises
    ------
    UsageError
        if an outline lies in a plane and no wall is given
    SurveyError
        if an outline has no area
    """
    if wall is not None and abs(float(wall.axes[2, 2])) < _UPRIGHT:
        outlines = levelled(outlines)
    flat = next((outline for outline in outlines if outline.corners.shape[1] == 2), None)
    if flat is not None and wall is None:
        remedy = 'give the frame of the wall: --wall FILE.toml, or two points on its foot: --wall "X,Y X,Y"'
        raise UsageError("the outlines lie in a plane, without heights", where=flat.where, remedy=remedy)
    return tuple(
        _on_wall(outline, wall)
        if wall is not None and outline.corners.shape[1] == 2
        else _in_space(outline, stations)
        for outline in outlines
    )


def levelled(outlines: Sequence[Outline]) -> tuple[Outline, ...]:
    """Return outlines of which those at one elevation, as 2D polylines have it, lie in the plane of the drawing."""
    return tuple(
        replace(outline, corners=outline.corners[:, :2])
        if outline.corners.shape[1] == 3 and np.ptp(outline.corners[:, 2]) <= TOUCHING
        else outline
        for outline in outlines
    )


def facing_station(origin: Array, stations: Sequence[Station]) -> Station | None:
    """Return the station nearest to a place; None if there is none."""
    return min(stations, key=lambda station: float(np.linalg.norm(station.position - origin)), default=None)


def _on_wall(outline: Outline, wall: Wall) -> PlacedOutline:
    middle = 0.5 * (outline.corners.min(axis=0) + outline.corners.max(axis=0))
    ring = outline.corners - middle
    area = abs(ring_area(ring))
    _check_area(area, outline)
    origin = wall.origin + middle @ wall.axes[:2]
    return PlacedOutline(outline, origin, wall.axes, ring, np.zeros(len(ring)), area)


def _in_space(outline: Outline, stations: Sequence[Station]) -> PlacedOutline:
    corners = outline.corners
    origin = corners.mean(axis=0)
    normal = area_vector(corners - origin)
    area = float(np.linalg.norm(normal))
    _check_area(area, outline)
    normal = normal / area
    if (station := facing_station(origin, stations)) is not None and normal @ (
        station.position - origin
    ) < 0.0:
        normal = -normal
    upright = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.9 else np.array([0.0, 1.0, 0.0])
    along = np.cross(upright, normal)
    along /= np.linalg.norm(along)
    axes = np.array([along, np.cross(normal, along), normal])
    local = (corners - origin) @ axes.T
    ring = np.ascontiguousarray(local[:, :2])
    return PlacedOutline(outline, origin, axes, ring, local[:, 2], abs(ring_area(ring)))


def _check_area(area: float, outline: Outline) -> None:
    if not area > 1e-6:
        raise SurveyError("the outline has no area", where=outline.where, remedy="draw it again")
