"""Movement of a wall as its beds show it: courses tested together, piecewise, with the power of the test.

Each course was laid at one height, which is not known; what its stones depart from it is movement, as far as courses
share it, and scatter of beds and measurement otherwise. Of every wall these shapes are tried, each in the courses from
the lowest up to any, from any up to the highest, and in each course alone: a tilt, a sag or hog, a step at any head
joint or opening, a part between two of them, and an end that falls or rises away (`survey.quality.departures.shapes`).

The scatter τ of beds comes from differences between neighbours in a course, of which the few at a crack are outliers,
so that no movement hides itself as scatter; then from what the movements leave, which holds slow waves of beds too.
"""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from ground.statistics.roots import root_of
from ground.statistics.scale import OUTLIER, WITHIN, scatter_beyond
from survey.arrays import Array
from survey.conventions import FINEST, GROUP, LEAST, MOST, PLACES, SAMPLE, SIGNIFICANT
from survey.quality.courses import CourseLine, measure_courses, with_scatter
from survey.quality.departures.shapes import (
    LIKELY,
    Found,
    Run,
    Sample,
    Shape,
    critical,
    fit_shapes,
    millimetres,
    powers,
)
from survey.quality.facades import Facade
from survey.quality.precision import StoneQuality

CHANCE = 0.003
"""Probability that the beds of a survey without any movement are given one."""


_CLOSE = MOST  # of the median length of a stone: distance of two such places
_REACH = 1.2  # of the median length of a stone: distance from the step at which a course may be broken
_MIN_STONES_BESIDE = (
    GROUP  # stones on either side of a step or an edge; fewer are odd stones, not a part of the wall
)
_PER_DIFFERENCE = (
    0.45  # degrees of freedom that a difference of neighbours gives: each stone is in two of them
)
_PER_RESIDUAL = (
    0.8  # degrees of freedom that a residual gives: the variance of a clipped normal variable is less known
)
_ENOUGH = SAMPLE  # differences from which a wall's own scatter is estimated; fewer take that of the survey
_EXCLUDES = (
    SIGNIFICANT  # standard deviations by which a course differs from a movement that it has not taken part in
)
_SIMPLEST_FIRST = (("tilt",), ("sag",), ("step",), ("left end", "right end"), ("part",))
_RANKS = {name: rank for rank, names in enumerate(_SIMPLEST_FIRST) for name in names}


class BedKind(StrEnum):
    """Families of movement that beds show."""

    TILT = "tilt"
    SAG = "sag"
    STEP = "step"
    LEFT_END = "left end"
    RIGHT_END = "right end"
    PART = "part"


