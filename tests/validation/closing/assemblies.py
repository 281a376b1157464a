"""Assemblies as exported by other programs: solids with coordinates rounded to a millimetre, and their truth.

A dome of hexagonal stones, whose joints are planes through its centre; and piers of angled stones, which are not
convex. Rounding turns faces of more than three corners out of their plane and neighbours out of touch.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, HalfspaceIntersection

from survey.arrays import Array
from survey.extrusion.extrusion import prism
from survey.geometry.solids import Solid
from synthetic.true_joints import TrueJoint, true_joints

_GOLDEN = math.pi * (3.0 - math.sqrt(5.0))  # turn from point to point of a spiral that fills a sphere evenly
_NEAR = 14  # nearest points that include all neighbours of one on the sphere
_SAME = 1e-9  # distance of identical corners, due to rounding [m]


@dataclass(frozen=True)
class RoundedAssembly:
    """A synthetic assembly.

    Attributes
    ----------
    name : a description
    solids : with coordinates rounded to a millimetre; not all need be convex
    truth : the same before rounding, in the same order
    parts : convex parts of the true solids; those of one stone bear its code
    joints : all true joints
    base : codes of the stones that stand on the ground
    """

    name: str
    solids: tuple[Solid, ...]
    truth: tuple[Solid, ...]
    parts: tuple[Solid, ...]
    joints: tuple[TrueJoint, ...]
    base: tuple[str, ...]


def rounded(solids: Sequence[Solid], decimals: int = 3) -> tuple[Solid, ...]:
    """Round the coordinates of solids to the decimals of a file."""
    return tuple(Solid(one.code, np.round(one.vertices, decimals) + 0.0, one.faces) for one in solids)


def hexagonal_dome(stones: int = 90, radius: float = 3.0, thickness: float = 0.3) -> RoundedAssembly:
    """Build half a sphere of stones with mostly six sides.

    Parameters
    ----------
    stones : their number
    radius, thickness : of the intrados, touched by every stone's lower face, and of the shell [m]

    Returns
    -------
    RoundedAssembly, whose codes are D<number> from the crown down
    """
    heights = 1.0 - (np.arange(stones) + 0.5) / stones
    turns = _GOLDEN * np.arange(stones)
    around = np.sqrt(1.0 - heights**2)
    centres = np.column_stack([around * np.cos(turns), around * np.sin(turns), heights])
    solids = []
    for number, centre in enumerate(centres):
        near = np.argsort(-(centres @ centre), kind="stable")[1 : _NEAR + 1]
        # rows (n, d): the stone is where n·x + d ≤ 0
        planes = [(*_unit(centres[k] - centre), 0.0) for k in near]
        planes += [(*-centre, radius), (*centre, -radius - thickness), (0.0, 0.0, -1.0, 0.0)]
        inside = (radius + 0.5 * thickness) * centre + [0.0, 0.0, 1e-3]
        solids.append(_cell(f"D{number + 1:03d}", np.array(planes), inside))
    truth = tuple(solids)
    base = tuple(one.code for one in truth if one.vertices[:, 2].min() < _SAME)
    return RoundedAssembly(f"dome of {stones} stones", rounded(truth), truth, truth, true_joints(truth), base)


def angled_pier(courses: int = 6, wing: float = 2.2, height: float = 0.3) -> RoundedAssembly:
    """Build two short walls at a right angle, whose corner stones are angled and bind both.

    Parameters
    ----------
    courses : of both walls
    wing : length of each wall from the corner [m]
    height : of a course [m]

    Returns
    -------
    RoundedAssembly, whose codes are L<course> for angled stones, A… and B<course>-<number> in the walls
    """
    truth, parts = [], []
    for course in range(1, courses + 1):
        low, high = (course - 1) * height, course * height
        for code, outlines in _course(course, wing).items():
            whole, *pieces = (_upright(code, outline, low, high) for outline in outlines)
            truth.append(whole)
            parts += pieces or [whole]
    base = tuple(one.code for one in truth if one.vertices[:, 2].min() < _SAME)
    return RoundedAssembly(
        "angled pier", rounded(truth), tuple(truth), tuple(parts), true_joints(parts), base
    )


def _course(course: int, wing: float, depth: float = 0.4) -> dict[str, list[Array]]:
    """Return by code the outline of each stone on the ground, and those of its convex parts if it is not convex."""
    a, b = (1.0, 0.7) if course % 2 else (0.7, 1.0)
    out = {
        f"L{course:02d}": [
            np.array([(0, 0), (a, 0), (a, depth), (depth, depth), (depth, b), (0, b)]),
            np.array([(0, 0), (a, 0), (a, depth), (0, depth)]),
            np.array([(0, depth), (depth, depth), (depth, b), (0, b)]),
        ]
    }
    for letter, start in (("A", a), ("B", b)):
        count = 3 if start < 0.9 else 2
        ends = np.linspace(start, wing, count + 1)
        for k in range(count):
            s, t = ends[k], ends[k + 1]
            along_x = np.array([(s, 0), (t, 0), (t, depth), (s, depth)])
            outline = along_x if letter == "A" else along_x[::-1, ::-1]
            out[f"{letter}{course:02d}-{k + 1}"] = [outline]
    return out


def _upright(code: str, outline: Array, low: float, high: float) -> Solid:
    """Make a prism on a counter-clockwise outline, turned about the vertical so that no coordinate is round."""
    angle = 0.37
    turn = np.array([(math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))])
    flat = np.asarray(outline, dtype=float) @ turn + [3.1234567, 7.6543217]
    top, bottom = (np.column_stack([flat, np.full(len(flat), z)]) for z in (high, low))
    return prism(code, top, bottom)


def _cell(code: str, planes: Array, inside: Array) -> Solid:
    """Make the convex solid within half-spaces n·x + d ≤ 0 (n, 4), with one polygon for each that bounds it."""
    points = HalfspaceIntersection(planes, inside).intersections
    keep: list[Array] = []
    for point in points:
        if all(np.linalg.norm(point - other) > _SAME for other in keep):
            keep.append(point)
    vertices = np.array(keep)
    faces = []
    for *normal, offset in planes:
        on = np.flatnonzero(np.abs(vertices @ normal + offset) < _SAME)
        if len(on) >= 3:
            n = np.array(normal)
            u = _unit(np.cross(n, np.eye(3)[np.argmin(np.abs(n))]))
            flat = vertices[on] @ np.array([u, np.cross(n, u)]).T
            faces.append(tuple(int(i) for i in on[ConvexHull(flat).vertices]))
    return Solid(code, vertices, tuple(faces))


def _unit(vector: Array) -> Array:
    out: Array = vector / np.linalg.norm(vector)
    return out
