"""Chain of methods: the one driver of every automatic choice.

A link is a method, its budget of iterations, and where it starts. The links are tried in order until one has solved the
problem; the best iterate so far is kept, iterations are counted, and the reason stated here alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Protocol

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import project_on_cone, residual
from mechanics.solvers.scales import CORRECTIONS, ROUNDING
from mechanics.solvers.second_order.scaling import equilibrated


def without_self_stress(problem: ContactProblem, impulse: Array) -> Array:
    """Return the smallest impulses (nc, d) that load the bodies alike, projected on the cones.

    (W + α) Δ = W (r - r̂) a few times (Riley 1955), in units in which all contacts yield alike: what no body feels stays
    out, to 10⁻⁶ where masses differ by 10⁶. Stones that clamp each other at the edge of sliding leave less friction to
    the rest, which no residual shows where all but the lightest are far heavier.

    Raises
    ------
    SolverError : if W is known by its products alone, or W + α is singular
    """
    even, each = equilibrated(problem)
    unit, size = each[:, None], impulse.shape[1]
    theta = np.tile(ROUNDING * even.delassus.scale * np.eye(size), (len(impulse), 1, 1))
    system, wanted = even.form("forces without self-stress").shifted(theta), impulse / unit
    least = np.zeros_like(wanted)
    for _ in range(CORRECTIONS):
        least += system(even.delassus.apply(wanted - least).ravel()).reshape(wanted.shape)
    return project_on_cone(unit * least, problem.friction, problem.cohesion)


KEPT = "forces of the last step"
"""Reason of a solution that no method had to find."""


class Solver(Protocol):
    """Solver of contact problems."""

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`."""


class Begin(Enum):
    """Start of a link."""

    WARM = auto()  # forces of the last step
    AHEAD = auto()  # forces of the last two steps, extrapolated
    NOTHING = auto()  # no force
    BEST = auto()  # best iterate of the links before
    RELEASED = auto()  # the same without self-stress


@dataclass(frozen=True)
class Link:
    """One method of a chain.

    Attributes
    ----------
    name : of the method, as the solution states it
    method : solver from a tolerance of η, of velocities, and a number of iterations
    iterations : at most; as many as are left where none are given
    begin : where it starts
    further : tolerances over those asked for; going further costs little and spares later steps their work [-]
    near : η of the best iterate from which it is too far for the method [-]
    """

    name: str
    method: Callable[[float, float, int], Solver]
    iterations: float = np.inf
    begin: Begin = Begin.BEST
    further: float = 1.0
    near: float = np.inf


def follow(
    links: Sequence[Link],
    problem: ContactProblem,
    start: ContactStart,
    limits: tuple[float, float],
    most: float,
) -> ContactSolution:
    """Try the links in order until one solves the problem; return the best iterate of all.

    Parameters
    ----------
    limits : tolerances of η and of velocities [-]
    most : iterations of all links together
    """
    remaining = residual(problem, start.impulse)
    best = ContactSolution(
        start.impulse.copy(), remaining.dual, 0, remaining.natural_map, remaining.within(*limits), KEPT
    )
    before, count = "warm start" if start.impulse.any() else "cold start", 0
    for link in links:
        if count >= most:
            break
        if best.natural_map > link.near:
            continue
        tight = link.further * limits[0], link.further * limits[1]
        solver = link.method(*tight, int(min(link.iterations, most - count)))
        try:
            solution = solver(problem, _begun(link.begin, problem, start, best))
        except SolverError as error:
            before = f"{link.name} failed: {error.what}"
            continue
        count += solution.iterations
        remaining = residual(problem, solution.impulse)
        solution = replace(
            solution,
            natural_map=remaining.natural_map,
            converged=remaining.within(*limits),
            why=f"{link.name}: {before}",
        )
        before = f"{link.name} stood at η {solution.natural_map:.0e}"
        best = min(solution, best, key=lambda candidate: (not candidate.converged, candidate.natural_map))
        if best.converged:
            break
    return replace(best, iterations=count)


@dataclass(frozen=True)
class Chain:
    """Solver that follows one chain.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : of all links together
    links : in order
    """

    tolerance: float
    velocity_tolerance: float
    max_iterations: int
    links: Sequence[Link]

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`."""
        limits = self.tolerance, self.velocity_tolerance
        solution = follow((), problem, start, limits, 0)
        return (
            solution
            if solution.converged
            else follow(self.links, problem, start, limits, self.max_iterations)
        )


def _begun(begin: Begin, problem: ContactProblem, start: ContactStart, best: ContactSolution) -> ContactStart:
    if begin is Begin.RELEASED:
        return ContactStart(without_self_stress(problem, best.impulse), best.velocity)
    if begin is Begin.BEST:
        return ContactStart(best.impulse, best.velocity)
    if begin is Begin.NOTHING:
        return ContactStart(np.zeros_like(start.impulse), np.zeros_like(start.velocity))
    if begin is Begin.AHEAD and start.ahead is not None:
        return start.ahead
    return start
