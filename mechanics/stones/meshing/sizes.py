"""Target edge lengths of a mesh from place to place: fine at the faces in contact, coarser away from them."""

from dataclasses import dataclass, field

import numpy as np

from mechanics.arrays import Array
from mechanics.stones.polyhedra import face_plane

Faces = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class SizeField:
    """Target edge length h(x) = min(size, fine + growth · distance to the nearest of some planes).

    Attributes
    ----------
    size : away from the planes [m]
    fine : at the planes [m]
    growth : of the edge length per metre away from the planes [-]
    normals, offsets : (k, 3) unit normals and (k,) n·x of the planes [m]; none: the size is uniform
    """

    size: float
    fine: float
    growth: float = 0.0
    normals: Array = field(default_factory=lambda: np.zeros((0, 3)))
    offsets: Array = field(default_factory=lambda: np.zeros(0))

    def __call__(self, points: Array) -> Array:
        """Return sizes (n,) at points (n, 3) [m]."""
        if self.uniform:
            return np.full(len(points), self.size)
        distance = np.abs(points @ self.normals.T - self.offsets).min(axis=1)
        sizes: Array = np.minimum(self.size, self.fine + self.growth * distance)
        return sizes

    @property
    def uniform(self) -> bool:
        """True if the size is the same everywhere."""
        return not len(self.offsets)

    def scaled(self, factor: float) -> "SizeField":
        """Return the field with all sizes times a factor."""
        return SizeField(
            factor * self.size, factor * self.fine, factor * self.growth, self.normals, self.offsets
        )

    def local(self, origin: Array, scale: float) -> "SizeField":
        """Return the field in coordinates (x - origin) / scale."""
        offsets = (self.offsets - self.normals @ origin) / scale
        return SizeField(self.size / scale, self.fine / scale, self.growth, self.normals, offsets)


def as_field(size: SizeField | float) -> SizeField:
    """Return a field; a number is a uniform size [m]."""
    return size if isinstance(size, SizeField) else SizeField(size, size)


def graded(
    size: float, fine: float, growth: float, vertices: Array, faces: Faces, contact: tuple[int, ...]
) -> SizeField:
    """Return the field of a stone whose edges have length `fine` at the faces numbered in `contact` [m]."""
    if fine >= size or not contact:
        return as_field(size)
    planes = [face_plane(vertices[list(faces[k])]) for k in contact]
    normals = np.array([normal for normal, _ in planes])
    origins = np.array([origin for _, origin in planes])
    return SizeField(size, fine, growth, normals, (normals * origins).sum(axis=1))
