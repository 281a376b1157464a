"""ADMM between rigid bodies in motion: compiled, with its own factors, and extrapolated where it is slow.

The iteration of `ADMM`, from a start that is predicted from the last two steps, and with a penalty of each contact's
own compliance. As the contacts of moving stones change from step to step and their forces from iteration to iteration,
what counts is the cost of an iteration: of two passes over the contacts and one solution with the factors of
M + H Σ⁻¹ Hᵀ, less than that of a Gauss–Seidel sweep (mechanics/solvers/_kernels/body_admm.py).
"""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.delassus.elimination import elimination
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart, RigidContacts
from mechanics.problem.residual import project_on_cone, residual
from mechanics.solvers._kernels import body_admm as kernel
from mechanics.solvers._kernels import body_cholesky as cholesky
from moma.errors import SolverError

__all__ = ["BodyADMM", "Stage"]


# overshoot of the impulses [-]
_OVER = 1.6
# zeros that a panel of the factors may hold, over its other blocks [-]
_SPARE = 0.2
# iterations before the first look at the residual
_FIRST_LOOK = 10
# fewest iterations between two looks
_LEAST_LOOK = 5
# part of the change at which the residual is expected to be small enough, at which it is looked at [-]
_EARLY = 0.8
# iterates from which is extrapolated
_DEPTH = 6


@dataclass(frozen=True)
class Stage:
    """Some iterations.

    Attributes
    ----------
    penalty : σ of a contact over the mean diagonal of its W_αα; larger values bear with contacts that open and slide,
        smaller ones find the forces of stones that stay in touch sooner [-]
    iterations : their number
    extrapolated : from the iterates before (Anderson 1965)
    """

    penalty: float
    iterations: int
    extrapolated: bool


STAGES = (Stage(0.02, 150, False), Stage(0.05, 150, True), Stage(0.2, 250, True))


@dataclass(frozen=True)
class BodyADMM:
    """ADMM on the velocities of rigid bodies until η and the velocity error are within their tolerances.

    Attributes
    ----------
    tolerance, velocity_tolerance, max_iterations : as in `ADMM`
    stages : in turn, as long as it is not solved
    further : tolerances of the first stage over those asked for: the next steps begin where the last ones lead, and
        gain from what these go further [-]
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 1000
    stages: tuple[Stage, ...] = STAGES
    further: float = 1.0

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; return the best of all looks.

        Raises
        ------
        SolverError : if W is not that of rigid bodies, or no contact holds a body
        """
        contacts = problem.delassus.rigid
        if contacts is None:
            raise SolverError(
                "bodies are not all rigid", where="ADMM of bodies", remedy='use the method "admm"'
            )
        run = _Run(problem, contacts, start, self)
        best = run.look()
        most = min(self.max_iterations, sum(stage.iterations for stage in self.stages))
        while best[0] > run.goal and run.iterations < most:
            run.iterate()
            best = min(best, run.look(), key=lambda look: look[0])
        left = residual(problem, best[1])
        within = left.within(self.tolerance, self.velocity_tolerance)
        return ContactSolution(best[1], best[2], run.iterations, left.natural_map, within)


