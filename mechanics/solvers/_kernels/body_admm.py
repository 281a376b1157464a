"""Numba kernels of ADMM between rigid bodies, in world axes, with the velocities of the bodies as unknowns.

Each contact has a penalty σ of its own, the same in all directions. So its frame drops out of M + H Σ⁻¹ Hᵀ, of which
the lever arms alone are needed, and of the iteration all that is left of the frame is the normal n. With x = z + y,
where z = P_K(x) holds the impulses and û = -σ y the velocities that are dual to them, an iteration is

    q = z - y - (u_free + bias n + μ‖û_T‖ n) / σ,     (M + H Σ⁻¹ Hᵀ) v = H q,     r = q - Hᵀ v / σ
    x ← y + ω r + (1 - ω) z

and one pass over the contacts on either side of the solution for v makes it. What is solved for is the change of v,
from H q - (M + H Σ⁻¹ Hᵀ) v, so that factors of single precision lose nothing: each iteration corrects the last one's
errors. Contacts of the same two bodies follow each other, so the bodies' velocities and sums stay in registers.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mechanics.contact._kernels.vectors import cross, dot, row, write_row
from mechanics.delassus._kernels.sides import inverse_columns
from mechanics.problem._kernels import onto_cone
from mechanics.solvers._kernels.body_cholesky import Panels, solve

__all__ = [
    "Acceleration",
    "Factors",
    "Iterate",
    "Touching",
    "advance",
    "assemble",
    "broken_laws",
    "masses",
    "projected",
    "to_local",
    "to_world",
]

# regularisation of the extrapolation's normal equations over their trace [-]
_REGULAR = 1e-10
# numbers of a vector that are combined at once
_PIECE = 1024
# growth of the change of an iteration from which earlier ones mislead [-]
_WORSE = 2.0


class Touching(NamedTuple):
    """Contacts as the iteration sees them; vectors in world axes.

    Attributes
    ----------
    side : (nc, 2) int64, place of the two bodies in the order of elimination, -1: does not move
    normal : (nc, 3) float64 [-]
    arm : (nc, 6) float64, from the two centres of mass [m]
    shift : (nc, 3) float64, u_free + bias n [m/s]
    friction, cohesion, adhesion : (nc,) float64, μ [-], k and s [N s]
    soft : (nc,) float64, 1/σ [kg]
    """

    side: NDArray[np.int64]
    normal: NDArray[np.float64]
    arm: NDArray[np.float64]
    shift: NDArray[np.float64]
    friction: NDArray[np.float64]
    cohesion: NDArray[np.float64]
    adhesion: NDArray[np.float64]
    soft: NDArray[np.float64]


class Iterate(NamedTuple):
    """Iterate of the bodies and contacts, overwritten by the next one.

    Attributes
    ----------
    x, z, q : (nc, 3) float64, as above [N s]; z and q belong to the x of the iteration before
    velocity : (6 nm,) float64, v in the order of elimination [m/s], [rad/s]
    """

    x: NDArray[np.float64]
    z: NDArray[np.float64]
    q: NDArray[np.float64]
    velocity: NDArray[np.float64]


class Factors(NamedTuple):
    """Factors of M + H Σ⁻¹ Hᵀ.

    Attributes
    ----------
    panels : their pattern
    value : as `factorise` leaves them, of single or double precision
    mass : (nm, 6, 6) float64, M in the order of elimination [kg], [kg m²]
    """

    panels: Panels
    value: NDArray[np.floating]
    mass: NDArray[np.float64]


class Acceleration(NamedTuple):
    """Memory of Anderson's extrapolation, a ring of the last iterates.

    Attributes
    ----------
    image, step : (depth + 1, 3 nc) float64, G(x) and G(x) - x [N s]
    gram : (depth + 1, depth + 1) float64, products of the steps
    tally : (2,) int64: how many there are, and the row of the last
    size : (1,) float64, ‖G(x) - x‖² of the last [N² s²]
    """

    image: NDArray[np.float64]
    step: NDArray[np.float64]
    gram: NDArray[np.float64]
    tally: NDArray[np.int64]
    size: NDArray[np.float64]


@njit(cache=True)
def masses(inertia, moving):  # pragma: no cover - compiled
    """Return the matrices (nm, 6, 6) of mass and inertia of some bodies, from their inverses (nb, 7), world axes."""
    result = np.zeros((moving.shape[0], 6, 6))
    for k in range(moving.shape[0]):
        i, m = inertia[moving[k]], result[k]
        first, second, third, determinant = inverse_columns(
            (i[1], i[2], i[3]), (i[2], i[4], i[5]), (i[3], i[5], i[6])
        )
        for a in range(3):
            m[a, a] = 1.0 / i[0]
            m[3 + a, 3], m[3 + a, 4], m[3 + a, 5] = (
                first[a] / determinant,
                second[a] / determinant,
                third[a] / determinant,
            )
    return result


@njit(cache=True)
def _add_product(block, a, b, weight):
    """Add J_aᵀ J_b times a weight to a block (6, 6), of J = (1, -[arm]×), world velocity of the point at an arm."""
    for k in range(3):
        block[k, k] += weight
    # -[b]×, and [a]×
    block[0, 4] += weight * b[2]
    block[0, 5] -= weight * b[1]
    block[1, 3] -= weight * b[2]
    block[1, 5] += weight * b[0]
    block[2, 3] += weight * b[1]
    block[2, 4] -= weight * b[0]
    block[3, 1] -= weight * a[2]
    block[3, 2] += weight * a[1]
    block[4, 0] += weight * a[2]
    block[4, 2] -= weight * a[0]
    block[5, 0] -= weight * a[1]
    block[5, 1] += weight * a[0]
    # -[a]× [b]× = (a·b) - b aᵀ
    along = dot(a, b)
    for i in range(3):
        for k in range(3):
            block[3 + i, 3 + k] -= weight * b[i] * a[k]
        block[3 + i, 3 + i] += weight * along


@njit(cache=True)
def assemble(touching, mass, panels, value):  # pragma: no cover - compiled
    """Write the panels of M + H Σ⁻¹ Hᵀ.

    Inputs
    ------
    touching : Touching
    mass : (nm, 6, 6) float64, in the order of elimination [kg], [kg m²]
    panels : Panels
    value : zeros, of the precision of the factors

    Outputs
    -------
    value : as `factorise` takes it
    """
    body, first, rows, start = panels.body, panels.first, panels.row, panels.start
    owner = np.empty(mass.shape[0], dtype=np.int64)
    own = mass.copy()
    for s in range(body.shape[0] - 1):
        owner[body[s] : body[s + 1]] = s
    side, nc, c = touching.side, touching.side.shape[0], 0
    between = np.zeros((6, 6))
    while c < nc:
        i, j = side[c, 0], side[c, 1]
        between[:] = 0.0
        while c < nc and side[c, 0] == i and side[c, 1] == j:
            arms, weight = touching.arm[c], touching.soft[c]
            a, b = (arms[0], arms[1], arms[2]), (arms[3], arms[4], arms[5])
            if i >= 0:
                _add_product(own[i], a, a, weight)
            if j >= 0:
                _add_product(own[j], b, b, weight)
            if i >= 0 and j >= 0:
                _add_product(between, a, b, weight)
            c += 1
        if i < 0 or j < 0:
            continue
        early, late = min(i, j), max(i, j)
        s = owner[early]
        reach = rows[first[s] : first[s + 1]]
        column, at = 6 * (early - body[s]), 6 * np.searchsorted(reach, late)
        panel = value[start[s] : start[s + 1]].reshape((6 * (body[s + 1] - body[s]), 6 * reach.shape[0]))
        for p in range(6):
            for q in range(6):
                # rows of the panel belong to the earlier body
                panel[column + p, at + q] -= between[p, q] if early == i else between[q, p]
    for k in range(mass.shape[0]):
        s = owner[k]
        at, height = 6 * (k - body[s]), first[s + 1] - first[s]
        panel = value[start[s] : start[s + 1]].reshape((6 * (body[s + 1] - body[s]), 6 * height))
        for p in range(6):
            for q in range(6):
                panel[at + p, at + q] = own[k, p, q]


@njit(cache=True, inline="always")
def _onto(x, n, mu, k):
    """Return the point of a cone about n that is nearest to x."""
    normal = dot(x, n)
    t = x[0] - normal * n[0], x[1] - normal * n[1], x[2] - normal * n[2]
    tangential = np.sqrt(dot(t, t))
    height, radius = onto_cone(normal, tangential, mu, k)
    shrink = radius / tangential if tangential > 0.0 else 0.0
    return shrink * t[0] + height * n[0], shrink * t[1] + height * n[1], shrink * t[2] + height * n[2]


@njit(cache=True, inline="always")
def _speeds(v, k):
    """Return the six velocities of a body, or zeros of one that does not move."""
    if k < 0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return v[6 * k], v[6 * k + 1], v[6 * k + 2], v[6 * k + 3], v[6 * k + 4], v[6 * k + 5]


@njit(cache=True)
def _push(iterate, load, touching, mass):
    """Write z and q of an iterate, and H q - (M + H Σ⁻¹ Hᵀ) v into `load` (6 nm,)."""
    x, kept, q, v = iterate.x, iterate.z, iterate.q, iterate.velocity
    side, normal, arm, shift = touching.side, touching.normal, touching.arm, touching.shift
    friction, cohesion, soft_of = touching.friction, touching.cohesion, touching.soft
    for k in range(mass.shape[0]):
        for p in range(6):
            total = 0.0
            for b in range(6):
                total -= mass[k, p, b] * v[6 * k + b]
            load[6 * k + p] = total
    nc, c = side.shape[0], 0
    while c < nc:
        i, j = side[c, 0], side[c, 1]
        f0 = f1 = f2 = m0 = m1 = m2 = w0 = w1 = w2 = 0.0
        one, other = _speeds(v, i), _speeds(v, j)
        v0, v1, v2 = one[0] - other[0], one[1] - other[1], one[2] - other[2]
        v3, v4, v5, o3, o4, o5 = one[3], one[4], one[5], other[3], other[4], other[5]
        while c < nc and side[c, 0] == i and side[c, 1] == j:
            n, p, soft = row(normal, c), row(x, c), soft_of[c]
            along = dot(p, n)
            t = p[0] - along * n[0], p[1] - along * n[1], p[2] - along * n[2]
            most = friction[c] * along + cohesion[c]
            if along >= 0.0 and most >= 0.0 and dot(t, t) <= most * most:
                # sticks: z = x and y = 0, as for most contacts of a wall
                z, g0, g1, g2 = p, p[0], p[1], p[2]
            else:
                size = np.sqrt(dot(t, t))
                height, radius = onto_cone(along, size, friction[c], cohesion[c])
                shrink = radius / size if size > 0.0 else 0.0
                z = (
                    shrink * t[0] + height * n[0],
                    shrink * t[1] + height * n[1],
                    shrink * t[2] + height * n[2],
                )
                lag = friction[c] * (1.0 - shrink) * size
                g0 = 2.0 * z[0] - p[0] - lag * n[0]
                g1 = 2.0 * z[1] - p[1] - lag * n[1]
                g2 = 2.0 * z[2] - p[2] - lag * n[2]
            kept[c, 0], kept[c, 1], kept[c, 2] = z
            g0 -= shift[c, 0] * soft
            g1 -= shift[c, 1] * soft
            g2 -= shift[c, 2] * soft
            q[c, 0], q[c, 1], q[c, 2] = g0, g1, g2
            a = arm[c]
            g0 -= soft * (v0 + v4 * a[2] - v5 * a[1] - o4 * a[5] + o5 * a[4])
            g1 -= soft * (v1 + v5 * a[0] - v3 * a[2] - o5 * a[3] + o3 * a[5])
            g2 -= soft * (v2 + v3 * a[1] - v4 * a[0] - o3 * a[4] + o4 * a[3])
            f0 += g0
            f1 += g1
            f2 += g2
            m0 += a[1] * g2 - a[2] * g1
            m1 += a[2] * g0 - a[0] * g2
            m2 += a[0] * g1 - a[1] * g0
            w0 += a[4] * g2 - a[5] * g1
            w1 += a[5] * g0 - a[3] * g2
            w2 += a[3] * g1 - a[4] * g0
            c += 1
        if i >= 0:
            to = load[6 * i : 6 * i + 6]
            to[0] += f0
            to[1] += f1
            to[2] += f2
            to[3] += m0
            to[4] += m1
            to[5] += m2
        if j >= 0:
            to = load[6 * j : 6 * j + 6]
            to[0] -= f0
            to[1] -= f1
            to[2] -= f2
            to[3] -= w0
            to[4] -= w1
            to[5] -= w2


@njit(cache=True)
def _pull(iterate, image, v, over, touching):
    """Write the next iterate's x into `image` (nc, 3), from the velocities v (6 nm,)."""
    x, z, q = iterate.x, iterate.z, iterate.q
    side, arm, soft_of = touching.side, touching.arm, touching.soft
    nc, c = side.shape[0], 0
    while c < nc:
        i, j = side[c, 0], side[c, 1]
        one, other = _speeds(v, i), _speeds(v, j)
        v0, v1, v2 = one[0] - other[0], one[1] - other[1], one[2] - other[2]
        v3, v4, v5, o3, o4, o5 = one[3], one[4], one[5], other[3], other[4], other[5]
        while c < nc and side[c, 0] == i and side[c, 1] == j:
            a, soft = arm[c], soft_of[c]
            r0 = q[c, 0] - soft * (v0 + v4 * a[2] - v5 * a[1] - o4 * a[5] + o5 * a[4])
            r1 = q[c, 1] - soft * (v1 + v5 * a[0] - v3 * a[2] - o5 * a[3] + o3 * a[5])
            r2 = q[c, 2] - soft * (v2 + v3 * a[1] - v4 * a[0] - o3 * a[4] + o4 * a[3])
            image[c, 0] = x[c, 0] + over * (r0 - z[c, 0])
            image[c, 1] = x[c, 1] + over * (r1 - z[c, 1])
            image[c, 2] = x[c, 2] + over * (r2 - z[c, 2])
            c += 1


