"""Which solver a scene gets."""

from mechanics.scene import Method, SolverSettings
from mechanics.solvers.admm import ADMM
from mechanics.solvers.alternating import Alternating, moving_admm
from mechanics.solvers.nsgs import NSGS

__all__ = ["choose_solver"]


def choose_solver(settings: SolverSettings, deformable: bool) -> NSGS | ADMM | Alternating:
    """The solver that the settings ask for; *auto*: ADMM as soon as a body is deformable, else both in turn.

    Deformable bodies make Gauss–Seidel slow: their contacts are many, and each is far stiffer than the stone is
    heavy.
    """
    limits = settings.tolerance, settings.velocity_tolerance, settings.max_iterations
    if settings.method == Method.ADMM and not deformable:
        return moving_admm(*limits)
    if settings.method == Method.ADMM or (settings.method == Method.AUTO and deformable):
        return ADMM(*limits)
    return NSGS(*limits) if settings.method == Method.NSGS else Alternating(*limits)