@dataclass(frozen=True)
class BedMovement:
    """A movement that the courses of a wall share.

    Attributes
    ----------
    facade, zone : wall
    kind : its family
    first, last : courses that have it
    left, right : extent of what moved against the rest, along the facade [m]
    amount, sigma : upwards: rise to the right over the wall, height of mid-span over the chord (negative where it
        sags), height of the right over the left side, of the end, or of the part over the rest [m]
    probability : that as much is found anywhere in a wall that has not moved
    courses : amount and standard deviation of every course that tells by itself, also of those that have it not [m]
    chi2, dof : disagreement of the courses that have it
    older_than : course that was laid level above it; None if none is known
    above, above_sigma : amount in the courses from there on [m]; None without any
    stones : codes of the stones that moved against the rest
    """

    facade: str
    zone: str | None
    kind: BedKind
    first: int
    last: int
    left: float
    right: float
    amount: float
    sigma: float
    probability: float
    courses: Mapping[int, tuple[float, float]]
    chi2: float
    dof: int
    older_than: int | None
    above: float | None
    above_sigma: float | None
    stones: tuple[str, ...]

    @property
    def text(self) -> str:
        """The movement in a sentence."""
        size = millimetres(self.amount, self.sigma)
        down = self.amount < 0.0
        where = f"from {self.left:z.2f} to {self.right:z.2f} m"
        what = {
            "tilt": f"it {'falls' if down else 'rises'} to the right by {size} over its length",
            "sag": f"it {'sags' if down else 'hogs'} by {size} at mid-span",
            "step": f"settlement: its {'right' if down else 'left'} part, {where}, lies {size} lower",
            "left end": f"its left end, {where}, {'falls' if down else 'rises'} away by {size}",
            "right end": f"its right end, {where}, {'falls' if down else 'rises'} away by {size}",
            "part": (
                f"settlement: the part {where} lies {size} lower than both sides"
                if down
                else f"settlement: both sides of the part {where} lie {size} lower than it"
            ),
        }[self.kind]
        return f"{what}, in {self._courses}"

    def lift(self, along: Array, ends: tuple[float, float]) -> Array:
        """Return the movement upwards at places along the wall.

        Parameters
        ----------
        along : (n,) places [m]
        ends : of the wall [m]
        """
        share = (along - ends[0]) / max(ends[1] - ends[0], 1e-9)
        inside = (along >= self.left) & (along <= self.right)
        reach = max(self.right - self.left, 1e-9)
        lifted = {
            "tilt": self.amount * share,
            "sag": self.amount * (1.0 - (2.0 * share - 1.0) ** 2),
            "step": -abs(self.amount) * inside,
            "part": self.amount * inside,
            "left end": self.amount * np.clip((self.right - along) / reach, 0.0, 1.0),
            "right end": self.amount * np.clip((along - self.left) / reach, 0.0, 1.0),
        }[self.kind]
        return np.asarray(lifted, dtype=np.float64)

    @property
    def dating(self) -> str:
        """Its age beside the courses."""
        if self.first == self.last and self.dof == 0 and len(self.courses) > 1 and self.older_than is None:
            return "in one course alone: laid so, rather than moved"
        if self.older_than is not None and self.above is not None and self.above_sigma is not None:
            return (
                f"older than course {self.older_than}, which was laid level above it: "
                f"{self.above * 1e3:+z.1f} ± {self.above_sigma * 1e3:.1f} mm from there on"
            )
        return "no course above tells its age"

    @property
    def _courses(self) -> str:
        numbers = [number for number in self.courses if self.first <= number <= self.last]
        if len(numbers) < 2:
            return f"course {self.first}"
        agree = self.chi2 <= self.dof + 3.0 * math.sqrt(2.0 * self.dof)
        return f"{len(numbers)} courses ({self.first} to {self.last}), which {'agree' if agree else 'differ'}"


@dataclass(frozen=True)
class OddBed:
    """A stone whose bed lies off those of its neighbours on both sides.

    Attributes
    ----------
    code, line : of the stone
    amount, sigma : upwards [m]
    """

    code: str
    line: int
    amount: float
    sigma: float

    @property
    def text(self) -> str:
        """The departure in words."""
        size = millimetres(self.amount, self.sigma, 0)
        return f"its bed lies {size} {'above' if self.amount > 0.0 else 'below'} those of its neighbours"


@dataclass(frozen=True)
class WallBeds:
    """Findings about the beds of a wall.

    Attributes
    ----------
    facade, zone : wall
    courses : those that were tested
    scatter : τ, standard deviation of a stone's bed [m]
    freedom : degrees of freedom of the scatter
    movements : found, the most significant first
    odd : stones whose beds lie off those of their neighbours
    excluded : smallest amount of a settlement of part of the wall, common to all courses, that would have been found
        in 95 of 100 surveys [m]; None if nothing could be tested
    excluded_in : the same of a course by itself [m]
    """

    facade: str
    zone: str | None
    courses: tuple[int, ...]
    scatter: float
    freedom: float
    movements: tuple[BedMovement, ...]
    odd: tuple[OddBed, ...]
    excluded: float | None
    excluded_in: Mapping[int, float]

    def finding(self, course: int) -> str:
        """Verdict on one course."""
        movements = [movement for movement in self.movements if movement.first <= course <= movement.last]
        if movements:
            return "; ".join(self._in_course(movement, course) for movement in movements)
        bound = self.excluded_in.get(course)
        if bound is None:
            return "not tested: too few stones"
        dated = [
            movement
            for movement in self.movements
            if movement.older_than is not None and course >= movement.older_than
        ]
        level = "laid level above older movement; " if dated else ""
        return f"{level}no movement found; more than {bound * 1e3:.0f} mm is excluded"

    @staticmethod
    def _in_course(movement: BedMovement, course: int) -> str:
        amount = movement.courses.get(course)
        size = "" if amount is None else f" {amount[0] * 1e3:+z.1f} ± {amount[1] * 1e3:.1f} mm"
        words = {"sag": "sags" if movement.amount < 0.0 else "hogs", "step": "settled", "part": "settled"}
        return f"{words.get(movement.kind, movement.kind)}{size}"


