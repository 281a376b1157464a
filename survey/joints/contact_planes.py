"""Contact planes of a building's joints: one for each straight bed, whatever the bond.

Faces that face each other in a chain make one joint: the tops of a course and the undersides of the next, the two
sides of a head joint, springers and voussoir at a skewback. So do faces of neighbours that continue each other, where
four stones meet at a cross. All of them are fitted together, so that a course stays a course. A bed that is not
straight becomes several planes that meet at head joints (`survey.joints.bent_beds`). Where that fails as well, the
few stones that are off are moved to the plane of the others; if they are not few, each pair of stones gets its own
plane.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from survey.arrays import Array, Bools, Ints
from survey.conventions import MOST, ON_PLANE, PARALLEL, SOME
from survey.geometry.adjacency import SolidArrays
from survey.joints._kernels import KNOWN, FaceCorners, continuing_faces, fit_middle_planes
from survey.joints.bent_beds import fit_bent_bed
from survey.joints.facing import FacePlanes, FacingFaces
from survey.joints.hidden_sides import HiddenSides, common_planes
from survey.joints.settings import JointSettings

_ALIKE = math.cos(PARALLEL)  # largest angle between faces of neighbours that continue each other
_MAX_OFF_SHARE = SOME  # largest part of the corners of a joint that may be off it
_FINE = MOST  # of the straightness: distance within which the inliers of a straight bed lie


@dataclass(frozen=True)
class StoneFaces:
    """Faces of all stones, and their measured corners.

    Attributes
    ----------
    solids : as they were surveyed, about a place among them
    planes : of their faces
    sound : (nv,) whether a corner is known from measurement
    kept : (nf,) whether a face has to stay in place
    core : (nf,) whether a face is of the core of a wall, which nobody has measured
    slack : (nf,) distance by which the plane of a hidden side may be wrong, as its depth was not measured; else 0 [m]
    """

    solids: SolidArrays
    planes: FacePlanes
    sound: Bools
    kept: Bools
    core: Bools
    slack: Array

    def corners(self, face: int) -> Ints:
        """Return the vertex indices of a face's corners."""
        starts = self.solids.face_starts
        return self.solids.corners[starts[face] : starts[face + 1]]


@dataclass(frozen=True)
class ContactPlanes:
    """Planes n·x = d of joints, and the plane of each pair of faces.

    Attributes
    ----------
    normals, offsets : (np, 3) unit [-], (np,) [m]
    of_link : (m,) plane of each pair of facing faces; -1 for none
    side : (m,) +1 if the plane's normal points out of the first of the two faces, -1 if into it
    """

    normals: Array
    offsets: Array
    of_link: Ints
    side: Ints


@dataclass(frozen=True)
class _Groups:
    """Faces of several joints, concatenated: (k,) face, side ±1; (n + 1,) starts; normals (n, 3)."""

    faces: Ints
    hands: Array
    starts: Ints
    normals: Array


def contact_planes(faces: StoneFaces, facing: FacingFaces, settings: JointSettings) -> ContactPlanes:
    """Find the contact plane of each pair of facing faces.

    Faces that have to stay in place take no part in the fit. A face whose only joint is with them moves to their
    plane; one with other joints meets them only if it already lies in their plane. Nor do those of the core, which
    follow the stones. It has two effects on these, where nothing was measured: beds of a course on its two sides get
    one plane if one fits them, and so do hidden sides that continue each other.

    Parameters
    ----------
    faces : of all stones
    facing : pairs of facing faces
    settings : tolerance of a corner from its side of a straight joint
    """
    builder = _Found(faces, facing, [], [], np.full(len(facing), -1))
    stays = faces.kept[facing.faces]
    movable, core = ~stays.any(axis=1), faces.core[facing.faces]
    _add_joints(
        builder,
        np.flatnonzero(movable & ~core.any(axis=1)),
        settings,
        np.flatnonzero(movable & core.any(axis=1)),
    )
    for link in np.flatnonzero(~movable).tolist():
        builder.add_kept(link, stays[link])
    beside = np.flatnonzero(movable & (core[:, 0] != core[:, 1]))
    _add_hidden_sides(builder, beside, settings)
    for link in beside.tolist():
        builder.add_beside_core(link, int(facing.faces[link, int(core[link, 0])]))
    alone = np.flatnonzero(movable & core.all(axis=1)).tolist()
    count = -1
    while len(alone) != count:
        # a plane goes on from block to block, to those that touch no stone
        count = len(alone)
        alone = [link for link in alone if not builder.add_in_core(link)]
    _add_joints(builder, np.array(alone, np.int64), settings)
    return builder.planes()


