"""Estimates of a study by its method: moments, probability of failure, shares of the variance, fragility curve."""

from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import norm, qmc

from ground.errors import SceneError
from mechanics.arrays import Array
from pipelines.assess.study.methods.counting import (
    Estimate,
    Probability,
    controlled,
    fragility,
    mean_of,
    probability,
)
from pipelines.assess.study.methods.design_points import Design, design_points
from pipelines.assess.study.methods.failure import Failure
from pipelines.assess.study.methods.first_order import FirstOrder, first_order, regressed
from pipelines.assess.study.methods.importance import importance
from pipelines.assess.study.methods.sobol import Indices, sobol
from pipelines.assess.study.methods.subset import Subset, subset
from pipelines.assess.study.problem import Problem
from pipelines.assess.study.quantities import quantity_name
from pipelines.assess.study.sampling import IncompleteError, Sampler
from pipelines.assess.study.settings import Method, StudyTable
from pipelines.assess.workers.store import Sample


def monte_carlo(count: int, dimension: int, seed: int) -> Array:
    """Return independent points (count, dimension); each follows from the seed and its number alone.

    >>> bool((monte_carlo(5, 2, 1)[:3] == monte_carlo(3, 2, 1)).all())
    True
    """
    points = np.empty((count, dimension))
    for number in range(count):
        points[number] = np.random.default_rng([seed, 0, number]).standard_normal(dimension)
    return points


def latin_hypercube(count: int, dimension: int, seed: int) -> Array:
    """Return points (count, dimension) of which each unknown has one in each of `count` equally probable intervals."""
    if dimension == 0:
        return np.zeros((count, 0))
    plan = qmc.LatinHypercube(dimension, rng=np.random.default_rng([seed, 1]))
    points: Array = norm.ppf(plan.random(count))
    return points


_CURVE = 21  # levels of a fragility curve that are not given


@dataclass(frozen=True)
class Estimates:
    """Estimates of a study.

    Attributes
    ----------
    points, values : of independent samples: (m, n), and (m,) of each quantity by name, NaN where there is none
    samples : the same, with their reasons
    means : of each quantity
    probability : of failure; None where it is not asked for
    fragility : probability of failure at levels of the first quantity
    linear : first-order prediction; None where there is no gradient
    designs : design points, the most probable first
    subset : of subset simulation
    indices : of Sobol'
    weights : (m,) of samples about design points; None where all count the same
    gradient : (n,) the gradient; None where only shares of inputs are known
    """

    points: Array
    values: dict[str, Array]
    samples: list[Sample]
    means: dict[str, Estimate]
    probability: Probability | None = None
    fragility: list[tuple[float, Probability]] = field(default_factory=list)
    linear: FirstOrder | None = None
    designs: tuple[Design, ...] = ()
    subset: Subset | None = None
    indices: Indices | None = None
    weights: Array | None = None
    gradient: Array | None = None


def failure_of(problem: Problem) -> Failure | None:
    """Return when the first quantity fails; None where the study does not say."""
    table = problem.quantities[0]
    if table.fails_above is not None:
        return Failure(quantity_name(table), table.fails_above, True)
    if table.fails_below is not None:
        return Failure(quantity_name(table), table.fails_below)
    return Failure(quantity_name(table), 0.5) if table.type == "outcome" else None


def estimated(study: StudyTable, problem: Problem, sampler: Sampler) -> Estimates:
    """Return the estimates of a study by its method.

    Raises
    ------
    SceneError : the method has nothing to go by
    IncompleteError : a part has taken its samples
    """
    name, failure = quantity_name(problem.quantities[0]), failure_of(problem)
    # parts of a plan need no prediction: whoever gathers them makes it once
    gathers = sampler.part.count == 1 or study.method is Method.FORM
    linear = first_order(sampler, name, problem.dimension) if problem.differentiable and gathers else None
    match study.method:
        case Method.MONTE_CARLO:
            plan = monte_carlo(study.samples, problem.dimension, study.seed)
            return _counted(study, problem, plan, sampler, linear, failure)
        case Method.LATIN_HYPERCUBE:
            plan = latin_hypercube(study.samples, problem.dimension, study.seed)
            return _counted(study, problem, plan, sampler, linear, failure)
        case Method.SOBOL:
            return _sobol(study, problem, sampler, linear)
        case Method.FIRST_ORDER:
            return _first_order(problem, name, linear, failure)
        case Method.FORM:
            return _form(study, problem, sampler, linear, failure)
        case Method.SUBSET:
            return _subset(study, problem, sampler, linear, failure)


def _counted(
    study: StudyTable,
    problem: Problem,
    points: Array,
    sampler: Sampler,
    linear: FirstOrder | None,
    failure: Failure | None,
) -> Estimates:
    """Return the estimates from samples of equal weight."""
    with suppress(IncompleteError):
        control = _control(study, problem, sampler)
    samples = sampler.divided(points)
    values = _values(problem, samples)
    first = quantity_name(problem.quantities[0])
    means = {}
    for name, numbers in values.items():
        if control is not None and name == control[0]:
            means[name] = control[1]
        elif control is not None:
            half = 0.5 * (control[1].high - control[1].low)
            other, expected = values[control[0]], control[1].value
            means[name] = controlled(numbers, other, expected, study.confidence, half)
        elif linear is not None:
            means[name] = controlled(numbers, linear.predicted(points), linear.mean, study.confidence)
        else:
            means[name] = mean_of(numbers, study.confidence)
    table = problem.quantities[0]
    levels = table.levels or _levels(values[first])
    above = table.fails_above is not None
    return Estimates(
        points,
        values,
        samples,
        means,
        None if failure is None else probability(failure.states(samples), study.confidence),
        fragility(values[first], levels, above, study.confidence),
        linear,
        gradient=linear.gradient if linear is not None else regressed(points, values[first]),
    )


