"""Limit loads of rigid stones by cone programmes: bound, candidate, and the mechanism of each.

The largest λ for which forces within the joints' strength balance the load p + λ q,

    maximise  λ ≥ 0    over    H f + p + λ q = 0,   ‖f_T‖ ≤ μ (f_N + s) + k,   f_N + s ≥ 0

is the limit load of *associative* friction, where joints that slide open by μ times the slip. With Coulomb's friction,
which slides without opening, it is a rigorous upper bound (Drucker 1954). The dual variables of the balance are the
velocities of the stones in the mechanism.

With Coulomb's friction limit loads are not unique. Those of a *fictitious* cohesion that passes through the forces of
the programme before,

    ‖f_T‖ ≤ μ n̄ + ψ (f_N - n̄),     ψ → 0,

come to forces that meet Coulomb's law and to a mechanism without opening (Gilbert, Casapulla & Ahmed 2006; Portioli
et al. 2014). Such a λ is a candidate: the stones may fall at less. Which one comes out is decided by forces with which
stones clamp one another: a small charge on the sum of the normal forces takes them away, and leads to the lowest
values that are known (docs/decisions/045-limit-loads.md).
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any

import numpy as np
from scipy.sparse import block_array, csc_array, csr_array, diags_array, vstack

from mechanics.arrays import Array, Bools
from mechanics.limit.assembly import Assembly
from mechanics.limit.live_loads import LiveLoad
from mechanics.solvers.second_order.cone_program import load_clarabel
from moma.errors import SolverError

__all__ = ["Flow", "LimitLoad", "limit_load"]


# friction from which a contact has a cone [-]
_SMOOTH = 1e-9
# tolerances asked of Clarabel [-]
_GAP, _FEASIBLE = 1e-9, 1e-9
# slope of the fictitious strength over that of the programme before, and over the friction in the end [-]
_FLATTER, _DILATANCY = 0.3, 1e-3
# share of the new normal forces in those through which the fictitious strength passes, at first: it falls after _FIRST
# programmes, so that forces that swing come to rest [-]
_MIXED = 0.5
# charge on the sum of all normal forces over the weight, in units of λ: a tenth finds states up to 10 % higher [-]
_CLAMPING = 3e-3
# range of λ over so many programmes at which the candidate stands, relative [-]; from which programme on
_STANDS, _TIMES, _FIRST = 3e-3, 5, 8
# programmes of a candidate at most
_MOST = 40
# friction beyond Coulomb's that a candidate may have, over the strength of all contacts [-]
_BEYOND = 2e-2
# velocity over the largest below which a contact stays closed [-]
_STILL = 1e-4


class Flow(StrEnum):
    """Motion of joints that slide, and so what λ is."""

    ASSOCIATIVE = "associative"
    COULOMB = "coulomb"


@dataclass(frozen=True)
class LimitLoad:
    """Limit load of an assembly.

    Attributes
    ----------
    flow : *associative*: `multiplier` is a rigorous upper bound; *coulomb*: a candidate
    load : the live load, in words
    multiplier : λ [-]; infinite where nothing limits it, NaN where the dead load alone is too much
    force : (nc, 3) on the candidate of each contact at the limit, local frame [N]
    velocity : (n, 6) of the free stones in the mechanism, the fastest corner at 1 [m/s, rad/s]
    opening, sliding : (nc,) contacts that open, and that slide, in the mechanism
    programmes : cone programmes that were solved
    converged : they came to an end: to the tolerance, or as λ and forces of a candidate stood
    beyond : friction beyond Coulomb's law, over the strength of all contacts [-]
    """

    flow: Flow
    load: str
    multiplier: float
    force: Array
    velocity: Array
    opening: Bools
    sliding: Bools
    programmes: int
    converged: bool
    beyond: float

    @property
    def headline(self) -> str:
        """Statement of what λ is, in one sentence."""
        if np.isnan(self.multiplier):
            return f"{self.load}: the stones fall under their own weight"
        if np.isinf(self.multiplier):
            return f"{self.load}: nothing limits it"
        kind = "rigorous upper bound" if self.flow is Flow.ASSOCIATIVE else "candidate, may fall at less"
        left = "" if self.converged else "; NOT CONVERGED"
        return f"{self.load}: λ = {self.multiplier:.4g} ({self.flow} friction, {kind}{left})"


def limit_load(
    on: Assembly, live: LiveLoad, flow: Flow = Flow.ASSOCIATIVE, bound: LimitLoad | None = None
) -> LimitLoad:
    """Return the limit load of an assembly with its mechanism.

    A candidate begins with the `bound` of the same load, that of associative friction, which is found where it is None.

    Raises
    ------
    SolverError : Clarabel is not installed, or came to no answer
    """
    programme = _Programme(on, live)
    if bound is None:
        found = programme.solve(on.friction, on.cohesion, on.tension)
        bound = programme.judged(found, Flow.ASSOCIATIVE, 1, True)
    if flow is Flow.ASSOCIATIVE or not np.isfinite(bound.multiplier):
        return replace(bound, flow=flow)
    return _candidate(on, programme, bound.force)


@dataclass(frozen=True)
class _Answer:
    """λ, the forces (nc, 3) [N] and the velocities (n, 6) of one programme, not yet scaled."""

    multiplier: float
    force: Array
    velocity: Array


def _candidate(on: Assembly, programme: "_Programme", force: Array) -> LimitLoad:
    """Iterate the fictitious strength from `force` (nc, 3) of associative friction, its slope falling to almost zero.

    The strength passes through mixed forces n̄, so that forces that swing between two states come to rest. The
    mechanism is that of the last strength without the charge on clamping, which would open joints a little.
    """
    slope, held = on.friction, _normal(on, force)
    multipliers: list[float] = []
    ended = False
    while True:
        slope = np.maximum(_FLATTER * slope, _DILATANCY * on.friction)
        strength = on.cohesion + (on.friction - slope) * held
        found = programme.solve(slope, strength, on.tension, _CLAMPING)
        multipliers.append(found.multiplier)
        if not np.isfinite(found.multiplier):
            break
        share = _MIXED / (1.0 + max(0, len(multipliers) - _FIRST) / _FIRST)
        held += share * (_normal(on, found.force) - held)
        stands = np.ptp(multipliers[-_TIMES:]) <= _STANDS * abs(found.multiplier)
        near = programme.judged(found, Flow.COULOMB, 0, True).beyond <= _BEYOND
        ended = len(multipliers) > _FIRST and bool(stands) and near
        if ended or len(multipliers) == _MOST:
            break
    moving = programme.solve(slope, strength, on.tension)
    judged = programme.judged(
        replace(found, velocity=moving.velocity), Flow.COULOMB, len(multipliers) + 2, True
    )
    return replace(judged, converged=ended)


def _normal(on: Assembly, force: Array) -> Array:
    return np.maximum(force[:, 0] + on.tension, 0.0)


class _Programme:
    """The cone programme of an assembly and a load, for any strength of its joints.

    Forces are in units of the largest load on a stone, moments in that times the width of each stone, so that all rows
    of the balance weigh alike.
    """

    def __init__(self, on: Assembly, live: LiveLoad) -> None:
        self._on, self._load, load = on, str(live), live(on)
        if not load.any():
            raise SolverError(
                "the live load is zero", where=self._load, remedy="give one that acts on stones"
            )
        size = on.model.surfaces.size[on.free]
        self._unit = max(float(np.abs(on.dead).max()), float(np.abs(load).max())) or 1.0
        row = np.column_stack([np.ones((len(size), 3)), np.repeat(1.0 / size[:, None], 3, axis=1)]).ravel()
        # balance in units of 1: rows of the wrenches over the unit of force, and over widths
        self._row = row
        self._live_unit = float(np.linalg.norm(row * load)) / self._unit
        live_column = (row * load / self._unit / self._live_unit)[:, None]
        self._balance = csc_array(block_array([[diags_array(row) @ on.lift, csr_array(live_column)]]))
        self._dead = row * on.dead / self._unit
        self._live, self._weight = load, max(on.weight, float(np.abs(load).sum()))

    def solve(self, friction: Array, cohesion: Array, tension: Array, clamping: float = 0.0) -> _Answer:
        """Return the answer for μ, k and s (nc,) of the contacts; `clamping`: charge on normal forces."""
        clarabel = load_clarabel("limit load", "pip install clarabel")
        count = len(friction)
        rough = (friction > _SMOOTH) | (cohesion > 0)
        side = np.flatnonzero(~rough | (cohesion > 0))
        cone = np.flatnonzero(rough)
        factor = np.ones((count, 3))
        factor[:, 0] = friction
        identity = csr_array(diags_array(np.ones(3 * count)))
        in_cone = (3 * cone[:, None] + np.arange(3)).ravel()
        flat = np.flatnonzero(~rough)
        zero = (3 * flat[:, None] + [1, 2]).ravel()
        rows = vstack(
            [identity[zero], csr_array(diags_array(factor.ravel()))[in_cone], identity[3 * side]],
            format="csc",
        )
        # the last row is λ ≥ 0: stones that stand only as the live load holds them do not stand
        rows = block_array([[rows, None], [None, csc_array([[1.0]])]], format="csc")
        right = np.zeros((len(cone), 3))
        right[:, 0] = (cohesion + friction * tension)[cone] / self._unit
        matrix = csc_array(vstack([self._balance, -rows]))
        bound = np.concatenate(
            [-self._dead, np.zeros(len(zero)), right.ravel(), tension[side] / self._unit, [0.0]]
        )
        kinds = [clarabel.ZeroConeT(self._balance.shape[0] + len(zero))]
        kinds += [clarabel.SecondOrderConeT(3)] * len(cone)
        kinds.append(clarabel.NonnegativeConeT(len(side) + 1))
        objective = np.zeros(3 * count + 1)
        objective[-1] = -1.0
        objective[:-1:3] = clamping * self._live_unit * self._unit / self._weight
        none = csc_array((3 * count + 1, 3 * count + 1))
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.max_threads = False, 1
        settings.tol_gap_abs = settings.tol_gap_rel = _GAP
        settings.tol_feas = _FEASIBLE
        answer = clarabel.DefaultSolver(none, objective, matrix, bound, kinds, settings).solve()
        return self._read(answer, count)

    def _read(self, answer: Any, count: int) -> _Answer:
        status, on = str(answer.status), self._on
        velocity = self._row * np.asarray(answer.z)[: len(self._row)]
        if status in ("Solved", "AlmostSolved"):
            x = np.asarray(answer.x)
            force, multiplier = self._unit * x[:-1].reshape(count, 3), float(x[-1]) / self._live_unit
        elif status in ("PrimalInfeasible", "AlmostPrimalInfeasible"):
            force, multiplier = np.zeros((count, 3)), float("nan")
        elif status in ("DualInfeasible", "AlmostDualInfeasible"):
            force, multiplier, velocity = np.zeros((count, 3)), float("inf"), np.zeros_like(velocity)
        else:
            raise SolverError(
                f"Clarabel came to no answer: {status}",
                where=self._load,
                remedy="check the scene's joints with `moma check`",
            )
        # the loads do work on the mechanism
        work = velocity @ (self._live if np.isfinite(multiplier) else on.dead)
        velocity = velocity if work >= 0 else -velocity
        return _Answer(multiplier, force, velocity.reshape(-1, 6))

    def judged(self, found: _Answer, flow: Flow, programmes: int, converged: bool) -> LimitLoad:
        """Return the limit load with its mechanism, at a speed of 1 of the fastest corner."""
        on = self._on
        size = on.model.surfaces.size[on.free]
        fastest = np.linalg.norm(found.velocity[:, :3], axis=1) + 0.5 * size * np.linalg.norm(
            found.velocity[:, 3:], axis=1
        )
        largest = float(fastest.max(initial=0.0))
        velocity = found.velocity / largest if largest > 0 else found.velocity
        u = (on.lift.T @ velocity.ravel()).reshape(-1, 3)
        slip = np.linalg.norm(u[:, 1:], axis=1)
        tangential = np.linalg.norm(found.force[:, 1:], axis=1)
        most = on.friction * (found.force[:, 0] + on.tension) + on.cohesion
        beyond = float(np.maximum(tangential - most, 0.0).sum()) / max(float(most.sum()), 1e-300)
        return LimitLoad(
            flow=flow,
            load=self._load,
            multiplier=found.multiplier,
            force=found.force,
            velocity=velocity,
            opening=u[:, 0] > _STILL,
            sliding=slip > _STILL,
            programmes=programmes,
            converged=converged,
            beyond=beyond,
        )
