"""Numba kernels of L D Lᵀ factors of symmetric, positive definite matrices of blocks, one row for each body.

Blocks are 6 × 6 in space, and 3 × 3 in the plane. The formulas below are those of space.

Bodies are numbered in the order of their elimination. Those that follow each other and reach nearly the same later ones
share a panel: a dense matrix (6 w, 6 m) for the w bodies of its columns and the m bodies of its rows, of which the
first w are its own. Its entry (6 i + b, 6 p + a) couples velocity b of its i-th body with velocity a of the p-th of its
rows, so that loops run along the long side. Panels are made from left to right, each from those before it that reach it
(George & Liu 1981; Ng & Peyton 1993). At the end the blocks of L are divided by those on its diagonal: D⁻¹ takes their
place, and no solution waits for a triangle. Six rows are then laid out one after the other as a solution reads them:
D⁻¹, and what is to the right of it in tiles of 16 columns, row by row. A solution costs the memory that it reads; so
factors may be of single precision, where the equation that they solve is one for a correction.

Far from a load, and between velocities that hardly feel each other, numbers fade below the least normal one, 1e-38 in
single precision. Products of such take ten times as long. So entries of L below its third root r are taken as 0, those
beside the diagonal of a block of D⁻¹ below r times the geometric mean of their diagonal ones, and loads and velocities
below r².
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

# rows of a panel that are finished, while other threads wait, before they are taken from the others by one product
AT_ONCE = 48
# bodies above which a product is faster than line by line
_FEW = 1
# columns of a tile: a multiple of what a processor multiplies at once
_TILE = 16


class Panels(NamedTuple):
    """Pattern of the factors.

    Attributes
    ----------
    body : (np+1,) int64, first body of each panel
    first : (np+1,) int64, where the rows of each panel begin in `row`
    row : int64, bodies of the rows of each panel, in order, its own first
    start : (np+1,) int64, where each panel begins among the values
    size : int64, velocities of a body: 6, or 3 in the plane
    """

    body: NDArray[np.int64]
    first: NDArray[np.int64]
    row: NDArray[np.int64]
    start: NDArray[np.int64]
    size: int


@njit(cache=True)
def _columns(pairs, count):
    """Return where the rows of each body's column begin, and the rows with their fill, in order, its own first."""
    start = np.zeros(count + 1, dtype=np.int64)
    for p in range(pairs.shape[0]):
        start[min(pairs[p, 0], pairs[p, 1]) + 1] += 1
    for k in range(count):
        start[k + 1] += start[k]
    later, fill = np.empty(pairs.shape[0], dtype=np.int64), start[:-1].copy()
    for p in range(pairs.shape[0]):
        k = min(pairs[p, 0], pairs[p, 1])
        later[fill[k]] = max(pairs[p, 0], pairs[p, 1])
        fill[k] += 1
    first = np.zeros(count + 1, dtype=np.int64)
    row = np.empty(8 * count + pairs.shape[0] + 1, dtype=np.int64)
    mark = np.full(count, -1, dtype=np.int64)
    # columns whose second row is k pass their rows on to it
    child, sibling = np.full(count, -1, dtype=np.int64), np.full(count, -1, dtype=np.int64)
    for k in range(count):
        at = first[k]
        if at + count - k > row.shape[0]:
            longer = np.empty(2 * row.shape[0] + count, dtype=np.int64)
            longer[:at] = row[:at]
            row = longer
        row[at], mark[k] = k, k
        end = at + 1
        for p in range(start[k], start[k + 1]):
            if mark[later[p]] != k:
                mark[later[p]] = k
                row[end] = later[p]
                end += 1
        j = child[k]
        while j >= 0:
            for p in range(first[j] + 2, first[j + 1]):
                if mark[row[p]] != k:
                    mark[row[p]] = k
                    row[end] = row[p]
                    end += 1
            j = sibling[j]
        row[at + 1 : end] = np.sort(row[at + 1 : end])
        first[k + 1] = end
        if end > at + 1:
            parent = row[at + 1]
            sibling[k] = child[parent]
            child[parent] = k
    return first, row


