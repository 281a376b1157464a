"""Surfaces that points marked on one photograph are taken to lie on: planes and cylinders, with their precision."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array
from survey.conventions import MAX_ITERATIONS, SOME, TRIALS
from survey.faces.planes import FaceFit, fit_plane
from survey.orientation.oriented import Oriented
from survey.orientation.stones.located import Located, joint_covariance

_MIN_CYLINDER_POINTS = 6  # points of a cylinder: five parameters, and one that checks them
_TRIED = 6  # of these, the best, from which the fit starts
_VAGUE = SOME  # standard deviation of the radius over it, beyond which an arc is too short


class Surface(Protocol):
    """A surface, and how it follows the points that define it.

    The scatter of faces about it is what the assumption costs.
    """

    @property
    def points(self) -> tuple[Located, ...]:
        """Points that it was fitted to."""

    @property
    def scatter(self) -> float:
        """Standard deviation of the stones' faces about it [m]."""

    @property
    def text(self) -> str:
        """Description with the number of points and how they fit."""

    def meet(self, origin: Array, direction: Array) -> Array | None:
        """Return the point where a ray meets the surface, (3,); None if it does not."""

    def normal(self, place: Array) -> Array:
        """Return the unit normal at a place on the surface, (3,)."""

    def pull(self, place: Array) -> Array:
        """Return by how much the surface moves along its normal at a place if a point moves, (n, 3)."""


@dataclass(frozen=True)
class Plane:
    """A plane fitted to points.

    Attributes
    ----------
    fit : the plane
    sound : (n,) points that the fit uses
    sigma : (n,) standard deviation of each point along the normal [m]
    points, scatter, text : as in `Surface`
    """

    fit: FaceFit
    sound: Array
    sigma: Array
    points: tuple[Located, ...]
    scatter: float
    text: str

    def meet(self, origin: Array, direction: Array) -> Array | None:
        """Return the point where a ray meets the plane."""
        slope = float(self.fit.normal @ direction)
        if abs(slope) < 1e-12:
            return None
        along = float(self.fit.normal @ (self.fit.centroid - origin)) / slope
        return origin + along * direction if along > 0.0 else None

    def normal(self, place: Array) -> Array:
        """Return the normal of the plane."""
        return self.fit.normal

    def pull(self, place: Array) -> Array:
        """Return the pull of each point on the plane at a place."""
        places = np.array([point.place for point in self.points])
        rows = np.column_stack([(places - self.fit.centroid) @ self.fit.axes.T, np.ones(len(places))])
        weights = np.where(self.sound, self.sigma**-2.0, 0.0)
        at = np.append((place - self.fit.centroid) @ self.fit.axes.T, 1.0)
        gains = at @ np.linalg.solve(rows.T @ (weights[:, None] * rows), rows.T * weights)
        return np.outer(gains, self.fit.normal)


@dataclass(frozen=True)
class Cylinder:
    """A circular cylinder.

    Attributes
    ----------
    centre : (3,) place on its axis, amid the points [m]
    axis : (3,) unit vector
    across : (2, 3) unit vectors square to the axis
    radius : [m]
    sigma : (n,) standard deviation of each point along the radius [m]
    points, scatter, text : as in `Surface`
    """

    centre: Array
    axis: Array
    across: Array
    radius: float
    sigma: Array
    points: tuple[Located, ...]
    scatter: float
    text: str

    def meet(self, origin: Array, direction: Array) -> Array | None:
        """Return the point where a ray meets the cylinder, on the side of the points that define it."""
        side = np.eye(3) - np.outer(self.axis, self.axis)
        d, o = side @ direction, side @ (origin - self.centre)
        a, b, c = d @ d, o @ d, o @ o - self.radius**2
        root = b * b - a * c
        if a < 1e-18 or root < 0.0:
            return None
        meetings = [
            origin + distance * direction
            for distance in ((-b - root**0.5) / a, (-b + root**0.5) / a)
            if distance > 0.0
        ]
        middle = np.mean([point.place for point in self.points], axis=0)
        return (
            min(meetings, key=lambda meeting: float(np.linalg.norm(meeting - middle))) if meetings else None
        )

    def normal(self, place: Array) -> Array:
        """Return the unit vector from the axis to a place."""
        arm = place - self.centre
        arm = arm - (arm @ self.axis) * self.axis
        out: Array = arm / np.linalg.norm(arm)
        return out

    def pull(self, place: Array) -> Array:
        """Return the pull of each point on the cylinder at a place."""
        places = np.array([point.place for point in self.points])
        _, rows = _slopes(places, self.centre, self.axis, self.across)
        outward = rows[:, :2] @ self.across
        at = _slopes(place[None], self.centre, self.axis, self.across)[1][0]
        weights = self.sigma**-2.0
        gains = at @ np.linalg.pinv(rows.T @ (weights[:, None] * rows)) @ (rows.T * weights)
        out: Array = gains[:, None] * outward
        return out


