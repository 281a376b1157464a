"""Mortar bonds between stones, made in joints that are closed as their stones meet."""

from dataclasses import replace

import numpy as np

from mechanics.arrays import Bools
from mechanics.scene.laws.law import BOND, REST, Approach

# values of the internal variable BOND; between 0 and WHOLE: damaged
WHOLE, BROKEN = 1.0, -1.0

_FILLED = 1e-2  # largest gap or overlap that mortar fills, over a body's size [-]; surveyed joints never close exactly


def with_bonds(contacts: Approach) -> Approach:
    """Return the contacts with the bonds that are made in the first step of the run, or of a stage of building.

    A bond keeps the gap of that instant as REST: that gap counts as closed, even after the bond has broken, as the
    mortar remains in the joint. A bed that mortar makes up (REST above zero before there is a bond) is filled, however
    wide it is.
    """
    if not contacts.first.any():
        return contacts
    state = contacts.state.copy()
    # the gap before the flight to the predicted configuration
    gap = contacts.gap - contacts.step * (1 - contacts.theta) * contacts.speed
    filled = (np.abs(gap) <= _FILLED * contacts.size) | (state[:, REST] > 0)
    closed = contacts.first & filled & (contacts.area > 0)
    state[closed, BOND] = WHOLE
    state[closed, REST] = gap[closed]
    return replace(contacts, state=state, first=np.zeros_like(contacts.first))


def bonded(contacts: Approach) -> Bools:
    """Return the contacts (n,) that are bonded, whole or damaged."""
    holds: Bools = contacts.state[:, BOND] > 0
    return holds
