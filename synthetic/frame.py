"""Frame of the wall in the site, and the true stones in space."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from random import Random

import numpy as np

from survey.arrays import Array
from survey.extrusion.extrusion import prism
from survey.geometry.solids import Solid
from synthetic.bond import PlannedStone

ORIGIN = (12.4, 38.25, 6.83)  # foot of the window's axis in the local site frame [m]
AZIMUTH = math.radians(7.0)  # of the wall against the x axis
BATTER = math.radians(0.3)
"""Angle by which walls lean back from the observer [rad]."""
RELIEF = 0.002  # standard deviation of a face's distance from the wall plane [m]
FACE_TILT = math.radians(0.15)  # standard deviation of each tilt of a face against the wall plane


@dataclass(frozen=True)
class RigidMotion:
    """Motion of a stone since it was laid, x → rotation x + shift.

    Attributes
    ----------
    rotation : (3, 3) [-]
    shift : (3,) of the origin of the site [m]
    """

    rotation: Array
    shift: Array

    def place(self, points: Array) -> Array:
        """Return the places (n, 3) to which points (n, 3) have moved."""
        moved: Array = points @ self.rotation.T + self.shift
        return moved


Movement = Mapping[str, RigidMotion]
"""Motions of stones by code; stones without one have stayed."""


@dataclass(frozen=True)
class WallFrame:
    """Right-handed frame of the wall plane in the site: x = origin + s axes[0] + t axes[1] + depth axes[2].

    Attributes
    ----------
    origin : (3,) [m]
    axes : (3, 3) rows: along the wall to the right, up the wall, outward normal [-]
    """

    origin: Array
    axes: Array

    def place(self, flat: Array, out: float = 0.0) -> Array:
        """Place points (n, 2) of the wall plane, moved out by `out` [m], in the site (n, 3)."""
        placed: Array = self.origin + flat @ self.axes[:2] + out * self.axes[2]
        return placed

    def moved(self, motion: RigidMotion) -> "WallFrame":
        """Return the frame as it has moved with a stone."""
        return WallFrame(motion.place(self.origin[None])[0], self.axes @ motion.rotation.T)


@dataclass(frozen=True)
class TrueStone:
    """A stone in its true geometry, joints closed.

    Attributes
    ----------
    plan : its outline in the wall plane
    normal, offset : true plane n·x = d of its face
    depth : [m]
    solid : hexahedron: side planes perpendicular to the wall, its own face, that face moved by -depth n
    """

    plan: PlannedStone
    normal: Array
    offset: float
    depth: float
    solid: Solid

    def on_face(self, frame: WallFrame, flat: Array) -> Array:
        """Move points (n, 2) of the wall plane square to the wall onto the true face."""
        placed = frame.place(flat)
        lift = (self.offset - placed @ self.normal) / (frame.axes[2] @ self.normal)
        out: Array = placed + np.outer(lift, frame.axes[2])
        return out

    def moved(self, motion: RigidMotion) -> "TrueStone":
        """Return the stone where it has moved to."""
        normal = motion.rotation @ self.normal
        solid = replace(self.solid, vertices=motion.place(self.solid.vertices))
        return replace(self, normal=normal, offset=self.offset + float(normal @ motion.shift), solid=solid)


def wall_frame(batter: float = BATTER) -> WallFrame:
    """Lay the wall's frame: turned about the vertical, then leaning back by an angle [rad]."""
    along = np.array([math.cos(AZIMUTH), math.sin(AZIMUTH), 0.0])
    facing, vertical = np.array([along[1], -along[0], 0.0]), np.array([0.0, 0.0, 1.0])
    up = math.cos(batter) * vertical - math.sin(batter) * facing
    out = math.cos(batter) * facing + math.sin(batter) * vertical
    return WallFrame(np.array(ORIGIN), np.array([along, up, out]))


def build_stone(plan: PlannedStone, depth: float, frame: WallFrame, rng: Random) -> TrueStone:
    """Give a planned stone its own face plane, near the wall's, and its depth."""
    tilt_s, tilt_t = rng.gauss(0.0, FACE_TILT), rng.gauss(0.0, FACE_TILT)
    normal = frame.axes[2] + math.tan(tilt_s) * frame.axes[0] + math.tan(tilt_t) * frame.axes[1]
    normal /= math.sqrt(float(normal @ normal))
    centre = frame.place(plan.corners.mean(axis=0), rng.gauss(0.0, RELIEF))
    offset = float(normal @ centre)
    corners = frame.place(plan.corners)
    square = float(frame.axes[2] @ normal)
    front = corners + np.outer((offset - corners @ normal) / square, frame.axes[2])
    back = corners + np.outer((offset - depth - corners @ normal) / square, frame.axes[2])
    return TrueStone(plan, normal, offset, depth, prism(plan.code, front, back))
