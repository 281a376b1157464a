"""The common plane of measured faces, and the prediction of a face that was not measured.

The faces of a wall scatter about a common plane: each stands out by a height aⱼ at its centroid and is tilted by two
angles, with variances that are estimated from the wall itself. Heights and tilts of n faces are 3 n observations of the
three parameters of the plane; the variance of each of the two groups follows from its own residuals over its own
redundancy (Förstner 1979), and the unmeasured face is one more draw from the same scatter:

    variance = scatter between faces + variance of the common plane.

With few faces the scatter is uncertain itself. Then the prediction follows Student's distribution, whose variance is
ν/(ν - 2) times larger for ν degrees of freedom. A sill or a cornice does not belong to the plane: a face whose height
is an outlier against the scatter of all others (Student's test, 0.1 %) is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from survey.arrays import Array
from survey.conventions import CORNERS, MANY, MAX_ITERATIONS, RARE
from survey.faces.planes import FaceFit
from survey.geometry.solids import plane_frame

Indices = NDArray[np.intp]

_MOST_STUDENT = 3.0  # ν/(ν - 2) where ν is 3; it does not exist for two
_LEAST_FACES = CORNERS  # a plane has three parameters
_FEW_FACES = MANY  # number of faces up to which they are examined one by one


@dataclass(frozen=True)
class PlaneEstimate:
    """A predicted plane of a face that was not measured itself.

    Attributes
    ----------
    centroid : (3,) a place on the plane [m]
    normal : (3,) outward [-]
    axes : (2, 3) unit directions in the plane [-]
    covariance : (3, 3) of two tilts [rad] and the height at `centroid` [m]; tilt i turns the normal towards -axes[i]
    scatter : standard deviation of the heights of faces about the plane [m]
    text : origin of the prediction, in words
    """

    centroid: Array
    normal: Array
    axes: Array
    covariance: Array
    scatter: float
    text: str

    def height_sigma(self, points: Array) -> Array:
        """Compute the standard deviation of the face's height at places (n, 3), (n,) [m]."""
        arms = self._arms(points)
        out: Array = np.sqrt(((arms @ self.covariance) * arms).sum(axis=1))
        return out

    def corrected(self, points: Array, sigmas: Array, text: str) -> "PlaneEstimate":
        """Correct the estimate by points (n, 3) measured on the face, with their precision (n,) [m]."""
        arms = self._arms(points)
        gain = self.covariance @ arms.T @ np.linalg.inv(arms @ self.covariance @ arms.T + np.diag(sigmas**2))
        step = gain @ ((points - self.centroid) @ self.normal)
        keep = np.eye(3) - gain @ arms  # Joseph's form: rounding makes no variance negative
        normal, axes = _tilted(self.normal, self.axes, step)
        return PlaneEstimate(
            centroid=self.centroid + step[2] * self.normal,
            normal=normal,
            axes=axes,
            covariance=keep @ self.covariance @ keep.T + (gain * sigmas**2) @ gain.T,
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
    members : indices of the faces that belong to the plane; the others stand out of it or lie behind
    """

    centroid: Array
    normal: Array
    axes: Array
    covariance: Array
    height_scatter: float
    tilt_scatter: float
    members: tuple[int, ...] = ()

    def face_at(self, place: Array, text: str) -> PlaneEstimate:
        """Predict a face that has its corners around a place (3,) [m]; `text` is the origin of the prediction."""
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
            text=text,
        )


def common_plane(fits: Sequence[FaceFit], place: Array) -> CommonPlane:
    """Estimate the plane about which three or more faces scatter, without outliers.

    Parameters
    ----------
    fits : planes of the faces, turned less than 90° from each other
    place : (3,) near them, the origin of the computation [m]

    Returns
    -------
    CommonPlane
    """
    mean = np.sum([fit.normal for fit in fits], axis=0)
    frame = plane_frame(mean / np.linalg.norm(mean))
    places = np.array([fit.centroid for fit in fits]) - place
    normals = np.array([fit.normal for fit in fits]) @ frame.T
    variances = np.array([np.diagonal(fit.covariance) for fit in fits])
    faces = _Faces(
        arms=np.column_stack([places @ frame[:2].T, np.ones(len(fits))]),
        heights=places @ frame[2],
        slopes=-normals[:, :2] / normals[:, 2:],
        variances=np.column_stack([variances[:, 2], variances[:, :2].mean(axis=1)]),
    )
    members, best = _without_outliers(faces)
    normal, axes = _tilted(frame[2], frame[:2], best.step)
    scatter = [
        float(np.sqrt(max(variance * _student(freedom) - measured, 0.0)))
        for variance, freedom, measured in zip(
            best.variances, best.freedom, faces.variances[members].mean(axis=0).tolist(), strict=True
        )
    ]
    return CommonPlane(
        centroid=place + best.step[2] * frame[2],
        normal=normal,
        axes=axes,
        covariance=best.cofactors,
        height_scatter=scatter[0],
        tilt_scatter=scatter[1],
        members=tuple(members.tolist()),
    )


@dataclass(frozen=True)
class _Faces:
    """Faces in a frame along their mean plane.

    Attributes
    ----------
    arms : (n, 3) lateral place of each centroid [m], and 1
    heights : (n,) of each centroid [m]
    slopes : (n, 2) [rad]
    variances : (n, 2) of each height [m²], of each slope [rad²], as measured
    """

    arms: Array
    heights: Array
    slopes: Array
    variances: Array

    def only(self, some: Indices) -> "_Faces":
        """Return some of the faces."""
        return _Faces(self.arms[some], self.heights[some], self.slopes[some], self.variances[some])


@dataclass(frozen=True)
class _Adjusted:
    """An adjusted common plane: slopes and height, their covariance; variance and redundancy of heights and slopes."""

    step: Array
    cofactors: Array
    variances: tuple[float, float]
    freedom: tuple[float, float]


def _without_outliers(faces: _Faces) -> tuple[Indices, _Adjusted]:
    """Remove the farthest face, then the next, and so on; leave out all up to the last proven outlier.

    Tested after its own removal, a face cannot hide another (generalised extreme studentised deviate; Rosner 1983).
    """
    everything = np.arange(len(faces.heights))
    members, best = everything, _adjust(faces)
    answer = members, best
    most = len(members) // 3 if len(members) <= _FEW_FACES else len(members)
    for _ in range(most):
        some = faces.only(members)
        inner = _studentised(some, best)
        # one at a time where each counts; among many, all that are at least half as far out as the farthest
        out = inner >= (inner.max() if len(members) <= _FEW_FACES else 0.5 * inner.max())
        rest = np.flatnonzero(~out)
        if len(rest) < max(_LEAST_FACES + 1, len(everything) // 2):
            break
        best = _adjust(some.only(rest))
        tests = _predicted_residuals(some.only(np.flatnonzero(out)), best)
        limit = float(stdtrit(best.freedom[0], 1.0 - 0.5 * RARE / len(members)))
        members = members[rest]
        if tests.min() > limit:
            answer = members, best
        elif len(members) > _FEW_FACES:
            break
    return answer


def _studentised(faces: _Faces, best: _Adjusted) -> Array:
    """Compute the residual of each height over its standard deviation, (n,) [-]."""
    carried = ((faces.arms @ best.cofactors) * faces.arms).sum(axis=1)
    variance = np.maximum(best.variances[0] - carried, 1e-6 * best.variances[0])
    out: Array = np.abs(faces.heights - faces.arms @ best.step) / np.sqrt(variance)
    return out


def _predicted_residuals(faces: _Faces, best: _Adjusted) -> Array:
    """Compute the residual of heights outside the fit over their standard deviation, (n,) [-]."""
    carried = ((faces.arms @ best.cofactors) * faces.arms).sum(axis=1)
    out: Array = np.abs(faces.heights - faces.arms @ best.step) / np.sqrt(best.variances[0] + carried)
    return out


def _adjust(faces: _Faces) -> _Adjusted:
    """Fit by least squares with one variance for the heights and one for the slopes, both from the residuals."""
    arms, heights, slopes, count = faces.arms, faces.heights, faces.slopes, len(faces.heights)
    by_heights, by_slopes = arms.T @ arms, np.diag([count, count, 0.0])
    least = np.maximum(faces.variances.mean(axis=0), 1e-16).tolist()
    step: Array = np.append(slopes.mean(axis=0), 0.0)
    step[2] = (heights - arms @ step).mean()
    freedom, before = (count - 1.0, 2.0 * count - 2.0), 0.0
    for _ in range(MAX_ITERATIONS):
        squares = float(((heights - arms @ step) ** 2).sum()), float(((slopes - step[:2]) ** 2).sum())
        variances = max(squares[0] / freedom[0], least[0]), max(squares[1] / freedom[1], least[1])
        inverse = np.linalg.inv(by_heights / variances[0] + by_slopes / variances[1])
        cofactors = np.asarray(inverse, dtype=np.float64)
        right = arms.T @ heights / variances[0] + np.append(slopes.sum(axis=0), 0.0) / variances[1]
        step = cofactors @ right
        freedom = (
            max(count - float(np.trace(cofactors @ by_heights)) / variances[0], 0.5),
            max(2.0 * count - float(np.trace(cofactors @ by_slopes)) / variances[1], 0.5),
        )
        if abs(freedom[0] - before) < 1e-6:
            break
        before = freedom[0]
    return _Adjusted(step, cofactors, variances, freedom)


def _student(freedom: float) -> float:
    return freedom / (freedom - 2.0) if freedom > 3.0 else _MOST_STUDENT


def _tilted(normal: Array, axes: Array, step: Array) -> tuple[Array, Array]:
    """Tilt a plane by two slopes along its axes; return its normal and axes."""
    tilted = normal - step[:2] @ axes
    new: Array = tilted / float(np.linalg.norm(tilted))
    along: Array = axes[0] - (axes[0] @ new) * new
    along = along / float(np.linalg.norm(along))
    return new, np.array([along, np.cross(new, along)])