@dataclass(frozen=True)
class _Beds:
    """Beds of the stones of a wall, sorted by course and along it; one row per stone."""

    codes: tuple[str, ...]
    course: NDArray[np.intp]
    numbers: tuple[int, ...]
    along: Array
    height: Array
    measured: Array
    tilt: float


def find_bed_movements(
    lines: Sequence[CourseLine],
    lengths: Mapping[str, float],
    alpha: float,
    rows: Mapping[str, int] | None = None,
) -> tuple[WallBeds, ...]:
    """Find the movements of all walls of a survey.

    Parameters
    ----------
    lines : bed lines of its courses
    lengths : of the stones' faces, by code [m]
    alpha : probability that a survey without any movement is given one
    rows : line of the survey file of each stone, by code

    Returns
    -------
    One for each facade and zone, in the order of the lines
    """
    walls: dict[tuple[str, str | None], list[CourseLine]] = defaultdict(list)
    for line in lines:
        walls[line.facade, line.zone].append(line)
    beds = {key: _beds(lines) for key, lines in walls.items()}
    together = _scatter(list(beds.values()))
    share = alpha / max(len(walls), 1)
    found = []
    for (facade, zone), bed in beds.items():
        wall_scatter = _scatter([bed])
        scatter = wall_scatter if wall_scatter[2] >= _ENOUGH else together
        found.append(_wall(facade, zone, bed, scatter, lengths, share, rows or {}))
    return tuple(found)


def measure_beds(
    stones: Sequence[StoneQuality], facades: Iterable[Facade]
) -> tuple[tuple[CourseLine, ...], tuple[WallBeds, ...]]:
    """Return the bed lines of a survey and the movements of its walls, both with one scatter of beds.

    Parameters
    ----------
    stones, facades : as of `measure_courses`
    """
    lines = measure_courses(stones, facades)
    lengths, rows = (
        {stone.code: stone.length for stone in stones},
        {stone.code: stone.line for stone in stones},
    )
    walls = find_bed_movements(lines, lengths, CHANCE, rows)
    return with_scatter(
        lines, {(wall.facade, wall.zone): (wall.scatter, wall.freedom) for wall in walls}
    ), walls


def _beds(lines: Sequence[CourseLine]) -> _Beds:
    codes: list[str] = []
    table: list[tuple[int, float, float, float]] = []
    for k, line in enumerate(sorted(lines, key=lambda line: line.course)):
        corners: dict[str, list[int]] = defaultdict(list)
        for i, code in enumerate(line.codes):
            corners[code].append(i)
        own = sorted(corners, key=lambda code: float(line.along[corners[code]].mean()))
        for code in own:
            places = corners[code]
            variance = max(float((line.sigma[places] ** 2).sum()) / len(places) ** 2, FINEST**2)
            codes.append(code)
            table.append((k, float(line.along[places].mean()), float(line.height[places].mean()), variance))
    course, along, height, measured = (np.array(column) for column in zip(*table, strict=True))
    numbers = tuple(sorted(line.course for line in lines))
    tilt = max(line.frame_sigma for line in lines)
    return _Beds(tuple(codes), course.astype(np.intp), numbers, along, height - height.mean(), measured, tilt)


