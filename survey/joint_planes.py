"""The contact planes of a building's joints: one for each straight bed, whatever the bond.

Faces that face each other in turn make one joint: the tops of a course and the undersides of the next, the two
sides of a head joint, springers and voussoir at a skewback. So do faces of neighbours that continue each other, where
four stones meet at a cross. All of them are fitted together, so that a course stays a course. Where a bed is not
straight it is taken as several planes that meet at head joints (`survey.joint_bends`). Where that does not do either,
the few stones that are off are led to the plane of the others; if they are not few, each two stones have a plane of
their own.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from survey._kernels_continuing import continuing_faces
from survey._kernels_joint_planes import fit_middle_planes
from survey.adjacency import Polyhedra
from survey.facing import FacePlanes, FacingFaces
from survey.joint_bends import bent
from survey.joint_settings import JointSettings

__all__ = ["ContactPlanes", "StoneFaces", "contact_planes", "some_links"]

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Bools = NDArray[np.bool_]

_ALIKE = 0.985  # cosine of 10°: faces of neighbours that are turned by more do not continue each other
_FEW = 0.25  # part of the corners of a joint that may be off it
_SAME = 1e-9  # metres: faces of stones that keep their shape that are nearer lie in one plane


@dataclass(frozen=True)
class StoneFaces:
    """The faces of all stones, and what is known of them.

    Attributes
    ----------
    solids : as they were surveyed, about a place among them
    planes : of their faces
    sound : (nv,) whether a corner is known from measurement
    kept : (nf,) whether a face has to stay where it is
    """

    solids: Polyhedra
    planes: FacePlanes
    sound: Bools
    kept: Bools

    def corners(self, face: int) -> Indices:
        """Indices of a face's corners."""
        starts = self.solids.face_starts
        return self.solids.corners[starts[face] : starts[face + 1]]


@dataclass(frozen=True)
class ContactPlanes:
    """The planes n·x = d of joints, and which joint has which.

    Attributes
    ----------
    normals, offsets : (np, 3) unit [-], (np,) [m]
    of_link : (m,) plane of each pair of facing faces; -1 for one that has none
    side : (m,) +1 if the plane's normal leads out of the first of the two faces, -1 if into it
    """

    normals: Array
    offsets: Array
    of_link: Indices
    side: Indices


@dataclass(frozen=True)
class _Groups:
    """Faces of several joints, one after the other: (k,) face, hand ±1; (n + 1,) starts; normals (n, 3)."""

    faces: Indices
    hands: Array
    starts: Indices
    normals: Array


def contact_planes(faces: StoneFaces, facing: FacingFaces, settings: JointSettings) -> ContactPlanes:
    """Find the contact plane of each pair of facing faces.

    Parameters
    ----------
    faces : of all stones
    facing : the pairs
    settings : how far a corner may be off its side of a straight joint
    """
    label = _joints(faces, facing, settings)
    count = int(label.max()) + 1 if len(label) else 0
    groups = _gathered(faces, facing, label, count)
    _, values = _fitted(faces, groups, -1.0, settings)
    usual = float(np.median(values[:, 0])) if count else 0.0
    planes, values = _fitted(faces, groups, usual, settings)
    kept = _any_kept(faces, groups)
    straight = (values[:, 2] <= settings.straightness) & ~kept
    found = _Found(faces, facing, [], [], np.full(len(facing), -1))
    found.add_many(planes[straight], np.cumsum(straight)[label] - 1, straight[label])
    order = np.argsort(label, kind="stable")
    first = np.searchsorted(label[order], np.arange(count + 1))
    for joint in np.flatnonzero(~straight):
        links = order[first[joint] : first[joint + 1]]
        if not kept[joint] and found.add_bent(links, settings):
            continue
        if not kept[joint] and values[joint, 3] <= _FEW:
            found.add_many(planes[[joint]], np.zeros(len(label), np.int64), label == joint)
        else:
            found.add_each(links, usual, settings)
    return found.planes()


