"""Threads that share work: kernels that let go of the interpreter run at once."""

from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache

__all__ = ["pool"]


@lru_cache
def pool(threads: int) -> ThreadPoolExecutor:
    """Return so many threads, always the same: work reaches one that waits in microseconds, a new one in milliseconds.

    Work that runs in them gives them none, as it would wait for itself.
    """
    return ThreadPoolExecutor(threads)
