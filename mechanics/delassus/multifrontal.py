"""Factors of W + Θ, front by front (Duff & Reid 1983; Liu 1992).

W is a sum of dense blocks, one for each stone that moves, between the contacts of that stone. All contacts of the same
two stones are eliminated together, in the order of least degree, so the fronts are dense matrices of a size that
suits BLAS, and nothing is sought among single entries. Θ has a block for each contact and need not be symmetric; rows
are exchanged within a front (docs/decisions/009-factors-by-stones.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from mechanics.arrays import Array, Ints
from mechanics.delassus._kernels.fronts import Layout, add_into, solve
from moma.errors import SolverError

__all__ = ["Cliques", "Factors", "Fronts", "fronts"]


@dataclass(frozen=True)
class Cliques:
    """W as a sum of dense blocks, each between some contacts.

    Attributes
    ----------
    contacts : of each clique, (m,)
    blocks : of each clique, symmetric (3m, 3m) [1/kg]
    """

    contacts: Sequence[Ints]
    blocks: Sequence[Array]


@dataclass(frozen=True)
class Fronts:
    """Order of elimination and contents of each front; the same for all matrices of one pattern.

    Attributes
    ----------
    layout : order, unknowns of each front, and places of its factors
    cliques : of each front, the cliques that are assembled there, and where their unknowns lie in the front
    children : of each front, the fronts whose updates it takes in, and where their unknowns lie in it
    """

    layout: Layout
    cliques: tuple[tuple[tuple[int, Ints, Ints], ...], ...]
    children: tuple[tuple[tuple[int, Ints], ...], ...]

    @property
    def size(self) -> int:
        """Number of entries of the factors."""
        return int(self.layout.fptr[-1])

    def factorise(self, cliques: Cliques, theta: Array) -> "Factors":
        """Factorise W + Θ; `theta` (nc, 3, 3) blocks on its diagonal.

        Raises
        ------
        SolverError : if W + Θ is singular
        """
        layout = self.layout
        factor, pivots = np.empty(self.size), np.empty(int(layout.pptr[-1]), dtype=np.int32)
        updates: dict[int, Array] = {}
        for f in layout.order:
            front, k = self._assembled(int(f), cliques, theta, updates), int(layout.width[f])
            m, at = len(front) - k, int(layout.fptr[f])
            lu, exchanged, failed = dgetrf(front[:k, :k])
            if failed:
                raise SolverError("W + Θ is singular", where="solver", remedy="use another method")
            pivots[layout.pptr[f] : layout.pptr[f + 1]] = exchanged
            factor[at : at + k * k] = lu.T.ravel()
            if m:
                across, _ = dgetrs(lu, exchanged, front[:k, k:])
                below = front[k:, :k]
                factor[at + k * k : at + k * (k + m)] = across.T.ravel()
                factor[at + k * (k + m) : at + k * (k + 2 * m)] = below.T.ravel()
                updates[int(f)] = front[k:, k:] - below @ across
        return Factors(self, factor, pivots)

    def _assembled(self, f: int, cliques: Cliques, theta: Array, updates: dict[int, Array]) -> Array:
        layout = self.layout
        unknown = layout.dof[layout.dptr[f] : layout.dptr[f + 1]]
        front = np.zeros((len(unknown), len(unknown)), order="F")
        for clique, own, place in self.cliques[f]:
            add_into(front, place, own, cliques.blocks[clique])
        for child, place in self.children[f]:
            update = updates.pop(child)
            add_into(front, place, np.arange(len(update)), update)
        diagonal = theta[unknown[: layout.width[f] : 3] // 3]
        first = 3 * np.arange(len(diagonal))
        for i in range(3):
            for j in range(3):
                front[first + i, first + j] += diagonal[:, i, j]
        return front


@dataclass(frozen=True)
class Factors:
    """Factors of W + Θ, by fronts, and their row exchanges."""

    fronts: Fronts
    factor: Array
    pivots: NDArray[np.int32]

    def solve(self, b: Array) -> Array:
        """Return (W + Θ)⁻¹ b for one right-hand side (3 nc,)."""
        x = b.copy()
        solve(x, self.fronts.layout, self.pivots, self.factor)
        return x


def fronts(pairs: Ints, cliques: Sequence[Ints]) -> Fronts:
    """Analyse the pattern: `pairs` (nc, 2) bodies of each contact, `cliques` the contacts of each body that moves."""
    _, group = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    group = group.ravel()
    count = int(group.max(initial=-1)) + 1
    size = np.bincount(group, minlength=count)
    members = np.split(np.argsort(group, kind="stable"), np.cumsum(size)[:-1])
    around = [np.unique(group[contacts]) for contacts in cliques]
    order, later = _least_degree(count, size, around)
    rank = np.empty(count, dtype=np.int64)
    rank[order] = np.arange(count)
    unknowns = [_unknowns([members[g] for g in (f, *later[f])]) for f in range(count)]
    first = [int(groups[rank[groups].argmin()]) if len(groups) else -1 for groups in around]
    own: list[list[tuple[int, Ints, Ints]]] = [[] for _ in range(count)]
    for clique, f in enumerate(first):
        if f >= 0:
            place = _places(unknowns[f], _unknowns([cliques[clique]]))
            by_place = np.argsort(place)
            own[f].append((clique, by_place, place[by_place]))
    children: list[list[tuple[int, Ints]]] = [[] for _ in range(count)]
    for f in order:
        if len(later[f]):
            parent = later[f][0]
            children[parent].append((int(f), _places(unknowns[parent], unknowns[f][3 * size[f] :])))
    lengths = np.array([len(u) for u in unknowns], dtype=np.int64)
    layout = Layout(
        order=order,
        width=3 * size,
        dptr=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        dof=np.concatenate([np.zeros(0, dtype=np.int64), *unknowns]),
        fptr=np.concatenate([[0], np.cumsum(3 * size * (2 * lengths - 3 * size))]).astype(np.int64),
        pptr=np.concatenate([[0], np.cumsum(3 * size)]).astype(np.int64),
    )
    return Fronts(layout, tuple(map(tuple, own)), tuple(map(tuple, children)))


def _unknowns(members: Sequence[Ints]) -> Ints:
    contacts = np.concatenate(members)
    unknowns: Ints = (3 * contacts[:, None] + np.arange(3)).ravel()
    return unknowns


def _places(front: Ints, unknowns: Ints) -> Ints:
    """Return the place of each of the unknowns in a front."""
    order = np.argsort(front)
    places: Ints = order[np.searchsorted(front, unknowns, sorter=order)]
    return places


def _least_degree(count: int, size: Ints, around: Sequence[Ints]) -> tuple[Ints, list[list[int]]]:
    """Return the order of least external degree, counted in contacts, and the groups left in each front, in order."""
    adjacent: list[set[int]] = [set() for _ in range(count)]
    for groups in around:
        for g in groups.tolist():
            adjacent[g].update(groups.tolist())
    for g in range(count):
        adjacent[g].discard(g)
    degree = np.array([sum(size[h] for h in adjacent[g]) for g in range(count)], dtype=float)
    order = np.empty(count, dtype=np.int64)
    for k in range(count):
        g = int(degree.argmin())
        order[k], degree[g] = g, np.inf
        for h in adjacent[g]:
            adjacent[h] |= adjacent[g]
            adjacent[h] -= {g, h}
            degree[h] = sum(size[i] for i in adjacent[h])
    rank = np.empty(count, dtype=np.int64)
    rank[order] = np.arange(count)
    return order, [sorted(adjacent[g], key=rank.__getitem__) for g in range(count)]