def _add_hidden_sides(builder: "_Found", links: Ints, settings: JointSettings) -> None:
    """Add one plane for all hidden sides that continue each other, among those that touch nothing but the core."""
    faces, facing = builder.faces, builder.facing
    side = facing.faces[links, faces.core[facing.faces[links]].argmin(axis=1)]
    taken = np.zeros(len(faces.slack), np.bool_)
    taken[facing.faces[builder.of_link >= 0]] = True
    hidden = np.unique(side[(faces.slack[side] > 0.0) & ~taken[side]])
    if not len(hidden):
        return
    place = np.full(len(faces.slack), -1)
    place[hidden] = np.arange(len(hidden))
    between = facing.faces[builder.of_link >= 0]
    between = between[~faces.core[between].any(axis=1)]
    pairs = place[_continuing(faces, between, place >= 0, settings)]
    planes = np.column_stack([faces.planes.normals[hidden], faces.planes.offsets[hidden]])
    corners = [faces.solids.vertices[faces.corners(face)] for face in hidden.tolist()]
    starts = np.cumsum([0, *map(len, corners)])
    slack = np.minimum(faces.slack[hidden], settings.straightness)
    common, number = common_planes(HiddenSides(np.concatenate(corners), starts, planes, slack), pairs)
    rows = np.flatnonzero(place[side] >= 0)
    builder.add_many(common, links[rows], number[place[side[rows]]])


def _add_joints(builder: "_Found", links: Ints, settings: JointSettings, core: Ints | None = None) -> None:
    """Add the planes of the joints of these links; beds that links of the `core` tie are one if that is straight."""
    faces, facing = builder.faces, some_links(builder.facing, links)
    label = _joints(faces, facing, settings)
    if core is not None and len(core) and len(links):
        label = _through_core(faces, facing, label, builder.facing.faces[core], settings)
    count = int(label.max()) + 1 if len(label) else 0
    groups = _gathered(faces, facing, label, count)
    planes, values = _fitted(faces, groups, -1.0, settings)
    usual = float(np.median(values[:, 0])) if count else 0.0
    few = np.flatnonzero(_few_known(faces, groups))
    planes[few], values[few] = _fitted(faces, _some_groups(groups, few), usual, settings)
    few_are_odd = (values[:, 3] <= _MAX_OFF_SHARE) & (values[:, 4] <= _FINE * settings.straightness)
    straight = (values[:, 2] <= settings.straightness) | few_are_odd
    builder.add_many(
        planes[straight], links[straight[label]], (np.cumsum(straight)[label] - 1)[straight[label]]
    )
    order = np.argsort(label, kind="stable")
    first = np.searchsorted(label[order], np.arange(count + 1))
    for joint in np.flatnonzero(~straight).tolist():
        joint_links = links[order[first[joint] : first[joint + 1]]]
        if builder.add_bent(joint_links, settings, float(values[joint, 3])):
            continue
        if values[joint, 3] <= _MAX_OFF_SHARE:
            builder.add_many(planes[[joint]], joint_links, np.zeros(len(joint_links), np.int64))
        else:
            builder.add_each(joint_links, usual, settings)


