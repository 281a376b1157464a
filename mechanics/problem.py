"""One step's frictional contact problem: pure algebra between physics and algorithm.

    find (u, r):  u = W r + u_free,   0 ≤ u_N + bias ⊥ r_N ≥ 0,   ‖r_T‖ ≤ μ r_N,  r_T = -μ r_N u_T/‖u_T‖ if u_T ≠ 0

W = Hᵀ ŵ H is never formed. A rigid body answers through its six velocities; a deformable one through the dense
compliance between the contact sides that lie on it.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

__all__ = [
    "ELASTIC",
    "NONE",
    "RIGID",
    "ContactProblem",
    "ContactSolution",
    "ContactStart",
    "Delassus",
    "SparseForm",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

NONE, RIGID, ELASTIC = 0, 1, 2


@dataclass(frozen=True)
class Delassus:
    """W = Hᵀ ŵ H in factored form; side 0 (candidate) counts positive, side 1 (antagonist) negative.

    Attributes
    ----------
    body : (nc, 2) bodies of the two sides
    kind : (nc, 2) NONE (fixed), RIGID or ELASTIC
    jacobian : (nc, 2, 3, 6) local velocity of a rigid side from its body's velocity
    response : (nc, 2, 6, 3) body velocity from the local impulse, ŵ times the transpose of `jacobian`
    slot : (nc, 2) place of an elastic side among those of its body
    yptr : (nb+1,) where each body's elastic velocities begin (three for each side)
    bptr : (nb+1,) where each body's compliance block begins
    block : flat symmetric compliance blocks of the elastic bodies, between their contact sides [1/kg]
    diagonal : (nc, 3, 3) W_αα [1/kg]
    """

    body: Ints
    kind: Ints
    jacobian: Array
    response: Array
    slot: Ints
    yptr: Ints
    bptr: Ints
    block: Array
    diagonal: Array

    @property
    def scale(self) -> float:
        """Mean diagonal of W [1/kg]; what r and u are measured against."""
        return float(np.mean(np.trace(self.diagonal, axis1=1, axis2=2) / 3.0))

    @property
    def arrays(self) -> tuple[NDArray[np.generic], ...]:
        """What the kernels take, in their order."""
        return self.body, self.kind, self.jacobian, self.response, self.slot, self.yptr, self.bptr, self.block


class _Factor(Protocol):
    def solve(self, rhs: Array) -> Array:
        """Solve for one right-hand side."""


class SparseForm:
    """W as Hᵀ Â⁻¹ H with sparse matrices, for methods that factorise.

    Attributes
    ----------
    inertia : Â = ŵ⁻¹, (nd, nd) over the velocities of all bodies that move [kg]
    lift : H, (nd, 3 nc), local impulses → generalized impulses
    """

    def __init__(self, inertia: "csc_array[np.float64]", lift: "csc_array[np.float64]") -> None:
        self.inertia, self.lift = inertia, lift
        self._factors: dict[float, _Factor] = {}

    def factor(self, sigma: float) -> _Factor:
        """Sparse factors of Â + H Hᵀ/σ, kept for the next call."""
        if sigma not in self._factors:
            matrix = (self.inertia + self.lift @ self.lift.T / sigma).tocsc()
            # symmetric positive definite: order A + Aᵀ and do not pivot
            self._factors[sigma] = splu(
                matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        return self._factors[sigma]


@dataclass(frozen=True)
class ContactProblem:
    """What a solver sees.

    Attributes
    ----------
    delassus : W
    u_free : (nc, 3) relative velocity without contact impulses, local frame (n, t1, t2) [m/s]
    bias : (nc,) shift of u_N in Signorini's condition [m/s]
    friction : (nc,) Coulomb's μ [-]
    sparse : W once more, for methods that factorise; None where none was asked for
    """

    delassus: Delassus
    u_free: Array
    bias: Array
    friction: Array
    sparse: SparseForm | None = None


@dataclass(frozen=True)
class ContactStart:
    """Where a solver begins: what is remembered of the same contacts, zero for new ones.

    Attributes
    ----------
    impulse : (nc, 3) r [N s]
    velocity : (nc, 3) û = u + (bias + μ‖u_T‖) n, the velocity that is dual to r [m/s]
    """

    impulse: Array
    velocity: Array


@dataclass(frozen=True)
class ContactSolution:
    """What a solver gives back.

    Attributes
    ----------
    impulse : (nc, 3) r, on the candidate, local frame [N s]
    velocity : (nc, 3) û, dual to r, as the solver knows it [m/s]
    iterations : Gauss–Seidel sweeps, or the iterations of another method
    natural_map : η of `impulse`, as mechanics.residual computes it
    converged : η is within the tolerance
    """

    impulse: Array
    velocity: Array
    iterations: int
    natural_map: float
    converged: bool
