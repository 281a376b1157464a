"""Numba kernels that factorise matrices of 3 × 3 blocks in block-sparse rows.

Rows with the same columns, as contacts of one pair of bodies have, or translation and rotation of one body, are one
group. Groups are eliminated in the order of least degree; each has a dense front, of its own unknowns and of those
that are still to come and couple with it (the multifrontal method, Duff & Reid 1983). Pivots are sought within a group
alone, which suits matrices that are positive definite except for the derivatives of contact laws.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

__all__ = ["Plan", "analyse", "factorise", "solve"]


class Plan(NamedTuple):
    """Pattern of the factors; groups are numbered in the order of their elimination.

    Attributes
    ----------
    width, whole : (ng,) int64, unknowns of a group, and of its front
    aptr : (ng+1,) int64, where the fronts begin in the factors, which hold them one after the other
    fptr : (ng+1,) int64, where the groups of a front begin in `front`
    front, offset : int64, groups of the fronts, its own first, and where their unknowns begin in it
    place : int64, as `front`: where its groups begin in the parent's front
    parent : (ng,) int64, the front that takes what a front leaves; -1 for a root
    mptr, member : int64, the contacts of each group
    eptr, entry, row, column : int64, blocks of the matrix that a front begins with, and where they go
    work : multiplications of a factorisation
    """

    width: NDArray[np.int64]
    whole: NDArray[np.int64]
    aptr: NDArray[np.int64]
    fptr: NDArray[np.int64]
    front: NDArray[np.int64]
    offset: NDArray[np.int64]
    place: NDArray[np.int64]
    parent: NDArray[np.int64]
    mptr: NDArray[np.int64]
    member: NDArray[np.int64]
    eptr: NDArray[np.int64]
    entry: NDArray[np.int64]
    row: NDArray[np.int64]
    column: NDArray[np.int64]
    work: float


@njit(cache=True)
def _mix(x):
    """Return a number that looks random for each contact: patterns are compared by their sums."""
    z = np.uint64(x) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(0x632BE59BD9B4E019)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@njit(cache=True)
def _groups(indices, indptr):
    """Return the group of each contact, those of one group having the same columns, and the number of groups."""
    nc = len(indptr) - 1
    signature = np.empty(nc, dtype=np.uint64)
    for c in range(nc):
        total = np.uint64(0)
        for p in range(indptr[c], indptr[c + 1]):
            total += _mix(indices[p])
        signature[c] = total
    order = np.argsort(signature, kind="mergesort")
    group, count = np.empty(nc, dtype=np.int64), 0
    mark = np.full(nc, -1, dtype=np.int64)
    first = -1
    for k in range(nc):
        c = order[k]
        same = k > 0 and signature[c] == signature[first]
        if same:
            same = indptr[c + 1] - indptr[c] == indptr[first + 1] - indptr[first]
            for p in range(indptr[c], indptr[c + 1]):
                if mark[indices[p]] != first:
                    same = False
                    break
        if not same:
            first = c
            for p in range(indptr[c], indptr[c + 1]):
                mark[indices[p]] = first
            count += 1
        group[c] = count - 1
    return group, count


@njit(cache=True)
def _neighbours(group, count, indices, indptr):
    """Return bit sets (count, words) of the groups that couple, either way round."""
    words = (count + 63) // 64
    bits = np.zeros((count, words), dtype=np.uint64)
    one = np.uint64(1)
    for c in range(len(indptr) - 1):
        g = group[c]
        for p in range(indptr[c], indptr[c + 1]):
            h = group[indices[p]]
            bits[g, h >> 6] |= one << np.uint64(h & 63)
            bits[h, g >> 6] |= one << np.uint64(g & 63)
    for g in range(count):
        bits[g, g >> 6] &= ~(one << np.uint64(g & 63))
    return bits


@njit(cache=True)
def _members(row, found):
    """Write the set bits of a row into `found`; return their number."""
    number = 0
    one, zero = np.uint64(1), np.uint64(0)
    for w in range(len(row)):
        word = row[w]
        while word != zero:
            low = word & (~word + one)
            # the place of the only bit that is set
            place, rest = 0, low
            for half in (32, 16, 8, 4, 2, 1):
                if rest >> np.uint64(half) != zero:
                    place += half
                    rest >>= np.uint64(half)
            found[number] = 64 * w + place
            number += 1
            word ^= low
    return number


@njit(cache=True)
def _eliminate(bits, size):
    """Return the order of least degree; `bits` ends as the groups that are left in the front of each."""
    count, words = bits.shape
    order = np.empty(count, dtype=np.int64)
    done = np.zeros(count, dtype=np.bool_)
    degree = np.zeros(count, dtype=np.int64)
    near, far = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    one = np.uint64(1)
    for g in range(count):
        for k in range(_members(bits[g], near)):
            degree[g] += size[near[k]]
    for step in range(count):
        g, least = -1, np.int64(1) << 60
        for h in range(count):
            if not done[h] and degree[h] < least:
                g, least = h, degree[h]
        order[step] = g
        done[g] = True
        number = _members(bits[g], near)
        for k in range(number):
            h = near[k]
            for w in range(words):
                bits[h, w] |= bits[g, w]
            bits[h, g >> 6] &= ~(one << np.uint64(g & 63))
            bits[h, h >> 6] &= ~(one << np.uint64(h & 63))
            total = 0
            for i in range(_members(bits[h], far)):
                total += size[far[i]]
            degree[h] = total
    return order


@njit(cache=True)
def analyse(indices, indptr):  # pragma: no cover - compiled
    """Analyse the pattern of a matrix of 3 × 3 blocks.

    Inputs
    ------
    indices : (nnz,) int64, columns of the blocks, row by row
    indptr : (nc+1,) int64, where each row begins

    Outputs
    -------
    Plan
    """
    nc = len(indptr) - 1
    group, count = _groups(indices, indptr)
    size = np.zeros(count, dtype=np.int64)
    for c in range(nc):
        size[group[c]] += 1
    bits = _neighbours(group, count, indices, indptr)
    order = _eliminate(bits, size)
    rank = np.empty(count, dtype=np.int64)
    for f in range(count):
        rank[order[f]] = f
    mptr = np.zeros(count + 1, dtype=np.int64)
    for f in range(count):
        mptr[f + 1] = mptr[f] + size[order[f]]
    member, within, fill = np.empty(nc, dtype=np.int64), np.empty(nc, dtype=np.int64), mptr[:-1].copy()
    for c in range(nc):
        f = rank[group[c]]
        member[fill[f]] = c
        within[c] = fill[f] - mptr[f]
        fill[f] += 1
    near = np.empty(count, dtype=np.int64)
    fptr = np.zeros(count + 1, dtype=np.int64)
    for f in range(count):
        fptr[f + 1] = fptr[f] + 1 + _members(bits[order[f]], near)
    front = np.empty(fptr[-1], dtype=np.int64)
    offset = np.empty(fptr[-1], dtype=np.int64)
    width, whole = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    parent = np.full(count, -1, dtype=np.int64)
    work = 0.0
    for f in range(count):
        number = _members(bits[order[f]], near)
        later = np.sort(rank[near[:number]])
        start = fptr[f]
        front[start] = f
        front[start + 1 : start + 1 + number] = later
        at = 0
        for k in range(number + 1):
            offset[start + k] = at
            at += 3 * size[order[front[start + k]]]
        width[f], whole[f] = 3 * size[order[f]], at
        if number:
            parent[f] = later[0]
        w, m = float(width[f]), float(at)
        work += w * w * w / 3.0 + w * (m - w) * (w + m - w)
    place = np.zeros(fptr[-1], dtype=np.int64)
    spot = np.empty(count, dtype=np.int64)
    for f in range(count):
        if parent[f] >= 0:
            for k in range(fptr[parent[f]], fptr[parent[f] + 1]):
                spot[front[k]] = offset[k]
            for k in range(fptr[f] + 1, fptr[f + 1]):
                place[k] = spot[front[k]]
    eptr, entry, row, column = _entries(indices, indptr, group, rank, within, fptr, front, offset)
    aptr = np.zeros(count + 1, dtype=np.int64)
    for f in range(count):
        aptr[f + 1] = aptr[f] + whole[f] * whole[f]
    return Plan(
        width, whole, aptr, fptr, front, offset, place, parent, mptr, member, eptr, entry, row, column, work
    )


@njit(cache=True)
def _entries(indices, indptr, group, rank, within, fptr, front, offset):
    """Assign each block of the matrix to the front of the first of its two groups."""
    count = len(fptr) - 1
    eptr = np.zeros(count + 1, dtype=np.int64)
    nc = len(indptr) - 1
    for c in range(nc):
        for p in range(indptr[c], indptr[c + 1]):
            eptr[min(rank[group[c]], rank[group[indices[p]]]) + 1] += 1
    for f in range(count):
        eptr[f + 1] += eptr[f]
    number = eptr[-1]
    owner, source = np.empty(number, dtype=np.int64), np.empty(number, dtype=np.int64)
    row, column = np.empty(number, dtype=np.int64), np.empty(number, dtype=np.int64)
    fill = eptr[:-1].copy()
    for c in range(nc):
        for p in range(indptr[c], indptr[c + 1]):
            f = min(rank[group[c]], rank[group[indices[p]]])
            owner[fill[f]], source[fill[f]] = c, p
            fill[f] += 1
    spot = np.empty(count, dtype=np.int64)
    for f in range(count):
        for k in range(fptr[f], fptr[f + 1]):
            spot[front[k]] = offset[k]
        for e in range(eptr[f], eptr[f + 1]):
            c, j = owner[e], indices[source[e]]
            row[e] = spot[rank[group[c]]] + 3 * within[c]
            column[e] = spot[rank[group[j]]] + 3 * within[j]
    return eptr, source, row, column


@njit(cache=True, fastmath={"contract"})
def _partial_lu(a, w, pivot, symmetric):
    """Eliminate the first w unknowns of a dense front, in place, with row pivots among them.

    Of a symmetric front, the lower half of what is left is made alone.
    """
    m = a.shape[0]
    for k in range(w):
        best, size = k, abs(a[k, k])
        for i in range(k + 1, w):
            if abs(a[i, k]) > size:
                best, size = i, abs(a[i, k])
        pivot[k] = best
        if best != k:
            for j in range(m):
                a[k, j], a[best, j] = a[best, j], a[k, j]
        if size == 0.0 or not np.isfinite(size):
            return False
        scale = 1.0 / a[k, k]
        for i in range(k + 1, w):
            factor = a[i, k] * scale
            a[i, k] = factor
            if factor != 0.0:
                for j in range(k + 1, m):
                    a[i, j] -= factor * a[k, j]
    whole = w - w % 4
    for i in range(w, m):
        row = a[i]
        for k in range(w):
            total = row[k]
            for n in range(k):
                total -= row[n] * a[n, k]
            row[k] = total / a[k, k]
        last = i + 1 if symmetric else m
        # four pivots at a time: each entry is read and written once for them all
        for k in range(0, whole, 4):
            f0, f1, f2, f3 = row[k], row[k + 1], row[k + 2], row[k + 3]
            if f0 == 0.0 and f1 == 0.0 and f2 == 0.0 and f3 == 0.0:
                continue
            a0, a1, a2, a3 = a[k], a[k + 1], a[k + 2], a[k + 3]
            for j in range(w, last):
                row[j] -= f0 * a0[j] + f1 * a1[j] + f2 * a2[j] + f3 * a3[j]
        for k in range(whole, w):
            f0, a0 = row[k], a[k]
            for j in range(w, last):
                row[j] -= f0 * a0[j]
    return True


@njit(cache=True, fastmath={"contract"})
def factorise(value, symmetric, plan, factor, pivot):  # pragma: no cover - compiled
    """Factorise a matrix; return whether it is regular.

    Inputs
    ------
    value : (nnz, 3, 3) float64, blocks in the order of the pattern
    symmetric : bool, whether the matrix is symmetric, which halves the work
    plan : Plan

    Outputs
    -------
    factor : (aptr[-1],) float64, written
    pivot : (3 nc,) int64, written
    """
    width, whole, aptr, fptr = plan.width, plan.whole, plan.aptr, plan.fptr
    offset, place, parent = plan.offset, plan.place, plan.parent
    eptr, entry, row, column = plan.eptr, plan.entry, plan.row, plan.column
    count = len(width)
    factor[: aptr[-1]] = 0.0
    at = 0
    for f in range(count):
        m, w = whole[f], width[f]
        a = factor[aptr[f] : aptr[f + 1]].reshape((m, m))
        for e in range(eptr[f], eptr[f + 1]):
            i, j, x = row[e], column[e], value[entry[e]]
            for k in range(3):
                a[i + k, j] += x[k, 0]
                a[i + k, j + 1] += x[k, 1]
                a[i + k, j + 2] += x[k, 2]
        if symmetric:
            # children have left the lower half alone
            for k in range(w):
                for j in range(k + 1, m):
                    a[k, j] = a[j, k]
        if not _partial_lu(a, w, pivot[at : at + w], symmetric):
            return False
        at += w
        if parent[f] < 0:
            continue
        up = parent[f]
        above = factor[aptr[up] : aptr[up + 1]].reshape((whole[up], whole[up]))
        for s in range(fptr[f] + 1, fptr[f + 1]):
            i0, i1 = offset[s], offset[s + 1] if s + 1 < fptr[f + 1] else m
            for t in range(fptr[f] + 1, s + 1 if symmetric else fptr[f + 1]):
                j0, j1 = offset[t], offset[t + 1] if t + 1 < fptr[f + 1] else m
                pi, pj = place[s], place[t]
                for i in range(i1 - i0):
                    for j in range(j1 - j0):
                        above[pi + i, pj + j] += a[i0 + i, j0 + j]
    return True


@njit(cache=True, fastmath={"contract", "reassoc"})
def solve(x, plan, factor, pivot, work):  # pragma: no cover - compiled
    """Solve for one right side.

    Inputs
    ------
    x : (nc, 3) float64, overwritten
    plan, factor, pivot : as in `factorise`
    work : (largest `whole`,) float64, overwritten

    Outputs
    -------
    x : the solution
    """
    width, whole, aptr, fptr, front = plan.width, plan.whole, plan.aptr, plan.fptr, plan.front
    offset, mptr, member = plan.offset, plan.mptr, plan.member
    count = len(width)
    at = 0
    for f in range(count):
        m, w = whole[f], width[f]
        a = factor[aptr[f] : aptr[f + 1]].reshape((m, m))
        for s in range(mptr[f], mptr[f + 1]):
            c, i = member[s], 3 * (s - mptr[f])
            work[i], work[i + 1], work[i + 2] = x[c, 0], x[c, 1], x[c, 2]
        for k in range(w):
            best = pivot[at + k]
            if best != k:
                work[k], work[best] = work[best], work[k]
        for i in range(1, w):
            total = work[i]
            for k in range(i):
                total -= a[i, k] * work[k]
            work[i] = total
        for s in range(mptr[f], mptr[f + 1]):
            c, i = member[s], 3 * (s - mptr[f])
            x[c, 0], x[c, 1], x[c, 2] = work[i], work[i + 1], work[i + 2]
        for s in range(fptr[f] + 1, fptr[f + 1]):
            i, g = offset[s], front[s]
            for c in member[mptr[g] : mptr[g + 1]]:
                for n in range(3):
                    total = x[c, n]
                    for k in range(w):
                        total -= a[i, k] * work[k]
                    x[c, n] = total
                    i += 1
        at += w
    for f in range(count - 1, -1, -1):
        m, w = whole[f], width[f]
        a = factor[aptr[f] : aptr[f + 1]].reshape((m, m))
        for s in range(fptr[f], fptr[f + 1]):
            i, g = offset[s], front[s]
            for c in member[mptr[g] : mptr[g + 1]]:
                work[i], work[i + 1], work[i + 2] = x[c, 0], x[c, 1], x[c, 2]
                i += 3
        for i in range(w - 1, -1, -1):
            total = work[i]
            for j in range(i + 1, m):
                total -= a[i, j] * work[j]
            work[i] = total / a[i, i]
        for s in range(mptr[f], mptr[f + 1]):
            c, i = member[s], 3 * (s - mptr[f])
            x[c, 0], x[c, 1], x[c, 2] = work[i], work[i + 1], work[i + 2]
