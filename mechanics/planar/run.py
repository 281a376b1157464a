"""A run of a scene of the plane, step by step: its observations, what it carries, and its result."""

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Clock, SteppedRun
from mechanics.planar.contacts import PlanarDetector
from mechanics.planar.model import PlanarModel, PlanarState, build_planar_model
from mechanics.planar.observers import (
    PlanarEnergy,
    PlanarWatch,
    disk_speed,
    imbalance,
    kinetic_energy,
    world_force,
)
from mechanics.planar.overlaps import refuse_deep
from mechanics.planar.result import (
    PlanarContactResult,
    PlanarFrame,
    PlanarHistory,
    PlanarInstant,
    PlanarResult,
)
from mechanics.planar.scene import PlanarScene
from mechanics.planar.simulation import PlanarSimulation, PlanarStep
from mechanics.results.log import StepLog
from mechanics.scene.laws.status import contact_status
from mechanics.solvers.chain import Solver


class PlanarRun(SteppedRun):
    """A run in progress.

    `step` takes it one time step on until it is `done`; `instant` and `result` tell of the last step. `carried` is what
    another run of the same scene needs to go on from here, to the last bit (`restore`); the steps that it has made
    change nothing of what it carried before.

    Parameters
    ----------
    scene : it
    solver : of its steps; None: as the scene's settings choose

    Raises
    ------
    SceneError : disks overlap too much at the start, or a wall runs through them

    Attributes
    ----------
    model : constant data of the scene
    steps, total : steps done, and at most
    frames : the motion so far: the start, and each `frame_every`-th step

    Examples
    --------
    >>> from mechanics.planar.scene import Disk, PlanarScene, PlanarTime
    >>> drop = PlanarScene("drop", (Disk("disk", (0.0, 0.0), 0.1),), time=PlanarTime(0.01, 0.5, 0.1))
    >>> run = PlanarRun(drop)
    >>> for _ in range(5):
    ...     step = run.step()
    >>> other = PlanarRun(drop)
    >>> other.restore(run.carried())
    >>> while not other.done:
    ...     step = other.step()
    >>> other.steps, round(float(other.instant().velocity[0, 1]), 3)
    (10, -0.981)
    """

    CARRIED = ("_log", "_watch", "simulation", "steps")
    REBUILT = ("_last", "clock", "model", "total")

    def __init__(self, scene: PlanarScene, solver: Solver | None = None) -> None:
        self.clock = Clock()
        self.model, start = build_planar_model(scene)
        refuse_deep(self.model, PlanarDetector(self.model)(start))
        self.simulation = PlanarSimulation(self.model, start, self.clock, solver)
        self._log, self._watch = _Log(self.model, start), PlanarWatch(self.model)
        self.steps, self.total = 0, scene.time.steps
        self._last: PlanarStep | None = None

    @property
    def outcome(self) -> Outcome:
        """Outcome so far: equilibrium or moving."""
        return self._watch.outcome

    @property
    def done(self) -> bool:
        """Its duration is over, or it rests and is to stop there."""
        rests = self.model.scene.time.stop_at_equilibrium and self.outcome is Outcome.EQUILIBRIUM
        return rests or self.steps >= self.total

    @property
    def text(self) -> str:
        """Residual of the last step."""
        return f"η {self._made().solution.natural_map:.1e}"

    @property
    def frames(self) -> tuple[PlanarFrame, ...]:
        """The motion so far."""
        return tuple(self._log.frames)

    def step(self) -> PlanarStep:
        """Make one time step.

        Raises
        ------
        SceneError : if a motion leaves the plane
        SolverError : if the motion is no longer finite
        """
        step = self.simulation.step()
        self.steps += 1
        with self.clock("observe"):
            balance = imbalance(self.model, step)
            self._watch(step, balance)
            self._log(step, float(balance.max()))
        every = self.model.scene.frame_every
        if every and self.steps % every == 0:
            self._log.frames.append(_frame(step.after))
        self._last = step
        return step

    def instant(self) -> PlanarInstant:
        """Return the end of the last step, with its contacts and forces.

        Raises
        ------
        SceneError : if no step has been made since the run began, or was restored
        """
        last = self._made()
        contacts = _contacts(last, self.model.scene.time.step)
        after = last.after
        return PlanarInstant(self.steps, after.time, _position(after), after.velocity, contacts)

    def result(self, outcome: Outcome | None = None) -> PlanarResult:
        """Return the result so far, as of the last step.

        Parameters
        ----------
        outcome : other than the run's own, as where it is stopped

        Raises
        ------
        SceneError : if no step has been made since the run began, or was restored
        """
        return _result(self.model, self._made(), outcome or self.outcome, self._log, self.clock)

    def _made(self) -> PlanarStep:
        if self._last is None:
            raise SceneError("no step has been made", where=self.model.scene.name, remedy="make a step first")
        return self._last


