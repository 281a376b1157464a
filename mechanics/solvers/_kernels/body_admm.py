"""Numba kernels of ADMM between rigid bodies, in world axes, with the velocities of the bodies as unknowns.

Each contact has a penalty σ of its own, the same in all directions. So its frame drops out of M + H Σ⁻¹ Hᵀ, of which
the lever arms alone are needed, and of the iteration all that is left of the frame is the normal n. With x = z + y,
where z = P_K(x) holds the impulses and û = -σ y the velocities that are dual to them, an iteration is

    q = z - y - (u_free + bias n + μ‖û_T‖ n) / σ,     (M + H Σ⁻¹ Hᵀ) v = H q,     r = q - Hᵀ v / σ
    x ← y + ω r + (1 - ω) z

where joints are rigid. Joints with a compliance E have σ + E for σ in M + H Σ⁻¹ Hᵀ, and r = σ/(σ + E) (q - Hᵀ v / σ);
E is one number across the joint and one along it. One pass over the contacts, between two solutions for v, makes it:
the x that it finds gives the next q. What is solved for is the change of v, from H q - (M + H Σ⁻¹ Hᵀ) v, so that
factors of single precision lose nothing: each iteration corrects the last one's errors.

Contacts of the same two bodies follow each other in runs, so the bodies' velocities and sums stay in registers. Runs of
one part of the bodies (`body_parts`) touch no other part, so that parts may be taken at once. Numbers of contacts stand
in blocks, row by row, so that loops over a block have no branch and take several contacts at once.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mechanics.contact._kernels.vectors import cross, dot, row, write_row
from mechanics.delassus._kernels.sides import inverse_columns
from mechanics.problem._kernels import onto_cone
from mechanics.solvers._kernels.body_cholesky import Panels, backward, forward
from mechanics.solvers._kernels.body_parts import Parts
from mechanics.solvers.scales import ROUNDING

# places of a block: a multiple of what a processor multiplies at once, so few that a block stays in the fastest memory
BLOCK = 64
# rows of a block of a field, and where the vectors and numbers of contacts begin
ROWS = 17
ARM, SHIFT, FRICTION, COHESION, ADHESION, SOFT, SHARE, YIELD = 3, 6, 9, 10, 11, 12, 13, 15


class Runs(NamedTuple):
    """Runs of contacts of the same two bodies, in blocks of `BLOCK` places, of which some at the end may be empty.

    Attributes
    ----------
    begin, end : (nr,) int64, first place of each run, and the one after the last
    body : (nr, 2) int64, the two bodies in the order of elimination, -1: does not move
    sum : (nr, 2) int64, where what the run exerts on them adds up, as in `Parts`
    offset : (nr, 3) float64, the candidate's arms less the antagonist's, which all contacts of a run share [m]
    block : (n+1,) int64, first run of each block
    part : (k+2,) int64, first block of each part; the last holds those between bodies of no part
    """

    begin: NDArray[np.int64]
    end: NDArray[np.int64]
    body: NDArray[np.int64]
    sum: NDArray[np.int64]
    offset: NDArray[np.float64]
    block: NDArray[np.int64]
    part: NDArray[np.int64]


class Touching(NamedTuple):
    """Contacts as the iteration sees them; vectors in world axes.

    Attributes
    ----------
    runs : of the contacts
    field : (n ROWS BLOCK,) float64, block by block, and row by row in it, one number for each place: normal n [-], the
        arm from the candidate's centre of mass [m], shift u_free + bias n [m/s], friction μ [-], cohesion k and
        adhesion s [N s], 1/σ [kg], σ/(σ + E) across the joint and along it [-], and E [1/kg], the compliance of the
        joint; 0 where a place is empty
    """

    runs: Runs
    field: NDArray[np.float64]


class Iterate(NamedTuple):
    """Iterate of the bodies and contacts, overwritten by the next one.

    Attributes
    ----------
    x : (3 n BLOCK,) float64, as above, in blocks of three rows [N s]
    way : alike, σ q / (σ + E) - z [N s]
    velocity : (6 nm,) float64, v in the order of elimination [m/s], [rad/s]
    load : (6 (nm + (k+1) ns),) float64, H q - (M + H Σ⁻¹ Hᵀ) v by bodies, and by copies of those between the k parts
    """

    x: NDArray[np.float64]
    way: NDArray[np.float64]
    velocity: NDArray[np.float64]
    load: NDArray[np.float64]


class Factors(NamedTuple):
    """Factors of M + H Σ⁻¹ Hᵀ.

    Attributes
    ----------
    panels, parts : their pattern
    value : as `divide` leaves them, of single or double precision
    mass : (nm, 6, 6) float64, M in the order of elimination [kg], [kg m²]
    """

    panels: Panels
    parts: Parts
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
def _add_outer(block, one, other, weight):
    """Add what a contact has across its joint, over what it has along it."""
    if weight == 0.0:
        return
    for i in range(6):
        for k in range(6):
            block[i, k] += weight * one[i] * other[k]


@njit(cache=True, inline="always")
def _vector(rows, at):
    """Return a vector of a block."""
    return rows[at], rows[at + BLOCK], rows[at + 2 * BLOCK]


@njit(cache=True)
def packed(sizes, part, parts):  # pragma: no cover - compiled
    """Return where runs begin among the places of blocks, so that none lies in two blocks and no block in two parts.

    Inputs
    ------
    sizes : (nr,) int64, contacts of each run, `BLOCK` at most
    part : (nr,) int64, their part, in order
    parts : int64, number of the parts

    Outputs
    -------
    begin : (nr,) int64
    block : (n+1,) int64, first run of each block
    of_part : (parts+1,) int64, first block of each part
    """
    count = sizes.shape[0]
    begin, block, of_part = (
        np.empty(count, np.int64),
        np.empty(count + 1, np.int64),
        np.empty(parts + 1, np.int64),
    )
    blocks, used, reached = 0, BLOCK, 0
    for g in range(count):
        new = used + sizes[g] > BLOCK
        while reached <= part[g]:
            of_part[reached] = blocks
            reached, new = reached + 1, True
        if new:
            block[blocks] = g
            blocks, used = blocks + 1, 0
        begin[g] = BLOCK * (blocks - 1) + used
        used += sizes[g]
    while reached <= parts:
        of_part[reached] = blocks
        reached += 1
    block[blocks] = count
    return begin, block[: blocks + 1].copy(), of_part


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
    value : as `eliminate` takes it
    """
    body, first, rows, start = panels.body, panels.first, panels.row, panels.start
    owner = np.empty(mass.shape[0], dtype=np.int64)
    own = mass.copy()
    for s in range(body.shape[0] - 1):
        owner[body[s] : body[s + 1]] = s
    runs, field = touching.runs, touching.field
    between = np.zeros((6, 6))
    for g in range(runs.body.shape[0]):
        i, j = runs.body[g]
        between[:] = 0.0
        for c in range(runs.begin[g], runs.end[g]):
            at = ROWS * BLOCK * (c // BLOCK) + c % BLOCK
            a, soft = _vector(field, at + ARM * BLOCK), field[at + SOFT * BLOCK]
            across, weight = soft * field[at + SHARE * BLOCK], soft * field[at + (SHARE + 1) * BLOCK]
            b = a[0] - runs.offset[g, 0], a[1] - runs.offset[g, 1], a[2] - runs.offset[g, 2]
            n = _vector(field, at)
            one, other = (*n, *cross(a, n)), (*n, *cross(b, n))
            if i >= 0:
                _add_product(own[i], a, a, weight)
                _add_outer(own[i], one, one, across - weight)
            if j >= 0:
                _add_product(own[j], b, b, weight)
                _add_outer(own[j], other, other, across - weight)
            if i >= 0 and j >= 0:
                _add_product(between, a, b, weight)
                _add_outer(between, one, other, across - weight)
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
def _velocities(block, v, touching, room):
    """Write Hᵀ v of the contacts of a block into the first three rows of `room` (6 BLOCK,)."""
    runs, base = touching.runs, BLOCK * block
    for g in range(runs.block[block], runs.block[block + 1]):
        one, other, s = _speeds(v, runs.body[g, 0]), _speeds(v, runs.body[g, 1]), row(runs.offset, g)
        # the arm of the antagonist is that of the candidate less a vector that all of a run share
        c0 = one[0] - other[0] + other[4] * s[2] - other[5] * s[1]
        c1 = one[1] - other[1] + other[5] * s[0] - other[3] * s[2]
        c2 = one[2] - other[2] + other[3] * s[1] - other[4] * s[0]
        w0, w1, w2 = one[3] - other[3], one[4] - other[4], one[5] - other[5]
        for c in range(runs.begin[g] - base, runs.end[g] - base):
            room[c], room[BLOCK + c], room[2 * BLOCK + c] = c0, c1, c2
            room[3 * BLOCK + c], room[4 * BLOCK + c], room[5 * BLOCK + c] = w0, w1, w2
    _turned(room, touching.field[ROWS * base : ROWS * (base + BLOCK)])


@njit(cache=True, fastmath={"contract"})
def _turned(room, field):
    """Add the rotations in the last three rows of `room`, about the arms, to the velocities in the first three."""
    for c in range(BLOCK):
        a0, a1, a2 = field[ARM * BLOCK + c], field[(ARM + 1) * BLOCK + c], field[(ARM + 2) * BLOCK + c]
        w0, w1, w2 = room[3 * BLOCK + c], room[4 * BLOCK + c], room[5 * BLOCK + c]
        room[c] += w1 * a2 - w2 * a1
        room[BLOCK + c] += w2 * a0 - w0 * a2
        room[2 * BLOCK + c] += w0 * a1 - w1 * a0


@njit(cache=True)
def _gather(block, touching, room, load, place):
    """Add the forces and moments (6 BLOCK,) of a block's contacts to what acts on their bodies, by run, at `place`."""
    runs, base = touching.runs, BLOCK * block
    for g in range(runs.block[block], runs.block[block + 1]):
        f0 = f1 = f2 = m0 = m1 = m2 = 0.0
        for c in range(runs.begin[g] - base, runs.end[g] - base):
            f0 += room[c]
            f1 += room[BLOCK + c]
            f2 += room[2 * BLOCK + c]
            m0 += room[3 * BLOCK + c]
            m1 += room[4 * BLOCK + c]
            m2 += room[5 * BLOCK + c]
        if runs.body[g, 0] >= 0:
            _add(load, place[g, 0], (f0, f1, f2, m0, m1, m2))
        if runs.body[g, 1] >= 0:
            s = row(runs.offset, g)
            m0 -= s[1] * f2 - s[2] * f1
            m1 -= s[2] * f0 - s[0] * f2
            m2 -= s[0] * f1 - s[1] * f0
            _add(load, place[g, 1], (-f0, -f1, -f2, -m0, -m1, -m2))


@njit(cache=True, fastmath={"contract"})
def _relax(x, image, way, room, field, over):
    """Write x + ω (r - z) of a block into `image`, and u / (σ + E) where u is."""
    for c in range(BLOCK):
        n0, n1, n2, soft = field[c], field[BLOCK + c], field[2 * BLOCK + c], field[SOFT * BLOCK + c]
        across, along = soft * field[SHARE * BLOCK + c], soft * field[(SHARE + 1) * BLOCK + c]
        u0, u1, u2 = room[c], room[BLOCK + c], room[2 * BLOCK + c]
        more = (across - along) * (u0 * n0 + u1 * n1 + u2 * n2)
        room[c] = along * u0 + more * n0
        room[BLOCK + c] = along * u1 + more * n1
        room[2 * BLOCK + c] = along * u2 + more * n2
    for c in range(3 * BLOCK):
        image[c] = x[c] + over * (way[c] - room[c])


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _exerted(x, way, room, field):
    """Write σ q / (σ + E) - z of a block's x into `way`, and r, with its moments, into `room`, where u / (σ + E) is."""
    for c in range(BLOCK):
        n0, n1, n2 = field[c], field[BLOCK + c], field[2 * BLOCK + c]
        mu, k, soft = field[FRICTION * BLOCK + c], field[COHESION * BLOCK + c], field[SOFT * BLOCK + c]
        x0, x1, x2 = x[c], x[BLOCK + c], x[2 * BLOCK + c]
        along = x0 * n0 + x1 * n1 + x2 * n2
        t0, t1, t2 = x0 - along * n0, x1 - along * n1, x2 - along * n2
        size = np.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
        height, shrink = _height_and_shrink(along, size, mu, k)
        inside = (along >= 0.0) & (size <= mu * along + k)
        # sticks, as most contacts of a wall: z = x and y = 0
        lag = 0.0 if inside else mu * (size - shrink * size)
        y0 = 0.0 if inside else x0 - (shrink * t0 + height * n0)
        y1 = 0.0 if inside else x1 - (shrink * t1 + height * n1)
        y2 = 0.0 if inside else x2 - (shrink * t2 + height * n2)
        z0, z1, z2 = x0 - y0, x1 - y1, x2 - y2
        q0 = z0 - y0 - lag * n0 - field[SHIFT * BLOCK + c] * soft
        q1 = z1 - y1 - lag * n1 - field[(SHIFT + 1) * BLOCK + c] * soft
        q2 = z2 - y2 - lag * n2 - field[(SHIFT + 2) * BLOCK + c] * soft
        share = field[(SHARE + 1) * BLOCK + c]
        more = (field[SHARE * BLOCK + c] - share) * (q0 * n0 + q1 * n1 + q2 * n2)
        q0, q1, q2 = share * q0 + more * n0, share * q1 + more * n1, share * q2 + more * n2
        way[c], way[BLOCK + c], way[2 * BLOCK + c] = q0 - z0, q1 - z1, q2 - z2
        room[c] = q0 - room[c]
        room[BLOCK + c] = q1 - room[BLOCK + c]
        room[2 * BLOCK + c] = q2 - room[2 * BLOCK + c]
    _moments(room, field)


@njit(cache=True, fastmath={"contract"})
def _moments(room, field):
    """Write the moments of the forces in the first three rows of `room` about the arms into the last three."""
    for c in range(BLOCK):
        a0, a1, a2 = field[ARM * BLOCK + c], field[(ARM + 1) * BLOCK + c], field[(ARM + 2) * BLOCK + c]
        f0, f1, f2 = room[c], room[BLOCK + c], room[2 * BLOCK + c]
        room[3 * BLOCK + c] = a1 * f2 - a2 * f1
        room[4 * BLOCK + c] = a2 * f0 - a0 * f2
        room[5 * BLOCK + c] = a0 * f1 - a1 * f0


@njit(cache=True, inline="always")
def _height_and_shrink(along, size, mu, k):
    """Return the height of the nearest point of a cone, and by how much its tangent is shorter; without a branch.

    As `onto_cone`, for points outside of it: on the disk of the cohesion, on the line t = μ n + k, or in its corner.
    """
    foot = (along + mu * (size - k)) / (1.0 + mu * mu)
    height = foot if foot > 0.0 else 0.0
    disk = (along < 0.0) & (size <= k)
    radius = size if disk else mu * height + k
    return (0.0 if disk else height), radius / (size if size > 0.0 else 1.0)


@njit(cache=True)
def _pass(part, iterate, image, over, touching, does):
    """Find the next x of a part's contacts, if the first of `does`, and what they exert by the next q, if the second.

    x + ω (r - z) goes to `image`, which may be x itself, and then exerts.
    """
    pull, push = does
    runs, room = touching.runs, np.zeros(6 * BLOCK)
    for block in range(runs.part[part], runs.part[part + 1]):
        begin, end = 3 * BLOCK * block, 3 * BLOCK * (block + 1)
        x, to, way = iterate.x[begin:end], image[begin:end], iterate.way[begin:end]
        field = touching.field[ROWS * BLOCK * block : ROWS * BLOCK * (block + 1)]
        _velocities(block, iterate.velocity, touching, room)
        _relax(x, to, way, room, field, over if pull else 0.0)
        if push:
            _exerted(to, way, room, field)
            _gather(block, touching, room, iterate.load, runs.sum)


@njit(cache=True, inline="always")
def _add(load, k, six):
    """Add six numbers of a body or copy."""
    for a in range(6):
        load[6 * k + a] += six[a]


@njit(cache=True)
def _inertial(load, velocity, mass, k):
    """Write -M v of a body."""
    for p in range(6):
        total = 0.0
        for b in range(6):
            total -= mass[k, p, b] * velocity[6 * k + b]
        load[6 * k + p] = total


@njit(cache=True)
def _exert(part, iterate, image, over, touching, factors, does):
    """Write what acts on the bodies of a part, and on its copies of those between parts, as `_pass` finds it."""
    parts, load, bodies = factors.parts, iterate.load, factors.mass.shape[0]
    if does[1] and part < parts.body.shape[0]:
        for k in range(parts.body[part, 0], parts.body[part, 1]):
            _inertial(load, iterate.velocity, factors.mass, k)
    copies = bodies + part * parts.shared.shape[0]
    for a in range(6 * copies, 6 * (copies + parts.shared.shape[0])):
        load[a] = 0.0
    _pass(part, iterate, image, over, touching, does)


@njit(cache=True)
def _down(part, load, step, factors):
    """Solve downwards for the bodies of a part; its copies of those between parts gather what these contribute."""
    parts, bodies = factors.parts, factors.mass.shape[0]
    first, last = parts.panel[part]
    for a in range(6 * parts.body[part, 0], 6 * parts.body[part, 1]):
        step[a] = load[a]
    copies = bodies + part * parts.shared.shape[0]
    for a in range(6 * copies, 6 * (copies + parts.shared.shape[0])):
        step[a] = 0.0
    work = np.empty(_longest(factors.panels, first, last), factors.value.dtype)
    forward(factors.panels, factors.value, step, work, first, last, parts.row)


@njit(cache=True)
def _longest(panels, begin, end):
    """Return the length of the longest of some panels."""
    longest = 0
    for s in range(begin, end):
        longest = max(longest, panels.first[s + 1] - panels.first[s])
    return panels.size * longest


@njit(cache=True, nogil=True)
def between(iterate, step, length, factors):  # pragma: no cover - compiled
    """Solve for the bodies between parts, from what all parts contribute, and move them; inputs as of `up`.

    Outputs
    -------
    iterate, step : written
    float64, the largest change of velocity of these bodies [m/s]
    """
    parts, panels, load, velocity = factors.parts, factors.panels, iterate.load, iterate.velocity
    bodies, count, many = factors.mass.shape[0], parts.body.shape[0], parts.shared.shape[0]
    for r in range(many):
        k = parts.shared[r]
        _inertial(load, velocity, factors.mass, k)
        for part in range(count + 1):
            come = 6 * (bodies + part * many + r)
            for a in range(6):
                load[6 * k + a] += load[come + a]
        for a in range(6 * k, 6 * k + 6):
            step[a] = load[a]
        for part in range(count):
            come = 6 * (bodies + part * many + r)
            for a in range(6):
                step[6 * k + a] += step[come + a]
    change, rest = 0.0, parts.rest
    for i in range(rest.shape[0]):
        s = rest[i]
        work = np.empty(_longest(panels, s, s + 1), step.dtype)
        forward(panels, factors.value, step, work, s, s + 1, panels.row)
    for i in range(rest.shape[0] - 1, -1, -1):
        s = rest[i]
        work = np.empty(_longest(panels, s, s + 1), step.dtype)
        backward(panels, factors.value, step, work, s, s + 1)
        change = max(change, _moved(velocity, step, length, panels.body[s], panels.body[s + 1]))
    return change


@njit(cache=True)
def _up(part, velocity, step, length, factors):
    """Solve upwards for the bodies of a part and move them; return their largest change of velocity [m/s]."""
    first, last = factors.parts.panel[part]
    work = np.empty(_longest(factors.panels, first, last), step.dtype)
    backward(factors.panels, factors.value, step, work, first, last)
    return _moved(velocity, step, length, factors.parts.body[part, 0], factors.parts.body[part, 1])


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
def _moved(velocity, step, length, begin, end):
    """Add a step to the velocities of some bodies; return its largest, rotations counted at a distance `length`."""
    change = 0.0
    for k in range(6 * begin, 6 * end, 6):
        for a in range(3):
            change = max(change, abs(step[k + a]), length * abs(step[k + 3 + a]))
    for k in range(6 * begin, 6 * end):
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
    if memory.tally[0] > 0 and not size <= memory.size[0]:
        # where steps grow, earlier ones mislead
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
                a[k, k] += ROUNDING * trace
            found = np.linalg.solve(a, b)
            for k in range(n):
                weight[k] = found[k]
    total = 0.0
    for k in range(known - 1):
        total += weight[k]
    # by blocks, which stay in the fastest memory
    for start in range(0, x.shape[0], 3 * BLOCK):
        end = start + 3 * BLOCK
        piece, own = x[start:end], kept[start:end]
        for i in range(piece.shape[0]):
            piece[i] = (1.0 - total) * own[i]
        for k in range(known - 1):
            other, part = memory.image[(last - 1 - k) % depth][start:end], weight[k]
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
    x, parts = iterate.x, factors.parts.body.shape[0]
    step = np.empty(iterate.load.shape[0], factors.value.dtype)
    extrapolated = memory.image.shape[0] > 1
    image = np.empty_like(x) if extrapolated else x
    change = np.inf
    for part in range(parts + 1):
        _exert(part, iterate, x, over, touching, factors, (False, True))
    for k in range(count):
        for part in range(parts):
            _down(part, iterate.load, step, factors)
        change = between(iterate, step, length, factors)
        for part in range(parts):
            change = max(change, _up(part, iterate.velocity, step, length, factors))
        for part in range(parts + 1):
            _exert(part, iterate, image, over, touching, factors, (True, not extrapolated))
        if extrapolated:
            _extrapolate(x, image, memory)
            for part in range(parts + 1):
                _exert(part, iterate, x, over, touching, factors, (False, True))
        if not change > limit:
            return k + 1, change
    return count, change


@njit(cache=True, nogil=True)
def begin(which, iterate, touching, factors):  # pragma: no cover - compiled
    """Find what some parts' contacts exert, with which `down` begins.

    Inputs
    ------
    which : int64, the parts, of which the last is that of the contacts between parts
    iterate, touching, factors : as in `advance`

    Outputs
    -------
    iterate : written
    """
    for part in which:
        _exert(part, iterate, iterate.x, 0.0, touching, factors, (False, True))


@njit(cache=True, nogil=True)
def down(which, iterate, step, factors):  # pragma: no cover - compiled
    """Solve downwards for the bodies of some parts: the first of the three stages of an iteration.

    Inputs
    ------
    which, iterate, factors : as in `begin`
    step : as long as `iterate.load`, of the precision of the factors

    Outputs
    -------
    step : written
    """
    for part in which:
        if part < factors.parts.body.shape[0]:
            _down(part, iterate.load, step, factors)


@njit(cache=True, nogil=True)
def up(which, iterate, step, lengths, touching, factors):  # pragma: no cover - compiled
    """Solve upwards for the bodies of some parts, and go on with their contacts: the last stage, after `between`.

    Inputs
    ------
    lengths : ω [-], and the distance at which rotations count [m]
    which, iterate, step, touching, factors : as in `down`

    Outputs
    -------
    iterate : written
    float64, the largest change of velocity of their bodies [m/s]
    """
    over, length = lengths
    change = 0.0
    for part in which:
        if part < factors.parts.body.shape[0]:
            change = max(change, _up(part, iterate.velocity, step, length, factors))
        _exert(part, iterate, iterate.x, over, touching, factors, (True, True))
    return change


@njit(cache=True, fastmath={"contract"}, error_model="numpy")
def _projected(x, z, field):
    """Write the nearest points of a block's cones into z."""
    for c in range(BLOCK):
        n0, n1, n2 = field[c], field[BLOCK + c], field[2 * BLOCK + c]
        mu, k = field[FRICTION * BLOCK + c], field[COHESION * BLOCK + c]
        x0, x1, x2 = x[c], x[BLOCK + c], x[2 * BLOCK + c]
        along = x0 * n0 + x1 * n1 + x2 * n2
        t0, t1, t2 = x0 - along * n0, x1 - along * n1, x2 - along * n2
        size = np.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
        height, shrink = _height_and_shrink(along, size, mu, k)
        inside = (along >= 0.0) & (size <= mu * along + k)
        z[c] = x0 if inside else shrink * t0 + height * n0
        z[BLOCK + c] = x1 if inside else shrink * t1 + height * n1
        z[2 * BLOCK + c] = x2 if inside else shrink * t2 + height * n2


@njit(cache=True, fastmath={"contract"})
def _opposed(z, room, free, field, rho):
    """Write z - ρ û of a block into `room`, where Hᵀ v is."""
    for c in range(BLOCK):
        n0, n1, n2 = field[c], field[BLOCK + c], field[2 * BLOCK + c]
        free0, free1, free2 = free[c], free[BLOCK + c], free[2 * BLOCK + c]
        z0, z1, z2 = z[c], z[BLOCK + c], z[2 * BLOCK + c]
        give = field[(YIELD + 1) * BLOCK + c]
        more = (field[YIELD * BLOCK + c] - give) * (z0 * n0 + z1 * n1 + z2 * n2)
        u0 = room[c] + free0 + give * z0 + more * n0
        u1 = room[BLOCK + c] + free1 + give * z1 + more * n1
        u2 = room[2 * BLOCK + c] + free2 + give * z2 + more * n2
        along = u0 * n0 + u1 * n1 + u2 * n2
        t0, t1, t2 = u0 - along * n0, u1 - along * n1, u2 - along * n2
        # the bias is what the shift has beyond u_free
        up = (
            (field[SHIFT * BLOCK + c] - free0) * n0
            + (field[(SHIFT + 1) * BLOCK + c] - free1) * n1
            + (field[(SHIFT + 2) * BLOCK + c] - free2) * n2
            + field[FRICTION * BLOCK + c] * np.sqrt(t0 * t0 + t1 * t1 + t2 * t2)
        )
        room[c] = z0 - rho * (u0 + up * n0)
        room[BLOCK + c] = z1 - rho * (u1 + up * n1)
        room[2 * BLOCK + c] = z2 - rho * (u2 + up * n2)


@njit(cache=True, fastmath={"contract", "reassoc"})
def _apart(z, other, field):
    """Return the sum and the largest of ‖z - other‖² of a block's contacts, and the sums of ‖z - s n‖² of both."""
    whole = largest = size = projected = 0.0
    for c in range(BLOCK):
        shift = field[ADHESION * BLOCK + c]
        e = one = two = 0.0
        for i in range(3):
            f, g, less = z[i * BLOCK + c], other[i * BLOCK + c], shift * field[i * BLOCK + c]
            e += (f - g) ** 2
            one += (f - less) ** 2
            two += (g - less) ** 2
        whole += e
        largest = max(largest, e)
        size += one
        projected += two
    return whole, largest, size, projected


@njit(cache=True)
def broken_laws(x, touching, free, inertia, rho, z):  # pragma: no cover - compiled
    """Compute the impulses z = P_K(x), and by how much they break the laws of contact.

    Inputs
    ------
    x : (3 n BLOCK,) float64, as in `Iterate` [N s]
    touching : Touching
    free : alike, u_free, world axes [m/s]
    inertia : (nm, 7) float64, inverse masses and inertias of the bodies, in the order of elimination
    rho : float64, 1 over the scale of W [kg]

    Outputs
    -------
    z : as x, written
    whole, largest : ‖e‖ over all contacts, and of the worst [N s]
    size : the larger of ‖z‖ and ‖P_K(z - ρ û)‖ [N s]
    """
    runs, blocks = touching.runs, touching.runs.block.shape[0] - 1
    v, room, other = np.zeros(6 * inertia.shape[0]), np.zeros(6 * BLOCK), np.empty(3 * BLOCK)
    for block in range(blocks):
        begin, end = 3 * BLOCK * block, 3 * BLOCK * (block + 1)
        field = touching.field[ROWS * BLOCK * block : ROWS * BLOCK * (block + 1)]
        _projected(x[begin:end], z[begin:end], field)
        for c in range(3 * BLOCK):
            room[c] = z[begin + c]
        _moments(room, field)
        # straight to the bodies, as all is done in order
        _gather(block, touching, room, v, runs.body)
    for k in range(inertia.shape[0]):
        i, at = inertia[k], 6 * k
        moment = v[at + 3], v[at + 4], v[at + 5]
        for a in range(3):
            v[at + a] *= i[0]
        v[at + 3] = dot((i[1], i[2], i[3]), moment)
        v[at + 4] = dot((i[2], i[4], i[5]), moment)
        v[at + 5] = dot((i[3], i[5], i[6]), moment)
    whole = largest = size = projected = 0.0
    for k in range(6 * BLOCK):
        room[k] = 0.0
    for block in range(blocks):
        begin, end = 3 * BLOCK * block, 3 * BLOCK * (block + 1)
        field = touching.field[ROWS * BLOCK * block : ROWS * BLOCK * (block + 1)]
        _velocities(block, v, touching, room)
        _opposed(z[begin:end], room, free[begin:end], field, rho)
        _projected(room, other, field)
        one = _apart(z[begin:end], other, field)
        whole, largest = whole + one[0], max(largest, one[1])
        size, projected = size + one[2], projected + one[3]
    return np.sqrt(whole), np.sqrt(largest), np.sqrt(max(size, projected))