@dataclass
class _Found:
    """Planes found so far."""

    faces: StoneFaces
    facing: FacingFaces
    normals: list[Array]
    offsets: list[float]
    of_link: Ints

    def add_many(self, planes: Array, links: Ints, number: Ints) -> None:
        """Add planes (n, 4), and the plane (m,) of each link."""
        self.of_link[links] = len(self.normals) + number
        self.normals += list(planes[:, :3])
        self.offsets += planes[:, 3].tolist()

    def add_bent(self, links: Ints, settings: JointSettings, off: float) -> bool:
        """Add several planes for a bent joint; return False if no chain of planes fits it."""
        bed = fit_bent_bed(
            self.faces.solids, self.faces.planes, self.faces.sound, self.facing, links, settings, off
        )
        if bed is None:
            return False
        self.add_many(bed[0], links, bed[1])
        return True

    def add_each(self, links: Ints, usual: float, settings: JointSettings) -> None:
        """Add a plane for each pair."""
        part, number = some_links(self.facing, links), np.arange(len(links))
        planes, _ = _fitted(self.faces, _gathered(self.faces, part, number, len(links)), usual, settings)
        self.add_many(planes, links, number)

    def add_kept(self, link: int, keeps: Bools) -> None:
        """Add a pair with a face that must stay: its plane, if the other face lies in it or has no other joint."""
        first, second = self.facing.faces[link].tolist()
        stays, moves = (first, second) if keeps[0] else (second, first)
        plane = np.array([*self.faces.planes.normals[stays], self.faces.planes.offsets[stays]])
        if keeps.all():
            theirs = -np.array([*self.faces.planes.normals[moves], self.faces.planes.offsets[moves]])
            if self._same(plane, theirs, stays):
                self.add_many(plane[None], np.array([link]), np.zeros(1, np.int64))
            return
        beside = np.flatnonzero((self.facing.faces == moves).any(axis=1) & (self.of_link >= 0))
        planes = {int(self.of_link[k]) for k in beside}
        if not planes:
            self.add_many(plane[None], np.array([link]), np.zeros(1, np.int64))
        for number in planes:
            theirs = np.array([*self.normals[number], self.offsets[number]])
            if self._same(plane, theirs, stays) or self._same(plane, -theirs, stays):
                self.of_link[link] = number

    def add_beside_core(self, link: int, stone: int) -> None:
        """Add a pair of the face of a stone and one of the core: the plane of that face."""
        nearest = self._nearest(link, (stone,))
        if nearest is not None:
            self.of_link[link] = nearest
        else:
            plane = np.array([[*self.faces.planes.normals[stone], self.faces.planes.offsets[stone]]])
            self.add_many(plane, np.array([link]), np.zeros(1, np.int64))
        for face in self.facing.faces[link].tolist():
            self._of_face.setdefault(face, set()).add(int(self.of_link[link]))

    def add_in_core(self, link: int) -> bool:
        """Add a pair of faces of the core: the plane that one has beside a stone; return False if none has."""
        first, second = self.facing.faces[link].tolist()
        nearest = self._nearest(link, (first, second))
        if nearest is None:
            return False
        self.of_link[link] = nearest
        for face in (first, second):
            self._of_face.setdefault(face, {nearest})
        return True

    def _nearest(self, link: int, faces: tuple[int, ...]) -> int | None:
        """Return the plane of these faces that is nearest to the middle of a joint; None if they have none."""
        planes = set[int]().union(*(self._of_face.get(face, ()) for face in faces))
        middle = self.facing.centroid[link]
        return min(planes, key=lambda k: abs(self.normals[k] @ middle - self.offsets[k]), default=None)

    @cached_property
    def _of_face(self) -> dict[int, set[int]]:
        """Planes of the joints of each face of a stone."""
        planes: dict[int, set[int]] = {}
        for link in np.flatnonzero(self.of_link >= 0).tolist():
            for face in self.facing.faces[link].tolist():
                planes.setdefault(face, set()).add(int(self.of_link[link]))
        return planes

    def _same(self, plane: Array, second: Array, face: int) -> bool:
        """Return whether a face also lies in another plane, within rounding."""
        corners = self.faces.solids.vertices[self.faces.corners(face)]
        alike = float(plane[:3] @ second[:3]) > 0.0
        return alike and bool(np.abs(corners @ second[:3] - second[3]).max() <= ON_PLANE)

    def planes(self) -> ContactPlanes:
        """Return all planes found, with the side of each on which the first face of each pair lies."""
        normals = np.array(self.normals).reshape(-1, 3)
        outward = self.faces.planes.normals[self.facing.faces[:, 0]]
        linked = self.of_link >= 0
        side = np.ones(len(self.of_link), np.int64)
        side[linked] = np.where((normals[self.of_link[linked]] * outward[linked]).sum(axis=1) > 0.0, 1, -1)
        return ContactPlanes(normals, np.array(self.offsets), self.of_link, side)


