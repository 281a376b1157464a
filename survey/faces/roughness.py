"""Roughness of stone: scatter of points about their planes beyond the precision with which they were measured.

Marks on photographs are good to a tenth of a millimetre, and stone is rough by one or more. With the precision of the
marks alone a robust fit takes most of the stone for blunders. So one variance, of all faces together, is added to that
of every point before planes are fitted: the one with which the points scatter as normal errors do. It is estimated
from faces without outliers, and without what a curved face explains, so that a round tower is not a rough one.
"""

import math
from collections.abc import Sequence

import numpy as np

from ground.errors import GeometryError
from ground.statistics.roots import root_of
from ground.statistics.scale import spread
from survey.arrays import Array
from survey.conventions import MANY, SIGNIFICANT, TENTH
from survey.faces.planes import FaceFit, fit_plane
from survey.records.survey import BlockRecord

TOLERANCE = TENTH
"""Relative error below which a stated standard deviation is right, since nobody states it better."""

_MIN_FREEDOM = MANY  # degrees of freedom from which a scatter is known to a fifth
_CLIPPED = 1.4  # standard deviation of a clipped scatter over that of all of n normal values
_CURVED = 9  # least points of a face from which its curvature is told from its roughness: 6 unknowns


def rough_sigmas(record: BlockRecord) -> Array:
    """Return the standard deviation of each point and corner of a stone across its face, (n,) [m]."""
    return np.hypot(record.point_and_vertex_sigmas, record.roughness)


def estimate_roughness(records: Sequence[BlockRecord]) -> float:
    """Return the roughness that the faces of a survey share [m]; 0 if they scatter as stated, or too few tell.

    Parameters
    ----------
    records : stones measured in space
    """
    places = [
        (
            np.concatenate([record.points.reshape(-1, 3), record.vertices]),
            record.point_and_vertex_sigmas,
            record.seen_from,
        )
        for record in records
        if len(record.points) + len(record.vertices) > 3
    ]
    fits = _fits(places, 0.0)
    freedom = sum(len(points) - 3 for points, *_ in places)
    if freedom < _MIN_FREEDOM or not fits:
        return 0.0
    least = 1.0 + max(TOLERANCE, SIGNIFICANT * _CLIPPED / math.sqrt(2.0 * freedom))
    if _ratio(fits) <= least:
        return 0.0
    residuals = np.concatenate([fit.residuals for fit in fits])
    rough = root_of(lambda size: _ratio(_fits(places, size)) - 1.0, spread(residuals))
    return min(rough, _without_curvature(places, rough))


Measured = tuple[Array, Array, Array | None]


def _fits(places: Sequence[Measured], rough: float) -> list[FaceFit]:
    """Return the planes of faces with some roughness, of those that have one."""
    fits = []
    for points, sigma, observer in places:
        try:
            fits.append(fit_plane(points, np.hypot(sigma, rough), observer))
        except GeometryError:
            continue  # it is refused, and told, when its stone is made
    return fits


def _ratio(fits: Sequence[FaceFit]) -> float:
    """Return the scatter of all points over their standard deviation, outliers among them or not."""
    every = np.concatenate([fit.standardised for fit in fits])
    return spread(every[np.isfinite(every)])


def _without_curvature(places: Sequence[Measured], rough: float) -> float:
    """Return the roughness about quadrics, of the faces with enough points; infinite where there are too few."""
    squares: list[Array] = []
    variances: list[Array] = []
    freedom = 0
    for points, sigma, observer in places:
        try:
            fit = fit_plane(points, np.hypot(sigma, rough), observer)
        except GeometryError:
            continue
        inliers = np.setdiff1d(np.arange(len(points)), fit.rejected)
        if len(inliers) < _CURVED:
            continue
        u, v = ((points[inliers] - fit.centroid) @ fit.axes.T).T
        design = np.column_stack([np.ones(len(inliers)), u, v, u * u, u * v, v * v])
        root = 1.0 / np.hypot(sigma[inliers], rough)
        solved = np.linalg.lstsq(root[:, None] * design, root * fit.residuals[inliers], rcond=None)[0]
        squares.append((fit.residuals[inliers] - design @ solved) ** 2)
        variances.append(sigma[inliers] ** 2)
        freedom += len(inliers) - 6
    if freedom < _MIN_FREEDOM:
        return math.inf
    square, variance = np.concatenate(squares), np.concatenate(variances)

    def excess(size: float) -> float:
        """Return how much χ² over its freedom exceeds 1 at a roughness [m]."""
        return float((square / (variance + size**2)).sum()) / freedom - 1.0

    if excess(rough) > -SIGNIFICANT * math.sqrt(2.0 / freedom):
        return math.inf
    return root_of(excess, rough)
