"""W between contacts, ready to be factorised: bodies are condensed on their contacts."""

from collections.abc import Callable
from functools import cached_property

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.delassus.multifrontal import Cliques, Fronts, fronts

__all__ = ["CondensedForm"]


class CondensedForm:
    """W + Θ, factorised by stones; where stones have more nodes than contacts, far smaller than a system of nodes.

    Attributes
    ----------
    cliques : W as a sum of blocks

    Parameters
    ----------
    bodies : (nc, 2) of each contact
    cliques : as above
    """

    def __init__(self, bodies: Ints, cliques: Cliques) -> None:
        self._bodies, self.cliques = bodies, cliques
        self._relaxed: dict[float, Callable[[Array], Array]] = {}

    @cached_property
    def _fronts(self) -> Fronts:
        return fronts(self._bodies, self.cliques.contacts)

    def shifted(self, theta: Array) -> Callable[[Array], Array]:
        """(W + Θ)⁻¹ as a function of b (3 nc,); `theta` (nc, 3, 3), not always symmetric [1/kg].

        Raises
        ------
        SolverError : if W + Θ is singular
        """
        return self._fronts.factorise(self.cliques, theta).solve

    def relaxed(self, sigma: float) -> Callable[[Array], Array]:
        """(W/σ + 1)⁻¹ as a function of b (3 nc,); its factors are kept for the next call."""
        if sigma not in self._relaxed:
            solve = self.shifted(np.tile(sigma * np.eye(3), (len(self._bodies), 1, 1)))
            self._relaxed[sigma] = lambda b: solve(sigma * b)
        return self._relaxed[sigma]
