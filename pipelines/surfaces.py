"""The visible surface of a result, triangles to colour and stone edges to draw, in one .npz file."""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mechanics.result import BodyResult, Result
from mechanics.scene import Fidelity

__all__ = ["WallSurface", "load_surface", "save_surface", "wall_surface"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_EDGE_ANGLE = np.deg2rad(20.0)  # faces that meet at less than this are one face of the stone


@dataclass(frozen=True)
class WallSurface:
    """Outer faces of all stones at the end of a run, fanned into triangles.

    Attributes
    ----------
    points : (n, 3) where the points are now [m]
    triangles : (nt, 3)
    deformable : (nt,) whether the triangle belongs to a deformable stone
    fixed : (nt,) whether it belongs to a fixed one
    edges : (ne, 2) edges of the stones
    von_mises : (n,) [Pa]; NaN where no stress was computed
    displacement : (n,) length of the displacement [m]
    """

    points: Array
    triangles: Ints
    deformable: NDArray[np.bool_]
    fixed: NDArray[np.bool_]
    edges: Ints
    von_mises: Array
    displacement: Array


def wall_surface(result: Result) -> WallSurface:
    """Surface of all stones of a result."""
    sizes = [len(body.reference) for body in result.bodies]
    offsets = np.concatenate([[0], np.cumsum(sizes)[:-1]])
    triangles = [_fans(body.faces) for body in result.bodies]
    counts = [len(one) for one in triangles]
    return WallSurface(
        points=np.concatenate([body.position for body in result.bodies]),
        triangles=np.concatenate([one + offset for one, offset in zip(triangles, offsets, strict=True)]),
        deformable=np.repeat([body.fidelity is Fidelity.DEFORMABLE for body in result.bodies], counts),
        fixed=np.repeat([body.fidelity is Fidelity.FIXED for body in result.bodies], counts),
        edges=np.concatenate(
            [
                _stone_edges(body, one) + offset
                for body, one, offset in zip(result.bodies, triangles, offsets, strict=True)
            ]
        ),
        von_mises=np.concatenate(
            [
                np.full(size, np.nan) if body.von_mises is None else body.von_mises
                for body, size in zip(result.bodies, sizes, strict=True)
            ]
        ),
        displacement=np.concatenate([np.linalg.norm(body.displacement, axis=1) for body in result.bodies]),
    )


def save_surface(path: Path, surface: WallSurface) -> None:
    """Write a surface as .npz."""
    np.savez(path, **{one.name: getattr(surface, one.name) for one in fields(surface)})


def load_surface(path: Path) -> WallSurface:
    """Read what `save_surface` wrote."""
    with np.load(path, allow_pickle=False) as arrays:
        return WallSurface(**{one.name: arrays[one.name] for one in fields(WallSurface)})


def _fans(faces: tuple[tuple[int, ...], ...]) -> Ints:
    """(nt, 3) triangles of convex polygons."""
    return np.array(
        [(face[0], face[k], face[k + 1]) for face in faces for k in range(1, len(face) - 1)], dtype=np.int64
    ).reshape(-1, 3)


def _stone_edges(body: BodyResult, triangles: Ints) -> Ints:
    """(ne, 2) edges where two triangles meet at an angle; those inside a flat face are left out."""
    a, b, c = body.reference[triangles].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    order = np.lexsort((sides[:, 1], sides[:, 0]))
    sides, owner = sides[order], owner[order]
    same = np.all(sides[1:] == sides[:-1], axis=1)
    bent = np.einsum("ij,ij->i", normals[owner[1:]], normals[owner[:-1]]) < np.cos(_EDGE_ANGLE)
    return np.asarray(sides[1:][same & bent], dtype=np.int64)
