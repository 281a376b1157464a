"""Sparse factors of matrices of 3 × 3 blocks between rigid bodies, in an order that is given."""

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import SuperLU, splu

from mechanics.arrays import Array, Ints


class SparseBlocks:
    """Pattern of a matrix of 3 × 3 blocks whose structure is symmetric, and its latest factors.

    Parameters
    ----------
    indices : (nnz,) columns of the blocks, row by row
    indptr : (n + 1,) where each row begins
    rank : (n,) place of each row of blocks in the order of elimination
    """

    def __init__(self, indices: Ints, indptr: Ints, rank: Ints) -> None:
        row, column = np.repeat(rank, np.diff(indptr)), rank[indices]
        each = np.arange(3)
        rows = (3 * row[:, None, None] + each[:, None] + 0 * each).ravel()
        columns = (3 * column[:, None, None] + 0 * each[:, None] + each).ravel()
        size = 3 * len(rank)
        numbers = coo_array((np.arange(len(rows), dtype=float), (rows, columns)), shape=(size, size)).tocsc()
        self._source = numbers.data.astype(np.int64)
        self._rows, self._starts, self._size = numbers.indices, numbers.indptr, size
        self._place = np.argsort(rank)
        self._factors: SuperLU | None = None
        self._precision = np.dtype(float)

    def factorise(self, value: Array) -> bool:
        """Factorise the matrix of these blocks (nnz, 3, 3) in their precision; return whether it is regular.

        Factors of single precision take 0.6 of the time, and only lead to a solution.
        """
        # those of the matrix before make room for them
        self._factors = None
        self._precision = value.dtype
        data = value.ravel()[self._source]
        if not np.isfinite(data).all():
            return False
        matrix = csc_array((data, self._rows, self._starts), shape=(self._size, self._size))
        try:
            self._factors = splu(
                matrix,
                permc_spec="NATURAL",
                # the order of elimination stays
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError:
            return False
        return True

    def solve(self, x: Array) -> None:
        """Replace a right side (n, 3) by the solution."""
        assert self._factors is not None
        with np.errstate(over="ignore"):
            right = x[self._place].ravel().astype(self._precision, copy=False)
        x[self._place] = self._factors.solve(right).reshape(-1, 3)
