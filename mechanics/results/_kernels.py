"""Numba kernels of the observation of a step: faces in contact, motion of joints, pressures, largest values so far."""

from typing import NamedTuple

import numpy as np
from numba import njit

from mechanics.arrays import Array, Bools, Ints

_ONE_PLANE = 0.999  # cosine of the angle between two contacts of one joint [-]


class Faces(NamedTuple):
    """Flat faces of all stones at one instant.

    Attributes
    ----------
    body : (nf,)
    first : (nb+1,) faces of each body
    normal : (nf, 3) outward [-]
    centre : (nf, 3) mean of the corners [m]
    corner : (nf, m, 3) counter-clockwise seen from outside [m]
    corners : (nf,) number of those of each face
    size : (nf,) smallest width of the body [m]
    flat : (nf,) false for the facets of balls, which serve pictures only
    """

    body: Ints
    first: Ints
    normal: Array
    centre: Array
    corner: Array
    corners: Ints
    size: Array
    flat: Bools


class StartCorners(NamedTuple):
    """Corners of the joints of the start, on both stones.

    Attributes
    ----------
    bodies : (nj, 2) int64
    first : (nj+1,) int64, first corner of each joint
    own : (k, 3) float64, corner on the first stone, in its axes [m]
    other : (k, 3) float64, the same point at the start, in the axes of the second stone [m]
    normal : (nj, 3) float64, from the second to the first stone, in the axes of the second [-]
    """

    bodies: np.ndarray
    first: np.ndarray
    own: np.ndarray
    other: np.ndarray
    normal: np.ndarray


@njit(cache=True)
def facing(faces, body, point, direction):  # pragma: no cover - compiled
    """Find the face of a body on which a point lies, among those that face a direction.

    It is the one that looks best along the direction and lies nearest: the distance from a face is that from its plane
    and that beyond its edges, over the width of the body.

    Inputs
    ------
    faces : Faces
    body : (n,) int64
    point : (n, 3) float64 [m]
    direction : (n, 3) float64 [-]

    Outputs
    -------
    (n,) int64; the first face of the body where none faces the direction
    """
    found = np.empty(len(body), dtype=np.int64)
    for i in range(len(body)):
        p, d, most = point[i], direction[i], -np.inf
        found[i] = faces.first[body[i]]
        for f in range(faces.first[body[i]], faces.first[body[i] + 1]):
            n, centre, corner = faces.normal[f], faces.centre[f], faces.corner[f]
            looks = n[0] * d[0] + n[1] * d[1] + n[2] * d[2]
            # no distance makes it better than one that looks better
            if not looks > 0.0 or looks <= most:
                continue
            off = (p[0] - centre[0]) * n[0] + (p[1] - centre[1]) * n[1] + (p[2] - centre[2]) * n[2]
            beyond, count = 0.0, faces.corners[f]
            for k in range(count):
                a, b = corner[k], corner[k + 1 if k + 1 < count else 0]
                x, y, z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
                u, v, w = y * n[2] - z * n[1], z * n[0] - x * n[2], x * n[1] - y * n[0]
                length = np.sqrt(u * u + v * v + w * w)
                out = (p[0] - a[0]) * u + (p[1] - a[1]) * v + (p[2] - a[2]) * w
                beyond = max(beyond, out / length if length > 0.0 else out)
            fits = looks - (abs(off) + beyond) / faces.size[f]
            if fits > most:
                found[i], most = f, fits
    return found


