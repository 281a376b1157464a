"""Deformation of courses: how far their bed lines are from level and from straight, and how well that is known.

The bed line of a course is drawn through the lower corners of its stones: z against the distance s along the
facade. A corner differs from it by the height of its own stone's bed, alike for the corners of one stone, and
by an error of its own:

    z_ij = a + b s_ij (+ c s_ij²) + u_i + e_ij,    var u = τ²,    var e = κ² σ_ij².

The corners of one stone are therefore not independent witnesses of the course, and least squares that took
them so would promise too much by up to √2. κ, at least 1, comes from the differences between corners of one
stone; τ from the stones' means by the rule of Paule & Mandel (1982; DerSimonian & Kacker 2007): that value for
which Σ residual² / variance is the redundancy. Slope and sag are tested with Student's t and the number of
stones, not of corners. Courses of fewer than five stones borrow κ and τ from the others.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from survey.facades import Facade
from survey.quality import StoneQuality
from survey.walls import WallPlane

__all__ = [
    "ENOUGH",
    "SIGNIFICANT",
    "CourseHeight",
    "CourseLine",
    "course_heights",
    "lower_corners",
    "measure_courses",
]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

ENOUGH = 5
"""Stones from which the scatter of a course's beds can be estimated: with fewer, τ is uncertain by half."""

SIGNIFICANT = 0.01
"""A slope or sag that chance would exceed less often than this is called one."""

_LEVEL = math.tan(math.radians(30.0))  # a lower side steeper than this is a worn or bevelled corner, no bed


@dataclass(frozen=True)
class CourseLine:
    """The bed line of one course on one facade.

    Attributes
    ----------
    facade, zone, course : where it is
    stones : codes of its stones that have a bed, in order along the wall
    codes : (n,) stone of each corner
    along : (n,) place of each corner along the facade, to the right of the viewer [m]
    height : (n,) its z [m]
    sigma : (n,) standard deviation of its z as measured [m]
    left_out : worn corners that do not count
    middle : half-way between the ends, along the facade [m]
    level : z of the line there [m]; it and `slope` have the covariance
    slope : rise to the right over length [-]; None if one corner alone is left
    covariance : (2, 2) of level [m] and slope [-]
    slope_probability : that chance alone makes such a slope in a level course; None if the scatter of beds is
        not known
    sag : height of mid-span above the chord of the best parabola, negative where it sags [m]; None with fewer
        than five stones
    sag_sigma : its standard deviation [m]
    sag_probability : that chance alone makes such a sag in a straight course
    deviations : (n,) of the corners from the straight line, upwards [m]
    rms : of the deviations [m]
    scatter : τ, standard deviation of a stone's bed about the line [m]
    roughness : κ, how much more than measured the corners of one stone scatter [-]
    evidence : where τ and κ come from: "own", "other courses", or "none" if both are unknown
    """

    facade: str
    zone: str | None
    course: int
    stones: tuple[str, ...]
    codes: tuple[str, ...]
    along: Array
    height: Array
    sigma: Array
    left_out: int
    middle: float
    level: float
    slope: float | None
    covariance: Array
    slope_probability: float | None
    sag: float | None
    sag_sigma: float | None
    sag_probability: float | None
    deviations: Array
    rms: float
    scatter: float
    roughness: float
    evidence: str

    @property
    def slope_sigma(self) -> float | None:
        """Standard deviation of the slope [-]."""
        return None if self.slope is None else math.sqrt(self.covariance[1, 1])

    @property
    def span(self) -> float:
        """Distance of its first from its last corner [m]."""
        return float(self.along[-1] - self.along[0])

    @property
    def worst(self) -> tuple[str, float]:
        """Stone with the corner farthest from the line, and how far that is [m]."""
        i = int(np.abs(self.deviations).argmax())
        return self.codes[i], float(self.deviations[i])

    @property
    def finding(self) -> str:
        """What the numbers mean, in words."""
        if self.slope is None:
            return "not determined: one corner is left"
        if self.slope_probability is None:
            return "not tested: too few stones to know the scatter of beds"
        said = []
        if self.slope_probability < SIGNIFICANT:
            said.append(f"{'rises' if self.slope > 0.0 else 'falls'} to the right")
        if self.sag is not None and self.sag_probability is not None and self.sag_probability < SIGNIFICANT:
            said.append("hogs" if self.sag > 0.0 else "sags")
        return " and ".join(said) or ("level and straight" if self.sag is not None else "level")