@njit(cache=True)
def postorder(pairs, count):  # pragma: no cover - compiled
    """Return the rank (count,) int64 of each body in an order of the same fill in which chains follow each other.

    Inputs
    ------
    pairs : (n, 2) int64, bodies that couple, those of one row different
    count : int64, nm
    """
    first, row = _columns(pairs, count)
    child, sibling = np.full(count, -1, dtype=np.int64), np.full(count, -1, dtype=np.int64)
    roots = -1
    for k in range(count - 1, -1, -1):
        if first[k + 1] > first[k] + 1:
            parent = row[first[k] + 1]
            sibling[k] = child[parent]
            child[parent] = k
        else:
            sibling[k] = roots
            roots = k
    rank, stack = np.empty(count, dtype=np.int64), np.empty(count + 1, dtype=np.int64)
    number, top = 0, 0
    root = roots
    while root >= 0:
        stack[0], top = root, 1
        while top > 0:
            k = stack[top - 1]
            if child[k] >= 0:
                stack[top] = child[k]
                # visited once: its place is taken by the next
                child[k] = sibling[child[k]]
                top += 1
            else:
                rank[k] = number
                number += 1
                top -= 1
        root = sibling[root]
    return rank


@njit(cache=True)
def panels_of(pairs, count, spare, size):  # pragma: no cover - compiled
    """Return the pattern of the factors.

    Inputs
    ------
    pairs : (n, 2) int64, bodies that couple, those of one row different; repetitions are allowed
    count : int64, nm
    spare : float64, zeros that a panel may hold for its bodies to be together, over its other blocks
    size : int64, velocities of a body: 6, or 3 in the plane

    Outputs
    -------
    Panels
    """
    first, row = _columns(pairs, count)
    body = np.empty(count + 1, dtype=np.int64)
    number, k = 0, 0
    while k < count:
        body[number] = k
        number += 1
        true = first[k + 1] - first[k]
        width = 1
        while k + 1 < count and first[k + 1] > first[k] + 1 and row[first[k] + 1] == k + 1:
            rows = first[k + 2] - first[k + 1]
            more = true + rows
            # of the square of its own bodies the upper half is no loss
            whole = width * (width + 1) // 2 + width * rows + rows
            if whole > (1.0 + spare) * more:
                break
            true, width, k = more, width + 1, k + 1
        k += 1
    body[number] = count
    body = body[: number + 1].copy()
    begin, start = np.zeros(number + 1, dtype=np.int64), np.zeros(number + 1, dtype=np.int64)
    for s in range(number):
        last, width = body[s + 1] - 1, body[s + 1] - body[s]
        height = width + first[last + 1] - first[last] - 1
        begin[s + 1] = begin[s] + height
        start[s + 1] = start[s] + size * size * width * height
    rows = np.empty(begin[number], dtype=np.int64)
    for s in range(number):
        last, at = body[s + 1] - 1, begin[s]
        for k in range(body[s], last):
            rows[at] = k
            at += 1
        rows[at : begin[s + 1]] = row[first[last] : first[last + 1]]
    return Panels(body, begin, rows, start, size)