def some_links(facing: FacingFaces, links: Ints) -> FacingFaces:
    """Return these pairs only."""
    return replace(
        facing,
        faces=facing.faces[links],
        area=facing.area[links],
        gap=facing.gap[links],
        centroid=facing.centroid[links],
        normal=facing.normal[links],
    )


def _joints(faces: StoneFaces, facing: FacingFaces, settings: JointSettings) -> Ints:
    """Return the number (m,) of the joint of each pair, in the order of their first pair."""
    if not len(facing):
        return np.zeros(0, np.int64)
    count = len(faces.planes.areas)
    joined = np.zeros(count, np.bool_)
    joined[facing.faces] = True
    pairs = np.concatenate([facing.faces, _continuing(faces, facing.faces, joined, settings)])
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    _, first, number = np.unique(label[facing.faces[:, 0]], return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first))
    out: Ints = rank[number]
    return out


def _through_core(
    faces: StoneFaces, facing: FacingFaces, label: Ints, core: Ints, settings: JointSettings
) -> Ints:
    """Return the joints (m,) of all pairs, merging the bed joints of both facings across the core.

    Beds merge where one plane fits both. How a bed slopes into a wall is not measured at all: where the course is the
    same on both sides, one plane goes through both visible edges, as where a stone passes through. Of two planes, one
    above the other by a millimetre, the core could bear on one alone.
    """
    count, joints = len(faces.planes.areas), int(label.max()) + 1
    level = (np.abs(faces.planes.normals[core][:, :, 2]) > _ALIKE).all(axis=1)
    # a face of a stone stands for its joint, so that nodes are the joints and the faces of the core
    node = np.where(faces.core, joints + np.arange(count), -1)
    node[facing.faces] = label[:, None]
    ties = node[core[level]]
    ties = ties[(ties >= 0).all(axis=1)]
    graph = coo_array((np.ones(len(ties)), (ties[:, 0], ties[:, 1])), shape=(joints + count, joints + count))
    _, group = connected_components(graph, directed=False)
    _, group = np.unique(group[:joints], return_inverse=True)
    of_link, groups = group[label], int(group.max()) + 1
    _, values = _fitted(faces, _gathered(faces, facing, of_link, groups), -1.0, settings)
    straight = values[:, 2] <= settings.straightness
    merged = np.where(straight[of_link], of_link, groups + label)
    _, first, number = np.unique(merged, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first))
    out: Ints = rank[number]
    return out


def _continuing(faces: StoneFaces, pairs: Ints, joined: Bools, settings: JointSettings) -> Ints:
    """Return the faces (m, 2), among those `joined`, of the owners of `pairs` (n, 2) that lie in one plane."""
    solids, planes = faces.solids, faces.planes
    found: Ints = continuing_faces(
        planes.owner[pairs],
        (solids.vertices, solids.corners, solids.face_starts, solids.solid_starts),
        planes.normals,
        planes.offsets,
        joined,
        _ALIKE,
        settings.straightness,
    )
    return found


