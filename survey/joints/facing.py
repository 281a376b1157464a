"""Detection of faces of neighbouring stones that face each other across a joint."""

from dataclasses import dataclass

import numpy as np

from survey.arrays import Array, Bools, Ints
from survey.geometry._kernels.adjacency import face_planes, facing_faces
from survey.geometry.adjacency import SolidArrays, boxes_of, near_pairs, open_to_each_other
from survey.joints.settings import JointSettings


@dataclass(frozen=True)
class FacePlanes:
    """Planes n·x = d of all faces of many solids.

    Attributes
    ----------
    normals : (nf, 3) outward unit normals [-]
    offsets : (nf,) [m]
    areas : (nf,) [m²]
    boxes : (nf, 6) lower and upper corner of each face [m]
    convex : (nf,) whether the face's outline is convex
    owner : (nf,) solid of each face
    """

    normals: Array
    offsets: Array
    areas: Array
    boxes: Array
    convex: Bools
    owner: Ints


@dataclass(frozen=True)
class FacingFaces:
    """Pairs of faces of two solids that face each other.

    Attributes
    ----------
    faces : (m, 2) indices of the faces, that of the solid with the smaller index first
    area : (m,) shared area, seen square to the joint [m²]
    gap : (m,) mean distance over it; negative where they overlap [m]
    centroid : (m, 3) of it, half-way between the two faces [m]
    normal : (m, 3) unit normal, from the second to the first [-]
    """

    faces: Ints
    area: Array
    gap: Array
    centroid: Array
    normal: Array

    def __len__(self) -> int:
        return len(self.faces)


def planes_of(solids: SolidArrays) -> FacePlanes:
    """Return the planes of all faces, each through the mean of its corners."""
    normals, areas, boxes, convex = face_planes(solids.vertices, solids.corners, solids.face_starts)
    counts = np.diff(solids.face_starts)
    centres = (
        np.add.reduceat(solids.vertices[solids.corners], solids.face_starts[:-1], axis=0) / counts[:, None]
    )
    owner = np.repeat(np.arange(len(solids)), np.diff(solids.solid_starts))
    return FacePlanes(normals, (normals * centres).sum(axis=1), areas, boxes, convex, owner)


def find_facing(solids: SolidArrays, planes: FacePlanes, settings: JointSettings) -> FacingFaces:
    """Find the faces that face each other across a joint, or overlap by no more than a joint is wide.

    Parameters
    ----------
    solids : closed, with coordinates about a place among them
    planes : of their faces
    settings : widest joint, largest angle, narrowest strip
    """
    limits = (
        settings.max_width,
        settings.max_width,
        float(np.cos(np.radians(settings.max_angle))),
        0.0,
        True,
    )
    solid = (solids.vertices, solids.corners, solids.face_starts, solids.solid_starts)
    kernel_planes = (planes.normals, planes.areas, planes.boxes, planes.convex)
    faces, rows = [np.zeros((0, 2), np.int64)], [np.zeros((0, 8))]
    everyone = np.ones(len(solids), np.bool_)
    for pair in near_pairs(boxes_of(planes.boxes, solids.solid_starts, settings.max_width), everyone):
        room = 4 * len(pair)
        while True:
            found, values = np.empty((room, 2), np.int64), np.empty((room, 8))
            count = facing_faces(pair, solid, kernel_planes, limits, found, values)
            if count <= room:
                break
            room = count
        faces.append(found[:count])
        rows.append(values[:count])
    pairs, row = np.concatenate(faces), np.concatenate(rows)
    wide = row[:, 0] >= settings.min_overlap * np.sqrt(planes.areas[pairs].min(axis=1))
    pairs, row = pairs[wide], row[wide]
    stones = np.ascontiguousarray(planes.owner[pairs])
    seen = open_to_each_other(stones, row, solid, kernel_planes, settings.max_width)
    pairs, row = pairs[seen], row[seen]
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    pairs, row = pairs[order], row[order]
    return FacingFaces(pairs, row[:, 0], row[:, 1], row[:, 2:5], row[:, 5:8])
