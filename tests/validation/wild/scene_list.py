"""The list of wild scenes: each is a function with its true verdict, and how to state one.

A verdict is true by statics or energy, never by MOMA's own motion: the docstring of each function gives the closed
form, or says that the linear program of `tests.validation.statics.limit_analysis` decides, and with which margin.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Any

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Scene, SolverSettings, TimeSettings

G = 9.81
SCENES: dict[str, "Wild"] = {}
"""All of them by name, in the order of their files."""


class Truth(StrEnum):
    """Fate of the stones."""

    STANDS = "stands"  # at rest in its place
    RESTS = "rests"  # the same, elsewhere: it moves on its way
    FALLS = "falls"  # a stone loses its support, wherever it comes to lie afterwards
    SLIDES = "slides"  # without end, still supported


@dataclass(frozen=True)
class Wild:
    """One scene.

    Attributes
    ----------
    name : of the function, or of the case of it
    truth : verdict
    build : makes the scene
    pace : factor on the time steps, for scenes that are slower than stones of a metre on Earth [-]
    """

    name: str
    truth: Truth
    build: Callable[[], Scene]
    pace: float = 1.0


def wild(truth: Truth, pace: float = 1.0) -> Callable[..., Any]:
    """Enter a function that makes a scene in the list: under its name, or under one given with its arguments.

    >>> @wild(Truth.STANDS)
    ... def cube(): ...
    >>> @wild(Truth.STANDS)("low", 1.0)
    ... @wild(Truth.FALLS)("high", 3.0)
    ... def tower(height): ...
    """

    def enter(made: Callable[[], Scene] | str, *given: object) -> Callable[..., Any]:
        if isinstance(made, str):
            return partial(_entered, name=made, given=given)
        return _entered(made, made.__name__, ())

    def _entered(build: Callable[..., Scene], name: str, given: tuple[object, ...]) -> Callable[..., Scene]:
        assert name not in SCENES, name
        SCENES[name] = Wild(name, truth, partial(build, *given), pace)
        return build

    return enter


stands, falls, slides = wild(Truth.STANDS), wild(Truth.FALLS), wild(Truth.SLIDES)
rests = wild(Truth.RESTS)


def scene(
    blocks, friction=0.7, *, duration=3.0, gravity=(0.0, 0.0, -G), motion=False, law=None, rules=(), **more
):
    """A scene that asks for its rest, or, with `motion`, for the motion itself."""
    return Scene(
        "wild",
        tuple(blocks),
        gravity=tuple(float(x) for x in gravity),
        contact=ContactSettings(law or DryJoint(friction), tuple(rules)),
        time=TimeSettings(step=1e-3, theta=0.5 if motion else 1.0, duration=duration),
        solver=SolverSettings(),
        **more,
    )


def tilted(multiplier, direction=(1.0, 0.0, 0.0), g=G):
    """Weight, and `multiplier` times the weight along a direction [m/s²]."""
    x, y, z = direction
    return (g * multiplier * x, g * multiplier * y, g * multiplier * z - g)
