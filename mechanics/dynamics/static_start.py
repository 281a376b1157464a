"""Static equilibrium in which a run may begin, solved for directly instead of by waiting for rest."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mechanics.arrays import Array
from mechanics.dynamics.observers.equilibrium import displacement, imbalance
from mechanics.dynamics.outcome import StaticStart
from mechanics.dynamics.progress import Progress
from mechanics.dynamics.rest.relaxation import halted
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.dynamics.stopping import rests
from mechanics.model.model import Model
from mechanics.scene.scene import Method, TimeSettings
from mechanics.scene.state import State
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.strategies.compliant import Compliant

__all__ = ["static_start"]

_LONG = (
    1.0  # time step where stones deform [s]: inertia leaves a structure of 1 Hz less than 1/40 of its motion
)
_STEPS = 10  # most such steps; few scenes need more than three
# the same where joints alone yield: in longer ones the joints that slide slide too far before they are seen again
_YIELDING, _YIELDING_STEPS = 0.1, 40
# the same where stones deform and more of them are rigid: a stone yields by a thousandth of what it moves as a whole
# then, in steps of 1 s by a hundred millionth
_MIXED, _MIXED_STEPS = 5e-3, 50
# part of the last imbalance up to which such a step is halted, which leaves a hundredth of vibrations; stones that have
# a way to go, as joints that yield or open do not bear them yet, go on until they have passed a peak [-]
_PAYS = 0.5
_UNSOLVED = 2  # such steps in a row that may be left unsolved
_RELAXED = 1e-2  # shortest time step in which rigid stones settle [s]: they fall by a millimetre in it
_RELAXED_STEPS = 50  # most of these; joints that are open by a millimetre need some ten
_NATURAL_MAP = (
    0.1  # of the tolerance of η asked for [-]: Newton's last steps cost little, and spare the run its first
)
_VELOCITY = 0.01  # of the tolerance of velocities asked for [-], for the same reason
_ROUNDING = 1e-7  # least η in steps as long as these, because of rounding [-]
_SETTLING = 5  # steps of the run's own length in which rigid stones close their last gaps
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
    search = _Search(model, halted(start), report)
    if model.rigid_only and not model.laws.sprung:
        return search.rigid()
    if model.mostly_rigid:
        told, found = search.mixed()
        if told.found:
            return told, found
        search = _Search(model, halted(start), report)
    return search.elastic()


class _Search:
    """Steps of one search.

    Parameters
    ----------
    model, start, report : as `static_start` takes them, all at rest
    """

    def __init__(self, model: Model, start: State, report: Callable[[Progress], None]) -> None:
        self._model, self._start, self._report = model, start, report
        self._count = self._iterations = 0
        self._balance: Array | None = None
        self._eta = 0.0

    def elastic(self) -> tuple[StaticStart, Simulation]:
        """Search in steps that leave no time for inertia."""
        asked = self._model.scene.solver
        eta = max(asked.tolerance, _ROUNDING)
        joints = self._model.rigid_only
        (method, step) = (Compliant, _YIELDING) if joints else (InteriorPoint, _LONG)
        solver = method(_NATURAL_MAP * eta, _VELOCITY * asked.velocity_tolerance)
        search = Simulation(_still(self._model, step), self._start, solver=solver, elastic_scale=not joints)
        found, settles, most = False, False, _YIELDING_STEPS if joints else _STEPS
        while self._count < most and not found and (settles or self._count == 0):
            self._step(search, most)
            # each step begins at rest, and the loads stay those of the first instant
            search.halt(self._start.time)
            settles = self._settles(search)
            found = settles and self._eta <= eta and self._largest <= self._model.scene.time.balance_tolerance
        if found and self._model.inertia.moving.any():
            search = _set_down(self._model, search)
        return self._told(found), search

    def mixed(self) -> tuple[StaticStart, Simulation]:
        """Search by a relaxation in short steps, each to the tolerances of the run."""
        own, settings = self._model.scene.time, self._model.scene.solver
        # joints that do not yield in the run do not do so here; a method that is asked for is that of the run
        share = settings.joint_compliance if own.relaxation else 0.0
        still = _still(self._model, _MIXED)
        usual = replace(settings, method=Method.AUTO, joint_compliance=share)
        search = Simulation(replace(still, scene=replace(still.scene, solver=usual)), self._start)
        found, unsolved, before = False, 0, np.inf
        while self._count < _MIXED_STEPS and not found and unsolved < _UNSOLVED and self._settles(search):
            # the loads stay those of the first instant
            search.state = replace(search.state, time=self._start.time)
            made = self._step(search, _MIXED_STEPS)
            unsolved = 0 if made.solution.converged else unsolved + 1
            found = self._at_rest(made)
            if self._largest <= _PAYS * before:
                search.halt(self._start.time)
            before = self._largest
        found = found and self._settles(search)
        search.halt(self._start.time)
        if found and own.step != _MIXED:
            search = _set_down(self._model, search)
        return self._told(found), search

    def rigid(self) -> tuple[StaticStart, Simulation]:
        """Search by one step from rest, then by a relaxation."""
        own = self._model.scene.time.step
        search = Simulation(_still(self._model, own), self._start)
        if self._at_rest(self._step(search, 1)):
            return self._told(True), search
        if own < _RELAXED:
            search = Simulation(_still(self._model, _RELAXED), self._start)
        found, most = False, _RELAXED_STEPS
        while self._count < most and not found and self._settles(search):
            # the loads stay those of the first instant
            search.state = replace(search.state, time=self._start.time)
            found = self._at_rest(self._step(search, most))
        if found:
            search.halt(self._start.time)
            search = _set_down(self._model, search)
        return self._told(found), search

    def _step(self, search: Simulation, most: int) -> Step:
        """Take a step, and look at its balance under the loads of the first instant."""
        made = search.step()
        after = replace(made.after, time=self._start.time)
        self._balance = imbalance(search.model, after, made.contacts, made.force, made.kick.load)
        self._count, self._iterations = self._count + 1, self._iterations + made.solution.iterations
        self._eta = made.solution.natural_map
        text = f"balance {self._largest:.1e}, η {self._eta:.1e}"
        self._report(Progress("static", self._count, most, text))
        return made

    @property
    def _largest(self) -> float:
        return float("inf") if self._balance is None else float(self._balance.max())

    def _at_rest(self, made: Step) -> bool:
        assert self._balance is not None
        return made.solution.converged and rests(self._model, made.after, self._balance)

    def _settles(self, search: Simulation) -> bool:
        """Return whether no stone has moved by more than a settlement."""
        moved = displacement(self._model, self._start, search.state)
        return bool((moved < _FALLS * self._model.surfaces.size).all())

    def _told(self, found: bool) -> StaticStart:
        return StaticStart(found, self._count, self._iterations, self._eta, self._largest)


def _still(model: Model, step: float) -> Model:
    """Return the model for steps of the search: θ = 1, and supports at rest."""
    own = model.scene.time
    time = TimeSettings(step=step, theta=1.0, relaxation=True, lumped_mass=own.lumped_mass)
    return replace(model, scene=replace(model.scene, time=time), motions=())


def _set_down(model: Model, search: Simulation) -> Simulation:
    """Take a few steps of the run's own length; over 1 s small errors of velocity leave gaps between rigid stones."""
    last = Simulation(_still(model, model.scene.time.step), search.start)
    last.take_over(search)
    for _ in range(_SETTLING):
        last.step()
        last.halt(search.start.time)
    return last