def _scatter(walls: Sequence[_Beds]) -> tuple[float, float, int]:
    """Return τ [m], its degrees of freedom, and the number of differences it comes from."""
    differences, variances = [], []
    for beds in walls:
        for k in range(len(beds.numbers)):
            members = np.flatnonzero(beds.course == k)
            step = np.diff(beds.height[members])
            if len(step) >= 3:
                # without the slope of the course, which takes one difference
                step = (step - np.median(step)) * math.sqrt(len(step) / (len(step) - 1.0))
            differences.append(step)
            variances.append(beds.measured[members][1:] + beds.measured[members][:-1])
    step = np.concatenate([np.zeros(0), *differences])
    tau, count = scatter_beyond(step, np.concatenate([np.zeros(0), *variances]), 2.0)
    return tau, max(_PER_DIFFERENCE * count, 1.0) if count else 0.0, count


def _wall(
    facade: str,
    zone: str | None,
    beds: _Beds,
    scatter: tuple[float, float, int],
    lengths: Mapping[str, float],
    alpha: float,
    rows: Mapping[str, int],
) -> WallBeds:
    tau, freedom, _ = scatter
    if freedom <= 0.0 or len(beds.codes) < 2 * 2:
        return WallBeds(facade, zone, beds.numbers, tau, freedom, (), (), None, {})
    variance = beds.measured + tau**2
    odd = _odd_beds(beds, variance, lengths, critical(alpha / 3.0, len(beds.codes), freedom), rows)
    usual = ~np.isin(beds.codes, [one.code for one in odd])
    sound = _kept(beds, usual)
    if len(sound.codes) < 4:
        return WallBeds(facade, zone, beds.numbers, tau, freedom, (), odd, None, {})
    length = float(np.median([lengths.get(code, 0.5) for code in sound.codes]))
    middle = 0.5 * float(sound.along.min() + sound.along.max())
    sample = Sample(
        sound.height,
        variance[usual],
        sound.along,
        np.zeros(len(sound.codes)),
        sound.course,
        np.ones((len(sound.codes), 1)),
        sound.tilt * (sound.along - middle),
        freedom,
    )
    shapes, fields = _shapes(sample, length)
    runs = _runs(len(sound.numbers))

    def follow(sample: Sample, fit: Found) -> Found:
        """Extend a fitted shape over the courses that it moves."""
        if fit.shape.name.endswith("end"):
            return _hinged(sample, fit, length)
        return _extended(sample, _follow(sample, fit, fit.run, length), length)

    first, _ = fit_shapes(sample, shapes, fields, runs, 2.0 * alpha / 3.0, follow)
    # what the first movements leave tells the scatter better than neighbours do, and holds slow waves of beds too
    tau, freedom = _left(sample, sound.measured, first, tau, freedom)
    sample = replace(sample, variance=sound.measured + tau**2, freedom=freedom)
    movements, limit = fit_shapes(sample, shapes, fields, runs, 2.0 * alpha / 3.0, follow)
    told = tuple(_told(facade, zone, sound, sample, movement) for movement in movements)
    bounds = _bounds(sample, shapes, fields, limit, [*((k, k) for k in range(len(sound.numbers))), runs[-1]])
    single = {
        number: bound for number, bound in zip(sound.numbers, bounds, strict=False) if bound is not None
    }
    return WallBeds(facade, zone, beds.numbers, tau, freedom, told, odd, bounds[-1], single)


def _left(
    sample: Sample, measured: Array, fits: Sequence[Found], tau: float, freedom: float
) -> tuple[float, float]:
    """Return τ and its degrees of freedom from what movements leave; those before where few stones are left."""
    rest = sample.values - sum((fit.amount * fit.field for fit in fits), np.zeros(len(sample.values)))
    counts = np.bincount(sample.group)
    free = len(rest) - sample.groups - len(fits)
    means = np.bincount(sample.group, rest) / counts
    # a residual about the mean of its course has less variance than the bed
    share = (1.0 - 1.0 / counts)[sample.group]
    rest = rest - means[sample.group]
    if free < _ENOUGH:
        return tau, freedom
    inliers = (np.abs(rest) <= OUTLIER * np.sqrt(share * sample.variance)) & (share > 0.0)

    def excess(square: float) -> float:
        """Return the weighted sum of squares minus its expectation, for an added variance [m²]."""
        return float(
            (rest[inliers] ** 2 / (share[inliers] * (measured[inliers] + square))).sum()
        ) - WITHIN * int(inliers.sum())

    square = root_of(excess, float(np.ptp(rest)) ** 2)
    return math.sqrt(square), max(_PER_RESIDUAL * free, 1.0)


