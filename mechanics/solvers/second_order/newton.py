"""Newton's method for all kinds of bodies, however many contacts two of them share.

W of rigid bodies is singular: four contacts hold a stone in place three times over. So W + α stands for W in the
derivative of the non-smooth Newton method of Alart & Curnier (1991), with α as small as η, as in the method of
Levenberg and Marquardt (Fan & Yuan 2005): the steps stay near to where they began, and near the solution nothing is
lost. A line search keeps them from going astray; where it has to shorten steps, α grows. From nothing it begins with
the forces of joints that yield a little and hold everywhere: self-stress that no load causes is left out.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers._kernels.body_newton import alart_curnier
from mechanics.solvers.scales import HELD, ROUNDING
from mechanics.solvers.second_order.newton_equations import Equations, equations_of
from mechanics.solvers.second_order.scaling import equilibrated

# α over η and the scale of W, at first and at least: α falls with η, so convergence stays fast (Fan & Yuan 2005) [-]
_SHARE = 0.1
# η above which a start is far from a solution, and the contacts that bear are held first [-]
_FAR_RESIDUAL = 0.3
# smallest α over the scale of W: rounding in self-stress is ε/α of it, and α itself as large [-]
_MIN_PROXIMAL_WEIGHT = float(np.sqrt(np.finfo(float).eps))
# factor by which α grows after steps shortened by more than that, and falls after whole ones [-]
_ADAPT = 4.0
# iterates whose worst merit a step must improve on (Grippo, Lampariello & Lucidi 1986)
_MEMORY = 5
# shortest part of a step, taken even where it gains nothing: it leads away from a kink [-]
_SHORTEST = 1e-3
# steps with the least α that may gain nothing
_IDLE = 1
_SPACE = 3  # components of an impulse in space


@dataclass(frozen=True)
class Newton:
    """Proximal Newton method: high accuracy, in units in which all contacts yield alike.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : limit of the steps, with a factorisation each as a rule
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 100

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`; return the best of all iterates.

        Raises
        ------
        SolverError : if W is known by its products alone
        """
        if len(start.impulse) == 0:
            return ContactSolution(start.impulse, start.velocity, 0, 0.0, True)
        limits = self.tolerance, self.velocity_tolerance
        run = _Run(problem, start.impulse)
        best, idle = (run.left, run.r), 0
        if run.left.natural_map > _FAR_RESIDUAL:
            run.hold()
        while True:
            gains = run.left.natural_map < best[0].natural_map
            best = (run.left, run.r) if gains else best
            # where α is least each step gains until rounding wins
            idle = 0 if gains or not run.exact else idle + 1
            solved = run.left.within(*limits)
            if solved or idle > _IDLE or run.iterations >= self.max_iterations or not run.step():
                break
        remaining, impulse = (run.left, run.r) if run.left.within(*limits) else best
        return ContactSolution(
            run.unit * impulse,
            remaining.dual,
            run.iterations,
            remaining.natural_map,
            remaining.within(*limits),
        )


class _Run:
    """Iterates of one solution, in units in which all contacts yield alike.

    Attributes
    ----------
    unit : (nc, 1) of the impulses [√kg]
    r : (nc, 3) impulses in these units
    left : residual of the problem itself
    iterations : steps so far
    exact : the last one had the least α
    """

    def __init__(self, unscaled: ContactProblem, impulse: Array) -> None:
        self.exact, self._given = False, unscaled
        problem, each = equilibrated(unscaled)
        self.unit = each[:, None]
        impulse = impulse / self.unit
        self._problem, self._delassus = problem, problem.delassus
        self._free = problem.biased
        self._scale = problem.delassus.scale
        diagonals = np.einsum("cii->ci", problem.delassus.diagonal)
        across, along = diagonals[:, 0], diagonals[:, 1:].mean(axis=1)
        if self._scale < diagonals.min():
            # W is measured against its elastic part: with the far larger motion of whole stones in ρ, impulses alone
            # would tell which contacts are open
            across = along = np.full(len(diagonals), self._scale)
        self._rho = 1.0 / np.column_stack([across, along])
        size = diagonals.shape[1]
        self._first, self._second = np.zeros((2, len(impulse), size, size))
        self._merits: list[float] = []
        self.iterations, self._share = 0, _SHARE
        self._take(impulse)

    def _take(self, impulse: Array) -> None:
        self.r, self.left = impulse, residual(self._given, self.unit * impulse)
        self._error = np.empty_like(impulse)
        self._u = self._delassus.apply(impulse) + self._free
        self._merits.append(self._look(impulse, self._u, self._error))

    @cached_property
    def _system(self) -> Equations:
        return equations_of(self._problem, self._rho)

    def hold(self) -> None:
        """Begin as if each contact that bears held with a little compliance: all of them from nothing.

        At rest without impulses only the lowest contact is seen to be pressed, and each step would find one more. In a
        later step of 1 s the impulses are right, but whole stones would fly off by the next to nothing that these lack.
        """
        size = np.sqrt((self.r**2).sum(axis=1))
        bears = (size >= ROUNDING * size.max())[:, None]
        unit = np.eye(self.r.shape[1])
        self._first[:], self._second[:] = ~bears[:, :, None] * unit, bears[:, :, None] * unit
        step = self._system.step(self._first, self._second, bears * self._u, HELD * self._scale)
        if step is None:
            return
        self.iterations += 1
        # not projected on the cones, which would break the balance: it tells the states apart
        self._merits.clear()
        self._take(self.r + step)

    def step(self) -> bool:
        """Make one step of Newton's method; return whether there was one."""
        alpha = max(self._share * min(self.left.natural_map, 1.0), _MIN_PROXIMAL_WEIGHT)
        self.exact = alpha == _MIN_PROXIMAL_WEIGHT
        alpha *= self._scale
        step = self._system.step(self._first, self._second, self._error, alpha)
        if step is None:
            return False
        self.iterations += 1
        change = self._delassus.apply(step)
        length, limit, error = 1.0, max(self._merits[-_MEMORY:]), np.empty_like(step)
        merit = self._look(self.r + step, self._u + change, error)
        while not merit < limit and length > _SHORTEST:
            length *= 0.5
            merit = self._look(self.r + length * step, self._u + length * change, error)
        if not np.isfinite(merit):
            return False
        if length < 1.0 / _ADAPT:
            self._share *= _ADAPT
        elif length == 1.0:
            self._share = max(self._share / _ADAPT, _SHARE)
        self._take(self.r + length * step)
        return True

    def _look(self, r: Array, u: Array, error: Array) -> float:
        problem = self._problem
        laws = problem.friction, problem.cohesion, self._rho
        if r.shape[1] == _SPACE:
            merit: float = alart_curnier(r, u, *laws, error, self._first, self._second)
            return merit
        # the plane is space without its second tangent
        wide = [np.pad(values, ((0, 0), (0, 1))) for values in (r, u, error)]
        derivative = np.zeros((2, len(r), _SPACE, _SPACE))
        merit = alart_curnier(*wide[:2], *laws, wide[2], *derivative)
        error[:], self._first[:], self._second[:] = wide[2][:, :2], *derivative[:, :, :2, :2]
        return merit
