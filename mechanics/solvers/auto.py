"""Automatic choice: the chain of the kind of problem, at rest or in motion."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.chain import KEPT, follow
from mechanics.solvers.kinds import EXACT, FURTHER, POLISH, chain_of

# steps without slip after which chains of rest are tried again; where they fail, they cost as much as one step
_MOTION = 40
# loosest tolerance of η and of velocities in a motion, and largest velocity of a contact at rest over the largest
# u_free; beyond it contacts no longer obey their laws [-]
_LOOSEST = 0.025
# velocity over the tolerance of a motion up to which a contact may be at rest: errors hold u_N + μ‖u_T‖ [-]
_UNTOLD = 2.0
# velocity from which a contact moves, over the velocity tolerance: below it are errors of one step that add up [-]
_MOVES = 10.0


@dataclass(frozen=True)
class Auto:
    """Solver of every kind of problem: forces of the last step where they solve it still, else its chain.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : of all methods together
    motion_speed : velocity by which contacts may break their laws in the steps of a motion [m/s]; None: as in others
    rest_tolerance : velocity tolerance of steps of a motion in which nothing moves faster than errors let it [-]
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    motion_speed: float | None = None
    rest_tolerance: float = np.inf

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; `why` of the solution names the method, and what the one before left."""
        limits, most = (self.tolerance, self.velocity_tolerance), self.max_iterations
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True, "nothing: no contacts")
        warm, steps = bool(start.impulse.any()), start.motion
        if warm and not steps:
            remaining = residual(problem, start.impulse)
            # at the limits they would set rigid stones in motion that a relaxation halts, and so on
            share = FURTHER if steps is None and problem.delassus.rigid is not None else 1.0
            if remaining.within(share * limits[0], share * limits[1]):
                return ContactSolution(
                    start.impulse.copy(), remaining.dual, 0, remaining.natural_map, True, KEPT
                )
        follows = steps is not None and problem.delassus.rigid is not None
        # a motion that has long been still may have come to rest: one step brakes it, one finds its forces
        moving = warm and follows and steps not in (1, 2)
        asked = self._in_motion(problem) if moving else limits
        links = chain_of(problem, follows, moving, asked[1], warm)
        closed = problem if moving else self._closed(problem)
        solution = follow(links, closed, start, asked, most)
        if closed is not problem:
            solution = _judged(problem, solution, asked)
            if not solution.converged:
                count = solution.iterations
                alternative = follow(links, problem, start, asked, most - count)
                solution = min(
                    solution,
                    alternative,
                    key=lambda candidate: (not candidate.converged, candidate.natural_map),
                )
                solution = replace(solution, iterations=count + alternative.iterations)
        if moving:
            solution = self._as_at_rest(problem, solution, asked, warm)
        if not follows or steps is None:
            return solution
        if not (solution.converged and self._rests(problem, solution)):
            return replace(solution, motion=_MOTION)
        if not moving:
            # what forces lack that are kept for hundreds of steps would add up
            solution = self._exact(problem, closed, solution)
        return replace(solution, motion=steps - 1 if steps else _MOTION * warm)

    def _closed(self, problem: ContactProblem) -> ContactProblem:
        """Return the problem of a rest of rigid stones with gaps closed that are below the tolerance.

        Errors of earlier steps leave them: which of hundreds of contacts are open by a billionth would decide the
        forces, Newton's method would not end, and bodies would lack more balance than contacts show.
        """
        if problem.delassus.rigid is None or problem.delassus.joint_compliance is not None:
            return problem
        # what a closed gap takes of the tolerance leaves enough for the forces: less than an ångström, as a rule
        small = (1.0 - EXACT) * self.velocity_tolerance * float(np.abs(problem.u_free).max())
        ajar = (problem.bias != 0.0) & (np.abs(problem.bias) <= small)
        return replace(problem, bias=np.where(ajar, 0.0, problem.bias)) if ajar.any() else problem

    def _as_at_rest(
        self, problem: ContactProblem, solution: ContactSolution, asked: tuple[float, float], warm: bool
    ) -> ContactSolution:
        """Return a step of a motion solved as exactly as a rest asks, if nothing moves faster than errors may let it.

        Velocities within the errors of a motion would otherwise add up from step to step, and stones in balance drift.
        """
        limits = self.tolerance, min(self.velocity_tolerance, self.rest_tolerance)
        exact_already = asked[0] <= limits[0] and asked[1] <= limits[1]
        if exact_already or not solution.converged or not self._within(problem, solution, _UNTOLD * asked[1]):
            return solution
        links = chain_of(problem, True, True, limits[1], warm)
        exact = follow(
            links, problem, ContactStart(solution.impulse, solution.velocity), limits, self.max_iterations
        )
        count = solution.iterations + exact.iterations
        return replace(exact if exact.converged else solution, iterations=count)

    def _exact(
        self, problem: ContactProblem, closed: ContactProblem, solution: ContactSolution
    ) -> ContactSolution:
        """Return the forces of a rest solved further, with its gaps closed; or as they are."""
        limits = EXACT * self.tolerance, EXACT * self.velocity_tolerance
        start = ContactStart(solution.impulse, np.zeros_like(solution.velocity))
        exact = follow((POLISH,), closed, start, limits, self.max_iterations)
        count = solution.iterations + exact.iterations
        judged = _judged(problem, exact, (self.tolerance, self.velocity_tolerance))
        if not judged.converged:
            return replace(solution, iterations=count)
        return replace(judged, iterations=count, why=solution.why)

    def _in_motion(self, problem: ContactProblem) -> tuple[float, float]:
        """Return the tolerances of a step of a motion, of η and of velocities."""
        pace = float(np.abs(problem.u_free).max())
        if self.motion_speed is None or pace == 0.0:
            return self.tolerance, self.velocity_tolerance
        velocity = min(max(self.motion_speed / pace, self.velocity_tolerance), _LOOSEST)
        # η says next to nothing of a motion: the forces of the step before have one of 10⁻⁴
        return max(self.tolerance, velocity), velocity

    def _rests(self, problem: ContactProblem, solution: ContactSolution) -> bool:
        """Return whether no contact moves, neither one that carries a force nor one that opens."""
        return self._within(problem, solution, min(_MOVES * self.velocity_tolerance, _LOOSEST))

    def _within(self, problem: ContactProblem, solution: ContactSolution, share: float) -> bool:
        """Return whether no contact is faster than a share of the largest u_free."""
        u = problem.delassus.apply(solution.impulse) + problem.u_free
        return bool(np.abs(u).max() <= share * float(np.abs(problem.u_free).max()))


def _judged(
    problem: ContactProblem, solution: ContactSolution, limits: tuple[float, float]
) -> ContactSolution:
    """Return a solution of a problem with closed gaps, as the problem itself judges it."""
    remaining = residual(problem, solution.impulse)
    return replace(
        solution,
        velocity=remaining.dual,
        natural_map=remaining.natural_map,
        converged=remaining.within(*limits),
    )
