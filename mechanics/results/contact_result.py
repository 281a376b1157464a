"""Contact results of a simulation: point by point, and joint by joint."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechanics.arrays import Array, Bools, Ints

_LIMIT_ROUNDING = 1e-9  # by which rounding may take a number beyond its limit of 1 [-]


@dataclass(frozen=True)
class ContactResult:
    """The contact points at one instant.

    Attributes
    ----------
    bodies : (nc, 2) indices into the scene's blocks: candidate, antagonist
    point : (nc, 3) [m]
    normal : (nc, 3) from antagonist to candidate [-]
    force : (nc, 3) mean force over the last step, on the candidate, world axes [N]
    gap : (nc,) [m]
    area : (nc,) tributary area; zero between edges [m²]
    pressure : (nc,) normal force over area; NaN between edges [Pa]
    opening : (nc,) growth of its gap since the start [m]
    slide : (nc,) displacement of its two material points along each other since the start [m]
    status : (nc,) "open", "stick", "slip", "bonded", "broken" or "crush"
    joint : (nc,) its joint; -1 without one, as between edges
    """

    bodies: Ints
    point: Array
    normal: Array
    force: Array
    gap: Array
    area: Array
    pressure: Array
    opening: Array
    slide: Array
    status: NDArray[np.str_]
    joint: Ints


@dataclass(frozen=True)
class JointResult:
    """The joints at the end of the run: pairs of flat faces of two stones that touch, or that touched at the start.

    Attributes
    ----------
    bodies : (nj, 2) indices into the scene's blocks, the lower first
    parted : (nj,) closed at the start, and now open beyond the distance at which contacts are watched; its polygon is
        that of the start, carried along by the second stone
    polygon : the common polygon of both faces, (k, 3) corners for each joint [m]
    frame : (nj, 3, 3) rows n, t1, t2; n from the second to the first stone, t1 along the larger second moment [-]
    centroid : (nj, 3) of the polygon [m]
    area : (nj,) [m²]
    sliver : (nj,) its area is not above `mechanics.results.joints.SLIVER` of the faces of its stones: its force counts,
        its pressure, eccentricity and kern say nothing of the masonry
    force : (nj, 3) resultant on the first stone, world axes [N]
    moment : (nj, 3) about the centroid [N m]
    centre_of_pressure : (nj, 3) intersection of the resultant with the joint; NaN without compression [m]
    eccentricity : (nj, 2) the same from the centroid, along t1 and t2; NaN without compression [m]
    kern : (nj,) largest tension of a linear pressure with this resultant, over the mean pressure: 0 if centred, up to 1
        within the kern; NaN without compression [-]
    edge : (nj,) distance of the centre of pressure from the centroid, 0, relative to the edge, 1; NaN without
        compression [-]
    pressure_mean : (nj,) compression over area; negative: tension [Pa]
    pressure_max : (nj,) largest around a contact point, as `patch_pressure` defines it [Pa]
    gap : (nj,) largest gap, not less than zero [m]
    opening : (nj,) largest growth of the gap since the start; the gap itself of joints that were not there then [m]
    sliding : (nj,) largest slide of a contact point since the start [m]
    slipping, open : (nj,) part of the area of the watched contact points that slips, or that carries no force [-]
    friction_use : (nj,) shear force over the capacity of friction and cohesion; NaN without capacity [-]
    """

    bodies: Ints
    parted: Bools
    polygon: tuple[Array, ...]
    frame: Array
    centroid: Array
    area: Array
    sliver: Bools
    force: Array
    moment: Array
    centre_of_pressure: Array
    eccentricity: Array
    kern: Array
    edge: Array
    pressure_mean: Array
    pressure_max: Array
    gap: Array
    opening: Array
    sliding: Array
    slipping: Array
    open: Array
    friction_use: Array

    def __len__(self) -> int:
        return len(self.bodies)

    @property
    def pressed(self) -> Bools:
        """(nj,) true for joints under compression."""
        return np.isfinite(self.kern)

    @property
    def bearing(self) -> Bools:
        """(nj,) true for joints under compression that are not slivers."""
        return self.pressed & ~self.sliver

    @property
    def in_kern(self) -> Bools:
        """(nj,) true for joints under compression within the kern."""
        inside: Bools = self.kern <= 1.0 + _LIMIT_ROUNDING
        return inside