@njit(cache=True)
def to_world(geometry, local):  # pragma: no cover - compiled
    """Return vectors (nc, 3) of contacts in world axes.

    Inputs
    ------
    geometry : (nc, 15) float64, rows n, t1, t2 of the frames first
    local : (nc, 3) float64, in these frames
    """
    world = np.empty_like(local)
    for c in range(local.shape[0]):
        f, (x, y, z) = geometry[c], row(local, c)
        for i in range(3):
            world[c, i] = f[i] * x + f[3 + i] * y + f[6 + i] * z
    return world


@njit(cache=True)
def to_local(geometry, world):  # pragma: no cover - compiled
    """Return vectors (nc, 3) of contacts in their frames, from world axes: the reverse of `to_world`."""
    local = np.empty_like(world)
    for c in range(world.shape[0]):
        f, (x, y, z) = geometry[c], row(world, c)
        for k in range(3):
            local[c, k] = f[3 * k] * x + f[3 * k + 1] * y + f[3 * k + 2] * z
    return local


@njit(cache=True)
def projected(impulse, friction, cohesion):  # pragma: no cover - compiled
    """Return the nearest impulses (nc, 3) in the cones, local frames [N s]."""
    result = np.empty_like(impulse)
    for c in range(impulse.shape[0]):
        write_row(result, c, _onto(row(impulse, c), (1.0, 0.0, 0.0), friction[c], cohesion[c]))
    return result


