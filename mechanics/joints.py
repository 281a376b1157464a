"""What each joint carries: resultant and its eccentricity, pressure, opening, sliding, use of friction."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanics.contact.contacts import Contacts, material_points
from mechanics.interfaces import Faces, find_interfaces, placed_faces
from mechanics.joint_sections import Section, eccentricity, sections
from mechanics.model import Model
from mechanics.result import ContactResult, JointResult
from mechanics.simulation import Step
from mechanics.state import State

__all__ = ["StartingJoints", "joint_results", "slides", "starting_joints"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class StartingJoints:
    """The joints in which a run begins.

    Attributes
    ----------
    state : where it begins
    face : (nj, 2) pairs of faces
    section : their polygons then
    """

    state: State
    face: Ints
    section: Section


def starting_joints(model: Model, start: State, contacts: Contacts) -> StartingJoints:
    """The joints of the contacts of the first step."""
    faces = placed_faces(model, start)
    face = find_interfaces(faces, contacts, start).face
    return StartingJoints(start, face, sections(faces, face))


def slides(contacts: Contacts, start: State, state: State) -> Array:
    """How far the two material points of each contact have parted across its normal since the start, (nc, 3) [m].

    In axes that turn with the antagonist: stones that turn together do not slide.
    """
    now, then = (np.subtract(*np.moveaxis(material_points(contacts, one), 1, 0)) for one in (state, start))
    return _across(contacts.frame[:, 0], now - _turned(start, state, contacts.bodies[:, 1], then))


def joint_results(
    model: Model, start: StartingJoints, faces: Faces, face: Ints, step: Step, contacts: ContactResult
) -> JointResult:
    """Sum up the contacts of each joint.

    Parameters
    ----------
    start : the joints at the start; they come first in `face`
    faces, face : all faces at the end of the step, and the pairs (nj, 2) that are joints
    step, contacts : the step that gave the forces, and its contact points
    """
    count, bodies = len(face), faces.body[face]
    own = np.flatnonzero(contacts.joint >= 0)
    joint = contacts.joint[own]
    parted = np.flatnonzero(np.bincount(joint, minlength=count) == 0)
    section, slide = _carried_along(sections(faces, face), start, bodies, step.after, parted)
    force, moment = _resultants(section, bodies, contacts, own)
    n = section.frame[:, 0]
    compression = np.einsum("ji,ji->j", force, n)
    # what is less than the solver leaves is no force
    least = model.scene.solver.tolerance * float(np.linalg.norm(force, axis=1).max(initial=0.0))
    place, kern, edge = eccentricity(section, force, moment, least)
    status, area = contacts.status[own], contacts.area[own]
    bearing = _sums(joint, _bearing(model, step)[own], count)
    return JointResult(
        bodies=bodies,
        parted=np.isin(np.arange(count), parted),
        polygon=tuple(section.polygon(number) for number in range(count)),
        frame=section.frame,
        centroid=section.centroid,
        area=section.area,
        second_moment=section.moment,
        force=force,
        moment=moment,
        centre_of_pressure=section.centroid + np.einsum("jd,jdi->ji", place, section.frame[:, 1:]),
        eccentricity=place,
        kern=kern,
        edge=edge,
        pressure_mean=_ratio(compression, section.area),
        pressure_max=_largest(joint, contacts.pressure[own], count),
        opening=np.maximum(_widest(section), _largest(joint, contacts.gap[own], count)),
        sliding=np.maximum(slide, _largest(joint, contacts.slide[own], count)),
        slipping=_share(joint, area, status == "slip", count),
        open=np.where(
            np.bincount(joint, minlength=count) > 0, _share(joint, area, _idle(status), count), 1.0
        ),
        friction_use=_ratio(
            np.linalg.norm(_across(n, force), axis=1), np.where(bearing > least, bearing, 0.0)
        ),
    )


def _resultants(section: Section, bodies: Ints, contacts: ContactResult, own: Ints) -> tuple[Array, Array]:
    """(nj, 3) forces on the first stones, and moments about the centroids."""
    joint, count = contacts.joint[own], len(bodies)
    # forces act on the candidate; in a joint, on the first stone
    sign = np.where(contacts.bodies[own, 0] == bodies[joint, 0], 1.0, -1.0)
    force = sign[:, None] * contacts.force[own]
    return _sums(joint, force, count), _sums(
        joint, np.cross(contacts.point[own] - section.centroid[joint], force), count
    )


def _bearing(model: Model, step: Step) -> Array:
    """(nc,) shear force that friction and cohesion can bear in each contact of a step [N]."""
    limit = step.terms.friction * step.solution.impulse[:, 0] + step.terms.cohesion
    bearing: Array = limit / model.scene.time.step
    return bearing


def _carried_along(
    section: Section, start: StartingJoints, bodies: Ints, state: State, parted: Ints
) -> tuple[Section, Array]:
    """The sections, those of parted joints as at the start but carried along by the second stone; their slides."""
    slide = np.zeros(len(bodies))
    if not len(parted):
        return section, slide
    then, (first, second) = start.section, bodies[parted].T
    n = then.frame[parted, 0]
    flat = then.centroid[parted, None] + np.einsum(
        "jkd,jdi->jki", then.corner[parted], then.frame[parted, 1:]
    )
    ends = [
        flat + (then.middle[parted] + half * then.gap[parted])[..., None] * n[:, None] for half in (0.5, -0.5)
    ]
    moved = [_moved(start.state, state, body, end) for body, end in zip((first, second), ends, strict=True)]
    turn = state.rotation[second] @ start.state.rotation[second].transpose(0, 2, 1)
    apart = moved[0] - moved[1]
    frame = then.frame[parted] @ turn.transpose(0, 2, 1)
    sheared = _across(frame[:, None, 0], apart - np.einsum("jab,jkb->jka", turn, ends[0] - ends[1]))
    meant = np.arange(apart.shape[1]) < then.count[parted, None]
    slide[parted] = np.where(meant, np.linalg.norm(sheared, axis=2), 0.0).max(axis=1)
    old = replace(
        then,
        gap=_put(then.gap, parted, np.einsum("jki,ji->jk", apart, frame[:, 0])),
        frame=_put(then.frame, parted, frame),
        centroid=_put(
            then.centroid, parted, _moved(start.state, state, second, then.centroid[parted, None])[:, 0]
        ),
    )
    return _merged(section, old, parted), slide


def _moved(start: State, state: State, body: Ints, point: Array) -> Array:
    """Where places (n, k, 3) of bodies (n,) at the start are now, if these are rigid."""
    turn = state.rotation[body] @ start.rotation[body].transpose(0, 2, 1)
    moved: Array = state.centre[body, None] + np.einsum(
        "jab,jkb->jka", turn, point - start.centre[body, None]
    )
    return moved


def _merged(section: Section, other: Section, rows: Ints) -> Section:
    """A section with some rows of another one."""
    most = max(section.corner.shape[1], other.corner.shape[1])
    wide, narrow = (
        replace(
            one,
            corner=_padded(one.corner, most),
            gap=_padded(one.gap, most),
            middle=_padded(one.middle, most),
        )
        for one in (section, other)
    )
    values: dict[str, Any] = {
        one.name: _put(getattr(wide, one.name), rows, getattr(narrow, one.name)[rows])
        for one in fields(Section)
    }
    return Section(**values)


def _padded(values: Array, most: int) -> Array:
    room = most - values.shape[1]
    return np.concatenate([values, np.zeros((len(values), room, *values.shape[2:]))], axis=1)


def _put(values: Array, rows: Ints, new: Array) -> Array:
    changed = values.copy()
    changed[rows] = new
    return changed


def _turned(start: State, state: State, body: Ints, vector: Array) -> Array:
    """Vectors (n, 3) fixed to bodies (n,), as these have turned since the start."""
    local = np.einsum("nba,nb->na", start.rotation[body], vector)
    turned: Array = np.einsum("nab,nb->na", state.rotation[body], local)
    return turned


def _across(normal: Array, vector: Array) -> Array:
    """The part of vectors (…, 3) at right angles to unit normals."""
    across: Array = vector - np.sum(vector * normal, axis=-1, keepdims=True) * normal
    return across


def _widest(section: Section) -> Array:
    """(nj,) largest gap at a corner, not less than zero [m]."""
    meant = np.arange(section.gap.shape[1]) < section.count[:, None]
    widest: Array = np.where(meant, section.gap, 0.0).max(axis=1, initial=0.0)
    return widest


def _idle(status: NDArray[np.str_]) -> NDArray[np.bool_]:
    return np.isin(status, ("open", "broken"))


def _share(joint: Ints, area: Array, chosen: NDArray[np.bool_], count: int) -> Array:
    """Part (nj,) of the area of the contacts of each joint; zero where there are none."""
    return np.nan_to_num(_ratio(_sums(joint, area * chosen, count), _sums(joint, area, count)))


def _sums(joint: Ints, values: Array, count: int) -> Array:
    """Sum the values (n,) or (n, d) of the contacts of each joint."""
    total = np.zeros((count, *values.shape[1:]))
    np.add.at(total, joint, values)
    return total


def _largest(joint: Ints, values: Array, count: int) -> Array:
    """Largest value of the contacts of each joint, not less than zero."""
    largest = np.zeros(count)
    np.maximum.at(largest, joint, values)
    return largest


def _ratio(number: Array, by: Array) -> Array:
    """Their ratio; NaN where that has no meaning."""
    return np.where(by > 0, number / _positive(by), np.nan)


def _positive(values: Array) -> Array:
    return np.where(values > 0, values, 1.0)
