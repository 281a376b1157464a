"""Detection of touching solids: faces that face each other across an open joint and overlap.

Two faces touch if their normals are opposite within `angle`, if the area they share, seen square to the joint
between them, is more than `share` of the smaller face, and if the mean distance of their planes over that shared
area is at most `width`; surveyed stones may also overlap a little. The joint's normal is the mean of the two
faces' normals; nothing is assumed about a wall or the direction of up.

The distance between two planes is linear along the joint, so its mean over an area is its value at the area's
centroid: the area and centroid of the polygons' intersection suffice.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np

from survey.arrays import Array, Bools, Ints
from survey.conventions import STEP
from survey.geometry._kernels.adjacency import GROUPS, face_planes, touching_faces
from survey.geometry._kernels.between import hidden, thinnest_of
from survey.geometry._kernels.boxes import count_near, list_near, morton_codes


@dataclass(frozen=True)
class SolidArrays:
    """Many closed solids with planar faces, one after the other.

    Attributes
    ----------
    vertices : (nv, 3) of all solids [m]
    corners : (nc,) indices into `vertices`, face by face, counter-clockwise seen from outside
    face_starts : (nf + 1,) index of the first corner of each face; last entry: number of corners
    solid_starts : (n + 1,) index of the first face of each solid; last entry: number of faces
    """

    vertices: Array
    corners: Ints
    face_starts: Ints
    solid_starts: Ints

    def __len__(self) -> int:
        return len(self.solid_starts) - 1

    @classmethod
    def gather(cls, solids: Iterable[tuple[Array, Sequence[Sequence[int]]]]) -> "SolidArrays":
        """Concatenate solids, each given by its vertices (nv, 3) and its faces."""
        builder = PolyhedraBuilder()
        for vertices, faces in solids:
            builder.add(vertices, tuple(tuple(face) for face in faces))
        return builder.build()


@dataclass
class PolyhedraBuilder:
    """Incremental builder of `SolidArrays`, which keeps only the numbers of each solid."""

    _vertices: bytearray = field(default_factory=bytearray)
    _corners: bytearray = field(default_factory=bytearray)
    _face_counts: bytearray = field(default_factory=bytearray)
    _solid_counts: list[int] = field(default_factory=list)
    _known: dict[tuple[tuple[int, ...], ...], tuple[Ints, bytes]] = field(default_factory=dict)

    def add(self, vertices: Array, faces: tuple[tuple[int, ...], ...]) -> None:
        """Add a solid: vertices (nv, 3), and faces counter-clockwise seen from outside."""
        if (topology := self._known.get(faces)) is None:
            corners = np.fromiter(chain.from_iterable(faces), dtype=np.int64)
            topology = corners, np.array([len(face) for face in faces], dtype=np.int64).tobytes()
            self._known[faces] = topology
        start = len(self._vertices) // 24
        self._vertices += np.ascontiguousarray(vertices, dtype=np.float64).tobytes()
        self._corners += (topology[0] + start).tobytes()
        self._face_counts += topology[1]
        self._solid_counts.append(len(faces))

    def build(self) -> SolidArrays:
        """Return all solids added so far."""
        counts = np.frombuffer(bytes(self._face_counts), dtype=np.int64)
        return SolidArrays(
            np.frombuffer(bytes(self._vertices)).reshape(-1, 3),
            np.frombuffer(bytes(self._corners), dtype=np.int64),
            np.concatenate([[0], np.cumsum(counts)]),
            np.cumsum([0, *self._solid_counts], dtype=np.int64),
        )


@dataclass(frozen=True)
class Touching:
    """Contacts of solids, in the order of their pairs; a pair that touches in two directions comes twice.

    Attributes
    ----------
    pairs : (m, 2) indices of the solids, smaller first
    area : (m,) shared area, seen square to the joint [m²]
    gap : (m,) mean width of the joint, negative where they overlap [m]
    normal : (m, 3) unit normal of the joint, from the second to the first [-]
    centroid : (m, 3) of the shared area, half-way between the two faces [m]
    """

    pairs: Ints
    area: Array
    gap: Array
    normal: Array
    centroid: Array

    def __len__(self) -> int:
        return len(self.pairs)


def find_touching(
    solids: SolidArrays,
    width: float = 0.04,
    angle: float = 12.0,
    *,
    overlap: float = STEP,
    share: float = 0.03,
    among: Bools | None = None,
) -> Touching:
    """Find the solids that face each other across a joint.

    Parameters
    ----------
    solids : closed, with planar faces of any number of corners, convex or not
    width : widest open joint [m]; at most half the thickness of either stone, and no third stone in it
    angle : largest angle between the two faces [degrees]
    overlap : depth by which solids may overlap [m]
    share : least part of the smaller face that the other covers [-]; below, they meet at an edge apart from noise
    among : (n,) solids of which at least one must be in a pair; None: all

    Returns
    -------
    Touching, independent of the solids' position except for rounding
    """
    wanted = np.ones(len(solids), np.bool_) if among is None else np.asarray(among, np.bool_)
    if len(solids) == 0 or not wanted.any():
        return _touching(np.zeros((0, 2), np.int64), np.zeros((0, 8)), np.zeros(3))
    origin = solids.vertices.min(axis=0)
    local = np.ascontiguousarray(solids.vertices - origin)
    local.flags.writeable = False  # as the solids' own vertices: a kernel is compiled once more for others
    planes = face_planes(local, solids.corners, solids.face_starts)
    solid = (local, solids.corners, solids.face_starts, solids.solid_starts)
    limits = (width, overlap, float(np.cos(np.radians(angle))), share, False)
    pairs, rows = [np.zeros((0, 2), np.int64)], [np.zeros((0, 8))]
    for pair in near_pairs(boxes_of(planes[2], solids.solid_starts, width), wanted):
        room = GROUPS * len(pair)
        touching, values = np.empty((room, 2), np.int64), np.empty((room, 8))
        count = touching_faces(pair, solid, planes, limits, touching, values)
        pairs.append(touching[:count].copy())
        rows.append(values[:count].copy())
    all_pairs, all_rows = np.concatenate(pairs), np.concatenate(rows)
    seen = open_to_each_other(all_pairs, all_rows, solid, planes, width)
    return _touching(all_pairs[seen], all_rows[seen], origin)


def open_to_each_other(pairs: Ints, rows: Array, solid: Any, planes: Any, width: float) -> Bools:
    """Return whether each contact (m,) has no third, thinner solid in it.

    Parameters
    ----------
    pairs, rows : solids (m, 2), and (m, 8) area, gap, place and normal of their contacts
    solid, planes : as the kernels take them
    width : widest joint [m]
    """
    thinnest = thinnest_of(solid, planes[0])
    if not (rows[:, 1] >= thinnest.min()).any():
        return np.ones(len(pairs), np.bool_)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    starts = np.searchsorted(both[:, 0], np.arange(len(thinnest) + 1))
    ranges = (starts, np.ascontiguousarray(both[:, 1]))
    out: Bools = ~hidden(pairs, rows, ranges, solid, planes, thinnest, 0.5 * width)
    return out


def _touching(pairs: Ints, rows: Array, origin: Array) -> Touching:
    order = np.lexsort((pairs[:, 1], pairs[:, 0]))
    return Touching(
        pairs=pairs[order],
        area=rows[order, 0],
        gap=rows[order, 1],
        normal=rows[order, 5:8],
        centroid=rows[order, 2:5] + origin,
    )


_PAIRS = 1 << 15  # neighbours examined at a time, which bounds the memory


def boxes_of(faces: Array, starts: Ints, width: float) -> Array:
    """Return the boxes (n, 6) of solids from those of their faces, wider by half a joint on all sides."""
    out = np.empty((len(starts) - 1, 6))
    out[:, :3] = np.minimum.reduceat(faces[:, :3], starts[:-1]) - 0.5 * width
    out[:, 3:] = np.maximum.reduceat(faces[:, 3:], starts[:-1]) + 0.5 * width
    return out


def near_pairs(boxes: Array, wanted: Bools) -> Iterator[Ints]:
    """Yield the pairs of overlapping boxes, about `_PAIRS` at a time."""
    centres = boxes[:, :3] + boxes[:, 3:]
    low, extent = centres.min(axis=0), np.ptp(centres, axis=0)
    # one scale for all axes, so that a flat wall is not stretched into a cube
    scale = np.full(3, (2.0**21 - 1.0) / max(float(extent.max()), 1e-300))
    order = np.argsort(morton_codes(centres, low, scale), kind="stable")
    size = 1 << max(len(boxes) - 1, 0).bit_length()
    tree = np.empty((2 * size, 6))
    tree[:, :3], tree[:, 3:] = np.inf, -np.inf
    tree[size : size + len(boxes)] = boxes[order]
    level = size
    while level > 1:
        level //= 2
        below = tree[2 * level : 4 * level].reshape(level, 2, 6)
        tree[level : 2 * level, :3] = below[:, :, :3].min(axis=1)
        tree[level : 2 * level, 3:] = below[:, :, 3:].max(axis=1)
    counts = count_near(tree, size, order, wanted)
    before = np.concatenate([[0], np.cumsum(counts)])
    start = 0
    while start < len(order):
        stop = int(np.searchsorted(before, before[start] + _PAIRS, side="right")) - 1
        stop = min(max(stop, start + 1), len(order))
        pairs = np.empty((int(before[stop] - before[start]), 2), np.int64)
        list_near(tree, size, order, wanted, start, stop, pairs)
        yield pairs
        start = stop
