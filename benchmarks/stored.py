"""Contact problems with a stored W, as other programs write them."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import bsr_array, csc_array, csr_array
from scipy.sparse.linalg import splu

from ground.errors import SolverError, UsageError
from mechanics.arrays import Array
from mechanics.problem._kernels import Laws, local_factors, solve_contact
from mechanics.problem.forms import block_diagonal
from mechanics.problem.problem import ContactProblem, GaussSeidel, ScaledDelassus, mean_diagonal


def read_problem(path: Path) -> ContactProblem:
    """Read `data` (nnz, 3, 3), `indices`, `indptr`, `q` (3 nc), `mu` (nc).

    Raises
    ------
    UsageError : if one of them is missing
    """
    with np.load(path) as data:
        try:
            operator = StoredDelassus(
                np.ascontiguousarray(data["data"], dtype=float),
                data["indices"].astype(np.int64),
                data["indptr"].astype(np.int64),
            )
            q, mu = data["q"].astype(float).reshape(-1, 3), data["mu"].astype(float)
        except KeyError as missing:
            remedy = "see benchmarks/README.md for what a problem holds"
            raise UsageError(str(missing.args[0]), where=str(path), remedy=remedy) from None
    none = np.zeros(len(mu))
    return ContactProblem(operator, q, none, mu, none)


@dataclass(frozen=True)
class StoredDelassus:
    """W in block-sparse rows (BSR) of 3 × 3 blocks, local axes (n, t1, t2) at each contact.

    W is taken as it is given. Matrices written by other programs may be slightly asymmetric; then `apply` uses every
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
    indices: NDArray[np.int64]
    indptr: NDArray[np.int64]
    rigid = None
    plane = None
    joint_compliance = None
    mostly_rigid = False
    as_rigid = None

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
        lowest = np.linalg.eigvalsh(self._local)[:, 0]
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

    @cached_property
    def _local(self) -> Array:
        """Symmetric parts of W_αα (nc, 3, 3) [1/kg]."""
        symmetric: Array = 0.5 * (self.diagonal + self.diagonal.transpose(0, 2, 1))
        return symmetric

    @cached_property
    def _matrix(self) -> "csr_array[np.float64]":
        size = 3 * (len(self.indptr) - 1)
        return bsr_array((self.block, self.indices, self.indptr), shape=(size, size)).tocsr()

    @cached_property
    def scale(self) -> float:
        """Mean diagonal of W [1/kg]."""
        return mean_diagonal(self.diagonal)

    def apply(self, impulse: Array) -> Array:
        """Return W r (nc, 3) [m/s]."""
        velocity: Array = (self._matrix @ impulse.ravel()).reshape(impulse.shape)
        return velocity

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Return sweeps in the order of the contacts: on most problems forth and back takes twice as many."""
        local = self._local
        laws = Laws(shift, friction, cohesion, local_factors(local))
        return lambda impulse, count, /: _sweep(
            count, impulse, laws, local, self.block, self.indices, self.indptr
        )

    def scaled(self, unit: Array) -> ScaledDelassus:
        """Return D W D with the units (nc,) of the contacts on the diagonal of D."""
        return ScaledDelassus(self, unit)

    @cached_property
    def form(self) -> "StoredForm":
        """W for methods that factorise; its factors are kept as long as this operator is."""
        return StoredForm(self._matrix)


class StoredForm:
    """Assembled W, which need not be symmetric."""

    def __init__(self, matrix: "csr_array[np.float64]") -> None:
        self._matrix = matrix

    @property
    def matrix(self) -> "csc_array[np.float64]":
        """Symmetric part of W (3 nc, 3 nc) [1/kg]."""
        return csc_array(0.5 * (self._matrix + self._matrix.T))

    def shifted(self, theta: Array, exact: bool = True) -> Callable[[Array], Array]:
        """Return (W + Θ)⁻¹ as a function of b (3 nc,).

        Raises
        ------
        SolverError : if W + Θ is singular
        """
        try:
            factor = splu(csc_array(self._matrix + block_diagonal(theta)))
        except RuntimeError as error:
            raise SolverError("W + Θ is singular", where="solver", remedy="use another method") from error
        solve: Callable[[Array], Array] = factor.solve
        return solve


@njit(cache=True)  # type: ignore[untyped-decorator]
def _sweep(
    count: int, r: Array, laws: Laws, local: Array, block: Array, indices: Any, indptr: Any
) -> None:  # pragma: no cover - compiled
    """Make `count` passes of non-smooth Gauss–Seidel over impulses r (nc, 3), which are written [N s]."""
    b, new = np.empty(3), np.empty(3)
    for _ in range(count):
        for c in range(len(r)):
            for k in range(3):
                b[k] = laws.shift[c, k]
                for i in range(3):
                    b[k] -= local[c, k, i] * r[c, i]
            for p in range(indptr[c], indptr[c + 1]):
                other = r[indices[p]]
                for k in range(3):
                    b[k] += block[p, k, 0] * other[0] + block[p, k, 1] * other[1] + block[p, k, 2] * other[2]
            solve_contact(laws.factors[c], b, laws.friction[c], laws.cohesion[c], new)
            r[c, 0], r[c, 1], r[c, 2] = new[0], new[1], new[2]
