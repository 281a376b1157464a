"""Run a scene of the plane from its start to its outcome, with its history and error measures."""

from collections.abc import Callable

import numpy as np

from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.progress import Clock, Progress
from mechanics.dynamics.stopping import LASTING
from mechanics.planar.model import PlanarModel, PlanarState, build_planar_model
from mechanics.planar.observers import (
    PlanarEnergy,
    PlanarWatch,
    disk_speed,
    imbalance,
    kinetic_energy,
    world_force,
)
from mechanics.planar.result import PlanarContactResult, PlanarFrame, PlanarHistory, PlanarResult
from mechanics.planar.scene import PlanarScene
from mechanics.planar.simulation import PlanarSimulation, PlanarStep
from mechanics.results.result import Errors
from mechanics.scene.laws.status import contact_status

__all__ = ["simulate_planar"]


def simulate_planar(scene: PlanarScene, progress: Callable[[Progress], None] | None = None) -> PlanarResult:
    """Run a scene of the plane until it rests or its duration is over.

    Raises
    ------
    SceneError : if a motion leaves the plane
    SolverError : if the motion is no longer finite

    Examples
    --------
    A floor carries the weight of the disk that rests on it:

    >>> from mechanics.planar.scene import Disk, PlanarScene, Wall
    >>> disk, floor = Disk("disk", (0.0, 0.1), 0.1), Wall("floor", (-1.0, 0.0), (1.0, 0.0))
    >>> result = simulate_planar(PlanarScene("rest", (disk,), (floor,)))
    >>> round(result.reaction / result.weight, 6)
    1.0
    """
    report = progress or (lambda _: None)
    clock = Clock()
    model, start = build_planar_model(scene)
    simulation = PlanarSimulation(model, start, clock)
    log, watch = _Log(model, start), PlanarWatch(model)
    frames = [_frame(start)]
    outcome, step = Outcome.MOVING, None
    total = max(1, round(scene.time.duration / scene.time.step))
    for count in range(1, total + 1):
        step = simulation.step()
        with clock("observe"):
            balance = imbalance(model, step)
            outcome = watch(step, balance)
            log(step, float(balance.max()))
        report(Progress("step", count, total, f"η {step.solution.natural_map:.1e}"))
        done = count == total or (scene.time.stop_at_equilibrium and outcome is Outcome.EQUILIBRIUM)
        if done or (scene.frame_every and count % scene.frame_every == 0):
            frames.append(_frame(step.after))
        if done:
            break
    assert step is not None
    return _result(model, step, outcome, log, tuple(frames), clock)


def _frame(state: PlanarState) -> PlanarFrame:
    return PlanarFrame(state.time, np.column_stack([state.centre, state.angle]))


class _Log:
    """Record of the observations of each step."""

    def __init__(self, model: PlanarModel, start: PlanarState) -> None:
        self._model = model
        self.energy = PlanarEnergy(model, start)
        self.unconverged = 0
        self._rows: list[tuple[float, ...]] = []

    def __call__(self, step: PlanarStep, balance: float) -> None:
        """Account for one step."""
        model, solution, velocity = self._model, step.solution, step.after.velocity
        self.energy(step)
        self.unconverged += not solution.converged
        self._rows.append(
            (
                step.after.time,
                kinetic_energy(model, velocity),
                float(disk_speed(model, velocity).max()),
                balance,
                solution.natural_map,
                solution.iterations,
                len(step.contacts),
                float(np.max(-step.gap / step.contacts.size, initial=0.0)),
                step.lifted,
            )
        )

    def history(self) -> PlanarHistory:
        """Return one array for each quantity."""
        time, kinetic, speed, balance, eta, iterations, contacts, penetration, lifted = np.array(self._rows).T
        return PlanarHistory(
            time,
            kinetic,
            speed,
            balance,
            eta,
            iterations.astype(np.int64),
            contacts.astype(np.int64),
            penetration,
            lifted,
        )


def _result(
    model: PlanarModel,
    last: PlanarStep,
    outcome: Outcome,
    log: _Log,
    frames: tuple[PlanarFrame, ...],
    clock: Clock,
) -> PlanarResult:
    scene, contacts, history = model.scene, last.contacts, log.history()
    force = world_force(contacts, last.impulse, scene.time.step)
    gravity = np.asarray(scene.gravity, dtype=float)
    g = float(np.hypot(*gravity))
    up = -gravity / g if g > 0 else np.array([0.0, 1.0])
    sides = model.fixed[contacts.bodies].astype(float)
    reaction = float(np.sum((sides[:, 1] - sides[:, 0]) * (force[:, 0] * up[0] + force[:, 1] * up[1])))
    weight = float(model.mass[~model.fixed].sum()) * g
    errors = Errors(
        natural_map=float(history.natural_map[-LASTING:].max()),
        penetration=float(history.penetration.max()),
        balance=float(history.balance[-1]),
        reaction=abs(reaction - weight) / weight if weight > 0 else 0.0,
        energy=log.energy.error,
        unconverged_steps=log.unconverged,
    )
    result = PlanarContactResult(
        bodies=contacts.bodies,
        point=contacts.point,
        normal=contacts.normal,
        force=force,
        gap=last.gap,
        area=contacts.area,
        status=contact_status(last.internal, last.terms, last.solution.impulse),
    )
    return PlanarResult(
        scene=scene,
        outcome=outcome,
        steps=len(history.time),
        time=last.after.time,
        position=frames[-1].position,
        velocity=last.after.velocity,
        contacts=result,
        errors=errors,
        reaction=reaction,
        weight=weight,
        frames=frames,
        history=history,
        wall_time=dict(clock.seconds),
    )
