"""Mean stress in groups of disks, from the forces at their contacts."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Ints


@dataclass(frozen=True)
class Stress:
    """Mean Cauchy stress, compression positive.

    Attributes
    ----------
    tensor : σ (2, 2), its symmetric part [Pa]
    pressure : p = (σ1 + σ2)/2 [Pa]
    deviator : q = (σ1 - σ2)/2 [Pa]
    direction : angle of the larger principal stress from the x axis, within ± π/2 [rad]
    """

    tensor: Array
    pressure: float
    deviator: float
    direction: float


def moments(count: int, centre: Array, bodies: Ints, point: Array, force: Array) -> Array:
    """Return the internal moment (nd, 2, 2) of each disk, compression positive [N m].

        M_i = -Σ f ⊗ (x - x_i)   over the contacts of disk i, with the force f on it at the point x

    (Moreau 1997; Staron, Radjai & Vilotte 2005). Moments add up over disks: a contact between two disks of a group
    gives f ⊗ l with the vector l between their centres, so that the sum over the area of the group is the mean stress
    of Love and Weber, and of Renouf, Dubois & Alart (2006, eq. 7); one with a disk outside gives the part of l within.

    Parameters
    ----------
    count : number of disks nd; bodies with larger numbers are walls
    centre : (nb, 2) [m]
    bodies : (nc, 2) candidate and antagonist
    point : (nc, 2) [m]
    force : (nc, 2) on the candidate [N]
    """
    total = np.zeros((count, 4))
    for side, sign in ((0, -1.0), (1, 1.0)):
        body = bodies[:, side]
        acting = body < count
        arm = point[acting] - centre[body[acting]]
        dyad = (sign * force[acting])[:, :, None] * arm[:, None, :]
        for index, values in enumerate(dyad.reshape(-1, 4).T):
            total[:, index] += np.bincount(body[acting], values, minlength=count)
    return total.reshape(count, 2, 2)


def mean_stress(moment: Array, area: float, thickness: float = 1.0) -> Stress:
    """Return the mean stress of disks with these moments (n, 2, 2) in an area [m²] of a slice [m]."""
    mean = moment.sum(axis=0) / (area * thickness)
    tensor = 0.5 * (mean + mean.T)
    (low, high), axes = np.linalg.eigh(tensor)
    angle = float(np.arctan2(axes[1, 1], axes[0, 1]))
    # axes have no sign
    angle -= np.pi * np.round(angle / np.pi)
    return Stress(tensor, 0.5 * float(low + high), 0.5 * float(high - low), angle)
