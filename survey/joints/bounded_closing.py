"""Joint closing within a displacement bound: the joints that can be closed, and the resulting stones."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ground.errors import GeometryError
from survey.arrays import Array, Bools, Ints
from survey.conventions import MAX_ROUNDS, SAME
from survey.geometry._kernels.convexity import highest_corners
from survey.geometry.adjacency import SolidArrays
from survey.geometry.cutting import cut_stones, joins_three, moves
from survey.geometry.solids import Solid
from survey.joints.contact_planes import ContactPlanes, StoneFaces, contact_planes, some_links
from survey.joints.facing import FacingFaces, planes_of
from survey.joints.settings import JointSettings
from survey.joints.worn_sides import mended_planes
from survey.simplify.simplify import BlockyStone

_CORE = "infill"  # kind of the parts of the core of a wall
_INFERRED = ("rule", "kind", "structure")  # origins of a depth that nobody has measured on the stone itself
_BOTH_KEPT = "both stones keep their shape"
_KEEPS_SHAPE = "one of the stones keeps its shape, and the other is led by its other joints"


@dataclass(frozen=True)
class LocalStones:
    """All stones, in coordinates about a place among them.

    Attributes
    ----------
    stones : simplified stones
    solids : their solids, about `origin`
    origin : (3,) [m]
    faces : of all solids
    planes : (nf, 4) of these
    convex : (n,) whether a stone may be cut
    notched : (n,) whether a stone is not convex but its faces may be moved; others keep their shape
    """

    stones: tuple[BlockyStone, ...]
    solids: tuple[Solid, ...]
    origin: Array
    faces: StoneFaces
    planes: Array
    convex: Bools
    notched: Bools

    def rows(self, stone: int) -> slice:
        """Return the range of the faces of a stone."""
        starts = self.faces.solids.solid_starts
        return slice(int(starts[stone]), int(starts[stone + 1]))


@dataclass(frozen=True)
class Cut:
    """Stones whose joints are closed as far as possible.

    Attributes
    ----------
    contact : plane of each pair of facing faces
    reasons : reason why each pair stays open; empty if it is closed
    solids : all stones
    planes : of each stone that may be cut or moved, (n, 4), those of its faces first
    free : of each of these stones, whether each plane touches no stone
    of_face : of each stone that was cut, plane of each face of its solid
    """

    contact: ContactPlanes
    reasons: list[str]
    solids: list[Solid]
    planes: dict[int, Array]
    free: dict[int, Bools]
    of_face: dict[int, tuple[int, ...]]


def as_building(stones: Sequence[BlockyStone]) -> LocalStones:
    """Express the stones in coordinates about a place among them.

    Raises
    ------
    GeometryError : if two stones have one code
    """
    codes: set[str] = set()
    for stone in stones:
        if stone.code in codes:
            raise GeometryError(
                "two stones have this code", where=f"stone {stone.code}", remedy="rename one of them"
            )
        codes.add(stone.code)
    origin = stones[0].solid.vertices.mean(axis=0)
    solids = tuple(replace(stone.solid, vertices=stone.solid.vertices - origin) for stone in stones)
    gathered = SolidArrays.gather((solid.vertices, solid.faces) for solid in solids)
    planes = planes_of(gathered)
    height, extent = highest_corners(*_arrays(gathered), planes.normals, planes.offsets)
    convex: Bools = height <= SAME * extent
    sound = np.concatenate([_sound(stone) for stone in stones])
    notched = ~convex & np.array([joins_three(solid.faces) for solid in solids])
    core = np.array([stone.kind == _CORE for stone in stones])
    slack = np.concatenate([_slack(stone) for stone in stones])
    kept = ~(convex | notched)[planes.owner]
    faces = StoneFaces(gathered, planes, sound, kept, core[planes.owner], slack)
    rows = np.column_stack([planes.normals, planes.offsets])
    return LocalStones(tuple(stones), solids, origin, faces, rows, convex, notched)


def close_within_bounds(
    building: LocalStones, facing: FacingFaces, settings: JointSettings, known: Sequence[Solid]
) -> Cut:
    """Close the joints of a building, except those that would move a corner farther than the bound.

    Parameters
    ----------
    building : the stones
    facing : pairs of faces that face each other
    settings : bounds
    known : the stones with their joints closed, as far as known so far
    """
    notched = set(np.flatnonzero(building.notched).tolist())
    reasons, unmended = [""] * len(facing), set[int]()
    for number in range(MAX_ROUNDS + len(building.stones)):
        links = np.array([k for k, reason in enumerate(reasons) if not reason], np.int64)
        some = contact_planes(building.faces, some_links(facing, links), settings)
        for k in links[some.of_link < 0].tolist():
            reasons[k] = _BOTH_KEPT if building.faces.kept[facing.faces[k]].all() else _KEEPS_SHAPE
        contact = _of_all(some, links, len(facing))
        planes, free = _stone_planes(building, facing, contact, known, settings)
        planes |= {i: building.planes[building.rows(i)] for i in unmended if free[i].all()}
        touched = {i: rows for i, rows in planes.items() if _changed(building, i, rows)}
        solids, offended = list(building.solids), False
        of_face = {}
        for i, stone in cut_stones(building.solids, touched, notched).items():
            moved = np.inf if stone is None else _moved(building, i, stone.solid, planes[i])
            if stone is not None and moved <= settings.max_displacement:
                solids[i], of_face[i] = stone.solid, stone.of_face
            else:
                offended = True
                if free[i].all():
                    unmended.add(i)
                else:
                    _leave_open(building, facing, contact, i, moved, settings, reasons, number >= MAX_ROUNDS)
        if not offended:
            break
    return Cut(contact, reasons, solids, planes, free, of_face)


def _sound(stone: BlockyStone) -> Bools:
    """Return the corners known from measurement; a hidden one counts if the one in front of it does."""
    count, sound = len(stone.solid.vertices), np.array(stone.sound, np.bool_)
    return np.tile(sound, -(-count // len(sound)))[:count]


def _slack(stone: BlockyStone) -> Array:
    """Return the distance by which each face may be wrong, as a hidden side of a stone whose depth is inferred [m]."""
    if stone.depth.origin not in _INFERRED:
        return np.zeros(len(stone.solid.faces))
    first = len(stone.sound)
    hidden = np.array([min(face) >= first for face in stone.solid.faces])
    sigma = np.inf if stone.depth.sigma is None else stone.depth.sigma
    return np.where(hidden, sigma, 0.0)


def _arrays(solids: SolidArrays) -> tuple[Array, Ints, Ints, Ints]:
    return solids.vertices, solids.corners, solids.face_starts, solids.solid_starts


def _of_all(some: ContactPlanes, links: Ints, count: int) -> ContactPlanes:
    """Return the planes of some pairs as planes of all pairs."""
    of_link, side = np.full(count, -1), np.ones(count, np.int64)
    of_link[links], side[links] = some.of_link, some.side
    return ContactPlanes(some.normals, some.offsets, of_link, side)


def _stone_planes(
    building: LocalStones,
    facing: FacingFaces,
    contact: ContactPlanes,
    solids: Sequence[Solid],
    settings: JointSettings,
) -> tuple[dict[int, Array], dict[int, Bools]]:
    """Return the planes of each convex stone: of its faces in order, from joints or its own, then further joints'."""
    taken = np.zeros(len(building.planes), np.bool_)
    taken[facing.faces[contact.of_link >= 0]] = True
    neighbours = building.faces.planes.owner[facing.faces[contact.of_link >= 0]]
    rows = mended_planes(
        building.faces, building.planes, ~taken, neighbours, solids, settings.max_displacement
    )
    taken[:] = False
    further: dict[int, list[Array]] = {}
    placed: set[tuple[int, int]] = set()
    for k in np.flatnonzero(contact.of_link >= 0).tolist():
        plane = int(contact.of_link[k])
        row = np.array([*contact.normals[plane], contact.offsets[plane]])
        for face, side in zip(facing.faces[k].tolist(), (contact.side[k], -contact.side[k]), strict=True):
            if (face, plane) in placed:
                continue
            placed.add((face, plane))
            if taken[face]:
                further.setdefault(int(building.faces.planes.owner[face]), []).append(side * row)
            else:
                rows[face], taken[face] = side * row, True
    planes, free = {}, {}
    for i in np.flatnonzero(building.convex | building.notched).tolist():
        more = np.array(further.get(i, [])).reshape(-1, 4)
        planes[i] = np.vstack([rows[building.rows(i)], more])
        free[i] = np.concatenate([~taken[building.rows(i)], np.zeros(len(more), np.bool_)])
    return planes, free


