"""What is remembered from step to step of contacts that persist: the solver's solution and the laws' own variables."""

import numpy as np
from numpy.typing import NDArray

from mechanics.laws.law import STATE
from mechanics.problem import ContactSolution, ContactStart

__all__ = ["Memory"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class Memory:
    """Impulses, velocities and internal variables by contact key.

    Parameters
    ----------
    dimension : d, of the impulses
    """

    def __init__(self, dimension: int = 3) -> None:
        self._dimension = dimension
        self._key = np.zeros(0, dtype=np.int64)
        self._values = np.zeros((0, 2 * dimension + STATE))

    def recall(self, key: Ints) -> tuple[ContactStart, Array]:
        """What the contacts of these keys (nc,) had in the last step, and their internal variables (nc, STATE).

        Zero for new contacts.
        """
        if key is self._key:
            values = self._values
        else:
            values = np.zeros((len(key), self._values.shape[1]))
            order = np.argsort(self._key, kind="stable")
            if len(order):
                at = order[np.minimum(np.searchsorted(self._key, key, sorter=order), len(order) - 1)]
                known = self._key[at] == key
                values[known] = self._values[at[known]]
        d = self._dimension
        return ContactStart(values[:, :d], values[:, d : 2 * d]), values[:, 2 * d :]

    def store(self, key: Ints, solution: ContactSolution, state: Array) -> None:
        """Remember this step: its solution, and the internal variables (nc, STATE) that the laws left."""
        self._key = key
        self._values = np.hstack([solution.impulse, solution.velocity, state])
