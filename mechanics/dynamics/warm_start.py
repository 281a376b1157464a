"""Warm start: impulses, velocities and internal variables of the contacts that persist from step to step."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.carried import Carrier
from mechanics.contact.contacts import PAIR_BIT
from mechanics.problem.problem import ContactSolution, ContactStart
from mechanics.scene.laws.law import BOND, ENERGY, REST, SPRING, STATE

_AHEAD = (
    0.9  # part of the last change that is expected again [-]: forces without effect must not grow by habit
)
# internal variables that belong to places in a joint
_OF_PLACES = [BOND, REST, *range(SPRING.start, SPRING.stop)]


class Memory(Carrier):
    """Impulses, velocities and internal variables by contact key.

    Bonds, springs, and gaps that count as closed, belong to places in a joint. A face that slides a little, or is cut
    at another edge, gets contacts with new keys; where any contact has one of these, they inherit the internal
    variables of the nearest earlier contact of the pair.

    In a motion the forces and velocities of the last two steps are extrapolated to the next one, for contacts of both.

    Parameters
    ----------
    dimension : d, of the impulses

    Attributes
    ----------
    follows : the steps follow a motion, and need not begin where the last one ended
    """

    CARRIED = ("_before", "_key", "_key_before", "_motion", "_place", "_values", "follows")
    REBUILT = ("_dimension",)

    def __init__(self, dimension: int = 3, follows: bool = False) -> None:
        self._dimension, self.follows = dimension, follows
        self._key = np.zeros(0, dtype=np.int64)
        self._values = np.zeros((0, 2 * dimension + STATE))
        self._place: Array | None = None
        # the step before the last one, and the number of steps to come that count as part of a motion
        self._key_before, self._before = self._key, self._values[:, : 2 * dimension]
        self._motion = 0

    def recall(self, key: Ints, place: Array | None = None) -> tuple[ContactStart, Array]:
        """Return the warm start of the contacts of some keys (nc,), and their internal variables (nc, STATE).

        Both are zero for new contacts, except for the internal variables in joints with bonds, springs or gaps that
        count as closed if the places (nc, d) [m] are given.
        """
        if np.array_equal(key, self._key):
            values = self._values
        else:
            values = np.zeros((len(key), self._values.shape[1]))
            order = np.argsort(self._key, kind="stable")
            if len(order):
                at, present = _places(self._key, key, order)
                values[present] = self._values[at[present]]
                if place is not None and self._place is not None:
                    self._inherit(values, np.flatnonzero(~present), key, place, order)
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
            before, present = self._before, np.ones(len(key), dtype=bool)
        else:
            at, present = _places(self._key_before, key, np.argsort(self._key_before, kind="stable"))
            before = self._before[at]
        # one that closed or opened has no line
        present &= _any(last[:, :d]) == _any(before[:, :d])
        ahead = last + (_AHEAD * present)[:, None] * (last - before)
        return ContactStart(ahead[:, :d], ahead[:, d:])

    def _inherit(self, values: Array, new: Ints, key: Ints, place: Array, order: Ints) -> None:
        """Copy the internal variables of the nearest old contacts of their pairs to new ones (rows of `values`)."""
        state = self._values[:, 2 * self._dimension :]
        if not len(new) or self._place is None or not state[:, _OF_PLACES].any():
            return
        pair, asked = self._key[order] >> PAIR_BIT, key[new] >> PAIR_BIT
        low, high = np.searchsorted(pair, asked, side="left"), np.searchsorted(pair, asked, side="right")
        heirs, count = new[high > low], (high - low)[high > low]
        if not len(heirs):
            return
        # all old contacts of each heir's pair, heir by heir
        first = np.concatenate([[0], np.cumsum(count)[:-1]])
        old = order[np.arange(count.sum()) - np.repeat(first - low[high > low], count)]
        distance = np.linalg.norm(self._place[old] - np.repeat(place[heirs], count, axis=0), axis=1)
        heir = np.repeat(np.arange(len(heirs)), count)
        nearest = old[np.lexsort((distance, heir))[first]]
        values[heirs, 2 * self._dimension :] = state[nearest]

    def _share(self, values: Array, key: Ints, order: Ints) -> None:
        """Share what the springs of each pair of shapes hold evenly over the contacts that it has now."""
        column = 2 * self._dimension + ENERGY
        stored = self._values[order, column]
        if not stored.any():
            return
        pair, first = np.unique(self._key[order] >> PAIR_BIT, return_index=True)
        total = np.add.reduceat(stored, first)
        now, row, count = np.unique(key >> PAIR_BIT, return_inverse=True, return_counts=True)
        at, paired = _places(pair, now, np.arange(len(pair)))
        values[:, column] = (np.where(paired, total[at], 0.0) / count)[row]

    def store(self, key: Ints, solution: ContactSolution, state: Array, place: Array | None = None) -> None:
        """Remember a step: its solution, with true impulses r, internal variables (nc, STATE) and places."""
        self._key_before, self._before = self._key, self._values[:, : 2 * self._dimension]
        self._key, self._place, self._motion = key, place, solution.motion
        self._values = np.hstack([solution.impulse, solution.velocity, state])

    def take_up(self, key: Ints, solution: Array, state: Array, place: Array | None = None) -> None:
        """Remember further contacts as part of the last step: r and û (nc, 2d), internal variables, places."""
        self._key = np.concatenate([self._key, key])
        self._values = np.vstack([self._values, np.hstack([solution, state])])
        if self._place is not None and place is not None:
            self._place = np.vstack([self._place, place])

    def at_rest(self, factor: float) -> "Memory":
        """Return the forces for a step `factor` times as long, of bodies that have come to rest; none with 0."""
        d, memory = self._dimension, Memory(self._dimension, self.follows)
        memory._key, memory._place, memory._values = self._key, self._place, self._values.copy()
        memory._values[:, :d] *= factor
        memory._values[:, d : 2 * d] = 0.0
        return memory

    def renamed(self, names: Callable[[Ints], Ints]) -> "Memory":
        """Return the memory of the same contacts under other keys; those whose new key is negative are forgotten."""
        key = names(self._key)
        rows = np.flatnonzero(key >= 0)
        memory = Memory(self._dimension, self.follows)
        memory._key, memory._values = key[rows], self._values[rows]
        memory._place = None if self._place is None else self._place[rows]
        return memory


def _any(values: Array) -> Bools:
    """Return the rows (n,) of values (n, d) that have any other than zero."""
    any_: Bools = np.einsum("cd,cd->c", values, values) > 0.0
    return any_


def _places(among: Ints, key: Ints, order: Ints) -> tuple[Ints, Bools]:
    """Return where each key (nc,) stands `among` others, which `order` sorts, and whether it is there at all."""
    at: Ints = order[np.minimum(np.searchsorted(among, key, sorter=order), len(order) - 1)]
    return at, among[at] == key
