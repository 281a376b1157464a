"""Corners of folds where neighbours meet.

Convex stones on opposite sides of a plane never overlap, wherever their corners lie in it. Where a non-convex stone
touches others on both sides of a fold, the plane of one side does not keep the neighbour on the other from reaching
around the edge into the stone, unless the plane between the two neighbours passes through that very edge. So the
corners of the fold lie on the planes of all stones that meet there.
"""

from collections.abc import Sequence, Set

import numpy as np
from scipy.spatial import cKDTree

from survey.geometry.convexity import is_convex, reflex_edges
from survey.geometry.solids import Solid

__all__ = ["meeting_corners"]


def meeting_corners(solids: Sequence[Solid], touching: Set[int], reach: float) -> dict[int, tuple[int, ...]]:
    """Find the corners of folds between touching faces, and the corners of other solids that meet them.

    Parameters
    ----------
    solids : closed
    touching : numbers of the faces that touch others, counted through all solids
    reach : largest distance of corners that meet [m]

    Returns
    -------
    for each corner of a fold, counted through all solids, the nearest corner of each other solid within reach
    """
    starts = np.cumsum([0, *(len(one.vertices) for one in solids)])
    first_face = np.cumsum([0, *(len(one.faces) for one in solids)])
    folds = {
        int(starts[k]) + i
        for k, one in enumerate(solids)
        if not is_convex(one)
        for edge in reflex_edges(one)
        if {int(first_face[k]) + edge.first, int(first_face[k]) + edge.second} <= touching
        for i in edge.corners
    }
    if not folds:
        return {}
    vertices = np.concatenate([one.vertices for one in solids])
    owner = np.repeat(np.arange(len(solids)), np.diff(starts))
    tree = cKDTree(vertices)
    found = {}
    for i in sorted(folds):
        near = tree.query_ball_point(vertices[i], reach)
        near.sort(key=lambda j: (float(np.linalg.norm(vertices[j] - vertices[i])), j))
        nearest: dict[int, int] = {}
        for j in near:
            nearest.setdefault(int(owner[j]), j)
        found[i] = tuple(j for one, j in nearest.items() if one != owner[i])
    return {i: others for i, others in found.items() if others}
