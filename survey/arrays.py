"""Array types that annotations of the package share."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["Array", "Bools", "Ints"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
