"""Kinematic analysis of a mechanism: its equivalent oscillator, and the curve of λ as it goes on.

Stones that move as one are one block. A block goes on along the screw on which it begins, turning by ω t about its
axis. With the forces P_i of its weight at its centre, the loads at λ and the friction D of the joints that slide,
which stay what they are, the power balances

    λ(t) Σ q_i·v_i(t) + Σ P_i·v_i(t) = D        with  v_i(t) = R(ω_i t) v_i.

δ_i is the part of v_i along the load. The oscillator of the Italian code (circular 617/2009, C8A.4) has

    M* = (Σ P_i δ_i)² / (g Σ P_i δ_i²),   e* = g M* / Σ P_i,   a0* = λ Σ P_i / M*,   d* = Σ P_i δ_i d_i / Σ P_i δ_i,

where d_i(t) is the way of block i along the load. Of a single block, d* is the way of its centre.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial.transform import Rotation

from ground.errors import SolverError
from mechanics.arrays import Array, Ints
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.limit_load import LimitLoad, Mechanism
from mechanics.limit.live_loads import Acceleration

# speed over the fastest below which a stone stands, or does not turn [-]
_STANDS = 1e-3
# difference of the motions of two stones at their centres, over the fastest, up to which they are one block [-]
_SAME_MOTION = 1e-3
# places of the curve, and turn of the fastest block up to which it is followed [rad]
_PLACES, _FARTHEST = 51, 1.5


@dataclass(frozen=True)
class Kinematics:
    """Equivalent oscillator of a mechanism under an acceleration.

    Attributes
    ----------
    block : (nb,) block of each stone; -1: it stands
    multiplier : λ at which the mechanism begins [-]
    weight : ΣP of the blocks that move [N]
    mass : M* [kg]
    share : e* [-]
    displacement : (n,) d* along the curve, from 0 [m]
    multipliers : (n,) λ along it, down to 0 at the end, where there is one [-]
    capacity : d0*, at which λ is 0; infinite where it does not fall to 0 [m]
    """

    block: Ints
    multiplier: float
    weight: float
    mass: float
    share: float
    displacement: Array
    multipliers: Array
    capacity: float

    def acceleration(self, confidence: float = 1.0) -> float:
        """Return a0*, given the factor of confidence FC [m/s²]."""
        return self.multiplier * self.weight / (self.mass * confidence)


def kinematics(on: RigidAssembly, live: Acceleration, limit: LimitLoad) -> Kinematics:
    """Return the kinematic analysis of the mechanism of a limit load.

    Raises
    ------
    SolverError : there is no mechanism, or it does not move along the load
    """
    gravity = on.model.gravity(0.0)
    down, size = gravity / np.linalg.norm(gravity), float(np.linalg.norm(gravity))
    direction = np.asarray(live.direction, dtype=float) / np.linalg.norm(live.direction)
    block = _blocks(on, limit.mechanism)
    count = int(block.max()) + 1
    if not count or not np.isfinite(limit.multiplier):
        raise SolverError(
            "there is no mechanism to follow", where=str(live), remedy="take a load that has one"
        )
    moving = np.flatnonzero(block >= 0)
    weight = np.bincount(block[moving], on.model.mass[moving] * size, count)
    velocity, spin = _motions(on, limit.mechanism, [np.flatnonzero(block == k) for k in range(count)])
    along = velocity @ direction
    if not weight @ along > 0:
        raise SolverError("the mechanism does not move along the load", where=str(live))
    loss = weight @ (velocity @ down) + limit.multiplier * (weight @ along)

    def at(time: float) -> tuple[Array, float]:
        """Return the ways of the blocks along the load, and λ, when they have gone on for a time."""
        now = Rotation.from_rotvec(time * spin).apply(velocity)
        speed = np.linalg.norm(spin, axis=1)
        turn = np.maximum(time * speed, 1e-12)[:, None]
        axis = np.where(speed[:, None] > 0, spin / np.maximum(speed, 1e-300)[:, None], [0.0, 0.0, 1.0])
        fixed = np.sum(velocity * axis, axis=1, keepdims=True) * axis
        swept = (
            np.sin(turn) * (velocity - fixed) + (1.0 - np.cos(turn)) * np.cross(axis, velocity)
        ) / turn + fixed
        return time * swept @ direction, float((loss - weight @ (now @ down)) / (weight @ (now @ direction)))

    fastest = float(np.linalg.norm(spin, axis=1).max())
    last, ends = _end(lambda time: at(time)[1], fastest)
    times = np.linspace(0.0, last, _PLACES)
    curve = [at(float(time)) for time in times]
    lever = weight * along
    displacement = np.array([lever @ ways / lever.sum() for ways, _ in curve])
    return Kinematics(
        block=block,
        multiplier=limit.multiplier,
        weight=float(weight.sum()),
        mass=float((weight @ along) ** 2 / (size * (weight @ along**2))),
        share=float((weight @ along) ** 2 / (weight @ along**2) / weight.sum()),
        displacement=displacement,
        multipliers=np.array([multiplier for _, multiplier in curve]),
        capacity=float(displacement[-1]) if ends else float("inf"),
    )


def _motions(on: RigidAssembly, mechanism: Mechanism, blocks: Sequence[Ints]) -> tuple[Array, Array]:
    """Return the velocities of the centres of blocks (k, 3), and their spins (k, 3); none of what does not turn."""
    velocity, spin = np.zeros((len(blocks), 3)), np.zeros((len(blocks), 3))
    for k, members in enumerate(blocks):
        mass = on.model.mass[members]
        centre = mass @ on.state.centre[members] / mass.sum()
        first = members[np.argmax(mass)]
        turning = mechanism.velocity[first, 3:]
        if 0.5 * on.model.surfaces.size[first] * np.linalg.norm(turning) > _STANDS:
            spin[k] = turning
        velocity[k] = mechanism.velocity[first, :3] + np.cross(spin[k], centre - on.state.centre[first])
    return velocity, spin


def _end(multiplier: Callable[[float], float], fastest: float) -> tuple[float, bool]:
    """Return the time at which λ is 0, and whether there is one; else that of the farthest turn that is followed."""
    if fastest == 0.0:
        return 1.0, False
    times = np.linspace(0.0, _FARTHEST / fastest, 301)
    below = np.flatnonzero([not multiplier(float(time)) > 0 for time in times])
    if not len(below):
        return float(times[-1]), False
    first = int(below[0])
    return float(brentq(multiplier, times[first - 1], times[first])), True


def _blocks(on: RigidAssembly, mechanism: Mechanism) -> Ints:
    """Return the block (nb,) of each stone: those that touch and move as one; -1 where it stands."""
    velocity, centre = mechanism.velocity, on.state.centre
    moves = mechanism.speed > _STANDS
    moves[on.model.fixed] = False
    a, b = on.contacts.bodies.T
    carried = velocity[a, :3] + np.cross(velocity[a, 3:], centre[b] - centre[a])
    apart = np.linalg.norm(carried - velocity[b, :3], axis=1)
    size = on.model.surfaces.size[b]
    apart += 0.5 * size * np.linalg.norm(velocity[a, 3:] - velocity[b, 3:], axis=1)
    together = moves[a] & moves[b] & (apart < _SAME_MOTION)
    count = len(on.model.mass)
    graph = coo_array((np.ones(int(together.sum())), (a[together], b[together])), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    block = np.full(count, -1)
    block[moves] = np.unique(label[moves], return_inverse=True)[1]
    return block.astype(np.int64)
