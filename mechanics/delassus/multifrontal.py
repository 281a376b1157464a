"""Factors of W + Θ, front by front (Duff & Reid 1983; Liu 1992).

W is a sum of dense blocks, one for each stone that moves, between the contacts of that stone. All contacts of the same
two stones are eliminated together, in the order of least degree, and so are fronts with the same unknowns (supernodes;
Ashcraft & Grimes 1989): fronts are dense matrices of a size that suits BLAS, and little data passes between them. Θ has
a block for each contact and need not be symmetric; rows are exchanged within a front (docs/design/solvers.md).
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dgetrf, dgetrs

from ground.errors import SolverError
from mechanics.arrays import Array, Ints
from mechanics.delassus._kernels.fronts import Layout, add_into, solve
from mechanics.delassus.elimination import elimination
from mechanics.scene.threads import at_once

# columns of a front that one thread takes at a time
_PANEL = 192
# pivots of a front, in contacts, beyond which no more are merged: a wider one is eliminated by a single thread
_WIDEST = 96
# largest share of the work in a subtree that one thread eliminates alone [-]
_SUBTREE = 0.1


@dataclass(frozen=True)
class Cliques:
    """W as a sum of dense blocks, each between some contacts.

    Attributes
    ----------
    contacts : of each clique, (m,)
    blocks : of each clique, (3m, 3m), transposed where it is not symmetric [1/kg]
    """

    contacts: Sequence[Ints]
    blocks: Sequence[Array]


@dataclass(frozen=True)
class Fronts:
    """Order of elimination and contents of each front; the same for all matrices of one pattern.

    Attributes
    ----------
    layout : order, unknowns of each front, and places of its factors
    cliques : of each front, the cliques that are assembled there, and the runs of their unknowns (`add_into`)
    children : of each front, the fronts whose updates it assembles, and the runs of their unknowns
    """

    layout: Layout
    cliques: tuple[tuple[tuple[int, Ints], ...], ...]
    children: tuple[tuple[tuple[int, Ints], ...], ...]

    @property
    def size(self) -> int:
        """Number of entries of the factors."""
        return int(self.layout.fptr[-1])

    def factorise(self, cliques: Cliques, theta: Array, threads: int = 1) -> "Factors":
        """Factorise W + Θ; `theta` (nc, 3, 3) blocks on its diagonal. The result does not depend on the threads.

        Raises
        ------
        SolverError : if W + Θ is singular
        """
        run = _Elimination(self, cliques, theta)
        if threads == 1:
            for f in self.layout.order.tolist():
                run.eliminate(f, map)
        else:
            trees, top = self._split
            each = at_once(threads)
            each(run.eliminate_all, trees)
            for f in top:
                run.eliminate(f, each)
        return Factors(self, run.factor, run.pivots)

    @cached_property
    def _split(self) -> tuple[list[list[int]], list[int]]:
        """Fronts of small independent subtrees, largest first, and the fronts above them."""
        width, whole = self.layout.width.astype(float), np.diff(self.layout.dptr).astype(float)
        front_work = width**3 / 1.5 + 2.0 * width * (whole - width) * whole
        work, above = front_work.copy(), np.full(len(front_work), -1)
        for f in self.layout.order:
            for child, _ in self.children[f]:
                work[f] += work[child]
                above[child] = f
        small = work <= _SUBTREE * front_work.sum()
        root = np.arange(len(front_work))
        for f in self.layout.order[::-1]:
            if small[f] and above[f] >= 0 and small[above[f]]:
                root[f] = root[above[f]]
        trees: dict[int, list[int]] = {}
        for f in self.layout.order[small[self.layout.order]].tolist():
            trees.setdefault(int(root[f]), []).append(f)
        largest = sorted(trees, key=lambda f: -work[f])
        return [trees[f] for f in largest], self.layout.order[~small[self.layout.order]].tolist()


class _Elimination:
    """One factorisation under way."""

    def __init__(self, fronts: Fronts, cliques: Cliques, theta: Array) -> None:
        self._fronts, self._theta = fronts, theta
        # by columns, as they are transposed
        self._blocks = [np.asfortranarray(block.T) for block in cliques.blocks]
        self._updates: dict[int, Array] = {}
        self.factor = np.zeros(fronts.size)
        self.pivots = np.empty(int(fronts.layout.pptr[-1]), dtype=np.int32)

    def eliminate_all(self, chosen: list[int]) -> None:
        """Eliminate fronts one after the other."""
        for f in chosen:
            self.eliminate(f, map)

    def eliminate(self, f: int, each: Callable[..., Iterable[None]]) -> None:
        """Eliminate the pivots of a front, with `each` applied to fixed parts of its columns."""
        layout = self._fronts.layout
        k, at = int(layout.width[f]), int(layout.fptr[f])
        m = int(layout.dptr[f + 1] - layout.dptr[f]) - k
        # views of the factors, by columns
        pivot = self.factor[at : at + k * (k + m)].reshape(k + m, k).T
        below = self.factor[at + k * (k + m) : at + k * (k + 2 * m)].reshape(k, m).T
        update = np.zeros((m, m)).T
        for clique, runs in self._fronts.cliques[f]:
            add_into(pivot, below, update, runs, runs, self._blocks[clique])
        for child, runs in self._fronts.children[f]:
            add = partial(add_into, pivot, below, update, runs, block=self._updates.pop(child))
            list(each(add, _parts(runs)))
        _add_diagonal(pivot, self._theta[layout.dof[layout.dptr[f] : layout.dptr[f] + k : 3] // 3])
        lu, exchanged, failed = dgetrf(pivot[:, :k], overwrite_a=True)
        if failed:
            raise SolverError("W + Θ is singular", where="solver", remedy="use another method")
        self.pivots[layout.pptr[f] : layout.pptr[f + 1]] = exchanged

        def reduce(first: int) -> None:
            """Eliminate the pivots from a panel of columns."""
            last = min(first + _PANEL, m)
            # SciPy's wrapper makes the pivots 1-based in the array itself while LAPACK runs: one copy for each thread
            across, _ = dgetrs(lu, exchanged.copy(), pivot[:, k + first : k + last], overwrite_b=True)
            # transposed, as the product is made by rows
            update[:, first:last] -= (across.T @ below.T).T

        list(each(reduce, range(0, m, _PANEL)))
        if m:
            self._updates[f] = update


def _parts(runs: Ints) -> list[Ints]:
    """Return the runs in parts of some columns each."""
    return np.split(runs, np.flatnonzero(np.diff(runs[:, 2].cumsum() // _PANEL)) + 1)


def _add_diagonal(pivot: Array, theta: Array) -> None:
    first = 3 * np.arange(len(theta))
    for i in range(3):
        for j in range(3):
            pivot[first + i, first + j] += theta[:, i, j]


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
    size = np.bincount(group)
    around = [np.unique(group[contacts]) for contacts in cliques]
    return _fronts_in_order(group, cliques, around, *_least_degree(len(size), size, around))


def fronts_of_graph(group: Ints, cliques: Sequence[Ints], place: Array) -> Fronts:
    """Analyse the pattern of many groups (n,) of unknowns, three each, by their graph and their `place` (ng, 3) [m]."""
    edges = [np.zeros(0, dtype=np.int64)]
    around = [np.unique(group[clique]) for clique in cliques]
    for groups in around:
        first, second = np.triu_indices(len(groups), 1)
        edges.append(groups[first] * len(place) + groups[second])
    key = np.unique(np.concatenate(edges))
    pairs = np.column_stack([key // len(place), key % len(place)])
    rank = elimination(pairs, np.arange(len(place)), place)
    return _fronts_in_order(group, cliques, around, np.argsort(rank), _left_in_fronts(pairs, rank))


def _fronts_in_order(
    group: Ints, cliques: Sequence[Ints], around: Sequence[Ints], order: Ints, later: list[list[int]]
) -> Fronts:
    """Lay out the fronts of groups (n,) of unknowns, three each, in an order.

    `around` has the groups of each clique; `later` as of `_least_degree`.
    """
    size = np.bincount(group)
    count = len(size)
    members = np.split(np.argsort(group, kind="stable"), np.cumsum(size)[:-1])
    order, pivots, later = _merged(order, later, size)
    rank = np.empty(count, dtype=np.int64)
    for f in order:
        rank[pivots[f]] = f
    width = np.array([3 * size[groups].sum() for groups in pivots], dtype=np.int64)
    unknowns = [_unknowns([members[g] for g in (*pivots[f], *later[f])]) for f in range(len(pivots))]
    entries: list[list[tuple[int, Ints]]] = [[] for _ in pivots]
    for clique, groups in enumerate(around):
        if len(groups):
            f = int(rank[groups].min())
            entries[f].append((clique, _runs(_places(unknowns[f], _unknowns([cliques[clique]])), width[f])))
    children: list[list[tuple[int, Ints]]] = [[] for _ in pivots]
    for f in order:
        if later[f]:
            parent = int(rank[later[f]].min())
            place = _places(unknowns[parent], unknowns[f][width[f] :])
            children[parent].append((int(f), _runs(place, width[parent])))
    lengths = np.array([len(u) for u in unknowns], dtype=np.int64)
    layout = Layout(
        order=order,
        width=width,
        dptr=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        dof=np.concatenate([np.zeros(0, dtype=np.int64), *unknowns]),
        fptr=np.concatenate([[0], np.cumsum(width * (2 * lengths - width))]).astype(np.int64),
        pptr=np.concatenate([[0], np.cumsum(width)]).astype(np.int64),
    )
    return Fronts(layout, tuple(map(tuple, entries)), tuple(map(tuple, children)))


def _runs(place: Ints, width: int) -> Ints:
    """Return runs of consecutive unknowns (nr, 3): offset in the front, offset in the block, and length.

    `place` are the positions of the block's unknowns in a front of `width` pivots; no run crosses the last pivot.
    """
    order = np.argsort(place)
    there = place[order]
    begins = (np.diff(order, prepend=-2) != 1) | (np.diff(there, prepend=-2) != 1) | (there == width)
    start = np.flatnonzero(begins)
    return np.column_stack([there[start], order[start], np.diff(start, append=len(order))])


def _merged(order: Ints, later: list[list[int]], size: Ints) -> tuple[Ints, list[list[int]], list[list[int]]]:
    """Merge fronts with parents that hold just their update; factors do not grow.

    Return the order of the merged fronts, and of each its groups and the later groups of its front, in elimination
    order.
    """
    pivots: dict[int, list[int]] = {}
    rest = {int(f): int(size[later[f]].sum()) for f in order}
    wide = {int(f): int(size[f]) for f in order}
    children: dict[int, list[int]] = {int(f): [] for f in order}
    for f in order.tolist():
        pivots[f] = [f]
        # as long as nothing else has been merged into it, wide ones first
        for child in sorted(children[f], key=wide.__getitem__, reverse=True):
            if rest[child] != wide[f] + rest[f] or wide[child] + wide[f] > _WIDEST:
                continue
            pivots[f] = pivots.pop(child) + pivots[f]
            wide[f] += wide.pop(child)
            children[f] += children.pop(child)
            children[f].remove(child)
        if later[f]:
            children[later[f][0]].append(f)
    roots = list(pivots)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    groups = [sorted(pivots[f], key=rank.__getitem__) for f in roots]
    return np.arange(len(roots)), groups, [later[f] for f in roots]


def _unknowns(members: Sequence[Ints]) -> Ints:
    contacts = np.concatenate(members)
    unknowns: Ints = (3 * contacts[:, None] + np.arange(3)).ravel()
    return unknowns


def _places(front: Ints, unknowns: Ints) -> Ints:
    """Return the position of each of the unknowns in a front."""
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
    # Python's numbers add up faster than numpy's, one by one
    contacts = size.tolist()
    degree = np.array([sum(map(contacts.__getitem__, adjacent[g])) for g in range(count)], dtype=float)
    order = np.empty(count, dtype=np.int64)
    for k in range(count):
        g = int(degree.argmin())
        order[k], degree[g] = g, np.inf
        for h in adjacent[g]:
            adjacent[h] |= adjacent[g]
            adjacent[h] -= {g, h}
            degree[h] = sum(map(contacts.__getitem__, adjacent[h]))
    rank = np.empty(count, dtype=np.int64)
    rank[order] = np.arange(count)
    return order, [sorted(adjacent[g], key=rank.__getitem__) for g in range(count)]


def _left_in_fronts(pairs: Ints, rank: Ints) -> list[list[int]]:
    """Return the groups left in each front, in order; `pairs` (m, 2) are coupled groups, `rank` (n,) orders them."""
    order = np.argsort(rank)
    first = np.where(rank[pairs[:, 0]] < rank[pairs[:, 1]], 0, 1)
    remaining: list[set[int]] = [set() for _ in rank]
    each = np.arange(len(pairs))
    for g, h in zip(pairs[each, first].tolist(), rank[pairs[each, 1 - first]].tolist(), strict=True):
        remaining[g].add(h)
    for g in order.tolist():
        if remaining[g]:
            least = min(remaining[g])
            remaining[int(order[least])] |= remaining[g] - {least}
    return [order[sorted(ranks)].tolist() if ranks else [] for ranks in remaining]
