"""An interior-point method for contact with friction (Andersen, Roos & Terlaky 2003; Acary, Armand et al. 2023).

With û = u + μ‖u_T‖ n, and the bias in u_free, the laws say that û lies in the cone dual to that of r, and r · û = 0.
Slack s and dual z of the cones turn this into

    W r + u_free + μ‖z_T‖ n = Aᵀ z,     s = A r + (k, 0, 0),     s ∘ z = 0,     A = diag(μ, 1, 1)

which Newton's method follows along the central path s ∘ z = ν e, ν → 0, with Mehrotra's corrector and the scaling of
Nesterov and Todd. Unlike a cone programme, Coulomb's friction is no minimum of anything: the derivative of the shift
μ‖z_T‖ n belongs to Newton's matrix W + Θ, which is not symmetric, and the whole converges in some 30 iterations
whatever the conditioning of W. Contacts with cohesion have r_N ≥ 0 as a second cone; without friction it is the only
one.
"""

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.second_order.proximal_newton import ProximalNewton
from mechanics.solvers.second_order.scaling import equilibrated
from mechanics.solvers.second_order.second_order_cones import Scaling, divide, product, reach, scaling
from moma.errors import SolverError

__all__ = ["InteriorPoint"]


_NAME = "interior point"
# friction below which a contact has no cone, only a side [-]
_SMOOTH = 1e-9
# compliance that holds impulses as they are: tangential ones of contacts without friction, and those of open contacts,
# over the scale of W [-]
_RIGID = 1e9
# part of the way to the boundary that a step goes [-]
_BACK_OFF = 0.98
# part of a step below which it counts as short [-]
_SHORT = 0.1
# distance of the start from the cones, over typical impulses and the velocities that they cause: nearer, the first
# steps are short (measured: 13 iterations instead of 19) [-]
_INSIDE = 10.0
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
# compliance of the impulses that have no effect on any velocity, over the scale of W: without it they wander [-]
_GIVE = 1e-10


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
        problem.form(_NAME)
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
        path = _Path(end.even)
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
        form, scale, impulse = even.form(_NAME), even.delassus.scale, start / unit
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


@dataclass
class _Side:
    """The conditions r_N ≥ 0 of some contacts: slack and dual."""

    rows: Ints
    slack: Array
    dual: Array


@dataclass
class _Cone:
    """The friction cones of some contacts: slack and dual."""

    rows: Ints
    friction: Array
    cohesion: Array
    slack: Array
    dual: Array
    diagonal: Array = field(init=False)

    def __post_init__(self) -> None:
        self.diagonal = np.column_stack([self.friction, np.ones((len(self.rows), 2))])

    def transpose(self) -> Array:
        """Return Aᵀ - n ∂(μ‖z_T‖)/∂z (n, 3, 3), the derivative of the balance of velocities by z."""
        matrix = self.diagonal[:, :, None] * np.eye(3)
        size = np.sqrt((self.dual[:, 1:] ** 2).sum(axis=1))
        matrix[:, 0, 1:] -= (self.friction / np.maximum(size, 1e-300))[:, None] * self.dual[:, 1:]
        return matrix

    def velocity(self) -> Array:
        """Return Aᵀ z - μ‖z_T‖ n, the velocity u that the dual asks for."""
        u = self.diagonal * self.dual
        u[:, 0] -= self.friction * np.sqrt((self.dual[:, 1:] ** 2).sum(axis=1))
        return u


