"""Unknowns of a study: its inputs, taken apart into independent standard normal variables.

What the stones of an input have in common is one unknown, and the scatter of each stone about it another. Without the
first, errors that are the same for all stones would average out, and a wall would look safer than it is.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mechanics.arrays import Array, Ints
from pipelines.assess.study.inputs.distributions import Distribution
from pipelines.assess.study.settings import Acts, InputTable, InputType, Shape
from pipelines.scene.selection import StoneModel

PLANE_PARTS = ("tilt 1", "tilt 2", "height")
"""Unknowns of a plane, in the order of its covariance."""


@dataclass(frozen=True)
class Unknown:
    """One independent unknown.

    Attributes
    ----------
    input : number of its input
    label : in reports
    distribution : of its value
    stones : codes of the stones on which it acts; none: it acts on joints or loads
    part : "common", "scatter", or the name of a coordinate
    acts : replaces, multiplies or is added to the value of the scene or survey
    """

    input: int
    label: str
    distribution: Distribution
    stones: tuple[str, ...] = ()
    part: str = "common"
    acts: Acts = Acts.VALUE


@dataclass(frozen=True)
class Unknowns:
    """All unknowns of a study, and the correlation of some.

    Attributes
    ----------
    each : in the order of the points
    correlated : (k,) numbers of those that are correlated
    root : (k, k) lower root of their matrix of correlations
    """

    each: tuple[Unknown, ...]
    correlated: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    root: Array = field(default_factory=lambda: np.zeros((0, 0)))

    def __len__(self) -> int:
        return len(self.each)

    def values(self, point: Array) -> Array:
        """Return the values (n,) at a point (n,) in standard normal space."""
        return np.array(
            [
                unknown.distribution.value(z)
                for unknown, z in zip(self.each, self._normal(point).tolist(), strict=True)
            ]
        )

    def gradient(self, point: Array, by_value: Array) -> Array:
        """Return the gradient (n,) by the coordinates of the point, from that by the values (n,)."""
        slopes = [
            unknown.distribution.slope(z)
            for unknown, z in zip(self.each, self._normal(point).tolist(), strict=True)
        ]
        gradient: Array = np.array(by_value * slopes)
        gradient[self.correlated] = self.root.T @ gradient[self.correlated]
        return gradient

    def _normal(self, point: Array) -> Array:
        normal: Array = np.array(point, dtype=float)
        normal[self.correlated] = self.root @ normal[self.correlated]
        return normal


def expand(
    number: int, table: InputTable, models: Sequence[StoneModel], stones: frozenset[str], base: float
) -> Iterator[Unknown]:
    """Yield the unknowns of an input.

    Parameters
    ----------
    number, table : of the input
    models : stones of the scene
    stones : codes of those that the input names
    base : value of the scene, for inputs that replace it

    Raises
    ------
    SceneError : the distribution cannot be
    """
    chosen = [model for model in models if model.record.code in stones]
    name = table.name or str(table.type)
    codes = tuple(model.record.code for model in chosen)
    match table.type:
        case InputType.PLANE:
            yield from _planes(number, name, chosen, table)
        case InputType.POINT:
            yield from _points(number, name, chosen)
        case InputType.STATION:
            yield from _stations(number, name, chosen, table)
        case InputType.RECORD:
            # each of n files stands for a share of 1/n
            yield Unknown(number, name, Distribution(Shape.UNIFORM, low=0.0, high=1.0))
        case InputType.DEPTH if table.sigma is table.cov is table.mean is table.low is None:
            yield from _surveyed_depths(number, name, chosen, table.scatter)
        case _:
            common = _distribution(table, base)
            if not common.certain or (table.acts is Acts.VALUE and table.mean is not None):
                yield Unknown(number, name, common, codes, "common", table.acts)
            yield from _scatter(number, name, codes, table.scatter, table.acts)


def _distribution(table: InputTable, base: float) -> Distribution:
    neutral: Mapping[Acts, float] = {Acts.VALUE: base, Acts.FACTOR: 1.0, Acts.CHANGE: 0.0}
    mean = neutral[table.acts] if table.mean is None else table.mean
    sigma = table.sigma if table.sigma is not None else abs(mean) * (table.cov or 0.0)
    low, high = (0.0 if end is None else end for end in (table.low, table.high))
    mode = 0.5 * (low + high) if table.mode is None else table.mode
    return Distribution(table.distribution, mean, sigma, low, high, mode)


def _scatter(number: int, name: str, codes: Sequence[str], sigma: float, acts: Acts) -> Iterator[Unknown]:
    if sigma > 0.0:
        spread = Distribution(Shape.NORMAL, 0.0, sigma)
        for code in codes:
            yield Unknown(number, f"{name} of {code}", spread, (code,), "scatter", acts)


def _surveyed_depths(
    number: int, name: str, chosen: Sequence[StoneModel], scatter: float
) -> Iterator[Unknown]:
    """Yield one unknown for each rule of the survey, and one for each stone whose depth was measured."""
    rules: dict[tuple[str, float, float, str], list[str]] = {}
    for model in chosen:
        record = model.record
        if not record.depth_sigma:
            continue
        if record.depth_origin == "stone":
            error = Distribution(Shape.NORMAL, 0.0, record.depth_sigma)
            yield Unknown(number, f"{name} of {record.code}", error, (record.code,), "measured", Acts.CHANGE)
        else:
            rule = (record.kind, record.depth, record.depth_sigma, record.depth_source)
            rules.setdefault(rule, []).append(record.code)
    for (kind, _, sigma, _), codes in rules.items():
        error = Distribution(Shape.NORMAL, 0.0, sigma)
        yield Unknown(number, f"{name}, rule of {kind}", error, tuple(codes), "common", Acts.CHANGE)
        yield from _scatter(number, name, codes, scatter, Acts.CHANGE)


def _planes(number: int, name: str, chosen: Sequence[StoneModel], table: InputTable) -> Iterator[Unknown]:
    factor = 1.0 if table.cov is None else table.cov
    for model in chosen:
        sigmas = factor * np.sqrt(np.diag(model.record.covariance))
        for part, sigma in zip(PLANE_PARTS, sigmas.tolist(), strict=True):
            if sigma > 0.0:
                error = Distribution(Shape.NORMAL, 0.0, sigma)
                code = model.record.code
                yield Unknown(number, f"{name} of {code}, {part}", error, (code,), part, Acts.CHANGE)


def _points(number: int, name: str, chosen: Sequence[StoneModel]) -> Iterator[Unknown]:
    for model in chosen:
        code = model.record.code
        for corner, sigma in enumerate(corner_sigmas(model)):
            for axis, spread in zip("xyz", sigma, strict=True):
                if spread > 0.0:
                    error = Distribution(Shape.NORMAL, 0.0, float(spread))
                    part = f"{corner} {axis}"
                    yield Unknown(
                        number, f"{name} {corner + 1} of {code}, {axis}", error, (code,), part, Acts.CHANGE
                    )


def corner_sigmas(model: StoneModel) -> Array:
    """Return the standard deviations (nv, 3) of the measured corners of a stone [m]."""
    record = model.record
    count = len(record.vertices)
    if record.sigmas is None:
        return np.full((count, 3), record.sigma)
    # those of the corners come after those of the points
    return np.repeat(np.asarray(record.sigmas, dtype=float)[-count:, None], 3, axis=1)


def _stations(number: int, name: str, chosen: Sequence[StoneModel], table: InputTable) -> Iterator[Unknown]:
    stations: dict[str, list[str]] = {}
    for model in chosen:
        stations.setdefault(model.record.station or "all", []).append(model.record.code)
    for station, codes in stations.items():
        for axis in "xyz":
            error = Distribution(Shape.NORMAL, 0.0, table.sigma or 0.0)
            yield Unknown(number, f"{name} {station}, {axis}", error, tuple(codes), axis, Acts.CHANGE)