def _gathered(faces: StoneFaces, facing: FacingFaces, label: Ints, count: int) -> _Groups:
    """Return the faces of each joint, without repetition, and the side of it on which they lie."""
    of_face = np.repeat(label, 2) * len(faces.planes.areas) + facing.faces.ravel()
    unique = np.unique(of_face)
    joint, face = np.divmod(unique, len(faces.planes.areas))
    starts = np.searchsorted(joint, np.arange(count + 1))
    largest = np.lexsort((face, -faces.planes.areas[face], joint))[starts[:-1]]
    reference = faces.planes.normals[face[largest]]
    hand = np.where((faces.planes.normals[face] * reference[joint]).sum(axis=1) > 0.0, -1.0, 1.0)
    weight = -hand * faces.planes.areas[face]
    mean = np.zeros((count, 3))
    np.add.at(mean, joint, weight[:, None] * faces.planes.normals[face])
    mean /= np.linalg.norm(mean, axis=1)[:, None]
    return _Groups(face, hand, starts, mean)


def _few_known(faces: StoneFaces, groups: _Groups) -> Bools:
    """Return which joints (n,) have fewer sound corners on a side than determine its distance from the other."""
    if not len(groups.normals):
        return np.zeros(0, np.bool_)
    begin = faces.solids.face_starts
    sound = np.concatenate([[0], np.cumsum(faces.sound[faces.solids.corners])])
    known = (sound[begin[1:]] - sound[begin[:-1]])[groups.faces]
    sides = [
        np.add.reduceat(np.where(groups.hands == hand, known, 0), groups.starts[:-1]) for hand in (1.0, -1.0)
    ]
    return np.minimum(*sides) < KNOWN


def _some_groups(groups: _Groups, joints: Ints) -> _Groups:
    """Return the faces of these joints (k,) only."""
    sizes = np.diff(groups.starts)[joints]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    rows = np.repeat(groups.starts[joints] - starts[:-1], sizes) + np.arange(starts[-1])
    return _Groups(groups.faces[rows], groups.hands[rows], starts, groups.normals[joints])


def _fitted(faces: StoneFaces, groups: _Groups, usual: float, settings: JointSettings) -> tuple[Array, Array]:
    """Return planes (n, 4) half-way between the two sides, and the kernel's values (n, 5)."""
    count = len(groups.normals)
    solids = faces.solids
    sizes = np.diff(solids.face_starts)[groups.faces]
    begin = np.repeat(solids.face_starts[groups.faces], sizes)
    within = np.arange(len(begin)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    corner = solids.corners[begin + within]
    face_joint = np.repeat(np.arange(count), np.diff(groups.starts))
    joint = np.repeat(face_joint, sizes)
    starts = np.searchsorted(joint, np.arange(count + 1))
    x = solids.vertices[corner]
    centre = np.zeros((count, 3))
    np.add.at(centre, joint, x)
    centre /= np.diff(starts)[:, None]
    axes = _frames(groups.normals)
    local = np.einsum("kij,kj->ki", axes[joint], x - centre[joint])
    scale = np.ones(count)
    np.maximum.at(scale, joint, np.abs(local[:, :2]).max(axis=1))
    planes, values = np.zeros((count, 3)), np.zeros((count, 5))
    corners = FaceCorners(
        np.ascontiguousarray(local), np.repeat(groups.hands, sizes), faces.sound[corner], starts, scale
    )
    fit_middle_planes(corners, usual, settings.straightness, planes, values)
    normal = axes[:, 2] - planes[:, 1:2] * axes[:, 0] - planes[:, 2:3] * axes[:, 1]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    offset = (normal * (centre + planes[:, :1] * axes[:, 2])).sum(axis=1)
    return np.column_stack([normal, offset]), values


def _frames(normals: Array) -> Array:
    """Return right-handed frames (n, 3, 3) whose last row is the normal."""
    least = np.eye(3)[np.abs(normals).argmin(axis=1)] if len(normals) else np.zeros((0, 3))
    first = np.cross(least, normals)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normals, first), normals], axis=1)
