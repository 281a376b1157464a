"""Limit load by the rule that judges runs: the largest load under which one step from rest moves nothing.

The contact problem of a step from rest under p + λ q is solved from nothing, as that of a run is:

    u = W r + h Hᵀ M⁻¹ (p + λ q),      (u_α, r_α) satisfies its law for every contact α

Joints are closed, so h is a unit: stones at rest under λ rest whatever the step. Where u vanishes the load is borne,
else the stones begin to fall with velocities v, and the balance of power

    v·M v = h (p + λ q)·v - D

says with the dissipation D at which load the same mechanism would stop: λ - v·M v / (h q·v). The search goes down to
such estimates, which are borne as a rule, and up by steps until a bracket is left to be halved.

Only round loads are tried: multiples of 1, 2 or 5 · 10ᵏ, two thousandths of the bound apart at most. So the answer is
the same to the last digit however stones are turned and numbered, unless one of these loads lies within rounding of the
limit, and it is a load that was tried as it is written.

Between the load at which a mechanism stops and the limit, stones may rest or move by the same law. So loads down to a
hundredth below the limit are tried too, and one that falls lowers it. Where the step that falls is not solved,
methods and steps decide what holds from the load at which its motion would stop.

A run asks of a rest whether forces that arise from nothing between joints that yield bring it about, and else goes on
from these. So does the load that is found; where stones surely move then, as one does that stands on an edge wedged
between its neighbours, the search is made again by what such a step says.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import cycle

import numpy as np

from mechanics.arrays import Array
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.limit_load import LimitLoad, Mechanism, mechanism
from mechanics.limit.live_loads import LiveLoad
from mechanics.model.rigid import inverse_inertia_world
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.auto import Auto
from mechanics.solvers.chain import Link, follow
from mechanics.solvers.from_nothing import rests_from_nothing
from mechanics.solvers.kinds import FURTHER, chain_of, standing_chain
from mechanics.solvers.scales import ROUNDING
from mechanics.solvers.second_order.newton import Newton

WIDTH = 2e-3
"""Width of the bracket over the bound, at most [-]: friction without dilatancy decides no limit more closely."""

# velocity of a contact over the largest u_free from which it moves: steps solved to their tolerance leave up to a
# third of it [-]
_MOVES = 1e-3
# the same of steps that are solved so well that their motion is no error, as methods go that far below their tolerance;
# and by what contacts break their laws there, over the fastest one: stones may move a hundred times as fast [-]
_CREEPS, _SURE = FURTHER * _MOVES, 1e-2
# tolerances of η and of velocities, and iterations of all methods of one problem
_LIMITS, _ITERATIONS = (Newton.tolerance, Newton.velocity_tolerance), Auto.max_iterations
# share of a load within which loads beside it are tried: up from one to begin with that is held, and below the limit
_BESIDE = 0.01
# first load that is tried where the bound is endless; it is doubled up to one over the width before nothing limits it,
# and made smaller down to the width
_FIRST = 1.0


@dataclass(frozen=True)
class HeldLimit:
    """Limit load by the rule of runs.

    Attributes
    ----------
    held : largest λ that a step from rest bears; 0: none but the dead load, infinite: nothing limits it [-]
    lost : least λ that is known to be too much: the bound, or a step that falls; 0: the dead load is [-]
    force : (nc, 3) on the candidate of each contact under `held`, local frame [N]
    mechanism : velocities of the step that falls under `lost`; None where only the bound says that it is lost
    problems : contact problems that were solved
    sure : the same as `held`; where the step that falls is not solved, the load at which its motion would stop, from
        which methods and steps decide what holds [-]
    """

    held: float
    lost: float
    force: Array
    mechanism: Mechanism | None
    problems: int
    sure: float


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


def held_limit(
    on: RigidAssembly, live: LiveLoad, bound: LimitLoad, candidate: float | None = None
) -> HeldLimit:
    """Return between which loads the limit of stones at rest lies, below the bound of associative friction.

    The search begins next to the bound, or at a `candidate` where that lies lower.

    Raises
    ------
    SolverError : a problem has no solution that any method finds
    """
    steps = _Steps(on, live)
    nothing = steps(0.0)
    if not bound.multiplier > 0.0 or not nothing.holds:
        return HeldLimit(0.0, 0.0, nothing.force, _falling(on, nothing), 1, 0.0)
    if np.isinf(bound.multiplier):
        return _without_bound(on, steps, nothing)
    search = _Search(steps, _unit(bound.multiplier), {0: nothing})
    # a load within rounding of the bound would be held or lost by chance
    high = int(bound.multiplier / search.unit + 0.5)
    first = high - 1
    if candidate is not None and candidate < (1.0 - _BESIDE) * bound.multiplier:
        # in whole hundredths of the bound, as forms of a scene agree on a candidate to 0.2 %
        first = int(_BESIDE * int(candidate / (_BESIDE * bound.multiplier)) * high)
    limit = _lasting(on, steps, search, search.limit(on, 0, high, first))
    return limit if limit.mechanism is not None else replace(limit, lost=bound.multiplier)


def _without_bound(on: RigidAssembly, steps: "_Steps", nothing: _Trial) -> HeldLimit:
    """Return the limit below the first load that falls, doubled again and again; an endless one if none does.

    Where the first load of all falls, loads of 5, 2 and 1 · 10ᵏ below it are tried until one holds: the width is then
    one of the limit, too.
    """
    carried, best, load, problems = 0.0, nothing, _FIRST, 1
    while load * WIDTH <= _FIRST:
        trial = steps(load)
        problems += 1
        if not trial.holds:
            smaller = cycle((0.5, 0.4, 0.5))
            while carried == 0.0 and load > WIDTH * _FIRST:
                less = next(smaller) * load
                lower = steps(less)
                problems += 1
                if lower.holds:
                    carried, best = less, lower
                else:
                    load, trial = less, lower
            unit = _unit(load)
            low, high = round(carried / unit), round(load / unit)
            tried = {0: nothing, low: best, high: trial}
            search = _Search(steps, unit, dict(tried))
            limit = _lasting(on, steps, search, search.limit(on, low, high, None))
            return replace(limit, problems=problems + limit.problems - len(tried))
        carried, best, load = load, trial, 2.0 * load
    return HeldLimit(np.inf, np.inf, best.force, None, problems, np.inf)


def _lasting(on: RigidAssembly, steps: "_Steps", search: "_Search", limit: HeldLimit) -> HeldLimit:
    """Return a limit; where stones surely move after the step that it holds, as steps that are followed give it."""
    falling = steps.released(limit.held) if limit.held else None
    if falling is None:
        return limit
    high = round(limit.held / search.unit)
    tried = {0: search.tried[0], high: falling}
    again = replace(search, steps=steps.followed, tried=tried).limit(on, 0, high, None)
    return replace(again, problems=limit.problems + again.problems)


def _unit(load: float) -> float:
    """Return the largest of 1, 2 and 5 · 10ᵏ that is no more than two thousandths of a load."""
    most = WIDTH * load * (1.0 + ROUNDING)
    power = 10.0 ** np.floor(np.log10(most))
    return float(power * max(digit for digit in (1.0, 2.0, 5.0) if digit * power <= most))


def _falling(on: RigidAssembly, trial: _Trial) -> Mechanism:
    return mechanism(on, trial.velocity, still=10.0 * trial.error)


@dataclass(frozen=True)
class _Search:
    """Search among the multiples of a unit.

    Attributes
    ----------
    steps : from rest under any load
    unit : of loads [-]
    tried : the step under each multiple that was tried
    """

    steps: Callable[[float], _Trial]
    unit: float
    tried: dict[int, _Trial]

    def limit(self, on: RigidAssembly, low: int, high: int, first: int | None) -> HeldLimit:
        """Return the limit between multiples of which the lower is held and the higher lost.

        Parameters
        ----------
        on : the stones
        low, high : of which the higher is the bound where it has not been tried
        first : to be tried first; None: where the mechanism of the higher would stop
        """
        low, high = self._neighbours(low, high, first)
        while fallen := [load for load in self._below(low) if not self._holds(load)]:
            high = min(fallen)
            low, high = self._neighbours(max(load for load in self.tried if load < high), high, None)
        best, worst = self.tried[low], self.tried.get(high)
        falls = None if worst is None else _falling(on, worst)
        held = sure = self._load(low)
        if worst is not None and worst.error > _SURE:
            sure = min(sure, max(worst.stops, 0.0))
        return HeldLimit(held, self._load(high), best.force, falls, len(self.tried), sure)

    def _below(self, low: int) -> Iterator[int]:
        """Yield multiples below one, ever farther, down to a hundredth of it."""
        step = 1
        while step <= max(_BESIDE * low, 1.0) and step < low:
            yield low - step
            step *= 2

    def _neighbours(self, low: int, high: int, first: int | None) -> tuple[int, int]:
        """Return neighbouring multiples of which the lower is held and the higher lost."""
        load = self._stops(low, high) if first is None else first
        # a load at which a mechanism stops lies next to the limit
        step = 1 if first is None else max(1, int(_BESIDE * first))
        while high - low > 1:
            load = min(max(load, low + 1), high - 1)
            if self._holds(load):
                low, load, step = load, min(load + step, (load + high) // 2), 2 * step
            else:
                high, step = load, 1
                load = self._stops(low, high)
        return low, high

    def _stops(self, low: int, high: int) -> int:
        """Return the multiple at which the mechanism of the higher would stop, or the one above the lower."""
        return max(int(self.tried[high].stops / self.unit), low + 1)

    def _holds(self, load: int) -> bool:
        if load not in self.tried:
            self.tried[load] = self.steps(self._load(load))
        return self.tried[load].holds

    def _load(self, load: int) -> float:
        """Return a multiple of the unit, as it is written in decimals."""
        return float(f"{load * self.unit:.8g}")


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
        problem, free = self._problem(multiplier)
        return self._trial(multiplier, problem, free, standing_chain(problem), np.zeros_like(problem.u_free))

    def followed(self, multiplier: float) -> _Trial:
        """Return the step under λ, or the one after it where stones surely move in that alone."""
        trial = self(multiplier)
        return (self.released(multiplier) or trial) if trial.holds else trial

    def released(self, multiplier: float) -> _Trial | None:
        """Return the step after one that holds; None where stones do not surely move in it.

        It begins with the forces that arise from nothing between joints that yield, unless these bring about the rest.
        """
        problem, free = self._problem(multiplier)
        rests, impulse = rests_from_nothing(problem)
        if rests:
            return None
        chain = chain_of(problem, follows=True, moving=True, velocity_tolerance=_LIMITS[1])
        trial = self._trial(multiplier, problem, free, chain, impulse)
        return None if trial.holds or trial.error > _SURE else trial

    def _problem(self, multiplier: float) -> tuple[ContactProblem, Array]:
        """Return the contact problem under λ, and the velocities (nb, 6) of stones without joints after 1 s."""
        (dead, live), strength = self._free, self._on.strength
        free = dead + multiplier * live
        u_free = self._operator.relative_velocity(free) - self._operator.apply(self._pull)
        none = np.zeros(len(u_free))
        problem = ContactProblem(
            self._operator, u_free, none, strength.friction, strength.cohesion, strength.tension
        )
        return problem, free

    def _trial(
        self, multiplier: float, problem: ContactProblem, free: Array, chain: Sequence[Link], impulse: Array
    ) -> _Trial:
        """Return the step that a chain finds from impulses (nc, 3)."""
        on, u_free = self._on, problem.u_free
        solution = follow(chain, problem, ContactStart(impulse, np.zeros_like(impulse)), _LIMITS, _ITERATIONS)
        force = solution.impulse - self._pull
        fastest = float(np.abs(self._operator.apply(solution.impulse) + u_free).max())
        pace = float(np.abs(u_free).max()) or 1.0
        velocity = (free + self._operator.rigid_change(force))[on.free]
        load = self._dead + multiplier * self._live
        gained = float(velocity.ravel() @ (load + on.lift @ force.ravel()))
        power = float(velocity.ravel() @ self._live)
        error = residual(problem, solution.impulse).velocity * pace / (fastest or 1.0)
        return _Trial(
            holds=fastest <= (_CREEPS if error <= _SURE else _MOVES) * pace,
            stops=multiplier - gained / power if power > 0.0 else 0.0,
            force=force,
            velocity=velocity,
            error=error,
        )

    def _motion(self, load: Array) -> Array:
        """Return the velocities (nb, 6) that a load (6 n,) gives to stones without joints in 1 s."""
        model, velocity = self._on.model, np.zeros((len(self._on.model.mass), 6))
        velocity[self._on.free] = load.reshape(-1, 6)
        turn = inverse_inertia_world(model.inertia, self._on.state.rotation)
        velocity[:, :3] *= model.inertia.inverse_mass[:, None]
        velocity[:, 3:] = (turn @ velocity[:, 3:, None])[..., 0]
        return velocity
