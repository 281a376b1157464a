"""First-order change of a limit load with the friction of the joints and the depth of the stones.

The mechanism of the bound, at the speed at which the live load has unit power, gives λ as the power that its joints
and the dead load take. The programme is at its optimum there, so that to first order neither its forces nor its
velocities count in the change of λ: with the sliding velocities u_T and the normal forces f_N of the contacts

    μ dλ/dμ = Σ μ (f_N + s) |u_T|,

and if all stones grow deeper by a share, about their centres along the direction o, weights and strengths with them,

    d dλ/dd = -Σ ω·((r·o) o × f),

over both stones of each contact, with the lever r of its force f on the stone, which turns with ω.
"""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.contact.contacts import material_points
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.limit_load import LimitLoad
from mechanics.limit.live_loads import Acceleration


@dataclass(frozen=True)
class Sensitivity:
    """Relative change of a limit load for a relative change of what it rests on.

    Attributes
    ----------
    friction : d ln λ / d ln μ, of all joints together [-]
    depth : d ln λ / d ln d, of all stones together; None where no direction of the depth is known [-]
    """

    friction: float
    depth: float | None


def sensitivity(
    on: RigidAssembly, live: Acceleration, bound: LimitLoad, outwards: Array | None
) -> Sensitivity | None:
    """Return how a bound changes; None where nothing limits the load.

    Parameters
    ----------
    on, live, bound : with associative friction
    outwards : (3,) direction of the stones' depth; None: not known
    """
    velocity = bound.mechanism.velocity
    power = float(live(on) @ velocity[on.free].ravel())
    if not np.isfinite(bound.multiplier) or bound.multiplier <= 0.0 or power <= 0.0:
        return None
    arms = material_points(on.contacts, on.state) - on.state.centre[on.contacts.bodies]
    moving = velocity[on.contacts.bodies]
    speeds = moving[..., :3] + np.cross(moving[..., 3:], arms)
    slip = np.einsum("cij,cj->ci", on.contacts.frame, speeds[:, 0] - speeds[:, 1])[:, 1:]
    strength = on.strength
    rubbed = strength.friction * (bound.force[:, 0] + strength.tension) * np.linalg.norm(slip, axis=1)
    scale = power * bound.multiplier
    return Sensitivity(
        float(rubbed.sum()) / scale,
        None if outwards is None else _deeper(on, bound.force, moving[..., 3:], arms, outwards) / scale,
    )


def _deeper(on: RigidAssembly, force: Array, spin: Array, arms: Array, outwards: Array) -> float:
    """Return the power that levers longer along a direction, each by its length, take from the mechanism [W].

    Parameters
    ----------
    force : (nc, 3) on the candidates, local frames [N]
    spin, arms : (nc, 2, 3) of both stones [rad/s], [m]
    """
    on_candidate = np.einsum("cij,ci->cj", on.contacts.frame, force)
    forces = np.stack([on_candidate, -on_candidate], axis=1)
    longer = (arms @ outwards)[..., None] * outwards
    return -float(np.sum(spin * np.cross(longer, forces)))
