"""Threads that share work: kernels that let go of the interpreter run at once."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import Any

_pool = lru_cache(ThreadPoolExecutor)


def at_once(threads: int) -> Callable[..., list[Any]]:
    """Return a `map` by so many threads, of which the caller's is one; its results are in order.

    The others are kept, and wait for more: work reaches one that waits in microseconds, a new one in milliseconds. Work
    must not share out work itself, as it might wait for its own thread.
    """

    def each(work: Callable[..., Any], *given: Any) -> list[Any]:
        """Return the results of the parts of a work, the first on this thread."""
        parts = list(zip(*given, strict=True))
        waiting = [_pool(threads - 1).submit(work, *part) for part in parts[1:]]
        results = [work(*part) for part in parts[:1]]
        # the last first, as the other threads take the first
        own = {k: work(*parts[k + 1]) for k in reversed(range(len(waiting))) if waiting[k].cancel()}
        return results + [own[k] if k in own else one.result() for k, one in enumerate(waiting)]

    return each