@dataclass(frozen=True)
class CourseHeight:
    """From the bed of a course to that of the next.

    Attributes
    ----------
    facade, zone, course : of the lower course
    along : where along the facade it is taken: the middle of what the two courses share [m]
    height : with its bed joint [m]
    sigma : standard deviation [m]
    """

    facade: str
    zone: str | None
    course: int
    along: float
    height: float
    sigma: float


@dataclass(frozen=True)
class _Bed:
    """Lower corners of a course, sorted along the wall; `stone` numbers the stones from 0."""

    facade: str
    zone: str | None
    course: int
    codes: tuple[str, ...]
    stone: Rows
    along: Array
    height: Array
    sigma: Array
    left_out: int

    @property
    def count(self) -> int:
        """How many stones."""
        return int(self.stone.max()) + 1


@dataclass(frozen=True)
class _Scatter:
    tau: float
    kappa: float
    freedom: int


def measure_courses(stones: Sequence[StoneQuality], facades: Iterable[Facade]) -> tuple[CourseLine, ...]:
    """Fit the bed line of every course of every standing facade.

    Parameters
    ----------
    stones : all stones of the survey
    facades : which stones face one way; level ones have no bed lines

    Returns
    -------
    One line per facade, zone and course that has any sound lower corner, in that order
    """
    beds = [bed for facade in facades if facade.azimuth is not None for bed in _beds(stones, facade)]
    own = {k: _scatter(bed, 2) for k, bed in enumerate(beds) if bed.count >= ENOUGH}
    pooled = _pool(list(own.values()))
    return tuple(_line(bed, own.get(k), pooled) for k, bed in enumerate(beds))


def course_heights(lines: Sequence[CourseLine]) -> tuple[CourseHeight, ...]:
    """Height of every course whose next one lies above part of it."""
    found = []
    by_place = {(line.facade, line.zone, line.course): line for line in lines}
    for (facade, zone, course), line in by_place.items():
        above = by_place.get((facade, zone, course + 1))
        if above is None or line.slope is None or above.slope is None:
            continue
        left, right = max(line.along[0], above.along[0]), min(line.along[-1], above.along[-1])
        if left >= right:
            continue
        place = float(left + right) / 2.0
        (low, low_variance), (high, high_variance) = (_at(one, place) for one in (line, above))
        sigma = math.sqrt(low_variance + high_variance)
        found.append(CourseHeight(facade, zone, course, place, high - low, sigma))
    return tuple(found)


def lower_corners(outline: Array, frame: WallPlane) -> list[int]:
    """Indices of the corners of a face on which it is bedded: the ends of its lower, nearly level sides.

    Parameters
    ----------
    outline : (nv, 3) counter-clockwise seen from outside [m]
    frame : elevation of the facade
    """
    flat = frame.flatten(outline)
    run = np.roll(flat, -1, axis=0) - flat
    # counter-clockwise, the lower sides run to the right
    bedded = (run[:, 0] > 0.0) & (np.abs(run[:, 1]) <= _LEVEL * run[:, 0])
    return sorted({k for i in np.flatnonzero(bedded).tolist() for k in (i, (i + 1) % len(flat))})


