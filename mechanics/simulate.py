"""Run a scene from its start to its outcome, with its history and error measures."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any, Protocol

import numpy as np
from threadpoolctl import ThreadpoolController

from mechanics.arrays import Array
from mechanics.carried import Carried, Carrier, Checkpointing, Rows
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
from mechanics.results.result import BodyResult, Energies, Errors, Frame, History, Result
from mechanics.scene.scene import Scene, Start
from mechanics.scene.state import State

__all__ = ["Archive", "simulate"]


class Archive(Checkpointing, Protocol):
    """Place where a run is kept while it goes on."""

    def begin(self, bodies: tuple[BodyResult, ...], frames: Sequence[Frame]) -> None:
        """Take the stones at the start, and the frames so far: a list to which the run adds others."""

    def frame(self) -> None:
        """Note that there is a further frame."""


def simulate(
    scene: Scene,
    progress: Listener = silent,
    stop: Callable[[], bool] = lambda: False,
    built: tuple[Model, State] | None = None,
    archive: Archive | None = None,
) -> Result:
    """Run a scene until it rests, has collapsed, or its duration is over.

    Parameters
    ----------
    scene : the scene
    progress : called at every stage and step
    stop : asked after every step; where it says True, the run ends as interrupted
    built : what `build_model` made of the scene, if it is known; None: build it
    archive : keeps checkpoints and frames, and knows from which checkpoint the run goes on; None: nothing is kept

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
        return _simulate(scene, progress, stop, built, archive)


def _simulate(
    scene: Scene,
    report: Listener,
    stop: Callable[[], bool],
    built: tuple[Model, State] | None,
    archive: Archive | None,
) -> Result:
    clock, settings = Clock(), scene.time
    if built is None:
        with clock("mesh"):
            built = build_model(scene, lambda done, total: report(Progress("mesh", done, total)))
    model, start = built
    earlier = None if archive is None else archive.earlier()
    run = _Run(model, start, clock)
    if earlier is not None:
        run.restore(earlier)
    elif settings.start == Start.EQUILIBRIUM:
        run.begin_in_equilibrium(report)
    log, watch = run.log, run.watch
    if archive is not None:
        archive.begin(log.observer.bodies(start, np.zeros(len(model.mass))), log.frames)
    total = max(1, round(settings.duration / settings.step))
    report(Progress("step", run.steps, total))
    for count in range(run.steps + 1, total + 1):
        run.steps = count
        step = run.simulation.step()
        with clock("observe"):
            balance = log(step)
            outcome = watch(step, balance)
        if outcome is Outcome.EQUILIBRIUM and (settings.stop_at_equilibrium or count == total):
            at_once = count == LASTING and not settings.relaxation and run.simulation.cold
            with clock("confirm"):
                confirmed = at_once or lasts(run.simulation.released())
            if not confirmed:
                outcome, run.simulation = watch.disproved(), run.simulation.released()
        text = f"balance {balance.max():.1e}, η {step.solution.natural_map:.1e}"
        report(Progress("step", count, total, text))
        done = settings.stop_at_equilibrium and outcome is not Outcome.MOVING
        stopped = not done and count < total and stop()
        last = done or stopped or count == total
        regular = bool(scene.frame_every) and count % scene.frame_every == 0
        if regular:
            _keep_frame(log, step, clock, archive)
        if archive is not None and (stopped or (not last and archive.every and count % archive.every == 0)):
            with clock("checkpoint"):
                archive.checkpoint(count, run.carried())
        if last and not regular:
            _keep_frame(log, step, clock, archive)
        if stopped:
            outcome = Outcome.INTERRUPTED
        if last:
            break
    verdict = watch.verdict(outcome, step.after, run.static)
    return _result(log, step, verdict, watch.rest_time, clock, run.static)


def _keep_frame(log: "_Log", step: Step, clock: Clock, archive: Archive | None) -> None:
    with clock("stress"):
        log.frames.append(log.observer.frame(step))
        if archive is not None:
            archive.frame()


class _Run(Carrier):
    """A run in progress: the simulation, and what is known of its steps so far."""

    CARRIED = ("log", "static", "steps", "watch")
    REBUILT = ("clock", "simulation")

    def __init__(self, model: Model, start: State, clock: Clock) -> None:
        self.clock, self.steps = clock, 0
        self.static: StaticStart | None = None
        self.simulation = Simulation(model, start, clock)
        self.log, self.watch = _Log(model, start, start), Watch(model, start)

    def begin_in_equilibrium(self, report: Listener) -> None:
        """Begin where all stones bear the loads of the first instant, if there is such a state."""
        simulation = self.simulation
        report(Progress("static", 0, None, "searching for the static equilibrium"))
        with self.clock("start"):
            self.static, search = static_start(simulation.model, simulation.start, report)
        if self.static.found:
            simulation.take_over(search)
            self.log = _Log(simulation.model, simulation.start, simulation.state)

    def carried(self) -> dict[str, Any]:
        """Return what a resumed run must know."""
        own = {"simulation": self.simulation.carried(), "seconds": dict(self.clock.seconds)}
        return super().carried() | own

    def restore(self, carried: Carried) -> None:
        """Go on where another run of the same scene stood."""
        super().restore(carried)
        self.simulation = self.simulation.resumed(carried["simulation"])
        for stage, seconds in carried["seconds"].items():
            self.clock.seconds[stage] = self.clock.seconds.get(stage, 0.0) + seconds


class _Log(Carrier):
    """Record of a run: what the observers find in each step, and its frames."""

    CARRIED = ("_rows", "balance", "energy", "frames", "observer", "peaks", "solvers", "unconverged")
    REBUILT = ("_start", "model")

    def __init__(self, model: Model, start: State, first: State) -> None:
        self.model, self._start = model, start
        self.observer = Observer(model, start)
        self.frames = Rows([self.observer.first_frame(first)])
        self.peaks = PeakTracker(model, start)
        self.balance = np.zeros(len(model.mass))
        self.energy = EnergyBalance(model, first)
        self.unconverged = 0
        self.solvers: Counter[str] = Counter()
        self._rows: Rows[tuple[float, ...]] = Rows()

    def restore(self, carried: Carried) -> None:
        """Take over the record of another run of the same scene."""
        super().restore(carried)
        self.solvers = Counter(self.solvers)
        if self.observer.joints is not None:
            self.peaks.begin(self.observer.joints)

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
    support = support_reaction(model, last.contacts, last.force, last.kick.load, last.after.time)
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
