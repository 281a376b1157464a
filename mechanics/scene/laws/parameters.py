"""Checks of the parameters of laws."""

from math import isfinite

from moma.errors import SceneError

__all__ = ["require_at_least_zero", "require_between", "require_positive"]


def require_between(law: str, low: float, high: float, remedy: str, **given: float) -> None:
    """Refuse a parameter outside [low, high].

    Raises
    ------
    SceneError : naming the law, the parameter and its value
    """
    for name, value in given.items():
        if not low <= value <= high:
            raise SceneError(f"{name} = {value!r}", where=law, remedy=remedy)


def require_at_least_zero(law: str, **given: float) -> None:
    """Refuse a parameter that is negative or not finite (SceneError)."""
    for name, value in given.items():
        if not (isfinite(value) and value >= 0):
            raise SceneError(f"{name} = {value!r}", where=law, remedy="give a number of 0 or more")


def require_positive(law: str, **given: float) -> None:
    """Refuse a parameter that is not finite and above zero (SceneError)."""
    for name, value in given.items():
        if not (isfinite(value) and value > 0):
            raise SceneError(f"{name} = {value!r}", where=law, remedy="give a number greater than 0")
