"""Measured deformation of courses and faces beside a computed movement of the same stones.

Masons lay courses level and faces plumb. So far as they did, the departure of a bed from level and of a face from the
upright plane of its wall is movement, and a computed movement explains it if the rest is no more than the scatter of
beds and faces. Of each course one height is free, of each wall one position: the original ones are unknown.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from survey.arrays import Array
from survey.conventions import ENOUGH
from survey.quality.bed_fit import BedCorners, BedScatter, fit_bed
from survey.quality.courses import CourseLine
from survey.quality.facades import Facade
from survey.quality.precision import StoneQuality

Displacement = Callable[[str, Array], Array]
"""Displacement (n, 3) of points (n, 3) of the stone of a code [m]."""


@dataclass(frozen=True)
class Misfit:
    """Sum of squares of residuals over their standard deviations.

    Attributes
    ----------
    chi2 : of measured against simulated
    still : the same if nothing had moved
    dof : degrees of freedom
    """

    chi2: float
    still: float
    dof: int


@dataclass(frozen=True)
class StoneMovement:
    """One quantity of one stone, relative to its course or wall.

    Attributes
    ----------
    measured, simulated : [m]
    sigma : standard deviation of their difference [m]
    """

    measured: float
    simulated: float
    sigma: float


@dataclass(frozen=True)
class CourseMovement:
    """The bed line of one course, measured and simulated.

    Attributes
    ----------
    line : as measured
    simulated : (n,) vertical displacement of each of its corners [m]
    slope, slope_sigma : simulated rise to the right over length, and standard deviation of the measured one [-]
    sag, sag_sigma : simulated height of mid-span above the chord, and standard deviation of the measured one [m];
        None where none was measured
    misfit : of the corners
    stones : height of the bed of each stone above the mean of the course, by code
    """

    line: CourseLine
    simulated: Array
    slope: float
    slope_sigma: float
    sag: float | None
    sag_sigma: float | None
    misfit: Misfit
    stones: Mapping[str, StoneMovement]


@dataclass(frozen=True)
class PlumbMovement:
    """The faces of one wall, measured and simulated, relative to its mean.

    Attributes
    ----------
    facade, zone : location; None: the stones name no zone
    misfit : of the means of the courses
    courses : mean outward position of each course
    stones : outward position of each face, by code
    """

    facade: str
    zone: str | None
    misfit: Misfit
    courses: Mapping[int, StoneMovement]
    stones: Mapping[str, StoneMovement]


def compare_courses(lines: Sequence[CourseLine], displacement: Displacement) -> tuple[CourseMovement, ...]:
    """Compare bed lines with a movement.

    Parameters
    ----------
    lines : measured; those without a slope, of a single corner, are left out
    displacement : of the simulation

    Notes
    -----
    The residuals z - w - level of the corners, with the simulated vertical displacement w, have the covariance
    κ² σ² + τ² 1 1ᵀ of each stone (`survey.quality.bed_fit`). τ and κ are those of the lines: with the lines of
    `survey.quality.departures.beds.measure_beds` those of the verdict on movement, which no simulation changes.
    """
    return tuple(_course(line, displacement) for line in lines if line.slope is not None)


def _course(line: CourseLine, displacement: Displacement) -> CourseMovement:
    number = {code: k for k, code in enumerate(dict.fromkeys(line.codes))}
    stone = np.array([number[code] for code in line.codes], dtype=np.intp)
    measured = BedCorners(stone, line.along, line.height, line.sigma)
    moved = np.zeros(len(stone))
    for code, rows in _rows(line.codes).items():
        moved[rows] = displacement(code, line.places[rows])[:, 2]
    scatter = BedScatter(line.scatter, line.roughness, 0)
    simulated = BedCorners(stone, line.along, moved, line.sigma)
    slope = fit_bed(simulated, scatter, 2)[0][1]
    lever = -((line.span / 2.0) ** 2)
    curved = line.sag is not None
    sag = lever * float(fit_bed(simulated, scatter, 3)[0][2]) if curved else None
    residual, level = (
        _levelled(measured, heights, scatter) for heights in (line.height - moved, line.height)
    )
    misfit = Misfit(_square(measured, residual, scatter), _square(measured, level, scatter), len(stone) - 1)
    still = _levelled(measured, moved, scatter)
    stones = {
        code: _bed_of(measured, rows, level, still, scatter) for code, rows in _rows(line.codes).items()
    }
    sigma = line.slope_sigma
    assert sigma is not None
    return CourseMovement(line, moved, float(slope), sigma, sag, line.sag_sigma, misfit, stones)


def _rows(codes: Sequence[str]) -> dict[str, list[int]]:
    rows: dict[str, list[int]] = {}
    for k, code in enumerate(codes):
        rows.setdefault(code, []).append(k)
    return rows


def _levelled(bed: BedCorners, heights: Array, scatter: BedScatter) -> Array:
    """Return heights less their best common level."""
    level = float(fit_bed(BedCorners(bed.stone, bed.along, heights, bed.sigma), scatter, 1)[0][0])
    levelled: Array = heights - level
    return levelled


def _square(bed: BedCorners, residual: Array, scatter: BedScatter) -> float:
    """Return rᵀ C⁻¹ r, each stone's block inverted by Sherman & Morrison."""
    weights = 1.0 / (scatter.kappa * bed.sigma) ** 2
    sums, total = (np.bincount(bed.stone, column) for column in (weights * residual, weights))
    shared = scatter.tau**2 / (1.0 + scatter.tau**2 * total)
    return float(weights @ residual**2 - shared @ sums**2)


