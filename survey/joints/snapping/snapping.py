"""Snapping of solids with rounded coordinates: matching faces of neighbours come to lie in one plane.

Faces that belong together are found first (`survey.joints.snapping.matching_faces`). Then corners and planes are
adjusted together (`survey.geometry.plane_network`); each stone keeps its corners, edges and faces, and all faces become
planar to the last digit. Where a corner would have to move farther than the tolerance, its constraints are released
one after another until it stays: first corners of folds and planes that are common only at a seam, then the planarity
of a free face, which is folded, and last the contact itself, which is left open and listed.
"""

from collections import Counter
from collections.abc import Iterator, Sequence, Set
from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from ground.errors import UsageError
from survey.arrays import Array, Ints
from survey.conventions import EPSILON
from survey.geometry.convexity import is_convex, reflex_edges
from survey.geometry.folds import fold
from survey.geometry.plane_network import Settled, settle
from survey.geometry.solids import Solid
from survey.joints.snapping.matching_faces import Match, common_planes, find_matches
from survey.records.snapping import OpenContact, Snapping

Polygon = tuple[int, ...]


def snap(solids: Sequence[Solid], tolerance: float) -> tuple[tuple[Solid, ...], Snapping]:
    """Bring matching faces of solids into common planes.

    Parameters
    ----------
    solids : closed, their faces planar within the tolerance
    tolerance : largest displacement of a corner, and largest distance of matching faces from one plane [m]

    Returns
    -------
    the solids, with the same corners in the same order, and a report of the changes

    Raises
    ------
    UsageError : if the tolerance is not positive
    """
    if not tolerance > 0.0:
        raise UsageError(
            f"the tolerance of snapping is {tolerance:g} m", remedy="give a positive one, or leave it out"
        )
    assembly = _Assembly(solids, tolerance)
    assembly.settle()
    return assembly.solids(), assembly.report()


class _Assembly:
    """All solids with their corners and faces numbered consecutively, and their constraints."""

    def __init__(self, solids: Sequence[Solid], tolerance: float) -> None:
        self._given, self._tolerance = solids, tolerance
        starts = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
        self._starts = starts
        self._vertices = np.concatenate([solid.vertices for solid in solids])
        self._size = float(np.abs(self._vertices - self._vertices.mean(axis=0)).max())
        self._faces: list[Polygon] = [
            tuple(int(starts[k]) + i for i in face) for k, solid in enumerate(solids) for face in solid.faces
        ]
        self._owner = [k for k, solid in enumerate(solids) for _ in solid.faces]
        self._folded: Counter[int] = Counter()
        self._gone: set[int] = set()  # faces that were folded: their pieces follow at the end
        self._matches = list(find_matches(solids, tolerance))
        touching = {k for match in self._matches if match.area > 0.0 for k in match.faces}
        self._folds = _meeting_corners(solids, touching, 2.0 * tolerance)
        self._open: list[tuple[Match, str]] = []
        self._plane: list[int] = []
        self._settled = Settled(self._vertices, np.empty((0, 3)), np.empty(0))

    def settle(self) -> None:
        """Move corners onto their planes; release constraints that would move one too far."""
        while True:  # each round releases a constraint, and unmatched triangles stay in place
            self._join()
            corner, plane = self._incidences()
            if not len(corner):
                return
            self._settled = settle(self._vertices, corner, plane)
            moved = np.linalg.norm(self._settled.vertices - self._vertices, axis=1)
            np.maximum.at(moved, corner[np.abs(self._settled.residual) > EPSILON * self._size], np.inf)
            if moved.max() <= self._tolerance:
                return
            self._let_go(moved)

    def _join(self) -> None:
        """Assign a plane to each face."""
        corners = [self._vertices[list(face)] for face in self._faces]
        self._plane, apart = common_planes(corners, self._owner, self._matches, self._tolerance)
        for match in apart:
            self._matches.remove(match)
            self._open.append((match, "others that share their planes are too far from a common one"))

    def _incidences(self) -> tuple[Ints, Ints]:
        """Return the corner and plane of each incidence; an unmatched triangle needs no plane."""
        count = Counter(self._plane[k] for k in self._present())
        planes: dict[int, set[int]] = {}
        for k in self._present():
            if len(self._faces[k]) > 3 or count[self._plane[k]] > 1:
                for i in self._faces[k]:
                    planes.setdefault(i, set()).add(self._plane[k])
        for i, others in self._folds.items():
            planes[i] |= {p for j in others for p in planes.get(j, ()) if count[p] > 1}
        column_of: dict[int, int] = {}
        rows = [
            (i, column_of.setdefault(p, len(column_of))) for i in sorted(planes) for p in sorted(planes[i])
        ]
        table = np.array(rows, dtype=np.int64).reshape(-1, 2)
        return table[:, 0], table[:, 1]

    def _present(self) -> Iterator[int]:
        return (k for k in range(len(self._faces)) if k not in self._gone)

    def _let_go(self, moved: Array) -> None:
        """Release one constraint at each corner that moves too far, only the worst of those with a common plane."""
        at: dict[int, list[int]] = {}
        for k in self._present():
            for i in self._faces[k]:
                at.setdefault(i, []).append(k)
        touched: set[int] = set()
        for i in np.argsort(-moved, kind="stable").tolist():
            if moved[i] <= self._tolerance:
                return
            planes = {self._plane[k] for k in at[i]}
            if not planes & touched:
                touched |= planes
                self._loosen(i, at[i], planes, float(moved[i]))

    def _loosen(self, corner: int, faces: list[int], planes: set[int], moved: float) -> None:
        turned = {i for k in self._present() if self._plane[k] in planes for i in self._faces[k]}
        folds = {corner} & self._folds.keys() or turned & self._folds.keys()
        if folds:
            self._folds = {i: others for i, others in self._folds.items() if i not in folds}
            return
        seams = [
            match for match in self._matches if not match.area > 0.0 and self._plane[match.faces[0]] in planes
        ]
        if seams:
            self._matches = [match for match in self._matches if match not in seams]
            return
        tied = {k for match in self._matches for k in match.faces}
        free = [k for k in faces if k not in tied and len(self._faces[k]) > 3]
        if free:
            self._fold(max(free, key=lambda k: len(self._faces[k])))
            return
        matches = [match for match in self._matches if set(match.faces) & set(faces)]
        worst = max(matches, key=lambda one: one.spread)
        self._matches.remove(worst)
        self._open.append((worst, f"it would move a corner by {moved:.3g} m"))

    def _fold(self, face: int) -> None:
        pieces = fold(self._vertices, self._faces[face], -1.0)
        self._gone.add(face)
        self._faces += pieces
        self._owner += [self._owner[face]] * len(pieces)
        self._plane += [-1] * len(pieces)  # until planes are assigned again
        self._folded[self._owner[face]] += 1

    def solids(self) -> tuple[Solid, ...]:
        """Return the current solids."""
        faces: list[list[Polygon]] = [[] for _ in self._given]
        for k in self._present():
            owner = self._owner[k]
            faces[owner].append(tuple(i - int(self._starts[owner]) for i in self._faces[k]))
        return tuple(
            replace(one, vertices=self._settled.vertices[start:stop].copy(), faces=tuple(faces[k]))
            for k, (one, start, stop) in enumerate(
                zip(self._given, self._starts[:-1], self._starts[1:], strict=True)
            )
        )

    def report(self) -> Snapping:
        """Return a report of the changes."""
        moved = np.linalg.norm(self._settled.vertices - self._vertices, axis=1)
        shared = {self._plane[match.faces[0]] for match in self._matches if match.area > 0.0}
        return Snapping(
            self._tolerance,
            sum(match.area > 0.0 for match in self._matches),
            len(shared),
            {
                one.code: float(moved[start:stop].max())
                for one, start, stop in zip(self._given, self._starts[:-1], self._starts[1:], strict=True)
            },
            {self._given[k].code: count for k, count in sorted(self._folded.items())},
            tuple(
                OpenContact(
                    (self._given[match.solids[0]].code, self._given[match.solids[1]].code), match.area, why
                )
                for match, why in self._open
            ),
        )


