"""Central path of contact with friction (Andersen, Roos & Terlaky 2003; Acary, Armand et al. 2023).

With û = u + μ‖u_T‖ n, and the bias in u_free, the laws say that û lies in the cone dual to that of r, and r · û = 0.
Slack s and dual z of the cones turn this into

    W r + u_free + μ‖z_T‖ n = Aᵀ z,     s = A r + (k, 0, 0),     s ∘ z = 0,     A = diag(μ, 1, 1)

which Newton's method follows along the central path s ∘ z = ν e, ν → 0, with Mehrotra's corrector, corrections of the
pairs that are far from the others (Gondzio 1996), and the scaling of Nesterov and Todd. Unlike a cone programme,
Coulomb's friction is no minimum of anything: the derivative of the shift μ‖z_T‖ n belongs to Newton's matrix W + Θ,
which is not symmetric, and the whole converges in some 30 iterations whatever the conditioning of W. Contacts with
cohesion have r_N ≥ 0 as a second cone; without friction it is the only one.
"""

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.problem.problem import ContactProblem
from mechanics.solvers.scales import CORRECTIONS, ROUNDING
from mechanics.solvers.second_order.second_order_cones import (
    Scaling,
    central,
    divide,
    product,
    reach,
    scaling,
    tangential,
    to_bounds,
)

NAME = "interior point"
"""Method in the messages of errors."""

# part of the way to the boundary of the cones that a step goes; on it Newton's matrix is singular [-]
_BACK_OFF = 0.98
# length of a step, over Newton's, below which one towards the middle of the path is tried [-]
_SHORT = 0.2
# factor within which pairs are well centred: of their complementarities on the one wanted, and of the first ones on
# typical impulses and their velocities: a start nearer to the cones takes 19 iterations instead of 13 [-]
_CENTRAL = 10.0


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
        size = tangential(self.dual)
        matrix[:, 0, 1:] -= (self.friction / np.maximum(size, 1e-300))[:, None] * self.dual[:, 1:]
        return matrix

    def velocity(self) -> Array:
        """Return Aᵀ z - μ‖z_T‖ n, the velocity u that the dual asks for."""
        u = self.diagonal * self.dual
        u[:, 0] -= self.friction * tangential(self.dual)
        return u


class CentralPath:
    """Iterates along the central path.

    Parameters
    ----------
    problem : in even units as a rule (`equilibrated`)
    near : (nc, 3) impulses near the solution, as those of the last step, from which it begins; None: far inside the
        cones
    level : complementarity with which it begins there; as small as the impulses are right [-]
    """

    def __init__(self, problem: ContactProblem, start: Array | None = None, level: float = 1.0) -> None:
        self._problem, form = problem, problem.form(NAME)
        # a direction a little wrong costs less than another factorisation
        self._system = partial(form.shifted, exact=False)
        self._free = problem.biased
        mu, k = problem.friction, problem.cohesion
        cone, side = np.flatnonzero((mu > ROUNDING) | (k > 0)), np.flatnonzero((mu <= ROUNDING) | (k > 0))
        self._smooth = np.flatnonzero((mu <= ROUNDING) & (k <= 0))
        self._hold = np.zeros((len(mu), 3, 3))
        self._hold[self._smooth[:, None], [1, 2], [1, 2]] = problem.delassus.scale / ROUNDING
        if start is None:
            self._begin_far(cone, side)
        else:
            self._begin_near(cone, side, start, level)

    def _begin_far(self, cone: Ints, side: Ints) -> None:
        """Begin well inside the cones, with the impulses of contacts that all hold a little."""
        scale, mu, k = self._problem.delassus.scale, self._problem.friction, self._problem.cohesion
        theta = self._hold + scale * np.eye(3)
        self._r = self._system(theta)(-self._free.ravel()).reshape(-1, 3)
        size = float(np.sqrt((self._r**2).mean())) or 1.0
        self._unit = size * size * scale
        slack = mu[cone, None] * self._r[cone] * [1.0, 0.0, 0.0] + self._r[cone] * [0.0, 1.0, 1.0]
        slack[:, 0] += k[cone]
        inside = _CENTRAL * size
        slack[:, 0] = np.maximum(slack[:, 0], tangential(slack) + inside)
        dual = np.tile([inside * scale, 0.0, 0.0], (len(cone), 1))
        self._cone = _Cone(cone, mu[cone], k[cone], slack, dual)
        self._side = _Side(side, np.maximum(self._r[side, 0], inside), np.full(len(side), inside * scale))

    def _begin_near(self, cone: Ints, side: Ints, start: Array, level: float) -> None:
        """Begin on the path itself: with s - z of these impulses and their velocities, and s ∘ z = level e."""
        problem, scale, mu, k = (
            self._problem,
            self._problem.delassus.scale,
            self._problem.friction,
            self._problem.cohesion,
        )
        self._r = start.copy()
        size = float(np.sqrt((start**2).mean())) or 1.0
        self._unit = size * size * scale
        dual = problem.delassus.apply(start) + self._free
        normal = dual[side, 0]
        dual[:, 0] += mu * tangential(dual)
        diagonal = np.column_stack([mu[cone], np.ones((len(cone), 2))])
        point = diagonal * start[cone]
        point[:, 0] += k[cone]
        slack, dual_start = central(
            point - dual[cone] / (np.maximum(diagonal, ROUNDING) * scale), level * size * size
        )
        self._cone = _Cone(cone, mu[cone], k[cone], slack, scale * dual_start)
        point = start[side, 0] - normal / scale
        root = np.sqrt(point**2 + 4.0 * level * size * size)
        self._side = _Side(side, 0.5 * (root + point), 0.5 * scale * (root - point))

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
        level = centring * self._gap
        step = newton.direction(newton.corrected(step, level), 1.0 - centring)
        length = min(1.0, _BACK_OFF * self._reach(step))
        for _ in range(CORRECTIONS):
            if length >= _BACK_OFF:
                break
            right = newton.recentred(step, level)
            direction = tuple(a + b for a, b in zip(step, newton.direction(right, 0.0), strict=True))
            farther = min(1.0, _BACK_OFF * self._reach(direction))
            if farther <= length:
                break
            step, length = direction, farther
        if length < _SHORT:
            direction = newton.direction(newton.centred(0.5 * self._gap), 0.5)
            farther = min(1.0, _BACK_OFF * self._reach(direction))
            if farther > length:
                step, length = direction, farther
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

    def __init__(self, path: CentralPath) -> None:
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
        # impulses that affect no velocity would wander
        theta = path._hold + ROUNDING * problem.delassus.scale * np.eye(3)
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
        complementarity = level - side.slack * side.dual - slack_n * dual_n
        return divide(self._lambda, square), complementarity / side.dual

    def recentred(self, step: tuple[Array, ...], level: float) -> tuple[Array, Array]:
        """Return the right side of a correction: of the pairs that a whole step would leave far from the level."""
        _, slack, dual, slack_n, dual_n = step
        cone, side = self._cone, self._side
        low, high = level / _CENTRAL, _CENTRAL * level
        primal = self._scaling.inverse(cone.slack + slack)
        pairs = product(primal, self._scaling(cone.dual + dual))
        products = (side.slack + slack_n) * (side.dual + dual_n)
        change = np.maximum(np.clip(products, low, high) - products, -high)
        return divide(self._lambda, to_bounds(pairs, low, high)), change / side.dual

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
