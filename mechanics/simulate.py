"""Run a scene from its start to its outcome, with its history and error measures."""

from collections import Counter
from collections.abc import Callable

import numpy as np
from threadpoolctl import ThreadpoolController

from mechanics.arrays import Array
from mechanics.dynamics.clock import Clock
from mechanics.dynamics.observers.energy import EnergyBalance, kinetic_energy
from mechanics.dynamics.observers.equilibrium import imbalance, settlement, speed, support_reaction
from mechanics.dynamics.progress import Progress
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.static_start import static_start
from mechanics.dynamics.step import Step
from mechanics.dynamics.stopping import LASTING, Watch
from mechanics.model.model import Model, build_model
from mechanics.results.postprocess import Observer
from mechanics.results.result import Energies, Errors, Frame, History, Outcome, Result, StaticStart
from mechanics.scene.scene import Scene, Start
from mechanics.scene.state import State

__all__ = ["simulate"]


def simulate(scene: Scene, progress: Callable[[Progress], None] | None = None) -> Result:
    """Run a scene until it rests, has collapsed, or its duration is over.

    Raises
    ------
    SceneError, GeometryError, MeshError : if the scene cannot be built
    SolverError : if the motion is no longer finite
    """
    # dense products of stones are small: threads that others use too would cost more than they gain
    with ThreadpoolController().limit(limits=scene.solver.threads, user_api="blas"):
        return _simulate(scene, progress or (lambda _: None))


def _simulate(scene: Scene, report: Callable[[Progress], None]) -> Result:
    clock = Clock()
    with clock("mesh"):
        model, start = build_model(scene, lambda done, total: report(Progress("mesh", done, total)))
    simulation = Simulation(model, start, clock)
    static = None
    if scene.time.start == Start.EQUILIBRIUM:
        with clock("start"):
            static, search = static_start(model, start, report)
        if static.found:
            simulation.take_over(search)
    log = _Log(model, start, simulation.state)
    watch = Watch(model, start)
    settings = scene.time
    observer = Observer(model, start)
    frames = [observer.first_frame(simulation.state)]
    outcome, step = Outcome.MOVING, None
    total = max(1, round(settings.duration / settings.step))
    for count in range(1, total + 1):
        step = simulation.step()
        with clock("observe"):
            if count == 1:
                observer.begin(step)
            balance = log(step)
            outcome = watch(step.after, balance, step.solution)
        report(
            Progress("step", count, total, f"balance {balance.max():.1e}, η {step.solution.natural_map:.1e}")
        )
        done = settings.stop_at_equilibrium and outcome is not Outcome.MOVING
        if done or count == total or (scene.frame_every and count % scene.frame_every == 0):
            with clock("stress"):
                frames.append(observer.frame(step))
        if done:
            break
    assert step is not None
    return _result(model, observer, step, outcome, watch.rest_time, log, frames, clock, static)


class _Log:
    """Collects what the observers say of each step."""

    def __init__(self, model: Model, start: State, first: State) -> None:
        self._model, self._start = model, start
        self.balance = np.zeros(len(model.mass))
        self.energy = EnergyBalance(model, first)
        self.penetration = 0.0
        self.unconverged = 0
        self.rows: list[tuple[float, ...]] = []
        self.solvers: Counter[str] = Counter()

    def __call__(self, step: Step) -> Array:
        """Account for one step, and return the imbalance of each body (nb,)."""
        model, solution = self._model, step.solution
        self.energy(step)
        overlap = float(np.max(-step.gap, initial=0.0))
        self.penetration = max(self.penetration, overlap)
        self.unconverged += not solution.converged
        if solution.why:
            self.solvers[solution.why] += 1
        self.balance = balance = imbalance(
            model, step.after, step.active.contacts, step.active.force, step.kick.load, step.resting
        )
        self.rows.append(
            (
                step.after.time,
                kinetic_energy(model, step.after),
                float(speed(model, step.after).max()),
                float(balance.max()),
                solution.natural_map,
                solution.iterations,
                len(step.gap),
                overlap,
                float(settlement(model, self._start, step.after)[~model.fixed].max(initial=0.0)),
            )
        )
        return balance

    def history(self) -> History:
        """One array for each quantity."""
        time, kinetic, fastest, balance, eta, iterations, contacts, overlap, sunk = np.array(self.rows).T
        return History(
            time,
            kinetic,
            fastest,
            balance,
            eta,
            iterations.astype(np.int64),
            contacts.astype(np.int64),
            overlap,
            sunk,
        )


def _result(
    model: Model,
    observer: Observer,
    last: Step,
    outcome: Outcome,
    rest_time: float,
    log: _Log,
    frames: list[Frame],
    clock: Clock,
    static: StaticStart | None,
) -> Result:
    history, scene = log.history(), model.scene
    support = support_reaction(model, last.contacts, last.force, last.after.time)
    with clock("stress"):
        bodies = observer.bodies(last.after, log.balance)
        contacts, joints = observer.contacts_and_joints(last)
    errors = Errors(
        natural_map=float(history.natural_map[-LASTING:].max()),
        penetration=log.penetration / float(model.surfaces.size.min()),
        balance=float(history.balance[-1]),
        reaction=support.error,
        energy=log.energy.error,
        unconverged_steps=log.unconverged,
    )
    return Result(
        scene=scene,
        outcome=outcome,
        steps=len(history.time),
        time=last.after.time,
        bodies=bodies,
        contacts=contacts,
        joints=joints,
        errors=errors,
        energies=Energies(log.energy.external, log.energy.contact, log.energy.scheme),
        rest_time=rest_time if outcome is Outcome.EQUILIBRIUM else None,
        reaction=support.reaction,
        weight=support.weight,
        frames=tuple(frames),
        history=history,
        wall_time=dict(clock.seconds),
        static=static,
        solvers=dict(log.solvers.most_common()),
    )
