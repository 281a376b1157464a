"""Evaluation of a tradeoff study: errors against the finest run, Pareto front, and recommendation."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from pipelines.results.quantities import QUANTITIES, differences
from pipelines.tradeoff.grid import Variant
from pipelines.tradeoff.store import Measured, Status
from pipelines.tuning.overlay import Overlay
from survey.conventions import SOME

_CHANCE = 1.0 + SOME  # ratio of processor times of the same work, run after run on a busy machine [-]
_SOLVER_ERRORS = ("natural_map", "penetration", "balance", "reaction", "energy")
_COARSER = 1.2  # least ratio of sizes at which one mesh gives an error estimate of another [-]


@dataclass(frozen=True)
class ErrorReference:
    """Reference of the errors: the finest run within the budget, not the truth.

    Attributes
    ----------
    name : of its setting
    errors : estimated error of each of QUANTITIES; None where no estimate is possible [-]
    partner : the run whose difference gives the estimate; "" without one
    ratio : size of the partner over that of the reference [-]
    stress_error : of its stress as Zienkiewicz & Zhu (1987) estimate it; None if no stone deforms [-]
    """

    name: str
    errors: Mapping[str, float | None]
    partner: str
    ratio: float
    stress_error: float | None


@dataclass(frozen=True)
class Judged:
    """One finished run with its errors.

    Attributes
    ----------
    run : its measurements
    errors : of each of QUANTITIES against the reference; those of the reference itself are estimated [-]
    """

    run: Measured
    errors: Mapping[str, float | None]


@dataclass(frozen=True)
class Recommendation:
    """The cheapest setting whose error is below the requested one.

    Attributes
    ----------
    name : of the setting
    error : its error, including that of the reference [-]
    holds : the error is below the requested one; if not, it is the smallest available
    """

    name: str
    error: float
    holds: bool


def judge(
    settings: Mapping[str, Variant], runs: Mapping[str, Measured]
) -> tuple[ErrorReference | None, tuple[Judged, ...]]:
    """Return the reference, None without finished runs, and all finished runs with their errors.

    The reference is the run with the finest elements, by the distance of their nodes and their order: error estimates
    of a stress cannot see what a mesh of one cell does not resolve. Of runs with equal meshes, and where no stone
    deforms, it is the one with the smallest time step, then the smallest tolerance, then the most contact points. Its
    own error is estimated on the assumption that errors fall with the first power of the cell or step size, which is
    slower than for smooth fields and about what corners and edges of contacts allow: the difference from the next
    coarser run of its kind over (ratio of the sizes - 1).
    """
    done = [run for run in runs.values() if run.status is Status.DONE and run.quantities is not None]
    if not done:
        return None, ()
    ranked = sorted(done, key=lambda run: _fineness(settings[run.name], run))
    finest = ranked[0]
    assert finest.quantities is not None
    reference = _reference(settings, finest, ranked[1:])
    judged = []
    for run in done:
        assert run.quantities is not None
        errors = differences(run.quantities, finest.quantities)
        judged.append(Judged(run, reference.errors if run is finest else errors))
    return reference, tuple(judged)


def front(points: Iterable[tuple[float, float]]) -> tuple[int, ...]:
    """Return the indices of the points (cost, error) on the Pareto front, by rising cost; of equal points the first.

    >>> front([(1.0, 0.3), (2.0, 0.4), (3.0, 0.1)])
    (0, 2)
    """
    listed = list(points)
    order = sorted(range(len(listed)), key=lambda one: (*listed[one], one))
    rows: list[int] = []
    for index in order:
        if not rows or listed[index][1] < listed[rows[-1]][1]:
            rows.append(index)
    return tuple(rows)


def cheapest(
    judged: Sequence[Judged], reference: ErrorReference, quantity: str, error: float
) -> Recommendation | None:
    """Return the cheapest run that is surely below an error of a quantity; None if its error is unknown in all runs.

    A run that differs by e from a reference whose error is at most e_r has an error of at most e + e_r. Of runs whose
    times differ by chance alone, that which changes least of the scene.
    """
    bounded = [(run, bound) for run in judged if (bound := _bound(run, reference, quantity)) is not None]
    if not bounded:
        return None
    below = [(one, bound) for one, bound in bounded if bound <= error]
    if below:
        least = min(one.run.cpu for one, _ in below)
        alike = [pair for pair in below if pair[0].run.cpu <= _CHANCE * least]
        best, bound = min(alike, key=lambda pair: (_changes(pair[0].run.overlay), pair[0].run.cpu))
    else:
        best, bound = min(bounded, key=lambda pair: (pair[1], pair[0].run.cpu))
    return Recommendation(best.run.name, bound, bool(below))


def _changes(overlay: Overlay) -> int:
    """Return the number of settings that are not as the scene has them."""
    return sum(value is not None for value in vars(overlay).values())


def models_of_interest(
    settings: Mapping[str, Variant], runs: Mapping[str, Measured], quantity: str
) -> frozenset[str]:
    """Return the scene as written, if its error is known, and the models on the front of a quantity."""
    _, judged = judge(settings, runs)
    with_errors = [
        (run_judged.run, error)
        for run_judged in judged
        if settings[run_judged.run.name].varied is None
        and (error := counted(run_judged, quantity)) is not None
    ]
    best = front((run.cpu, error) for run, error in with_errors)
    written = {run.name for run, _ in with_errors if run.overlay == Overlay()}
    return frozenset(with_errors[number][0].name for number in best) | written


def counted(judged: Judged, quantity: str) -> float | None:
    """Return the error of a run [-]; None if it is unknown, or if the outcome differs from that of the reference."""
    return None if judged.errors["outcome"] else judged.errors[quantity]


def _bound(judged: Judged, reference: ErrorReference, quantity: str) -> float | None:
    """Return the error of a run plus that of the reference; None if it is unknown, or the outcome differs."""
    error, own_error = counted(judged, quantity), reference.errors[quantity]
    if error is None or own_error is None:
        return None
    return error if judged.run.name == reference.name or quantity in _SOLVER_ERRORS else error + own_error


def _fineness(setting: Variant, run: Measured) -> tuple[float, ...]:
    """Return a sort key that is smaller for finer runs."""
    stressed = run.quantities is not None and run.quantities.stress_error is not None
    return (
        setting.coarseness if stressed else math.inf,
        setting.step,
        setting.tolerance,
        -setting.points,
        -run.nodes,
        float(setting.varied is not None),
    )


def _reference(
    settings: Mapping[str, Variant], finest: Measured, others: Sequence[Measured]
) -> ErrorReference:
    """Return the finest run, its error estimated from the finest of the others that is coarser in mesh or step."""
    match = _partner(settings, finest, others)
    assert finest.quantities is not None
    if match is None:
        own = dict.fromkeys(QUANTITIES) | {name: finest.quantities.errors[name] for name in _SOLVER_ERRORS}
        return ErrorReference(finest.name, own, "", 1.0, finest.quantities.stress_error)
    partner, ratio = match
    assert partner.quantities is not None
    apart = differences(partner.quantities, finest.quantities)
    errors = {name: None if value is None else value / (ratio - 1.0) for name, value in apart.items()}
    errors |= {"outcome": 0.0} | {name: finest.quantities.errors[name] for name in _SOLVER_ERRORS}
    return ErrorReference(finest.name, errors, partner.name, ratio, finest.quantities.stress_error)


def _partner(
    settings: Mapping[str, Variant], finest: Measured, others: Sequence[Measured]
) -> tuple[Measured, float] | None:
    """Return a run for the error estimate of the finest, and how much coarser it is; None if none is coarser."""
    fine = settings[finest.name]
    alike = [candidate for candidate in others if settings[candidate.name].element is fine.element]
    meshes = [
        candidate for candidate in others if settings[candidate.name].element not in (None, fine.element)
    ]
    by_edge = _coarser(settings, fine, alike, "edge") if fine.element else None
    if by_edge is None and fine.element and meshes:
        return meshes[0], 2.0  # of another element: as if it were half as fine
    coarser = by_edge or _coarser(settings, fine, alike, "step")
    if coarser is None and fine.element is None and others:
        return others[0], 2.0  # a looser tolerance, fewer points
    return coarser


def _coarser(
    settings: Mapping[str, Variant], fine: Variant, runs: Sequence[Measured], size: str
) -> tuple[Measured, float] | None:
    """Return the first of the runs that is coarser in cell or step size, and by how much."""
    for run in runs:
        ratio = getattr(settings[run.name], size) / getattr(fine, size)
        if ratio > _COARSER:
            return run, ratio
    return None
