"""Form of W between contacts for methods that factorise: bodies are condensed on their contacts."""

from collections.abc import Callable
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array, csc_array

from mechanics.arrays import Array, Ints
from mechanics.delassus.multifrontal import Cliques, Fronts, fronts


class CondensedForm:
    """W + Θ, factorised by stones; far smaller than a nodal system where stones have more nodes than contacts.

    Parameters
    ----------
    bodies : (nc, 2) of each contact
    cliques : W as a sum of blocks
    threads : that factorise; the factors are the same to the last bit
    """

    def __init__(self, bodies: Ints, cliques: Cliques, threads: int = 1) -> None:
        self._bodies, self._cliques, self._threads = bodies, cliques, threads

    @property
    def matrix(self) -> "csc_array[np.float64]":
        """W (3 nc, 3 nc) [1/kg]."""
        return assembled(self._cliques, len(self._bodies))

    @cached_property
    def _fronts(self) -> Fronts:
        return fronts(self._bodies, self._cliques.contacts)

    def shifted(self, theta: Array, exact: bool = True) -> Callable[[Array], Array]:
        """Return (W + Θ)⁻¹ as a function of b (3 nc,); `theta` (nc, 3, 3), not always symmetric [1/kg].

        Raises
        ------
        SolverError : if W + Θ is singular
        """
        return self._fronts.factorise(self._cliques, theta, self._threads).solve


def assembled(cliques: Cliques, count: int) -> "csc_array[np.float64]":
    """Return the sum (3 nc, 3 nc) of the blocks between some of `count` contacts [1/kg]."""
    row, column, value = [], [], []
    for contacts, block in zip(cliques.contacts, cliques.blocks, strict=True):
        place = (3 * contacts[:, None] + np.arange(3)).ravel()
        row.append(np.repeat(place, len(place)))
        column.append(np.tile(place, len(place)))
        value.append(block.ravel())
    index, size = (np.concatenate(row), np.concatenate(column)), 3 * count
    return csc_array(coo_array((np.concatenate(value), index), shape=(size, size)))
