"""Forms of the Delassus operator for methods that factorise it."""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.sparse import block_array, bsr_array, csc_array, diags_array
from scipy.sparse.linalg import splu

from ground.errors import SolverError
from mechanics.arrays import Array


class Form(Protocol):
    """W in a form that can be factorised.

    Attributes
    ----------
    matrix : (d nc, d nc) W where it is assembled; None for W = Hᵀ Â⁻¹ H (`SparseForm`), which would be dense
    """

    @property
    def matrix(self) -> "csc_array[np.float64] | None":
        """W (d nc, d nc), or None."""

    def shifted(self, theta: Array, exact: bool = True) -> Callable[[Array], Array]:
        """Return (W + Θ)⁻¹ as a function of b (d nc,); W may be singular where Θ holds it.

        Parameters
        ----------
        theta : (nc, d, d) Θ, not always symmetric [1/kg]
        exact : False allows the fastest way, even where it loses more than rounding

        Raises
        ------
        SolverError : if W + Θ is singular
        """


class SparseForm:
    """W as Hᵀ Â⁻¹ H with sparse matrices.

    Attributes
    ----------
    inertia : Â = ŵ⁻¹, (nd, nd) over the velocities of all bodies that move [kg]
    lift, across : H, (nd, d nc), local impulses → generalized impulses, and Hᵀ
    """

    matrix: "csc_array[np.float64] | None" = None

    def __init__(self, inertia: "csc_array[np.float64]", lift: "csc_array[np.float64]") -> None:
        self.inertia, self.lift, self.across = inertia, lift, lift.T.tocsr()

    def shifted(self, theta: Array, exact: bool = True) -> Callable[[Array], Array]:
        """Return (W + Θ)⁻¹ as a function of b (d nc,).

        The velocities y = Â⁻¹ H r of the bodies are unknowns beside r, so that nothing dense is made however many
        contacts a body has:

            [ Â   -H ] [ y ]   [ 0 ]
            [ Hᵀ   Θ ] [ r ] = [ b ]

        Raises
        ------
        SolverError : if W + Θ is singular
        """
        count = self.inertia.shape[0]
        matrix = block_array([[self.inertia, -self.lift], [self.across, block_diagonal(theta)]])
        try:
            factor = splu(csc_array(matrix))
        except RuntimeError as error:
            raise SolverError("W + Θ is singular", where="solver", remedy="use another method") from error
        zero = np.zeros(count)
        return lambda b: factor.solve(np.concatenate([zero, b]))[count:]


class ScaledForm:
    """D W D of any form, with the units (nc,) of the contacts on the diagonal of D.

    (D W D + Θ̂)⁻¹ = D⁻¹ (W + D⁻¹ Θ̂ D⁻¹)⁻¹ D⁻¹.
    """

    def __init__(self, inner: Form, unit: Array, axes: int) -> None:
        self._inner, self._unit, self._axes = inner, unit, axes

    @property
    def matrix(self) -> "csc_array[np.float64] | None":
        """D W D where W is assembled."""
        unit = diags_array(np.repeat(self._unit, self._axes))
        return None if self._inner.matrix is None else csc_array(unit @ self._inner.matrix @ unit)

    def shifted(self, theta: Array, exact: bool = True) -> Callable[[Array], Array]:
        """Return (D W D + Θ̂)⁻¹ as a function of b (d nc,)."""
        solve = self._inner.shifted(theta / (self._unit**2)[:, None, None], exact)
        unit = np.repeat(self._unit, self._axes)
        return lambda b: solve(b / unit) / unit


def block_diagonal(blocks: Array) -> "bsr_array[np.float64]":
    """Return the sparse matrix (d nc, d nc) of blocks (nc, d, d)."""
    nc, d = blocks.shape[:2]
    return bsr_array((blocks, np.arange(nc), np.arange(nc + 1)), shape=(d * nc, d * nc))