def _beds(stones: Sequence[StoneQuality], facade: Facade) -> list[_Bed]:
    """Lower corners of a facade, by zone and course."""
    groups: dict[tuple[str, int], list[StoneQuality]] = {}
    for i in facade.members.tolist():
        course = stones[i].course
        if course is not None:
            groups.setdefault((stones[i].zone or "", course), []).append(stones[i])
    beds = [_bed(groups[key], facade) for key in sorted(groups)]
    return [bed for bed in beds if bed is not None]


def _bed(stones: Sequence[StoneQuality], facade: Facade) -> _Bed | None:
    codes: list[str] = []
    parts: list[Array] = []
    left_out = 0
    for stone in stones:
        lower = lower_corners(stone.outline, facade.frame)
        sound = [k for k in lower if k not in stone.worn_corners]
        left_out += len(lower) - len(sound)
        along = (stone.outline[sound] - facade.frame.origin) @ facade.frame.axes[0]
        parts.append(np.column_stack([along, stone.outline[sound, 2], stone.corner_sigma[sound, 2]]))
        codes += [stone.code] * len(sound)
    if not codes:
        return None
    table = np.concatenate(parts)
    order = np.argsort(table[:, 0], kind="stable")
    names = [codes[i] for i in order.tolist()]
    number = {code: k for k, code in enumerate(dict.fromkeys(names))}
    course = stones[0].course
    assert course is not None
    numbers = np.array([number[code] for code in names], dtype=np.intp)
    along, height, sigma = (np.ascontiguousarray(column) for column in table[order].T)
    return _Bed(facade.name, stones[0].zone, course, tuple(names), numbers, along, height, sigma, left_out)


def _design(bed: _Bed, parameters: int) -> Array:
    """Powers of the distance from the middle."""
    return (bed.along - _middle(bed))[:, None] ** np.arange(parameters)


def _middle(bed: _Bed) -> float:
    return float(bed.along[0] + bed.along[-1]) / 2.0


def _by_stone(bed: _Bed, columns: Array) -> Array:
    """Sums over the corners of each stone, (m, k)."""
    return np.array([np.bincount(bed.stone, column) for column in columns.T]).T


def _scatter(bed: _Bed, parameters: int) -> _Scatter:
    """τ and κ of one course from its own stones."""
    weights = 1.0 / bed.sigma**2
    design, total = _design(bed, parameters), _by_stone(bed, weights[:, None])
    low = float(bed.height.min())
    rows = np.column_stack([design, bed.height - low])
    means = _by_stone(bed, weights[:, None] * rows) / total
    within = rows - means[bed.stone]
    freedom = len(bed.along) - bed.count
    line = _solve(means, np.full(bed.count, 1.0))
    squares = float(weights @ (within @ np.append(-line, 1.0)) ** 2)
    kappa = max(1.0, math.sqrt(squares / freedom)) if freedom >= ENOUGH else 1.0
    variances = kappa**2 / total[:, 0]
    return _Scatter(_paule_mandel(means, variances), kappa, bed.count - parameters)


def _solve(rows: Array, weights: Array) -> Array:
    root = np.sqrt(weights)[:, None]
    solution = np.linalg.lstsq(root * rows[:, :-1], root[:, 0] * rows[:, -1], rcond=None)[0]
    return np.asarray(solution, dtype=np.float64)


def _paule_mandel(rows: Array, variances: Array) -> float:
    """τ for which Σ residual² / (variance + τ²) is the redundancy; 0 if the variances explain all."""
    redundancy = rows.shape[0] - (rows.shape[1] - 1)

    def excess(square: float) -> float:
        weights = 1.0 / (variances + square)
        residuals: Array = rows @ np.append(-_solve(rows, weights), 1.0)
        return float(np.sum(weights * residuals**2)) - redundancy

    if redundancy <= 0 or excess(0.0) <= 0.0:
        return 0.0
    high = float(np.ptp(rows[:, -1])) ** 2 + float(variances.max())
    while excess(high) > 0.0:
        high *= 4.0
    low = 0.0
    for _ in range(60):
        middle = (low + high) / 2.0
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
        if high - low < 1e-6 * high:
            break
    return math.sqrt(high)


