"""Record of a run, step by step, and the results that it and its stages end in."""

from collections import Counter
from dataclasses import fields
from typing import ClassVar, Generic, TypeVar

import numpy as np

from mechanics.arrays import Array
from mechanics.carried import Carried, Carrier, Rows
from mechanics.dynamics.energy_balance import EnergyBalance, EnergyTerms
from mechanics.dynamics.observers.energy import kinetic_energy
from mechanics.dynamics.observers.equilibrium import settlement, speed, support_reaction
from mechanics.dynamics.outcome import Outcome, StaticStart
from mechanics.dynamics.progress import Clock
from mechanics.dynamics.step import Step
from mechanics.dynamics.verdicts.lasting import LASTING, balance_of
from mechanics.dynamics.verdicts.watch import Verdict
from mechanics.model.model import Model
from mechanics.results.peaks import PeakTracker
from mechanics.results.postprocess import Observer
from mechanics.results.result import Energies, Errors, Frame, Result, RunHistory, StepHistory
from mechanics.results.stages import StageResult
from mechanics.scene.scene import Fidelity, Scene
from mechanics.scene.state import State

_COUNTS = ("iterations", "contacts")
F = TypeVar("F")
H = TypeVar("H", bound=StepHistory)


class StepLog(Carrier, Generic[F, H]):
    """Record of the steps of stones or of disks: energy, frames, and one row of the history per step.

    Parameters
    ----------
    energy : balance of energy, that has seen no step
    history : class of the history; its fields are the columns of the rows
    """

    CARRIED: ClassVar[tuple[str, ...]] = ("_rows", "energy", "frames", "unconverged")
    REBUILT: ClassVar[tuple[str, ...]] = ("_history",)

    def __init__(self, energy: EnergyTerms, history: type[H]) -> None:
        self.energy, self.unconverged = energy, 0
        self.frames: Rows[F] = Rows()
        self._rows: Rows[tuple[float, ...]] = Rows()
        self._history = history

    def add(self, converged: bool, row: tuple[float, ...]) -> None:
        """Account for one step: whether it was solved, and its row of the history."""
        self.unconverged += not converged
        self._rows.append(row)

    def history(self) -> H:
        """Return one array for each quantity."""
        names = (field.name for field in fields(self._history))
        columns = dict(zip(names, np.array(self._rows).T, strict=True))
        counts = {name: columns.pop(name).astype(np.int64) for name in _COUNTS}
        return self._history(**columns, **counts)

    def errors(self, reaction: float, width: float = 1.0) -> Errors:
        """Return the error measures, given that of the reaction, and the width that penetration is over."""
        history = self.history()
        return Errors(
            natural_map=float(history.natural_map[-LASTING:].max()),
            penetration=float(history.penetration.max()) / width,
            balance=float(history.balance[-1]),
            reaction=reaction,
            energy=self.energy.error,
            unconverged_steps=self.unconverged,
        )


class Log(StepLog[Frame, RunHistory]):
    """Record of a run: what the observers find in each step, and its frames.

    Parameters
    ----------
    model : the scene
    start : its stones before they carry load, from where displacements count
    first : the state in which the run begins
    """

    CARRIED = (*StepLog.CARRIED, "balance", "observer", "peaks", "solvers")
    REBUILT = (*StepLog.REBUILT, "_start", "model")
    energy: EnergyBalance

    def __init__(self, model: Model, start: State, first: State) -> None:
        super().__init__(EnergyBalance(model, first), RunHistory)
        self.model, self._start = model, start
        self.observer = Observer(model, start)
        self.peaks = PeakTracker(model, start)
        self.balance = np.zeros(len(model.mass))
        self.solvers: Counter[str] = Counter()

    def restore(self, carried: Carried) -> None:
        """Take over the record of another run of the same scene."""
        super().restore(carried)
        self.solvers = Counter(self.solvers)
        if self.observer.joints is not None:
            self.peaks.begin(self.observer.joints)

    def begin(self, state: State) -> None:
        """Keep the frame of the start, before the first step."""
        self.frames.append(self.observer.first_frame(state))

    def __call__(self, step: Step) -> Array:
        """Account for one step, and return the imbalance of each body (nb,)."""
        model, solution = self.model, step.solution
        if not self._rows:
            self.peaks.begin(self.observer.begin(step))
        self.peaks(step)
        self.energy(step)
        if solution.why:
            self.solvers[solution.why] += 1
        self.balance = balance = balance_of(model, step)
        self.add(
            solution.converged,
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
            ),
        )
        return balance


