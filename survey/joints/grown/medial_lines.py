"""Medial lines: the places as far from one outline as from another, within a rectangle.

Outlines are sampled densely. The ridges of the Voronoi diagram between samples of different stones are the medial
lines (Brandt & Algazi 1992), and ridges share their ends to the last bit, so lines that meet at a point share it.
Samples are mirrored at the sides of the rectangle, so that ridges between a sample and its own image are its sides.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Voronoi, cKDTree

from ground.errors import GeometryError
from survey.arrays import Array, Ints
from survey.geometry.polygons import inside
from survey.joints.grown.openings import open_places, usual_width

LEFT_BELOW_RIGHT_ABOVE = tuple(range(-1, -5, -1))
"""Numbers that stand for the sides of the frame where a line runs along it instead of between two stones."""

_FINEST = 1.0 / 16.0  # of the sampling distance: finest samples, where outlines come close to each other
_INSET = (
    _FINEST  # of the sampling distance: samples lie within outlines by this, so that those that touch differ
)
_TOUCHING = 1.0 / 64.0  # of the sampling distance: samples of two stones nearer than this belong to neither
_FINER_WITHIN = 2.0  # sampling distances within which another outline calls for finer samples
_WIDEST = 4.0  # widths of the usual joint that mortar fills; traced rubble has pockets three of them wide
_NEIGHBOURS = 16  # samples that are looked at for one of another stone


@dataclass(frozen=True)
class Line:
    """A medial line between two places where three stones or sides meet.

    Attributes
    ----------
    ends : numbers of the nodes at its ends
    path : (k, 2) its places from the first end to the last, both included [m]
    left, right : numbers of the stones on its sides, as seen from the first end; openings follow the stones; negative
        for a side of the frame
    """

    ends: tuple[int, int]
    path: Array
    left: int
    right: int


@dataclass(frozen=True)
class MedialLines:
    """Network of medial lines that divides a rectangle among stones and openings.

    Attributes
    ----------
    nodes : (n, 2) [m]
    lines : between them
    crossing : pairs of stones whose outlines touch or cross
    openings : number of the places beyond reach of the mortar
    usual : median width of the joints, weighted by length [m]
    filled : mortar is filled in up to this width [m]
    """

    nodes: Array
    lines: tuple[Line, ...]
    crossing: tuple[tuple[int, int], ...]
    openings: int = 0
    usual: float = 0.0
    filled: float = np.inf


def medial_lines(outlines: Sequence[Array], frame: Array, step: float, widest: float = np.inf) -> MedialLines:
    """Divide a rectangle among outlines: each place belongs to the nearest, or to an opening.

    Parameters
    ----------
    outlines : (n, 2) corners of each stone, counter-clockwise [m]
    frame : (2, 2) lower left and upper right corner of the rectangle [m]
    step : distance of the samples along outlines [m]; finer where outlines are near to each other
    widest : mortar is filled in up to this width, or up to four times that of the usual joint where this is more [m]

    Raises
    ------
    GeometryError
        naming the number of a stone that lies within another
    """
    points, owner, crossing = _samples(outlines, frame, step)
    lost = np.flatnonzero(np.bincount(owner, minlength=len(outlines)) == 0)
    if len(lost):
        what = f"outline {lost[0]} lies within another"
        raise GeometryError(what, where="joints", remedy="leave one of the two out")
    inset = _INSET * step
    diagram, original, side = _diagram(points, frame, step)
    lengths, pairs = _lengths(diagram), diagram.ridge_points
    between = pairs.max(axis=1) < len(points)
    between[between] = owner[pairs[between, 0]] != owner[pairs[between, 1]]
    apart = np.linalg.norm(points[pairs[between, 0]] - points[pairs[between, 1]], axis=1)
    usual = usual_width(lengths[between], apart) - 2.0 * inset
    filled = max(widest, _WIDEST * usual)
    places, opening = open_places(diagram, points, outlines, frame, 0.5 * filled, inset)
    openings = 0
    if len(places):
        openings = int(opening.max()) + 1
        points = np.concatenate([points, places])
        owner = np.concatenate([owner, len(outlines) + opening])
        diagram, original, side = _diagram(points, frame, step)
    lines = _divided(diagram, points, owner, frame, original, side)
    return replace(lines, crossing=crossing, openings=openings, usual=usual, filled=filled)


def _diagram(points: Array, frame: Array, step: float) -> tuple[Voronoi, Ints, Ints]:
    """Return the diagram of samples and their images, of which samples the images are, and beyond which sides."""
    images, original, side = _images(points, frame, step)
    return Voronoi(np.concatenate([points, images])), original, side


def _divided(
    diagram: Voronoi, points: Array, owner: Ints, frame: Array, original: Ints, side: Ints
) -> MedialLines:
    """Return the lines between the regions of different owners, and between these and the frame."""
    count = len(points)
    pairs, ends = diagram.ridge_points, np.asarray(diagram.ridge_vertices)
    first, second = pairs.min(axis=1), pairs.max(axis=1)
    inner = second < count
    owner = _in_one_piece(owner, pairs[inner], _lengths(diagram)[inner])
    inner[inner] = owner[first[inner]] != owner[second[inner]]
    bound = (first < count) & (second >= count)
    bound[bound] = original[second[bound] - count] == first[bound]
    vertices = _on_frame(diagram.vertices, ends[bound], side[second[bound] - count], frame)
    chosen = inner | bound
    chosen &= (ends >= 0).all(axis=1)
    labels = np.column_stack([owner[first[chosen]], np.zeros(chosen.sum(), np.int64)])
    beside = second[chosen]
    labels[:, 1] = np.where(
        beside < count, owner[np.minimum(beside, count - 1)], -1 - side[np.maximum(beside - count, 0)]
    )
    return _walk(vertices, ends[chosen], labels, points[first[chosen]])


def _samples(
    outlines: Sequence[Array], frame: Array, step: float
) -> tuple[Array, Ints, tuple[tuple[int, int], ...]]:
    """Return samples (n, 2) of the outlines, the stones that they are of, and the pairs of stones that touch."""
    places, owner = _sampled(outlines, [np.full(len(outline), step) for outline in outlines], _INSET * step)
    too_close = _apart(places, owner, _FINER_WITHIN * step)
    # each side of an outline is sampled as finely as its nearest neighbour asks for
    finest, at = [], 0
    for outline in outlines:
        counts = _counts(outline, np.full(len(outline), step))
        starts = at + np.concatenate([[0], np.cumsum(counts)[:-1]])
        closest = np.minimum.reduceat(too_close, starts)
        finest.append(np.clip(0.5 * closest, _FINEST * step, step))
        at += int(counts.sum())
    places, owner = _sampled(outlines, finest, _INSET * step)
    crossing = set[tuple[int, int]]()
    free = np.ones(len(places), np.bool_)
    low = np.array([outline.min(axis=0) for outline in outlines])
    high = np.array([outline.max(axis=0) for outline in outlines])
    starts = np.searchsorted(owner, np.arange(len(outlines) + 1))
    for i, ring in enumerate(outlines):
        for j in np.flatnonzero(((low <= high[i]) & (high >= low[i])).all(axis=1)).tolist():
            if j == i:
                continue
            rows = slice(starts[j], starts[j + 1])
            within = inside(places[rows], ring)
            if within.any():
                free[rows] &= ~within
                crossing.add((min(i, j), max(i, j)))
    tree = cKDTree(places)
    touching = tree.query_pairs(2.0 * (_INSET + _TOUCHING) * step, output_type="ndarray")
    touching = touching[owner[touching[:, 0]] != owner[touching[:, 1]]]
    crossing |= {(min(a, b), max(a, b)) for a, b in owner[touching].tolist()}
    gaps = np.linalg.norm(places[touching[:, 0]] - places[touching[:, 1]], axis=1)
    free[touching[gaps < _TOUCHING * step].ravel()] = False
    low_end, high_end = frame + _TOUCHING * step * np.array([[1.0], [-1.0]])
    # two samples at one place, as where sides return, would be one site
    clear: Array = np.clip(places[free], low_end, high_end)
    _, single = np.unique(clear, axis=0, return_index=True)
    single.sort()
    return clear[single], owner[free][single], tuple(sorted(crossing))


def _sampled(outlines: Sequence[Array], steps: Sequence[Array], inset: float) -> tuple[Array, Ints]:
    """Return samples (n, 2) a little to the left of the sides of outlines, so far apart at most, and their stones."""
    places = []
    for ring, step in zip(outlines, steps, strict=True):
        counts = _counts(ring, step)
        along = np.concatenate([np.linspace(0.0, 1.0, count) for count in counts.tolist()])
        sides = np.roll(ring, -1, axis=0) - ring
        inward = inset * np.column_stack([-sides[:, 1], sides[:, 0]])
        inward /= np.maximum(np.hypot(*sides.T), 1e-12)[:, None]
        starts = np.repeat(ring + inward, counts, axis=0)
        places.append(starts + along[:, None] * np.repeat(sides, counts, axis=0))
    owner = np.repeat(np.arange(len(outlines)), [len(place) for place in places])
    return np.concatenate(places), owner


def _counts(ring: Array, step: Array) -> Ints:
    """Return the number of samples (n,) of each side, those at both of its ends included."""
    sides = np.linalg.norm(np.roll(ring, -1, axis=0) - ring, axis=1)
    out: Ints = np.maximum(1, np.ceil(sides / step)).astype(np.int64) + 1
    return out


def _apart(places: Array, owner: Ints, most: float) -> Array:
    """Return the distance (n,) of each sample from the nearest of another stone, `most` if there is none nearer."""
    apart, found = cKDTree(places).query(places, k=min(_NEIGHBOURS, len(places)), distance_upper_bound=most)
    neighbour = np.append(owner, -1)[found]
    foreign = (neighbour >= 0) & (neighbour != owner[:, None])
    out: Array = np.where(foreign, apart, most).min(axis=1)
    return out


def _images(points: Array, frame: Array, step: float) -> tuple[Array, Ints, Ints]:
    """Return the images (m, 2) of samples beyond the sides of the frame, the samples that they are of, and the sides.

    Of a side, samples count that are as near to it as the farthest place on it is from the nearest sample.
    """
    tree = cKDTree(points)
    images, original, sides = [], [], []
    for side, (axis, end) in enumerate(((0, 0), (1, 0), (0, 1), (1, 1))):
        low, high = frame[:, 1 - axis].tolist()
        along = np.linspace(low, high, max(2, int(np.ceil((high - low) / step)) + 1))
        places = np.empty((len(along), 2))
        places[:, axis], places[:, 1 - axis] = frame[end, axis], along
        reach = float(np.max(tree.query(places)[0])) + step
        close = np.flatnonzero(np.abs(points[:, axis] - frame[end, axis]) <= reach)
        mirrored = points[close].copy()
        mirrored[:, axis] = 2.0 * frame[end, axis] - mirrored[:, axis]
        images.append(mirrored)
        original.append(close)
        sides.append(np.full(len(close), side))
    return np.concatenate(images), np.concatenate(original), np.concatenate(sides)


def _lengths(diagram: Voronoi) -> Array:
    """Return the lengths (n,) of the ridges, zero for those without an end [m]."""
    ends = np.asarray(diagram.ridge_vertices)
    apart = np.linalg.norm(diagram.vertices[ends[:, 1]] - diagram.vertices[ends[:, 0]], axis=1)
    out: Array = np.where((ends >= 0).all(axis=1), apart, 0.0)
    return out


def _in_one_piece(owner: Ints, pairs: Ints, lengths: Array) -> Ints:
    """Return the owners of samples, those of stray pieces of a stone's region given to the stone around them."""
    owner = owner.copy()
    for _ in range(8):
        same = owner[pairs[:, 0]] == owner[pairs[:, 1]]
        linked = pairs[same]
        graph = coo_array((np.ones(len(linked)), (linked[:, 0], linked[:, 1])), shape=(len(owner),) * 2)
        count, piece = connected_components(graph, directed=False)
        sizes = np.bincount(piece, minlength=count)
        of_piece = np.zeros(count, np.int64)
        of_piece[piece] = owner
        main = np.zeros(owner.max() + 1, np.int64)
        for number in np.argsort(sizes, kind="stable").tolist():
            main[of_piece[number]] = number
        stray = main[owner] != piece
        if not stray.any():
            break
        weights: dict[int, dict[int, float]] = defaultdict(lambda: defaultdict(float))
        across = pairs[~same]
        for (a, b), length in zip(across.tolist(), lengths[~same].tolist(), strict=True):
            for first, second in ((a, b), (b, a)):
                if stray[first]:
                    weights[int(piece[first])][int(owner[second])] += length
        for number, beside in weights.items():
            owner[piece == number] = max(beside, key=lambda stone: beside[stone])
    return owner