def _pool(scatters: Sequence[_Scatter]) -> _Scatter | None:
    """What courses of few stones borrow: the root mean squares of those that have enough."""
    freedom = sum(one.freedom for one in scatters)
    if not freedom:
        return None
    tau = math.sqrt(sum(one.freedom * one.tau**2 for one in scatters) / freedom)
    kappa = math.sqrt(sum(one.freedom * one.kappa**2 for one in scatters) / freedom)
    return _Scatter(tau, kappa, freedom)


def _fit(bed: _Bed, scatter: _Scatter, parameters: int) -> tuple[Array, Array]:
    """Generalised least squares, C = κ²σ² + τ² 1 1ᵀ of each stone, inverted by Sherman and Morrison."""
    weights = 1.0 / (scatter.kappa * bed.sigma) ** 2
    rows = np.column_stack([_design(bed, parameters), bed.height - bed.height.min()])
    sums = _by_stone(bed, weights[:, None] * rows)
    shared = scatter.tau**2 / (1.0 + scatter.tau**2 * _by_stone(bed, weights[:, None])[:, 0])
    normal = rows.T @ (weights[:, None] * rows) - sums.T @ (shared[:, None] * sums)
    covariance: Array = np.linalg.inv(normal[:-1, :-1])
    values = covariance @ normal[:-1, -1]
    values[0] += bed.height.min()
    return values, covariance


def _line(bed: _Bed, own: _Scatter | None, pooled: _Scatter | None) -> CourseLine:
    evidence = "own" if own else "other courses" if pooled else "none"
    scatter = own or pooled or _Scatter(0.0, 1.0, 0)
    sloped = bed.along[-1] > bed.along[0]
    values, covariance = _fit(bed, scatter, 2 if sloped else 1)
    slope = float(values[1]) if sloped else None
    if not sloped:
        covariance = np.array([[covariance[0, 0], 0.0], [0.0, math.nan]])
    deviations = bed.height - values[0] - (slope or 0.0) * (bed.along - _middle(bed))
    sag = _sag(bed) if own and sloped else (None, None, None)
    return CourseLine(
        facade=bed.facade,
        zone=bed.zone,
        course=bed.course,
        stones=tuple(dict.fromkeys(bed.codes)),
        codes=bed.codes,
        along=bed.along,
        height=bed.height,
        sigma=bed.sigma,
        left_out=bed.left_out,
        middle=_middle(bed),
        level=float(values[0]),
        slope=slope,
        covariance=covariance,
        slope_probability=_chance(slope, math.sqrt(covariance[1, 1]), scatter.freedom)
        if slope is not None
        else None,
        sag=sag[0],
        sag_sigma=sag[1],
        sag_probability=sag[2],
        deviations=deviations,
        rms=math.sqrt(float((deviations**2).mean())),
        scatter=scatter.tau,
        roughness=scatter.kappa,
        evidence=evidence,
    )


def _sag(bed: _Bed) -> tuple[float, float, float | None]:
    """Height of mid-span above the chord of the best parabola, -c (L/2)², its sigma and probability."""
    scatter = _scatter(bed, 3)
    values, covariance = _fit(bed, scatter, 3)
    lever = -(((bed.along[-1] - bed.along[0]) / 2.0) ** 2)
    sag, sigma = float(lever * values[2]), float(-lever * math.sqrt(covariance[2, 2]))
    return sag, sigma, _chance(sag, sigma, scatter.freedom)


def _chance(value: float, sigma: float, freedom: int) -> float | None:
    """Two-sided probability of Student's t."""
    return float(2.0 * stdtr(freedom, -abs(value) / sigma)) if freedom > 0 else None


def _at(line: CourseLine, place: float) -> tuple[float, float]:
    """Height of a line at a place along the facade, and its variance."""
    row = np.array([1.0, place - line.middle])
    return line.level + (line.slope or 0.0) * row[1], float(row @ line.covariance @ row)
