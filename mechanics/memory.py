"""What the solver remembers from step to step: the impulses of contacts that persist."""

import numpy as np
from numpy.typing import NDArray

from mechanics.contact.contacts import Contacts

__all__ = ["Memory"]

Array = NDArray[np.float64]


class Memory:
    """Impulses by contact key, for warm starts."""

    def __init__(self) -> None:
        self._key = np.zeros(0, dtype=np.int64)
        self._impulse = np.zeros((0, 3))

    def recall(self, contacts: Contacts) -> Array:
        """Impulses (nc, 3) of the same contacts in the last step [N s]; zero for new ones."""
        impulse = np.zeros((len(contacts), 3))
        if len(self._key):
            place = np.minimum(np.searchsorted(self._key, contacts.key), len(self._key) - 1)
            known = self._key[place] == contacts.key
            impulse[known] = self._impulse[place[known]]
        return impulse

    def store(self, contacts: Contacts, impulse: Array) -> None:
        """Remember the impulses (nc, 3) of this step."""
        order = np.argsort(contacts.key, kind="stable")
        self._key, self._impulse = contacts.key[order], impulse[order]
