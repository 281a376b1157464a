"""Plotting on one photograph (Drap, Grussenmeyer, Curtinot, Seinturier & Gaillard, CIPA 2001): a ray meets a surface.

The point X lies on the ray of its mark and on the surface. With the rows A and B of the collinearity equations by the
orientation and by the point, and the normal n of the surface, small errors of the mark m, the orientation c and
the surface's height h give

    [B; nᵀ] dX = [dm - A dc; dh],   dh = Σ gᵢ nᵢ·dPᵢ + ds,

with the points Pᵢ that define the surface and the scatter s of faces about it: what the assumption costs along the ray.
"""

import math

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import PARALLEL
from survey.orientation.oriented import Oriented
from survey.orientation.projection import directions
from survey.orientation.stones.intersection import sight
from survey.orientation.stones.located import Located, Mark, line_up
from survey.orientation.stones.surfaces import Surface

_GRAZING = math.degrees(PARALLEL)  # flattest useful line of sight [°]


def plot(oriented: Oriented, name: str, mark: Mark, surface: Surface) -> Located:
    """Plot a point on a surface.

    Parameters
    ----------
    name : of the point

    Raises
    ------
    GeometryError
        if the ray misses the surface, or meets it at less than 10°
    """
    station = oriented.station(mark.photo)
    direction = oriented.rotation(mark.photo) @ directions(oriented.camera(mark.photo), mark.image[None])[0]
    direction = direction / np.linalg.norm(direction)
    photo = oriented.photos[mark.photo].name
    place = surface.meet(station, direction)
    if place is None:
        raise GeometryError(
            f"the ray of point {name} from {photo} misses {surface.text}", remedy="check the mark"
        )
    normal = surface.normal(place)
    angle = float(np.degrees(np.arcsin(min(1.0, abs(float(normal @ direction))))))
    if angle < _GRAZING:
        raise GeometryError(
            f"{photo} sees {surface.text} at {angle:.0f}° where point {name} is marked",
            remedy="mark the point on a photograph from in front, or on two",
        )
    _, by_camera, by_point = line_up(oriented, mark, place)
    inverse = np.linalg.inv(np.vstack([by_point, normal]))
    pull = surface.pull(place)
    by_orientation = -inverse[:, :2] @ by_camera
    sources: dict[str, Array] = {f"mark {mark.photo} {mark.image[0]!r} {mark.image[1]!r}": inverse[:, :2]}
    for point, gain in zip(surface.points, pull, strict=True):
        by_orientation = by_orientation + np.outer(inverse[:, 2], gain @ point.by_orientation)
        for source, slopes in point.by_source.items():
            more = np.outer(inverse[:, 2], gain @ slopes)
            sources[source] = sources[source] + more if source in sources else more
    if surface.scatter > 0.0:
        sources[f"scatter {name} {mark.photo}"] = surface.scatter * inverse[:, 2:]
    seen = sight(oriented, mark, np.zeros(2), np.zeros(2), place)
    return Located(name, place, by_orientation, sources, (seen,), f"on {surface.text}")
