"""Warm start: impulses, velocities and internal variables of the contacts that persist from step to step."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.carried import Carrier
from mechanics.contact.contacts import PAIR_BIT
from mechanics.problem.problem import ContactSolution, ContactStart
from mechanics.scene.laws.law import BOND, ENERGY, REST, SPRING, STATE

__all__ = ["Memory"]


_AHEAD = (
    0.9  # part of the last change that is expected again [-]: forces without effect must not grow by habit
)
# internal variables that belong to places in a joint
_OF_PLACES = [BOND, REST, *range(SPRING.start, SPRING.stop)]


class Memory(Carrier):
    """Impulses, velocities and internal variables by contact key.

    Bonds, springs, and gaps that count as closed, belong to places in a joint. A face that slides a little, or is cut
    at another edge, gets contacts with new keys; where any contact has one of these, they inherit the internal
    variables of the nearest earlier contact of the pair. The force of a contact that is no more goes to the nearest one
    of its pair: where two faces are nearly parallel, or a corner lies on an edge, the same points get other names and
    axes as stones move by next to nothing.

    In a motion the forces and velocities of the last two steps are extrapolated to the next one, for contacts of both.

    Parameters
    ----------
    dimension : d, of the impulses

    Attributes
    ----------
    follows : the steps follow a motion, and need not begin where the last one ended
    """

    CARRIED = ("_before", "_force", "_key", "_key_before", "_motion", "_place", "_values", "follows")
    REBUILT = ("_dimension",)

    def __init__(self, dimension: int = 3, follows: bool = False) -> None:
        self._dimension, self.follows = dimension, follows
        self._key = np.zeros(0, dtype=np.int64)
        self._values = np.zeros((0, 2 * dimension + STATE))
        self._place: Array | None = None
        # of each contact on the first of its bodies (nc, d), world axes
        self._force: Array | None = None
        # the step before the last one, and the number of steps to come that count as part of a motion
        self._key_before, self._before = self._key, self._values[:, : 2 * dimension]
        self._motion = 0

    def recall(
        self, key: Ints, place: Array | None = None, axes: Array | None = None
    ) -> tuple[ContactStart, Array]:
        """Return the warm start of the contacts of some keys (nc,), and their internal variables (nc, STATE).

        Both are zero for new contacts, except for the internal variables in joints with bonds, springs or gaps that
        count as closed if the places (nc, d) [m] are given, and for impulses that are passed on if the axes (nc, d, d)
        are, too: rows n, t1, t2 as they point to the first body of each pair.
        """
        if np.array_equal(key, self._key):
            values = self._values
        else:
            values = np.zeros((len(key), self._values.shape[1]))
            order = np.argsort(self._key, kind="stable")
            if len(order):
                at, known = _places(self._key, key, order)
                values[known] = self._values[at[known]]
                if place is not None and axes is not None:
                    self._pass_on(values, at[known], key, place, axes)
                if place is not None and self._place is not None:
                    self._inherit(values, np.flatnonzero(~known), key, place, order)
                self._share(values, key, order)
        d = self._dimension
        motion = self._motion if self.follows else None
        last = ContactStart(values[:, :d], values[:, d : 2 * d], motion)
        if motion and len(self._key_before):
            last = replace(last, ahead=self._extrapolated(key, values[:, : 2 * d]))
        return last, values[:, 2 * d :]

    def _extrapolated(self, key: Ints, last: Array) -> ContactStart:
        """Return r and û of the next step, linear through the last two where a contact was there in both."""
        d = self._dimension
        if np.array_equal(key, self._key_before):
            before, known = self._before, np.ones(len(key), dtype=bool)
        else:
            at, known = _places(self._key_before, key, np.argsort(self._key_before, kind="stable"))
            before = self._before[at]
        # one that closed or opened has no line
        known &= _any(last[:, :d]) == _any(before[:, :d])
        ahead = last + (_AHEAD * known)[:, None] * (last - before)
        return ContactStart(ahead[:, :d], ahead[:, d:])

    def _pass_on(self, values: Array, kept: Ints, key: Ints, place: Array, axes: Array) -> None:
        """Add the forces of contacts that are no more to those nearest to them in their pairs."""
        if self._place is None or self._force is None:
            return
        gone = _any(self._force)
        gone[kept] = False
        lost = np.flatnonzero(gone)
        passed, heir = _nearest(
            self._key[lost], self._place[lost], key, place, np.argsort(key, kind="stable")
        )
        impulse = np.einsum("cij,cj->ci", axes[heir], self._force[lost[passed]])
        np.add.at(values[:, : self._dimension], heir, impulse)

    def _inherit(self, values: Array, new: Ints, key: Ints, place: Array, order: Ints) -> None:
        """Copy the internal variables of the nearest old contacts of their pairs to new ones (rows of `values`)."""
        state = self._values[:, 2 * self._dimension :]
        if not len(new) or self._place is None or not state[:, _OF_PLACES].any():
            return
        heirs, nearest = _nearest(key[new], place[new], self._key, self._place, order)
        values[new[heirs], 2 * self._dimension :] = state[nearest]

    def _share(self, values: Array, key: Ints, order: Ints) -> None:
        """Share what the springs of each pair of shapes hold evenly over the contacts that it has now."""
        column = 2 * self._dimension + ENERGY
        held = self._values[order, column]
        if not held.any():
            return
        pair, first = np.unique(self._key[order] >> PAIR_BIT, return_index=True)
        total = np.add.reduceat(held, first)
        now, row, count = np.unique(key >> PAIR_BIT, return_inverse=True, return_counts=True)
        at, known = _places(pair, now, np.arange(len(pair)))
        values[:, column] = (np.where(known, total[at], 0.0) / count)[row]

    def store(
        self,
        key: Ints,
        solution: ContactSolution,
        state: Array,
        place: Array | None = None,
        axes: Array | None = None,
    ) -> None:
        """Remember a step: its solution, with true impulses r, internal variables (nc, STATE), places and axes."""
        self._key_before, self._before = self._key, self._values[:, : 2 * self._dimension]
        self._key, self._place, self._motion = key, place, solution.motion
        self._force = None if axes is None else np.einsum("cij,ci->cj", axes, solution.impulse)
        self._values = np.hstack([solution.impulse, solution.velocity, state])

    def take_up(
        self,
        key: Ints,
        solution: Array,
        state: Array,
        place: Array | None = None,
        axes: Array | None = None,
    ) -> None:
        """Remember further contacts as part of the last step: r and û (nc, 2d), internal variables, places, axes."""
        self._key = np.concatenate([self._key, key])
        self._values = np.vstack([self._values, np.hstack([solution, state])])
        if self._place is not None and place is not None:
            self._place = np.vstack([self._place, place])
        if self._force is not None and axes is not None:
            force = np.einsum("cij,ci->cj", axes, solution[:, : self._dimension])
            self._force = np.vstack([self._force, force])

    def at_rest(self, factor: float) -> "Memory":
        """Return the forces for a step `factor` times as long, of bodies that have come to rest; none with 0."""
        d, other = self._dimension, Memory(self._dimension, self.follows)
        other._key, other._place, other._values = self._key, self._place, self._values.copy()
        other._values[:, :d] *= factor
        other._values[:, d : 2 * d] = 0.0
        other._force = None if self._force is None else factor * self._force
        return other

    def renamed(self, names: Callable[[Ints], Ints]) -> "Memory":
        """Return the memory of the same contacts under other keys; those whose new key is negative are forgotten."""
        key = names(self._key)
        kept = np.flatnonzero(key >= 0)
        other = Memory(self._dimension, self.follows)
        other._key, other._values = key[kept], self._values[kept]
        other._place = None if self._place is None else self._place[kept]
        # no forces to pass on: which of two bodies is the first may have changed
        return other


def _any(values: Array) -> Bools:
    """Return the rows (n,) of values (n, d) that have any other than zero."""
    any_: Bools = np.einsum("cd,cd->c", values, values) > 0.0
    return any_


def _nearest(key: Ints, place: Array, among: Ints, there: Array, order: Ints) -> tuple[Ints, Ints]:
    """Return which of the contacts (n,) have others in their pairs, which `order` sorts by key, and the nearest."""
    pair, asked = among[order] >> PAIR_BIT, key >> PAIR_BIT
    low, high = np.searchsorted(pair, asked, side="left"), np.searchsorted(pair, asked, side="right")
    own, count = np.flatnonzero(high > low), (high - low)[high > low]
    # all others of each pair, one after the other
    first = np.cumsum(count) - count
    other = order[np.arange(count.sum()) - np.repeat(first - low[own], count)]
    distance = np.linalg.norm(there[other] - np.repeat(place[own], count, axis=0), axis=1)
    each = np.repeat(np.arange(len(own)), count)
    return own, other[np.lexsort((distance, each))[first]]


def _places(among: Ints, key: Ints, order: Ints) -> tuple[Ints, Bools]:
    """Return where each key (nc,) stands `among` others, which `order` sorts, and whether it is there at all."""
    at: Ints = order[np.minimum(np.searchsorted(among, key, sorter=order), len(order) - 1)]
    return at, among[at] == key