def fit_surface(
    kind: str, points: Sequence[Located], oriented: Oriented, towards: Array, scatter: float | None = None
) -> Surface:
    """Fit a surface to points.

    Parameters
    ----------
    kind : "plane" or "cylinder"
    points : of which each counts by the precision that it does not share with the others
    towards : (3,) place in front of it [m]
    scatter : of the stones' faces about it; None: as far as the points show it [m]

    Raises
    ------
    GeometryError
        if there are too few points, or they define no such surface
    """
    covariances = np.array([joint_covariance([point], oriented, shared=False) for point in points]).reshape(
        -1, 3, 3
    )
    return (_plane if kind == "plane" else _cylinder)(tuple(points), covariances, towards, scatter)


def _plane(points: tuple[Located, ...], covariances: Array, towards: Array, scatter: float | None) -> Plane:
    if len(points) < 3:
        raise GeometryError(
            f"{len(points)} points define no plane",
            remedy="mark 3 or more points of the face on two photographs",
        )
    places = np.array([point.place for point in points])
    normal = np.linalg.svd(places - places.mean(axis=0))[2][2]
    for _ in range(2):
        sigma = np.sqrt(np.einsum("a,nab,b->n", normal, covariances, normal))
        fit = fit_plane(places, sigma, towards)
        normal = fit.normal
    sound = np.ones(len(points), dtype=bool)
    sound[list(fit.rejected)] = False
    spread = _scatter(fit.residuals[sound], sigma[sound], fit.redundancy) if scatter is None else scatter
    text = f"the plane of {_told(int(sound.sum()), fit.rms, fit.redundancy, spread)}"
    return Plane(fit, sound, sigma, points, spread, text)


def _cylinder(
    points: tuple[Located, ...], covariances: Array, towards: Array, scatter: float | None
) -> Cylinder:
    if len(points) < _MIN_CYLINDER_POINTS:
        raise GeometryError(
            f"{len(points)} points define no cylinder",
            remedy=f"mark {_MIN_CYLINDER_POINTS} or more points of the faces on two photographs",
        )
    places = np.array([point.place for point in points])
    best = min(
        (_refined(places, covariances, axis) for axis in _starts(places)), key=lambda candidate: candidate[0]
    )
    square, centre, axis, across, radius, vague, sigma = best
    residuals = _slopes(places, centre, axis, across)[0] - radius
    flat = float(np.linalg.svd(places - places.mean(axis=0))[1][2])
    if not np.isfinite(square) or vague > _VAGUE * radius or flat <= np.linalg.norm(residuals):
        raise GeometryError(
            f"the {len(points)} points do not define a cylinder: they cover too short an arc, or are plane",
            remedy="mark points farther around it, or take a plane",
        )
    redundancy = len(points) - 5
    spread = _scatter(residuals, sigma, redundancy) if scatter is None else scatter
    rms = float(np.sqrt((residuals**2).mean()))
    text = f"the cylinder of radius {radius:.3f} m of {_told(len(points), rms, redundancy, spread)}"
    return Cylinder(centre, axis, across, radius, sigma, points, spread, text)


