"""Contacts of deformable stones: weighted points between flat faces (mortar), single points of a surface elsewhere."""

import numpy as np
from scipy.sparse import csr_array

from mechanics.arrays import Array, Bools, Ints
from mechanics.contact._kernels.facets import FacetMeshes
from mechanics.contact._kernels.mortar import Bodies, FacePairs, mortar_rows
from mechanics.contact._kernels.points import surface_points
from mechanics.contact.contacts import NODE, Contacts
from mechanics.contact.surfaces import Placed, Surfaces

_ALIKE = 1e-6  # relative difference up to which two faces are equally fine or large
# a direction to which faces of stones are unlikely to be normal
_ASKEW = np.array([0.3015113446, 0.5381, 0.7870])
_BESIDE = 1e-3  # share of a shape's width: a point farther from all finite elements lies between the parts of a stone


def surface_weights(
    surfaces: Surfaces, placed: Placed, sides: Ints, face: Ints, normal: Array, arm: Array, nodes: int
) -> "tuple[csr_array[np.float64], Bools]":
    """Find the weights (2 nc, nodes) of the nodes of deformable bodies at single contact points: their shape functions.

    Parameters
    ----------
    sides, face : (nc, 2) shapes of candidate and antagonist, and the faces on which the points lie; -1: the face
        that faces the other side most
    normal : (nc, 3) from antagonist to candidate
    arm : (nc, 2, 3) the points in body axes [m]

    Returns
    -------
    weights : rows of rigid sides are empty
    outside : (nc,) the points lie on the surface of both bodies, and not where parts of one meet
    """
    meshes = surfaces.meshes
    elastic = (meshes.of_face[surfaces.shapes.fptr[:-1]] >= 0)[sides]
    row = np.flatnonzero(elastic.ravel())
    shape = sides.ravel()[row]
    sign = np.where(row % 2, 1.0, -1.0)[:, None]
    towards = np.einsum("rji,rj->ri", placed.rotation[surfaces.body[shape]], sign * normal[row // 2])
    column, value, size, off = surface_points(
        shape, face.ravel()[row], arm.reshape(-1, 3)[row], towards, surfaces.shapes, meshes
    )
    count = np.zeros(2 * len(sides), dtype=np.int64)
    count[row] = size
    filled = np.arange(column.shape[1]) < size[:, None]
    pointer = np.concatenate([[0], np.cumsum(count)])
    weights = csr_array((value[filled], column[filled], pointer), shape=(2 * len(sides), nodes))
    outside = np.ones((len(sides), 2), dtype=bool)
    outside.reshape(-1)[row] = off <= _BESIDE * surfaces.shapes.size[shape]
    return weights, outside[:, 0] & outside[:, 1]


def mortar_contacts(
    surfaces: Surfaces,
    placed: Placed,
    shapes: Ints,
    faces: Ints,
    key: Ints,
    limit: Array,
    nodes: int,
    thin: float,
) -> tuple[Contacts, Array]:
    """One weighted point per corner node of the candidate faces of flat interfaces, and the alert distance of each [m].

    Parameters
    ----------
    shapes, faces : (np, 2) those of the reference and of the incident face; at least one is deformable
    key, limit : (np,) first key and alert distance of each interface
    thin : faces that overlap by less than this share of the smaller one do not touch
    """
    first = np.where(_first_is_candidate(surfaces, placed, shapes, faces), 0, 1)
    order, rows = np.column_stack([first, 1 - first]), np.arange(len(first))[:, None]
    face, body = faces[rows, order], surfaces.body[shapes[rows, order]]
    frame, origin = _frames(surfaces, placed, face)
    meshes = surfaces.meshes
    least = thin * surfaces.shapes.face_area[face].min(axis=1)
    interfaces = FacePairs(meshes.of_face[face], face, body, frame, origin, least)
    bodies = Bodies(placed.centre, placed.rotation)
    # where a face lies on a single other face, all its nodes have contacts
    plane = surfaces.plane[face[:, 0]]
    several = np.flatnonzero(np.bincount(plane)[plane] > 1)
    face_pairs = FacePairs._make(array[several] for array in interfaces)
    pointer = _starts(meshes, face_pairs.mesh[:, 0])
    share = np.zeros(int(pointer[-1]))
    mortar_rows(pointer, np.empty(0, dtype=bool), face_pairs, bodies, meshes, placed.shapes, share)
    start, mask = _kept(surfaces, face[:, 0], several, pointer, share)
    interface, node, area, middle, pointer, column, value = mortar_rows(
        start, mask, interfaces, bodies, meshes, placed.shapes, np.empty(len(mask))
    )
    arm = np.zeros((len(interface), 2, 3))
    rigid = np.flatnonzero(meshes.of_face[face[interface, 1]] < 0)
    on = interface[rigid]
    at = (
        _foot(origin[on], frame[on], placed.shapes.normal[face[on, 1]], middle[rigid, :2])
        - placed.centre[body[on, 1]]
    )
    arm[rigid, 1] = np.einsum("cji,cj->ci", placed.rotation[body[on, 1]], at)
    contacts = Contacts(
        body[interface],
        key[interface] + NODE + node,
        frame[interface],
        area,
        arm,
        csr_array((value, column, pointer), shape=(2 * len(interface), nodes)),
    )
    return contacts, limit[interface]


def _first_is_candidate(surfaces: Surfaces, placed: Placed, shapes: Ints, faces: Ints) -> Bools:
    """Decide whether the first face of each pair (np, 2) carries the contacts, whatever the order in the scene.

    The finer mesh does; of equally fine ones the smaller face, then that of the smaller part, then the face whose
    normal opposed an oblique direction more when the run began, or does now if both agreed then.
    """
    count = len(surfaces.body)
    # the smaller value wins
    judges = (
        (-surfaces.meshes.fineness[faces], _ALIKE),
        (surfaces.shapes.face_area[faces], _ALIKE),
        (surfaces.shapes.size[shapes], _ALIKE),
        (surfaces.shapes.normal[faces] @ _ASKEW, 1e-3),
        (placed.shapes.normal[faces] @ _ASKEW, 1e-9),
        (shapes / count, 0.0),
    )
    chosen, open_ = np.zeros(len(faces), dtype=bool), np.ones(len(faces), dtype=bool)
    for measure, tolerance in judges:
        apart = np.abs(measure[:, 0] - measure[:, 1]) > tolerance * np.abs(measure).max(axis=1)
        chosen = np.where(open_ & apart, measure[:, 0] < measure[:, 1], chosen)
        open_ &= ~apart
    return chosen


def _kept(surfaces: Surfaces, face: Ints, several: Ints, start: Ints, share: Array) -> tuple[Ints, Bools]:
    """Keep the contact of each node of candidate faces (ni,) in the interface where its share is largest.

    Otherwise a node beside the seam of two antagonists would have a contact with each: more contacts than nodes, so
    forces would not be unique. Faces of parts in one plane count as one face. Shares are those of all nodes of each
    candidate in `several` interfaces, which begin at `start`.
    """
    meshes = surfaces.meshes
    size = np.diff(meshes.node_ptr)[meshes.of_face[face]]
    pointer = _starts(meshes, meshes.of_face[face])
    mask = np.ones(int(pointer[-1]), dtype=bool)
    if len(share) == 0:
        return pointer, mask
    within = np.arange(len(share)) - np.repeat(start[:-1], size[several])
    node = meshes.node[within + np.repeat(meshes.node_ptr[meshes.of_face[face[several]]], size[several])]
    plane = np.repeat(surfaces.plane[face[several]], size[several])
    order = np.lexsort([node, plane])
    new = np.flatnonzero((np.diff(plane[order], prepend=-1) != 0) | (np.diff(node[order], prepend=-1) != 0))
    largest = np.repeat(np.maximum.reduceat(share[order], new), np.diff(new, append=len(share)))
    place = within + np.repeat(pointer[several], size[several])
    mask[place[order]] = share[order] >= (1.0 - _ALIKE) * largest
    return pointer, mask


def _starts(meshes: FacetMeshes, mesh: Ints) -> Ints:
    """Return where the nodes of each of some meshes (n,) begin in their list, and where it ends (n + 1,)."""
    starts: Ints = np.concatenate([[0], np.cumsum(np.diff(meshes.node_ptr)[mesh])]).astype(np.int64)
    return starts


def _frames(surfaces: Surfaces, placed: Placed, face: Ints) -> tuple[Array, Array]:
    """Return rows n, t1, t2 (np, 3, 3) and origins (np, 3) of interfaces of candidate and antagonist faces (np, 2).

    n is half-way between both normals; t1 runs along the first edge of the antagonist, so that the frame turns with
    the stones.
    """
    n = placed.shapes.normal[face[:, 1]] - placed.shapes.normal[face[:, 0]]
    n = n / np.linalg.norm(n, axis=1)[:, None]
    start = surfaces.shapes.cptr[face[:, 1]]
    origin = placed.shapes.vertex[surfaces.shapes.corner[start]]
    edge = placed.shapes.vertex[surfaces.shapes.corner[start + 1]] - origin
    t1 = edge - np.einsum("pi,pi->p", edge, n)[:, None] * n
    t1 = t1 / np.linalg.norm(t1, axis=1)[:, None]
    return np.stack([n, t1, np.cross(n, t1)], axis=1), origin


def _foot(origin: Array, frame: Array, normal: Array, middle: Array) -> Array:
    """Return the points of plane faces through `origin` above which plane coordinates `middle` (nc, 2) lie along n."""
    across = np.einsum("cd,cdi->ci", middle, frame[:, 1:])
    rise = np.einsum("ci,ci->c", across, normal) / np.einsum("ci,ci->c", frame[:, 0], normal)
    foot: Array = origin + across - rise[:, None] * frame[:, 0]
    return foot
