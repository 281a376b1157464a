"""Control points: whether they fit what the photographs show, and what they cannot tell."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import chdtri

from ground.errors import SurveyError
from survey.arrays import AXES, Array
from survey.conventions import RARE, SOME
from survey.orientation.bundle.adjustment import Solution
from survey.orientation.bundle.start import FLAT
from survey.orientation.bundle.statistics import Statistics
from survey.orientation.network import Network, Photo

MISSES = math.sqrt(float(chdtri(AXES, RARE)) / AXES)
"""√(χ²₃ / 3) that a sound point exceeds once in a thousand cases."""

FAR_OFF = 10.0
"""The same, beyond which it is a mistake, not chance."""

# distance of a station from where it was given, over that from the control points, up to which they agree
_STATION_DISTANCE = SOME
_FOOTPRINT = 0.5  # of a pixel on the object, beyond which coordinates are hardly in metres [m]
_FINE = 3e-3  # standard deviation of coordinates over that, below which they are not


def control_tests(network: Network, solution: Solution, result: Statistics) -> Array:
    """Return by how many standard deviations each control or check point misses its place; 0 where it is fixed.

    The misfit d of a control point has the covariance Σ - C of what was stated and what was adjusted, that of a
    check point Σ + C; returned is √(dᵀ(…)⁻¹d / 3).
    """
    out = np.zeros(len(network.control))
    for k, gcp in enumerate(network.control):
        solved = result.points[gcp.point]
        if (gcp.fixed and not gcp.check) or not np.isfinite(solved).all():
            continue
        off = gcp.place - solution.unknowns.point[gcp.point]
        spread = gcp.covariance + (solved if gcp.check else -solved)
        values, axes = np.linalg.eigh(spread)
        sound = values > 1e-3 * float(np.trace(gcp.covariance if not gcp.check else spread)) / 3.0
        if sound.any():
            out[k] = np.sqrt((((axes.T @ off)[sound]) ** 2 / values[sound]).sum() / sound.sum())
    return out


def control_remarks(network: Network, solution: Solution, photos: Sequence[Photo]) -> list[str]:
    """Return remarks on what control points leave open: their unit, and the side of their plane.

    Parameters
    ----------
    photos : as they were given: where their stations agree with what was found, a plane is not mirrored

    Raises
    ------
    SurveyError
        if coordinates are stated far finer than a pixel: they are of another unit
    """
    fitted_points = [gcp for gcp in network.control if not gcp.check]
    if len(fitted_points) < 3:
        return []
    places, out = np.array([gcp.place for gcp in fitted_points]), list[str]()
    towards = solution.unknowns.station.mean(axis=0) - places.mean(axis=0)
    lengths = [network.camera_of(f).inner[0] / network.camera_of(f).pixel for f in range(len(network.photos))]
    footprint = float(np.linalg.norm(towards) / np.median(lengths))
    sigma = float(np.sqrt(np.median([np.trace(gcp.covariance) / 3.0 for gcp in fitted_points])))
    if footprint > _FOOTPRINT:
        what = f"a pixel covers about {footprint:.2g} m where the control points are"
        if 0.0 < sigma < _FINE * footprint:
            raise SurveyError(
                f"{what}, which are stated to {sigma:.2g} m: their coordinates are of another unit",
                where=fitted_points[0].where or network.path,
                remedy="give coordinates and deviations in metres",
            )
        out.append(f"{what}: are their coordinates in metres?")
    _, sizes, axes = np.linalg.svd(places - places.mean(axis=0), full_matrices=False)
    stations = zip((photo.station for photo in photos), solution.unknowns.station, strict=True)
    off = [float(np.linalg.norm(here - there)) for there, here in stations if there is not None]
    placed = bool(off) and np.median(off) < _STATION_DISTANCE * np.linalg.norm(towards)
    placed = placed or any(photo.observed_station is not None or photo.fixed for photo in photos)
    if sizes[2] < FLAT * sizes[0] and not placed:
        normal = axes[2] * np.sign(axes[2] @ towards)
        x, y, z = normal.round(2) + 0.0
        out.append(
            "the control points lie in a plane, and mirrored ones would fit as well: check that the photographs stand "
            f"{normal @ towards:.3g} m from it on the side of its normal ({x:g}, {y:g}, {z:g})"
        )
    return out
