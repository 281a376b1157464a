"""The plane that the neighbours of an unmeasured face suggest, and how far real faces differ from it.

The faces of a wall scatter about a common plane: each stands out by a height aⱼ at its centroid and is tilted by two
angles, of variances that the wall itself must tell. Heights and tilts of the n neighbours are 3 n observations of
the three parameters of the plane; the variance of each of the two groups follows from its own residuals over its
own redundancy (Förstner 1979), and the face that nobody measured is one more draw from the same scatter:

    variance = scatter between faces + variance of the common plane.

With few neighbours the scatter is uncertain itself. Then the prediction follows Student's distribution, whose
variance is ν/(ν - 2) times larger for ν degrees of freedom.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from survey.planes import FaceFit

__all__ = ["CommonPlane", "MeasuredFace", "Neighbours", "PlaneEstimate", "plane_of_neighbours"]

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

_SAME_WAY = float(np.cos(np.radians(30.0)))  # faces turned farther belong to another wall
_ENOUGH = 3  # neighbours that it takes to speak of their plane
_REACH = 0.5  # how near a neighbour has to come, in sizes of the stone
_LEANING = 0.1  # how far a wall may leave the plane of the marks, per distance from them
_MOST_STUDENT = 3.0  # ν/(ν - 2) where ν is 3; it does not exist for two
_ROUNDS = 8


class MeasuredFace(Protocol):
    """What has to be known of a face: its code, its plane and its outline (nv, 3) [m]."""

    @property
    def code(self) -> str:
        """Code of the stone."""

    @property
    def fit(self) -> FaceFit:
        """Its plane."""

    @property
    def outline(self) -> Array:
        """(nv, 3) corners in order [m]."""


@dataclass(frozen=True)
class PlaneEstimate:
    """Where a face lies that was not measured itself.

    Attributes
    ----------
    centroid : (3,) a place on the plane [m]
    normal : (3,) outward [-]
    axes : (2, 3) unit directions in the plane [-]
    covariance : (3, 3) of two tilts [rad] and the height at `centroid` [m]; tilt i turns the normal towards -axes[i]
    scatter : standard deviation of the heights of faces about the plane [m]
    text : what it is the plane of
    """

    centroid: Array
    normal: Array
    axes: Array
    covariance: Array
    scatter: float
    text: str

    def height_sigma(self, points: Array) -> Array:
        """Standard deviation of the face's height at places (n, 3), (n,) [m]."""
        arms = self._arms(points)
        out: Array = np.sqrt(((arms @ self.covariance) * arms).sum(axis=1))
        return out

    def corrected(self, points: Array, sigmas: Array, text: str) -> "PlaneEstimate":
        """The estimate after some points (n, 3) of the face were measured, with their precision (n,) [m]."""
        arms = self._arms(points)
        gain = self.covariance @ arms.T @ np.linalg.inv(arms @ self.covariance @ arms.T + np.diag(sigmas**2))
        step = gain @ ((points - self.centroid) @ self.normal)
        normal, axes = _turned(self.normal, self.axes, step)
        return PlaneEstimate(
            centroid=self.centroid + step[2] * self.normal,
            normal=normal,
            axes=axes,
            covariance=self.covariance - gain @ arms @ self.covariance,
            scatter=self.scatter,
            text=text,
        )

    def _arms(self, points: Array) -> Array:
        return np.column_stack([(points - self.centroid) @ self.axes.T, np.ones(len(points))])


@dataclass(frozen=True)
class CommonPlane:
    """A plane about which faces scatter.

    Attributes
    ----------
    centroid, normal, axes : as in PlaneEstimate
    covariance : (3, 3) of the two tilts [rad] and the height at `centroid` [m] of the plane itself
    height_scatter : standard deviation of the heights of faces at their centroids, about the plane [m]
    tilt_scatter : standard deviation of either tilt of a face against the plane [rad]
    text : what it is the plane of
    """

    centroid: Array
    normal: Array
    axes: Array
    covariance: Array
    height_scatter: float
    tilt_scatter: float
    text: str

    def face_at(self, place: Array) -> PlaneEstimate:
        """Predict a face that has its corners around a place (3,)."""
        lateral = self.axes @ (place - self.centroid)
        carry = np.eye(3)
        carry[2, :2] = lateral
        scatter = np.array([self.tilt_scatter, self.tilt_scatter, self.height_scatter])
        return PlaneEstimate(
            centroid=self.centroid + lateral @ self.axes,
            normal=self.normal,
            axes=self.axes,
            covariance=carry @ self.covariance @ carry.T + np.diag(scatter**2),
            scatter=self.height_scatter,
            text=self.text,
        )


