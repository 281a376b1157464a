"""Bonds between stones, as mortar makes them: where the first step finds a joint closed."""

from dataclasses import replace

import numpy as np

from mechanics.arrays import Bools
from mechanics.scene.laws.law import BOND, REST, Approach

__all__ = ["BROKEN", "WHOLE", "bonded", "with_bonds"]

# values of the internal variable BOND; between 0 and WHOLE: damaged
WHOLE, BROKEN = 1.0, -1.0

# of a body's size: mortar fills joints up to this width, open or overlapping; surveyed joints never close exactly
_FILLED = 1e-2


def with_bonds(contacts: Approach) -> Approach:
    """The contacts with the bonds that the first step makes.

    A bond keeps the gap with which the run begins as REST: that gap is closed for it, and stays so when it has
    broken, as the mortar is still there.
    """
    if not contacts.first:
        return contacts
    state = contacts.state.copy()
    # before the flight to the predicted configuration
    gap = contacts.gap - contacts.step * (1 - contacts.theta) * contacts.speed
    closed = (np.abs(gap) <= _FILLED * contacts.size) & (contacts.area > 0)
    state[closed, BOND] = WHOLE
    state[closed, REST] = gap[closed]
    return replace(contacts, state=state, first=False)


def bonded(contacts: Approach) -> Bools:
    """Which contacts (n,) are bonded, whole or damaged."""
    holds: Bools = contacts.state[:, BOND] > 0
    return holds
