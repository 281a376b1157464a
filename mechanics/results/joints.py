"""Results of each joint: resultant and eccentricity, pressure, opening, sliding, use of friction."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.contact.contacts import Contacts, material_points
from mechanics.dynamics.step import Step
from mechanics.model.model import Model
from mechanics.results._kernels import Faces, StartCorners
from mechanics.results.contact_result import ContactResult, JointResult
from mechanics.results.interfaces import find_interfaces, placed_faces
from mechanics.results.joint_sections import JointPolygons, eccentricity, sections
from mechanics.results.patch_pressure import patch_pressure
from mechanics.scene.state import State

SLIVER = 5e-3
"""Area of a joint over the smaller of the largest faces of its two stones, up to which it is a sliver [-].

Slivers come from the rounding of corners. Their forces count, but force over area says nothing of the stone.
"""


_CLOSED = 1e-2  # gap of a closed joint over the size of the smaller stone, at most [-], as for bonds
_IDLE = ("open", "broken")  # status of contacts without force


@dataclass(frozen=True)
class StartingJoints:
    """Joints at the start of a run.

    Attributes
    ----------
    state : the start
    face : (nj, 2) pairs of faces
    bodies : (nj, 2) of these, the lower first
    section : their polygons then
    closed : (nj,) open by no more than a hundredth of the smaller stone's size, as for bonds
    """

    state: State
    face: Ints
    bodies: Ints
    section: JointPolygons
    closed: Bools


def starting_joints(model: Model, start: State, contacts: Contacts) -> StartingJoints:
    """Return the joints of the contacts of the first step."""
    faces = placed_faces(model, start)
    face = find_interfaces(faces, contacts, start).face
    section = sections(faces, face)
    meant = np.arange(section.gap.shape[1]) < section.count[:, None]
    nearest = np.where(meant, section.gap, np.inf).min(axis=1, initial=np.inf)
    closed = nearest <= _CLOSED * faces.size[face].min(axis=1)
    return StartingJoints(start, face, faces.body[face], section, closed)


def largest_faces(model: Model) -> Array:
    """Return the area (nb,) of the largest face of each body [m²]."""
    faces = model.surfaces
    owner = np.repeat(faces.body, np.diff(faces.shapes.fptr))
    return _largest(owner, faces.shapes.face_area, len(model.mass))


def joint_corners(start: StartingJoints) -> StartCorners:
    """Return the corners of the joints of the start in the axes of their stones, by which their motion is followed."""
    section, state = start.section, start.state
    meant = np.arange(section.corner.shape[1]) < section.count[:, None]
    joint = np.repeat(np.arange(len(start.face)), section.count)
    first = _sides(section, np.arange(len(start.face)))[0][meant]
    a, b = start.bodies[joint].T

    def in_axes(body: Ints, point: Array) -> Array:
        """Return points (n, 3) in the axes of their bodies [m]."""
        place: Array = np.einsum("kji,kj->ki", state.rotation[body], point - state.centre[body])
        return place

    return StartCorners(
        bodies=start.bodies,
        first=np.concatenate([[0], np.cumsum(section.count)]).astype(np.int64),
        own=in_axes(a, first),
        # the same place: the gap at the start is no opening
        other=in_axes(b, first),
        normal=np.einsum("jai,ja->ji", state.rotation[start.bodies[:, 1]], section.frame[:, 0]),
    )


def parting(contacts: Contacts, start: State, state: State) -> tuple[Array, Array]:
    """Return the relative displacement of the two material points of each contact since the start.

    It is taken in axes that turn with the antagonist: stones that turn together do not part.

    Returns
    -------
    opening : (nc,) along the normal [m]
    slide : (nc, 3) across it [m]
    """
    now, then = (np.subtract(*np.moveaxis(material_points(contacts, one), 1, 0)) for one in (state, start))
    body, normal = contacts.bodies[:, 1], contacts.frame[:, 0]
    parted = now - np.einsum("nab,nb->na", _turn(start, state, body), then)
    return np.einsum("ci,ci->c", parted, normal), _across(normal, parted)


def joint_results(
    model: Model, start: StartingJoints, faces: Faces, face: Ints, step: Step, contacts: ContactResult
) -> JointResult:
    """Sum up the contacts of each joint.

    Parameters
    ----------
    start : the joints at the start; they come first in `face`
    faces, face : all faces at the end of the step, and the pairs (nj, 2) of the joints
    step, contacts : the step of the forces, and its contact points
    """
    count, bodies = len(face), faces.body[face]
    in_joint = np.flatnonzero(contacts.joint >= 0)
    joint = contacts.joint[in_joint]
    away = np.bincount(joint, minlength=count) == 0
    section = _with_parted(sections(faces, face), start, bodies, step.after, np.flatnonzero(away))
    force, moment = resultants(
        section,
        bodies,
        joint,
        contacts.bodies[in_joint, 0],
        contacts.point[in_joint],
        contacts.force[in_joint],
    )
    n, status = section.frame[:, 0], contacts.status[in_joint]
    # a force below the tolerance of the solver counts as none
    least = model.scene.solver.tolerance * float(np.linalg.norm(force, axis=1).max(initial=0.0))
    place, kern, edge = eccentricity(section, force, moment, least)
    opening, sliding = _movement(section, start, bodies, step.after, contacts, in_joint)
    capacity = _sums(joint, _shear_capacity(step)[in_joint], count)
    shear = np.linalg.norm(_across(n, force), axis=1)
    return JointResult(
        bodies=bodies,
        parted=away & np.append(start.closed, np.zeros(count - len(start.face), dtype=bool)),
        polygon=_shown(section, away).polygons(),
        frame=section.frame,
        centroid=section.centroid,
        area=section.area,
        sliver=section.area <= SLIVER * largest_faces(model)[bodies].min(axis=1, initial=np.inf),
        force=force,
        moment=moment,
        centre_of_pressure=section.centroid + np.einsum("jd,jdi->ji", place, section.frame[:, 1:]),
        eccentricity=place,
        kern=kern,
        edge=edge,
        pressure_mean=_ratio(np.einsum("ji,ji->j", force, n), section.area),
        pressure_max=_largest(joint, _patches(contacts, in_joint), count),
        gap=np.maximum(_at_most(section, section.gap), _largest(joint, contacts.gap[in_joint], count)),
        opening=opening,
        sliding=sliding,
        slipping=_share(joint, contacts.area[in_joint], status == "slip", count),
        open=np.where(away, 1.0, _share(joint, contacts.area[in_joint], np.isin(status, _IDLE), count)),
        friction_use=_ratio(shear, np.where(capacity > least, capacity, 0.0)),
    )


def _movement(
    section: JointPolygons,
    start: StartingJoints,
    bodies: Ints,
    state: State,
    contacts: ContactResult,
    in_joint: Ints,
) -> tuple[Array, Array]:
    """Return opening and sliding (nj,) since the start, the largest of corners and contact points [m]."""
    joint, count = contacts.joint[in_joint], len(bodies)
    opened, slid = _moved_apart(section, start.state, state, bodies)
    # new joints have no start to refer to
    opened[len(start.face) :] = _at_most(section, section.gap)[len(start.face) :]
    # contact points, where there are any, include the deformation of the stones
    slid[np.bincount(joint, minlength=count) > 0] = 0.0
    return (
        np.maximum(opened, _largest(joint, contacts.opening[in_joint], count)),
        np.maximum(slid, _largest(joint, contacts.slide[in_joint], count)),
    )


def resultants(
    section: JointPolygons, bodies: Ints, joint: Ints, candidate: Ints, point: Array, force: Array
) -> tuple[Array, Array]:
    """Return the resultants of joints: forces (nj, 3) on the first stones, and moments about the centroids.

    Parameters
    ----------
    section, bodies : of the joints; (nj, 2) their stones, the first of which the resultants act on
    joint, candidate : (n,) the joint of each contact point, and the stone on which its force acts
    point, force : (n, 3) places [m] and forces, world axes [N]

    Returns
    -------
    force, moment : (nj, 3) [N], [N m]
    """
    count = len(bodies)
    sign = np.where(candidate == bodies[joint, 0], 1.0, -1.0)
    on_first = sign[:, None] * force
    return _sums(joint, on_first, count), _sums(
        joint, np.cross(point - section.centroid[joint], on_first), count
    )


def _patches(contacts: ContactResult, in_joint: Ints) -> Array:
    """Return the pressure (n,) around each contact point of a joint [Pa]."""
    area = contacts.area[in_joint]
    return patch_pressure(
        contacts.point[in_joint], contacts.pressure[in_joint] * area, area, contacts.joint[in_joint]
    )


def _shear_capacity(step: Step) -> Array:
    """Return the shear force (nc,) that friction and cohesion can carry in each contact of a step [N]."""
    limit = step.terms.friction * step.shifted[:, 0] + step.terms.cohesion
    capacity: Array = limit / step.duration
    return capacity


def _with_parted(
    section: JointPolygons, start: StartingJoints, bodies: Ints, state: State, parted: Ints
) -> JointPolygons:
    """Return the sections, those of parted joints as at the start but carried along by the second stone."""
    if not len(parted):
        return section
    then, second = start.section, bodies[parted, 1]
    turn = _turn(start.state, state, second)
    frame = then.frame[parted] @ turn.transpose(0, 2, 1)
    first_sides, second_sides = (
        _moved(start.state, state, body, side)
        for body, side in zip(bodies[parted].T, _sides(then, parted), strict=True)
    )
    gap = np.einsum("jki,ji->jk", first_sides - second_sides, frame[:, 0])
    centroid = _moved(start.state, state, second, then.centroid[parted, None])[:, 0]
    moved = replace(
        then,
        frame=_put(then.frame, parted, frame),
        centroid=_put(then.centroid, parted, centroid),
        gap=_put(then.gap, parted, gap),
        # on the second stone
        middle=_put(then.middle, parted, then.middle[parted] + 0.5 * (gap - then.gap[parted])),
    )
    return _merged(section, moved, parted)


def _shown(section: JointPolygons, parted: Bools) -> JointPolygons:
    """Return the sections, those of parted joints on the second stone rather than half-way between both."""
    beside = section.middle - 0.5 * section.gap
    return replace(section, middle=np.where(parted[:, None], beside, section.middle))


def _sides(section: JointPolygons, rows: Ints) -> tuple[Array, Array]:
    """Return the corners (n, m, 3) of some sections on the faces of the first and of the second stones [m]."""
    n = section.frame[rows, 0][:, None]
    middle = section.centroid[rows, None] + np.einsum(
        "jkd,jdi->jki", section.corner[rows], section.frame[rows, 1:]
    )
    return tuple(
        middle + (section.middle[rows] + half * section.gap[rows])[..., None] * n for half in (0.5, -0.5)
    )


def _moved_apart(section: JointPolygons, start: State, state: State, bodies: Ints) -> tuple[Array, Array]:
    """Return opening and sliding (nj,) of each joint since the start, the largest at its corners [m].

    The stones count as rigid; the opening is not less than zero.
    """
    sides = _sides(section, np.arange(len(bodies)))
    then = [_moved(state, start, body, side) for body, side in zip(bodies.T, sides, strict=True)]
    turn = _turn(start, state, bodies[:, 1])
    parted = sides[0] - sides[1] - np.einsum("jab,jkb->jka", turn, then[0] - then[1])
    n = section.frame[:, None, 0]
    opened = np.einsum("jki,jni->jk", parted, n)
    return _at_most(section, opened), _at_most(section, np.linalg.norm(_across(n, parted), axis=2))


def _turn(start: State, state: State, body: Ints) -> Array:
    """Return the rotations (n, 3, 3) of bodies since the start."""
    turn: Array = state.rotation[body] @ start.rotation[body].transpose(0, 2, 1)
    return turn


def _moved(start: State, state: State, body: Ints, point: Array) -> Array:
    """Return the places at a state of points (n, k, 3) of bodies (n,) at the start, as if these were rigid [m]."""
    moved: Array = state.centre[body, None] + np.einsum(
        "jab,jkb->jka", _turn(start, state, body), point - start.centre[body, None]
    )
    return moved


def _merged(section: JointPolygons, added: JointPolygons, rows: Ints) -> JointPolygons:
    """Return a section with some rows of another one."""
    most = max(section.corner.shape[1], added.corner.shape[1])
    wide, narrow = (
        replace(
            polygons,
            corner=_padded(polygons.corner, most),
            gap=_padded(polygons.gap, most),
            middle=_padded(polygons.middle, most),
        )
        for polygons in (section, added)
    )
    values: dict[str, Any] = {
        field.name: _put(getattr(wide, field.name), rows, getattr(narrow, field.name)[rows])
        for field in fields(JointPolygons)
    }
    return JointPolygons(**values)


def _padded(values: Array, most: int) -> Array:
    room = most - values.shape[1]
    return np.concatenate([values, np.zeros((len(values), room, *values.shape[2:]))], axis=1)


def _put(values: Array, rows: Ints, new: Array) -> Array:
    changed = values.copy()
    changed[rows] = new
    return changed


def _across(normal: Array, vector: Array) -> Array:
    """Return the part of vectors (…, 3) at right angles to unit normals."""
    across: Array = vector - np.sum(vector * normal, axis=-1, keepdims=True) * normal
    return across


def _at_most(section: JointPolygons, values: Array) -> Array:
    """Return the largest of the values (nj, m) at the corners of each joint, not less than zero."""
    meant = np.arange(values.shape[1]) < section.count[:, None]
    largest: Array = np.where(meant, values, 0.0).max(axis=1, initial=0.0)
    return largest


def _share(joint: Ints, area: Array, chosen: Bools, count: int) -> Array:
    """Return the chosen part (nj,) of the area of the contacts of each joint; zero without contacts."""
    return np.nan_to_num(_ratio(_sums(joint, area * chosen, count), _sums(joint, area, count)))


def _sums(joint: Ints, values: Array, count: int) -> Array:
    """Sum the values (n,) or (n, d) of the contacts of each joint."""
    total = np.zeros((count, *values.shape[1:]))
    np.add.at(total, joint, values)
    return total


def _largest(joint: Ints, values: Array, count: int) -> Array:
    """Return the largest value of the contacts of each joint, not less than zero."""
    largest = np.zeros(count)
    np.maximum.at(largest, joint, values)
    return largest


def _ratio(number: Array, by: Array) -> Array:
    """Return the ratio; NaN where the denominator is not positive."""
    return np.where(by > 0, number / np.where(by > 0, by, 1.0), np.nan)