class Neighbours:
    """Measured faces, to be searched by place.

    Parameters
    ----------
    faces : in any order
    """

    def __init__(self, faces: Sequence[MeasuredFace]) -> None:
        self.codes = tuple(face.code for face in faces)
        self._fits = [face.fit for face in faces]
        self._normals = np.array([face.fit.normal for face in faces]).reshape(-1, 3)
        self._corners = np.concatenate([face.outline for face in faces] or [np.empty((0, 3))])
        self._next = np.concatenate(
            [np.roll(face.outline, -1, axis=0) for face in faces] or [np.empty((0, 3))]
        )
        self._counts = np.array([len(face.outline) for face in faces], dtype=np.intp)
        self._starts = np.cumsum(self._counts) - self._counts
        self._centres = np.array([face.outline.mean(axis=0) for face in faces]).reshape(-1, 3)
        owner = np.repeat(np.arange(len(faces)), self._counts)
        self._radii = np.zeros(len(faces))
        np.maximum.at(self._radii, owner, np.linalg.norm(self._corners - self._centres[owner], axis=1))
        self._tree = cKDTree(self._centres) if faces else None

    def near(self, outline: Array, normal: Array) -> Indices:
        """Faces that face the same way and come within half the size of an outline (nv, 3), if three do."""
        if self._tree is None:
            return np.empty(0, dtype=np.intp)
        centre = outline.mean(axis=0)
        reach = _REACH * float(np.linalg.norm(outline[:, None] - outline[None], axis=2).max())
        around = float(np.linalg.norm(outline - centre, axis=1).max()) + reach
        found = np.sort(self._tree.query_ball_point(centre, around + float(self._radii.max()))).astype(
            np.intp
        )
        apart = np.linalg.norm(self._centres[found] - centre, axis=1)
        found = found[(apart <= around + self._radii[found]) & (self._normals[found] @ normal >= _SAME_WAY)]
        if len(found) < _ENOUGH:
            return np.empty(0, dtype=np.intp)
        near: Indices = found[self._distances(outline, found) <= reach]
        return near if len(near) >= _ENOUGH else near[:0]

    def _distances(self, outline: Array, found: Indices) -> Array:
        """Distance of each of some faces from an outline: that of the nearest corner from an edge, (k,) [m]."""
        counts = self._counts[found]
        first = np.cumsum(counts) - counts
        rows = np.repeat(self._starts[found] - first, counts) + np.arange(counts.sum())
        one = _to_segments(outline, self._corners[rows], self._next[rows]).min(axis=0)
        other = _to_segments(self._corners[rows], outline, np.roll(outline, -1, axis=0)).min(axis=1)
        out: Array = np.minimum.reduceat(np.minimum(one, other), first)
        return out

    def on_wall(self, centre: Array, normal: Array, size: float) -> Indices:
        """Faces of the wall that goes through a place: same way, and near its plane, if three do."""
        arms = self._centres - centre
        heights = np.abs(arms @ normal)
        along = np.sqrt(np.maximum((arms**2).sum(axis=1) - heights**2, 0.0))
        same = (self._normals @ normal >= _SAME_WAY) & (heights <= np.maximum(size, _LEANING * along))
        found: Indices = np.flatnonzero(same)
        return found if len(found) >= _ENOUGH else found[:0]

    def outward(self, centre: Array, normal: Array, size: float) -> Array:
        """The normal of a wall through a place, turned the way most faces look that lie on it."""
        ahead, behind = self.on_wall(centre, normal, size), self.on_wall(centre, -normal, size)
        return -normal if len(behind) > len(ahead) else normal

    def fits(self, found: Indices) -> list[FaceFit]:
        """Planes of some faces."""
        return [self._fits[i] for i in found]


