"""Solver registry."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ground.errors import SolverError
from mechanics.scene.scene import Method, SolverSettings
from mechanics.solvers.auto import Auto
from mechanics.solvers.chain import Chain, Solver
from mechanics.solvers.first_order.body_admm import STEADY, BodyADMM
from mechanics.solvers.first_order.disk_admm import DiskADMM
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.kinds import ENDED_PATH
from mechanics.solvers.scales import PLAIN_LOOK
from mechanics.solvers.second_order.newton import Newton

# largest error of a motion over the sum of the largest velocity errors of its steps: contacts may all err one way [-]
_ADDS_UP = 8.0

# methods by tolerance, velocity tolerance and iterations
_METHODS: Mapping[Method, Callable[[float, float, int], Solver]] = {
    Method.AUTO: Auto,
    Method.NSGS: NSGS,
    Method.ADMM: partial(BodyADMM, stages=STEADY),
    Method.INTERIOR_POINT: partial(Chain, links=ENDED_PATH),
    Method.NEWTON: Newton,
}


def choose_solver(
    settings: SolverSettings,
    deformable: bool = False,
    sprung: bool = False,
    duration: float = np.inf,
    rest_tolerance: float = np.inf,
) -> Solver:
    """Return the solver that the settings ask for.

    Parameters
    ----------
    settings : of the scene
    deformable, sprung : there are stones that deform, and joints that yield
    duration : of the run, over which errors of motion add up [s]
    rest_tolerance : velocity tolerance of steps in which stones may be at rest [-]

    Raises
    ------
    SolverError : if the method is not for stones that deform, or joints that yield
    """
    if settings.method is Method.NSGS and sprung:
        raise _refused(settings.method, "rigid joints", "where a law has stiffness")
    if settings.method is Method.ADMM and deformable:
        raise _refused(settings.method, "rigid stones", "where stones deform")
    solver = _METHODS[settings.method](
        settings.tolerance, settings.velocity_tolerance, settings.max_iterations
    )
    if not isinstance(solver, Auto):
        return solver
    error = settings.motion_error
    speed = None if error is None else error / (_ADDS_UP * duration)
    return replace(solver, motion_speed=speed, rest_tolerance=rest_tolerance)


def choose_planar_solver(settings: SolverSettings, min_sweeps: int = 0) -> Solver:
    """Return the solver for disks of the plane; *nsgs* makes plain sweeps, at least `min_sweeps` in each step.

    A sweep over disks costs a tenth of an extrapolation: where they flow, many plain sweeps are cheaper.

    Raises
    ------
    SolverError : if the method is one for three dimensions alone
    """
    limits = settings.tolerance, settings.velocity_tolerance, settings.max_iterations
    if settings.method is Method.INTERIOR_POINT:
        raise SolverError(
            "the method interior-point is for three dimensions", where="planar scene", remedy='use "newton"'
        )
    if settings.method is Method.ADMM:
        return DiskADMM(*limits)
    if settings.method is Method.NSGS:
        # a look costs two sweeps: none is needed before the sweeps that are made anyway
        return NSGS(*limits, check_every=max(PLAIN_LOOK, min_sweeps), depth=0, min_iterations=min_sweeps)
    return choose_solver(settings)


def _refused(method: Method, only: str, where: str) -> SolverError:
    return SolverError(
        f"the method {method.value} is for {only}", where="solver", remedy=f'use "auto" {where}'
    )