def _kept(beds: _Beds, mask: NDArray[np.bool_]) -> _Beds:
    """Return the beds of some stones, and the courses that are left."""
    left, course = np.unique(beds.course[mask], return_inverse=True)
    codes = tuple(code for code, one in zip(beds.codes, mask, strict=True) if one)
    numbers = tuple(beds.numbers[k] for k in left.tolist())
    return _Beds(codes, course, numbers, beds.along[mask], beds.height[mask], beds.measured[mask], beds.tilt)


def _odd_beds(
    beds: _Beds, variance: Array, lengths: Mapping[str, float], limit: float, rows: Mapping[str, int]
) -> tuple[OddBed, ...]:
    """Return the stones whose beds lie off two neighbours on each side, alone: no stone above or below does as well."""
    amount, sigma = np.zeros(len(beds.codes)), np.ones(len(beds.codes))
    for k in range(len(beds.numbers)):
        members = np.flatnonzero(beds.course == k)
        if len(members) < 5:
            continue
        height, square = beds.height[members], variance[members]
        for i in range(len(members)):
            sides = [s for s in (slice(max(i - 2, 0), i), slice(i + 1, i + 3)) if len(height[s])]
            gaps = [
                (height[i] - height[s].mean(), square[i] + square[s].sum() / len(height[s]) ** 2)
                for s in sides
            ]
            if len({gap > 0.0 for gap, _ in gaps}) == 1:
                gap, both = min(gaps, key=lambda gap: abs(gap[0]) / math.sqrt(gap[1]))
                amount[members[i]], sigma[members[i]] = gap, math.sqrt(both)
    strange = np.flatnonzero(np.abs(amount) > np.maximum(limit * sigma, LEAST))
    odd = []
    for i in strange.tolist():
        near = (np.abs(beds.along - beds.along[i]) < 0.75 * lengths.get(beds.codes[i], 0.5)) & (
            np.abs(beds.course - beds.course[i]) == 1
        )
        if not (near & (amount * np.sign(amount[i]) > 0.5 * abs(amount[i]))).any():
            code = beds.codes[i]
            odd.append(OddBed(code, rows.get(code, 0), float(amount[i]), float(sigma[i])))
    return tuple(sorted(odd, key=lambda bed: -abs(bed.amount) / bed.sigma))


def _runs(courses: int) -> list[Run]:
    """List the courses in which a movement may be: alone, from the lowest, up to the highest, all of them last."""
    single = [(k, k) for k in range(courses)]
    lower = [(0, k) for k in range(1, courses - 1)]
    upper = [(k, courses - 1) for k in range(1, courses - 1)]
    return [*single, *upper, *lower, *([(0, courses - 1)] if courses > 1 else [])]


