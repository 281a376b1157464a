"""Hidden sides beside the core of a wall: one plane for those that continue each other.

A hidden side lies behind its face by a depth that is known of its kind, to some centimetres, so that two neighbours of
one depth differ there by the relief of their faces, which says nothing of their backs. Left so, stones reach past each
other into the core by some millimetres, and meet its blocks in strips that no mason would count as bearing.
"""

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from survey.arrays import Array, Bools, Ints
from survey.conventions import MAX_ROUNDS

# rounds in which the members of a plane and the plane itself are found from each other, at most


class HiddenSides(NamedTuple):
    """Hidden sides of stones.

    Attributes
    ----------
    corners : (k, 3) of all sides, side after side [m]
    starts : (n + 1,) index of the first corner of each side
    planes : (n, 4) of each side, n·x = d, outward
    slack : (n,) distance by which the corners of each side may move [m]
    """

    corners: Array
    starts: Ints
    planes: Array
    slack: Array


def common_planes(sides: HiddenSides, continuing: Ints) -> tuple[Array, Ints]:
    """Fit one plane to all hidden sides that continue each other, as far as these may move.

    A plane begins with one side, takes those that continue it, and is fitted to its members until these stay the same.
    Sides that are too far off begin a plane of their own.

    Parameters
    ----------
    sides : hidden sides
    continuing : (m, 2) pairs of sides of neighbours that continue each other

    Returns
    -------
    planes (p, 4), and the plane (n,) of each side
    """
    count = len(sides.planes)
    graph = coo_array((np.ones(len(continuing)), (continuing[:, 0], continuing[:, 1])), shape=(count, count))
    planes: list[Array] = []
    number = np.full(count, -1)
    for seed in range(count):
        if number[seed] >= 0:
            continue
        plane, members = _grown(sides, graph, seed, number < 0)
        number[members] = len(planes)
        planes.append(plane)
    return np.array(planes).reshape(-1, 4), number


def _grown(sides: HiddenSides, graph: "coo_array[np.float64]", seed: int, free: Bools) -> tuple[Array, Ints]:
    """Return the plane that begins with a side, and its members among the sides that have none yet."""
    alone = sides.planes[seed], np.array([seed])
    plane, members = alone
    for _ in range(MAX_ROUNDS):
        on_plane = free & (_off(sides, plane) <= sides.slack)
        on_plane[seed] = True
        grown = _linked(graph, on_plane, seed)
        if np.array_equal(grown, members):
            break
        members, plane = grown, _fitted(sides, grown)
    members = members[_off(sides, plane)[members] <= sides.slack[members]]
    return (plane, members) if len(members) > 1 and seed in members else alone


def _off(sides: HiddenSides, plane: Array) -> Array:
    """Return the largest distance of a corner of each side (n,) from a plane [m]."""
    distance = np.abs(sides.corners @ plane[:3] - plane[3])
    out: Array = np.maximum.reduceat(distance, sides.starts[:-1])
    return np.where(sides.planes[:, :3] @ plane[:3] > 0.0, out, np.inf)


def _linked(graph: "coo_array[np.float64]", members: Bools, seed: int) -> Ints:
    """Return the sides that are linked with one of them by sides near its plane."""
    row, column = graph.coords
    linked = members[row] & members[column]
    some = coo_array((graph.data[linked], (row[linked], column[linked])), shape=graph.shape)
    _, label = connected_components(some, directed=False)
    return np.flatnonzero(members & (label == label[seed]))


def _fitted(sides: HiddenSides, members: Ints) -> Array:
    """Return the least-squares plane of the corners of some sides."""
    rows = np.concatenate([np.arange(sides.starts[k], sides.starts[k + 1]) for k in members.tolist()])
    points, normal = sides.corners[rows], sides.planes[members, :3].mean(axis=0)
    middle = points.mean(axis=0)
    axes = np.linalg.svd(points - middle, full_matrices=False)[2]
    out = axes[2] if axes[2] @ normal > 0.0 else -axes[2]
    return np.append(out, float(out @ middle))
