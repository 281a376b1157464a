"""The loop of docs/theory.md: predict, detect, state the problem, solve, advance."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechanics.bodies.deformable import DynamicCompliance
from mechanics.contact.assembly import delassus, local_velocity, sparse_form, world_impulse
from mechanics.contact.contacts import Contacts, gaps
from mechanics.contact.detection import Detector
from mechanics.memory import Memory
from mechanics.model import Model
from mechanics.observers.energy import kinetic_energy
from mechanics.observers.equilibrium import displacement, speed
from mechanics.problem import ContactSolution, Delassus, SparseForm
from mechanics.solvers.admm import ADMM
from mechanics.solvers.choice import choose_solver
from mechanics.state import State
from mechanics.stepping import advance, compliances, contact_problem, follow_nodes, free_motion, predict
from moma.errors import SolverError

__all__ = ["Clock", "Simulation", "Step"]

Array = NDArray[np.float64]

# contacts are found anew when a body has moved by more than this part of the scene's smallest width since last time,
_STALE = 1e-3
# or by more than this part, once it moves a hundred times less per step: where stones come to rest, no lag stays
_SETTLED, _SLOWED = 1e-6, 1e-2


class Clock:
    """Wall seconds by stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        """Add the time of a with-block to a stage."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - start


@dataclass(frozen=True)
class Step:
    """What one step found.

    Attributes
    ----------
    before, after : the states between which it lies; relaxation comes after them
    contacts : the contact points
    solution : their impulses
    force : (nc, 3) mean forces r/h on the candidates, world axes [N]
    gap : (nc,) at the end of the step [m]
    work : r·u_θ, the work of the contacts [J]
    relaxed : kinetic energy that relaxation took out at the end of the step [J]
    """

    before: State
    after: State
    contacts: Contacts
    solution: ContactSolution
    force: Array
    gap: Array
    work: float
    relaxed: float


@dataclass(frozen=True)
class _Touching:
    """The contacts in force, their Delassus operator, and the configuration in which they were found."""

    contacts: Contacts
    operator: Delassus
    sparse: SparseForm | None
    configuration: State


class Simulation:
    """A scene in motion; `step` takes it one time step on."""

    def __init__(self, model: Model, start: State, clock: Clock) -> None:
        settings = model.scene
        self.model, self.state, self.clock = model, start, clock
        self._step, self._theta = settings.time.step, settings.time.theta
        with clock("assemble"):
            self._compliance: dict[int, DynamicCompliance] = compliances(model, self._step, self._theta)
        self._detector = Detector(model.surfaces, model.fixed, settings.contact.alert_distance)
        self._solve = choose_solver(settings.solver, bool(model.elastic.any()))
        self._memory = Memory()
        self._touching: _Touching | None = None
        self._kinetic = 0.0

    def step(self) -> Step:
        """Predict, detect, solve, advance.

        Raises
        ------
        SolverError : if the motion is no longer finite
        """
        h, theta, model = self._step, self._theta, self.model
        predicted = predict(self.state, h * (1 - theta))
        predicted, touching = self._detect(predicted)
        contacts = touching.contacts
        # one frame for the whole step: the linear problem of a deformable body is stated in it
        before = self._with_frames_of(predicted, self.state)
        with self.clock("assemble"):
            free = free_motion(model, before, self._compliance, h, theta)
            problem = contact_problem(
                model, predicted, contacts, touching.operator, touching.sparse, free, h, theta
            )
        with self.clock("solve"):
            solution = self._solve(problem, start=self._memory.recall(contacts))
        with self.clock("advance"):
            after = advance(
                model, before, contacts, touching.operator, solution.impulse, free, self._compliance, h, theta
            )
        if not (np.isfinite(after.velocity).all() and np.isfinite(after.node_velocity).all()):
            raise SolverError(
                f"the velocities are not finite at t = {after.time:.6g} s",
                where=model.scene.name,
                remedy="use a smaller time step",
            )
        self._memory.store(contacts, solution)
        work = self._contact_work(before, after, touching, solution)
        self.state, relaxed = self._relax(after)
        force = world_impulse(contacts, solution.impulse) / h
        return Step(before, after, contacts, solution, force, gaps(contacts, after), work, relaxed)

    def _relax(self, after: State) -> tuple[State, float]:
        """Kinetic damping: bring all bodies to a halt once their kinetic energy has passed a peak (Cundall 1976)."""
        kinetic, last = kinetic_energy(self.model, after), self._kinetic
        if not self.model.scene.time.relaxation or kinetic >= last:
            self._kinetic = kinetic
            return after, 0.0
        self._kinetic = 0.0
        halted = replace(
            after, velocity=np.zeros_like(after.velocity), node_velocity=np.zeros_like(after.node_velocity)
        )
        return halted, kinetic

    def _detect(self, predicted: State) -> tuple[State, _Touching]:
        """The contacts at the predicted configuration; found anew only when something has moved."""
        known = self._touching
        if known is not None:
            width = self.model.surfaces.size.min()
            moved = displacement(self.model, known.configuration, predicted).max() / width
            pace = self._step * speed(self.model, predicted).max() / width
            settled = moved > _SETTLED and pace < _SLOWED * moved
            if moved <= _STALE and not settled:
                return self._with_frames_of(known.configuration, predicted), known
        with self.clock("detect"):
            predicted = follow_nodes(self.model, predicted)
            contacts = self._detector(predicted, self._step * speed(self.model, predicted))
        with self.clock("assemble"):
            operator = delassus(self.model, predicted, contacts, self._compliance)
            sparse = None
            if isinstance(self._solve, ADMM):
                sparse = sparse_form(self.model, predicted, contacts, operator, self._compliance)
        self._touching = _Touching(contacts, operator, sparse, predicted)
        return predicted, self._touching

    def _with_frames_of(self, source: State, state: State) -> State:
        """`state` with the frames of the deformable bodies taken from `source`."""
        elastic = self.model.elastic
        return replace(
            state,
            centre=np.where(elastic[:, None], source.centre, state.centre),
            rotation=np.where(elastic[:, None, None], source.rotation, state.rotation),
        )

    def _contact_work(
        self, before: State, after: State, touching: _Touching, solution: ContactSolution
    ) -> float:
        """r·u_θ [J]."""
        theta = self._theta
        velocity = theta * after.velocity + (1 - theta) * before.velocity
        node_velocity = theta * after.node_velocity + (1 - theta) * before.node_velocity
        u_theta = local_velocity(touching.contacts, touching.operator, velocity, node_velocity)
        return float(np.sum(solution.impulse * u_theta))
