"""Limit load by the rule that judges runs: the largest load under which one step from rest moves nothing.

The contact problem of a step from rest under p + λ q is solved from nothing, as that of a run is:

    u = W r + h Hᵀ M⁻¹ (p + λ q),      (u_α, r_α) satisfies its law for every contact α

Joints are closed, so h is a unit: stones at rest under λ rest whatever the step. Where u vanishes the load is borne,
else the stones begin to fall with velocities v, and the balance of power

    v·M v = h (p + λ q)·v - D

says with the dissipation D at which load the same mechanism would stop: λ - v·M v / (h q·v). The search goes down to
such estimates, which are borne as a rule, and up by steps until a bracket is left to be halved.

Only whole multiples of a thousandth of the bound are tried. So the answer is the same to the last digit however stones
are turned and numbered, unless one of these loads lies within rounding of the limit.
"""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.limit_load import LimitLoad, Mechanism, mechanism
from mechanics.limit.live_loads import LiveLoad
from mechanics.model.rigid import inverse_inertia_world
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.chain import follow
from mechanics.solvers.kinds import standing_chain
from mechanics.solvers.second_order.newton import Newton

__all__ = ["WIDTH", "HeldLimit", "held_limit"]

WIDTH = 1e-3
"""Width of the bracket over the bound [-]: friction without dilatancy decides no limit more closely."""

# velocity of a contact over the largest u_free from which it moves: steps solved to their tolerance leave up to a
# third of it [-]
_MOVES = 1e-3
# tolerances of η and of velocities, and iterations of all methods of one problem
_LIMITS, _ITERATIONS = (Newton.tolerance, Newton.velocity_tolerance), 1500
# step up from a load that is borne, over it, doubled each time that it is borne: with Coulomb's friction stones bear up
# to 2 % more than the load at which their mechanism would stop [-]
_UP = 0.02
# loads that are tried up to the bound
_LOADS = round(1.0 / WIDTH)
# first load that is tried where the bound is endless, and how often it is doubled before nothing limits it
_FIRST, _DOUBLED = 1.0, 10


@dataclass(frozen=True)
class HeldLimit:
    """Limit load by the rule of runs.

    Attributes
    ----------
    held : largest λ that is known to be borne; 0: none, infinite: nothing limits it [-]
    lost : least λ that is known to be too much: the bound, or a step that falls [-]
    force : (nc, 3) on the candidate of each contact under `held`, local frame [N]
    mechanism : velocities of the step that falls under `lost`; None where only the bound says that it is lost
    problems : contact problems that were solved
    """

    held: float
    lost: float
    force: Array
    mechanism: Mechanism | None
    problems: int


@dataclass(frozen=True)
class _Bracket:
    """Loads between which the limit lies, as multiples of a unit.

    Attributes
    ----------
    low, high : of what is held, and of what is lost
    unit : of both; infinite where nothing limits the load [-]
    best, worst : the steps under both; no worst one where only the bound says that it is lost
    problems : contact problems that were solved
    """

    low: int
    high: int
    unit: float
    best: "_Trial"
    worst: "_Trial | None"
    problems: int


@dataclass(frozen=True)
class _Trial:
    """Step from rest under one load.

    Attributes
    ----------
    holds : nothing moves
    stops : load at which its mechanism would stop [-]
    force : (nc, 3) [N]
    velocity : (n, 6) of the free stones after 1 s
    error : velocity by which contacts break their laws over the largest of a contact [-]
    """

    holds: bool
    stops: float
    force: Array
    velocity: Array
    error: float


def held_limit(on: RigidAssembly, live: LiveLoad, bound: LimitLoad) -> HeldLimit:
    """Return between which loads the limit of stones at rest lies, below the bound of associative friction.

    Raises
    ------
    SolverError : a problem has no solution that any method finds
    """
    steps = _Steps(on, live)
    nothing = steps(0.0)
    if not bound.multiplier > 0.0 or not nothing.holds:
        return HeldLimit(0.0, 0.0, nothing.force, _falling(on, nothing), 1)
    begun = _Bracket(0, _LOADS, bound.multiplier * WIDTH, nothing, None, 1)
    last = _searched(steps, _limited(steps, begun) if np.isinf(bound.multiplier) else begun)
    worst = None if last.worst is None else _falling(on, last.worst)
    return HeldLimit(last.low * last.unit, last.high * last.unit, last.best.force, worst, last.problems)