def _bed_of(
    bed: BedCorners, rows: Sequence[int], measured: Array, simulated: Array, scatter: BedScatter
) -> StoneMovement:
    weights = 1.0 / (scatter.kappa * bed.sigma[rows]) ** 2
    levels = [float(np.average(heights[rows], weights=weights)) for heights in (measured, simulated)]
    return StoneMovement(levels[0], levels[1], math.sqrt(1.0 / float(weights.sum()) + scatter.tau**2))


def compare_plumb(
    stones: Sequence[StoneQuality],
    facades: Sequence[Facade],
    displacement: Displacement,
    battered: bool = False,
) -> tuple[PlumbMovement, ...]:
    """Compare the outward position of faces with a movement.

    Parameters
    ----------
    stones : all stones of the survey
    facades : facades of the stones; level ones are never plumb
    displacement : of the simulation
    battered : walls may have been built leaning, by an angle that is free

    Returns
    -------
    One for each facade and zone of several courses. The scatter of single faces is that within courses.
    """
    plumb_walls = []
    for facade in facades:
        if facade.azimuth is None:
            continue
        zones: dict[str | None, list[StoneQuality]] = {}
        for i in facade.members.tolist():
            if stones[i].course is not None:
                zones.setdefault(stones[i].zone or None, []).append(stones[i])
        for zone, members in zones.items():
            if len({stone.course for stone in members}) > 1 and len(members) >= ENOUGH:
                plumb_walls.append(_wall(members, facade, zone, displacement, battered))
    return tuple(plumb_walls)


def _wall(
    stones: Sequence[StoneQuality],
    facade: Facade,
    zone: str | None,
    displacement: Displacement,
    battered: bool,
) -> PlumbMovement:
    outward = facade.frame.axes[2] * [1.0, 1.0, 0.0]
    outward = outward / np.linalg.norm(outward)
    centres = np.array([stone.outline.mean(axis=0) for stone in stones])
    moves = [displacement(stone.code, centre[None])[0] for stone, centre in zip(stones, centres, strict=True)]
    measured, simulated = (centres - facade.frame.origin) @ outward, np.array(moves) @ outward
    course, number = np.unique([stone.course or 0 for stone in stones], return_inverse=True)
    count = np.bincount(number)
    # of a course of one stone that of its plane
    sigma = max(_within(measured, number, count), float(np.mean([stone.offset_sigma for stone in stones])))
    height = centres[:, 2] - centres[:, 2].mean()
    free = np.column_stack([np.ones(len(stones)), height] if battered else [np.ones(len(stones))])
    rest, still = (
        np.bincount(number, values - free @ np.linalg.lstsq(free, values, rcond=None)[0]) / count
        for values in (measured - simulated, measured)
    )
    dof = max(len(course) - free.shape[1], 0)
    misfit = Misfit(float(count @ rest**2) / sigma**2, float(count @ still**2) / sigma**2, dof)
    a, b = measured - measured.mean(), simulated - simulated.mean()
    means = [np.bincount(number, values) / count for values in (a, b)]
    courses = {
        int(name): StoneMovement(float(means[0][k]), float(means[1][k]), sigma / math.sqrt(float(count[k])))
        for k, name in enumerate(course)
    }
    each = {stone.code: StoneMovement(float(a[k]), float(b[k]), sigma) for k, stone in enumerate(stones)}
    return PlumbMovement(facade.name, zone, misfit, courses, each)


def _within(values: Array, number: NDArray[np.intp], count: NDArray[np.intp]) -> float:
    """Return the standard deviation of values (n,) about the mean of their course."""
    means = np.bincount(number, values) / count
    return math.sqrt(float(((values - means[number]) ** 2).sum()) / max(len(values) - len(count), 1))