@njit(cache=True)
def _moved(velocity, step, length):
    """Add a step to velocities; return the largest of a body, or of a point `length` from its centre as it turns."""
    change = 0.0
    for k in range(0, step.shape[0], 6):
        for a in range(3):
            change = max(change, abs(step[k + a]), length * abs(step[k + 3 + a]))
    for k in range(step.shape[0]):
        velocity[k] += step[k]
    return change


@njit(cache=True, fastmath={"contract", "reassoc"})
def _product(a, b):
    total = 0.0
    for i in range(a.shape[0]):
        total += a[i] * b[i]
    return total


@njit(cache=True, fastmath={"contract", "reassoc"})
def _extrapolate(x, image, memory):
    """Write the next iterate (3 nc,) into x, from G(x): that of the combination of iterates with the least step."""
    depth = memory.image.shape[0]
    last = (memory.tally[1] + 1) % depth
    kept, step = memory.image[last], memory.step[last]
    size = 0.0
    for i in range(x.shape[0]):
        kept[i] = image[i]
        step[i] = image[i] - x[i]
        size += step[i] ** 2
    if memory.tally[0] > 0 and not size <= _WORSE * _WORSE * memory.size[0]:
        memory.tally[0] = 0
    memory.size[0] = size
    memory.tally[1] = last
    known = min(memory.tally[0] + 1, depth)
    memory.tally[0] = known
    for k in range(known):
        other = (last - k) % depth
        memory.gram[last, other] = memory.gram[other, last] = _product(step, memory.step[other])
    weight = np.zeros(depth)
    if known > 1:
        # steps as differences from the last: ‖s - Σ γ_k (s - s_k)‖² → min
        n = known - 1
        a, b, trace = np.empty((n, n)), np.empty(n), 0.0
        g = memory.gram
        for k in range(n):
            p = (last - 1 - k) % depth
            for m in range(n):
                o = (last - 1 - m) % depth
                a[k, m] = g[last, last] - g[last, p] - g[last, o] + g[p, o]
            b[k] = g[last, last] - g[last, p]
            trace += a[k, k]
        if trace > 0.0:
            for k in range(n):
                a[k, k] += _REGULAR * trace
            found = np.linalg.solve(a, b)
            for k in range(n):
                weight[k] = found[k]
    total = 0.0
    for k in range(known - 1):
        total += weight[k]
    # by pieces that stay in the fastest memory
    for start in range(0, x.shape[0], _PIECE):
        piece, own = x[start : start + _PIECE], kept[start : start + _PIECE]
        for i in range(piece.shape[0]):
            piece[i] = (1.0 - total) * own[i]
        for k in range(known - 1):
            other, part = memory.image[(last - 1 - k) % depth][start : start + _PIECE], weight[k]
            for i in range(piece.shape[0]):
                piece[i] += part * other[i]


