"""Kinds of contact problem, and the chain that solves each: data alone.

A new method is a file of its own and one line here.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mechanics.problem.problem import ContactProblem
from mechanics.solvers.chain import Begin, Link, Solver
from mechanics.solvers.first_order.body_admm import STAGES, BodyADMM, Stage
from mechanics.solvers.first_order.disk_admm import DiskADMM
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.first_order.stones_as_rigid import StonesAsRigid
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.second_order.softer_joints import SofterJoints

__all__ = ["POLISH", "chain_of"]

# moving rigid bodies from which a factorisation in each step of Newton's method takes longer than iterations with kept
# factors: at first, and at all
_SOME, _MANY = 300, 1000
# velocity tolerance of a motion from which it is solved loosely [-]
_LOOSE = 1e-3
# contacts of disks up to which Newton's method takes less than the iterations that it spares
_FEW = 1000
# tolerances over those asked for [-]: of forces that a rest keeps for hundreds of steps, as what they lack would be a
# creep; of others that the next step begins with; and of those that it extrapolates
_EXACT, _FURTHER, _AHEAD = 1e-3, 0.03, 0.1
# η up to which forces of the last step lead a path, and Newton's method between deformable stones [-]
_NEAR, _NEARER = 1e-2, 1e-3

# penalties in turn: with the large one contacts sort themselves into open, sliding and sticking; with the small one of
# those that stick, their forces, which grow steadily until one slips, arrive 200 times as soon
_SORT = Stage(1.0, 40, extrapolated=False)
_GROW = Stage((1.0, 0.05, 0.005), 60, extrapolated=False)
_TURNS = (
    replace(_SORT, iterations=10),
    replace(_GROW, penalty=(1.0, 0.05, 0.01)),
    replace(_SORT, iterations=80),
    *(50 * (_GROW, _SORT)),
)


# joints of a rest hold as a rule: with a small penalty their forces arrive at once, without self-stress
_HOLD = Stage(1e-3, 50, extrapolated=True, longer=100)
# most walls in motion need one penalty, in some 40 iterations, where their motion need not be exact; what wedges needs
# the turns
_SHAKEN = Stage(0.1, 80, extrapolated=True)


def _turns(tolerance: float, velocity_tolerance: float, most: int) -> Solver:
    return BodyADMM(tolerance, velocity_tolerance, most, _TURNS)


def _resting(tolerance: float, velocity_tolerance: float, most: int) -> Solver:
    return BodyADMM(tolerance, velocity_tolerance, most, (_HOLD, *_TURNS), further=_EXACT)


def _loosely(tolerance: float, velocity_tolerance: float, most: int) -> Solver:
    return BodyADMM(tolerance, velocity_tolerance, most, (_SHAKEN, *_TURNS))


def _predicted(tolerance: float, velocity_tolerance: float, most: int) -> Solver:
    return BodyADMM(tolerance, velocity_tolerance, most, STAGES, further=_AHEAD)


def _as_rigid(tolerance: float, velocity_tolerance: float, most: int) -> Solver:
    return StonesAsRigid(tolerance, velocity_tolerance, most, _TURNS)


def _sweeps(tolerance: float, velocity_tolerance: float, most: int) -> Solver:
    # a look costs two sweeps over disks, an extrapolation ten
    return NSGS(tolerance, velocity_tolerance, most, check_every=20, depth=0)


def _flow(tolerance: float, velocity_tolerance: float, most: int) -> Solver:
    return DiskADMM(tolerance, velocity_tolerance, most, penalty=0.05)


_PATH = Link("interior point", InteriorPoint, 60, Begin.NOTHING)
_NEWTON = Link("Newton", Newton, 20, Begin.BEST, _FURTHER)
POLISH = Link("Newton", Newton, 5, Begin.BEST, _EXACT)
"""Link that makes forces exact which a rest keeps."""

# Newton's method goes first from nothing: it begins with forces that yielding joints would have, without self-stress
_REST = (
    Link("Newton", Newton, 20, Begin.GIVEN, _EXACT),
    Link("body ADMM", _turns, 400, Begin.GIVEN, _FURTHER),
    _NEWTON,
    _PATH,
    _NEWTON,
)
_REST_OF_SOME = (Link("body ADMM", _resting, 550, Begin.GIVEN), *_REST[2:])
_MOTION = (
    Link("body ADMM", _predicted, 550, Begin.AHEAD),
    *(3 * (Link("Newton", Newton, 100, Begin.BEST, _FURTHER), Link("body ADMM", _turns, 200))),
    _PATH,
    _NEWTON,
)
# errors that are allowed would be extrapolated with the rest
_LOOSE_MOTION = (Link("body ADMM", _loosely, 10**6, Begin.GIVEN),)
_CROWD_AT_REST = (Link("body ADMM", _resting, 10**6, Begin.GIVEN),)
_CROWD = (Link("body ADMM", _turns, 10**6, Begin.AHEAD),)
_SPRINGS = (
    Link("Newton", Newton, 30, Begin.GIVEN, _EXACT),
    Link("Newton from softer joints", SofterJoints, 150, Begin.GIVEN, _EXACT),
    _PATH,
)
_SPRINGS_OF_SOME = (
    Link("body ADMM", _turns, 1000, Begin.GIVEN),
    Link("Newton", Newton, 30, Begin.BEST, _EXACT),
    *_SPRINGS[1:],
)
_DEFORMABLE = (
    Link("Newton", Newton, 20, Begin.GIVEN, near=_NEARER),
    replace(_PATH, iterations=100),
    _NEWTON,
    replace(_PATH, iterations=100, begin=Begin.BEST),
    _NEWTON,
)
# between rigid stones Newton's method wanders, so the path is followed until the laws hold, again from where it stalled
_MIXED = (
    replace(_PATH, begin=Begin.GIVEN, near=_NEAR),
    _PATH,
    *(2 * (replace(_PATH, begin=Begin.BEST),)),
)
_AS_RIGID = Link("stones as rigid ones", _as_rigid, 500, Begin.BEST, 100.0)
_MIXED_SPRINGS = (
    Link("Newton", Newton, 30, Begin.GIVEN, _EXACT, near=_NEARER),
    *(
        2
        * (
            Link("stones as rigid ones", _as_rigid, 500, Begin.BEST, 100.0),
            Link("Newton", Newton, 30, Begin.BEST, _EXACT),
        )
    ),
)
_DISKS = (
    Link("sweeps", _sweeps, 500, Begin.GIVEN),
    Link("ADMM of disks", _flow, 500, Begin.GIVEN),
    Link("ADMM of disks, larger penalty", DiskADMM, 10**6),
)
_FEW_DISKS = (*_DISKS[:2], Link("Newton", Newton, 60, Begin.GIVEN), _DISKS[2])
_UNKNOWN = (Link("sweeps", NSGS, 10**6, Begin.GIVEN),)


def chain_of(
    problem: ContactProblem, follows: bool, moving: bool, velocity_tolerance: float
) -> Sequence[Link]:
    """Return the chain for a problem; the steps may follow a motion, and this one may be part of it."""
    operator = problem.delassus
    yields, bodies = operator.joint_compliance is not None, _moving_bodies(problem)
    if operator.plane is not None:
        return _FEW_DISKS if len(problem.friction) <= _FEW else _DISKS
    if operator.rigid is None:
        if operator.form is None:
            return _UNKNOWN
        if not operator.mostly_rigid:
            return _DEFORMABLE
        if yields:
            return (*_MIXED_SPRINGS, *_DEFORMABLE)
        # the path of hundreds of stones between rigid joints takes too long to fail
        return (*_MIXED, *_DEFORMABLE) if bodies < _SOME else ()
    if yields:
        return _SPRINGS if bodies < _SOME else _SPRINGS_OF_SOME
    if follows and bodies >= _MANY:
        return _CROWD if moving else _CROWD_AT_REST
    if moving:
        return _MOTION if velocity_tolerance < _LOOSE else _LOOSE_MOTION
    return _REST if bodies < _SOME else _REST_OF_SOME


def _moving_bodies(problem: ContactProblem) -> int:
    """Return the number of bodies that move, those that deform among rigid ones included."""
    operator = problem.delassus
    simple = operator if operator.as_rigid is None else operator.as_rigid
    contacts = simple.rigid
    return 0 if contacts is None else int(np.count_nonzero(contacts.inertia[:, 0]))