@dataclass
class _Found:
    """Planes found so far."""

    faces: StoneFaces
    facing: FacingFaces
    normals: list[Array]
    offsets: list[float]
    of_link: Indices

    def add_many(self, planes: Array, number: Indices, wanted: Bools) -> None:
        """Planes (n, 4) whose numbers are given for each link that is wanted."""
        start = len(self.normals)
        self.normals += list(planes[:, :3])
        self.offsets += planes[:, 3].tolist()
        self.of_link[wanted] = start + number[wanted]

    def add_bent(self, links: Indices, settings: JointSettings) -> bool:
        """A joint that is bent but not broken: several planes; False if that is not what it is."""
        found = bent(self.faces.solids, self.faces.planes, self.faces.sound, self.facing, links, settings)
        if found is None:
            return False
        planes, number = found
        wanted = np.zeros(len(self.of_link), np.bool_)
        wanted[links] = True
        spread = np.zeros(len(self.of_link), np.int64)
        spread[links] = number
        self.add_many(planes, spread, wanted)
        return True

    def add_each(self, links: Indices, usual: float, settings: JointSettings) -> None:
        """A plane for each pair; where one face has to stay, its plane."""
        label = np.full(len(self.facing), -1)
        label[links] = np.arange(len(links))
        part = some_links(self.facing, links)
        groups = _gathered(self.faces, part, np.arange(len(links)), len(links))
        planes, _ = _fitted(self.faces, groups, usual, settings)
        kept = self.faces.kept[part.faces]
        for k in np.flatnonzero(kept.any(axis=1)):
            face = int(part.faces[k, 0 if kept[k, 0] else 1])
            planes[k] = [*self.faces.planes.normals[face], self.faces.planes.offsets[face]]
        wanted = label >= 0
        wanted[links[kept.all(axis=1) & ~self._coincide(part)]] = False
        self.add_many(planes, label, wanted)

    def _coincide(self, part: FacingFaces) -> Bools:
        planes = self.faces.planes
        first, second = part.faces.T
        turned = np.linalg.norm(planes.normals[first] + planes.normals[second], axis=1)
        size = np.sqrt(planes.areas[part.faces].max(axis=1))
        out: Bools = (turned * size <= _SAME) & (np.abs(part.gap) <= _SAME)
        return out

    def planes(self) -> ContactPlanes:
        normals = np.array(self.normals).reshape(-1, 3)
        outward = self.faces.planes.normals[self.facing.faces[:, 0]]
        linked = self.of_link >= 0
        side = np.ones(len(self.of_link), np.int64)
        side[linked] = np.where((normals[self.of_link[linked]] * outward[linked]).sum(axis=1) > 0.0, 1, -1)
        return ContactPlanes(normals, np.array(self.offsets), self.of_link, side)


def some_links(facing: FacingFaces, links: Indices) -> FacingFaces:
    """Only these pairs."""
    return replace(
        facing,
        faces=facing.faces[links],
        area=facing.area[links],
        gap=facing.gap[links],
        centroid=facing.centroid[links],
        normal=facing.normal[links],
    )


def _joints(faces: StoneFaces, facing: FacingFaces, settings: JointSettings) -> Indices:
    """Number (m,) of the joint that each pair belongs to, in the order of their first pair."""
    if not len(facing):
        return np.zeros(0, np.int64)
    count = len(faces.planes.areas)
    pairs = np.concatenate([facing.faces, _continuing(faces, facing, settings)])
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, label = connected_components(graph, directed=False)
    _, first, number = np.unique(label[facing.faces[:, 0]], return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first, kind="stable")] = np.arange(len(first))
    out: Indices = rank[number]
    return out


def _continuing(faces: StoneFaces, facing: FacingFaces, settings: JointSettings) -> Indices:
    """Faces (m, 2) of neighbours that lie in one plane."""
    solids, planes = faces.solids, faces.planes
    joined = np.zeros(len(planes.areas), np.bool_)
    joined[facing.faces] = True
    found: Indices = continuing_faces(
        planes.owner[facing.faces],
        (solids.vertices, solids.corners, solids.face_starts, solids.solid_starts),
        planes.normals,
        planes.offsets,
        joined & ~faces.kept,
        _ALIKE,
        settings.straightness,
    )
    return found


def _gathered(faces: StoneFaces, facing: FacingFaces, label: Indices, count: int) -> _Groups:
    """The faces of each joint, each once, and on which hand of it they are."""
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


def _any_kept(faces: StoneFaces, groups: _Groups) -> Bools:
    out = np.zeros(len(groups.normals), np.bool_)
    np.logical_or.at(out, np.repeat(np.arange(len(out)), np.diff(groups.starts)), faces.kept[groups.faces])
    return out


def _fitted(faces: StoneFaces, groups: _Groups, usual: float, settings: JointSettings) -> tuple[Array, Array]:
    """Planes (n, 4) half-way between the two hands, and values (n, 4) as of the kernel."""
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
    planes, values = np.zeros((count, 3)), np.zeros((count, 4))
    fit_middle_planes(
        np.ascontiguousarray(local),
        np.repeat(groups.hands, sizes),
        faces.sound[corner],
        starts,
        scale,
        usual,
        settings.straightness,
        planes,
        values,
    )
    normal = axes[:, 2] - planes[:, 1:2] * axes[:, 0] - planes[:, 2:3] * axes[:, 1]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    offset = (normal * (centre + planes[:, :1] * axes[:, 2])).sum(axis=1)
    return np.column_stack([normal, offset]), values


def _frames(normals: Array) -> Array:
    """Right-handed frames (n, 3, 3) whose last row is the normal."""
    least = np.eye(3)[np.abs(normals).argmin(axis=1)] if len(normals) else np.zeros((0, 3))
    first = np.cross(least, normals)
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([first, np.cross(normals, first), normals], axis=1)