def _control(study: StudyTable, problem: Problem, sampler: Sampler) -> tuple[str, Estimate] | None:
    """Return the name and the mean of the bound that is the control variate of runs; None where there is none."""
    bounds = [number for number, table in enumerate(problem.quantities) if table.type == "bound"]
    if study.controls < 2 or not bounds:
        return None
    name = quantity_name(problem.quantities[bounds[0]])
    # another seed: the mean must not know of the samples that it corrects
    points = monte_carlo(study.controls, problem.dimension, study.seed + 1)
    samples = sampler.alone(bounds[0]).divided(points)
    values = np.array([sample.values.get(name, np.nan) if sample.done else np.nan for sample in samples])
    return name, mean_of(values, study.confidence)


def _values(problem: Problem, samples: list[Sample]) -> dict[str, Array]:
    names = [quantity_name(table) for table in problem.quantities]
    return {
        name: np.array([sample.values.get(name, np.nan) if sample.done else np.nan for sample in samples])
        for name in names
    }


def _levels(values: Array) -> tuple[float, ...]:
    known = values[np.isfinite(values)]
    if not len(known):
        return ()
    return tuple(np.linspace(known.min(), known.max(), _CURVE).tolist())


def _first_order(
    problem: Problem, name: str, linear: FirstOrder | None, failure: Failure | None
) -> Estimates:
    if linear is None:
        raise SceneError(f"{name} has no gradient at the mean", remedy="give method = 'monte_carlo'")
    mean = Estimate(linear.mean, linear.sigma, float("nan"), float("nan"), 1)
    found = None
    if failure is not None and linear.sigma > 0.0:
        from scipy.stats import norm

        share = float(norm.cdf(failure.sign * (failure.level - linear.mean) / linear.sigma))
        # a prediction has no interval: only samples tell how good it is
        found = Probability(share, share, 0.0, 1.0, 0, 0, 0, float("nan"))
    return Estimates(
        np.zeros((0, problem.dimension)),
        {},
        [],
        {name: mean},
        found,
        [],
        linear,
        gradient=linear.gradient,
    )


def _form(
    study: StudyTable,
    problem: Problem,
    sampler: Sampler,
    linear: FirstOrder | None,
    failure: Failure | None,
) -> Estimates:
    assert failure is not None
    designs = design_points(sampler, failure, problem.dimension, _starts(problem))
    if not designs:
        raise SceneError(
            f"{failure.quantity} has no gradient from which a design point follows",
            remedy="give method = 'subset'",
        )
    found = importance(sampler.divided, designs, study.samples, study.seed)
    name, values = failure.quantity, _values(problem, found.samples)
    levels = problem.quantities[0].levels or found.levels(values[name], _CURVE)
    curve = [(level, found.probability(replace(failure, level=level), study.confidence)) for level in levels]
    means = {} if linear is None else {name: Estimate(linear.mean, linear.sigma, np.nan, np.nan, 1)}
    # that of the quantity itself, not of g
    gradient = failure.sign * designs[0].gradient
    return Estimates(
        found.points,
        values,
        found.samples,
        means,
        found.probability(failure, study.confidence),
        curve,
        linear,
        designs,
        weights=found.ratios,
        gradient=gradient,
    )


def _starts(problem: Problem) -> list[int]:
    """Return the unknowns along which further design points are sought: what stones have in common."""
    return [number for number, unknown in enumerate(problem.unknowns.each) if unknown.part == "common"]


def _subset(
    study: StudyTable,
    problem: Problem,
    sampler: Sampler,
    linear: FirstOrder | None,
    failure: Failure | None,
) -> Estimates:
    assert failure is not None
    found = subset(sampler, failure, problem.dimension, study.samples, study.seed, study.confidence)
    # the first level is of independent samples, as those of Monte Carlo
    values = failure.level + failure.sign * found.states
    curve = [(failure.level + failure.sign * state, one) for state, one in found.curve]
    return Estimates(
        np.zeros((0, problem.dimension)),
        {failure.quantity: values},
        [],
        {failure.quantity: mean_of(values, study.confidence)},
        found.probability,
        sorted(curve, key=lambda row: row[0]),
        linear,
        subset=found,
        gradient=None if linear is None else linear.gradient,
    )


def _sobol(study: StudyTable, problem: Problem, sampler: Sampler, linear: FirstOrder | None) -> Estimates:
    name = quantity_name(problem.quantities[0])
    groups = [
        [place for place, unknown in enumerate(problem.unknowns.each) if unknown.input == number]
        for number in range(len(problem.inputs))
    ]
    if len(problem.unknowns.correlated):
        raise SceneError(
            "Sobol' indices need independent inputs",
            remedy="leave out [[correlations]], or use another method",
        )
    found = sobol(
        sampler.divided, name, problem.dimension, groups, study.samples, study.seed, study.confidence
    )
    return Estimates(
        np.zeros((0, problem.dimension)),
        {name: found.values},
        [],
        {name: mean_of(found.values, study.confidence)},
        None,
        [],
        linear,
        indices=found,
        gradient=None if linear is None else linear.gradient,
    )