@njit(cache=True)
def advance(iterate, count, limit, over, length, touching, factors, memory):  # pragma: no cover - compiled
    """Make iterations until one changes no body's velocity by more than a limit.

    That change costs nothing and falls with the residual, of which the impulses tell nothing: forces that stones in a
    gap exert on each other may grow in each iteration without any effect.

    Inputs
    ------
    iterate : Iterate
    count : int64, most iterations
    limit : float64, of the change of velocities [m/s]
    over : float64, ω [-]
    length : float64, distance at which rotations count [m]
    touching : Touching
    factors : Factors
    memory : Acceleration; of depth 0, no extrapolation

    Outputs
    -------
    iterate, memory : written
    int64, iterations made; float64, the last change [m/s]
    """
    panels, x, velocity = factors.panels, iterate.x, iterate.velocity
    highest = 0
    for s in range(panels.body.shape[0] - 1):
        highest = max(highest, panels.first[s + 1] - panels.first[s])
    image, load = np.empty_like(x), np.empty_like(velocity)
    step = np.empty(velocity.shape[0], factors.value.dtype)
    work = np.empty(6 * highest, factors.value.dtype)
    change = np.inf
    for k in range(count):
        _push(iterate, load, touching, factors.mass)
        for i in range(load.shape[0]):
            step[i] = load[i]
        solve(panels, factors.value, step, work)
        change = _moved(velocity, step, length)
        _pull(iterate, image, velocity, over, touching)
        if memory.image.shape[0] > 1:
            _extrapolate(x.reshape(x.size), image.reshape(x.size), memory)
        else:
            x[:] = image
        if not change > limit:
            return k + 1, change
    return count, change