def _moved(building: LocalStones, stone: int, solid: Solid, planes: Array) -> float:
    """Return how far a corner moves; of the core, how far it comes to lie from the surface [m].

    Two sides of a core block that come to lie in one plane have no corner between them any more; nobody measured it.
    """
    old = building.solids[stone]
    if building.stones[stone].kind != _CORE:
        return float(moves(old, solid).max())
    return float(np.abs((old.vertices @ planes[:, :3].T - planes[:, 3]).max(axis=1)).max())


def _changed(building: LocalStones, stone: int, planes: Array) -> bool:
    """Return whether a stone has other planes than those of its faces."""
    own = building.planes[building.rows(stone)]
    return len(planes) != len(own) or not np.array_equal(planes, own)


def _leave_open(
    building: LocalStones,
    facing: FacingFaces,
    contact: ContactPlanes,
    stone: int,
    moved: float,
    settings: JointSettings,
    reasons: list[str],
    all_of_it: bool,
) -> None:
    """Leave open the joint of a stone whose plane is farthest from the face it replaces, or all its joints."""
    mine = building.faces.planes.owner[facing.faces] == stone
    rows = np.flatnonzero(mine.any(axis=1) & (contact.of_link >= 0))
    if np.isinf(moved):
        why = f"closing its joints would leave nothing of {building.stones[stone].code}"
    else:
        why = (
            f"it would move a corner of {building.stones[stone].code} by {moved * 1e3:.0f} mm, more than "
            f"{settings.max_displacement * 1e3:.0f} mm"
        )
    distance = np.zeros(len(rows))
    for n, k in enumerate(rows.tolist()):
        face = int(facing.faces[k][mine[k]][0])
        corners = building.faces.solids.vertices[building.faces.corners(face)]
        plane = int(contact.of_link[k])
        distance[n] = np.abs(corners @ contact.normals[plane] - contact.offsets[plane]).max()
    least = 0.0 if all_of_it else float(distance.max()) - 1e-12
    for k in rows[distance >= least].tolist():
        reasons[k] = why
