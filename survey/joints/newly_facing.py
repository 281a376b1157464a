"""Joints that show only when others are closed.

A worn corner can hide that two stones face each other: what is measured of the one ends before the other begins, or
lies too far back. Once the joints beside it are closed, and the corner with them, the two stones meet.
"""

from dataclasses import replace

import numpy as np

from survey.arrays import Array, Ints
from survey.geometry.adjacency import Polyhedra
from survey.joints.bounded_closing import Building, Cut
from survey.joints.facing import FacingFaces, find_facing, planes_of
from survey.joints.settings import JointSettings

__all__ = ["newly_facing"]


def newly_facing(building: Building, facing: FacingFaces, cut: Cut, settings: JointSettings) -> FacingFaces:
    """The pairs of faces that are known, and those of further stones that face each other now.

    Parameters
    ----------
    building : the stones as surveyed
    facing : pairs that are known
    cut : the stones with the joints of these closed
    settings : what counts as a joint; a joint that shows now is at most half as wide
    """
    solids = Polyhedra.gather((solid.vertices, solid.faces) for solid in cut.solids)
    found = find_facing(solids, planes_of(solids), replace(settings, max_width=0.5 * settings.max_width))
    pairs, owner = _surveyed_faces(building, cut)[found.faces], building.faces.planes.owner
    known = set(map(tuple, owner[facing.faces].tolist()))
    fresh = [
        k
        for k, (first, second) in enumerate(pairs.tolist())
        if first >= 0 and second >= 0 and (int(owner[first]), int(owner[second])) not in known
    ]
    width = _height(building, pairs[fresh, 0], found, fresh) - _height(
        building, pairs[fresh, 1], found, fresh
    )
    return FacingFaces(
        np.concatenate([facing.faces, pairs[fresh]]),
        np.concatenate([facing.area, found.area[fresh]]),
        np.concatenate([facing.gap, width]),
        np.concatenate([facing.centroid, found.centroid[fresh]]),
        np.concatenate([facing.normal, found.normal[fresh]]),
    )


def _surveyed_faces(building: Building, cut: Cut) -> Ints:
    """The surveyed face that each face of the stones now was; -1 for one that came with a bend of its bed."""
    out = []
    for i, solid in enumerate(cut.solids):
        rows = building.rows(i)
        of_face = np.array(cut.of_face.get(i, range(len(solid.faces))), np.int64)
        out.append(np.where(of_face < rows.stop - rows.start, rows.start + of_face, -1))
    return np.concatenate(out)


def _height(building: Building, faces: Ints, found: FacingFaces, links: list[int]) -> Array:
    """Where the planes of surveyed faces lie along the normal of a joint, seen from its middle [m]."""
    normals, offsets = building.faces.planes.normals[faces], building.faces.planes.offsets[faces]
    centroid, normal = found.centroid[links], found.normal[links]
    out: Array = (offsets - (normals * centroid).sum(axis=1)) / (normals * normal).sum(axis=1)
    return out
