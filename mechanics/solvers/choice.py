"""Which solver a scene gets."""

from mechanics.scene import Method, SolverSettings
from mechanics.solvers.admm import ADMM
from mechanics.solvers.nsgs import NSGS
from moma.errors import SceneError

__all__ = ["choose_solver"]


def choose_solver(settings: SolverSettings, deformable: bool) -> NSGS | ADMM:
    """The solver that the settings ask for; *auto* is ADMM as soon as a body is deformable.

    Deformable bodies make Gauss–Seidel slow: their contacts are many, and each is far stiffer than the stone is
    heavy. Rigid bodies leave ADMM without the elastic compliance that sets its penalty.

    Raises
    ------
    SceneError : if ADMM is asked for and nothing is deformable
    """
    if settings.method == Method.ADMM and not deformable:
        raise SceneError(
            "admm needs a deformable block", where="solver.method", remedy='use "nsgs" or "auto"'
        )
    if settings.method == Method.ADMM or (settings.method == Method.AUTO and deformable):
        return ADMM(settings.tolerance, settings.max_iterations)
    return NSGS(settings.tolerance, settings.max_iterations)