def result_of(
    log: Log, last: Step, verdict: Verdict, rest_time: float, clock: Clock, static: StaticStart | None
) -> Result:
    """Return the result of a run from its record, its last step and its verdict."""
    model, observer, energy, history = log.model, log.observer, log.energy, log.history()
    support = support_reaction(model, last.contacts, last.force, last.kick.load, last.after.time)
    with clock("stress"):
        bodies = observer.bodies(log.frames[-1], log.balance)
        contacts, joints = observer.contacts_and_joints(last)
    return Result(
        scene=model.scene,
        outcome=verdict.outcome,
        steps=len(history.time),
        time=last.after.time,
        bodies=bodies,
        contacts=contacts,
        joints=joints,
        errors=log.errors(support.error, float(model.surfaces.size.min())),
        energies=Energies(energy.external, energy.contact, energy.scheme),
        rest_time=rest_time if verdict.outcome.rests else None,
        reaction=support.reaction,
        weight=support.weight,
        frames=tuple(log.frames),
        history=history,
        wall_time=dict(clock.seconds),
        static=static,
        solvers=dict(log.solvers.most_common()),
        reason=verdict.reason,
        cautions=_with_loads(model.scene, verdict, last.after.time, len(history.time)),
        peaks=log.peaks.peaks(log.frames, joints, last.after),
        series=log.peaks.series(),
    )


def _with_loads(scene: Scene, verdict: Verdict, end: float, steps: int) -> tuple[str, ...]:
    """Return the cautions of a verdict, and loads that are not over: first those whose peak or strong part it lacks.

    A run that a collapse or its user ends before its time says nothing of them.
    """
    ended = verdict.outcome is Outcome.COLLAPSED and steps < scene.time.steps
    if ended or verdict.outcome is Outcome.INTERRUPTED:
        return verdict.cautions
    first, last = (scene.loads.unfinished(end, missed) for missed in (True, False))
    return (*first, *verdict.cautions, *last)


def stage_result(result: Result, name: str, laid: int, removed: int, held: int, bed: float) -> StageResult:
    """Return the stage that a result ends, with what `StageResult` says of its stones and its thickest bed."""
    supports = [body.fidelity is Fidelity.FIXED for body in result.bodies]
    free = [body for body in result.bodies if body.fidelity is not Fidelity.FIXED]
    moved = [float(np.linalg.norm(body.displacement, axis=1).max()) for body in free]
    most = int(np.argmax(moved)) if moved else -1
    return StageResult(
        name=name,
        outcome=str(result.outcome),
        reason=result.reason,
        cautions=result.cautions,
        steps=result.steps,
        time=result.time,
        stones=len(result.bodies),
        laid=laid,
        removed=removed,
        held=held,
        natural_map=result.errors.natural_map,
        balance=result.errors.balance,
        reaction_error=result.errors.reaction,
        weight=result.weight,
        reaction=result.reaction,
        displacement=moved[most] if moved else 0.0,
        moved=free[most].code if moved else "",
        bed=bed,
        supports=tuple(body.code for body, support in zip(result.bodies, supports, strict=True) if support),
        forces=_forces(result)[supports],
    )


def _forces(result: Result) -> Array:
    """Return the sum (nb, 3) of the forces of each body on the others at the end of a run [N]."""
    total = np.zeros((len(result.bodies), 3))
    # forces act on the first stone of a contact
    for side, sign in ((1, 1.0), (0, -1.0)):
        np.add.at(total, result.contacts.bodies[:, side], sign * result.contacts.force)
    return total