class _Path:
    """Iterates along the central path."""

    def __init__(self, problem: ContactProblem) -> None:
        self._problem, form = problem, problem.form(_NAME)
        # a direction a little wrong costs less than another factorisation
        self._system = partial(form.shifted, exact=False)
        scale = problem.delassus.scale
        self._free = problem.biased
        mu, k = problem.friction, problem.cohesion
        cone, side = np.flatnonzero((mu > _SMOOTH) | (k > 0)), np.flatnonzero((mu <= _SMOOTH) | (k > 0))
        self._smooth = np.flatnonzero((mu <= _SMOOTH) & (k <= 0))
        self._hold = np.zeros((len(mu), 3, 3))
        self._hold[self._smooth[:, None], [1, 2], [1, 2]] = _RIGID * scale
        theta = self._hold + scale * np.eye(3)
        self._r = self._system(theta)(-self._free.ravel()).reshape(-1, 3)
        size = float(np.sqrt((self._r**2).mean())) or 1.0
        self._unit = size * size * scale
        slack = mu[cone, None] * self._r[cone] * [1.0, 0.0, 0.0] + self._r[cone] * [0.0, 1.0, 1.0]
        slack[:, 0] += k[cone]
        inside = _INSIDE * size
        slack[:, 0] = np.maximum(slack[:, 0], np.sqrt((slack[:, 1:] ** 2).sum(axis=1)) + inside)
        dual = np.tile([inside * scale, 0.0, 0.0], (len(cone), 1))
        self._cone = _Cone(cone, mu[cone], k[cone], slack, dual)
        self._side = _Side(side, np.maximum(self._r[side, 0], inside), np.full(len(side), inside * scale))

    @property
    def complementarity(self) -> float:
        """s · z per cone, over that of a typical impulse and the velocity that it causes [-]."""
        return self._gap / self._unit

    @property
    def impulse(self) -> Array:
        """r (nc, 3), inside the cones except for what the slacks still lack [N s]."""
        r = self._r.copy()
        r[self._smooth, 1:] = 0.0
        return r

    @property
    def _gap(self) -> float:
        cone, side = self._cone, self._side
        total = float((cone.slack * cone.dual).sum() + side.slack @ side.dual)
        return total / (len(cone.rows) + len(side.rows))

    def advance(self) -> float:
        """Make one iteration of predictor and corrector; return the length of its step."""
        newton = _Newton(self)
        step = newton.direction(newton.towards_boundary(), 1.0)
        length = min(1.0, self._reach(step))
        # the gain of the predictor decides how much centring is needed (Mehrotra 1992)
        centring = (1.0 - length) ** 3
        step = newton.direction(newton.corrected(step, centring * self._gap), 1.0 - centring)
        length = min(1.0, _BACK_OFF * self._reach(step))
        if length < 2.0 * _SHORT:
            other = newton.direction(newton.centred(0.5 * self._gap), 0.5)
            farther = min(1.0, _BACK_OFF * self._reach(other))
            if farther > length:
                step, length = other, farther
        r, slack, dual, slack_n, dual_n = step
        self._r += length * r
        self._cone.slack += length * slack
        self._cone.dual += length * dual
        self._side.slack += length * slack_n
        self._side.dual += length * dual_n
        return length

    def _reach(self, step: tuple[Array, ...]) -> float:
        _, slack, dual, slack_n, dual_n = step
        cone, side = self._cone, self._side
        ends = [reach(cone.slack, slack), reach(cone.dual, dual)]
        for value, change in ((side.slack, slack_n), (side.dual, dual_n)):
            falls = change < 0
            ends.append(float((value[falls] / -change[falls]).min(initial=np.inf)))
        return min(ends)


class _Newton:
    """Newton's equations at one iterate, factorised."""

    def __init__(self, path: _Path) -> None:
        self._cone, self._side = cone, side = path._cone, path._side
        problem, r = path._problem, path._r
        target = np.zeros_like(r)
        target[cone.rows] += cone.velocity()
        target[side.rows, 0] += side.dual
        # tangential velocities of contacts without friction are free
        balance = problem.delassus.apply(r) + path._free - target
        balance[path._smooth, 1:] = 0.0
        self._balance = balance
        self._loose = cone.slack - cone.diagonal * r[cone.rows]
        self._loose[:, 0] -= cone.cohesion
        self._loose_n = side.slack - r[side.rows, 0]
        self._scaling: Scaling = scaling(cone.slack, cone.dual)
        self._lambda = self._scaling(cone.dual)
        self._square, self._back = self._scaling.inverse_squared, cone.transpose()
        theta = path._hold + _GIVE * problem.delassus.scale * np.eye(3)
        theta[cone.rows] += self._back @ self._square * cone.diagonal[:, None, :]
        theta[side.rows, 0, 0] += side.dual / side.slack
        self._solve = path._system(theta)

    def towards_boundary(self) -> tuple[Array, Array]:
        """Return the right side of the predictor: s ∘ z = 0."""
        return -self._lambda, -self._side.slack

    def centred(self, level: float) -> tuple[Array, Array]:
        """Return the right side of a step to s ∘ z = level e, without a corrector."""
        square = -product(self._lambda, self._lambda)
        square[:, 0] += level
        return divide(self._lambda, square), (level - self._side.slack * self._side.dual) / self._side.dual

    def corrected(self, predictor: tuple[Array, ...], level: float) -> tuple[Array, Array]:
        """Return the right side of the corrector, from the predictor's step."""
        _, slack, dual, slack_n, dual_n = predictor
        square = -product(self._lambda, self._lambda)
        square -= product(self._scaling.inverse(slack), self._scaling(dual))
        square[:, 0] += level
        side = self._side
        own = level - side.slack * side.dual - slack_n * dual_n
        return divide(self._lambda, square), own / side.dual

    def direction(self, right: tuple[Array, Array], share: float) -> tuple[Array, ...]:
        """Return the changes of r, of slack and dual of the cones, and of the sides, for a share of the residuals."""
        cone, side = self._cone, self._side
        in_cone, in_side = self._scaling(right[0]) + share * self._loose, right[1] + share * self._loose_n
        load = -share * self._balance
        load[cone.rows] += np.einsum("cij,cj->ci", self._back @ self._square, in_cone)
        load[side.rows, 0] += side.dual / side.slack * in_side
        r = self._solve(load.ravel()).reshape(-1, 3)
        slack = cone.diagonal * r[cone.rows]
        dual = np.einsum("cij,cj->ci", self._square, in_cone - slack)
        slack_n = r[side.rows, 0]
        dual_n = side.dual / side.slack * (in_side - slack_n)
        return r, slack - share * self._loose, dual, slack_n - share * self._loose_n, dual_n
