"""W between rigid bodies, matrix-free: 15 numbers for each contact, 7 for each body."""

from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.delassus._kernels import rigid as kernel
from mechanics.delassus.body_space import BodyForm, scaled_frames
from mechanics.problem.problem import GaussSeidel
from mechanics.solvers.first_order.colouring import greedy_colours

__all__ = ["RigidDelassus", "Schedule", "schedule"]


# fewer contacts than this are swept in their own order by one thread: there is nothing to win from more
_WORTH_COLOURS = 2000
# of the largest shift: contacts between bodies whose velocities change less than this sleep until they change more
_CALM = 1e-9


@dataclass(frozen=True)
class Schedule:
    """In which order contacts are swept; it depends on the contacts alone, never on the number of threads.

    Attributes
    ----------
    order : (nc,) contacts in sweep order: those with the same candidate and antagonist follow one another
    group : (ng+1,) where, in that order, each such group begins
    colour : (k+1,) where each colour begins among the groups; groups of one colour share no moving body. One
        colour for few contacts, which are swept by one thread
    """

    order: Ints
    group: Ints
    colour: Ints


def schedule(bodies: Ints, moving: Bools) -> Schedule:
    """Group the contacts (nc, 2) by candidate and antagonist, and colour the groups if they are many.

    Stones of several parts may be either to one another; they have two groups then.
    """
    count = len(bodies)
    if count == 0:
        empty = np.zeros(0, dtype=np.int64)
        return Schedule(empty, np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64))
    pair = 2 * (bodies.min(axis=1) * len(moving) + bodies.max(axis=1)) + (bodies[:, 0] > bodies[:, 1])
    order = np.argsort(pair, kind="stable")
    starts = np.flatnonzero(np.diff(pair[order], prepend=-1))
    sizes = np.diff(starts, append=count)
    if count < _WORTH_COLOURS:
        return Schedule(order, np.append(starts, count), np.array([0, len(starts)]))
    colours = greedy_colours(bodies[order[starts]], moving)
    by_colour = np.argsort(colours, kind="stable")
    sizes, starts = sizes[by_colour], starts[by_colour]
    group = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    inside = np.arange(count) - np.repeat(group[:-1], sizes)
    return Schedule(
        order[np.repeat(starts, sizes) + inside],
        group,
        np.searchsorted(colours[by_colour], np.arange(colours.max() + 2)).astype(np.int64),
    )


@dataclass(frozen=True)
class RigidDelassus:
    """W = Hᵀ ŵ H of contacts in the order of a schedule.

    Attributes
    ----------
    body : (nc, 2) candidate and antagonist
    geometry : (nc, 15) rows n, t1, t2 of the frame, then the lever arms from the two centres of mass [m], world axes
    inertia : (nb, 7) inverse mass [1/kg], upper triangle of the inverse inertia [1/(kg m²)], world axes; zero for
        bodies that no impulse moves
    schedule : order of the sweeps
    threads : that may sweep at once, at most; the result is the same to the last bit
    """

    body: Ints
    geometry: Array
    inertia: Array
    schedule: Schedule
    threads: int = 1

    @cached_property
    def diagonal(self) -> Array:
        """W_αα (nc, 3, 3) [1/kg]."""
        blocks: Array = kernel.diagonals(self.body, self.geometry, self.inertia)
        return blocks

    @cached_property
    def _factors(self) -> Array:
        factors: Array = kernel.factors_of(self.diagonal)
        return factors

    def apply(self, impulse: Array) -> Array:
        """W r (nc, 3) [m/s]."""
        velocity: Array = kernel.apply(impulse, self.body, self.geometry, self.inertia)
        return velocity

    def rigid_change(self, impulse: Array) -> Array:
        """Velocities (nb, 6) that the impulses give to the bodies [m/s, rad/s]."""
        change: Array = kernel.velocity_change(impulse, self.body, self.geometry, self.inertia)
        return change

    def relative_velocity(self, velocity: Array) -> Array:
        """u (nc, 3) of the bodies' velocities (nb, 6) [m/s]."""
        relative: Array = kernel.relative_velocity(velocity, self.body, self.geometry)
        return relative

    @cached_property
    def sparse(self) -> BodyForm:
        """The same W for methods that factorise: six velocities for each body that moves, world axes."""
        return BodyForm(self.body, self.geometry, self.inertia)

    def scaled(self, unit: Array) -> "RigidDelassus":
        """D W D with the units (nc,) of the contacts on the diagonal of D; what is known for factors is shared."""
        other = replace(self, geometry=scaled_frames(self.geometry, unit))
        # the kernel for the diagonal takes frames for what they are: of length one
        other.__dict__["diagonal"] = self.diagonal * (unit**2)[:, None, None]
        other.__dict__["sparse"] = self.sparse.scaled(unit)
        return other

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Sweeps in the order of the schedule; the same bits for any number of threads.

        Each call visits every contact at least once; those whose bodies hardly change then sleep until these do. The
        running velocities are made anew on each call, so that rounding cannot pile up.
        """
        # what opens needs no impulse, however fast
        calm = _CALM * max(float(np.abs(shift[:, 1:]).max(initial=0.0)), float(-shift[:, 0].min(initial=0.0)))
        threads = min(self.threads, numba.config.NUMBA_NUM_THREADS)
        parallel = len(self.schedule.colour) > 2 and threads > 1

        def sweeps(impulse: Array, count: int) -> None:
            change = self.rigid_change(impulse)
            data = (count, calm, impulse, change, shift, friction, cohesion, self._factors, self.body)
            more = (self.geometry, self.inertia, self.schedule.group)
            if parallel:
                numba.set_num_threads(threads)
                kernel.sweep_parallel(*data, *more, self.schedule.colour)
            else:
                kernel.sweep(*data, *more)

        return sweeps
