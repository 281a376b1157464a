"""For rigid scenes: sweeps, ADMM, Newton's method, the interior point; each is quick where another is slow."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechanics.delassus.rigid import RigidDelassus
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.first_order.admm import ADMM
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.second_order.proximal_newton import ProximalNewton
from mechanics.solvers.second_order.scaling import equilibrated

__all__ = ["Alternating", "moving_admm"]

# sweeps with which every solution begins that is not the first: near a solution they suffice
_FIRST_SWEEPS = 20
# sweeps between two extrapolations, and from how many iterates
_LOOK, _DEPTH = 5, 10
# a small penalty finds the forces in stones that stay in touch within a dozen iterations, or never
_STATIC_PENALTY, _STATIC_ITERATIONS, _STATIC_PATIENCE, _STATIC_LOOK = 1e-4, 40, 3.0, 5
# all are driven further than asked for, which costs little and spares the next steps any work
_FURTHER = 0.03
# Newton's method has converged within so many steps, or it wanders: between rigid stones most often where much slides
_NEWTON_STEPS = 20
# where contacts open and slide: a larger penalty, balanced, and a shift that is held; so many iterations cost what the
# interior point takes in all
_MOVING_PENALTY, _MOVING_HOLD, _MOVING_ITERATIONS = 0.03, 10, 400
# Newton's steps from where the interior point stood: where many contacts are at the edge between stick and slip, as in a
# leaning column that slides as one, η is small long before the light stones between heavy ones follow
_ENDING_STEPS = 60
# iterations of the interior point, and of ADMM from where that stood, with a penalty that is right for what still moves
_INTERIOR, _LAST_PENALTY, _LAST_ITERATIONS = 60, 0.3, 300

_Solver = Callable[[ContactProblem, ContactStart], ContactSolution]


def moving_admm(tolerance: float, velocity_tolerance: float, max_iterations: int) -> ADMM:
    """ADMM for rigid bodies of which many slide or open."""
    return ADMM(
        tolerance, velocity_tolerance, max_iterations, _MOVING_PENALTY, hold=_MOVING_HOLD, balanced=True
    )


@dataclass(frozen=True)
class Alternating:
    """For rigid scenes: one method after the other until one has solved the problem; the best of all counts.

    Gauss–Seidel carries news by one stone in a sweep, so it has the first word only where the forces of the last step
    are known. ADMM with a small penalty solves the motion of all stones at once, and needs a dozen iterations as long
    as few contacts open or slide. Newton's method tells by a few factorisations which do. From a cold start the
    interior point comes next, which no height, no mass and no redundant contact holds up; in a motion, ADMM with a
    balanced penalty first. Methods that factorise work in units in which all contacts yield alike (`equilibrated`).
    docs/decisions/006-alternating-solver.md and 022-tall-and-heavy.md have the measurements.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : sweeps and iterations together
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; `why` says which method did, and what the one before left."""
        best = ContactSolution(start.impulse, start.velocity, 0, np.inf, False, "nothing: no contacts")
        if len(start.impulse) == 0:
            return replace(best, natural_map=0.0, converged=True)
        warm = bool(start.impulse.any())
        before = "warm start" if warm else f"cold start, {len(start.impulse):,} contacts"
        for name, solve, from_best in self._stages(problem, warm):
            count = self.max_iterations - best.iterations
            if best.converged or count <= 0:
                break
            begin = ContactStart(best.impulse, best.velocity) if from_best else start
            found = self._judged(problem, solve(count)(problem, begin), f"{name}: {before}")
            before = f"{name} stood at η {found.natural_map:.0e}"
            best = _better(best, found)
        return best

    def _stages(
        self, problem: ContactProblem, warm: bool
    ) -> Iterator[tuple[str, Callable[[int], _Solver], bool]]:
        """Names, solvers of so many iterations at most, and whether each begins with the best of those before."""
        limits = self.tolerance, self.velocity_tolerance
        # from nothing, sweeps would leave much of the friction where they happen to begin
        if warm or problem.sparse is None:
            yield "sweeps", self._first, False
        if problem.sparse is not None:
            yield "admm, small penalty", self._static, False
            later = [("admm, balanced penalty", self._moving, False)]
            if isinstance(problem.delassus, RigidDelassus):
                yield "Newton", self._newton, False
                interior = [
                    ("interior point", self._interior, False),
                    ("Newton on the natural map", self._ending, True),
                    ("admm", self._last, True),
                ]
                later = later + interior if warm else interior + later
            yield from later
        yield "sweeps", lambda most: NSGS(*limits, most, _LOOK, _DEPTH), True

    def _first(self, most: int) -> _Solver:
        limits, tight = (self.tolerance, self.velocity_tolerance), self._tight

        def solve(problem: ContactProblem, start: ContactStart) -> ContactSolution:
            # what η does not see in a tall stack would add up from step to step, so sweeps go further than asked for;
            # but where nothing has changed since, nothing is done
            goal = limits if residual(problem, start.impulse).within(*limits) else tight
            return NSGS(*goal, min(_FIRST_SWEEPS, most), _LOOK, _DEPTH)(problem, start)

        return solve

    @property
    def _tight(self) -> tuple[float, float]:
        return _FURTHER * self.tolerance, _FURTHER * self.velocity_tolerance

    def _static(self, most: int) -> _Solver:
        solver = ADMM(
            *self._tight,
            min(_STATIC_ITERATIONS, most),
            _STATIC_PENALTY,
            _STATIC_LOOK,
            _STATIC_PATIENCE,
            over_relaxation=1.0,
        )
        # not from the velocities of sweeps: they end near a solution, but lead a small penalty astray
        return _even(lambda p, s: solver(p, ContactStart(s.impulse, np.zeros_like(s.velocity))))

    def _newton(self, most: int) -> _Solver:
        return _even(ProximalNewton(*self._tight, min(_NEWTON_STEPS, most)))

    def _moving(self, most: int) -> _Solver:
        return moving_admm(self.tolerance, self.velocity_tolerance, min(_MOVING_ITERATIONS, most))

    def _interior(self, most: int) -> _Solver:
        solver = InteriorPoint(self.tolerance, self.velocity_tolerance, min(_INTERIOR, most))
        # its Newton's method has had its try
        return lambda p, s: solver(p, ContactStart(np.zeros_like(s.impulse), s.velocity))

    def _ending(self, most: int) -> _Solver:
        return _even(Newton(*self._tight, min(_ENDING_STEPS, most)))

    def _last(self, most: int) -> _Solver:
        return _even(ADMM(*self._tight, min(_LAST_ITERATIONS, most), _LAST_PENALTY))

    def _judged(self, problem: ContactProblem, found: ContactSolution, why: str) -> ContactSolution:
        left = residual(problem, found.impulse)
        within = left.within(self.tolerance, self.velocity_tolerance)
        return replace(found, natural_map=left.natural_map, converged=within, why=why)


def _even(solver: _Solver) -> _Solver:
    """The solver, in units in which the contacts of rigid bodies yield alike."""

    def solve(problem: ContactProblem, start: ContactStart) -> ContactSolution:
        if not isinstance(problem.delassus, RigidDelassus):
            return solver(problem, start)
        even, each = equilibrated(problem)
        unit = each[:, None]
        found = solver(even, ContactStart(start.impulse / unit, start.velocity * unit))
        return replace(found, impulse=found.impulse * unit, velocity=found.velocity / unit)

    return solve


def _better(one: ContactSolution, other: ContactSolution) -> ContactSolution:
    """The one that is solved or has the smaller η, with the iterations of both."""
    best = min(one, other, key=lambda solution: (not solution.converged, solution.natural_map))
    return replace(best, iterations=one.iterations + other.iterations)
