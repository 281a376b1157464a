"""Measured deformation as one vector of standardised residuals, for least squares over movements.

Of each course the lower corners of its stones, of each wall the mean outward position of the faces of each course. The
height of each course, the position of each wall and, if asked, its lean are free, and projected out. Of n values with f
free ones the residuals P C^(-1/2) (z - w), with the simulated displacement w, have n entries and n - f degrees of
freedom.

The covariance C of beds is κ²σ² of each corner, τ² common to the corners of a stone, and the tolerance of level. τ is
that of the verdict on movement (`survey.quality.departures.beds`): what the shapes that the wall shows by itself leave.
So τ depends on no hypothesis, and all χ² are comparable.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from survey.arrays import Array
from survey.conventions import ENOUGH
from survey.quality.courses import CourseLine
from survey.quality.departures.beds import measure_beds
from survey.quality.facades import Facade
from survey.quality.precision import StoneQuality

Displacement = Callable[[str, Array], Array]
"""Displacement (n, 3) of points (n, 3) of the stone of a code [m]."""


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
        for code, row in rows.items():
            moved[row] = displacement(code, self.places[row]) @ self.direction
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
    scatter : τ of the beds of each facade and zone, as the verdict on movement has it [m]
    freedom : its degrees of freedom, of all walls together
    """

    groups: tuple[DeformationGroup, ...]
    scatter: Mapping[tuple[str, str | None], float]
    freedom: float

    @property
    def dof(self) -> int:
        """Degrees of freedom of all groups."""
        return sum(group.dof for group in self.groups)

    def residuals(self, displacement: Displacement) -> Array:
        """Return the standardised residuals (m,) that a movement leaves [-]."""
        return np.concatenate([np.zeros(0), *(group.residuals(displacement) for group in self.groups)])


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
    every, walls_beds = measure_beds(stones, facades)
    lines = [line for line in every if line.slope is not None]
    beds = (_bed(line, built.level, undetermined) for line in lines)
    walls = (wall for facade in facades for wall in _walls(stones, facade, built))
    scatter = {(bed.facade, bed.zone or None): bed.scatter for bed in walls_beds}
    freedom = sum(bed.freedom for bed in walls_beds)
    return Deformation((*(bed for bed in beds if bed is not None), *walls), scatter, freedom)


def _bed(line: CourseLine, level: float, undetermined: frozenset[str]) -> DeformationGroup | None:
    rows = [k for k, code in enumerate(line.codes) if code not in undetermined]
    if len(rows) < 2:
        return None
    codes, along = tuple(line.codes[k] for k in rows), line.along[rows]
    same = np.array([[a == b for b in codes] for a in codes])
    middle = along - along.mean()
    measured = np.diag((line.roughness * line.sigma[rows]) ** 2)
    covariance = measured + line.scatter**2 * same + level**2 * np.outer(middle, middle)
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
