"""Compilation of the usual kernels by ``python -m ground.kernels``, beside an installation.

It needs nothing but numba and SciPy, and may be ended at any moment: what it has compiled stays in the cache.
The kernels of the first command come first, those of the next from its far end: that command begins at the near one.
Last come those of other engines.
"""

import gc
from contextlib import suppress

from ground.kernels.uses import COMMANDS, OTHERS, kernels_of

if __name__ == "__main__":
    gc.disable()  # a compiler makes millions of small objects that live
    first, *later = COMMANDS
    for use in (
        *kernels_of(first),
        *(use for name in (*later, OTHERS) for use in reversed(kernels_of(name))),
    ):
        with suppress(Exception):  # a list of an older program; the command itself reports what is wrong
            use.compile()
