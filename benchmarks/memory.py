"""How much memory a simulation takes: the arrays that it keeps, and the most that the process ever had."""

import sys
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from scipy.sparse import issparse

__all__ = ["arrays_bytes", "peak_bytes"]


def arrays_bytes(root: Any) -> int:
    """Bytes of all numpy arrays that can be reached from an object, each buffer once."""
    seen: set[int] = set()
    buffers: dict[int, int] = {}
    waiting = [root]
    while waiting:
        one = waiting.pop()
        if id(one) in seen:
            continue
        seen.add(id(one))
        if isinstance(one, np.ndarray):
            owner = one
            while isinstance(owner.base, np.ndarray):
                owner = owner.base
            buffers[id(owner)] = owner.nbytes
            waiting += [owner]
        elif issparse(one):
            waiting += [one.data, *(getattr(one, key) for key in ("indices", "indptr") if hasattr(one, key))]
        elif isinstance(one, dict):
            waiting += list(one.values())
        elif isinstance(one, list | tuple):
            waiting += list(one)
        elif is_dataclass(one) and not isinstance(one, type):
            waiting += [getattr(one, field.name) for field in fields(one)]
            waiting += list(getattr(one, "__dict__", {}).values())
        elif type(one).__module__.startswith("mechanics"):
            waiting += list(getattr(one, "__dict__", {}).values())
    return sum(buffers.values())


def peak_bytes() -> int | None:
    """Most memory that this process ever had; None where the system does not say."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
