"""Run a scene from its start to its outcome, with its history and error measures."""

from collections import Counter
from collections.abc import Callable
from dataclasses import fields

import numpy as np
from threadpoolctl import ThreadpoolController

from mechanics.arrays import Array
from mechanics.dynamics.energy_balance import EnergyBalance
from mechanics.dynamics.observers.energy import kinetic_energy
from mechanics.dynamics.observers.equilibrium import settlement, speed, support_reaction
from mechanics.dynamics.outcome import Outcome, StaticStart
from mechanics.dynamics.progress import Clock, Listener, Progress, silent
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.static_start import static_start
from mechanics.dynamics.step import Step
from mechanics.dynamics.stopping import LASTING, Verdict, Watch, balance_of, lasts
from mechanics.model.model import Model, build_model
from mechanics.results.peaks import PeakTracker
from mechanics.results.postprocess import Observer
from mechanics.results.result import Energies, Errors, History, Result
from mechanics.scene.scene import Scene, Start
from mechanics.scene.state import State

__all__ = ["simulate"]


def simulate(
    scene: Scene,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    built: tuple[Model, State] | None = None,
) -> Result:
    """Run a scene until it rests, has collapsed, or its duration is over.

    Parameters
    ----------
    scene : the scene
    progress : called at every stage and step
    stop : asked after every step; where it says True, the run ends as interrupted
    built : what `build_model` made of the scene, if it is known; None: build it

    A block that stands on a fixed one is carried by its own weight:

    >>> import numpy as np
    >>> from mechanics.scene.scene import Block, Fidelity, Scene
    >>> from mechanics.stones.materials import Material
    >>> cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    >>> faces = (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)
    >>> stone = Material("stone", density=2000.0, young=10e9, poisson=0.2)
    >>> ground = Block("ground", cube - [0, 0, 1], faces, stone, Fidelity.FIXED)
    >>> result = simulate(Scene("one block", (ground, Block("block", cube, faces, stone))))
    >>> result.outcome.value, round(result.reaction / (2000.0 * 9.81), 6)
    ('equilibrium', 1.0)

    Raises
    ------
    SceneError, GeometryError, MeshError : if the scene cannot be built
    SolverError : if the motion is no longer finite
    """
    # dense products of stones are small, and those of several threads would not be the same to the last bit
    with ThreadpoolController().limit(limits=1, user_api="blas"):
        return _simulate(scene, progress, stop, built)


def _simulate(
    scene: Scene, report: Listener, stop: Callable[[], bool], built: tuple[Model, State] | None
) -> Result:
    clock, settings, static = Clock(), scene.time, None
    if built is None:
        with clock("mesh"):
            built = build_model(scene, lambda done, total: report(Progress("mesh", done, total)))
    model, start = built
    simulation = Simulation(model, start, clock)
    if settings.start == Start.EQUILIBRIUM:
        report(Progress("static", 0, None, "searching for the static equilibrium"))
        with clock("start"):
            static, search = static_start(model, start, report)
        if static.found:
            simulation.take_over(search)
    log, watch = _Log(model, start, simulation.state), Watch(model, start)
    total = max(1, round(settings.duration / settings.step))
    report(Progress("step", 0, total))
    for count in range(1, total + 1):
        step = simulation.step()
        with clock("observe"):
            balance = log(step)
            outcome = watch(step, balance)
        if outcome is Outcome.EQUILIBRIUM and (settings.stop_at_equilibrium or count == total):
            at_once = count == LASTING and not settings.relaxation and simulation.cold
            with clock("confirm"):
                confirmed = at_once or lasts(simulation.released())
            if not confirmed:
                outcome, simulation = watch.disproved(), simulation.released()
        text = f"balance {balance.max():.1e}, η {step.solution.natural_map:.1e}"
        report(Progress("step", count, total, text))
        done = settings.stop_at_equilibrium and outcome is not Outcome.MOVING
        if not done and count < total and stop():
            outcome, done = Outcome.INTERRUPTED, True
        if done or count == total or (scene.frame_every and count % scene.frame_every == 0):
            with clock("stress"):
                log.frames.append(log.observer.frame(step))
        if done:
            break
    verdict = watch.verdict(outcome, step.after, static)
    return _result(log, step, verdict, watch.rest_time, clock, static)


class _Log:
    """Record of a run: what the observers find in each step, and its frames."""

    def __init__(self, model: Model, start: State, first: State) -> None:
        self.model, self._start = model, start
        self.observer = Observer(model, start)
        self.frames = [self.observer.first_frame(first)]
        self.peaks = PeakTracker(model, start)
        self.balance = np.zeros(len(model.mass))
        self.energy = EnergyBalance(model, first)
        self.unconverged = 0
        self.solvers: Counter[str] = Counter()
        self._rows: list[tuple[float, ...]] = []

    def __call__(self, step: Step) -> Array:
        """Account for one step, and return the imbalance of each body (nb,)."""
        model, solution = self.model, step.solution
        if not self._rows:
            self.peaks.begin(self.observer.begin(step))
        self.peaks(step)
        self.energy(step)
        self.unconverged += not solution.converged
        if solution.why:
            self.solvers[solution.why] += 1
        self.balance = balance = balance_of(model, step)
        self._rows.append(  # in the order of History
            (
                step.after.time,
                kinetic_energy(model, step.after),
                float(speed(model, step.after).max()),
                float(balance.max()),
                solution.natural_map,
                solution.iterations,
                len(step.gap),
                float(np.max(-step.gap, initial=0.0)),
                float(settlement(model, self._start, step.after)[~model.fixed].max(initial=0.0)),
            )
        )
        return balance

    def history(self) -> History:
        """Return one array for each quantity."""
        names = (field.name for field in fields(History))
        columns = dict(zip(names, np.array(self._rows).T, strict=True))
        counts = {name: columns.pop(name).astype(np.int64) for name in ("iterations", "contacts")}
        return History(**columns, **counts)


def _result(
    log: _Log, last: Step, verdict: Verdict, rest_time: float, clock: Clock, static: StaticStart | None
) -> Result:
    model, observer, energy, history = log.model, log.observer, log.energy, log.history()
    support = support_reaction(model, last.contacts, last.force, last.after.time)
    with clock("stress"):
        bodies = observer.bodies(last.after, log.balance)
        contacts, joints = observer.contacts_and_joints(last)
    errors = Errors(
        natural_map=float(history.natural_map[-LASTING:].max()),
        penetration=float(history.penetration.max()) / float(model.surfaces.size.min()),
        balance=float(history.balance[-1]),
        reaction=support.error,
        energy=energy.error,
        unconverged_steps=log.unconverged,
    )
    return Result(
        scene=model.scene,
        outcome=verdict.outcome,
        steps=len(history.time),
        time=last.after.time,
        bodies=bodies,
        contacts=contacts,
        joints=joints,
        errors=errors,
        energies=Energies(energy.external, energy.contact, energy.scheme),
        rest_time=rest_time if verdict.outcome is Outcome.EQUILIBRIUM else None,
        reaction=support.reaction,
        weight=support.weight,
        frames=tuple(log.frames),
        history=history,
        wall_time=dict(clock.seconds),
        static=static,
        solvers=dict(log.solvers.most_common()),
        reason=verdict.reason,
        cautions=verdict.cautions,
        peaks=log.peaks.peaks(log.frames, joints, last.after),
        series=log.peaks.series(),
    )
