"""Status of contacts, in one word."""

import numpy as np
from numpy.typing import NDArray

from mechanics.arrays import Array
from mechanics.scene.laws.dry_joint import at_limit
from mechanics.scene.laws.law import BOND, CRUSHED, Terms

STATUSES = ("open", "stick", "slip", "bonded", "broken", "crush")


def contact_status(state: Array, terms: Terms, impulse: Array) -> NDArray[np.str_]:
    """Return the status (n,) of contacts, from their internal variables (n, STATE) after a step and its r̃ (n, d) [N s].

    *crush*: under pressure where the joint has been crushed; *bonded*: an intact or damaged bond; *broken*: open after
    a bond; *slip*: under pressure at the limit of the cone; *stick*: under pressure below it.
    """
    bond, is_open = state[:, BOND], impulse[:, 0] <= 0
    return np.select(
        [
            ~is_open & (state[:, CRUSHED] > 0),
            bond > 0,
            is_open & (bond < 0),
            is_open,
            at_limit(terms, impulse),
        ],
        ["crush", "bonded", "broken", "open", "slip"],
        "stick",
    )
