"""Joints of an assembly: the sections in which contact points act together, their resultants, and crushing.

Where stones crush, a joint with the compression N bears it on a stress block at the strength σ, of the depth
N/(σ w) from the pressed edge, with w the mean width of the section across. Its resultant lies no nearer to the edge y
than half that depth:

    N²/(2 σ w) ≤ Σ f_N (y - y_i)

for both edges along each of the two principal axes, with y_i the places of the contact points. For a rectangle bent
about one axis this is exact; bent about both it is an approximation from the unsafe side.
"""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import Contacts, material_points
from mechanics.model.model import Model
from mechanics.results.interfaces import find_interfaces, placed_faces
from mechanics.results.joint_sections import JointPolygons, eccentricity, sections
from mechanics.results.joints import resultants as summed
from mechanics.scene.state import State

# compression below which a joint counts as free of force, over the largest of all joints [-]
_FREE = 1e-6


@dataclass(frozen=True)
class Joints:
    """Joints of closed contact points.

    Attributes
    ----------
    bodies : (nj, 2) the lower first; forces and normals are those on the first
    section : their common polygons
    joint : (nc,) the joint of each contact; -1 without one, as between edges
    point : (nc, 3) places of the contact points [m]
    """

    bodies: Ints
    section: JointPolygons
    joint: Ints
    point: Array


@dataclass(frozen=True)
class StressBlocks:
    """Limits of crushing, four for each joint.

    Attributes
    ----------
    point : (4 nj, m) contact points of the joint; -1: none
    lever : (4 nj, m) their distances y - y_i from the edge; 0: none [m]
    limit : (4 nj,) σ w [N/m]
    """

    point: Ints
    lever: Array
    limit: Array


@dataclass(frozen=True)
class Resultants:
    """Resultant of each joint.

    Attributes
    ----------
    force : (nj, 3) on the first stone [N]
    normal, shear : (nj,) compression positive, and the size of the rest [N]
    place : (nj, 3) where it meets the joint; NaN without compression [m]
    kern : (nj,) up to 1 within the kern [-]
    edge : (nj,) from the centroid (0) to the edge (1) [-]
    friction_use : (nj,) shear over what friction and cohesion can carry; NaN without either [-]
    """

    force: Array
    normal: Array
    shear: Array
    place: Array
    kern: Array
    edge: Array
    friction_use: Array


def find_joints(model: Model, state: State, contacts: Contacts) -> Joints:
    """Return the joints to which contact points belong."""
    faces = placed_faces(model, state)
    interfaces = find_interfaces(faces, contacts, state)
    point: Array = material_points(contacts, state).mean(axis=1)
    return Joints(faces.body[interfaces.face], sections(faces, interfaces.face), interfaces.joint, point)


def resultants(joints: Joints, contacts: Contacts, force: Array, strength: Array) -> Resultants:
    """Return the resultants of forces (nc, 3) in local frames, given the shear strength (nc,) of each contact [N]."""
    jointed, count, section = np.flatnonzero(joints.joint >= 0), len(joints.bodies), joints.section
    joint = joints.joint[jointed]
    world = np.einsum("ci,cij->cj", force[jointed], contacts.frame[jointed])
    total, moment = summed(
        section, joints.bodies, joint, contacts.bodies[jointed, 0], joints.point[jointed], world
    )
    normal = np.einsum("ji,ji->j", total, section.frame[:, 0])
    shear = np.linalg.norm(total - normal[:, None] * section.frame[:, 0], axis=1)
    least = _FREE * float(np.abs(normal).max(initial=0.0))
    place, kern, edge = eccentricity(section, total, moment, least)
    most = np.bincount(joint, strength[jointed], count)
    return Resultants(
        force=total,
        normal=normal,
        shear=shear,
        place=section.centroid + np.einsum("jd,jdi->ji", place, section.frame[:, 1:]),
        kern=kern,
        edge=edge,
        friction_use=np.where(most > least, shear / np.where(most > least, most, 1.0), np.nan),
    )


def stress_blocks(joints: Joints, strength: Array) -> StressBlocks | None:
    """Return the limits of crushing for the strengths (nb,) of the stones, infinite where not known [Pa]."""
    section = joints.section
    weaker = strength[joints.bodies].min(axis=1, initial=np.inf)
    chosen = np.flatnonzero(np.isfinite(weaker) & (section.area > 0))
    if not len(chosen):
        return None
    most = int(np.bincount(joints.joint[joints.joint >= 0]).max())
    point = np.full((len(joints.bodies), most), -1)
    order = np.argsort(joints.joint, kind="stable")
    order = order[joints.joint[order] >= 0]
    first = np.searchsorted(joints.joint[order], np.arange(len(joints.bodies)))
    point[joints.joint[order], np.arange(len(order)) - first[joints.joint[order]]] = order
    meant = np.arange(section.corner.shape[1]) < section.count[:, None]
    points, levers, limits = [], [], []
    for axis in (0, 1):
        corner = section.corner[..., axis]
        place = np.einsum(
            "jki,ji->jk", joints.point[point] - section.centroid[:, None], section.frame[:, 1 + axis]
        )
        low, high = np.where(meant, corner, np.inf).min(axis=1), np.where(meant, corner, -np.inf).max(axis=1)
        for lever in (high[:, None] - place, place - low[:, None]):
            points.append(point[chosen])
            # points lie within the section, up to the rounding of the survey
            levers.append(np.where(point < 0, 0.0, np.maximum(lever, 0.0))[chosen])
            limits.append((weaker * section.area / (high - low))[chosen])
    return StressBlocks(np.concatenate(points), np.concatenate(levers), np.concatenate(limits))
