"""Least and greatest thrust on supports, over all states of equilibrium within the strength of the joints.

The push of a structure on its supports along a direction d lies between two extremes that hold for every state of
equilibrium, whatever the flow: both are rigorous. The structure is in the state of least thrust as the supports yield
along d, with the mechanism that the extreme comes with; in that of greatest thrust as they push back (Heyman 1966).
A settlement is the first with d the way of the support, and its extreme the support's least reaction.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.limit_load import Mechanism, mechanism
from mechanics.limit.programme import Ending, Programme

# thrust over the weight that counts as none [-]
_THRUST_ROUNDING = 1e-8


@dataclass(frozen=True)
class Extreme:
    """State of least or greatest thrust.

    Attributes
    ----------
    value : push of the structure on the supports along the direction; infinite where nothing limits it, NaN where
        the dead load cannot be balanced [N]
    force : (nc, 3) on the candidate of each contact, local frame [N]
    mechanism : as the supports yield along the direction, or push back
    """

    value: float
    force: Array
    mechanism: Mechanism


@dataclass(frozen=True)
class Thrust:
    """Range of the thrust on supports.

    Attributes
    ----------
    supports : their codes
    direction : (3,) unit vector [-]
    least, greatest : the extremes
    """

    supports: tuple[str, ...]
    direction: tuple[float, float, float]
    least: Extreme
    greatest: Extreme


def thrust(on: RigidAssembly, supports: Sequence[str], direction: tuple[float, float, float]) -> Thrust:
    """Return the range of the thrust that stones give to some fixed ones, along a direction of any length.

    Raises
    ------
    SceneError : a support is unknown or not fixed, no joint meets the supports, or the direction is zero
    SolverError : Clarabel is not installed, or came to no answer
    """
    where = f"thrust on {', '.join(supports)}"
    bodies = on.rows(supports, where)
    free = [on.model.scene.blocks[body].code for body in bodies if not on.model.fixed[body]]
    if free:
        raise SceneError(f"{free[0]} is not fixed", where=where, remedy="give stones that are fixed")
    unit, length = np.asarray(direction, dtype=float), float(np.linalg.norm(direction))
    if not np.isfinite(length) or length == 0:
        raise SceneError(
            f"direction = {list(direction)}", where=where, remedy="give three numbers, not all zero"
        )
    unit = unit / length
    push = on.push(bodies)
    if not push.nnz:
        raise SceneError("no joint meets the supports", where=where, remedy="give those that carry stones")
    cost = (push.T @ unit).reshape(-1, 3)
    programme, moving = Programme(on, None, where), np.zeros((len(on.model.mass), 6))
    moving[bodies, :3] = unit
    x, y, z = unit.tolist()
    return Thrust(
        tuple(supports),
        (x, y, z),
        _extreme(on, programme, cost, moving),
        _extreme(on, programme, -cost, -moving, sign=-1.0),
    )


def _extreme(
    on: RigidAssembly, programme: Programme, cost: Array, moving: Array, sign: float = 1.0
) -> Extreme:
    """Minimise cost · f; the supports move by `moving` (nb, 6) then."""
    optimum = programme.solve(on.strength, cost=cost)
    # what rounding leaves of the weight is no thrust
    total = float((cost * optimum.force).sum())
    total = total if abs(total) > _THRUST_ROUNDING * on.weight else 0.0
    value = {Ending.NO_BALANCE: np.nan, Ending.ENDLESS: -np.inf}.get(optimum.ending, total)
    still = optimum.ending is not Ending.FOUND
    return Extreme(
        sign * value + 0.0,
        optimum.force,
        mechanism(on, optimum.velocity, np.zeros_like(moving) if still else moving),
    )