@njit(cache=True)
def joint_motion(joints, centre, rotation):  # pragma: no cover - compiled
    """Compute opening and sliding of joints since the start, as if their stones were rigid.

    Inputs
    ------
    joints : JointCorners
    centre : (nb, 3) float64 [m]
    rotation : (nb, 3, 3) float64, from body axes to world axes [-]

    Outputs
    -------
    opening, sliding : (nj,) float64, largest of the corners, not less than zero [m]
    """
    count = len(joints.bodies)
    opening, sliding = np.zeros(count), np.zeros(count)
    for j in range(count):
        a, b = joints.bodies[j]
        ra, rb = rotation[a], rotation[b]
        n = joints.normal[j]
        c0, c1, c2 = centre[a, 0] - centre[b, 0], centre[a, 1] - centre[b, 1], centre[a, 2] - centre[b, 2]
        most = 0.0
        for k in range(joints.first[j], joints.first[j + 1]):
            p, q = joints.own[k], joints.other[k]
            x = c0 + ra[0, 0] * p[0] + ra[0, 1] * p[1] + ra[0, 2] * p[2]
            y = c1 + ra[1, 0] * p[0] + ra[1, 1] * p[1] + ra[1, 2] * p[2]
            z = c2 + ra[2, 0] * p[0] + ra[2, 1] * p[1] + ra[2, 2] * p[2]
            # in the axes of the second stone
            d0 = rb[0, 0] * x + rb[1, 0] * y + rb[2, 0] * z - q[0]
            d1 = rb[0, 1] * x + rb[1, 1] * y + rb[2, 1] * z - q[1]
            d2 = rb[0, 2] * x + rb[1, 2] * y + rb[2, 2] * z - q[2]
            out = d0 * n[0] + d1 * n[1] + d2 * n[2]
            d0, d1, d2 = d0 - out * n[0], d1 - out * n[1], d2 - out * n[2]
            most = max(most, d0 * d0 + d1 * d1 + d2 * d2)
            opening[j] = max(opening[j], out)
        sliding[j] = np.sqrt(most)
    return opening, sliding


@njit(cache=True)
def patch_pressures(bodies, frame, point, force, area, reach, least):  # pragma: no cover - compiled
    """Compute the largest pressure of each joint: of its contact points, each with its neighbours.

    A joint is a run of contacts of the same two bodies with the same normal.

    Inputs
    ------
    bodies : (nc, 2) int64
    frame : (nc, 3, 3) float64, rows n, t1, t2 [-]
    point : (nc, 3) float64, in any axes that the contacts of a joint share [m]
    force : (nc, 3) float64, in the axes of the frames [N]
    area : (nc,) float64, zero between edges [m²]
    reach : float64, radius of a patch over the mean distance of the contact points [-]
    least : (nb,) float64, area of both bodies that a joint must exceed [m²]

    Outputs
    -------
    pairs : (n, 2) int64, bodies of each joint
    largest : (n,) float64 [Pa]
    """
    count = len(bodies)
    pairs, largest = np.empty((count, 2), dtype=np.int64), np.zeros(count)
    pressing = np.empty(count)
    for c in range(count):
        n, f = frame[c, 0], force[c]
        pressing[c] = n[0] * f[0] + n[1] * f[1] + n[2] * f[2]
    found, start = 0, 0
    while start < count:
        a, b = bodies[start]
        whole, end = 0.0, start
        while end < count and bodies[end, 0] == a and bodies[end, 1] == b:
            m, n = frame[end, 0], frame[start, 0]
            if m[0] * n[0] + m[1] * n[1] + m[2] * n[2] < _ONE_PLANE:
                break
            whole += area[end]
            end += 1
        if whole > min(least[a], least[b]):
            radius = reach * reach * whole / (end - start)
            top = 0.0
            for c in range(start, end):
                if not (area[c] > 0.0 and pressing[c] > 0.0):
                    continue
                force, under = 0.0, 0.0
                for d in range(start, end):
                    away = 0.0
                    for i in range(3):
                        away += (point[c, i] - point[d, i]) ** 2
                    if area[d] > 0.0 and away <= radius:
                        force += pressing[d]
                        under += area[d]
                top = max(top, force / under)
            pairs[found, 0], pairs[found, 1], largest[found] = a, b, top
            found += 1
        start = end
    return pairs[:found], largest[:found]


@njit(cache=True)
def keep_largest(pairs, values, time, record):  # pragma: no cover - compiled
    """Keep the values of joints that exceed those of their bodies so far.

    Inputs
    ------
    pairs : (n, 2) int64, bodies of each joint
    values : (n,) float64
    time : float64 [s]

    Outputs
    -------
    record : Largest, of all bodies, changed in place
    """
    for j in range(len(pairs)):
        for side in range(2):
            body = pairs[j, side]
            if values[j] > record.value[body]:
                record.value[body] = values[j]
                record.time[body] = time
                record.partner[body] = pairs[j, 1 - side]
