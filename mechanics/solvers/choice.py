"""Which solver a scene gets."""

from typing import Protocol

from mechanics.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.scene import Method, SolverSettings
from mechanics.solvers.admm import ADMM
from mechanics.solvers.alternating import Alternating, moving_admm
from mechanics.solvers.elastic import Elastic
from mechanics.solvers.nsgs import NSGS

__all__ = ["Solver", "choose_solver"]


class Solver(Protocol):
    """Solves contact problems."""

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`."""


def choose_solver(settings: SolverSettings, deformable: bool) -> Solver:
    """The solver that the settings ask for; *auto* never sweeps where a body is deformable.

    Deformable bodies make Gauss–Seidel slow: their contacts are many, and each is far stiffer than the stone is
    heavy.
    """
    limits = settings.tolerance, settings.velocity_tolerance, settings.max_iterations
    if settings.method == Method.ADMM and not deformable:
        return moving_admm(*limits)
    if settings.method == Method.ADMM:
        return ADMM(*limits)
    if settings.method == Method.AUTO and deformable:
        return Elastic(*limits)
    return NSGS(*limits) if settings.method == Method.NSGS else Alternating(*limits)