def _position(state: PlanarState) -> Array:
    return np.column_stack([state.centre, state.angle])


def _frame(state: PlanarState) -> PlanarFrame:
    return PlanarFrame(state.time, _position(state))


def _contacts(step: PlanarStep, duration: float) -> PlanarContactResult:
    contacts = step.contacts
    return PlanarContactResult(
        bodies=contacts.bodies,
        point=contacts.point,
        normal=contacts.normal,
        force=world_force(contacts, step.impulse, duration),
        gap=step.gap,
        area=contacts.area,
        status=contact_status(step.internal, step.terms, step.solution.impulse),
    )


class _Log(StepLog[PlanarFrame, PlanarHistory]):
    """Record of the observations of each step, and the frames of the motion."""

    REBUILT = (*StepLog.REBUILT, "_model")
    energy: PlanarEnergy

    def __init__(self, model: PlanarModel, start: PlanarState) -> None:
        super().__init__(PlanarEnergy(model, start), PlanarHistory)
        self._model = model
        self.frames.append(_frame(start))

    def __call__(self, step: PlanarStep, balance: float) -> None:
        """Account for one step."""
        model, solution, velocity = self._model, step.solution, step.after.velocity
        self.energy(step)
        overlap = np.maximum(-step.gap, 0.0)
        self.add(
            solution.converged,
            (
                step.after.time,
                kinetic_energy(model, velocity),
                float(disk_speed(model, velocity).max()),
                balance,
                solution.natural_map,
                solution.iterations,
                len(step.contacts),
                float(np.max(-step.gap / step.contacts.size, initial=0.0)),
                float(overlap.max(initial=0.0)),
                float(overlap.sum()) / max(1, int((step.gap <= 0.0).sum())),
                step.lifted,
            ),
        )


def _result(
    model: PlanarModel,
    last: PlanarStep,
    outcome: Outcome,
    log: _Log,
    clock: Clock,
) -> PlanarResult:
    scene, history, contacts = model.scene, log.history(), _contacts(last, model.scene.time.step)
    gravity = np.asarray(scene.gravity, dtype=float)
    g = float(np.hypot(*gravity))
    up = -gravity / g if g > 0 else np.array([0.0, 1.0])
    sides, force = model.fixed[contacts.bodies].astype(float), contacts.force
    reaction = float(np.sum((sides[:, 1] - sides[:, 0]) * (force[:, 0] * up[0] + force[:, 1] * up[1])))
    weight = float(model.mass[~model.fixed].sum()) * g
    return PlanarResult(
        scene=scene,
        outcome=outcome,
        steps=len(history.time),
        time=last.after.time,
        position=_position(last.after),
        velocity=last.after.velocity,
        contacts=contacts,
        errors=log.errors(abs(reaction - weight) / weight if weight > 0 else 0.0),
        reaction=reaction,
        weight=weight,
        frames=tuple(log.frames),
        history=history,
        wall_time=dict(clock.seconds),
    )
