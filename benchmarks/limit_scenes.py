"""Walls and façades with known limit loads: the walls of Ferris & Tin-Loi, and façades with bonded returns."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np

from mechanics.limit.assembly import RigidAssembly, assembly
from mechanics.limit.live_loads import Acceleration
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene
from mechanics.scene.shapes import bond, box, wall
from mechanics.stones.materials import Material

__all__ = ["FACADES", "FRICTION", "WALLS", "LimitCase", "facade", "facade_case"]

FRICTION = 0.65
"""Coulomb's μ of the walls."""

_STONE = Material("stone", 2000.0, young=1e10, poisson=0.2)
_WIDTH, _HEIGHT = 0.4, 0.175  # of a whole stone of the walls [m]
_BRICK = (0.08, 0.04, 0.028)  # length, thickness and height of a stone of the façades [m]
_ALONG = (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class LimitCase:
    """Stones, a direction in which they are pushed, and what is known of their limit load.

    Attributes
    ----------
    blocks : makes the stones
    stones : number of those that may move; None: not published
    friction : Coulomb's μ
    direction : (3,) of the acceleration
    bound, candidate : published λ with associative and with Coulomb's friction; None: not published [-]
    """

    blocks: Callable[[], Sequence[Block]]
    stones: int | None
    friction: float
    direction: tuple[float, float, float]
    bound: float | None
    candidate: float | None

    @property
    def live(self) -> Acceleration:
        """Load whose multiple is sought."""
        return Acceleration(self.direction)

    def assembly(self) -> RigidAssembly:
        """Return the stones and their joints."""
        contact = ContactSettings(DryJoint(self.friction))
        return assembly(Scene("limit", tuple(self.blocks()), contact=contact))


def facade(stones: int, courses: int, returns: int) -> tuple[Block, ...]:
    """Return a façade along x with bonded return walls at both ends, on a fixed stone `ground`.

    Parameters
    ----------
    stones, courses : whole stones in a course, and courses
    returns : whole stones in the length of each return wall; 0: none
    """
    length, thick, high = _BRICK
    width, deep = stones * length, returns * length + thick
    blocks = [box("ground", (-2.0, -2.0, -1.0), (2.0, 2.0, 0.0), _STONE, fidelity=Fidelity.FIXED)]
    for course in range(courses):
        whole = course % 2 == 0
        inset = 0.0 if whole else thick
        ends = [(0.0, thick), (width - thick, width)]
        lying = [(a, 0.0, b, thick) for a, b in _row(inset, width - inset)]
        if returns:
            lying += [(x0, a, x1, b) for a, b in _row(thick - inset, deep) for x0, x1 in ends]
        elif not whole:
            lying += [(x0, 0.0, x1, thick) for x0, x1 in ends]
        blocks += [
            box(f"{course}-{number}", (x0, y0, course * high), (x1, y1, (course + 1) * high), _STONE)
            for number, (x0, y0, x1, y1) in enumerate(lying)
        ]
    return tuple(blocks)


def facade_case(
    stones: int, courses: int, returns: int, friction: float, way: str, bound: float | None = None
) -> LimitCase:
    """Return a façade that is pushed *out*, away from its return walls, or *in*; further parameters as `facade`."""
    direction = (0.0, -1.0, 0.0) if way == "out" else (0.0, 1.0, 0.0)
    return LimitCase(partial(facade, stones, courses, returns), None, friction, direction, bound, None)


def _row(start: float, end: float) -> Iterator[tuple[float, float]]:
    return pairwise([*np.arange(start, end - 1e-9, _BRICK[0]), end])


def _wall(courses: Iterable[Sequence[float]]) -> tuple[Block, ...]:
    return wall(list(courses), _WIDTH, _HEIGHT, _HEIGHT, _STONE)


def _with_windows(names: Mapping[str, list[float]], order: str) -> tuple[Block, ...]:
    """Return a wall of courses (F: whole, W: with windows; e: of even ones, u: of uneven ones) from bottom to top."""
    return _wall(names[name] for name in order.split())


_WINDOW = "Wu We Wu We Wu"
_W03: dict[str, list[float]] = {
    "Fe": [1] * 4,
    "Fu": [0.5, 1, 1, 1, 0.5],
    "We": [1, 0.5, -1, 0.5, 1],
    "Wu": [0.5, 1, -1, 1, 0.5],
}
_W04: dict[str, list[float]] = {
    "Fe": [0.5, 1, 1, 1, 1, 0.5],
    "Fu": [1] * 5,
    "Wu": [1, -1, 1, -1, 1],
    "We": [0.5, 0.5, -1, 0.5, 0.5, -1, 0.5, 0.5],
}
_W05: dict[str, list[float]] = {
    "Fe": [0.5, 1, 1, 0.5],
    "Fu": [1] * 3,
    "Wu": [1, -1, 1],
    "We": [0.5, 0.5, -1, 0.5, 0.5],
}
_W06: dict[str, list[float]] = {
    "Fe": [0.5, *[1] * 6, 0.5],
    "Fu": [1] * 7,
    "Wu": [0.5, 1, -1, 1, 1, -1, 1, 0.5],
    "We": [1, 0.5, -1, 0.5, 1, 0.5, -1, 0.5, 1],
}
_TWO_STOREYS = f"Fe Fu Fe {_WINDOW} Fe Fu Fe {_WINDOW} Fe Fu Fe"
_SIX = f"Fe Fu Fe Fu {_WINDOW} Fu Fe Fu {_WINDOW} Fu Fe Fu Fe"
_ONE_STOREY = f"Fe Fu Fe {_WINDOW} Fe Fu Fe"

WALLS: Mapping[str, LimitCase] = {
    name: LimitCase(blocks, stones, FRICTION, _ALONG, bound, candidate)
    for name, blocks, stones, bound, candidate in (
        ("W01", partial(_wall, bond(5, 6, halves_first=True)), 33, 0.64286, 0.64),
        ("W02", partial(_wall, bond(5, 10, halves_first=True)), 55, 0.58, 0.563),
        ("W03", partial(_with_windows, _W03, _ONE_STOREY), 46, 0.40369, 0.356),
        ("W04", partial(_with_windows, _W04, _ONE_STOREY), 55, 0.33195, 0.264),
        ("W05", partial(_with_windows, _W05, _TWO_STOREYS), 61, 0.23964, 0.215),
        ("W06", partial(_with_windows, _W06, _SIX), 146, 0.34782, 0.297),
    )
}
"""The walls of Ferris & Tin-Loi (2001), after Gilbert et al. (2006) and HybriDFEM."""

FACADES: Mapping[str, LimitCase] = {
    f"{stones} × {courses}, {returns}, {friction:g}, {way}": facade_case(
        stones, courses, returns, friction, way, bound
    )
    for stones, courses, returns, friction, way, bound in (
        (4, 6, 0, 0.7, "out", 0.2381),
        (4, 6, 0, 0.7, "in", 0.2381),
        (6, 10, 0, 0.7, "out", 0.14286),
        (6, 10, 0, 0.7, "in", 0.14286),
        (4, 6, 2, 0.7, "out", 0.59992),
        (4, 6, 2, 0.7, "in", 0.68301),
        (4, 10, 2, 0.7, "out", 0.41715),
        (4, 10, 2, 0.7, "in", 0.65024),
        (6, 10, 3, 0.7, "out", 0.46866),
        (6, 10, 3, 0.7, "in", 0.60397),
        (4, 6, 2, 0.4, "out", 0.4),
        (4, 10, 2, 0.4, "out", 0.39076),
        (4, 6, 2, 0.6, "out", None),
    )
}
"""Façades by stones × courses, length of the returns in stones, friction, and the way of the push (W09)."""