@njit(cache=True, fastmath={"contract"})
def _subtract(source, p, size, line, spot, row, work):
    """Take from the line of one velocity of a body what an earlier panel contributes.

    `source` (6 w, n) is that panel, `p` = 6 (place of the body among its rows) + velocity, 6 the `size` of a body;
    `spot` is the place of each body among the rows of the line's panel.
    """
    w, first = source.shape[0], p // size
    rest, whole = source[:, size * first :], w - w % 6
    # loops from zero on: other indices might be negative, and would not be vectorised
    n = rest.shape[1]
    for x in range(n):
        work[x] = 0.0
    for c in range(0, whole, 6):
        f0, f1, f2 = source[c, p], source[c + 1, p], source[c + 2, p]
        f3, f4, f5 = source[c + 3, p], source[c + 4, p], source[c + 5, p]
        s0, s1, s2, s3, s4, s5 = rest[c], rest[c + 1], rest[c + 2], rest[c + 3], rest[c + 4], rest[c + 5]
        for x in range(n):
            work[x] += f0 * s0[x] + f1 * s1[x] + f2 * s2[x] + f3 * s3[x] + f4 * s4[x] + f5 * s5[x]
    # three are left of an odd number of bodies in the plane
    if whole < w:
        f0, f1, f2 = source[whole, p], source[whole + 1, p], source[whole + 2, p]
        s0, s1, s2 = rest[whole], rest[whole + 1], rest[whole + 2]
        for x in range(n):
            work[x] += f0 * s0[x] + f1 * s1[x] + f2 * s2[x]
    for q in range(n // size):
        at, come = size * spot[row[first + q]], size * q
        for a in range(3):
            line[at + a] -= work[come + a]
        if size == 6:
            for a in range(3, 6):
                line[at + a] -= work[come + a]


class _Space(NamedTuple):
    """Memory for products: parts of two panels, and what they make, each as large as the largest."""

    left: NDArray[np.float64]
    right: NDArray[np.float64]
    product: NDArray[np.float64]


@njit(cache=True)
def _product(left, right, product):
    """Return leftᵀ right, in the beginning of `product`, which is large enough."""
    shape = left.shape[1], right.shape[1]
    out = product[: shape[0] * shape[1]].reshape(shape)
    np.dot(left.T, right, out)
    return out


@njit(cache=True)
def _copied(source, begin, end, space):
    """Copy some columns of `source` to the beginning of `space`; return them in their shape."""
    shape = source.shape[0], end - begin
    out = space[: shape[0] * shape[1]].reshape(shape)
    for c in range(shape[0]):
        row, to = source[c, begin:end], out[c]
        for x in range(shape[1]):
            to[x] = row[x]
    return out


@njit(cache=True, fastmath={"contract"})
def _finish_rows(panel, begin, end):
    """Turn some rows of a panel into those of the Cholesky factor, once all before them have been taken from them.

    Return whether they are those of a positive definite matrix.
    """
    one = panel.dtype.type(1.0)
    n = panel.shape[1]
    for b in range(begin, end):
        pivot, line = panel[b, b], panel[b]
        if not (pivot > 0.0 and np.isfinite(pivot)):
            return False
        scale = one / np.sqrt(pivot)
        for x in range(b, n):
            line[x] *= scale
        for d in range(b + 1, end):
            factor, other, own = line[d], panel[d, d:], line[d:]
            for x in range(n - d):
                other[x] -= factor * own[x]
    return True


@njit(cache=True)
def _finish(panel, space):
    """Turn an updated panel into one of the Cholesky factor; return whether it is positive definite.

    Rows are finished some at a time; what they take from all others is one product.
    """
    w, n = panel.shape
    for k in range(0, w, AT_ONCE):
        end = min(k + AT_ONCE, w)
        if not _finish_rows(panel, k, end):
            return False
        if end < w:
            done = panel[k:end]
            taken = _product(
                _copied(done, end, w, space.left), _copied(done, end, n, space.right), space.product
            )
            for d in range(end, w):
                line, less = panel[d, end:], taken[d - end]
                for x in range(n - end):
                    line[x] -= less[x]
    return True


@njit(cache=True)
def _subtract_rows(source, which, panel, spot, row, space):
    """Take from the lines of several bodies what an earlier panel contributes, as `_subtract` does from one line.

    `which` is 6, the first of these bodies among the rows of that panel, the one after the last, and the first body of
    the panel from which it is taken.
    """
    size, begin, end, own = which
    n = source.shape[1]
    left = _copied(source, size * begin, size * end, space.left)
    taken = _product(left, _copied(source, size * begin, n, space.right), space.product)
    for p in range(begin, end):
        for b in range(size):
            line, less = panel[size * (row[p] - own) + b], taken[size * (p - begin) + b]
            for q in range(p, n // size):
                at, come = size * spot[row[q]], size * (q - begin)
                for a in range(size):
                    line[at + a] -= less[come + a]


@njit(cache=True)
def _least(dtype, power):
    """Return a power of the least normal number of a precision, below which a product would be subnormal."""
    return dtype.type(np.float64(np.finfo(dtype).tiny) ** power)


@njit(cache=True, inline="always")
def _kept(number, least):
    """Return a number, or 0 where it is less; what is no number stays so."""
    return number if abs(number) >= least else number - number


@njit(cache=True, fastmath={"contract"})
def _divide(panel, n, inverse, spare):
    """Divide the blocks of a panel by those on its diagonal, which D⁻¹ replaces, and lay it out as it is read.

    In the plane two bodies share a block, and the last of an odd number has its own. `panel` (w n,) is flat; `inverse`
    (6, 6) and `spare` are overwritten.
    """
    zero, one, least = panel.dtype.type(0.0), panel.dtype.type(1.0), _least(panel.dtype, 1 / 3)
    w = panel.shape[0] // n
    for k in range(0, w, 6):
        m = min(6, w - k)
        block, rest = panel[k * n : (k + m) * n].reshape((m, n)), n - k - m
        for b in range(m - 1, -1, -1):
            line, scale = block[b, k + m :], one / block[b, k + b]
            for d in range(m):
                inverse[b, d] = zero
            inverse[b, b] = scale
            for x in range(rest):
                line[x] *= scale
            for d in range(b + 1, m):
                factor, other = block[b, k + d] * scale, block[d, k + m :]
                for c in range(d, m):
                    inverse[b, c] -= factor * inverse[d, c]
                for x in range(rest):
                    line[x] -= factor * other[x]
        for b in range(m):
            for d in range(m):
                total = zero
                for c in range(max(b, d), m):
                    total += inverse[b, c] * inverse[d, c]
                spare[m * b + d] = total
        for b in range(m):
            for d in range(b):
                # in whatever units
                small = least * np.sqrt(spare[m * b + b]) * np.sqrt(spare[m * d + d])
                spare[m * b + d] = spare[m * d + b] = _kept(spare[m * b + d], small)
        at = m * m
        for begin in range(k + m, n, _TILE):
            for b in range(m):
                for x in range(begin, min(begin + _TILE, n)):
                    spare[at] = _kept(block[b, x], least)
                    at += 1
        panel[k * n : k * n + at] = spare[:at]


@njit(cache=True)
def _panel(panels, value, s):
    """Return panel s (6 w, 6 m) of the values."""
    width, height = panels.body[s + 1] - panels.body[s], panels.first[s + 1] - panels.first[s]
    return value[panels.start[s] : panels.start[s + 1]].reshape((panels.size * width, panels.size * height))


@njit(cache=True)
def _take(source, which, panel, spot, row, work, space):
    """Take from the lines of some bodies what an earlier panel contributes; `which` as in `_subtract_rows`."""
    size, begin, end, own = which
    if end - begin > _FEW and source.shape[0] > size * _FEW:
        _subtract_rows(source, which, panel, spot, row, space)
        return
    for q in range(begin, end):
        for b in range(size):
            _subtract(source, size * q + b, size, panel[size * (row[q] - own) + b], spot, row, work)


@njit(cache=True, nogil=True)
def eliminate(panels, value, begin, end):  # pragma: no cover - compiled
    """Turn the panels of a subtree, or of the whole tree, into those of the Cholesky factor, in place.

    Inputs
    ------
    panels : Panels
    value : float64 or float32, the panels of A: its lower triangle, and zeros
    begin, end : int64, the first of the panels and the one after the last

    Outputs
    -------
    value : these panels of the factor
    bool, whether their part of A is positive definite
    """
    body, first, row, size = panels.body, panels.first, panels.row, panels.size
    low, number = body[begin], end - begin
    owner = np.empty(body[end] - low, dtype=np.int64)
    spot = np.zeros(body[-1], dtype=np.int64)
    # finished panels wait in a list of the next panel that they reach
    head, follower = np.full(number, -1, dtype=np.int64), np.full(number, -1, dtype=np.int64)
    place = np.zeros(number, dtype=np.int64)
    highest, widest, largest = 0, 0, 0
    for s in range(begin, end):
        owner[body[s] - low : body[s + 1] - low] = s - begin
        highest = max(highest, first[s + 1] - first[s])
        widest = max(widest, body[s + 1] - body[s])
        largest = max(largest, (body[s + 1] - body[s]) * (first[s + 1] - first[s]))
    work, largest = np.empty(size * highest, value.dtype), size * size * largest
    space = _Space(
        np.empty(largest, value.dtype),
        np.empty(largest, value.dtype),
        np.empty(size * widest * size * highest, value.dtype),
    )
    for s in range(begin, end):
        width, height = body[s + 1] - body[s], first[s + 1] - first[s]
        panel = _panel(panels, value, s)
        for p in range(height):
            spot[row[first[s] + p]] = p
        j = head[s - begin]
        while j >= 0:
            then, rows, q = follower[j], row[first[begin + j] : first[begin + j + 1]], place[j]
            after = q
            while after < rows.shape[0] and rows[after] < body[s + 1]:
                after += 1
            source = _panel(panels, value, begin + j)
            _take(source, (size, q, after, body[s]), panel, spot, rows, work, space)
            place[j] = after
            if after < rows.shape[0] and rows[after] < body[end]:
                up = owner[rows[after] - low]
                follower[j] = head[up]
                head[up] = j
            j = then
        if not _finish(panel, space):
            return False
        if height > width and row[first[s] + width] < body[end]:
            place[s - begin] = width
            up = owner[row[first[s] + width] - low]
            follower[s - begin] = head[up]
            head[up] = s - begin
    return True


@njit(cache=True)
def _first(values, begin, end, least):
    """Return the first place from `begin` to `end` of a value that is not less; `values` are in order."""
    while begin < end:
        middle = (begin + end) // 2
        if values[middle] < least:
            begin = middle + 1
        else:
            end = middle
    return begin


@njit(cache=True)
def _panel_with(body, k):
    """Return the panel of body k."""
    return _first(body, 0, body.shape[0], k + 1) - 1


@njit(cache=True, nogil=True)
def reduce(panels, value, sources, targets):  # pragma: no cover - compiled
    """Take from the rows of some bodies what earlier bodies contribute, whose own rows are those of the factor.

    Inputs
    ------
    panels : Panels
    value : as in `eliminate`
    sources : (n, 2) int64, runs of earlier bodies: the first, and the one after the last
    targets : (m, 2) int64, runs alike, each within a panel

    Outputs
    -------
    value : the rows of the targets, with the same bits whatever other targets there are
    """
    body, first, row, size = panels.body, panels.first, panels.row, panels.size
    number, most = body.shape[0] - 1, 0
    for t in range(targets.shape[0]):
        most = max(most, targets[t, 1] - targets[t, 0])
    highest, widest, largest = 0, 0, 0
    for k in range(sources.shape[0]):
        for j in range(_panel_with(body, sources[k, 0]), _panel_with(body, sources[k, 1] - 1) + 1):
            width, height = (
                min(body[j + 1], sources[k, 1]) - max(body[j], sources[k, 0]),
                first[j + 1] - first[j],
            )
            highest, widest, largest = max(highest, height), max(widest, width), max(largest, width * height)
    spot, work = np.zeros(body[number], dtype=np.int64), np.empty(size * highest, value.dtype)
    space = _Space(
        np.empty(size * widest * size * most, value.dtype),
        np.empty(size * size * largest, value.dtype),
        np.empty(size * most * size * highest, value.dtype),
    )
    for t in range(targets.shape[0]):
        low, high = targets[t]
        s = _panel_with(body, low)
        panel = _panel(panels, value, s)
        for p in range(first[s], first[s + 1]):
            spot[row[p]] = p - first[s]
        for k in range(sources.shape[0]):
            for j in range(_panel_with(body, sources[k, 0]), _panel_with(body, sources[k, 1] - 1) + 1):
                if row[first[j + 1] - 1] < low:
                    continue
                begin = _first(row, first[j], first[j + 1], low) - first[j]
                end = _first(row, first[j] + begin, first[j + 1], high) - first[j]
                if begin < end:
                    own = size * (max(sources[k, 0], body[j]) - body[j]), size * (sources[k, 1] - body[j])
                    source = _panel(panels, value, j)[own[0] : own[1]]
                    rows = row[first[j] : first[j + 1]]
                    _take(source, (size, begin, end, body[s]), panel, spot, rows, work, space)


@njit(cache=True)
def finish(panels, value, begin, end):  # pragma: no cover - compiled
    """Turn the rows of some bodies of a panel into those of the factor, once nothing is left to be taken from them.

    Inputs
    ------
    panels : Panels
    value : as in `eliminate`
    begin, end : int64, the first of the bodies and the one after the last

    Outputs
    -------
    value : these rows of the factor
    bool, whether their part of A is positive definite
    """
    s = _panel_with(panels.body, begin)
    own, size = panels.body[s], panels.size
    return _finish_rows(_panel(panels, value, s), size * (begin - own), size * (end - own))


@njit(cache=True, nogil=True)
def divide(panels, value, begin, end):  # pragma: no cover - compiled
    """Turn panels of the Cholesky factor into those of L, with D⁻¹ in the blocks on their diagonals, as they are read.

    Inputs
    ------
    panels : Panels
    value : as `eliminate` leaves it
    begin, end : int64, the first of the panels and the one after the last

    Outputs
    -------
    value : these panels of L
    """
    first, start, size, longest = panels.first, panels.start, panels.size, 0
    for s in range(begin, end):
        longest = max(longest, size * (first[s + 1] - first[s]))
    inverse, spare = np.empty((6, 6), value.dtype), np.empty(6 * longest, value.dtype)
    for s in range(begin, end):
        _divide(value[start[s] : start[s + 1]], size * (first[s + 1] - first[s]), inverse, spare)


@njit(cache=True, inline="always")
def _spread(tile, h, f, rest):
    """Add what six velocities f contribute by a tile (6, h)."""
    for i in range(h):
        rest[i] += (
            f[0] * tile[i]
            + f[1] * tile[h + i]
            + f[2] * tile[2 * h + i]
            + f[3] * tile[3 * h + i]
            + f[4] * tile[4 * h + i]
            + f[5] * tile[5 * h + i]
        )


@njit(cache=True, inline="always")
def _collect(tile, h, rest, sums):
    """Return six sums with what a tile (6, h) contributes."""
    s0, s1, s2, s3, s4, s5 = sums
    for i in range(h):
        w = rest[i]
        s0 += w * tile[i]
        s1 += w * tile[h + i]
        s2 += w * tile[2 * h + i]
        s3 += w * tile[3 * h + i]
        s4 += w * tile[4 * h + i]
        s5 += w * tile[5 * h + i]
    return s0, s1, s2, s3, s4, s5


@njit(cache=True, inline="always")
def _forward(block, x, work, least):
    """Take from a block of rows and its velocities x (6,), or (3,), what they contribute to those that follow.

    `work` holds what the rows before contribute, to these velocities first.
    """
    m = x.shape[0]
    rest = work[m:]
    n = rest.shape[0]
    for a in range(m):
        x[a] = _kept(x[a] - work[a], least)
    if m == 6:
        whole, tiles = n - n % _TILE, block[36:]
        f = x[0], x[1], x[2], x[3], x[4], x[5]
        for i in range(0, whole, _TILE):
            _spread(tiles[6 * i : 6 * (i + _TILE)], _TILE, f, rest[i : i + _TILE])
        _spread(tiles[6 * whole :], n - whole, f, rest[whole:])
        return
    for i in range(0, n, _TILE):
        h, tile, to = min(_TILE, n - i), block[9 + 3 * i :], rest[i:]
        for k in range(h):
            to[k] += x[0] * tile[k] + x[1] * tile[h + k] + x[2] * tile[2 * h + k]


@njit(cache=True, inline="always")
def _backward(block, x, work, least):
    """Solve for the velocities x (6,), or (3,), of a block of rows, from those that follow; all join in `work`."""
    m, zero = x.shape[0], block.dtype.type(0.0)
    rest = work[m:]
    n = rest.shape[0]
    if m == 6:
        whole, tiles = n - n % _TILE, block[36:]
        sums = zero, zero, zero, zero, zero, zero
        for i in range(0, whole, _TILE):
            sums = _collect(tiles[6 * i : 6 * (i + _TILE)], _TILE, rest[i : i + _TILE], sums)
        sums = _collect(tiles[6 * whole :], n - whole, rest[whole:], sums)
        t = x[0], x[1], x[2], x[3], x[4], x[5]
        for a in range(6):
            d = block[6 * a : 6 * a + 6]
            own = d[0] * t[0] + d[1] * t[1] + d[2] * t[2] + d[3] * t[3] + d[4] * t[4] + d[5] * t[5]
            x[a] = work[a] = _kept(own - sums[a], least)
        return
    s0 = s1 = s2 = zero
    for i in range(0, n, _TILE):
        h, tile, w = min(_TILE, n - i), block[9 + 3 * i :], rest[i:]
        for k in range(h):
            s0 += w[k] * tile[k]
            s1 += w[k] * tile[h + k]
            s2 += w[k] * tile[2 * h + k]
    t, ends = (x[0], x[1], x[2]), (s0, s1, s2)
    for a in range(3):
        d = block[3 * a : 3 * a + 3]
        x[a] = work[a] = _kept(d[0] * t[0] + d[1] * t[1] + d[2] * t[2] - ends[a], least)


@njit(cache=True, fastmath={"contract", "reassoc"})
def forward(panels, value, x, work, begin, end, place):  # pragma: no cover - compiled
    """Solve L D y = b for the bodies of some panels, once those before them have contributed.

    Inputs
    ------
    panels : Panels
    value : as `divide` leaves it
    x : b by bodies, of the same precision, overwritten
    work : as long as the longest panel at least, alike, overwritten
    begin, end : int64, the first of the panels and the one after the last
    place : int64, as long as `panels.row`, of each row the place in x where what a panel contributes to it adds up

    Outputs
    -------
    x : y, and at places of later bodies what these panels contribute
    """
    body, first, start, size = panels.body, panels.first, panels.start, panels.size
    zero, least = value.dtype.type(0.0), _least(value.dtype, 2 / 3)
    for s in range(begin, end):
        width, height, at = body[s + 1] - body[s], first[s + 1] - first[s], size * body[s]
        w, n = size * width, size * height
        panel = value[start[s] : start[s + 1]]
        for i in range(n):
            work[i] = zero
        for k in range(0, w, 6):
            end_k = min(k + 6, w)
            _forward(panel[k * n : end_k * n], x[at + k : at + end_k], work[k:n], least)
        for p in range(width, height):
            to, come = size * place[first[s] + p], size * p
            for a in range(3):
                x[to + a] -= work[come + a]
            if size == 6:
                for a in range(3, 6):
                    x[to + a] -= work[come + a]


@njit(cache=True, fastmath={"contract", "reassoc"})
def backward(panels, value, x, work, begin, end):  # pragma: no cover - compiled
    """Solve Lᵀ x = D⁻¹ y for the bodies of some panels, once those after them are solved; as `forward`.

    Outputs
    -------
    x : the solution
    """
    body, first, row, start, size = panels.body, panels.first, panels.row, panels.start, panels.size
    least = _least(value.dtype, 2 / 3)
    for s in range(end - 1, begin - 1, -1):
        width, height, at = body[s + 1] - body[s], first[s + 1] - first[s], size * body[s]
        w, n = size * width, size * height
        panel = value[start[s] : start[s + 1]]
        for p in range(width, height):
            come, to = size * row[first[s] + p], size * p
            for a in range(3):
                work[to + a] = x[come + a]
            if size == 6:
                for a in range(3, 6):
                    work[to + a] = x[come + a]
        for k in range(w - 1 - (w - 1) % 6, -1, -6):
            end_k = min(k + 6, w)
            _backward(panel[k * n : end_k * n], x[at + k : at + end_k], work[k:n], least)


@njit(cache=True)
def solve(panels, value, x, work):  # pragma: no cover - compiled
    """Solve L D Lᵀ x = b.

    Inputs
    ------
    panels : Panels
    value : as `divide` leaves it
    x : (6 nm,), or (3 nm,) in the plane, of the same precision, b, overwritten
    work : as long as the longest panel at least, alike, overwritten

    Outputs
    -------
    x : the solution
    """
    number = panels.body.shape[0] - 1
    forward(panels, value, x, work, 0, number, panels.row)
    backward(panels, value, x, work, 0, number)