def plane_of_neighbours(fits: Sequence[FaceFit], place: Array, text: str) -> CommonPlane:
    """The plane about which three or more faces scatter.

    Parameters
    ----------
    fits : planes of the faces, turned less than 90° from each other
    place : (3,) near them, to be the centre of the computation [m]
    text : what they are

    Returns
    -------
    CommonPlane
    """
    mean = np.sum([fit.normal for fit in fits], axis=0)
    frame = _frame(mean / np.linalg.norm(mean))
    places = np.array([fit.centroid for fit in fits]) - place
    lateral, heights = places @ frame[:2].T, places @ frame[2]
    normals = np.array([fit.normal for fit in fits]) @ frame.T
    slopes = -normals[:, :2] / normals[:, 2:]
    own = np.array([np.diagonal(fit.covariance) for fit in fits])
    best, cofactors, scatter = _common_plane(
        lateral, heights, slopes, float(own[:, 2].mean()), float(own[:, :2].mean())
    )
    normal, axes = _turned(frame[2], frame[:2], best)
    return CommonPlane(place + best[2] * frame[2], normal, axes, cofactors, *scatter, text)


def _common_plane(
    lateral: Array, heights: Array, slopes: Array, height_variance: float, tilt_variance: float
) -> tuple[Array, Array, tuple[float, float]]:
    """Slopes and height of the common plane, their covariance, and how far heights and tilts scatter."""
    count = len(heights)
    arms = np.column_stack([lateral, np.ones(count)])
    by_heights, by_tilts = arms.T @ arms, np.diag([count, count, 0.0])
    least = max(height_variance, 1e-16), max(tilt_variance, 1e-16)
    best: Array = np.append(slopes.mean(axis=0), 0.0)
    cofactors: Array = np.eye(3)
    best[2] = (heights - lateral @ best[:2]).mean()
    variances, freedom = least, (count - 1.0, 2.0 * count - 2.0)
    for _ in range(_ROUNDS):
        left = float(((heights - arms @ best) ** 2).sum()), float(((slopes - best[:2]) ** 2).sum())
        variances = max(left[0] / freedom[0], least[0]), max(left[1] / freedom[1], least[1])
        inverse = np.linalg.inv(by_heights / variances[0] + by_tilts / variances[1])
        cofactors = np.asarray(inverse, dtype=np.float64)
        best = cofactors @ (
            arms.T @ heights / variances[0] + np.append(slopes.sum(axis=0), 0.0) / variances[1]
        )
        freedom = (
            max(count - float(np.trace(cofactors @ by_heights)) / variances[0], 0.5),
            max(2.0 * count - float(np.trace(cofactors @ by_tilts)) / variances[1], 0.5),
        )
    between = [
        float(np.sqrt(max(variance * _student(f) - measured, 0.0)))
        for variance, f, measured in zip(variances, freedom, (height_variance, tilt_variance), strict=True)
    ]
    return best, cofactors, (between[0], between[1])


def _student(freedom: float) -> float:
    return freedom / (freedom - 2.0) if freedom > 3.0 else _MOST_STUDENT


def _turned(normal: Array, axes: Array, step: Array) -> tuple[Array, Array]:
    """Normal and axes of a plane after it was tilted by two slopes along its axes."""
    tilted = normal - step[:2] @ axes
    new: Array = tilted / float(np.linalg.norm(tilted))
    along: Array = axes[0] - (axes[0] @ new) * new
    along = along / float(np.linalg.norm(along))
    return new, np.array([along, np.cross(new, along)])


def _frame(normal: Array) -> Array:
    """(3, 3) right-handed, rows: two directions square to the normal, the normal."""
    along = np.cross(np.eye(3)[int(np.argmin(np.abs(normal)))], normal)
    along /= np.linalg.norm(along)
    return np.array([along, np.cross(normal, along), normal])


def _to_segments(points: Array, starts: Array, ends: Array) -> Array:
    """Distances of points (p, 3) from segments (e, 3) to (e, 3), (p, e) [m]."""
    run = ends - starts
    length = np.maximum((run**2).sum(axis=1), 1e-300)
    from_start = points[:, None] - starts[None]
    part = np.clip((from_start * run).sum(axis=2) / length, 0.0, 1.0)
    out: Array = np.linalg.norm(from_start - part[..., None] * run, axis=2)
    return out
