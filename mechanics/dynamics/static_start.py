"""Static equilibrium in which a run may begin, solved for directly instead of by waiting for rest."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array
from mechanics.dynamics.observers.equilibrium import displacement, imbalance
from mechanics.dynamics.outcome import StaticStart
from mechanics.dynamics.progress import Progress
from mechanics.dynamics.rest.relaxation import halted
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.dynamics.verdicts.lasting import rests
from mechanics.model.model import Model
from mechanics.scene.scene import Method, SolverSettings, TimeSettings
from mechanics.scene.state import State


@dataclass(frozen=True)
class _Attempt:
    """Steps of a search.

    Attributes
    ----------
    step : h, with θ = 1 [s]
    most : number of steps
    halts : share of the last imbalance up to which bodies are halted after a step; in between a relaxation halts
        them [-]
    tightened : the step leaves no time for inertia, and its tolerances are those of statics
    unsolved : steps in a row that may be left unsolved
    """

    step: float
    most: int
    halts: float = 0.0
    tightened: bool = False
    unsolved: int | None = None


# deformable stones: inertia leaves a structure of 1 Hz less than 1/40 of its motion in a step of 1 s
_DEFORMING = _Attempt(1.0, 10, np.inf, tightened=True)
# joints that yield between rigid stones: in longer steps those that slide do so too far before they are seen again
_YIELDING = _Attempt(0.1, 40, np.inf, tightened=True)
# deformable stones among more rigid ones: in steps of 1 s a stone would yield by a hundred millionth of what it moves
# as a whole. Stones that have a way to go, as open joints do not bear them yet, go on until they have passed a peak
_AMONG_RIGID = _Attempt(5e-3, 50, 0.5, unsolved=2)
# rigid stones, which fall by a millimetre in a step; joints that are open by a millimetre need some ten
_SETTLING = _Attempt(1e-2, 50)
# tolerances of statics over those asked for, of η and of velocities [-]: Newton's last steps spare the run its first
_NATURAL_MAP, _VELOCITY = 0.5, 0.01
_MIN_RESIDUAL = 1e-7  # least η in steps as long as 1 s, because of rounding [-]
_CLOSING = 5  # steps of the run's own length in which rigid stones close their last gaps
_FALLS = 0.2  # displacement over the smallest width beyond which a stone falls rather than settles [-]


def static_start(
    model: Model, start: State, report: Callable[[Progress], None]
) -> tuple[StaticStart, Simulation]:
    """Search for the equilibrium under the loads of the first instant; driven supports stay where they are.

    Where stones deform, in steps of 1 s, each from a halt, until every body is in balance: with θ = 1 such a step is
    the static problem (docs/theory.md §2), as M/h² is negligible beside K, but determines the motion that nothing else
    holds. Where joints alone do, in steps of 0.1 s; where stones deform beside more rigid ones, in steps of 5 ms first.
    Between rigid stones a step from rest is the static problem whatever its length, so that the run's own will do, and
    it is the one with which a run from rest begins. Where that leaves stones in motion, because their joints are open
    or warped, they settle in a relaxation.
    """
    begin, count, iterations = halted(start), 0, 0
    for attempt in _attempts(model):
        search = _Search(model, begin, report, attempt, count, iterations)
        search.run()
        if search.found:
            break
        count, iterations = search.count, search.iterations
    return search.told, search.ended()


def _attempts(model: Model) -> Iterator[_Attempt]:
    """Yield the ways to search, each for where the one before has failed."""
    step = model.scene.time.step
    if model.rigid_only:
        if model.laws.sprung:
            yield _YIELDING
            return
        yield _Attempt(step, 1)
        yield replace(_SETTLING, step=max(step, _SETTLING.step))
        return
    if model.mostly_rigid:
        yield _AMONG_RIGID
    yield _DEFORMING


class _Search:
    """Steps of one way.

    Attributes
    ----------
    count, iterations : steps, and iterations of the solver, those of the ways before included
    found : an equilibrium
    """

    def __init__(
        self,
        model: Model,
        start: State,
        report: Callable[[Progress], None],
        attempt: _Attempt,
        count: int,
        iterations: int,
    ) -> None:
        self._model, self._start, self._report, self._attempt = model, start, report, attempt
        self.count, self.iterations, self.found = count, iterations, False
        self._balance: Array = np.full(1, np.inf)
        self._eta, self._first = 0.0, count
        asked = model.scene.solver
        self._goal = max(asked.tolerance, _MIN_RESIDUAL)
        self._search = Simulation(
            _still(model, attempt.step, self._settings(asked)), start, elastic_scale=self._long
        )

    @property
    def _long(self) -> bool:
        """True where W is measured against its elastic part: whole stones move far more in such steps."""
        return self._attempt.tightened and not self._model.rigid_only

    def _settings(self, asked: SolverSettings) -> SolverSettings:
        if self._attempt.tightened:
            limits = _NATURAL_MAP * self._goal, _VELOCITY * asked.velocity_tolerance
            return replace(
                asked,
                method=Method.AUTO,
                tolerance=limits[0],
                velocity_tolerance=limits[1],
                joint_compliance=0.0,
            )
        if self._model.mostly_rigid and not self._model.rigid_only:
            # joints that do not yield in the run do not do so here; a method that is asked for is that of the run
            share = asked.joint_compliance if self._model.scene.time.relaxation else 0.0
            return replace(asked, method=Method.AUTO, joint_compliance=share)
        return asked

    def run(self) -> None:
        """Take steps until an equilibrium is found, stones fall, or the way ends."""
        attempt, unsolved, before = self._attempt, 0, np.inf
        while self.count - self._first < attempt.most and not self.found and self._settles():
            # the loads stay those of the first instant
            self._search.state = replace(self._search.state, time=self._start.time)
            made = self._step()
            unsolved = 0 if made.solution.converged else unsolved + 1
            self.found = self._at_rest(made)
            if self._largest <= attempt.halts * before:
                self._search.halt(self._start.time)
            if attempt.unsolved is not None and unsolved >= attempt.unsolved:
                break
            before = self._largest
        self.found = self.found and self._settles()

    def ended(self) -> Simulation:
        """Return the simulation with which the run begins, its last gaps closed if an equilibrium was found."""
        step, still = self._model.scene.time.step, self._model.inertia.moving.any()
        if not self.found:
            return self._search
        if self._attempt == _Attempt(step, 1):
            # the very step with which a run from rest begins
            return self._search
        self._search.halt(self._start.time)
        if not still or (self._attempt == _AMONG_RIGID and step == self._attempt.step):
            return self._search
        last = Simulation(_still(self._model, step, self._model.scene.solver), self._search.start)
        last.take_over(self._search)
        # over long steps small errors of velocity leave gaps between rigid stones
        for _ in range(_CLOSING):
            last.step()
            last.halt(self._start.time)
        return last

    @property
    def told(self) -> StaticStart:
        """Outcome of the search."""
        return StaticStart(self.found, self.count, self.iterations, self._eta, self._largest)

    def _step(self) -> Step:
        """Take a step, and look at its balance under the loads of the first instant."""
        made = self._search.step()
        after = replace(made.after, time=self._start.time)
        self._balance = imbalance(self._search.model, after, made.contacts, made.force, made.kick.load)
        self.count, self.iterations = self.count + 1, self.iterations + made.solution.iterations
        self._eta = made.solution.natural_map
        text = f"balance {self._largest:.1e}, η {self._eta:.1e}"
        self._report(Progress("static", self.count, self._first + self._attempt.most, text))
        return made

    @property
    def _largest(self) -> float:
        return float(self._balance.max())

    def _at_rest(self, made: Step) -> bool:
        if self._attempt.tightened:
            return self._eta <= self._goal and self._largest <= self._model.scene.time.balance_tolerance
        return made.solution.converged and rests(self._model, made.after, self._balance)

    def _settles(self) -> bool:
        """Return whether no stone has moved by more than a settlement."""
        moved = displacement(self._model, self._start, self._search.state)
        return bool((moved < _FALLS * self._model.surfaces.size).all())


def _still(model: Model, step: float, solver: SolverSettings) -> Model:
    """Return the model for steps of the search: θ = 1, and supports at rest."""
    settings = model.scene.time
    time = TimeSettings(step=step, theta=1.0, relaxation=True, lumped_mass=settings.lumped_mass)
    return replace(model, scene=replace(model.scene, time=time, solver=solver), motions=())
