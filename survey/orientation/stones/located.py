"""Points located by marks, and the errors that they share.

A point is a function of its marks, of the orientation of the photographs, and where it was plotted of the points
that define
the surface. To first order its error is a sum over these sources, so that the joint covariance of any points
follows exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.orientation._kernels.camera import PARAMETERS, ray
from survey.orientation.oriented import Oriented


@dataclass(frozen=True)
class Mark:
    """A point marked on an oriented photograph.

    Attributes
    ----------
    photo : index of the photograph
    image : (2,) to the right and down [px]
    sigma : standard deviation of either coordinate [px]
    line : line of the file
    """

    photo: int
    image: Array
    sigma: float
    line: int = 0


@dataclass(frozen=True)
class Sight:
    """One mark behind a point: the evidence.

    Attributes
    ----------
    photo : name of the photograph
    image, residual : (2,) mark, and measured minus computed [px]
    test : residual over its standard deviation, the larger of both coordinates; 0 where nothing checks it
    distance : from the station to the point [m]
    """

    photo: str
    image: Array
    residual: Array
    test: float
    distance: float


@dataclass(frozen=True)
class Located:
    """A point with its errors by their sources.

    Attributes
    ----------
    name : of the point
    place : (3,) [m]
    by_orientation : (3, nr) derivative by the columns of the photographs' covariance
    by_source : derivatives (3, k) by errors of variance 1, of marks and of surfaces, by the name of the source
    sights : its marks
    text : how it was located
    left_out : a mark that the others contradict, in words; empty: none
    """

    name: str
    place: Array
    by_orientation: Array
    by_source: dict[str, Array]
    sights: tuple[Sight, ...]
    text: str
    left_out: str = ""

    def covariance(self, oriented: Oriented) -> Array:
        """Return the covariance of the point, (3, 3) [m²]."""
        return joint_covariance([self], oriented)


def joint_covariance(points: Sequence[Located], oriented: Oriented, *, shared: bool = True) -> Array:
    """Return the covariance of all coordinates of some points, (3n, 3n) [m²].

    Parameters
    ----------
    shared : the errors of the photographs' orientation count too
    """
    count = 3 * len(points)
    out = np.zeros((count, count))
    if shared and oriented.covariance.size:
        by = np.concatenate([point.by_orientation for point in points])
        used = np.flatnonzero(by.any(axis=0))
        by = by[:, used]
        out += by @ oriented.covariance[np.ix_(used, used)] @ by.T
    widths: dict[str, int] = {}
    for point in points:
        for name, slopes in point.by_source.items():
            widths[name] = slopes.shape[1]
    offsets = dict(zip(widths, np.cumsum([0, *widths.values()]).tolist(), strict=False))
    slopes_of_points = np.zeros((count, sum(widths.values())))
    for k, point in enumerate(points):
        for name, slopes in point.by_source.items():
            slopes_of_points[3 * k : 3 * k + 3, offsets[name] : offsets[name] + widths[name]] = slopes
    return out + slopes_of_points @ slopes_of_points.T


def line_up(oriented: Oriented, mark: Mark, place: Array) -> tuple[Array, Array, Array]:
    """Return the weighted residual of a mark, (2,), its derivatives by orientation, (2, nr), and point, (2, 3)."""
    camera = oriented.camera(mark.photo)
    work = np.zeros((5, PARAMETERS))
    measured = mark.image * camera.pixel * (1.0, -1.0)
    weight = np.full(2, 1.0 / (mark.sigma * camera.pixel))
    ray(
        measured, weight, camera.forward, camera.inner,
        oriented.rotation(mark.photo), oriented.station(mark.photo), place, work,
    )  # fmt: skip
    by = np.zeros((2, len(oriented.covariance)))
    columns = oriented.table[mark.photo]
    free = columns >= 0
    by[:, columns[free]] = work[:2, free]
    return work[4, :2].copy(), by, work[2:4, :3].copy()
