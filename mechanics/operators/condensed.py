"""W between contacts, sparse and ready to be factorised, where deformable bodies are condensed on their contacts."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import block_array, csc_array, csr_array, eye_array
from scipy.sparse.linalg import splu

__all__ = ["CondensedForm"]

Array = NDArray[np.float64]


class CondensedForm:
    """W = W_el + Hᵀ Â⁻¹ H: elastic bodies as blocks between their contacts, rigid ones by their velocities.

    (W/σ + 1) r = b is solved through the symmetric, quasi-definite system

        [ W_el/σ + 1    Hᵀ  ] [ r ]   [ b ]
        [ H            -σ Â ] [ w ] = [ 0 ],     w = Â⁻¹ H r / σ

    which has factors for every order of elimination (Vanderbei 1995). Where stones have more nodes than contacts it is
    far smaller than the system of their nodes.

    Parameters
    ----------
    elastic : W_el (3 nc, 3 nc) [1/kg]
    across : Hᵀ (3 nc, 6 nr) of the rigid bodies
    inertia : Â (6 nr, 6 nr) [kg]
    """

    def __init__(
        self,
        elastic: "csc_array[np.float64]",
        across: "csr_array[np.float64]",
        inertia: "csc_array[np.float64]",
    ) -> None:
        self._elastic, self._across, self._inertia = elastic, across, inertia
        self._inverse: dict[float, Callable[[Array], Array]] = {}

    def relaxed(self, sigma: float) -> Callable[[Array], Array]:
        """(W/σ + 1)⁻¹ as a function of b (3 nc,); its factors are kept for the next call."""
        if sigma not in self._inverse:
            self._inverse[sigma] = self._factorise(sigma)
        return self._inverse[sigma]

    def _factorise(self, sigma: float) -> Callable[[Array], Array]:
        size, more = self._across.shape
        system = (self._elastic / sigma + eye_array(size, format="csc")).tocsc()
        if more:
            system = block_array(
                [[system, self._across], [self._across.T, -sigma * self._inertia]], format="csc"
            )
        factor = splu(
            system, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        if not more:
            return factor.solve  # type: ignore[no-any-return]
        padding = np.zeros(more)
        return lambda b: factor.solve(np.concatenate([b, padding]))[:size]
