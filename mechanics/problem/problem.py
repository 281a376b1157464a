"""One step's frictional contact problem: pure algebra between physics and algorithm.

    find (u, r):  u = W r + u_free,   0 ≤ u_N + bias ⊥ r_N ≥ 0,   ‖r_T‖ ≤ μ r_N + k,  r_T opposes u_T at the limit

W = Hᵀ ŵ H is behind the protocol `Delassus`; mechanics/operators holds its forms. Laws with adhesion state r shifted
by the largest tension, so that r_N ≥ 0 (mechanics/scene/laws/law.py).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from mechanics.arrays import Array
from mechanics.problem.validation import check_problem

__all__ = [
    "ContactProblem",
    "ContactSolution",
    "ContactStart",
    "Delassus",
    "Form",
    "GaussSeidel",
    "ShiftedForm",
    "SparseForm",
    "scale_of",
]


class GaussSeidel(Protocol):
    """Passes of non-smooth Gauss–Seidel on one problem."""

    def __call__(self, impulse: Array, count: int, /) -> None:
        """Sweep `impulse` (nc, d) in place, `count` times."""


class Delassus(Protocol):
    """W = Hᵀ ŵ H, the relative velocities that impulses cause; d is 3, or 2 in the plane.

    Attributes
    ----------
    diagonal : (nc, d, d) W_αα [1/kg]
    """

    @property
    def diagonal(self) -> Array:
        """W_αα (nc, d, d) [1/kg]."""

    def apply(self, impulse: Array) -> Array:
        """W r (nc, d) [m/s]."""

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Sweeps that solve each contact exactly with its neighbours frozen.

        Parameters
        ----------
        shift : (nc, d) u_free, with the bias added to its normal part [m/s]
        friction, cohesion : (nc,) μ [-] and k [N s]
        """


def scale_of(delassus: Delassus) -> float:
    """What u over r is measured against [1/kg]: the mean diagonal of W, if the operator does not say otherwise.

    1 without contacts.
    """
    given = getattr(delassus, "scale", None)
    if given is not None:
        return float(given)
    diagonal = delassus.diagonal
    if len(diagonal) == 0:
        return 1.0
    return float(np.einsum("cii->", diagonal) / (len(diagonal) * diagonal.shape[1]))


class _Factor(Protocol):
    def solve(self, rhs: Array) -> Array:
        """Solve for one right-hand side."""


class Form(Protocol):
    """W in a form that can be factorised."""

    def relaxed(self, sigma: float) -> Callable[[Array], Array]:
        """(W/σ + 1)⁻¹ as a function of b (d nc,); its factors are kept for the next call."""


class ShiftedForm(Form, Protocol):
    """W in a form to which a block can be added for each contact."""

    def shifted(self, theta: Array) -> Callable[[Array], Array]:
        """(W + Θ)⁻¹ as a function of b (3 nc,); `theta` (nc, 3, 3), not always symmetric [1/kg]."""


class SparseForm:
    """W as Hᵀ Â⁻¹ H with sparse matrices, for methods that factorise.

    Attributes
    ----------
    inertia : Â = ŵ⁻¹, (nd, nd) over the velocities of all bodies that move [kg]
    lift, across : H, (nd, 3 nc), local impulses → generalized impulses, and Hᵀ
    """

    def __init__(self, inertia: "csc_array[np.float64]", lift: "csc_array[np.float64]") -> None:
        self.inertia, self.lift, self.across = inertia, lift, lift.T.tocsr()
        self._factors: dict[float, _Factor] = {}

    def factor(self, sigma: float) -> _Factor:
        """Sparse factors of Â + H Hᵀ/σ, kept for the next call."""
        if sigma not in self._factors:
            matrix = (self.inertia + self.lift @ self.across / sigma).tocsc()
            # symmetric positive definite: order A + Aᵀ and do not pivot
            self._factors[sigma] = splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        return self._factors[sigma]

    def relaxed(self, sigma: float) -> Callable[[Array], Array]:
        """(W/σ + 1)⁻¹ as a function of b (d nc,), by the Woodbury identity."""
        factor = self.factor(sigma)
        return lambda b: b - (self.across @ factor.solve(self.lift @ b)) / sigma


@dataclass(frozen=True)
class ContactProblem:
    """What a solver sees.

    Attributes
    ----------
    delassus : W
    u_free : (nc, d) relative velocity without contact impulses, local frame (n, t1, t2), or (n, t) [m/s]
    bias : (nc,) shift of u_N in Signorini's condition [m/s]
    friction : (nc,) Coulomb's μ [-]
    cohesion : (nc,) k, the tangential impulse carried at r_N = 0 [N s]
    sparse : gives W once more, for methods that factorise; None where it has no such form
    adhesion : (nc,) by which r_N is shifted, r̃ = r + s n; None where nothing is [N s]

    Raises
    ------
    SolverError : if it cannot be solved: shapes that do not fit, NaN, contacts that do not give way, negative friction
    """

    delassus: Delassus
    u_free: Array
    bias: Array
    friction: Array
    cohesion: Array
    sparse: Callable[[], Form] | None = None
    adhesion: Array | None = None

    def __post_init__(self) -> None:
        check_problem(
            self.delassus.diagonal,
            self.u_free,
            bias=self.bias,
            friction=self.friction,
            cohesion=self.cohesion,
            adhesion=self.adhesion,
        )

    @property
    def biased(self) -> Array:
        """u_free with the bias in its normal part (nc, d), not to be written [m/s]."""
        if not self.bias.any():
            return self.u_free
        velocity = self.u_free.copy()
        velocity[:, 0] += self.bias
        return velocity


@dataclass(frozen=True)
class ContactStart:
    """Where a solver begins: what is remembered of the same contacts, zero for new ones.

    Attributes
    ----------
    impulse : (nc, d) r [N s]
    velocity : (nc, d) û = u + (bias + μ‖u_T‖) n, the velocity that is dual to r [m/s]
    """

    impulse: Array
    velocity: Array


@dataclass(frozen=True)
class ContactSolution:
    """What a solver gives back.

    Attributes
    ----------
    impulse : (nc, d) r, on the candidate, local frame [N s]
    velocity : (nc, d) û, dual to r, as the solver knows it [m/s]
    iterations : Gauss–Seidel sweeps, or the iterations of another method
    natural_map : η of `impulse`, as mechanics.residual computes it
    converged : η, and the error of the velocities where a solver looks at it, are within their tolerances
    why : which method found it, and why that one was chosen; empty where there was no choice
    """

    impulse: Array
    velocity: Array
    iterations: int
    natural_map: float
    converged: bool
    why: str = ""
