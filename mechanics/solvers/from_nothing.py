"""Rest by forces that arise from nothing, or by self-stress alone (docs/theory.md §3)."""

from dataclasses import replace
from functools import partial

import numpy as np

from mechanics.arrays import Array
from mechanics.delassus.compliant import CompliantDelassus
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.chain import Link, follow
from mechanics.solvers.first_order.body_admm import BodyADMM, Stage
from mechanics.solvers.kinds import SOME, moving_bodies
from mechanics.solvers.scales import FOLLOWING, JOINTS
from mechanics.solvers.second_order.newton import Newton

# velocity with the harder joints over that with the softer ones, a hundredth of the compliance apart, below which it
# vanishes with them; and velocity over the largest u_free above which stones fall [-]
_SMALL = 0.1
# ratio of the same two velocities above which compliance does not cause them [-]
_STAYS = 0.5
# tolerances of η and of velocities [-]
_LIMITS = Newton.tolerance, Newton.velocity_tolerance
_NEWTON = Link("Newton", Newton, Newton.max_iterations)
# forces follow those of the softer joints
_ADMM = Link("body ADMM", partial(BodyADMM, stages=(Stage(FOLLOWING),)), BodyADMM.max_iterations)


def rests_from_nothing(problem: ContactProblem) -> tuple[bool | None, Array]:
    """Return whether stones rest by forces that arise from nothing, and these (nc, 3); None: they may rest again.

    Joints with a small compliance E bring about one set of forces: those of the law at u = (W + E) r + u_free. Where
    stones rest, contacts slip and open by next to nothing, and u vanishes with E; where it does not, stones begin to
    move, and may come to rest again after next to nothing.
    """
    operator, pace = problem.delassus, float(np.abs(problem.u_free).max(initial=0.0))
    nothing = np.zeros_like(problem.u_free)
    start, slips, errors = ContactStart(nothing, nothing), [pace], [0.0]
    # each joint in the measure of its own stones: heavy ones hardly answer
    each = np.repeat(
        np.einsum("cii->c", operator.diagonal)[:, None] / nothing.shape[1], nothing.shape[1], axis=1
    )
    links = [_NEWTON, _ADMM]
    if operator.rigid is not None and moving_bodies(problem) >= SOME:
        links.remove(_NEWTON)
    for share in JOINTS:
        yields = share * each
        yielding = replace(problem, delassus=CompliantDelassus(operator, yields))
        # to a tenth of what slips come down to where they vanish with E
        exact = _SMALL * JOINTS[1] / JOINTS[0] * slips[-1] / (pace or 1.0)
        looser = max(1.0, exact / _LIMITS[1])
        solution = follow(links, yielding, start, (looser * _LIMITS[0], looser * _LIMITS[1]), np.inf)
        start = ContactStart(solution.impulse, solution.velocity)
        errors.append(pace * residual(yielding, solution.impulse).velocity)
        moved = operator.apply(solution.impulse) + yields * solution.impulse + problem.u_free
        slips.append(float(np.abs(moved).max(initial=0.0)))
    (*_, softer, harder), (*_, unsure, error) = slips, errors
    if harder + error <= max(_SMALL * (softer - unsure), _LIMITS[1] * pace):
        return True, start.impulse
    falls = harder - error > max(_SMALL * pace, _STAYS * (softer + unsure))
    return (False if falls else None), start.impulse
