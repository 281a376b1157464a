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
et al. 2014). A small charge on the sum of the normal forces takes away those with which stones clamp one another, and
one on the squares of f_N - n̄ keeps each programme near the one before, so that the iteration comes to rest. It begins
twice: from the forces of the bound, and from the least that carry the dead load. In the plane both come to one λ; in
space the loads may lie apart by a third, and Coulomb's law holds at both. The higher is the candidate, as loads that
grow from nothing are borne up to it as a rule; only runs tell (`confirm`, docs/design/limit-loads.md).
"""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from scipy.sparse import bsr_array, csc_array, dia_array

from mechanics.arrays import Array, Bools
from mechanics.limit.assembly import RigidAssembly, Strength
from mechanics.limit.live_loads import LiveLoad
from mechanics.limit.programme import Optimum, Programme

# slope of the fictitious strength over that of the programme before, and over the friction in the end [-]
_FLATTER, _DILATANCY = 0.3, 1e-3
# charge on the sum of all normal forces over the weight, in units of λ: a tenth finds states up to 10 % higher [-]
_CLAMPING = 1e-2
# charge on the squares of their changes, over their mean and the weight, in units of λ [-]
_NEARBY = 0.03
# programmes from the bound without that charge, which come down far, and share of the new normal forces in theirs [-]
_FAR, _MIXED = 12, 0.5
# range of λ over so many programmes at which the candidate stands, relative [-]; from which programme on
_STANDS, _TIMES, _FIRST = 2e-3, 5, 8
# programmes in a row at a load that is known, and range about it, after which a beginning ends [-]
_AGAIN, _SAME = 5, 1e-2
# programmes of each beginning at most
_MOST = 40
# friction beyond Coulomb's that a candidate may have, over the strength of all contacts [-]
_BEYOND = 1e-2
# share of the friction across the line of sliding that stays, without which nothing would hold stones there [-]
_ACROSS = 1e-3
# squared sine of the angle between planes of joints up to which they are one plane: 2.6° [-]
_PLANE = 2e-3
# velocity over the largest below which a contact stays closed [-]
_STILL = 1e-4


class Flow(StrEnum):
    """Motion of joints that slide, and so what λ is."""

    ASSOCIATIVE = "associative"
    COULOMB = "coulomb"


@dataclass(frozen=True)
class Mechanism:
    """Motion with which stones begin to fall.

    Attributes
    ----------
    velocity : (nb, 6) of all stones, the fastest corner at 1 [m/s, rad/s]
    speed : (nb,) of the fastest corner of each, at most [m/s]
    opening, sliding : (nc,) contacts that open, and that slide
    """

    velocity: Array
    speed: Array
    opening: Bools
    sliding: Bools


@dataclass(frozen=True)
class LimitLoad:
    """Limit load of an assembly.

    Attributes
    ----------
    flow : *associative*: `multiplier` is a rigorous upper bound; *coulomb*: a candidate
    load : the live load, in words
    multiplier : λ [-]; infinite where nothing limits it, NaN where the dead load alone is too much
    force : (nc, 3) on the candidate of each contact at the limit, local frame [N]
    mechanism : how the stones begin to fall
    programmes : cone programmes that were solved
    converged : they came to an end: to the tolerance, or as λ and forces of a candidate stood
    beyond : friction beyond Coulomb's law, over the strength of all contacts [-]
    lower : the other of two candidates, if it is lower
    """

    flow: Flow
    load: str
    multiplier: float
    force: Array
    mechanism: Mechanism
    programmes: int
    converged: bool
    beyond: float
    lower: "LimitLoad | None" = None

    @property
    def lowest(self) -> "LimitLoad":
        """The lower of two candidates, or itself."""
        return self.lower or self

    @property
    def headline(self) -> str:
        """Statement of what λ is, in one sentence."""
        if np.isnan(self.multiplier):
            return f"{self.load}: the stones fall under their own weight"
        if np.isinf(self.multiplier):
            return f"{self.load}: nothing limits it"
        kind = "rigorous upper bound" if self.flow is Flow.ASSOCIATIVE else "candidate, may fall at less"
        caution = "" if self.converged else "; NOT CONVERGED"
        return f"{self.load}: λ = {self.multiplier:.4g} ({self.flow} friction, {kind}{caution})"


def limit_load(
    on: RigidAssembly, live: LiveLoad, flow: Flow = Flow.ASSOCIATIVE, bound: LimitLoad | None = None
) -> LimitLoad:
    """Return the limit load of an assembly with its mechanism.

    A candidate begins with the `bound` of the same load, that of associative friction, which is found where it is None.

    Raises
    ------
    SolverError : Clarabel is not installed, or came to no answer
    """
    programme = Programme(on, live(on), str(live))
    bound = bound or _bound(on, programme, str(live))
    if flow is Flow.ASSOCIATIVE or not np.isfinite(bound.multiplier):
        return replace(bound, flow=flow)
    return _candidate(on, programme, bound)


def _bound(on: RigidAssembly, programme: Programme, name: str) -> LimitLoad:
    """Return the limit load of associative friction."""
    optimum = programme.solve(on.strength)
    return LimitLoad(
        flow=Flow.ASSOCIATIVE,
        load=name,
        multiplier=optimum.multiplier,
        force=optimum.force,
        mechanism=mechanism(on, optimum.velocity),
        programmes=1,
        converged=True,
        beyond=_beyond(on, optimum.force),
    )


def without_friction_across(on: RigidAssembly, live: LiveLoad, candidate: LimitLoad) -> LimitLoad | None:
    """Return the limit load where joints that slide rub along their slip alone; None where none slides.

    Limit equilibrium, as rock engineers compute a wedge on two planes, has no friction across the line of sliding, and
    is a balance of forces alone. So stones that bear on two planes, and move along their line rather than across it,
    take moments without limit.

    Parameters
    ----------
    on, live : the stones and the load
    candidate : of Coulomb's friction, so that joints slide without opening; its mechanism has the directions of slip
    """
    velocity = candidate.mechanism.velocity
    slip = (on.lift.T @ velocity[on.free].ravel()).reshape(-1, 3)[:, 1:]
    line = lines_of_sliding(on, candidate)
    wedges = np.flatnonzero(line.any(axis=1))
    steady = candidate.mechanism.speed <= _STILL
    sliding = candidate.mechanism.sliding.copy()
    for side in (0, 1):
        body, neighbour = on.contacts.bodies[:, side], on.contacts.bodies[:, 1 - side]
        here = np.isin(body, wedges) & steady[neighbour]
        slip[here] = np.einsum("cij,cj->ci", on.contacts.frame[here, 1:], line[body[here]])
        sliding |= here
    slides = np.flatnonzero(sliding & (np.linalg.norm(slip, axis=1) > 0.0))
    if not len(slides):
        return None
    along = slip[slides] / np.linalg.norm(slip[slides], axis=1)[:, None]
    rubs = np.tile(np.eye(3), (len(on.contacts), 1, 1))
    rubs[slides, 1:, 1:] *= _ACROSS
    rubs[slides, 1:, 1:] += (1.0 - _ACROSS) * np.einsum("ci,cj->cij", along, along)
    projection = bsr_array((rubs, np.arange(len(rubs)), np.arange(len(rubs) + 1)))
    counts = np.ones((len(on.free), 6))
    counts[np.isin(on.free, wedges), 3:] = 0.0
    balance = counts.ravel()
    lift = csc_array(dia_array((balance[None], 0), shape=(len(balance),) * 2) @ on.lift @ projection)
    there = replace(on, lift=lift, dead=balance * on.dead)
    return _bound(there, Programme(there, balance * live(on), str(live)), str(live))


def lines_of_sliding(on: RigidAssembly, limit: LimitLoad) -> Array:
    """Return the line (nb, 3) along which each stone slides on two planes that stay, the way it goes; zero: none.

    The planes are those of joints that bear at the limit. A mechanism may turn the stone as well. Zero for all where
    some stone that moves has no such line: a vault that opens is no wedge.
    """
    moves = limit.mechanism.speed > _STILL
    line = np.zeros((len(moves), 3))
    bodies = on.contacts.bodies
    bears = limit.force[:, 0] > _STILL * limit.force[:, 0].max(initial=0.0)
    stands = bears & (moves[bodies].sum(axis=1) == 1)
    for body in np.unique(bodies[stands]):
        if not moves[body]:
            continue
        normals = on.contacts.frame[stands & (bodies == body).any(axis=1), 0]
        size, axes = np.linalg.svd(normals.T @ normals)[1:]
        velocity = limit.mechanism.velocity[body, :3]
        slip = float(velocity @ axes[2])
        two = size[1] > _PLANE * size[0] > size[2]
        if two and 2.0 * slip * slip > float(velocity @ velocity):
            line[body] = np.sign(slip) * axes[2]
    return line if line[moves].any(axis=1).all() else np.zeros_like(line)


def slides_along_one_line(on: RigidAssembly, limit: LimitLoad) -> bool:
    """Return whether all stones that move slide along one line, within 2.6°.

    Where they slide along several, as those of a dome that opens, no friction is across the line of sliding: that of
    each joint holds the others.
    """
    motion, lines = limit.mechanism, lines_of_sliding(on, limit)
    if not lines.any():
        lines = motion.velocity[:, :3]
        turning = 0.5 * on.model.surfaces.size * np.linalg.norm(motion.velocity[:, 3:], axis=1)
        if turning @ turning > _PLANE * motion.speed @ motion.speed:
            return False
    along, *across = np.linalg.svd(lines, compute_uv=False) ** 2
    return bool(along > 0.0 and sum(across) <= _PLANE * along)


def mechanism(
    on: RigidAssembly, velocity: Array, moving: Array | None = None, still: float = _STILL
) -> Mechanism:
    """Return the mechanism of velocities of any length.

    Parameters
    ----------
    velocity : (n, 6) of the free stones
    moving : (nb, 6) of the fixed ones, without spin; None: they stand
    still : velocity over the largest below which a contact stays closed [-]
    """
    u = (on.lift.T @ velocity.ravel()).reshape(-1, 3)
    every = np.zeros((len(on.model.mass), 6))
    if moving is not None:
        every, (candidate, antagonist) = moving.copy(), on.contacts.bodies.T
        u += np.einsum("cij,cj->ci", on.contacts.frame, every[candidate, :3] - every[antagonist, :3])
    every[on.free] = velocity
    turning = 0.5 * on.model.surfaces.size * np.linalg.norm(every[:, 3:], axis=1)
    speed = np.linalg.norm(every[:, :3], axis=1) + turning
    unit = float(speed.max(initial=0.0)) or 1.0
    u /= unit
    return Mechanism(every / unit, speed / unit, u[:, 0] > still, np.linalg.norm(u[:, 1:], axis=1) > still)


@dataclass(frozen=True)
class _Ending:
    """End of an iteration: λ, forces (nc, 3) [N] and strength of its last programme; as in `LimitLoad`."""

    multiplier: float
    force: Array
    strength: Strength
    programmes: int
    converged: bool
    beyond: float


def _candidate(on: RigidAssembly, programme: Programme, bound: LimitLoad) -> LimitLoad:
    """Return the higher of the loads to which the iteration comes from the bound, and from the dead load.

    Its mechanism is that of the last strength without the charges, which would open joints a little.
    """
    least = np.zeros((len(on.contacts), 3))
    least[:, 0] = 1.0
    resting = Programme(on, None, bound.load).solve(on.strength, cost=least / len(least))
    first = _iterated(on, programme, bound.force, _FAR)
    reached = first.multiplier if first.converged else None
    endings = [first, _iterated(on, programme, resting.force, 0, reached)]
    ended = [iteration for iteration in endings if iteration.converged] or [
        iteration for iteration in endings if np.isfinite(iteration.multiplier)
    ]
    programmes = 2 + sum(iteration.programmes for iteration in endings)
    lower: LimitLoad | None = None
    for ending in sorted(ended or endings[:1], key=lambda iteration: iteration.multiplier):
        moving: Optimum = programme.solve(ending.strength)
        lower = LimitLoad(
            flow=Flow.COULOMB,
            load=bound.load,
            multiplier=ending.multiplier,
            force=ending.force,
            mechanism=mechanism(on, moving.velocity),
            programmes=programmes,
            converged=ending.converged,
            beyond=ending.beyond,
            lower=lower,
        )
    assert lower is not None
    return lower


def _iterated(
    on: RigidAssembly, programme: Programme, begin: Array, unrestrained: int, reached: float | None = None
) -> _Ending:
    """Iterate the fictitious strength from forces (nc, 3), its slope falling to almost zero.

    The first programmes, `unrestrained` of them, go as far as they like; what follows stays near the one before. It
    ends early, without forces that meet the law, where it stays at a load that was `reached` before.
    """
    actual = on.strength
    slope, normal = actual.friction, _normal(actual, begin)
    multipliers: list[float] = []
    ended = False
    while True:
        slope = np.maximum(_FLATTER * slope, _DILATANCY * actual.friction)
        strength = Strength(slope, actual.cohesion + (actual.friction - slope) * normal, actual.tension)
        free = len(multipliers) < unrestrained
        optimum = programme.solve(
            strength, _CLAMPING, near=None if free else normal - actual.tension, pull=_NEARBY
        )
        multipliers.append(optimum.multiplier)
        if not np.isfinite(optimum.multiplier):
            break
        normal = normal + (_MIXED if free else 1.0) * (_normal(actual, optimum.force) - normal)
        stands = np.ptp(multipliers[-_TIMES:]) <= _STANDS * abs(optimum.multiplier)
        within = _beyond(on, optimum.force) <= _BEYOND
        ended = len(multipliers) > max(_FIRST, unrestrained + 1) and bool(stands) and within
        last = np.array(multipliers[-_AGAIN:])
        again = (
            reached is not None and len(last) == _AGAIN and np.abs(last - reached).max() <= _SAME * reached
        )
        if ended or again or len(multipliers) == _MOST:
            break
    return _Ending(
        optimum.multiplier, optimum.force, strength, len(multipliers), ended, _beyond(on, optimum.force)
    )


def _normal(strength: Strength, force: Array) -> Array:
    return np.maximum(force[:, 0] + strength.tension, 0.0)


def _beyond(on: RigidAssembly, force: Array) -> float:
    """Return the friction beyond Coulomb's law of forces (nc, 3), over the strength of all contacts."""
    most = on.strength.shear(force)
    over = np.maximum(np.linalg.norm(force[:, 1:], axis=1) - most, 0.0)
    return float(over.sum()) / max(float(most.sum()), 1e-300)
