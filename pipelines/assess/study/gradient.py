"""Derivatives of a limit load by the unknowns of a study, from one solution of its programme.

With the velocities z of the mechanism at which the live load has unit power, and u = Hᵀ z, the envelope theorem gives

    dλ = -z·(dH f + dp + λ dq) + Σ |u_T| ((f_N + s) dμ + dk) + Σ u_N ds

Densities, strengths and directions of joints and loads change p, q, μ, k and s in closed form. Geometry changes H, p
and q through the chain that a run takes, so these are differences of assemblies, without a programme. Frames of
contacts may turn in their plane from one assembly to the next: forces are carried over in world axes.

A stone that changes moves the contact planes of its joints, and with them all stones on these planes, and no other. So
of many stones those whose moved stones share no joint are changed together, and each change belongs to one of them.
Where contacts come and go with the sense of a change, as in perfectly regular masonry, it is made in both.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.spatial import cKDTree

from mechanics.arrays import Array, Bools, Ints
from mechanics.limit.assembly import RigidAssembly, Strength
from mechanics.limit.live_loads import LiveLoad
from pipelines.assess.study.quantities import Limited
from survey.conventions import PER_CENT, SAME

_KINK = PER_CENT
"""Difference of the changes in the two senses over the change, from which both are needed: curvature makes 1e-4 [-]."""
_SLIGHT = SAME
"""Change over the largest of a contact that matters to no derivative: a tenth of the error that these may have [-]."""


@dataclass(frozen=True)
class Dual:
    """Mechanism of a limit load at unit power of the live load.

    Attributes
    ----------
    limited : the limit load
    velocity : (n, 6) z of the free stones
    relative : (nc, 3) u = Hᵀ z in local frames
    """

    limited: Limited
    velocity: Array
    relative: Array

    @property
    def slip(self) -> Array:
        """|u_T| of each contact (nc,)."""
        slip: Array = np.linalg.norm(self.relative[:, 1:], axis=1)
        return slip


Changed = tuple[RigidAssembly, LiveLoad]
"""Assembly and live load after a change of unknowns."""


def dual(limited: Limited) -> Dual | None:
    """Return the mechanism of a limit load at unit power; None where the load has no power on it."""
    velocity = limited.optimum.velocity.ravel()
    power = float(velocity @ limited.load)
    if not np.isfinite(limited.optimum.multiplier) or power <= 0.0:
        return None
    velocity = velocity / power
    relative = (limited.on.lift.T @ velocity).reshape(-1, 3)
    return Dual(limited, velocity.reshape(-1, 6), relative)


def by_density(at: Dual, light: Array) -> Array:
    """Return the derivatives (n,) by the logarithm of the density of each free stone.

    Parameters
    ----------
    light : (6 n,) load at λ = 1 that is proportional to the mass of the stone on which it acts [N, N m]
    """
    on = at.limited.on
    weight = np.zeros((len(on.free), 6))
    weight[:, :3] = on.model.mass[on.free, None] * on.model.gravity(0.0)
    total = weight + at.limited.optimum.multiplier * light.reshape(-1, 6)
    derivative: Array = -np.einsum("bi,bi->b", at.velocity, total)
    return derivative


def by_strength(at: Dual, change: Strength) -> float:
    """Return the derivative by what changes the strength of contacts at this rate."""
    on, force = at.limited.on, at.limited.optimum.force
    return float(_strength_power(at, on.strength, change, force).sum())


def _strength_power(at: Dual, strength: Strength, change: Strength, force: Array) -> Array:
    pressure = force[:, 0] + strength.tension
    power: Array = at.slip * (pressure * change.friction + change.cohesion)
    return power + at.relative[:, 0] * change.tension


def difference(at: Dual, plus: Changed, minus: Changed, step: float) -> float | None:
    """Return the central difference of λ between two assemblies by their geometry, loads and strength alone.

    None where their contacts are not those of the solution, one by one, or joints may crush.

    Parameters
    ----------
    step : half of the distance between them
    """
    ends = [_power(at, changed) for changed in (plus, minus)]
    if ends[0] is None or ends[1] is None:
        return None
    return float((ends[0][0].sum() + ends[0][1].sum() - ends[1][0].sum() - ends[1][1].sum()) / (2.0 * step))


def together(
    at: Dual,
    reach: Bools,
    steps: Array,
    changed: Callable[[Mapping[int, float]], Changed],
) -> Array:
    """Return the derivatives (k,) by unknowns that each change some stones; NaN where contacts come and go.

    Parameters
    ----------
    reach : (k, nb) bodies that change with each unknown
    steps : (k,) half of the differences
    changed : assembly and load with unknowns, by their number, changed by so much
    """
    derivatives = np.full(len(reach), np.nan)
    start = _power(at, (at.limited.on, at.limited.live))
    if start is None:
        return derivatives
    kinked, scale = _kinked(at, start, steps, changed)
    for batch in _batches(reach, _touching(at.limited.on)):
        own = [batch]
        while own:
            some = own.pop()
            both = bool(reach[some][:, kinked].any())
            shares = _shared(at, start, some, reach[some], steps, changed, both, scale)
            if shares is not None:
                derivatives[some] = shares
            elif len(some) > 1:
                own += [[number] for number in some]
    return derivatives


def _kinked(
    at: Dual,
    start: tuple[Array, Array],
    steps: Array,
    changed: Callable[[Mapping[int, float]], Changed],
) -> tuple[Bools, float]:
    """Return the bodies (nb,) at whose contacts a change in one sense is not the opposite of that in the other.

    The second answer is the largest change of a contact as all unknowns change.
    """
    on = at.limited.on
    ahead, back = (_power(at, changed(dict(enumerate((sign * steps).tolist())))) for sign in (1.0, -1.0))
    kinked = np.zeros(len(on.model.mass), dtype=np.bool_)
    if ahead is None or back is None:
        return ~kinked, 0.0
    plus, minus = ahead[1] - start[1], back[1] - start[1]
    largest = np.maximum(np.abs(plus), np.abs(minus))
    off = np.abs(plus + minus)
    scale = float(largest.max(initial=0.0))
    kinked[on.contacts.bodies[(off > _KINK * largest) & (off > _SLIGHT * scale)]] = True
    return kinked, scale


def _shared(
    at: Dual,
    start: tuple[Array, Array],
    batch: Sequence[int],
    reach: Bools,
    steps: Array,
    changed: Callable[[Mapping[int, float]], Changed],
    both: bool,
    scale: float,
) -> Array | None:
    """Return the derivatives (k,) by unknowns that change together; None where they cannot be told apart."""
    on = at.limited.on
    end = _power(at, changed({number: float(steps[number]) for number in batch}))
    other = _power(at, changed({number: -float(steps[number]) for number in batch})) if both else start
    if end is None or other is None:
        return None
    moves = [(one - two) / (2.0 if both else 1.0) for one, two in zip(end, other, strict=True)]
    # the last place is of bodies that none of them changes
    owner = np.where(reach.any(axis=0), reach.argmax(axis=0), len(batch))
    of_contact = owner[on.contacts.bodies].min(axis=1)
    total = np.bincount(owner[on.free], moves[0], len(batch) + 1)
    total += np.bincount(of_contact, moves[1], len(batch) + 1)
    stray = (
        np.abs(moves[0][owner[on.free] == len(batch)]).sum()
        + np.abs(moves[1][of_contact == len(batch)]).sum()
    )
    # the median width of all joints leads a few of them, which 2e-5 of a change reaches
    if stray > max(_SLIGHT * scale, _SLIGHT * sum(float(np.abs(move).sum()) for move in moves)):
        return None
    shares: Array = total[:-1] / steps[batch]
    return shares


def _power(at: Dual, changed: Changed) -> tuple[Array, Array] | None:
    """Return -z·(p + λ q) by body (n,) and the power of forces and strength by contact (nc,) after a change.

    None where their contacts are not those of the solution, or joints may crush: the multipliers of that are not known.
    """
    on, live = changed
    base, optimum = at.limited.on, at.limited.optimum
    rows = _matched(base, on) if base.crushing is None else None
    if rows is None:
        return None
    load = (on.dead + optimum.multiplier * live(on)).reshape(-1, 6)
    by_body = -np.einsum("bi,bi->b", at.velocity, load)
    relative = (on.lift.T @ at.velocity.ravel()).reshape(-1, 3)[rows]
    force = _carried(base.contacts.frame, on.contacts.frame[rows], optimum.force)
    change = Strength(
        on.strength.friction[rows] - base.strength.friction,
        on.strength.cohesion[rows] - base.strength.cohesion,
        on.strength.tension[rows] - base.strength.tension,
    )
    by_contact = -np.einsum("ci,ci->c", relative, force)
    return by_body, by_contact + _strength_power(at, base.strength, change, optimum.force)


def _matched(base: RigidAssembly, on: RigidAssembly) -> Ints | None:
    """Return the contact of another assembly (nc,) that is nearest to each; None where they are not the same.

    Corners of a common face come in another order where edges of two stones align, and one of them moves.
    """
    if not np.array_equal(on.contacts.bodies, base.contacts.bodies):
        return None
    places = [one.state.centre[one.contacts.bodies[:, 0]] + one.contacts.arm[:, 0] for one in (base, on)]
    _, joint = np.unique(base.contacts.bodies, axis=0, return_inverse=True)
    apart = 10.0 * np.ptp(places[0], axis=0).max()
    (known, found) = (np.column_stack([place, apart * joint.ravel()]) for place in places)
    rows: Ints = np.asarray(cKDTree(found).query(known)[1], dtype=np.int64)
    return rows if len(np.unique(rows)) == len(rows) else None


def _carried(base: Array, frame: Array, force: Array) -> Array:
    """Return forces (nc, 3) in other frames (nc, 3, 3), tangential ones carried over in world axes."""
    world = np.einsum("ci,cij->cj", force[:, 1:], base[:, 1:])
    carried = np.empty_like(force)
    carried[:, 0] = force[:, 0]
    carried[:, 1:] = np.einsum("cij,cj->ci", frame[:, 1:], world)
    return carried


def _touching(on: RigidAssembly) -> "csr_array[np.float64]":
    """Return the matrix (nb, nb) of bodies that are the same or have a contact."""
    count = len(on.model.mass)
    first, second = np.concatenate([on.contacts.bodies, np.tile(np.arange(count)[:, None], 2)]).T
    rows, columns = np.concatenate([first, second]), np.concatenate([second, first])
    return csr_array(coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count)))


def _batches(reach: Bools, touching: "csr_array[np.float64]") -> list[list[int]]:
    """Return unknowns in batches within which no contact joins bodies that two of them change."""
    near: Bools = (reach.astype(float) @ touching) > 0.0
    batches: list[tuple[list[int], Bools]] = []
    for number in np.argsort(-reach.sum(axis=1), kind="stable").tolist():
        for batch, covered in batches:
            if not (near[number] & covered).any():
                batch.append(number)
                covered |= reach[number]
                break
        else:
            batches.append(([number], reach[number].copy()))
    return [batch for batch, _ in batches]