@njit(cache=True)
def broken_laws(x, touching, free, inertia, rho, z):  # pragma: no cover - compiled
    """Compute the impulses z = P_K(x), and by how much they break the laws of contact.

    Inputs
    ------
    x : (nc, 3) float64 [N s]
    touching : Touching
    free : (nc, 3) float64, u_free, world axes [m/s]
    inertia : (nm, 7) float64, inverse masses and inertias of the bodies, in the order of elimination
    rho : float64, 1 over the scale of W [kg]

    Outputs
    -------
    z : (nc, 3), written
    whole, largest : ‖e‖ over all contacts, and of the worst [N s]
    size : the larger of ‖z‖ and ‖P_K(z - ρ û)‖ [N s]
    """
    side, normal, arm = touching.side, touching.normal, touching.arm
    friction, cohesion, nc = touching.friction, touching.cohesion, touching.side.shape[0]
    v = np.zeros((inertia.shape[0], 6))
    for c in range(nc):
        f = _onto(row(x, c), row(normal, c), friction[c], cohesion[c])
        write_row(z, c, f)
        for s in range(2):
            k, sign = side[c, s], 1.0 - 2.0 * s
            if k >= 0:
                moment = cross((arm[c, 3 * s], arm[c, 3 * s + 1], arm[c, 3 * s + 2]), f)
                for a in range(3):
                    v[k, a] += sign * f[a]
                    v[k, 3 + a] += sign * moment[a]
    for k in range(inertia.shape[0]):
        i, moment = inertia[k], (v[k, 3], v[k, 4], v[k, 5])
        for a in range(3):
            v[k, a] *= i[0]
        v[k, 3] = dot((i[1], i[2], i[3]), moment)
        v[k, 4] = dot((i[2], i[4], i[5]), moment)
        v[k, 5] = dot((i[3], i[5], i[6]), moment)
    whole = largest = size = projected = 0.0
    for c in range(nc):
        n, f = row(normal, c), row(z, c)
        u0, u1, u2 = free[c, 0], free[c, 1], free[c, 2]
        for s in range(2):
            k, sign = side[c, s], 1.0 - 2.0 * s
            if k >= 0:
                turn = cross(
                    (v[k, 3], v[k, 4], v[k, 5]), (arm[c, 3 * s], arm[c, 3 * s + 1], arm[c, 3 * s + 2])
                )
                u0 += sign * (v[k, 0] + turn[0])
                u1 += sign * (v[k, 1] + turn[1])
                u2 += sign * (v[k, 2] + turn[2])
        along = u0 * n[0] + u1 * n[1] + u2 * n[2]
        slide = np.sqrt((u0 - along * n[0]) ** 2 + (u1 - along * n[1]) ** 2 + (u2 - along * n[2]) ** 2)
        # the bias is what the shift has beyond u_free
        bias = 0.0
        for a in range(3):
            bias += (touching.shift[c, a] - free[c, a]) * n[a]
        up = bias + friction[c] * slide
        p = f[0] - rho * (u0 + up * n[0]), f[1] - rho * (u1 + up * n[1]), f[2] - rho * (u2 + up * n[2])
        g = _onto(p, n, friction[c], cohesion[c])
        e = (f[0] - g[0]) ** 2 + (f[1] - g[1]) ** 2 + (f[2] - g[2]) ** 2
        whole += e
        largest = max(largest, e)
        shift = touching.adhesion[c]
        size += (f[0] - shift * n[0]) ** 2 + (f[1] - shift * n[1]) ** 2 + (f[2] - shift * n[2]) ** 2
        projected += (g[0] - shift * n[0]) ** 2 + (g[1] - shift * n[1]) ** 2 + (g[2] - shift * n[2]) ** 2
    return np.sqrt(whole), np.sqrt(largest), np.sqrt(max(size, projected))
