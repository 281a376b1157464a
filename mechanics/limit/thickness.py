"""Geometric safety factor: by how much all joints may shrink about their centres until the stones fall.

An arch of the thickness t stands while a line of thrust lies within a thinner arch of the same centreline and weight;
t over the least such thickness is Heyman's geometric factor of safety (Heyman 1982). The contact points of each joint
are drawn towards its centroid, to the share at which no forces balance the dead load any more.

The weights stay where they are. So the factor of an arch at its least thickness is 1 exactly, and that of a thicker one
differs a little from t over the thickness at which its thinned stones, with their own weights, would fall.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_array, csr_array

from mechanics.arrays import Array
from mechanics.limit.assembly import RigidAssembly
from mechanics.limit.limit_load import Mechanism, mechanism
from mechanics.limit.programme import Programme

# share of the width of joints to which its least value is found [-]
_WIDTH_ACCURACY = 1e-4
# part of the largest load on a stone that forces may lack [-]
_LACKING = 1e-5


@dataclass(frozen=True)
class GeometricSafety:
    """Geometric factor of safety.

    Attributes
    ----------
    share : least share of the widths of all joints at which the stones stand; 0: also where they meet in points,
        NaN: not even as they are [-]
    force : (nc, 3) at it, on the candidate of each contact, local frame [N]
    mechanism : of the stones when joints are smaller still
    """

    share: float
    force: Array
    mechanism: Mechanism

    @property
    def factor(self) -> float:
        """The factor, 1/share; infinite where joints may shrink to points [-]."""
        return float("inf") if self.share == 0.0 else 1.0 / self.share


def geometric_safety(on: RigidAssembly, widest: float = 1.0) -> GeometricSafety:
    """Return the geometric factor of safety of an assembly under its dead load.

    With a `widest` share beyond 1, joints of stones that fall are widened until they would stand.

    Raises
    ------
    SolverError : Clarabel is not installed, or came to no answer
    """
    force, fallen = _stands(on, widest)
    if fallen is not None:
        return GeometricSafety(float("nan"), force, fallen)
    at_points, fallen = _stands(on, 0.0)
    if fallen is None:
        return GeometricSafety(0.0, at_points, mechanism(on, np.zeros((len(on.free), 6))))
    low, high = 0.0, widest
    while high - low > _WIDTH_ACCURACY * high:
        share = 0.5 * (low + high)
        at_share, falls = _stands(on, share)
        if falls is None:
            high, force = share, at_share
        else:
            low, fallen = share, falls
    return GeometricSafety(high, force, fallen)


def _stands(on: RigidAssembly, share: float) -> tuple[Array, Mechanism | None]:
    """Return forces that balance the dead load with joints of a share of their widths; else how the stones fall."""
    shortfall = Programme(shrunk(on, share), None, "geometric safety").shortfall(on.strength)
    return shortfall.force, mechanism(on, shortfall.velocity) if shortfall.multiplier > _LACKING else None


def shrunk(on: RigidAssembly, share: float) -> RigidAssembly:
    """Return the assembly with the points of each joint drawn towards its centroid; points without a joint stay."""
    joints, contacts = on.joints, on.contacts
    shift = (share - 1.0) * (joints.point - joints.section.centroid[joints.joint])
    shift[joints.joint < 0] = 0.0
    row = np.full(len(on.model.mass), -1)
    row[on.free] = np.arange(len(on.free))
    lift = csr_array(on.lift.shape)
    for side, sign in ((0, 1.0), (1, -1.0)):
        body = row[contacts.bodies[:, side]]
        chosen = np.flatnonzero(body >= 0)
        # moments of the unit forces n, t1 and t2 by the shift of their point
        moment = sign * np.cross(shift[chosen, None], contacts.frame[chosen])
        at = 6 * body[chosen, None, None] + 3 + np.arange(3)[None, None, :]
        of = 3 * chosen[:, None, None] + np.arange(3)[None, :, None]
        at, of = np.broadcast_arrays(at, of)
        lift = lift + csr_array((moment.ravel(), (at.ravel(), of.ravel())), shape=on.lift.shape)
    return replace(on, lift=csc_array(on.lift + lift))
