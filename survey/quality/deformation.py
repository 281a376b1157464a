"""Measured deformation as one vector of standardised residuals, for least squares over movements.

Of each course the lower corners of its stones, of each wall the mean outward position of the faces of each course. The
height of each course, the position of each wall and, if asked, its lean are free, and projected out. Of n values with f
free ones the residuals P C^(-1/2) (z - w), with the simulated displacement w, have n entries and n - f degrees of
freedom.

The covariance C of beds is σ² of each corner, τ² common to the corners of a stone, and the tolerance of level. τ is
estimated once, from the steps of the bed at head joints: a movement that is continuous there leaves them as they were,
and the few joints at which a wall has cracked are outliers. So τ depends on no hypothesis, and all χ² are comparable.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from survey.arrays import Array
from survey.quality.courses import ENOUGH, CourseLine, measure_courses
from survey.quality.facades import Facade
from survey.quality.precision import StoneQuality

__all__ = ["AS_PLANNED", "Built", "Deformation", "DeformationGroup", "measure_deformation"]

Displacement = Callable[[str, Array], Array]
"""Displacement (n, 3) of points (n, 3) of the stone of a code [m]."""

_NEAR = 0.06  # largest distance of two corners at one head joint: an open joint with worn arrises [m]
_MEDIAN = 0.6745  # of the absolute value of a standard normal variable
_OUTLIER = 2.5  # standard deviations beyond which a step is a crack
_KEPT = 0.9113  # variance of a standard normal variable within that limit
_FEWEST = 5  # steps from which a scatter is estimated


@dataclass(frozen=True)
class Built:
    """Tolerances with which a building was laid.

    Attributes
    ----------
    level : standard deviation of the slope of a course as laid [-]
    battered : each wall may lean by an angle of its own
    """

    level: float = 0.0
    battered: bool = False


AS_PLANNED = Built()
"""Courses laid level, and faces plumb."""


@dataclass(frozen=True)
class DeformationGroup:
    """The bed of a course, or the faces of a wall.

    Attributes
    ----------
    facade, zone : location; None: the stones name no zone
    quantity : "beds" or "plumb"
    course : of a bed; None for a wall
    codes : (n,) stone of each value
    places : (n, 3) where it was measured [m]
    direction : (3,) of the displacement that changes it [-]
    values : (n,) [m]
    whitening : (m, n) P C^(-1/2), of means by course for a wall [1/m]
    dof : degrees of freedom
    """

    facade: str
    zone: str | None
    quantity: str
    course: int | None
    codes: tuple[str, ...]
    places: Array
    direction: Array
    values: Array
    whitening: Array
    dof: int

    def simulated(self, displacement: Displacement) -> Array:
        """Return the change (n,) of the values by a movement [m]."""
        moved = np.zeros(len(self.codes))
        rows: dict[str, list[int]] = {}
        for k, code in enumerate(self.codes):
            rows.setdefault(code, []).append(k)
        for code, own in rows.items():
            moved[own] = displacement(code, self.places[own]) @ self.direction
        return moved

    def residuals(self, displacement: Displacement) -> Array:
        """Return the standardised residuals (m,) that a movement leaves [-]."""
        left: Array = self.whitening @ (self.values - self.simulated(displacement))
        return left


@dataclass(frozen=True)
class Deformation:
    """All groups of a survey.

    Attributes
    ----------
    groups : beds, then walls
    scatter : τ of the beds of each facade [m]
    steps : number of steps at head joints from which it is known
    """

    groups: tuple[DeformationGroup, ...]
    scatter: Mapping[str, float]
    steps: int

    @property
    def dof(self) -> int:
        """Degrees of freedom of all groups."""
        return sum(one.dof for one in self.groups)

    def residuals(self, displacement: Displacement) -> Array:
        """Return the standardised residuals (m,) that a movement leaves [-]."""
        return np.concatenate([np.zeros(0), *(one.residuals(displacement) for one in self.groups)])


def measure_deformation(
    stones: Sequence[StoneQuality],
    facades: Sequence[Facade],
    built: Built = AS_PLANNED,
    undetermined: frozenset[str] = frozenset(),
) -> Deformation:
    """Return the departure of courses from level and of walls from plumb.

    Parameters
    ----------
    stones : of the survey
    facades : of the stones
    built : tolerances
    undetermined : codes of stones whose beds do not tell how they were laid: on older work that had moved
    """
    lines = [line for line in measure_courses(stones, facades) if line.slope is not None]
    scatter, steps = {}, 0
    for name in dict.fromkeys(line.facade for line in lines):
        scatter[name], count = _scatter([line for line in lines if line.facade == name])
        steps += count
    beds = (_bed(line, scatter[line.facade], built.level, undetermined) for line in lines)
    walls = (one for facade in facades for one in _walls(stones, facade, built))
    return Deformation((*(one for one in beds if one is not None), *walls), scatter, steps)


def _scatter(lines: Iterable[CourseLine]) -> tuple[float, int]:
    """Return τ from the steps at head joints, and the number of steps; without cracks."""
    steps, variances = [], []
    for line in lines:
        for i, k in pairwise(range(len(line.codes))):
            if line.codes[i] != line.codes[k] and line.along[k] - line.along[i] < _NEAR:
                steps.append(float(line.height[k] - line.height[i]))
                variances.append(float(line.sigma[i] ** 2 + line.sigma[k] ** 2))
    step, measured = np.abs(steps), np.array(variances)
    if len(step) < _FEWEST:
        return 0.0, 0
    first = _root(lambda square: float(np.median(step / np.sqrt(measured + 2.0 * square))) - _MEDIAN)
    kept = step <= _OUTLIER * np.sqrt(measured + 2.0 * first)
    count = int(kept.sum())
    square = _root(
        lambda square: float((step[kept] ** 2 / (measured[kept] + 2.0 * square)).sum()) - _KEPT * count
    )
    return math.sqrt(square), count


def _root(excess: Callable[[float], float]) -> float:
    """Return the argument at which a falling function is zero; 0 if it is never positive."""
    if excess(0.0) <= 0.0:
        return 0.0
    low, high = 0.0, 1e-6
    while excess(high) > 0.0:
        high *= 4.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return high


def _bed(
    line: CourseLine, scatter: float, level: float, undetermined: frozenset[str]
) -> DeformationGroup | None:
    rows = [k for k, code in enumerate(line.codes) if code not in undetermined]
    if len(rows) < 2:
        return None
    codes, along = tuple(line.codes[k] for k in rows), line.along[rows]
    same = np.array([[a == b for b in codes] for a in codes])
    middle = along - along.mean()
    covariance = np.diag(line.sigma[rows] ** 2) + scatter**2 * same + level**2 * np.outer(middle, middle)
    return DeformationGroup(
        line.facade,
        line.zone or None,
        "beds",
        line.course,
        codes,
        line.places[rows],
        np.array([0.0, 0.0, 1.0]),
        line.height[rows],
        _whitening(covariance, np.ones((len(rows), 1))),
        len(rows) - 1,
    )


def _whitening(covariance: Array, free: Array) -> Array:
    """Return P C^(-1/2), where P takes out the free columns."""
    root = np.linalg.inv(np.linalg.cholesky(covariance))
    basis = np.linalg.qr(root @ free)[0]
    white: Array = root - basis @ (basis.T @ root)
    return white


def _walls(stones: Sequence[StoneQuality], facade: Facade, built: Built) -> Iterable[DeformationGroup]:
    if facade.azimuth is None:
        return
    zones: dict[str | None, list[StoneQuality]] = {}
    for i in facade.members.tolist():
        if stones[i].course is not None:
            zones.setdefault(stones[i].zone or None, []).append(stones[i])
    for zone, members in zones.items():
        free = 2 if built.battered else 1
        if len({stone.course for stone in members}) > free and len(members) >= ENOUGH:
            yield _wall(members, facade, zone, built)


def _wall(stones: Sequence[StoneQuality], facade: Facade, zone: str | None, built: Built) -> DeformationGroup:
    outward = facade.frame.axes[2] * [1.0, 1.0, 0.0]
    outward = outward / np.linalg.norm(outward)
    centres = np.array([stone.outline.mean(axis=0) for stone in stones])
    values = (centres - facade.frame.origin) @ outward
    course, number = np.unique([stone.course or 0 for stone in stones], return_inverse=True)
    count = np.bincount(number)
    means = np.equal.outer(np.arange(len(course)), number) / count[:, None]
    rest = values - (means @ values)[number]
    within = math.sqrt(float(rest @ rest) / max(len(values) - len(count), 1))
    # of a course of one stone that of its plane
    sigma = max(within, float(np.mean([stone.offset_sigma for stone in stones])))
    height = means @ centres[:, 2]
    free = np.column_stack([np.ones(len(course)), height - height.mean()][: 2 if built.battered else 1])
    return DeformationGroup(
        facade.name,
        zone,
        "plumb",
        None,
        tuple(stone.code for stone in stones),
        centres,
        outward,
        values,
        _whitening(np.diag(sigma**2 / count), free) @ means,
        len(course) - free.shape[1],
    )
