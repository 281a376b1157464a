"""Kinds of contact problem, and the chain that solves each: data alone.

A new method is a file of its own and one line here.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from mechanics.problem.problem import ContactProblem
from mechanics.solvers.chain import Begin, Link, Solver
from mechanics.solvers.first_order.body_admm import RESTING, SORTED, BodyADMM, Stage
from mechanics.solvers.first_order.disk_admm import DiskADMM
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.first_order.stones_as_rigid import StonesAsRigid
from mechanics.solvers.scales import FOLLOWING, HELD, JOINTS, MANY, PLAIN_LOOK
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.second_order.softer_joints import SofterJoints

# budgets of links that others follow; what needs more is mostly solved by none of them
_ADMM = 500  # iterations of ADMM, and sweeps over disks
# the same from nothing: up to 2 % above a limit load the motion takes 500 to 1,000 iterations, and with fewer it is the
# budget that decides whether stones fall, or the next method finds a rest
_ADMM_FROM_NOTHING = 1500
_NEWTON = 20  # steps of Newton's method
_FAR = 100  # steps of Newton's method by way of soft joints, as the forces of a rest are far from nothing
_PATH = 60  # factorisations of a path, and steps of Newton's method where nothing else is left
# moving rigid bodies from which a factorisation in each step of Newton's method takes longer than iterations with kept
# factors, in the steps of a motion
_HANDFUL = 32
SOME = 300
"""The same at rest; of `MANY` a factorisation takes too long at all."""

EXACT = 1e-3
"""Tolerances over those asked for, of forces that a rest keeps for hundreds of steps: what they lack would be a creep.
"""

FURTHER = 0.03
"""Tolerances over those asked for, of forces that the next step begins with, or keeps [-]."""

# error up to which forces are near a solution: velocity tolerance below which a motion is solved by methods that need
# such a start, and η up to which forces of the last step lead them between deformable and rigid stones [-]
_NEAR = 1e-3

# forces of a rest, and of what slides or opens little by little until it rests
_HOLD, _DRIFT = (replace(stage, further=EXACT) for stage in (RESTING, SORTED[1]))
# joints of a motion hold as a rule, too
_FOLLOW = Stage(FOLLOWING, further=FURTHER)

_Method = Callable[[float, float, int], Solver]
_rest: _Method = partial(BodyADMM, stages=(SORTED[0], _HOLD, _DRIFT, _HOLD))
_motion: _Method = partial(BodyADMM, stages=(_FOLLOW, *SORTED))
_loosely: _Method = partial(BodyADMM, stages=(replace(_FOLLOW, further=1.0), *SORTED))
# a look costs two sweeps over disks, an extrapolation ten
_sweeps: _Method = partial(NSGS, check_every=PLAIN_LOOK, depth=0)

_newton = Link("Newton", Newton, _NEWTON, further=FURTHER)
_path = Link("interior point", InteriorPoint, _PATH, Begin.NOTHING, FURTHER)
_from_best = replace(_path, begin=Begin.BEST)
_endless = Link("body ADMM", BodyADMM)
_admm = replace(_endless, iterations=_ADMM)

_exact = replace(_newton, further=EXACT)

POLISH = Link("body ADMM", partial(BodyADMM, stages=(_HOLD,)), _HOLD.iterations)
"""Link that makes forces exact which a rest keeps."""

ENDED_PATH = (_path, _newton)
"""Chain of the interior point alone, which Newton's method ends: it stalls where contacts are between two states."""

