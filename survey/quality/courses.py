"""Deformation of courses: departure of their bed lines from level and from straight, with its uncertainty.

The bed line of a course is fitted to the lower corners of its stones: z against the distance s along the
facade. The corners of one stone are not independent, since its bed lies a little high or low as a whole; least squares
that ignored this would be overconfident by up to √2. So the beds' own scatter is estimated with the line
(`survey.quality.bed_fit`). Slope and sag have a probability by Student's t and the number of stones, not of corners.
Courses of fewer than five stones borrow the scatter of the others. Once the movements of a wall are known, all its
lines take the scatter that they leave (`with_scatter`). Whether a wall has moved is told by its courses
together (`survey.quality.departures.beds`).
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr

from survey.arrays import Array, Ints
from survey.conventions import BROKEN, CERTAIN, ENOUGH, ONE_WAY, SOME
from survey.quality.bed_fit import BedCorners, BedScatter, corner_roughness, fit_bed, pool, scatter_of
from survey.quality.facades import Facade, WallPlane
from survey.quality.precision import StoneQuality
from survey.quality.wedges import Side, lies_along, sides_of, spanning_stones

_BEVEL = BROKEN  # longest lower side that is a bevel if it rises [m]
_RISES = CERTAIN  # standard deviations by which its upper end lies higher
_ARRIS = SOME  # of the longest side of a stone: shorter ones beside a cut are its arris
_LEVEL = math.tan(ONE_WAY)  # largest slope of a bed; steeper lower sides are worn or bevelled


@dataclass(frozen=True)
class CourseLine:
    """The bed line of one course on one facade.

    Attributes
    ----------
    facade, zone, course : location
    stones : codes of its stones that have a bed, in order along the wall
    codes : (n,) stone of each corner
    places : (n, 3) place of each corner [m]
    along : (n,) the same along the facade, to the right of the viewer [m]
    height : (n,) its z [m]
    sigma : (n,) standard deviation of its z, as measured [m]
    left_out : lower corners that are ignored: worn, the upper end of a bevel, or of unknown precision
    middle : half-way between the ends, along the facade [m]
    level : z of the line there [m]; it and `slope` have the covariance
    slope : rise to the right over length [-]; None if only one corner is left
    covariance : (2, 2) of level [m] and slope [-], in the frame of the survey
    frame_sigma : standard deviation of a slope due to the frame itself, common to all courses [-]
    slope_probability : probability of such a slope in a level course by chance; None if the scatter of beds is
        unknown
    sag : height of mid-span above the chord of the best parabola, negative where it sags [m]; None with fewer
        than five stones
    sag_sigma : its standard deviation [m]
    sag_probability : probability of such a sag in a straight course by chance
    deviations : (n,) of the corners from the straight line, upwards [m]
    rms : of the deviations [m]
    scatter : τ, standard deviation of a stone's bed about the line [m]
    roughness : κ, scatter of the corners of one stone over their measured precision [-]
    evidence : source of τ and κ: "wall", "own", "other courses", or "none" if both are unknown
    """

    facade: str
    zone: str | None
    course: int
    stones: tuple[str, ...]
    codes: tuple[str, ...]
    places: Array
    along: Array
    height: Array
    sigma: Array
    left_out: int
    middle: float
    level: float
    slope: float | None
    covariance: Array
    frame_sigma: float
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
        """Standard deviation of the slope against level, including that of the frame [-]."""
        return None if self.slope is None else math.hypot(math.sqrt(self.covariance[1, 1]), self.frame_sigma)

    @property
    def span(self) -> float:
        """Distance from the first to the last corner [m]."""
        return float(self.along[-1] - self.along[0])

    @property
    def worst(self) -> tuple[str, float]:
        """Stone with the corner farthest from the line, and its distance [m]."""
        i = int(np.abs(self.deviations).argmax())
        return self.codes[i], float(self.deviations[i])


@dataclass(frozen=True)
class CourseHeight:
    """Height from the bed of a course to that of the next.

    Attributes
    ----------
    facade, zone, course : of the lower course
    along : place along the facade where it is measured: the middle of the overlap of the two courses [m]
    height : including its bed joint [m]
    sigma : standard deviation [m]
    """

    facade: str
    zone: str | None
    course: int
    along: float
    height: float
    sigma: float


@dataclass(frozen=True)
class _Course:
    """Lower corners of one course, with their stones."""

    facade: str
    zone: str | None
    course: int
    codes: tuple[str, ...]
    places: Array
    left_out: int
    bed: BedCorners
    frame_sigma: float


def measure_courses(
    stones: Sequence[StoneQuality], facades: Iterable[Facade], tilts: Sequence[Array] = ()
) -> tuple[CourseLine, ...]:
    """Fit the bed line of every course of every standing facade.

    Parameters
    ----------
    stones : all stones of the survey
    facades : facades of the stones; level ones have no bed lines
    tilts : (3, 3) covariances of small rotations about x, y and z with which the frames of the survey were levelled
        by control points [rad²], of which the worst applies; none: the instrument levelled itself

    Returns
    -------
    One line per facade, zone and course that has any sound lower corner, in that order
    """
    standing = [facade for facade in facades if facade.azimuth is not None]
    courses = [course for facade in standing for course in _courses(stones, facade, _tilt(facade, tilts))]
    scatters = {
        k: scatter_of(course.bed, 2) for k, course in enumerate(courses) if course.bed.count >= ENOUGH
    }
    pooled = pool(list(scatters.values()))
    return tuple(_line(course, scatters.get(k), pooled) for k, course in enumerate(courses))


def with_scatter(
    lines: Sequence[CourseLine], scatters: Mapping[tuple[str, str | None], tuple[float, float]]
) -> tuple[CourseLine, ...]:
    """Fit bed lines anew with the scatter of their walls, which no movement of a course makes larger.

    Parameters
    ----------
    lines : of all walls
    scatters : τ [m] and its degrees of freedom, by facade and zone; a wall without any keeps its lines
    """
    courses = [_course_of(line) for line in lines]
    walls = {
        wall: corner_roughness([course.bed for course in courses if (course.facade, course.zone) == wall])
        for wall in scatters
    }
    fitted = []
    for line, course in zip(lines, courses, strict=True):
        wall = line.facade, line.zone
        tau, freedom = scatters.get(wall, (0.0, 0.0))
        known = freedom > 0.0
        fitted.append(_line(course, BedScatter(tau, walls[wall], freedom), None, "wall") if known else line)
    return tuple(fitted)


def course_heights(lines: Sequence[CourseLine]) -> tuple[CourseHeight, ...]:
    """Return the height of every course whose next one lies above part of it."""
    heights = []
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
        heights.append(CourseHeight(facade, zone, course, place, high - low, sigma))
    return tuple(heights)


def lower_corners(outline: Array, frame: WallPlane, arches: Side | None = None) -> list[int]:
    """Return the indices of the corners on which a face is bedded: the ends of its lower, nearly level sides.

    Parameters
    ----------
    outline : (nv, 3) counter-clockwise seen from outside [m]
    frame : elevation of the facade
    arches : sides of arch stones and others that are no bed of the course; what is cut to one of them is none
    """
    flat = frame.flatten(outline)
    run = np.roll(flat, -1, axis=0) - flat
    # counter-clockwise, the lower sides run to the right
    bedded = (run[:, 0] > 0.0) & (np.abs(run[:, 1]) <= _LEVEL * run[:, 0])
    if arches is not None:
        cut = (run[:, 0] > 0.0) & lies_along(flat, run, arches)
        length = np.linalg.norm(run, axis=1)
        # beside a cut a short side is its arris
        bedded &= ~cut & (not cut.any() or length >= _ARRIS * length.max())
    return sorted({k for i in np.flatnonzero(bedded).tolist() for k in (i, (i + 1) % len(flat))})


def _tilt(facade: Facade, tilts: Sequence[Array]) -> float:
    """Return the standard deviation of a slope along a facade: the rotation ω raises s·u by (ω × u)_z s."""
    along = facade.frame.axes[0]
    lever = np.array([along[1], -along[0], 0.0])
    return max((math.sqrt(float(lever @ tilt @ lever)) for tilt in tilts), default=0.0)


def _courses(stones: Sequence[StoneQuality], facade: Facade, frame_sigma: float) -> list[_Course]:
    """Return the lower corners of a facade, by zone and course; arch stones and lintels have none."""
    groups: dict[tuple[str, int], dict[int, StoneQuality]] = {}
    sides = sides_of(stones, facade)
    spanning = spanning_stones(stones, sides)
    for i in facade.members.tolist():
        course = stones[i].course
        if course is not None and i not in spanning:
            groups.setdefault((stones[i].zone or "", course), {})[i] = stones[i]
    courses = []
    for zone, course in sorted(groups):
        # what stands on a stone of its own course or of a higher one does not stand on the course below
        same = {
            i
            for i in facade.members.tolist()
            if (stones[i].zone or "") == zone and _at_least(stones[i].course, course)
        }
        courses.append(_course(groups[zone, course], facade, frame_sigma, sides.of(spanning | same)))
    return [course for course in courses if course is not None]


def _at_least(course: int | None, other: int) -> bool:
    return course is not None and course >= other


def _bedded(along: Array, height: Array, sigma: Array) -> Ints:
    """Return which of the lower corners (n,) of a stone are no upper ends of bevels."""
    near = np.abs(along[:, None] - along) < _BEVEL
    rises = height - height[:, None] > _RISES * np.hypot(sigma[:, None], sigma)
    return np.flatnonzero(~(near & rises).any(axis=0))


def _course(
    stones: Mapping[int, StoneQuality], facade: Facade, frame_sigma: float, others: Side
) -> _Course | None:
    codes: list[str] = []
    parts: list[Array] = []
    left_out = 0
    for i, stone in stones.items():
        lower = lower_corners(stone.outline, facade.frame, others.without(i))
        known = np.isfinite(stone.corner_sigma[:, 2])
        sound = [k for k in lower if k not in stone.worn_corners and known[k]]
        places, sigma = stone.outline[sound], stone.corner_sigma[sound, 2]
        along = (places - facade.frame.origin) @ facade.frame.axes[0]
        bedded = _bedded(along, places[:, 2], sigma)
        left_out += len(lower) - len(bedded)
        parts.append(np.column_stack([along, sigma, places])[bedded])
        codes += [stone.code] * len(bedded)
    if not codes:
        return None
    table = np.concatenate(parts)
    order = np.argsort(table[:, 0], kind="stable")
    names = [codes[i] for i in order.tolist()]
    number = {code: k for k, code in enumerate(dict.fromkeys(names))}
    first = next(iter(stones.values()))
    course = first.course
    assert course is not None
    numbers = np.array([number[code] for code in names], dtype=np.intp)
    along, sigma, *_, height = (np.ascontiguousarray(column) for column in table[order].T)
    bed = BedCorners(numbers, along, height, sigma)
    places = table[order, 2:]
    return _Course(facade.name, first.zone, course, tuple(names), places, left_out, bed, frame_sigma)


def _course_of(line: CourseLine) -> _Course:
    """Return the corners of a line."""
    number = {code: k for k, code in enumerate(dict.fromkeys(line.codes))}
    stone = np.array([number[code] for code in line.codes], dtype=np.intp)
    bed = BedCorners(stone, line.along, line.height, line.sigma)
    return _Course(
        line.facade, line.zone, line.course, line.codes, line.places, line.left_out, bed, line.frame_sigma
    )


def _line(
    course: _Course, own: BedScatter | None, pooled: BedScatter | None, evidence: str | None = None
) -> CourseLine:
    bed = course.bed
    known = evidence is not None
    evidence = evidence or ("own" if own else "other courses" if pooled else "none")
    scatter = own or pooled or BedScatter(0.0, 1.0, 0)
    sloped = bed.along[-1] > bed.along[0]
    values, covariance = fit_bed(bed, scatter, 2 if sloped else 1)
    slope = float(values[1]) if sloped else None
    if not sloped:
        covariance = np.array([[covariance[0, 0], 0.0], [0.0, math.nan]])
    deviations = bed.height - values[0] - (slope or 0.0) * (bed.along - bed.middle)
    curved = own is not None and sloped and bed.count >= ENOUGH
    sag = _sag(bed, own if known else None) if curved else (None, None, None)
    return CourseLine(
        facade=course.facade,
        zone=course.zone,
        course=course.course,
        stones=tuple(dict.fromkeys(course.codes)),
        codes=course.codes,
        places=course.places,
        along=bed.along,
        height=bed.height,
        sigma=bed.sigma,
        left_out=course.left_out,
        middle=bed.middle,
        level=float(values[0]),
        slope=slope,
        covariance=covariance,
        frame_sigma=course.frame_sigma,
        slope_probability=None
        if slope is None
        else _chance(slope, math.hypot(math.sqrt(covariance[1, 1]), course.frame_sigma), scatter.freedom),
        sag=sag[0],
        sag_sigma=sag[1],
        sag_probability=sag[2],
        deviations=deviations,
        rms=math.sqrt(float((deviations**2).mean())),
        scatter=scatter.tau,
        roughness=scatter.kappa,
        evidence=evidence,
    )


def _sag(bed: BedCorners, scatter: BedScatter | None) -> tuple[float, float, float | None]:
    """Return the height of mid-span above the chord of the best parabola, -c (L/2)², its sigma and probability."""
    scatter = scatter or scatter_of(bed, 3)
    values, covariance = fit_bed(bed, scatter, 3)
    lever = -(((bed.along[-1] - bed.along[0]) / 2.0) ** 2)
    sag, sigma = float(lever * values[2]), float(-lever * math.sqrt(covariance[2, 2]))
    return sag, sigma, _chance(sag, sigma, scatter.freedom)


def _chance(value: float, sigma: float, freedom: float) -> float | None:
    """Return the two-sided probability of Student's t."""
    return float(2.0 * stdtr(freedom, -abs(value) / sigma)) if freedom > 0 else None


def _at(line: CourseLine, place: float) -> tuple[float, float]:
    """Return the height of a line at a place along the facade, and its variance."""
    row = np.array([1.0, place - line.middle])
    return line.level + (line.slope or 0.0) * float(row[1]), float(row @ line.covariance @ row)