def _meeting_corners(solids: Sequence[Solid], touching: Set[int], reach: float) -> dict[int, tuple[int, ...]]:
    """Find the corners of folds between touching faces, and the corners of other solids that meet them.

    Convex stones on opposite sides of a plane never overlap, wherever their corners lie in it. Where a non-convex stone
    touches others on both sides of a fold, the plane of one side does not keep the neighbour on the other from reaching
    around the edge into the stone, unless the plane between the two neighbours passes through that very edge. So the
    corners of the fold lie on the planes of all stones that meet there.

    Parameters
    ----------
    solids : closed
    touching : numbers of the faces that touch others, counted through all solids
    reach : largest distance of corners that meet [m]

    Returns
    -------
    for each corner of a fold, counted through all solids, the nearest corner of each other solid within reach
    """
    starts = np.cumsum([0, *(len(solid.vertices) for solid in solids)])
    first_face = np.cumsum([0, *(len(solid.faces) for solid in solids)])
    folds = {
        int(starts[k]) + i
        for k, solid in enumerate(solids)
        if not is_convex(solid)
        for edge in reflex_edges(solid)
        if {int(first_face[k]) + edge.first, int(first_face[k]) + edge.second} <= touching
        for i in edge.corners
    }
    if not folds:
        return {}
    vertices = np.concatenate([solid.vertices for solid in solids])
    owner = np.repeat(np.arange(len(solids)), np.diff(starts))
    tree = cKDTree(vertices)
    corners = {}
    for i in sorted(folds):
        close = tree.query_ball_point(vertices[i], reach)
        close.sort(key=lambda j: (float(np.linalg.norm(vertices[j] - vertices[i])), j))
        nearest: dict[int, int] = {}
        for j in close:
            nearest.setdefault(int(owner[j]), j)
        corners[i] = tuple(j for key, j in nearest.items() if key != owner[i])
    return {i: others for i, others in corners.items() if others}
