"""Surfaces for the pictures of a result: faces, edges and fields of the stones, joints and resultants."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.results.result import BodyResult, Result
from mechanics.results.stress_values import utilisation
from mechanics.scene.scene import Fidelity
from mechanics.stones.materials import Material
from pipelines.draw.catalogue import PICTURES
from pipelines.draw.offscreen.parts import fan_polygons
from survey.conventions import ALIKE, FEW

FIELDS = tuple(name for name, picture in PICTURES.items() if picture.shows != "joints")
"""Columns of `WallSurface.fields`."""

_TOGETHER = FEW  # part of the mean motion of the supports by which each may differ from it [-]


@dataclass(frozen=True)
class WallSurface:
    """Outer faces of all stones at the end of a run, fanned into triangles, and what the joints carry.

    Attributes
    ----------
    points : (n, 3) where the points are now [m]
    triangles : (nt, 3)
    deformable : (nt,) whether the triangle belongs to a deformable stone
    fixed : (nt,) whether it belongs to a fixed one
    edges : (ne, 2) edges of the stones
    fields : (n, len(FIELDS)) Von Mises stress [Pa], length of the displacement seen from supports that move as one [m],
        σ1 and -σ3 where they are positive [Pa], utilisation and estimated error of the stress [-]; NaN where they are
        not known
    joint_points : (m, 3) corners of the pressed joints [m]
    joint_triangles : (k, 3) of these joints
    joint_pressure : (k,) mean pressure of the joint of each triangle [Pa]
    resultant_points : (r, 3) where the resultants meet the pressed joints [m]
    resultants : (r, 3) on one of the two stones [N]
    in_kern : (r,) whether they are within the kern
    """

    points: Array
    triangles: Ints
    deformable: Bools
    fixed: Bools
    edges: Ints
    fields: Array
    joint_points: Array
    joint_triangles: Ints
    joint_pressure: Array
    resultant_points: Array
    resultants: Array
    in_kern: Bools

    def field(self, name: str) -> Array:
        """Return one of FIELDS, (n,)."""
        column: Array = self.fields[:, FIELDS.index(name)]
        return column


def wall_surface(result: Result) -> WallSurface:
    """Gather the surface of all stones of a result."""
    sizes = [len(body.reference) for body in result.bodies]
    offsets = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    triangles = [_fans(body.faces) for body in result.bodies]
    counts = [len(triangle) for triangle in triangles]
    carried = support_motion(result.bodies, [body.position for body in result.bodies])
    pressed = np.flatnonzero(result.joints.pressed)
    corners, of_joints, owners = fan_polygons([result.joints.polygon[number] for number in pressed])
    return WallSurface(
        points=np.concatenate([body.position for body in result.bodies]),
        triangles=np.concatenate(
            [triangle + offset for triangle, offset in zip(triangles, offsets, strict=True)]
        ),
        deformable=np.repeat([body.fidelity is Fidelity.DEFORMABLE for body in result.bodies], counts),
        fixed=np.repeat([body.fidelity is Fidelity.FIXED for body in result.bodies], counts),
        edges=np.concatenate(
            [
                _stone_edges(body, triangle) + offset
                for body, triangle, offset in zip(result.bodies, triangles, offsets, strict=True)
            ]
        ),
        fields=np.concatenate(
            [
                stone_fields(body, block.material, carried)
                for body, block in zip(result.bodies, result.scene.blocks, strict=True)
            ]
        ),
        joint_points=corners,
        joint_triangles=of_joints,
        joint_pressure=result.joints.pressure_mean[pressed][owners],
        resultant_points=result.joints.centre_of_pressure[pressed],
        resultants=result.joints.force[pressed],
        in_kern=result.joints.in_kern[pressed],
    )


def support_motion(bodies: Sequence[BodyResult], positions: Sequence[Array]) -> Array:
    """Return the displacement (3,) of the supports where they move as one, as in an earthquake; zero elsewhere [m]."""
    fixed = [
        place - body.reference
        for body, place in zip(bodies, positions, strict=True)
        if body.fidelity is Fidelity.FIXED
    ]
    if not fixed:
        return np.zeros(3)
    moved = np.concatenate(fixed)
    mean = moved.mean(axis=0)
    together = np.abs(moved - mean).max() <= _TOGETHER * np.linalg.norm(mean)
    return np.asarray(mean if together else np.zeros(3))


def stone_fields(body: BodyResult, material: Material, carried: Array | None = None) -> Array:
    """Compute the FIELDS of the points of one stone, (n, len(FIELDS)), as in `WallSurface`.

    Displacements are relative to `carried` (3,), that of the supports [m]; None: absolute.
    """
    displacement = body.displacement if carried is None else body.displacement - carried
    fields = {"displacement": np.linalg.norm(displacement, axis=1)}
    if body.von_mises is not None and body.principal is not None and body.values is not None:
        fields |= {
            "von_mises": body.von_mises,
            "principal_tension": np.maximum(body.principal[:, 0], 0.0),
            "principal_compression": np.maximum(-body.principal[:, 2], 0.0),
            "utilisation": utilisation(body.principal, material),
            "error": np.full(len(body.reference), body.values.error),
        }
    unknown = np.full(len(body.reference), np.nan)
    return np.column_stack([fields.get(name, unknown) for name in FIELDS])


def _fans(faces: tuple[tuple[int, ...], ...]) -> Ints:
    """Fan convex polygons into triangles (nt, 3)."""
    return np.array(
        [(face[0], face[k], face[k + 1]) for face in faces for k in range(1, len(face) - 1)], dtype=np.int64
    ).reshape(-1, 3)


def _stone_edges(body: BodyResult, triangles: Ints) -> Ints:
    """List the edges (ne, 2) where two triangles meet at an angle; those inside a flat face are left out."""
    a, b, c = body.reference[triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    # a corner on an edge makes a triangle without area, which bends with nothing
    normals = np.where(length > 0.0, normals / np.where(length > 0.0, length, 1.0), np.nan)
    sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    order = np.lexsort((sides[:, 1], sides[:, 0]))
    sides, owner = sides[order], owner[order]
    same = np.all(sides[1:] == sides[:-1], axis=1)
    bent = np.einsum("ij,ij->i", normals[owner[1:]], normals[owner[:-1]]) < np.cos(ALIKE)
    return np.asarray(sides[1:][same & bent], dtype=np.int64)
