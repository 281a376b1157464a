"""Interior-point method for contact with friction: the central path, ended by Newton's method."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.second_order.central_path import NAME, CentralPath
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.second_order.proximal_newton import ProximalNewton
from mechanics.solvers.second_order.scaling import equilibrated
from moma.errors import SolverError

__all__ = ["InteriorPoint"]


# compliance that holds the impulses of open contacts as they are, over the scale of W [-]
_RIGID = 1e9
# part of a step below which it counts as short [-]
_SHORT = 0.1
# complementarities, relative to where it began, at which Newton's method on the natural map tries to end it
_TRIES = (1e-7, 1e-9, 1e-11)
# the same between elastic stones, where it converges from farther away
_ELASTIC_TRIES = (1e-4, 1e-6, 1e-8, 1e-10)
# compliance of every contact with which Newton's method begins between elastic stones at rest, over the scale of W [-]
_HELD = 1e-3
# impulse over the largest from which a contact counts as one that bears [-]
_BEARS = 1e-6
# η from which a try between elastic stones is given up [-]
_HOPELESS = 0.3
# η over the tolerance from which a try that ended by rounding is the last [-]
_ROUNDING = 10.0
# part of a step below which it leads nowhere, however far the solution [-]
_NOWHERE = 1e-3
# short steps in a row after which the path has stalled, and Newton's method is tried
_STUCK = 5
# η and velocity error in even units from which short steps count [-]
_NEARLY = (1e-3, 1e-3)
# iterations after the last try that may gain nothing
_IDLE = 3
# η over the best so far that counts as a gain [-]
_GAIN = 0.9
# impulses, in even units, that only contradictions cause
_WORTHLESS = 1e30
# Newton's steps in one try
_NEWTON = 12
# and between elastic stones, where short steps lead on as well
_ELASTIC_NEWTON = 20
# tolerances of the tries over those asked for, since even units weigh light stones less [-]
_FURTHER = (1.0, 1e-3)


@dataclass(frozen=True)
class InteriorPoint:
    """Central path, followed until the laws hold or Newton's method takes over.

    Both factorise W + Θ in each iteration, in units in which all contacts yield alike (`equilibrated`): masses may
    differ by any factor. W may be singular, as between rigid stones that touch in more points than they need. A start
    from earlier impulses is given to Newton's method at once.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : limit of the iterations of both together
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 100

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve; return the best iterate.

        Raises
        ------
        SolverError : if W is known by its products alone
        """
        problem.form(NAME)
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True)
        end = _End(problem, self.tolerance, self.velocity_tolerance)
        # also without impulses: where no load acts, none are needed
        best = end.looked(start.impulse, 0)
        if not best.converged:
            if end.elastic and best.natural_map > _HOPELESS:
                best = min(best, end.held(start.impulse, self.max_iterations), key=_left)
            elif start.impulse.any():
                best = end.ended(start.impulse, self.max_iterations)
        return best if best.converged or end.rounded else self._along_path(end, best)

    def _along_path(self, end: "_End", best: ContactSolution) -> ContactSolution:
        count, tries, short, idle = best.iterations, list(end.tries), 0, 0
        path = CentralPath(end.even)
        while short < _STUCK and idle < _IDLE and count < self.max_iterations:
            try:
                # where the laws contradict each other impulses grow without bound, until they are no numbers
                with np.errstate(all="ignore"):
                    length = path.advance()
            except SolverError:
                # rounding has won
                break
            count += 1
            if not (np.isfinite(path.complementarity) and np.abs(path.impulse).max() < _WORTHLESS):
                break
            impulse = path.impulse * end.unit[:, None]
            found = end.looked(impulse, 0)
            slow = length < _SHORT and residual(end.even, path.impulse).within(*_NEARLY)
            short = short + 1 if slow or length < _NOWHERE else 0
            near = bool(tries) and path.complementarity < tries[0]
            if not found.converged and (near or short == _STUCK):
                tries = [one for one in tries if not path.complementarity < one]
                ended = end.ended(impulse, self.max_iterations - count)
                count += ended.iterations
                found = min(found, ended, key=_left)
            idle = 0 if tries or found.natural_map < _GAIN * best.natural_map else idle + 1
            best = min(best, found, key=_left)
            if best.converged or end.rounded:
                break
        return replace(best, iterations=count)


def _left(solution: ContactSolution) -> tuple[bool, float]:
    return not solution.converged, solution.natural_map


class _End:
    """Newton's method on the natural map in even units, judged in the problem's own."""

    def __init__(self, problem: ContactProblem, tolerance: float, velocity_tolerance: float) -> None:
        self.problem, self.limits = problem, (tolerance, velocity_tolerance)
        self.even, self.unit = equilibrated(problem)
        self.elastic, self.rounded = problem.delassus.rigid is None, False
        self.tries = _ELASTIC_TRIES if self.elastic else _TRIES

    def held(self, start: Array, most: int) -> ContactSolution:
        """Begin as if each contact with an impulse in `start`, all where none has, held with a little compliance.

        Elastic stones at rest under their weight leave few contacts: those open and slide that press least. In a
        second step from rest all that bears holds: the impulses of the first are right, but W is so large that whole
        stones fly off by the next to nothing that these lack. Newton's method ends it.
        """
        even, unit = self.even, self.unit[:, None]
        form, scale, impulse = even.form(NAME), even.delassus.scale, start / unit
        size = np.sqrt((impulse**2).sum(axis=1))
        # all of them where none has an impulse
        bears = size >= _BEARS * size.max()
        theta = scale * np.where(bears, _HELD, _RIGID)[:, None, None] * np.eye(3)
        left = even.delassus.apply(impulse) + even.biased
        impulse += form.shifted(theta)(-left.ravel()).reshape(-1, 3)
        found = self.ended(impulse * unit, most - 1)
        return replace(found, iterations=found.iterations + 1)

    def looked(self, impulse: Array, iterations: int) -> ContactSolution:
        """Return these impulses (nc, d) as a solution, judged in the problem's own units."""
        left = residual(self.problem, impulse)
        return ContactSolution(impulse, left.dual, iterations, left.natural_map, left.within(*self.limits))

    def ended(self, impulse: Array, most: int) -> ContactSolution:
        """Continue from these impulses to ever smaller tolerances, until the problem itself is solved."""
        unit, count = self.unit[:, None], 0
        found = self.looked(impulse, 0)
        for further in _FURTHER:
            if count >= most or found.converged:
                break
            limits = further * self.limits[0], further * self.limits[1]
            begin, rounded = ContactStart(found.impulse / unit, found.velocity), False
            if self.elastic:
                even, rounded = Newton(*limits, _ELASTIC_NEWTON, _HOPELESS).ended(self.even, begin)
            else:
                even = ProximalNewton(*limits, _NEWTON)(self.even, begin)
            count += even.iterations
            found = min(found, self.looked(even.impulse * unit, 0), key=_left)
            if not even.converged:
                # a path would come to the same
                self.rounded = rounded and found.natural_map <= _ROUNDING * self.limits[0]
                break
        return replace(found, iterations=count)
