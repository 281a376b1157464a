"""Fabric of groups of disks: directions and number of contacts, and the room between disks."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.planar.measures.tessellation import Tessellation

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
        (low, high), axes = np.linalg.eigh(tensor)
        anisotropy = 2.0 * float(high - low)
        direction = float(np.arctan2(axes[1, 1], axes[0, 1]))
        direction -= np.pi * np.round(direction / np.pi)
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
