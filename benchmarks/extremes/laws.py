"""An independent judge of contact problems: every law, contact by contact, in plain numpy.

Nothing of a solver, of its kernels or of the natural map is used. A contact that is open, sticks or slips obeys each
time other equations; what it breaks is the least that one of these states leaves unsatisfied, with velocities times
ρ = 1 / (mean diagonal of W), so that they count as impulses.
"""

import numpy as np

from benchmarks.stored import StoredDelassus
from mechanics.arrays import Array
from mechanics.delassus.rigid import RigidDelassus
from mechanics.problem.problem import ContactProblem

# the natural map knows a contact's distance from its law to this factor, times 1 + μ
_SLACK = 10.0
# of the terms of which u is the sum: rounding
_ROUNDING = 1e-13
# of the impulse that would stop the fastest contact: less than this is none
_NOTHING = 1e-8


def judge(problem: ContactProblem, impulse: Array, tolerance: float, velocity_tolerance: float) -> float:
    """By how much the worst contact breaks its law, over what the tolerances asked for allow; right up to 1.

    They allow ‖e‖ ≤ tolerance · ‖r‖, and the largest velocity that breaks a law is at most velocity_tolerance times the
    largest of u_free; where that is zero, of the bias.
    """
    if len(impulse) == 0:
        return 0.0
    if not np.isfinite(impulse).all():
        return np.inf
    rho = 1.0 / problem.delassus.scale
    pace = float(np.abs(problem.u_free).max() or np.abs(problem.bias).max())
    u, terms = velocity_of(problem, impulse)
    real = impulse.copy()
    if problem.adhesion is not None:
        real[:, 0] -= problem.adhesion
    size = max(float(np.linalg.norm(real)), _NOTHING * rho * pace)
    allowed = min(tolerance * size, velocity_tolerance * rho * pace if pace > 0 else np.inf)
    each = _SLACK * (1.0 + problem.friction) * allowed + _ROUNDING * rho * terms
    left = broken(problem, impulse, u, rho)
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.where(left > 0, left / each, 0.0).max())


def velocity_of(problem: ContactProblem, impulse: Array) -> tuple[Array, Array]:
    """u = W r + u_free (nc, 3), and the size of the terms of which it is the sum (nc,) [m/s]."""
    delassus = problem.delassus
    if isinstance(delassus, RigidDelassus):
        pushed, terms = _rigid(delassus, impulse)
    elif isinstance(delassus, StoredDelassus):
        row = np.repeat(np.arange(len(impulse)), np.diff(delassus.indptr))
        parts = np.einsum("kij,kj->ki", delassus.block, impulse[delassus.indices])
        pushed, terms = np.zeros_like(impulse), np.zeros(len(impulse))
        np.add.at(pushed, row, parts)
        np.add.at(terms, row, np.abs(parts).max(axis=1))
    else:
        pushed = delassus.apply(impulse)
        terms = np.abs(pushed).max(axis=1)
    return pushed + problem.u_free, terms + np.abs(problem.u_free).max(axis=1)


def _rigid(delassus: RigidDelassus, impulse: Array) -> tuple[Array, Array]:
    """W r through the velocities that the impulses give to the bodies, and the sum of the sizes of its terms."""
    frame = delassus.geometry[:, :9].reshape(-1, 3, 3)
    arm = delassus.geometry[:, 9:].reshape(-1, 2, 3)
    inverse = delassus.inertia[:, [1, 2, 3, 2, 4, 5, 3, 5, 6]].reshape(-1, 3, 3)
    world = np.einsum("cij,ci->cj", frame, impulse)
    moved, turned, pressed = (np.zeros((len(inverse), 3)) for _ in range(3))
    for side, sign in ((0, 1.0), (1, -1.0)):
        np.add.at(moved, delassus.body[:, side], sign * world)
        np.add.at(turned, delassus.body[:, side], sign * np.cross(arm[:, side], world))
        np.add.at(pressed, delassus.body[:, side], np.abs(world))
    linear, angular = delassus.inertia[:, :1] * moved, np.einsum("bij,bj->bi", inverse, turned)
    u, terms = np.zeros_like(impulse), np.zeros(len(impulse))
    for side, sign in ((0, 1.0), (1, -1.0)):
        body = delassus.body[:, side]
        point = linear[body] + np.cross(angular[body], arm[:, side])
        u += sign * np.einsum("cij,cj->ci", frame, point)
        # what all impulses on this body could do to the point together
        give = (
            delassus.inertia[:, 0] + np.abs(inverse).max(axis=(1, 2)) * (arm[:, side] ** 2).sum(axis=1).max()
        )
        terms += (give[:, None] * pressed)[body].max(axis=1)
    return u, terms


def broken(problem: ContactProblem, impulse: Array, u: Array, rho: float) -> Array:
    """By how much each contact breaks its law (nc,) [N s]: the least over open and closed, and over stick and slip."""
    push, drag = impulse[:, 0], impulse[:, 1:]
    opening, sliding = rho * (u[:, 0] + problem.bias), rho * u[:, 1:]
    friction, speed = np.linalg.norm(drag, axis=1), np.linalg.norm(sliding, axis=1)
    limit = problem.friction * np.maximum(push, 0.0) + problem.cohesion
    open_ = np.maximum(np.abs(push), -opening)
    closed = np.maximum(np.abs(opening), -push)
    beyond = np.maximum(friction - limit, 0.0)
    stick = np.maximum(speed, beyond)
    # sliding: the friction is at its limit and opposed to the velocity; seen from the one, and from the other
    against = np.linalg.norm(drag + limit[:, None] * _direction(sliding), axis=1)
    back = _direction(drag)
    along = np.minimum((sliding * back).sum(axis=1), 0.0)
    askew = np.linalg.norm(sliding - along[:, None] * back, axis=1)
    slip = np.minimum(against, np.maximum(askew, np.abs(friction - limit)))
    least: Array = np.maximum(np.minimum(open_, closed), np.minimum(stick, slip))
    return least


def _direction(vectors: Array) -> Array:
    """Unit vectors (n, 2) along these, zero where they are."""
    size = np.linalg.norm(vectors, axis=1)[:, None]
    directions: Array = np.where(size > 0, vectors / np.where(size > 0, size, 1.0), 0.0)
    return directions
