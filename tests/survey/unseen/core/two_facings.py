"""Small walls of two facings for the tests of the core, and checks that are independent of its construction."""

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from survey.extrusion.extrusion import prism
from survey.geometry.solids import Solid, area_vector
from survey.geometry.watertight import triangulate
from survey.unseen.core.facings import FacingStone
from synthetic.buildings.facings import TwoFacings
from synthetic.frame import wall_frame
from tests.survey.largest_ball import largest_ball

HALF = 0.5  # of the thickness of the wall [m]


def facing(rows, beds, *, back=False, joint=0.0, placed=None):
    """Return stones of one facing of a wall along x, whose front faces -y.

    rows: for each course (length, depth) of the stones from the left of the plan; a depth of None leaves a hole.
    """
    sign = -1.0 if back else 1.0
    stones = []
    for course, row in enumerate(rows, start=1):
        x = 0.0
        for number, (length, depth) in enumerate(row, start=1):
            left, right = x + joint, x + length - joint
            low, high = beds[course - 1] + joint, beds[course] - joint
            x += length
            if depth is None:
                continue
            flat = np.array([[left, low], [right, low], [right, high], [left, high]])[
                :: 1 if not back else -1
            ]
            front = np.column_stack([flat[:, 0], np.full(4, -sign * HALF), flat[:, 1]])
            code = f"{'B' if back else 'F'}{course:02d}-{number:02d}"
            solid = prism(code, front, front + np.array([0.0, sign * depth, 0.0]))
            stones.append(FacingStone(code, course, solid, np.array([0.0, -sign, 0.0])))
    return stones if placed is None else [moved(stone, *placed) for stone in stones]


def moved(stone, rotation, shift):
    """Return the stone elsewhere."""
    turn = Rotation.from_rotvec(rotation).as_matrix()
    solid = Solid(stone.code, stone.solid.vertices @ turn.T + shift, stone.solid.faces)
    return FacingStone(stone.code, stone.course, solid, turn @ stone.normal)


def depth_of_overlap(one, other):
    """Return the radius of the largest ball in the overlap of two convex solids; negative if they are apart [m]."""
    shift = one.mean(axis=0)
    planes = np.concatenate([ConvexHull(points - shift).equations for points in (one, other)])
    radius = largest_ball(planes * [1.0, 1.0, 1.0, -1.0])[1]
    assert np.isfinite(radius)
    return radius


def boxes_meet(one, other):
    """Return whether the boxes of two sets of corners overlap."""
    return bool((one.min(axis=0) < other.max(axis=0)).all() and (other.min(axis=0) < one.max(axis=0)).all())


def contains(solid, points):
    """Return the points inside a closed solid: the solid angle of its surface seen from them is 4π."""
    corners = solid.vertices[triangulate(solid)]
    a, b, c = (corners[None, :, k] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=2) for side in (a, b, c))
    upper = (a * np.cross(b, c)).sum(axis=2)
    lower = la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la + (c * a).sum(axis=2) * lb
    return np.abs(2.0 * np.arctan2(upper, lower).sum(axis=1)) > 2.0 * np.pi


def core_volume(wall: TwoFacings) -> float:
    """Compute the true volume between the hidden sides of the two facings of a wall [m³].

    Behind each stone, from its hidden side to the middle of the wall, lies a prism square to the wall: its
    section times the length at the section's centroid, since both ends are planes.
    """
    frame, volume = wall_frame(), 0.0
    for solid in wall.building.solids:
        if solid.code in wall.through:
            continue
        hidden = solid.vertices[list(solid.faces[1])]
        heights_over_middle = (hidden - frame.origin) @ frame.axes[2] + 0.5 * wall.thickness
        if solid.code in wall.second:
            heights_over_middle = -heights_over_middle
        section = abs(float(area_vector(hidden) @ frame.axes[2]))
        volume += section * _mean_over(hidden, heights_over_middle)
    return volume


def _mean_over(polygon, values):
    """Average over a plane polygon a linear function that is known at its corners."""
    areas, means = [], []
    normal = area_vector(polygon)
    for k in range(1, len(polygon) - 1):
        triangle = polygon[[0, k, k + 1]]
        areas.append(float(area_vector(triangle) @ normal))
        means.append(float(values[[0, k, k + 1]].mean()))
    return float(np.average(means, weights=areas))
