"""The scenes on which the errors of profiles are measured, and others on which they must hold."""

from collections.abc import Callable, Mapping

from benchmarks.masonry import flying_arch, pier, trilith, two_spans
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Scene, Start, TimeSettings
from mechanics.scene.shapes import bond, column, semicircular_arch, wall

__all__ = ["HELD_OUT", "REFERENCE"]

_GRAVITY, _FRICTION = 9.81, 0.65
# an opening of one stone, three courses high, under a lintel of two
_OPENING: list[list[float]] = [
    [0.5, 1, 1, 1, 0.5],
    [1, 1, 1, 1],
    [0.5, 1, -1, 1, 0.5],
    [0.75, 0.75, -1, 0.75, 0.75],
    [0.5, 1, -1, 1, 0.5],
    [1, 2, 1],
    [0.5, 1, 1, 1, 0.5],
    [1, 1, 1, 1],
]


def _scene(name: str, blocks: tuple[Block, ...], sideways: float = 0.0) -> Scene:
    """At rest from the start; `sideways` is a part of the weight that pushes along x."""
    return Scene(
        name,
        blocks,
        gravity=(sideways * _GRAVITY, 0.0, -_GRAVITY),
        contact=ContactSettings(DryJoint(_FRICTION)),
        time=TimeSettings(start=Start.EQUILIBRIUM, relaxation=True),
    )


REFERENCE: Mapping[str, Callable[[], Scene]] = {
    "running bond": lambda: _scene(
        "running bond", wall(bond(4, 6, halves_first=True), 0.5, 0.25, 0.3, slab=False), 0.15
    ),
    "pier": lambda: _scene("pier", pier()),
    "two spans": lambda: _scene("two spans", two_spans()),
    "flying arch": lambda: _scene("flying arch", flying_arch()),
    "trilith": lambda: _scene("trilith", trilith()),
    "pinnacle": lambda: _scene("pinnacle", column(4, 0.7, 0.45, top=0.35, sides=6), 0.08),
}
"""Those that the estimates were fitted to."""

HELD_OUT: Mapping[str, Callable[[], Scene]] = {
    "arch": lambda: _scene("arch", semicircular_arch(11, 0.3, 1.2)),
    "wall with opening": lambda: _scene("wall with opening", wall(_OPENING, 0.6, 0.3, 0.4, slab=False)),
    "column": lambda: _scene("column", column(6, 0.8, 0.5, top=0.6), 0.05),
}
"""Those that nothing was fitted to."""
