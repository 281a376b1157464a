"""What the solver remembers from step to step: the solution at contacts that persist."""

import numpy as np
from numpy.typing import NDArray

from mechanics.contact.contacts import Contacts
from mechanics.problem import ContactSolution, ContactStart

__all__ = ["Memory"]

Array = NDArray[np.float64]


class Memory:
    """Impulses and velocities by contact key, for warm starts."""

    def __init__(self) -> None:
        self._key = np.zeros(0, dtype=np.int64)
        self._values = np.zeros((0, 6))

    def recall(self, contacts: Contacts) -> ContactStart:
        """What the same contacts had in the last step; zero for new ones."""
        values = np.zeros((len(contacts), 6))
        if len(self._key):
            place = np.minimum(np.searchsorted(self._key, contacts.key), len(self._key) - 1)
            known = self._key[place] == contacts.key
            values[known] = self._values[place[known]]
        return ContactStart(values[:, :3], values[:, 3:])

    def store(self, contacts: Contacts, solution: ContactSolution) -> None:
        """Remember the solution of this step."""
        order = np.argsort(contacts.key, kind="stable")
        self._key = contacts.key[order]
        self._values = np.hstack([solution.impulse, solution.velocity])[order]