class _Run:
    """Iterates of one solution."""

    def __init__(
        self, problem: ContactProblem, contacts: RigidContacts, start: ContactStart, settings: BodyADMM
    ) -> None:
        self._problem, self._settings = problem, settings
        self._frame = np.ascontiguousarray(contacts.geometry[:, :9]).reshape(-1, 3, 3)
        moving = np.flatnonzero(contacts.inertia[:, 0] > 0)
        self._order, side, self._panels = _eliminated(contacts, moving)
        self._inertia = contacts.inertia[self._order]
        self._mass = kernel.masses(contacts.inertia, self._order)
        self._free = self._world(problem.u_free)
        compliance = np.einsum("cii->c", problem.delassus.diagonal) / 3.0
        normal = np.ascontiguousarray(self._frame[:, 0])
        self._touching = kernel.Touching(
            side,
            normal,
            np.ascontiguousarray(contacts.geometry[:, 9:]),
            self._free + problem.bias[:, None] * normal,
            problem.friction,
            problem.cohesion,
            np.zeros(len(side)) if problem.adhesion is None else problem.adhesion,
            settings.stages[0].penalty * compliance,
        )
        self._compliance, self._stages = compliance, list(settings.stages)
        self._pace = float(np.abs(problem.u_free).max()) or float(np.abs(problem.bias).max()) or 1.0
        impulse = project_on_cone(start.impulse, problem.friction, problem.cohesion)
        x = self._world(impulse) - self._world(start.velocity) / self._touching.sigma[:, None]
        self._iterate = kernel.Iterate(x, np.empty_like(x), np.empty_like(x), np.zeros(6 * len(moving)))
        self._length = float(np.linalg.norm(self._touching.arm[:, :3], axis=1).mean())
        self._factors: kernel.Factors | None = None
        # by penalty, for stages whose penalties recur
        self._known: dict[float, kernel.Factors] = {}
        self._memory = _acceleration(0, 0)
        self._until = 0
        self.iterations, self._change, self._limit = 0, np.inf, 0.0

    def _world(self, local: Array) -> Array:
        world: Array = np.einsum("cki,ck->ci", self._frame, local)
        return world

    def _local(self, world: Array) -> Array:
        local: Array = np.einsum("cki,ci->ck", self._frame, world)
        return local

    def _factorised(self) -> kernel.Factors:
        value: Array = kernel.assemble(self._touching, self._mass, self._panels)
        if not cholesky.factorise(self._panels, value):
            raise SolverError("W is not a number", where="ADMM of bodies", remedy="use another method")
        return kernel.Factors(self._panels, value)

    @property
    def goal(self) -> float:
        """Errors over their tolerances at which the iteration ends [-]."""
        settings = self._settings
        return settings.further if self.iterations < settings.stages[0].iterations else 1.0

    def iterate(self) -> None:
        """Make iterations until the next look."""
        if self.iterations == self._until:
            self._begin(self._stages.pop(0))
        most = min(self._settings.max_iterations, self._until) - self.iterations
        if self.iterations == 0:
            self._advance(min(_FIRST_LOOK, most), 0.0)
            return
        least = min(_LEAST_LOOK, most)
        self._advance(least, 0.0)
        if self._change > self._limit:
            self._advance(most - least, self._limit)

    def _advance(self, count: int, limit: float) -> None:
        made, self._change = kernel.advance(
            self._iterate, count, limit, _OVER, self._length, self._touching, self._factors, self._memory
        )
        self.iterations += made

    def _begin(self, stage: Stage) -> None:
        """Go on with the penalty of a stage; y keeps its velocities."""
        self._until += stage.iterations
        self._memory = _acceleration(_DEPTH if stage.extrapolated else 0, self._iterate.x.size)
        sigma = stage.penalty * self._compliance
        if self.iterations:
            self._broken()
            x, z = self._iterate.x, self._iterate.z
            x[:] = z + (x - z) * (self._touching.sigma / sigma)[:, None]
        if self._factors is None or self.iterations:
            self._touching = self._touching._replace(sigma=sigma)
            if stage.penalty not in self._known:
                self._known[stage.penalty] = self._factorised()
            self._factors = self._known[stage.penalty]

    def _broken(self) -> tuple[float, float, float]:
        iterate, scale = self._iterate, self._problem.delassus.scale
        found: tuple[float, float, float] = kernel.broken_laws(
            iterate.x, self._touching, self._free, self._inertia, 1.0 / scale, iterate.z
        )
        return found

    def look(self) -> tuple[float, Array, Array]:
        """Return the larger of both errors over their tolerances, the impulses and the velocities û (nc, 3)."""
        settings, scale = self._settings, self._problem.delassus.scale
        whole, largest, size = self._broken()
        eta = whole / max(size, 1e-300)
        excess = max(eta / settings.tolerance, largest * scale / self._pace / settings.velocity_tolerance)
        if np.isfinite(self._change) and excess > 0:
            self._limit = self._change * _EARLY * self.goal / excess
        velocity = self._touching.sigma[:, None] * (self._iterate.z - self._iterate.x)
        return float(excess), self._local(self._iterate.z), self._local(velocity)


def _acceleration(depth: int, size: int) -> kernel.Acceleration:
    return kernel.Acceleration(
        np.empty((depth, size)),
        np.empty((depth, size)),
        np.zeros((depth, depth)),
        np.zeros(2, dtype=np.int64),
        np.zeros(1),
    )


def _eliminated(contacts: RigidContacts, moving: Ints) -> tuple[Ints, Ints, cholesky.Panels]:
    """Return the moving bodies in the order of their elimination, the contacts' places in it, and the panels."""
    place = np.full(len(contacts.inertia), -1)
    place[moving] = np.arange(len(moving))
    side = place[contacts.body]
    inner = side[(side >= 0).all(axis=1)]
    pairs = np.unique(np.sort(inner, axis=1), axis=0) if len(inner) else inner
    rank = elimination(pairs, moving, contacts.centre)
    rank = cholesky.postorder(np.ascontiguousarray(rank[pairs]), len(moving))[rank]
    panels = cholesky.panels_of(np.ascontiguousarray(rank[pairs]), len(moving), _SPARE)
    order = np.empty_like(moving)
    order[rank] = moving
    return order, np.where(side >= 0, rank[side], -1), panels