def _told(count: int, rms: float, redundancy: int, scatter: float) -> str:
    checked = f"rms {rms * 1e3:.1f} mm" if redundancy > 0 else "which nothing checks"
    return f"{count} points, {checked}" + (
        f", faces within {scatter * 1e3:.1f} mm of it" if scatter > 0.0 else ""
    )


def _scatter(residuals: Array, sigma: Array, redundancy: int) -> float:
    """Return by how much the points scatter more than their precision tells, as a standard deviation [m]."""
    if redundancy <= 0:
        return 0.0
    excess = float((residuals**2).sum()) / redundancy - float((sigma**2).mean())
    return float(np.sqrt(max(excess, 0.0)))


def _starts(points: Array) -> list[Array]:
    """Return directions of the axis from which to start: those of circles that fit best."""
    k = np.arange(TRIALS)
    z = (k + 0.5) / TRIALS
    turn = k * np.pi * (3.0 - np.sqrt(5.0))
    side = np.sqrt(1.0 - z * z)
    axes = np.column_stack([side * np.cos(turn), side * np.sin(turn), z])
    return [axes[i] for i in np.argsort([_circle(points, axis)[0] for axis in axes])[:_TRIED]]


def _frame(axis: Array) -> Array:
    return np.linalg.svd(axis[None])[2][1:]


def _circle(points: Array, axis: Array) -> tuple[float, Array, float]:
    """Fit a circle to the points seen along an axis; return misfit, centre and radius."""
    across = _frame(axis)
    middle = points.mean(axis=0)
    flat = (points - middle) @ across.T
    design = np.column_stack([2.0 * flat, np.ones(len(flat))])
    solution = np.linalg.lstsq(design, (flat**2).sum(axis=1), rcond=None)[0]
    radius = float(np.sqrt(max(solution[2] + solution[:2] @ solution[:2], 1e-18)))
    off = np.linalg.norm(flat - solution[:2], axis=1) - radius
    return float(off @ off), middle + solution[:2] @ across, radius


def _slopes(points: Array, centre: Array, axis: Array, across: Array) -> tuple[Array, Array]:
    """Return distances from the axis, (n,), and how the radius at each place follows the parameters, (n, 5)."""
    arms = points - centre
    along = arms @ axis
    arms = arms - along[:, None] * axis
    distance = np.linalg.norm(arms, axis=1)
    side = (arms / np.maximum(distance, 1e-12)[:, None]) @ across.T
    return distance, np.column_stack([side, side * along[:, None], np.ones(len(points))])


def _refined(
    points: Array, covariances: Array, axis: Array
) -> tuple[float, Array, Array, Array, float, float, Array]:
    """Fit by Gauss–Newton steps; return square, centre, axis, axes across, radius and its σ, σ of points along it."""
    _, centre, radius = _circle(points, axis)
    square, vague, sigma, across = np.inf, np.inf, np.ones(len(points)), _frame(axis)
    for _ in range(MAX_ITERATIONS):
        across = _frame(axis)
        distance, rows = _slopes(points, centre, axis, across)
        outward = rows[:, :2] @ across
        sigma = np.sqrt(np.einsum("na,nab,nb->n", outward, covariances, outward))
        off = (distance - radius) / sigma
        rows = rows / sigma[:, None]
        square, (_, values, parts) = float(off @ off), np.linalg.svd(rows, full_matrices=False)
        vague = float(np.linalg.norm(parts[:, 4] / np.maximum(values, np.finfo(float).tiny)))
        step = np.linalg.lstsq(rows, off, rcond=1e-10)[0]
        size = float(np.abs(step[:2]).max() + abs(step[4])) / max(radius, 1e-9) + float(
            np.abs(step[2:4]).max()
        )
        if not np.isfinite(size):
            return np.inf, centre, axis, across, radius, vague, sigma
        step *= 0.5 / max(size, 0.5)
        centre, radius = centre + step[:2] @ across, radius + float(step[4])
        axis = axis + step[2:4] @ across
        axis = axis / np.linalg.norm(axis)
        centre = centre + ((points.mean(axis=0) - centre) @ axis) * axis
        if size < 1e-12 or radius <= 0.0:
            break
    return (square if radius > 0.0 else np.inf), centre, axis, across, radius, vague, sigma
