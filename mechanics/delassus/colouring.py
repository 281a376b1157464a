"""Colouring of contacts: two contacts of one colour share no body that moves, so a colour may be swept in parallel."""

import numpy as np

from mechanics.arrays import Bools, Ints
from mechanics.delassus._kernels.colouring import first_fit

__all__ = ["greedy_colours"]


def greedy_colours(bodies: Ints, moving: Bools) -> Ints:
    """Return for each contact the smallest colour, from 0, that no earlier contact of its moving bodies has.

    Low colours are large, high ones small; there are at most as many as the contacts of two bodies that touch.
    A body that does not move (fixed, driven) takes no part, however many contacts it has. The same contacts in the
    same order get the same colours.

    Parameters
    ----------
    bodies : (n, 2) the two bodies of each contact
    moving : (nb,) which bodies impulses can move

    Returns
    -------
    (n,) colours
    """
    colour: Ints = first_fit(np.ascontiguousarray(bodies, dtype=np.int64), moving)
    return colour
