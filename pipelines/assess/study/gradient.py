"""Derivatives of a limit load by the unknowns of a study, from one solution of its programme.

With the velocities z of the mechanism at which the live load has unit power, and u = Hᵀ z, the envelope theorem gives

    dλ = -z·(dH f + dp + λ dq) + Σ |u_T| ((f_N + s) dμ + dk) + Σ u_N ds

Densities, strengths and directions of joints and loads change p, q, μ, k and s in closed form. Geometry changes H, p
and q through the chain that a run takes, so these are differences of assemblies, without a programme. Frames of
contacts may turn in their plane from one assembly to the next: forces are carried over in world axes.

A stone that moves takes its neighbours along by all of its movement, and others of its course by a hundredth at most.
So of many stones those that are far apart are moved together, and each change belongs to the nearest of them. Few are
moved one by one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import dijkstra

from mechanics.arrays import Array
from mechanics.limit.assembly import RigidAssembly, Strength
from mechanics.limit.live_loads import LiveLoad
from pipelines.assess.study.quantities import Limited

__all__ = ["Changed", "Dual", "by_density", "by_strength", "difference", "dual", "together"]

_FEW = 60
"""Unknowns of single stones up to which each is moved alone, as exactly as rounding allows."""
_REACH = 1
"""Joints within which stones move with a stone; those beyond, of its course, by a hundredth of it at most."""
_STRAY = 0.2
"""Share of the changes that may lie beyond the reach of all stones that move together [-].

In the window bay derivatives are then wrong by 6·10⁻⁴ of the largest; a reach of two joints takes three times as long.
"""


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

    None where their contacts are not those of the solution, one by one.

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
    sources: Sequence[Sequence[int]],
    steps: Sequence[float],
    changed: Callable[[Mapping[int, float]], Changed],
) -> Array:
    """Return the derivatives by unknowns that each move some stones; NaN where contacts come and go.

    Parameters
    ----------
    sources : bodies that each unknown moves
    steps : half of the differences
    changed : assembly and load with unknowns, by their number, changed by so much
    """
    derivatives = np.full(len(sources), np.nan)
    distance = _distances(at.limited.on)
    few = sum(len(bodies) == 1 for bodies in sources) <= _FEW
    for batch in [[number] for number in range(len(sources))] if few else _batches(sources, distance):
        shares = _shared(at, batch, sources, steps, changed, distance) if len(batch) > 1 else None
        for place, number in enumerate(batch):
            if shares is not None:
                derivatives[number] = shares[place]
                continue
            step = steps[number]
            found = difference(at, changed({number: step}), changed({number: -step}), step)
            derivatives[number] = np.nan if found is None else found
    return derivatives


def _shared(
    at: Dual,
    batch: Sequence[int],
    sources: Sequence[Sequence[int]],
    steps: Sequence[float],
    changed: Callable[[Mapping[int, float]], Changed],
    distance: Array,
) -> Array | None:
    """Return the derivatives (k,) by unknowns whose stones move together; None where they cannot be told apart."""
    on = at.limited.on
    end = _power(at, changed({number: steps[number] for number in batch}))
    start = _power(at, (on, at.limited.live))
    if end is None or start is None:
        return None
    rows = np.array([distance[list(sources[number])].min(axis=0) for number in batch])
    nearest, far = rows.argmin(axis=0), rows.min(axis=0)
    by_body, by_contact = end[0] - start[0], end[1] - start[1]
    pair = on.contacts.bodies
    first = far[pair[:, 0]] <= far[pair[:, 1]]
    owner = np.where(first, nearest[pair[:, 0]], nearest[pair[:, 1]])
    away = np.concatenate([far[on.free], np.minimum(far[pair[:, 0]], far[pair[:, 1]])])
    moves = np.concatenate([by_body, by_contact])
    if np.abs(moves[away > _REACH]).sum() > _STRAY * np.abs(moves).sum():
        return None
    total = np.bincount(nearest[on.free], by_body, len(batch))
    total += np.bincount(owner, by_contact, len(batch))
    shares: Array = total / np.array([steps[number] for number in batch])
    return shares


def _power(at: Dual, changed: Changed) -> tuple[Array, Array] | None:
    """Return -z·(p + λ q) by body (n,) and the power of forces and strength by contact (nc,) after a change."""
    on, live = changed
    base, optimum = at.limited.on, at.limited.optimum
    if len(on.contacts) != len(base.contacts) or not np.array_equal(on.contacts.bodies, base.contacts.bodies):
        return None
    load = (on.dead + optimum.multiplier * live(on)).reshape(-1, 6)
    by_body = -np.einsum("bi,bi->b", at.velocity, load)
    relative = (on.lift.T @ at.velocity.ravel()).reshape(-1, 3)
    force = _carried(base, on, optimum.force)
    change = Strength(
        on.strength.friction - base.strength.friction,
        on.strength.cohesion - base.strength.cohesion,
        on.strength.tension - base.strength.tension,
    )
    by_contact = -np.einsum("ci,ci->c", relative, force)
    return by_body, by_contact + _strength_power(at, base.strength, change, optimum.force)


def _carried(base: RigidAssembly, on: RigidAssembly, force: Array) -> Array:
    """Return forces (nc, 3) in the frames of another assembly, tangential ones carried over in world axes."""
    world = np.einsum("ci,cij->cj", force[:, 1:], base.contacts.frame[:, 1:])
    carried = np.empty_like(force)
    carried[:, 0] = force[:, 0]
    carried[:, 1:] = np.einsum("cij,cj->ci", on.contacts.frame[:, 1:], world)
    return carried


def _distances(on: RigidAssembly) -> Array:
    """Return the number of joints between bodies (nb, nb); infinite where none connects them."""
    count = len(on.model.mass)
    first, second = on.contacts.bodies.T
    graph = csr_array(coo_array((np.ones(len(first)), (first, second)), shape=(count, count)))
    distance: Array = dijkstra(graph, directed=False, unweighted=True)
    return distance


def _batches(sources: Sequence[Sequence[int]], distance: Array) -> list[list[int]]:
    """Return unknowns in batches, so that the stones of a batch lie apart by more than twice their reach."""
    batches: list[tuple[list[int], Array]] = []
    for number, bodies in enumerate(sources):
        around = distance[list(bodies)].min(axis=0)
        if len(bodies) == 1:
            for batch, reached in batches:
                if reached[bodies[0]] > 2 * _REACH:
                    batch.append(number)
                    np.minimum(reached, around, out=reached)
                    break
            else:
                batches.append(([number], around.copy()))
        else:
            batches.append(([number], np.zeros(len(around))))
    return [batch for batch, _ in batches]