_long = replace(_newton, iterations=_PATH)
_released = replace(_long, begin=Begin.RELEASED)
_REST = (
    replace(_exact, begin=Begin.WARM),
    replace(_admm, begin=Begin.WARM),
    _newton,
    _path,
    _released,
    _released,
)
# from nothing: between joints so soft that contacts hardly know of each other there is one state only, and the way from
# it leaves out self-stress, as a fall does that is under way when joints would jam. It ends at 10⁻⁶ of W, as forces of
# the limit hardly depend on where corners lie
_FROM_NOTHING = Link(
    "Newton from soft joints",
    partial(SofterJoints, factors=tuple(share / HELD for share in JOINTS)),
    _FAR,
    Begin.WARM,
    EXACT,
)
# Newton's method has failed twice where iterations begin: the path goes on
_REST_FROM_NOTHING = (
    _FROM_NOTHING,
    _REST[0],
    replace(_REST[1], iterations=_ADMM_FROM_NOTHING, further=FURTHER),
    *_REST[3:],
)
_REST_OF_SOME = (replace(_admm, method=_rest, begin=Begin.WARM), _newton, _path, _newton)
_REST_OF_MANY = (replace(_endless, method=_rest, begin=Begin.WARM),)
_MOTION = (
    replace(_admm, method=_motion, begin=Begin.AHEAD),
    *(_long, _admm, _long, _admm),
    _path,
)
# of few stones Newton's method goes first: ADMM presses stones against what they only touch, and
# friction would hold what falls
_MOTION_OF_FEW = (replace(_newton, begin=Begin.AHEAD), *_MOTION)
# errors that are allowed would be extrapolated with the rest
_LOOSE_MOTION = (replace(_endless, method=_loosely, begin=Begin.WARM),)
_MOTION_OF_MANY = (replace(_endless, begin=Begin.AHEAD),)
_SOFTER = Link("Newton from softer joints", SofterJoints, _PATH, Begin.WARM, EXACT)
_SPRINGS = (replace(_exact, begin=Begin.WARM), _SOFTER, _path)
_SPRINGS_OF_SOME = (replace(_admm, begin=Begin.WARM), _exact, _SOFTER, _path)
_DEFORMABLE = (
    replace(_newton, begin=Begin.WARM, further=1.0),
    *(_path, _newton),
    *(_from_best, _newton),
    replace(_SOFTER, further=1.0),
    Link("sweeps", NSGS, _ADMM),
)
# between rigid stones Newton's method wanders, so the path is followed until the laws hold, again from where it stalled
_AMONG_RIGID = (replace(_from_best, near=_NEAR), _path, _from_best, _from_best)
_STONES_AS_RIGID = Link("stones as rigid ones", StonesAsRigid, _ADMM, Begin.BEST, 100.0)
_SPRINGS_AMONG_RIGID = (replace(_exact, near=_NEAR), _STONES_AS_RIGID, _exact, _STONES_AS_RIGID, _exact)
_DISKS = (
    Link("sweeps", _sweeps, _ADMM, Begin.WARM),
    Link("ADMM of disks", DiskADMM, _ADMM, Begin.WARM),
    Link("ADMM of disks", DiskADMM),
)
_FEW_DISKS = (*_DISKS[:2], replace(_long, begin=Begin.WARM), _DISKS[2])
_SWEEPS = (Link("sweeps", NSGS, begin=Begin.WARM),)


def chain_of(
    problem: ContactProblem, follows: bool, moving: bool, velocity_tolerance: float, warm: bool = True
) -> Sequence[Link]:
    """Return the chain for a problem.

    Parameters
    ----------
    follows, moving : the steps follow a motion; this one is part of it
    velocity_tolerance : asked of this step [-]
    warm : forces are known to begin with
    """
    operator, bodies = problem.delassus, moving_bodies(problem)
    yields = operator.joint_compliance is not None
    if operator.plane is not None:
        return _FEW_DISKS if len(problem.friction) <= MANY else _DISKS
    if operator.rigid is None:
        if operator.form is None:
            return _SWEEPS
        if not operator.mostly_rigid:
            return _DEFORMABLE
        if yields:
            return (*_SPRINGS_AMONG_RIGID, *_DEFORMABLE)
        # the path of hundreds of stones between rigid joints takes too long to fail
        return (*_AMONG_RIGID, *_DEFORMABLE) if bodies < SOME else ()
    if yields:
        return _SPRINGS if bodies < SOME else _SPRINGS_OF_SOME
    if follows and bodies >= MANY:
        return _MOTION_OF_MANY if moving else _REST_OF_MANY
    if moving and velocity_tolerance < _NEAR:
        return _MOTION if bodies >= _HANDFUL else _MOTION_OF_FEW
    if moving:
        return _LOOSE_MOTION
    if bodies < SOME:
        return _REST if warm else _REST_FROM_NOTHING
    return _REST_OF_SOME


def standing_chain(problem: ContactProblem) -> Sequence[Link]:
    """Return the chain from nothing of rigid stones of which only whether they rest is asked.

    It is that of a run. Of many the iterations alone, which bring stones to rest as forces spread.
    """
    bodies = moving_bodies(problem)
    if bodies < SOME:
        return _REST_FROM_NOTHING
    return _REST_OF_SOME if bodies < MANY else _REST_OF_MANY


def moving_bodies(problem: ContactProblem) -> int:
    """Return the number of bodies that move, those that deform among rigid ones included."""
    operator = problem.delassus
    contacts = (operator if operator.as_rigid is None else operator.as_rigid).rigid
    return 0 if contacts is None else int(np.count_nonzero(contacts.inertia[:, 0]))
