"""Buildings that have moved, each with the cause of its movement and with what else may have caused it."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from survey.arrays import Array
from synthetic.building import SyntheticBuilding
from synthetic.buildings.facings import two_facings
from synthetic.buildings.tower import tower_storey
from synthetic.buildings.walls import wall
from synthetic.frame import Movement, wall_frame

_REACH = 2.5  # distance from the corner of the tower at which its settlement ends [m]
_HEADS = 0.75  # share of the courses of the tower below the heads of its walls
PULSE = (0.05, 0.25)
"""Times after which the velocity of an earthquake pulse is at its peak and over; it is linear between them [s]."""

_THICK = 1.6  # wall of two facings with a core that has sunk [m]
_UPPER = 1.1  # its upper part, which stands on the first facing and the core [m]
_TIED = 1.0  # depth beyond which a stone goes through the wall [m]


@dataclass(frozen=True)
class MovedBuilding:
    """A building at the time of its movement, with what may have moved it.

    Attributes
    ----------
    building : measured
    settled : by code or query expression of stones on the ground their share of the settlement of the left corner, or
        of the core, which is the cause [-]
    rival : the same of the right corner, or of the left one beside a core; empty if that is not suspected
    axis : (3,) about which the base may have tilted [-]
    pushed : by code or query expression of stones the direction (3,) in which the thrust of a vault may have pushed
        them; empty if there is no vault
    jerked : (3,) in which the ground jerked; None if that is not suspected
    core : course of the core on which the stones above stand, and which is what has settled; None: no core
    level_break : last course of the first phase of a building that stood as a whole; None: it has one phase
    """

    building: SyntheticBuilding
    settled: Mapping[str, float]
    rival: Mapping[str, float]
    axis: Array
    pushed: Mapping[str, Array] = field(default_factory=dict)
    jerked: Array | None = None
    core: int | None = None
    level_break: int | None = None


@dataclass(frozen=True)
class Cause:
    """Settlement of a corner or a core, thrust of a vault or earthquake pulse, and the building that it moves.

    Attributes
    ----------
    settlement : of the ground at the corner, or of the core, downwards [m]
    build : the building after a movement; the same is measured again with the seed that may be given
    duration : of the settlement in the scene [s]
    step : of the scene [s]
    stood : last course that stood when the ground settled; those above were laid later, level, in a phase of their
        own; None: all stood
    thrust : with which a vault pushes each of `MovedBuilding.pushed` [N]
    most : thrust that a diagnosis considers [N]
    pulse : peak velocity of the ground along `MovedBuilding.jerked`; the motion itself is followed then [m/s]
    friction : of all joints [-]
    stiffness : across and along the joints, per area; None: rigid joints [Pa/m]
    battered : the walls may have been built leaning
    true_duration, true_step : of the simulation of the truth [s]
    """

    settlement: float
    build: Callable[[Movement, int | None], MovedBuilding]
    duration: float = 1.0
    step: float = 0.005
    stood: int | None = None
    thrust: float = 0.0
    most: float = 2000.0
    pulse: float = 0.0
    friction: float = 0.6
    stiffness: tuple[float, float] | None = None
    battered: bool = True
    true_duration: float = 1.0
    true_step: float = 0.005

    @property
    def amount(self) -> float:
        """Amount of the cause, in the unit of the true hypothesis."""
        return self.pulse or self.thrust or self.settlement

    def heights(self, site: MovedBuilding) -> dict[str, float]:
        """Return by code of a stone on the ground its displacement upwards [m]."""
        if not self.settlement:
            return {}
        return {code: round(-self.settlement * share, 6) for code, share in site.settled.items()}

    def forces(self, site: MovedBuilding) -> dict[str, tuple[float, float, float]]:
        """Return by code of a stone the force of the vault [N]."""
        if not self.thrust:
            return {}
        outward = {code: np.round(self.thrust * out, 3) + 0.0 for code, out in site.pushed.items()}
        return {code: (float(x), float(y), float(z)) for code, (x, y, z) in outward.items()}

    def jerk(self, site: MovedBuilding) -> tuple[float, float, float] | None:
        """Return the peak velocity (3,) of the ground, if it has jerked [m/s]."""
        if not self.pulse or site.jerked is None:
            return None
        x, y, z = (np.round(self.pulse * site.jerked, 6) + 0.0).tolist()
        return x, y, z


def _moved_wall(stones: int, shares: Sequence[float]) -> Callable[[Movement, int | None], MovedBuilding]:
    """Return the generator of a wall that has moved, with shares of the settlement from its corner inwards."""

    def build(movement: Movement, measured: int | None) -> MovedBuilding:
        built = wall(stones, movement=movement, measured=measured)
        settled, rival = (dict(zip(codes, shares, strict=False)) for codes in (built.base, built.base[::-1]))
        return MovedBuilding(built, settled, rival, wall_frame().axes[2])

    return build


def _pushed_wall(stones: int, shaken: bool = False) -> Callable[[Movement, int | None], MovedBuilding]:
    """Return the generator of a plumb wall against which a vault leans below its uppermost course."""

    def build(movement: Movement, measured: int | None) -> MovedBuilding:
        built = wall(stones, batter=0.0, movement=movement, measured=measured)
        frame = wall_frame(0.0)
        last = max(block.course or 0 for block in built.survey.blocks)
        pushed = {block.code: frame.axes[2] for block in built.survey.blocks if block.course == last - 1}
        settled = dict(zip(built.base, (1.0, 0.5), strict=False))
        inward = -frame.axes[2] if shaken else None
        return MovedBuilding(built, settled, {}, frame.axes[0], pushed, inward)

    return build


def _core_sunk(length: float, lower: int, upper: int) -> Callable[[Movement, int | None], MovedBuilding]:
    """Return the generator of a plumb wall whose upper courses stand on a facing and on a core that has sunk."""

    def build(movement: Movement, measured: int | None) -> MovedBuilding:
        built = two_facings(
            length,
            lower + upper,
            thickness=_THICK,
            storeys=1,
            upper=(upper, _UPPER),
            batter=0.0,
            movement=movement,
            measured=measured,
        ).building
        ground = tuple(block.code for block in built.survey.blocks if (block.course or 0) <= lower)
        core = {f"kind = infill and course = {lower}": 1.0}
        corner = [code for code in ground if code.startswith(f"F{lower:02d}")][:2]
        rival = dict(zip(corner, (1.0, 0.5), strict=False))
        return MovedBuilding(replace(built, base=ground), core, rival, wall_frame(0.0).axes[0], core=lower)

    return build


def _around(building: SyntheticBuilding, corner: Array) -> dict[str, float]:
    """Return shares of a settlement that falls off linearly from a corner of a building."""
    solids = {solid.code: solid for solid in building.solids}
    shares = {}
    for code in building.base:
        apart = solids[code].vertices.mean(axis=0) - corner
        share = 1.0 - math.hypot(apart[0], apart[1]) / _REACH
        if share > 0.0:
            shares[code] = round(share, 3)
    return shares


SETTLED = Cause(0.030, _moved_wall(90, (1.0, 2.0 / 3.0, 1.0 / 3.0)))
SETTLED_SMALL = Cause(0.030, _moved_wall(30, (1.0, 0.5)), 0.5, 0.02)
SETTLED_PHASES = Cause(0.020, _moved_wall(42, (1.0, 0.5)), 0.5, 0.02, stood=3)

PUSHED = Cause(
    0.0,
    _pushed_wall(60),
    0.5,
    0.05,
    thrust=900.0,
    most=1200.0,
    stiffness=(5e8, 2e8),
    battered=False,
    true_step=0.02,
)
CORE_SUNK = Cause(0.020, _core_sunk(2.6, 3, 3), 0.5, 0.01, battered=False)
SHAKEN = Cause(
    0.0,
    _pushed_wall(30, shaken=True),
    0.5,
    0.01,
    most=600.0,
    pulse=0.5,
    friction=0.3,
    battered=False,
    true_step=0.01,
)


def tower_settled(courses: int) -> Cause:
    """Return the settlement of the left corner of a storey of the tower."""

    def build(movement: Movement, measured: int | None) -> MovedBuilding:
        storey = tower_storey(courses, movement=movement, measured=measured)
        # through stones below the uppermost courses, which alone tie the facings
        tied = f"depth > {_TIED} and course > {round(_HEADS * courses)}"
        pushed = {f"zone = '{letter} outer' and {tied}": storey.outward[letter] for letter in "BC"}
        laid = tower_storey(courses) if movement else storey
        settled = _around(laid.building, storey.corners[0])
        return MovedBuilding(
            storey.building, settled, {}, storey.outward["A"], pushed, level_break=storey.level_break
        )

    # what joints give way is larger in longer steps: the scene's are those of the truth
    return Cause(0.030, build, 0.2, 0.025, battered=False, true_duration=0.2, true_step=0.025)
