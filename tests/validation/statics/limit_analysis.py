"""The other program: limit analysis of rigid blocks as a linear program, with contact points found by its own means.

Associative (normality) friction, so an upper bound for Coulomb's (Drucker); without sliding the bound is exact. The
circle of friction becomes a regular polygon inscribed in it, with a corner on the in-plane axis, so plane problems
are exact.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_array, csr_array, hstack

from mechanics.scene.scene import Fidelity

UP, ALONG = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Joints:
    """Contact points: point (n, 3), normal (n, 3) from body `first` (n,) to body `second` (n,)."""

    point: np.ndarray
    normal: np.ndarray
    first: np.ndarray
    second: np.ndarray


def joints(blocks, tolerance=1e-9):
    """Corners of the overlaps of all pairs of faces that lie on one another."""
    faces = [
        (b, part.vertices[list(face)])
        for b, block in enumerate(blocks)
        for part in (block.parts or (block,))
        for face in part.faces
    ]
    normal = np.array([_normal(corners) for _, corners in faces])
    centre = np.array([corners.mean(axis=0) for _, corners in faces])
    body = np.array([b for b, _ in faces])
    fixed = np.array([block.fidelity is Fidelity.FIXED for block in blocks])
    size = np.ptp(np.vstack([block.vertices for block in blocks]), axis=0).max()
    found = []
    for i in range(len(faces)):
        offset = (centre - centre[i]) @ normal[i]
        against = (normal @ normal[i] < -1 + 1e-9) & (np.abs(offset) < tolerance * size) & (body > body[i])
        for j in np.flatnonzero(against & ~(fixed[body] & fixed[body[i]])):
            found += [(x, normal[i], body[i], body[j]) for x in _overlap(faces[i][1], faces[j][1], normal[i])]
    point, normals, first, second = zip(*found, strict=True)
    return Joints(np.array(point), np.array(normals), np.array(first), np.array(second))


def _normal(corners):
    n = np.cross(corners[1] - corners[0], corners[2] - corners[1])
    return n / np.linalg.norm(n)


def _overlap(a, b, n):
    """Corners of the common part of two coplanar convex faces: clip `b` by the edges of `a` (Sutherland & Hodgman)."""
    size = np.linalg.norm(np.ptp(a, axis=0))
    corners = list(b)
    for start, end in zip(a, np.roll(a, -1, axis=0), strict=True):
        inward = np.cross(n, end - start) / np.linalg.norm(end - start)
        height = [float((x - start) @ inward) for x in corners]
        kept = []
        for k in range(len(corners)):
            x, y, hx, hy = corners[k - 1], corners[k], height[k - 1], height[k]
            if min(hx, hy) < -1e-9 * size and max(hx, hy) > 1e-9 * size:
                kept.append(x + (y - x) * hx / (hx - hy))
            if hy >= -1e-9 * size:
                kept.append(y)
        corners = kept
        if len(corners) < 3:
            return []
    flat = np.array(corners)
    doubled = np.cross(flat - flat[0], np.roll(flat, -1, axis=0) - flat[0]).sum(axis=0)
    return corners if np.linalg.norm(doubled) > 1e-9 * size**2 else []


def centroid(block):
    """Volume [m³] and centre of mass (3,) [m] of a stone, from tetrahedra to its first corner."""
    apex = block.vertices[0]
    volume, moment = 0.0, np.zeros(3)
    for face in block.faces:
        p = block.vertices[list(face)]
        for k in range(1, len(p) - 1):
            v = np.dot(p[0] - apex, np.cross(p[k] - apex, p[k + 1] - apex)) / 6
            volume, moment = volume + v, moment + v * (apex + p[0] + p[k] + p[k + 1]) / 4
    return volume, moment / volume


@dataclass(frozen=True)
class Assembly:
    """Equilibrium of all free stones: forces @ x + dead + λ live = 0, with x ≥ 0 and limit @ x ≤ 0.

    Attributes
    ----------
    forces : (6 n, m) wrench on each free stone of each unknown: per point the normal force, then its friction
    limit : (points, m) Coulomb
    dead, live : (6 n,) weight, and the weight turned into the direction of the load
    thrust : (m,) x-component of the force on the first block of the scene, which is fixed
    weight : of all free stones
    """

    forces: csr_array
    limit: csr_array
    dead: np.ndarray
    live: np.ndarray
    thrust: np.ndarray
    weight: float


def assembly(blocks, friction, direction=ALONG, sides=4, outside=False):
    """State the linear program; `outside`: the friction polygon is circumscribed instead of inscribed."""
    where = joints(blocks)
    count = len(where.point)
    moving = np.array([block.fidelity is not Fidelity.FIXED for block in blocks])
    mass = [centroid(block) for block in blocks]
    volume, centre = np.array([v for v, _ in mass]), np.array([c for _, c in mass])
    weight = volume * np.array([block.material.density for block in blocks])
    scale = weight[moving].sum()
    # the second axis of each joint as far as can be along y: in a plane problem the first one lies in the plane
    across = np.where(np.abs(where.normal[:, 1:2]) < 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    t1 = np.cross(across, where.normal)
    t1 /= np.linalg.norm(t1, axis=1)[:, None]
    t2 = np.cross(where.normal, t1)
    angle = 2 * np.pi * np.arange(sides) / sides
    directions = [where.normal] + [np.cos(a) * t1 + np.sin(a) * t2 for a in angle]
    columns = [_wrenches(where, force, centre, moving) for force in directions]
    mu = np.broadcast_to(friction / (np.cos(np.pi / sides) if outside else 1.0), count)
    cone, identity = (coo_array((v, (np.arange(count),) * 2)) for v in (-mu, np.ones(count)))
    limit = hstack([cone, *[identity] * sides], format="csr")
    dead, live = (
        np.hstack([np.outer(weight[moving], way), np.zeros((int(moving.sum()), 3))]).ravel() / scale
        for way in (-UP, np.asarray(direction, dtype=float))
    )
    on_first = where.first == 0
    thrust = np.concatenate([np.where(on_first, -force[:, 0], 0.0) for force in directions])
    return Assembly(hstack(columns, format="csr"), limit, dead, live, thrust, scale)


def _wrenches(where, force, centre, moving):
    """What a unit of `force` (points, 3) does to each stone that moves, (6 n, points)."""
    place = np.cumsum(moving) - 1
    rows, columns, values = [], [], []
    for sign, body in ((-1.0, where.first), (1.0, where.second)):
        keep = moving[body]
        rows.append((6 * place[body][keep, None] + np.arange(6)).ravel())
        columns.append(np.repeat(np.flatnonzero(keep), 6))
        wrench = sign * np.hstack([force, np.cross(where.point - centre[body], force)])
        values.append(wrench[keep].ravel())
    shape = (6 * int(moving.sum()), len(force))
    return coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape)


def multiplier(blocks, friction, direction=ALONG, sides=4, outside=False):
    """Largest λ at which weight, and λ times the weight along `direction`, are in equilibrium; nan if λ = 0 is not."""
    a = assembly(blocks, friction, direction, sides, outside)
    found, _ = _largest(a, a.limit, np.zeros(a.limit.shape[0]))
    return found


def without_dilatancy(blocks, friction, direction=ALONG, sides=4, rounds=30):
    """A λ at which Coulomb's friction without dilatancy collapses, after Gilbert, Casapulla & Ahmed 2006.

    The slope of each contact's limit goes to zero from round to round, and a cohesion replaces it that gives the
    same friction at the normal force of the rounds before. Such loads are not unique; with the corner solutions of
    the simplex method they come out near the lowest known.
    """
    a = assembly(blocks, 1.0, direction, sides)
    count = a.limit.shape[0]
    unit = coo_array((np.ones(count), (np.arange(count),) * 2), shape=a.limit.shape).tocsr()
    normal, slope = np.zeros(count), friction
    for _ in range(rounds):
        # a.limit says Σ friction ≤ 1 · normal force
        limit, bound = a.limit + (1.0 - slope) * unit, (friction - slope) * normal
        found, x = _largest(a, limit, bound, "highs-ds")
        normal = x[:count] if slope == friction else 0.5 * (normal + x[:count])
        slope *= 0.3
    return found


def _largest(a, limit, bound, method="highs-ipm"):
    """Largest λ with limit @ x ≤ bound, and x."""
    cost = np.append(np.zeros(a.forces.shape[1]), -1.0)
    equal = hstack([a.forces, csr_array(a.live[:, None])], format="csr")
    below = hstack([limit, csr_array((limit.shape[0], 1))], format="csr")
    answer = linprog(cost, below, bound, equal, -a.dead, method=method)
    assert answer.status in (0, 2), answer.message
    return (float(answer.x[-1]), answer.x) if answer.status == 0 else (float("nan"), None)


def stands(blocks, friction, sides=4):
    """Whether an equilibrium under the own weight exists."""
    a = assembly(blocks, friction, sides=sides)
    answer = linprog(
        np.zeros(a.forces.shape[1]), a.limit, np.zeros(a.limit.shape[0]), a.forces, -a.dead, method="highs"
    )
    assert answer.status in (0, 2), answer.message
    return answer.status == 0


def thrust_bounds(blocks, friction, sides=4):
    """Smallest and largest horizontal thrust on the first block over the total weight."""
    a = assembly(blocks, friction, sides=sides)
    bounds = []
    for sign in (1.0, -1.0):
        answer = linprog(
            sign * a.thrust, a.limit, np.zeros(a.limit.shape[0]), a.forces, -a.dead, method="highs"
        )
        assert answer.success, answer.message
        bounds.append(sign * float(answer.fun))
    return tuple(bounds)
