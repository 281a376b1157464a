"""Elimination order of the bodies of a scene: least degree, or geometric nested dissection (George 1973)."""

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from mechanics.arrays import Array, Ints
from mechanics.delassus._kernels.dissection import dissect

# number of bodies from which dissection fills in less than least degree
_MANY = 1000
# size of a part that is not divided further
_LEAF = 8
# distance along an axis below which bodies lie in one course [m]
_COURSE_HEIGHT = 1e-6


def elimination(pairs: Ints, moving: Ints, centre: Array) -> Ints:
    """Return the rank (nm,) of each body that moves.

    Parameters
    ----------
    pairs : (m, 2) of those that touch, by their places in `moving`
    moving : (nm,) bodies
    centre : (nb, 3) of all bodies, (nb, 2) in the plane [m]; without rows where they are not known
    """
    if len(centre) == 0 or len(moving) < _MANY:
        return least_degree(pairs, len(moving))
    return dissection(pairs, centre[moving])


def dissection(pairs: Ints, place: Array) -> Ints:
    """Return the rank (n,) of each body: one side of a cut, the other, then the separator; recursively in each side.

    Bodies of one side do not touch those of the other, so factors fill in less than by least degree. Cuts are planes
    across any axis, placed where the separator is smallest. docs/design/solvers.md has numbers.

    Parameters
    ----------
    pairs : (m, 2) bodies that touch
    place : (n, 3) of the bodies, (n, 2) in the plane [m]
    """
    count = len(place)
    body, neighbour = np.concatenate([pairs, pairs[:, ::-1]]).T
    start = np.searchsorted(np.sort(body), np.arange(count + 1))
    neighbours = neighbour[np.argsort(body, kind="stable")]
    # within a course, sort along the other axes
    axes = np.round(place.T / _COURSE_HEIGHT)
    along = np.array([np.lexsort((*np.delete(axes, k, axis=0), axes[k])) for k in range(len(axes))])
    rank: Ints = dissect(start, neighbours, along, _LEAF)
    return rank


def least_degree(pairs: Ints, count: int) -> Ints:
    """Return the rank (count,) of each body in SuperLU's order of least degree: fewest remaining neighbours first."""
    ones, each = np.ones(len(pairs)), np.arange(count)
    row, column = np.concatenate([pairs[:, 0], each]), np.concatenate([pairs[:, 1], each])
    graph = coo_array((np.concatenate([ones, np.zeros(count)]), (row, column)), shape=(count, count)).tocsc()
    graph = graph + graph.T
    # diagonally dominant, so that no rows are exchanged
    graph.setdiag(graph.sum(axis=0) + 1.0)
    lu = splu(
        csc_array(graph), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    rank: Ints = lu.perm_c.astype(np.int64)
    return rank
