"""Array types that annotations of the package share.

Commands that only look up rows need no arrays, and loading numpy takes a fifth of their time. At run time the names are
therefore markers; type checkers see the arrays.
"""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Bools = NDArray[np.bool_]
    Ints = NDArray[np.int64]
    Texts = NDArray[np.str_]
    Values = NDArray[np.generic]
else:

    class Array:
        """Array of float64."""

    class Bools:
        """Array of truths."""

    class Ints:
        """Array of int64."""

    class Texts:
        """Array of texts."""

    class Values:
        """Array of any type."""
