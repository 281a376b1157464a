"""Solver registry."""

from collections.abc import Callable, Mapping
from typing import Protocol

import numpy as np

from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.scene.scene import Method, SolverSettings
from mechanics.solvers.first_order.admm import ADMM
from mechanics.solvers.first_order.apgd import APGD
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.cone_program import ConeProgram
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.strategies.auto import Auto
from mechanics.solvers.strategies.rigid import moving_admm
from moma.errors import SolverError

__all__ = ["Solver", "choose_planar_solver", "choose_solver"]


# largest error of a motion over the largest errors of velocity in its steps, added up [-]
_ADDS_UP = 1.0


class Solver(Protocol):
    """Solver of contact problems."""

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`."""


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


def choose_planar_solver(settings: SolverSettings) -> Solver:
    """Return the solver for disks of the plane; *auto* sweeps.

    A sweep over disks costs a tenth of an iteration of ADMM, and of an extrapolation: where they flow, many plain
    sweeps are cheaper.

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
    if settings.method in (Method.AUTO, Method.NSGS):
        return NSGS(*limits, check_every=20, depth=0)
    return choose_solver(settings, deformable=False)
