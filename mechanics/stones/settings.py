"""Check of settings against the bounds that they are declared with."""

from math import inf
from typing import Any

from ground.errors import SceneError
from ground.settings import Setting, declared
from mechanics.stones.validation import LARGEST, SMALLEST


def check_settings(where: str, settings: object) -> None:
    """Refuse the first number outside its declared bounds; None, where a field allows it, is always within them.

    Raises
    ------
    SceneError : naming the place, the setting, its value and a remedy

    >>> from dataclasses import dataclass
    >>> from typing import Annotated
    >>> @dataclass
    ... class Step:
    ...     length: Annotated[float, Setting("Time step h.", "s", above=0)] = 1e-3
    >>> declared(Step)["length"].unit
    's'
    >>> check_settings("time", Step(-1.0))
    Traceback (most recent call last):
    ground.errors.SceneError: time: length = -1.0; give a number greater than 0 [s]
    """
    owner: Any = type(settings)
    for name, setting in declared(owner).items():
        value = getattr(settings, name)
        if not (value in setting.choices if setting.choices else value is None or _within(value, setting)):
            raise SceneError(f"{name} = {value!r}", where=where, remedy=_remedy(setting))


def _within(value: Any, setting: Setting) -> bool:
    _, _, above, at_least, below, at_most, _, infinite = setting
    if above is at_least is below is at_most is None:
        return True  # a flag, an enumeration, a text
    return (
        abs(value) <= (inf if infinite else LARGEST)
        and (above is None or value - above >= SMALLEST)
        and (at_least is None or value >= at_least)
        and (below is None or value < below)
        and (at_most is None or value <= at_most)
    )


def _remedy(setting: Setting) -> str:
    if setting.choices:
        *others, last = map(str, setting.choices)
        return f"give {', '.join(others)} or {last}"
    unit = f" [{setting.unit}]" if setting.unit not in ("", "-") else ""
    return f"give a number {' and '.join(_bounds(setting))}{unit}"


def _bounds(setting: Setting) -> list[str]:
    """Return the bounds in words."""
    if setting.at_least is not None and setting.at_most is not None:
        return [f"from {setting.at_least:g} to {setting.at_most:g}"]
    words = (
        (setting.above, "greater than {:g}"),
        (setting.at_least, "of {:g} or more"),
        (setting.below, "less than {:g}"),
        (setting.at_most, "of at most {:g}"),
    )
    return [text.format(bound) for bound, text in words if bound is not None]
