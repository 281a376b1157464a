"""Roots of falling functions, from 0 upwards."""

from collections.abc import Callable

from scipy.optimize import brentq

_DOUBLINGS = 60  # of the upper end of the range, until the function is negative


def root_of(excess: Callable[[float], float], high: float) -> float:
    """Return the argument at which a falling function is zero; 0 if it is not positive there.

    Parameters
    ----------
    excess : function of one argument, at least 0
    high : argument at which it may be negative; doubled until it is
    """
    if not excess(0.0) > 0.0:
        return 0.0
    high = max(high, 1e-300)
    for _ in range(_DOUBLINGS):
        if excess(high) <= 0.0:
            break
        high *= 2.0
    else:
        return high
    return float(brentq(excess, 0.0, high, rtol=1e-12, xtol=1e-300))
