"""Openings of a leaf: places farther from every outline than mortar reaches, such as windows, doors and niches.

The circles about Voronoi vertices that hold no sample and are larger than a bound make up an opening, as in alpha
shapes (Edelsbrunner, Kirkpatrick & Seidel 1983). Samples along its edge, a hair within it, give it a region of its own
in the diagram: outlines beside it become free edges, and mortar ends where it opens into it.
"""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Voronoi, cKDTree

from survey.arrays import Array, Bools, Ints
from survey.conventions import PER_MILLE
from survey.geometry.polygons import inside

_SAME_SAMPLE = (
    PER_MILLE  # of the distance of a sample of an opening from its edge: nearer ones are one sample
)


def usual_width(lengths: Array, apart: Array) -> float:
    """Return the median width of the joints between stones, weighted by length [m].

    Parameters
    ----------
    lengths : (n,) of the ridges between samples of two stones [m]
    apart : (n,) distances of these samples [m]
    """
    if not len(lengths):
        return 0.0
    order = np.argsort(apart)
    reached = np.cumsum(lengths[order])
    return float(apart[order][np.searchsorted(reached, 0.5 * reached[-1])])


def open_places(
    diagram: Voronoi, points: Array, outlines: Sequence[Array], frame: Array, reach: float, inset: float
) -> tuple[Array, Ints]:
    """Find the openings of a leaf, and sample their edges.

    Parameters
    ----------
    diagram : of the samples of the outlines, followed by their images beyond the frame
    points : (n, 2) the samples [m]
    outlines : (k, 2) of each stone [m]
    frame : (2, 2) lower left and upper right corner of the leaf [m]
    reach : distance from the nearest outline beyond which a place is open [m]
    inset : distance of samples from their outline, within the stone [m]

    Returns
    -------
    places : (m, 2) samples of the openings, as far from their edges within them as those of the stones are outside [m]
    opening : (m,) number of the opening of each
    """
    pairs: Ints = diagram.ridge_points.astype(np.int64)
    ends = np.asarray(diagram.ridge_vertices)
    opened = _open_vertices(diagram, outlines, frame, reach, inset)
    if not opened.any():
        return np.empty((0, 2)), np.empty(0, np.int64)
    free = np.where(ends >= 0, opened[ends], False)
    within = ends[free.all(axis=1)]
    graph = coo_array((np.ones(len(within)), (within[:, 0], within[:, 1])), shape=(len(opened),) * 2)
    _, component = connected_components(graph, directed=False)
    _, number = np.unique(component[opened], return_inverse=True)
    opening = np.full(len(opened), -1)
    opening[opened] = number
    # a ridge with one open end crosses the edge of an opening between its two samples
    edge = free[:, 0] != free[:, 1]
    sides, vertex = pairs[edge], np.where(free[edge, 0], ends[edge, 0], ends[edge, 1])
    towards = _middles(pairs, ends, len(opened), diagram.points)[vertex]
    start, stop = diagram.points[sides[:, 0]], diagram.points[sides[:, 1]]
    inward = np.column_stack([start[:, 1] - stop[:, 1], stop[:, 0] - start[:, 0]])
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    inward *= np.where(((towards - start) * inward).sum(axis=1) > 0.0, 2.0 * inset, -2.0 * inset)[:, None]
    places = np.concatenate([start + inward, stop + inward])
    of = np.concatenate([opening[vertex], opening[vertex]])
    own = np.concatenate([sides[:, 0], sides[:, 1]]) < len(points)
    own &= ((places > frame[0]) & (places < frame[1])).all(axis=1)
    return _single(places[own], of[own], _SAME_SAMPLE * inset)


def _open_vertices(
    diagram: Voronoi, outlines: Sequence[Array], frame: Array, reach: float, inset: float
) -> Bools:
    """Return which vertices (v,) of a diagram lie in the frame, outside all stones, and beyond reach of these."""
    vertices, ends = diagram.vertices, np.asarray(diagram.ridge_vertices)
    clearance = np.zeros(len(vertices))
    for end in (ends[:, 0], ends[:, 1]):
        there = end >= 0
        sample = diagram.points[diagram.ridge_points[there, 0]]
        clearance[end[there]] = np.linalg.norm(vertices[end[there]] - sample, axis=1)
    out: Bools = clearance - inset > reach
    out &= ((vertices > frame[0] - inset) & (vertices < frame[1] + inset)).all(axis=1)
    for ring in outlines:
        about = np.flatnonzero(
            out & ((vertices > ring.min(axis=0)) & (vertices < ring.max(axis=0))).all(axis=1)
        )
        out[about[inside(vertices[about], ring)]] = False
    return out


def _middles(pairs: Ints, ends: Ints, count: int, sites: Array) -> Array:
    """Return the mean (v, 2) of the sites about each vertex of a diagram."""
    total, number = np.zeros((count, 2)), np.zeros(count)
    for end in (0, 1):
        there = ends[:, end] >= 0
        for site in (0, 1):
            np.add.at(total, ends[there, end], sites[pairs[there, site]])
        np.add.at(number, ends[there, end], 2.0)
    out: Array = total / np.maximum(number, 1.0)[:, None]
    return out


def _single(places: Array, of: Ints, nearest: float) -> tuple[Array, Ints]:
    """Return places without those that lie where an earlier one does."""
    twice = cKDTree(places).query_pairs(nearest, output_type="ndarray")
    single = np.ones(len(places), np.bool_)
    single[twice.max(axis=1)] = False
    return places[single], of[single]
