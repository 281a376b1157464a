"""Local deformation of a sample between two instants, from triangles that follow the disks."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.planar.measures.tessellation import Tessellation


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