def _limited(steps: "_Steps", bracket: "_Bracket") -> "_Bracket":
    """Return the bracket below the first load that falls, doubled again and again; an endless one if none does."""
    best, low, problems = bracket.best, 0, bracket.problems
    for doubled in range(_DOUBLED + 1):
        load = _FIRST * 2.0**doubled
        trial = steps(load)
        problems += 1
        if not trial.holds:
            return _Bracket(low, _LOADS, load * WIDTH, best, trial, problems)
        best, low = trial, _LOADS // 2
    return replace(bracket, low=_LOADS, best=best, problems=problems)


def _searched(steps: "_Steps", bracket: "_Bracket") -> "_Bracket":
    """Return the bracket of neighbouring loads, next to the bound first."""
    low, high, unit = bracket.low, bracket.high, bracket.unit
    best, worst, problems, up = bracket.best, bracket.worst, bracket.problems, _UP
    load = high - 1 if worst is None else int(worst.stops / unit)
    while high - low > 1:
        load = min(max(load, low + 1), high - 1)
        trial = steps(load * unit)
        problems += 1
        middle = (load + high) // 2 if trial.holds else (low + load) // 2
        if trial.holds:
            low, best = load, trial
            load, up = min(int((1.0 + up) * low), middle), 2.0 * up
        else:
            high, worst = load, trial
            stops = int(trial.stops / unit)
            load = stops if stops > low else middle
    return _Bracket(low, high, unit, best, worst, problems)


def _falling(on: RigidAssembly, trial: _Trial) -> Mechanism:
    return mechanism(on, trial.velocity, still=10.0 * trial.error)


class _Steps:
    """Steps from rest of one assembly under any multiple of a load; W is made once."""

    def __init__(self, on: RigidAssembly, live: LiveLoad) -> None:
        self._on, self._dead, self._live = on, on.dead, live(on)
        self._operator = on.operator
        self._free = self._motion(self._dead), self._motion(self._live)
        self._pull = np.zeros((len(on.contacts), 3))
        self._pull[:, 0] = on.strength.tension

    def __call__(self, multiplier: float) -> _Trial:
        """Return the step under λ."""
        (dead, live), on = self._free, self._on
        free = dead + multiplier * live
        u_free = self._operator.relative_velocity(free) - self._operator.apply(self._pull)
        strength, none = on.strength, np.zeros(len(u_free))
        problem = ContactProblem(
            self._operator, u_free, none, strength.friction, strength.cohesion, strength.tension
        )
        start = ContactStart(np.zeros_like(u_free), np.zeros_like(u_free))
        found = follow(standing_chain(problem), problem, start, _LIMITS, _ITERATIONS)
        force = found.impulse - self._pull
        fastest = float(np.abs(self._operator.apply(found.impulse) + u_free).max())
        pace = float(np.abs(u_free).max()) or 1.0
        velocity = (free + self._operator.rigid_change(force))[on.free]
        load = self._dead + multiplier * self._live
        gained = float(velocity.ravel() @ (load + on.lift @ force.ravel()))
        power = float(velocity.ravel() @ self._live)
        return _Trial(
            holds=fastest <= _MOVES * pace,
            stops=multiplier - gained / power if power > 0.0 else 0.0,
            force=force,
            velocity=velocity,
            error=residual(problem, found.impulse).velocity * pace / (fastest or 1.0),
        )

    def _motion(self, load: Array) -> Array:
        """Return the velocities (nb, 6) that a load (6 n,) gives to stones without joints in 1 s."""
        model, velocity = self._on.model, np.zeros((len(self._on.model.mass), 6))
        velocity[self._on.free] = load.reshape(-1, 6)
        turn = inverse_inertia_world(model.inertia, self._on.state.rotation)
        velocity[:, :3] *= model.inertia.inverse_mass[:, None]
        velocity[:, 3:] = (turn @ velocity[:, 3:, None])[..., 0]
        return velocity