def _on_frame(vertices: Array, ends: Ints, sides: Ints, frame: Array) -> Array:
    """Return the vertices with those on the sides of the frame exactly on them."""
    out = vertices.copy()
    for side, (axis, end) in enumerate(((0, 0), (1, 0), (0, 1), (1, 1))):
        there = np.unique(ends[sides == side])
        out[there[there >= 0], axis] = frame[end, axis]
    return out


def _walk(vertices: Array, ends: Ints, labels: Ints, beside: Array) -> MedialLines:
    """Join ridges to lines between nodes: vertices where another number of ridges than two, or other stones, meet."""
    at: dict[int, list[int]] = defaultdict(list)
    for ridge, (a, b) in enumerate(ends.tolist()):
        at[a].append(ridge)
        at[b].append(ridge)
    pair = [tuple(label) for label in labels.tolist()]

    def is_node(vertex: int) -> bool:
        """Return whether lines meet or end at a vertex."""
        met = at[vertex]
        return len(met) != 2 or set(pair[met[0]]) != set(pair[met[1]])

    nodes = {vertex: k for k, vertex in enumerate(sorted(node for node in at if is_node(node)))}
    lines, used = list[Line](), np.zeros(len(ends), np.bool_)

    def follow(start: int, ridge: int) -> None:
        """Add the line that begins with a ridge at a node."""
        path, ridges, here = [start], list[int](), start
        while not used[ridge]:
            used[ridge] = True
            a, b = ends[ridge].tolist()
            here = b if here == a else a
            path.append(here)
            ridges.append(ridge)
            if here in nodes:
                break
            ridge = next((candidate for candidate in at[here] if not used[candidate]), ridge)
        places = vertices[path]
        ways = np.diff(places, axis=0)
        longest = int(np.argmax((ways**2).sum(axis=1)))
        run, off = ways[longest], beside[ridges[longest]] - places[longest]
        first, second = pair[ridges[longest]]
        left = run[0] * off[1] - run[1] * off[0] > 0.0
        sides = (first, second) if left else (second, first)
        lines.append(Line((nodes[path[0]], nodes[path[-1]]), places, *sides))

    for vertex in list(nodes):
        for ridge in at[vertex]:
            if not used[ridge]:
                follow(vertex, ridge)
    for ridge, (a, _) in enumerate(ends.tolist()):  # rings about a stone with one neighbour
        if not used[ridge]:
            ring = _ring(a, ridge, ends, at)
            farthest = max(ring, key=lambda one: float(((vertices[one] - vertices[a]) ** 2).sum()))
            for vertex in (a, farthest):
                nodes[vertex] = len(nodes)
            for vertex in (a, farthest):
                for edge in at[vertex]:
                    if not used[edge]:
                        follow(vertex, edge)
    return MedialLines(vertices[list(nodes)], tuple(lines), ())


def _ring(start: int, ridge: int, ends: Ints, at: dict[int, list[int]]) -> list[int]:
    ring, here = [start], start
    while True:
        a, b = ends[ridge].tolist()
        here = b if here == a else a
        if here == start:
            return ring
        ring.append(here)
        ridge = next(candidate for candidate in at[here] if candidate != ridge)