def _shapes(sample: Sample, length: float) -> tuple[list[Shape], Array]:
    """Return the shapes of a wall, and their values at its stones (n, m)."""
    along = sample.along
    left, right = float(along.min()), float(along.max())
    span = max(right - left, 1e-9)
    share = (along - left) / span
    named: list[tuple[str, tuple[float, ...], Array]] = [
        ("tilt", (left, right), share),
        ("sag", (left, right), 1.0 - (2.0 * share - 1.0) ** 2),
    ]
    places = _places(sample, length)
    for place in places:
        beyond = along > place
        named.append(("step", (place,), beyond.astype(float)))
        named.append(("right end", (place,), np.maximum(along - place, 0.0) / (right - place)))
        named.append(("left end", (place,), np.maximum(place - along, 0.0) / (place - left)))
    for i, start in enumerate(places):
        named += [
            ("part", (start, stop), ((along > start) & (along < stop)).astype(float))
            for stop in places[i + 1 :]
            if stop - start >= 0.9 * length
        ]
    fewest = min(_MIN_STONES_BESIDE, max(1, len(along) // 4))
    supported = [
        shape
        for shape in named
        if shape[0] in ("tilt", "sag") or fewest <= int((shape[2] != 0.0).sum()) <= len(along) - fewest
    ]
    shapes = [Shape(name, at, _RANKS[name]) for name, at, _ in supported]
    return shapes, np.column_stack([field for *_, field in supported])


def _places(sample: Sample, length: float) -> list[float]:
    """Return where a step can be: the middles between neighbours in a course, not closer than half a stone."""
    middles = []
    for k in range(sample.groups):
        ordered = np.sort(sample.along[sample.group == k])
        middles.append((ordered[1:] + ordered[:-1]) / 2.0)
    every = np.sort(np.concatenate(middles)) if middles else np.zeros(0)
    if len(every) == 0:
        return []
    close = max(_CLOSE * length, float(np.ptp(every)) / PLACES)
    places: list[float] = []
    for start in every.tolist():
        if places and start < places[-1] + close:
            continue
        places.append(start)
    return places


def _hinged(sample: Sample, fit: Found, length: float) -> Found:
    """Move the place from which an end falls away to where it fits best."""
    left, right = float(sample.along.min()), float(sample.along.max())
    inside = (sample.group >= fit.run[0]) & (sample.group <= fit.run[1])
    trials = []
    for place in fit.shape.places[0] + length * np.linspace(-0.6, 0.6, 13):
        rising = fit.shape.name == "right end"
        reach = right - place if rising else place - left
        if reach < length:
            continue
        field = (
            np.where(inside, np.maximum(sample.along - place if rising else place - sample.along, 0.0), 0.0)
            / reach
        )
        amount, sigma = _amount(sample, field, inside)
        trials.append(((amount / sigma) ** 2, field, amount, (float(place),)))
    if not trials:
        return fit
    _, field, amount, places = max(trials, key=lambda trial: trial[0])
    return replace(fit, field=field, amount=amount, shape=fit.shape._replace(places=places))


def _extended(sample: Sample, fit: Found, length: float) -> Found:
    """Add the courses next to a run which have the same step or part, their crack being a little farther off."""
    if fit.shape.name not in ("step", "part"):
        return fit
    for step in (1, -1):
        while 0 <= (k := fit.run[step == 1] + step) < sample.groups:
            members = sample.group == k
            start = _shape_field(fit.shape, sample.along)
            tried = replace(fit, field=np.where(members, start, fit.field))
            tried = _follow(sample, tried, (k, k), length)
            amount, sigma = _amount(sample, tried.field, members)
            if not abs(amount - fit.amount) < _EXCLUDES * sigma < abs(amount):
                break
            run = (fit.run[0], k) if step == 1 else (k, fit.run[1])
            fit = replace(tried, run=run)
    return fit


def _amount(sample: Sample, values: Array, own: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the amount of a shape in some courses and its σ; 0 and inf if they do not tell."""
    weights = np.where(own, 1.0 / sample.variance, 0.0)
    total = np.maximum(np.bincount(sample.group, weights), 1e-300)
    centred = values - (np.bincount(sample.group, weights * values) / total)[sample.group]
    square = float(weights @ centred**2)
    if square <= 1e-9 * float(weights.sum()):
        return 0.0, math.inf
    return float((weights * centred) @ sample.values) / square, 1.0 / math.sqrt(square)


def _shape_field(shape: Shape, along: Array) -> Array:
    """Return the values of a step or part."""
    values = along > shape.places[0]
    if shape.name == "part":
        values &= along < shape.places[1]
    return values.astype(float)


def _follow(sample: Sample, fit: Found, run: Run, length: float) -> Found:
    """Move the edges of a step or part in each course to the head joint that fits it best: cracks zigzag."""
    if fit.shape.name not in ("step", "part"):
        return fit
    field = fit.field.copy()
    for edge in fit.shape.places:
        for k in range(run[0], run[1] + 1):
            members = np.flatnonzero(sample.group == k)
            along = sample.along[members]
            order = np.argsort(along)
            members, along = members[order], along[order]
            gaps = (along[1:] + along[:-1]) / 2.0
            here = np.flatnonzero(np.abs(gaps - edge) <= _REACH * length)
            if len(here) < 2:
                continue
            rising = fit.shape.name == "step" or edge == fit.shape.places[0]
            trials = []
            for gap in here.tolist():
                trial = field[members].copy()
                close = np.abs(along - edge) <= (_REACH + 1.0) * length
                side = np.arange(len(members)) > gap
                trial[close] = (side if rising else ~side)[close]
                if fit.shape.name == "part":
                    trial[~close] = field[members][~close]
                rest = sample.values[members] - fit.amount * trial
                rest = rest - np.average(rest, weights=1.0 / sample.variance[members])
                trials.append((float((rest**2 / sample.variance[members]).sum()), trial))
            field[members] = min(trials, key=lambda trial: trial[0])[1]
    return replace(fit, field=field)


def _bounds(
    sample: Sample, shapes: Sequence[Shape], fields: Array, limit: float, runs: Sequence[Run]
) -> list[float | None]:
    """Return the smallest settlement of a part of the wall that would have been found, for each run of courses [m]."""
    wanted = [k for k, shape in enumerate(shapes) if shape.name in ("step", "sag", "tilt")]
    names = [shapes[k].name for k in wanted]
    bounds: list[float | None] = []
    for run in runs:
        sigma = powers(sample, fields[:, wanted], run)
        steps = np.array(
            [
                deviation
                for deviation, name in zip(sigma, names, strict=True)
                if name == "step" and np.isfinite(deviation)
            ]
        )
        others = [
            deviation
            for deviation, name in zip(sigma, names, strict=True)
            if name != "step" and np.isfinite(deviation)
        ]
        worst = [*others, *([float(np.median(steps))] if len(steps) else [])]
        bounds.append((limit + LIKELY) * max(worst) if worst and math.isfinite(limit) else None)
    return bounds


def _told(facade: str, zone: str | None, beds: _Beds, sample: Sample, fit: Found) -> BedMovement:
    low = fit.field < 0.5 if fit.shape.name == "step" and fit.amount > 0.0 else fit.field > 0.5
    inside = (sample.group >= fit.run[0]) & (sample.group <= fit.run[1])
    if fit.shape.name in ("tilt", "sag"):
        low = inside
    elif fit.shape.name in ("left end", "right end"):
        low = fit.field > 0.0
    moved = np.flatnonzero(low & inside)
    left, right = (
        (float(beds.along[moved].min()), float(beds.along[moved].max())) if len(moved) else (0.0, 0.0)
    )
    tested = np.flatnonzero(np.isfinite(fit.each[:, 0])).tolist()
    courses = {beds.numbers[k]: (float(fit.each[k, 0]), float(fit.each[k, 1])) for k in tested}
    older, above = _age(fit, tested)
    return BedMovement(
        facade=facade,
        zone=zone,
        kind=BedKind(fit.shape.name),
        first=beds.numbers[fit.run[0]],
        last=beds.numbers[fit.run[1]],
        left=left,
        right=right,
        amount=fit.amount,
        sigma=fit.sigma,
        probability=fit.probability,
        courses=courses,
        chi2=fit.chi2,
        dof=fit.dof,
        older_than=None if older is None else beds.numbers[older],
        above=None if above is None else above[0],
        above_sigma=None if above is None else above[1],
        stones=tuple(beds.codes[i] for i in moved.tolist()),
    )


def _age(fit: Found, tested: Sequence[int]) -> tuple[int | None, tuple[float, float] | None]:
    """Return the first course that was laid level above a movement, with the amount from there on; None if none is.

    The movement must reach down to the lowest course that tells, and the courses above must differ from it by three
    standard deviations and from none by less.
    """
    over = [k for k in tested if k > fit.run[1]]
    if not over or any(k < fit.run[0] for k in tested):
        return None, None
    weights = 1.0 / fit.each[over, 1] ** 2
    mean, sigma = float(weights @ fit.each[over, 0] / weights.sum()), 1.0 / math.sqrt(float(weights.sum()))
    level = abs(mean) < _EXCLUDES * sigma or abs(mean) < 0.2 * abs(fit.amount)
    if level and abs(mean - fit.amount) > _EXCLUDES * math.hypot(sigma, fit.sigma):
        return over[0], (mean, sigma)
    return None, None
