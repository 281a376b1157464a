"""W stored in blocks, for contact problems that come from elsewhere."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import bsr_array, csr_array, eye_array
from scipy.sparse.linalg import SuperLU, splu

from mechanics.arrays import Array
from mechanics.delassus._kernels.stored import apply, sweep
from mechanics.problem._kernels import local_factors
from mechanics.problem.problem import GaussSeidel, SparseForm
from moma.errors import SolverError

__all__ = ["StoredDelassus", "StoredForm"]


@dataclass(frozen=True)
class StoredDelassus:
    """W in block-sparse rows (BSR) of 3 × 3 blocks, local axes (n, t1, t2) at each contact.

    W is taken as it is given. Some that other programs have written are slightly asymmetric; then `apply` uses every
    entry, and so do the sweeps: each contact is solved exactly with the symmetric part of its own block, the rest of
    its row is frozen, and where the sweeps come to rest the laws hold for W itself.

    Attributes
    ----------
    block : (nnz, 3, 3) non-zero blocks, row by row [1/kg]
    indices : (nnz,) the column of each, in contacts; none twice in a row
    indptr : (nc+1,) where each row begins

    Raises
    ------
    SolverError : if the rows do not fit together, or a contact's own block is not positive definite
    """

    block: Array
    indices: NDArray[np.integer]
    indptr: NDArray[np.integer]

    def __post_init__(self) -> None:
        nc, entries = len(self.indptr) - 1, len(self.indices)
        if self.block.shape != (entries, 3, 3) or self.indptr[-1] != entries:
            raise SolverError(
                f"{self.block.shape} blocks for {entries} indices in rows that end at {self.indptr[-1]}",
                where="stored W",
                remedy="give one 3 × 3 block for each index",
            )
        if entries and not (self.indices.min() >= 0 and self.indices.max() < nc):
            raise SolverError(
                f"columns {self.indices.min()} to {self.indices.max()} for {nc} contacts", where="stored W"
            )
        finite = np.isfinite(self.block).all(axis=(1, 2))
        if not finite.all():
            entry = int(np.argmin(finite))
            raise SolverError(
                f"block {entry}, in the column of contact {self.indices[entry]}, is not finite",
                where="stored W",
                remedy="correct what it was made from",
            )
        lowest = np.linalg.eigvalsh(self._local())[:, 0]
        if (lowest <= 0).any():
            bad = int(np.argmin(lowest))
            raise SolverError(
                f"the block of contact {bad} is not positive definite (lowest eigenvalue {lowest[bad]:.3g})",
                where="stored W",
                remedy="a contact needs a body that gives way in every direction",
            )

    @cached_property
    def diagonal(self) -> Array:
        """W_αα (nc, 3, 3) [1/kg]; zero where it is not stored."""
        nc = len(self.indptr) - 1
        row = np.repeat(np.arange(nc), np.diff(self.indptr))
        own = row == self.indices
        diagonal = np.zeros((nc, 3, 3))
        diagonal[row[own]] = self.block[own]
        return diagonal

    def apply(self, impulse: Array) -> Array:
        """W r (nc, 3) [m/s]."""
        velocity: Array = apply(impulse, self.block, self.indices, self.indptr)
        return velocity

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Sweeps in the order of the contacts: on most problems forth and back takes twice as many."""
        local = self._local()
        factors = local_factors(local)

        def sweeps(impulse: Array, count: int, /) -> None:
            sweep(
                count,
                impulse,
                shift,
                friction,
                cohesion,
                factors,
                local,
                self.block,
                self.indices,
                self.indptr,
            )

        return sweeps

    def sparse(self) -> "StoredForm":
        """W for methods that factorise; its factors are kept as long as this operator is."""
        return self._form

    @cached_property
    def _form(self) -> "StoredForm":
        size = 3 * (len(self.indptr) - 1)
        return StoredForm(bsr_array((self.block, self.indices, self.indptr), shape=(size, size)).tocsr())

    def _local(self) -> Array:
        own = self.diagonal
        symmetric: Array = 0.5 * (own + own.transpose(0, 2, 1))
        return symmetric


class StoredForm(SparseForm):
    """A stored W in the place of Hᵀ Â⁻¹ H.

    Solvers find (W + σ)⁻¹ b as (b - Hᵀ (Â + H Hᵀ/σ)⁻¹ H b/σ) / σ. That is right as well with `lift` 1, `across` W, and
    W/σ + 1 for what is factorised, since (W + σ)⁻¹ = (1 - W (W + σ)⁻¹) / σ. W need not be symmetric.
    """

    def __init__(self, matrix: "csr_array[np.float64]") -> None:
        identity = eye_array(matrix.shape[0], format="csc")
        super().__init__(identity, identity)
        self.across = matrix
        self._lu: dict[float, SuperLU] = {}

    def factor(self, sigma: float) -> SuperLU:
        """Sparse factors of W/σ + 1, kept for the next call."""
        if sigma not in self._lu:
            self._lu[sigma] = splu((self.across / sigma + self.lift).tocsc())
        return self._lu[sigma]
