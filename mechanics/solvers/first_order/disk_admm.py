"""ADMM between rigid bodies of the plane: compiled, with its own factors in blocks of 3 × 3.

The iteration of `BodyADMM`, with a penalty of each contact's own compliance: one pass over the contacts and
one solution with the factors of M + H Σ⁻¹ Hᵀ (mechanics/solvers/_kernels/disk_admm.py).
"""

from dataclasses import dataclass

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array, Ints
from mechanics.delassus.elimination import elimination
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart, PlaneContacts
from mechanics.problem.residual import Residual, project_on_cone, residual
from mechanics.solvers._kernels import body_cholesky as cholesky
from mechanics.solvers._kernels import disk_admm as kernel
from mechanics.solvers.first_order.body_factors import factorise
from mechanics.solvers.scales import FOLLOWING, OVERSHOOT, PLAIN_LOOK, SPARE

# velocities of a body
_VELOCITIES = 3


@dataclass(frozen=True)
class DiskADMM:
    """Alternating directions between bodies of the plane until η and the velocity error are within their tolerances.

    Attributes
    ----------
    tolerance, velocity_tolerance, max_iterations : as in `NSGS`, iterations for sweeps
    penalty : σ of a contact over the mean diagonal of its W_αα; larger values bear with contacts that open and slide,
        smaller ones find the forces of disks that stay in touch sooner [-]
    check_every : iterations between two looks at η
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    penalty: float = FOLLOWING
    check_every: int = PLAIN_LOOK

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`, whose velocity û lets the iteration continue where it stopped; return the best look.

        Raises
        ------
        SolverError : if W is not that of rigid bodies of the plane
        """
        contacts = problem.delassus.plane
        if contacts is None:
            raise SolverError(
                "bodies are not those of the plane", where="ADMM of disks", remedy='use the method "auto"'
            )
        limits = self.tolerance, self.velocity_tolerance
        impulse = project_on_cone(start.impulse, problem.friction, problem.cohesion)
        remaining = residual(problem, impulse)
        best, iterations = (remaining, impulse, start.velocity), 0
        if remaining.within(*limits) or self.max_iterations == 0:
            return _solution(best, iterations, limits)
        run = _Run(problem, contacts, self.penalty, impulse, start.velocity)
        while not remaining.within(*limits) and iterations < self.max_iterations:
            count = min(self.check_every, self.max_iterations - iterations)
            run.advance(count)
            iterations += count
            remaining = residual(problem, run.impulse)
            if remaining.natural_map <= best[0].natural_map or remaining.within(*limits):
                best = remaining, run.impulse.copy(), run.velocity
        return _solution(best, iterations, limits)


def _solution(
    best: tuple[Residual, Array, Array], iterations: int, limits: tuple[float, float]
) -> ContactSolution:
    remaining, impulse, velocity = best
    return ContactSolution(impulse, velocity, iterations, remaining.natural_map, remaining.within(*limits))


class _Run:
    """Iterates of one solution."""

    def __init__(
        self,
        problem: ContactProblem,
        contacts: PlaneContacts,
        penalty: float,
        impulse: Array,
        velocity: Array,
    ) -> None:
        order, side, panels = _eliminated(contacts)
        self._sigma = penalty * np.einsum("cii->c", problem.delassus.diagonal) / 2.0
        self._touching = kernel.DiskTouching(
            side,
            contacts.normal,
            contacts.lever,
            problem.biased,
            problem.friction,
            problem.cohesion,
            1.0 / self._sigma,
        )
        x = impulse - velocity / self._sigma[:, None]
        count = _VELOCITIES * len(order)
        self._iterate = kernel.DiskIterate(x, np.empty_like(x), np.empty_like(x), np.zeros(count))
        mass = np.ascontiguousarray(1.0 / contacts.inertia[order])
        value: Array = kernel.assemble_disks(self._touching, mass, panels)
        if not factorise(panels, value):
            raise SolverError("W is not a number", where="ADMM of disks", remedy="use another method")
        self._factors = kernel.DiskFactors(panels, value)

    @property
    def impulse(self) -> Array:
        """Impulses in their cones (nc, 2) [N s]."""
        return self._iterate.z

    @property
    def velocity(self) -> Array:
        """û = -σ y (nc, 2) [m/s]."""
        velocity: Array = self._sigma[:, None] * (self._iterate.z - self._iterate.x)
        return velocity

    def advance(self, count: int) -> None:
        """Make iterations."""
        kernel.advance_disks(self._iterate, count, OVERSHOOT, self._touching, self._factors)


def _eliminated(contacts: PlaneContacts) -> tuple[Ints, Ints, cholesky.Panels]:
    """Return the moving bodies in the order of their elimination, the contacts' places in it, and the panels."""
    moving = np.flatnonzero(contacts.inertia[:, 0] > 0)
    place = np.full(len(contacts.inertia), -1)
    place[moving] = np.arange(len(moving))
    side = place[contacts.body]
    inner = side[(side >= 0).all(axis=1)]
    pairs = np.unique(np.sort(inner, axis=1), axis=0) if len(inner) else inner
    rank = elimination(pairs, moving, contacts.centre)
    rank = cholesky.postorder(np.ascontiguousarray(rank[pairs]), len(moving))[rank]
    panels = cholesky.panels_of(np.ascontiguousarray(rank[pairs]), len(moving), SPARE, _VELOCITIES)
    order = np.empty_like(moving)
    order[rank] = moving
    return order, np.where(side >= 0, rank[side], -1), panels
