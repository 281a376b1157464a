"""Tensors of groups of disks: mean stress from contact forces, deformation between two instants, fabric of contacts."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.planar.measures.tessellation import Tessellation


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
    low, high, angle = _principal(tensor)
    return Stress(tensor, 0.5 * (low + high), 0.5 * (high - low), angle)


def _principal(tensor: Array) -> tuple[float, float, float]:
    """Return the principal values, the lower first, and the angle of the axis of the higher, within ± π/2 [rad]."""
    (low, high), axes = np.linalg.eigh(tensor)
    angle = float(np.arctan2(axes[1, 1], axes[0, 1]))
    return float(low), float(high), angle - np.pi * np.round(angle / np.pi)  # axes have no sign


@dataclass(frozen=True)
class DiskDeformation:
    """Deformation at each disk, the mean over its triangles by area; nan where it has none.

    Attributes
    ----------
    gradient : F (nd, 2, 2) [-]
    volume : det F - 1 (nd,) [-]
    shear : ln of the ratio of the principal stretches (nd,); shear bands are where it is large [-]
    """

    gradient: Array
    volume: Array
    shear: Array


def deformation(start: Array, now: Array, cells: Tessellation) -> DiskDeformation:
    """Return the deformation from the places (nd, 2) at the start, tessellated by `cells`, to those now [m].

    The displacement is linear in a triangle, so one of a triangle's three disks changes it by its distance over the
    triangle's height; means over the triangles of a disk take that scatter out.
    """
    corners = start[cells.triangles]
    before = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    corners = now[cells.triangles]
    after = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    local = (after @ np.linalg.inv(before)).reshape(-1, 4) * cells.area[:, None]
    count, disks = len(start), cells.triangles.ravel()
    weight = np.bincount(disks, np.repeat(cells.area, 3), minlength=count)
    total = np.stack(
        [np.bincount(disks, np.repeat(component, 3), minlength=count) for component in local.T], axis=1
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        gradient = (total / weight[:, None]).reshape(-1, 2, 2)
    volume = gradient[:, 0, 0] * gradient[:, 1, 1] - gradient[:, 0, 1] * gradient[:, 1, 0] - 1.0
    # principal stretches of a 2 × 2 matrix: s1 + s2 and s1 - s2 have closed forms
    summed = np.hypot(gradient[:, 0, 0] + gradient[:, 1, 1], gradient[:, 1, 0] - gradient[:, 0, 1])
    differing = np.hypot(gradient[:, 0, 0] - gradient[:, 1, 1], gradient[:, 1, 0] + gradient[:, 0, 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        shear = np.log((summed + differing) / np.abs(summed - differing))
    return DiskDeformation(gradient, volume, shear)


_BEARS = 1e-9  # of the mean force, that a contact bears [-]


@dataclass(frozen=True)
class Fabric:
    """State of a group of disks.

    Attributes
    ----------
    tensor : mean of n ⊗ n (2, 2) over the contacts that bear a force (Satake 1982) [-]
    anisotropy : 2 (φ1 - φ2) of its principal values; zero if contacts look into all directions alike [-]
    density : a = (f1 - f2)/2 of f = (1/area) Σ n ⊗ n over the contacts that bear a force (Renouf, Dubois & Alart 2006,
        eq. 9 and 10), which grows with the number of contacts in an area; nan where porosity is [1/m²]
    direction : angle of the larger one from the x axis, within ± π/2 [rad]
    coordination : contacts that bear a force per disk [-]
    porosity : share of the area that no disk fills; nan where no disk has triangles all around [-]
    """

    tensor: Array
    anisotropy: float
    density: float
    direction: float
    coordination: float
    porosity: float


def fabric_of(
    group: Bools, bodies: Ints, normal: Array, force: Array, radius: Array, cells: Tessellation
) -> Fabric:
    """Describe a group of disks.

    Parameters
    ----------
    group : (nd,) the disks
    bodies, normal, force : (nc, 2) of all contacts; bodies from nd on are walls
    radius : (nd,) [m]
    cells : of all disks
    """
    size = np.hypot(force[:, 0], force[:, 1])
    bears = size > _BEARS * (size.mean() if len(size) else 0.0)
    ends = _ends(group, bodies[bears])
    looks = normal[bears][ends > 0]
    weight = ends[ends > 0].astype(float)
    tensor = np.full((2, 2), np.nan)
    anisotropy = direction = np.nan
    if len(looks):
        tensor = np.einsum("c,ci,cj->ij", weight, looks, looks) / weight.sum()
        low, high, direction = _principal(tensor)
        anisotropy = 2.0 * (high - low)
    inner = group & cells.inside
    room = float(cells.share[inner].sum())
    filled = np.pi * float((radius[inner] ** 2).sum())
    return Fabric(
        tensor=tensor,
        anisotropy=anisotropy,
        density=_density(_ends(inner, bodies[bears]), normal[bears], room),
        direction=direction,
        coordination=float(ends.sum()) / max(1, int(group.sum())),
        porosity=1.0 - filled / room if room > 0 else np.nan,
    )


def _ends(group: Bools, bodies: Ints) -> Ints:
    """Return how many of the two bodies of each contact (nc,) are disks of a group (nd,)."""
    ends: Ints = np.append(group, False)[np.minimum(bodies, len(group))].sum(axis=1)
    return ends


def _density(ends: Ints, normal: Array, area: float) -> float:
    """Return a = (f1 - f2)/2; of a contact with one disk of the group a half counts, as in the stress."""
    if area <= 0:
        return np.nan
    low, high = np.linalg.eigvalsh(np.einsum("c,ci,cj->ij", 0.5 * ends, normal, normal) / area)
    return 0.5 * float(high - low)
