"""W + Θ for methods of Newton's kind, from whichever form a problem has; W may be singular where Θ holds it."""

from collections.abc import Callable
from typing import cast

import numpy as np
from scipy.sparse import block_array, bsr_array, csc_array
from scipy.sparse.linalg import splu

from mechanics.arrays import Array
from mechanics.delassus.stored import StoredForm
from mechanics.problem.problem import ContactProblem, Delassus, ShiftedForm, SparseForm
from moma.errors import SolverError

__all__ = ["ShiftedSystem", "shifted_system"]


# of the right side: what a solution may leave of it
_LOST = 1e-9

ShiftedSystem = Callable[[Array], Callable[[Array], Array]]


def shifted_system(problem: ContactProblem, solver: str) -> ShiftedSystem:
    """Θ (nc, d, d) → (W + Θ)⁻¹ as a function of b (d nc,).

    By the form's own `shifted` where it has one; if that loses more than rounding, as elimination on bodies does where
    parts of Θ are next to nothing beside others, by the system below. A stored W is added to Θ as it is. Hᵀ Â⁻¹ H is
    not formed: the velocities y = Â⁻¹ H r of the bodies are unknowns beside r instead,

        [ Â   -H ] [ y ]   [ 0 ]
        [ Hᵀ   Θ ] [ r ] = [ b ]

    so that nothing dense is made however many contacts a body has.

    Raises
    ------
    SolverError : if the problem has no form that can be factorised, in the name of the solver that asks
    """
    form = None if problem.sparse is None else problem.sparse()
    if form is None:
        raise SolverError("the problem has no sparse form", where=solver, remedy='use the method "nsgs"')
    if hasattr(form, "shifted"):
        own = cast(ShiftedForm, form).shifted
        if not isinstance(form, SparseForm) or isinstance(form, StoredForm):
            return own
        return _checked(own, _with_velocities(form), problem.delassus)
    if isinstance(form, StoredForm):
        matrix = form.across
        return lambda theta: _factorised(matrix + _diagonal(theta)).solve
    if isinstance(form, SparseForm):
        return _with_velocities(form)
    raise SolverError(
        "the problem has no form to which blocks can be added", where=solver, remedy='use the method "admm"'
    )


def _checked(first: ShiftedSystem, second: ShiftedSystem, delassus: Delassus) -> ShiftedSystem:
    """The first, and where it leaves too much of the right side, the second."""

    def shifted(theta: Array) -> Callable[[Array], Array]:
        quick = first(theta)

        def solve(b: Array) -> Array:
            x = quick(b)
            r = x.reshape(theta.shape[:2])
            left = b - (delassus.apply(r) + np.einsum("cij,cj->ci", theta, r)).ravel()
            if np.linalg.norm(left) <= _LOST * np.linalg.norm(b):
                return x
            return second(theta)(b)

        return solve

    return shifted


def _with_velocities(form: SparseForm) -> ShiftedSystem:
    count = form.inertia.shape[0]

    def shifted(theta: Array) -> Callable[[Array], Array]:
        matrix = block_array([[form.inertia, -form.lift], [form.across, _diagonal(theta)]])
        factor, none = _factorised(matrix), np.zeros(count)
        return lambda b: factor.solve(np.concatenate([none, b]))[count:]

    return shifted


def _diagonal(theta: Array) -> "bsr_array[np.float64]":
    nc, d = theta.shape[:2]
    return bsr_array((theta, np.arange(nc), np.arange(nc + 1)), shape=(d * nc, d * nc))


class _Factor:
    """Sparse factors that say when they are none."""

    def __init__(self, matrix: "csc_array[np.float64]") -> None:
        try:
            self._lu = splu(matrix)
        except RuntimeError as error:
            raise SolverError("W + Θ is singular", where="solver", remedy="use another method") from error

    def solve(self, right: Array) -> Array:
        """One solution."""
        x: Array = self._lu.solve(right)
        return x


def _factorised(matrix: "bsr_array[np.float64]") -> _Factor:
    return _Factor(csc_array(matrix))
