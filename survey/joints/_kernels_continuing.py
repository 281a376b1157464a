"""Numba kernel of faces that continue each other: of neighbours, in one plane, on one hand of it."""

import numpy as np
from numba import njit

__all__ = ["continuing_faces"]


@njit(cache=True)
def continuing_faces(pairs, solid, normals, offsets, joined, cosine, near):
    """Faces of neighbouring stones that lie in one plane, as the tops of two stones of a course do.

    Parameters
    ----------
    pairs : (n, 2) stones that are neighbours
    solid : vertices, corners, face_starts, solid_starts of `Polyhedra`
    normals, offsets : (nf, 3), (nf,) of all faces
    joined : (nf,) whether a face belongs to a joint
    cosine : of the largest angle between the two
    near : by which a corner of either may be off the plane of the other [m]

    Returns
    -------
    (m, 2) faces
    """
    starts = solid[3]
    out = np.empty((4 * pairs.shape[0], 2), np.int64)
    count = 0
    for pair in range(pairs.shape[0]):
        one, two = pairs[pair]
        for f in range(starts[one], starts[one + 1]):
            for g in range(starts[two], starts[two + 1]):
                if not (joined[f] and joined[g]):
                    continue
                turned = 0.0
                for k in range(3):
                    turned += normals[f, k] * normals[g, k]
                if turned < cosine:
                    continue
                if (
                    _off(f, g, solid, normals, offsets) <= near
                    and _off(g, f, solid, normals, offsets) <= near
                ):
                    if count == out.shape[0]:
                        out = np.concatenate((out, np.empty_like(out)))
                    out[count, 0], out[count, 1] = f, g
                    count += 1
    return out[:count]


@njit(cache=True)
def _off(face, other, solid, normals, offsets):
    """Farthest that a corner of one face is from the plane of another."""
    vertices, corners, face_starts, _ = solid
    farthest = 0.0
    for c in range(face_starts[face], face_starts[face + 1]):
        height = -offsets[other]
        for k in range(3):
            height += normals[other, k] * vertices[corners[c], k]
        farthest = max(farthest, abs(height))
    return farthest
