"""Factors L D Lᵀ of many bodies, part by part of their elimination tree, by any number of threads.

Parts share no factor, so each is factorised apart. The rows of the bodies between parts are cut into blocks: all of
them take what the parts contribute, then block after block is finished, and the later ones take what it contributes.
What is taken from a block is taken in the same order and by the same products, whoever does so: threads change no bit
(mechanics/solvers/_kernels/body_cholesky.py, body_parts.py).
"""

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.scene.threads import at_once
from mechanics.solvers._kernels import body_cholesky as kernel
from mechanics.solvers._kernels.body_parts import Parts

_Each = Callable[..., Iterable[bool | None]]


def factorise(panels: kernel.Panels, value: Array, parts: Parts | None = None, threads: int = 1) -> bool:
    """Factorise A = L D Lᵀ in place; return whether A is positive definite.

    Parameters
    ----------
    panels : pattern of the factors
    value : the panels of A, its lower triangle and zeros; then those of L, with D⁻¹ in the blocks on their diagonals
    parts : of the panels; None for one that holds them all
    threads : the result does not depend on them
    """
    number = len(panels.body) - 1
    if parts is None or len(parts.panel) == 1:
        if not kernel.eliminate(panels, value, 0, number):
            return False
        kernel.divide(panels, value, 0, number)
        return True
    return _factorise(panels, value, parts, threads, at_once(threads) if threads > 1 else map)


def _factorise(panels: kernel.Panels, value: Array, parts: Parts, threads: int, each: _Each) -> bool:
    """Factorise in parts, with `each` applied to them."""
    sizes = np.diff(panels.start[parts.panel])[:, 0]
    largest = parts.panel[np.argsort(-sizes, kind="stable")]
    if not all(list(each(partial(kernel.eliminate, panels, value), *largest.T))):
        return False
    blocks = _blocks(panels, parts.rest)

    def reduce(sources: Ints, targets: Ints) -> None:
        """Reduce target blocks by sources, each thread a share of the targets."""
        shares = [targets[k::threads] for k in range(min(threads, len(targets)))]
        list(each(partial(kernel.reduce, panels, value, sources), shares))

    reduce(parts.body, blocks)
    for k in range(len(blocks)):
        if not kernel.finish(panels, value, *blocks[k]):
            return False
        reduce(blocks[k : k + 1], blocks[k + 1 :])
    between = np.column_stack([parts.rest, parts.rest + 1])
    list(each(partial(kernel.divide, panels, value), *np.concatenate([largest, between]).T))
    return True


def _blocks(panels: kernel.Panels, which: Ints) -> Ints:
    """Return the first body of each block (n, 2) of some panels, and the one after its last."""
    blocks, count = [], kernel.AT_ONCE // panels.size
    for first, end in zip(panels.body[which], panels.body[which + 1], strict=True):
        begin = np.arange(first, end, count)
        blocks.append(np.column_stack([begin, np.minimum(begin + count, end)]))
    return np.concatenate(blocks) if blocks else np.zeros((0, 2), dtype=np.int64)
