"""Solver registry."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.scene.scene import Method, SolverSettings, TimeSettings
from mechanics.solvers.first_order.admm import ADMM
from mechanics.solvers.first_order.apgd import APGD
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.cone_program import ConeProgram
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.strategies.auto import Auto
from mechanics.solvers.strategies.compliant import Compliant
from mechanics.solvers.strategies.planar import Planar
from mechanics.solvers.strategies.rigid import moving_admm
from mechanics.solvers.strategies.rigid_first import RigidFirst
from moma.errors import SolverError

__all__ = ["Solver", "Solvers", "choose_planar_solver", "choose_solver", "choose_solvers"]


# plain sweeps over disks between two looks at η
_LOOK = 20
# largest error of a motion over the largest errors of velocity in its steps, added up [-]
_ADDS_UP = 8.0


class Solver(Protocol):
    """Solver of contact problems."""

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`."""


@dataclass(frozen=True)
class Solvers:
    """Solvers of the steps of a run.

    Attributes
    ----------
    usual : of rigid joints
    early : of rigid joints, where compliant ones are a way out: it fails sooner
    brief : the same where rigid joints have failed before, and forces are known: it takes no longer than a step with
        compliant joints
    compliant : of compliant joints: factors on their compliance, and the solvers with which these are tried one after
        the other; empty where joints stay rigid
    """

    usual: Solver
    early: Solver | None = None
    brief: Solver | None = None
    compliant: tuple[tuple[float, Solver], ...] = ()


# iterations in which rigid joints must be solved after they have failed: those that cost no more than a step with
# compliant ones
_BRIEF = 80
# rigid stones that move, from which the central path between rigid joints takes too long to fail, where more than so
# many stones deform
_SOME, _FEW = 300, 20
# factors on the compliance of joints, where a step cannot be solved with it either
_SOFTNESS = (1.0, 3.0, 10.0)


# methods for rigid and deformable bodies alike, by tolerance, velocity tolerance and iterations
_EVERYWHERE: Mapping[Method, Callable[[float, float, int], Solver]] = {
    Method.NSGS: NSGS,
    Method.APGD: APGD,
    Method.INTERIOR_POINT: InteriorPoint,
    Method.NEWTON: Newton,
    Method.CONE: ConeProgram,
}


def choose_solver(settings: SolverSettings, deformable: bool, duration: float = np.inf) -> Solver:
    """Return the solver that the settings ask for, in a run of a duration [s], over which errors of motion add up."""
    limits = settings.tolerance, settings.velocity_tolerance, settings.max_iterations
    if settings.method in _EVERYWHERE:
        return _EVERYWHERE[settings.method](*limits)
    if settings.method == Method.ADMM:
        return ADMM(*limits) if deformable else moving_admm(*limits)
    if settings.motion_error is None:
        return Auto(*limits)
    return Auto(*limits, motion_speed=settings.motion_error / (_ADDS_UP * duration))


def choose_solvers(
    settings: SolverSettings, elastic: int, rigid: int, time: TimeSettings, sprung: bool = False
) -> Solvers:
    """Return the solvers of a run of so many deformable stones, and rigid ones that move.

    Compliant joints are a way out for the automatic choice where more stones are rigid than deform. They are one on the
    way to a rest alone: where a motion is followed they would decide it. Where the laws have springs of their own
    (`sprung`), joints are compliant in every step.

    Raises
    ------
    SolverError : if the method does not solve compliant joints
    """
    if sprung:
        return Solvers(_sprung_solver(settings, elastic > 0, time.duration))
    usual = choose_solver(settings, elastic > 0, time.duration)
    may_yield = isinstance(usual, Auto) and settings.joint_compliance > 0 and time.relaxation
    if not may_yield or 0 < elastic >= rigid:
        return Solvers(usual)
    assert isinstance(usual, Auto)
    if elastic:
        first = RigidFirst(usual.tolerance, usual.velocity_tolerance, usual.max_iterations)
        early = usual if rigid < _SOME or elastic <= _FEW else _given_up
        return Solvers(usual, early, first, tuple((factor, first) for factor in _SOFTNESS))
    quick = Compliant(usual.tolerance, usual.velocity_tolerance, usual.max_iterations)
    return Solvers(
        usual,
        replace(usual, thorough=False),
        replace(usual, max_iterations=min(_BRIEF, usual.max_iterations), thorough=False),
        (*((factor, quick) for factor in _SOFTNESS), (_SOFTNESS[-1], replace(quick, thorough=True))),
    )


def _given_up(problem: ContactProblem, start: ContactStart) -> ContactSolution:
    """Return the start as it is: rigid joints that no method solves."""
    left = residual(problem, start.impulse)
    return ContactSolution(start.impulse, left.dual, 0, left.natural_map, len(start.impulse) == 0)


def _sprung_solver(settings: SolverSettings, deformable: bool, duration: float) -> Solver:
    if settings.method in (Method.NSGS, Method.APGD, Method.CONE):
        raise SolverError(
            f"the method {settings.method.value} is for rigid joints",
            where="solver",
            remedy='use "auto" where a law has stiffness',
        )
    if settings.method is Method.AUTO:
        limits = settings.tolerance, settings.velocity_tolerance, settings.max_iterations
        return Compliant(*limits, thorough=True)
    return choose_solver(settings, deformable, duration)


def choose_planar_solver(settings: SolverSettings, min_sweeps: int = 0) -> Solver:
    """Return the solver for disks of the plane; *nsgs* makes plain sweeps, at least `min_sweeps` in each step.

    A sweep over disks costs a tenth of an extrapolation: where they flow, many plain sweeps are cheaper.

    Raises
    ------
    SolverError : if the method is one for three dimensions alone
    """
    if settings.method == Method.INTERIOR_POINT:
        raise SolverError(
            "the method interior-point is for three dimensions",
            where="planar scene",
            remedy='use "newton" or "cone"',
        )
    limits = settings.tolerance, settings.velocity_tolerance, settings.max_iterations
    if settings.method == Method.AUTO:
        return Planar(*limits)
    if settings.method == Method.NSGS:
        # a look costs two sweeps: none is needed before the sweeps that are made anyway
        return NSGS(*limits, check_every=max(_LOOK, min_sweeps), depth=0, min_iterations=min_sweeps)
    return choose_solver(settings, deformable=False)
