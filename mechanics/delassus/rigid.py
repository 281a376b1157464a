"""Delassus operator between rigid bodies, matrix-free: 15 numbers for each contact, 7 for each body."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numba
import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.delassus._kernels import rigid as kernel
from mechanics.delassus._kernels.strips import cut
from mechanics.delassus.body_space import BodyForm, scaled_frames
from mechanics.problem._kernels import Laws
from mechanics.problem.problem import GaussSeidel, RigidContacts, mean_diagonal

# below this number of contacts one thread sweeps: more would gain nothing
_WORTH_PARTS = 2000
# contacts from which there are four parts instead of two: their share of crossing contacts is larger
_MANY = 16_000
# change of a body's velocity, over the largest shift, below which its contacts sleep [-]
_CALM = 1e-9


@dataclass(frozen=True)
class Schedule:
    """Order of the sweeps; it depends on the contacts alone, never on the number of threads.

    Attributes
    ----------
    order : (nc,) contacts in sweep order: those with the same candidate and antagonist follow one another
    group : (ng+1,) offset of each such group in that order
    part : (k+1,) offset of each part among the groups. All parts but the last share no moving body with each
        other; the last holds the contacts between them. One part alone for few contacts, which are swept by one thread
    """

    order: Ints
    group: Ints
    part: Ints


def in_order(count: int) -> Schedule:
    """Return the schedule of so many contacts that are swept as they are, by one thread."""
    return Schedule(np.arange(count), np.arange(count + 1), np.array([0, count]))


def schedule(bodies: Ints, moving: Bools) -> Schedule:
    """Group the contacts (nc, 2) by candidate and antagonist, in the order of the bodies, cut into parts if many.

    Two stones of several parts may each be the candidate of the other; they then have two groups.
    """
    count = len(bodies)
    if count == 0:
        empty = np.zeros(0, dtype=np.int64)
        return Schedule(empty, np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64))
    first, second = bodies.T
    pair = 2 * (np.minimum(first, second) * len(moving) + np.maximum(first, second)) + (first > second)
    order = np.argsort(pair, kind="stable")
    starts = np.flatnonzero(np.diff(pair[order], prepend=-1))
    sizes = np.diff(starts, append=count)
    if count < _WORTH_PARTS:
        return Schedule(order, np.append(starts, count), np.array([0, len(starts)]))
    # body order, usually course by course, halves the number of sweeps
    by_part, part, _ = cut(bodies[order[starts]], moving, 2 if count < _MANY else 4, False)
    sizes, starts = sizes[by_part], starts[by_part]
    group = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    inside = np.arange(count) - np.repeat(group[:-1], sizes)
    return Schedule(order[np.repeat(starts, sizes) + inside], group, part)


@dataclass(frozen=True)
class RigidDelassus:
    """W = Hᵀ ŵ H of contacts in the order of a schedule.

    Attributes
    ----------
    body, geometry, inertia : as in `RigidContacts`
    schedule : order of the sweeps
    threads : largest number of threads that sweep at once; the result is the same to the last bit
    centre : (nb, 3) of the bodies, by which factors are ordered; None if not known [m]
    """

    body: Ints
    geometry: Array
    inertia: Array
    schedule: Schedule
    threads: int = 1
    centre: Array | None = None
    plane = None
    joint_compliance = None
    mostly_rigid = False
    as_rigid = None

    @cached_property
    def rigid(self) -> RigidContacts:
        """Contacts in terms of rigid bodies."""
        centre = np.zeros((0, 3)) if self.centre is None else self.centre
        return RigidContacts(self.body, self.geometry, self.inertia, centre)

    @cached_property
    def diagonal(self) -> Array:
        """W_αα (nc, 3, 3) [1/kg]."""
        blocks: Array = kernel.diagonals(self.rigid)
        return blocks

    @cached_property
    def scale(self) -> float:
        """Mean diagonal of W [1/kg]."""
        return mean_diagonal(self.diagonal)

    @cached_property
    def _factors(self) -> Array:
        factors: Array = kernel.factors_of(self.diagonal)
        return factors

    def apply(self, impulse: Array) -> Array:
        """Return W r (nc, 3) [m/s]."""
        velocity: Array = kernel.apply(impulse, self.rigid)
        return velocity

    def rigid_change(self, impulse: Array) -> Array:
        """Return the velocities (nb, 6) that the impulses give to the bodies [m/s, rad/s]."""
        change: Array = kernel.velocity_change(impulse, self.rigid)
        return change

    def relative_velocity(self, velocity: Array) -> Array:
        """Return u (nc, 3) of the bodies' velocities (nb, 6) [m/s]."""
        relative: Array = kernel.relative_velocity(velocity, self.rigid)
        return relative

    @cached_property
    def form(self) -> BodyForm:
        """W for methods that factorise: six velocities for each body that moves, world axes."""
        return BodyForm(self.rigid)

    @cached_property
    def memo(self) -> dict[str, Any]:
        """Results that solvers derived from W alone, by name; they can be recomputed with the same bits."""
        return {}

    def scaled(self, unit: Array) -> "RigidDelassus":
        """Return D W D with the units (nc,) of the contacts on the diagonal of D; the pattern of factors is shared.

        The result, with its factors, is kept for the next call with the same units.
        """
        cached: tuple[Array, RigidDelassus] | None = self.__dict__.get("_scaled")
        if cached is not None and np.array_equal(cached[0], unit):
            return cached[1]
        scaled = replace(self, geometry=scaled_frames(self.geometry, unit))
        # the kernel of the diagonal assumes frames of unit length
        scaled.__dict__["diagonal"] = self.diagonal * (unit**2)[:, None, None]
        scaled.__dict__["form"] = self.form.scaled(unit)
        self.__dict__["_scaled"] = unit, scaled
        return scaled

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Return sweeps in the order of the schedule; the same bits for any number of threads.

        Each call visits every contact at least once; contacts whose bodies hardly change then sleep until they do.
        Velocities are recomputed on each call, so that rounding cannot accumulate.
        """
        # opening contacts need no impulse, however fast
        calm = _CALM * max(float(np.abs(shift[:, 1:]).max(initial=0.0)), float(-shift[:, 0].min(initial=0.0)))
        threads = min(self.threads, numba.config.NUMBA_NUM_THREADS)
        laws, plan = Laws(shift, friction, cohesion, self._factors), self.schedule

        def sweeps(impulse: Array, count: int) -> None:
            """Sweep over the contacts of rigid bodies, by threads where the schedule has parts."""
            path, seen = np.zeros(len(self.inertia)), np.full((len(plan.group) - 1, 2), -np.inf)
            running = kernel.Running(impulse, self.rigid_change(impulse), path, seen)
            if len(plan.part) > 2 and threads > 1:
                numba.set_num_threads(threads)
                kernel.sweep_parallel(count, calm, running, laws, self.rigid, plan.group, plan.part)
            else:
                kernel.sweep(count, calm, running, laws, self.rigid, plan.group)

        return sweeps
