"""The loop of docs/theory.md: predict, detect, state the problem, solve, advance."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.contact.contacts import Contacts, gaps, take
from mechanics.contact.detection import Detector
from mechanics.delassus.assembly import (
    local_velocity,
    mixed_delassus,
    rigid_delassus,
    world_impulse,
)
from mechanics.delassus.mixed import MixedDelassus
from mechanics.delassus.rigid import RigidDelassus, schedule
from mechanics.dynamics.contact_forces import Bearing, both
from mechanics.dynamics.contact_laws import Statement, state_laws
from mechanics.dynamics.observers.energy import kinetic_energy
from mechanics.dynamics.observers.equilibrium import displacement, speed
from mechanics.dynamics.sleeping import RINGS, Sleep, held_model
from mechanics.dynamics.stepping import Kick, advance, compliances, free_kick, kicked, predict
from mechanics.dynamics.warm_start import Memory
from mechanics.model.model import Model
from mechanics.problem.problem import ContactSolution
from mechanics.scene.laws.law import Terms
from mechanics.scene.state import State
from mechanics.solvers.choice import Solver, choose_solver
from moma.errors import SolverError

__all__ = ["Clock", "Simulation", "Step", "detector"]


# contacts of rigid stones are found anew when one has moved by more than this part of the smallest width since last
# time: where stones rest, nothing is to be found; where they move, W is that of the very instant
_STALE_RIGID = 1e-6
# with deformable stones, whose W is dear, when one has moved by this,
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
    before, after : the states between which it lies; what relaxation and sleep halt is halted after them
    predicted : at the instant of the kick, with the velocities just before it
    kick : velocities just after it
    solution : the impulses r̃ of the active contacts, shifted where a law has adhesion
    active : contact points that were computed, and what they bear
    borne : those between sleeping stones; None if there are none
    resting : (nb, 6) forces and moments of these on their bodies; None if there are none [N], [N m]
    work : r·u_θ, the work of the contacts [J]
    driven : work that driven bodies put in through the contacts [J]
    relaxed : kinetic energy that relaxation, or sleep, took out at the end of the step [J]
    """

    before: State
    after: State
    predicted: State
    kick: Kick
    solution: ContactSolution
    active: Bearing
    borne: Bearing | None
    resting: Array | None
    work: float
    driven: float
    relaxed: float

    @cached_property
    def _all(self) -> Bearing:
        return self.active if self.borne is None else both(self.active, self.borne)

    @property
    def contacts(self) -> Contacts:
        """All contact points."""
        return self._all.contacts

    @property
    def impulse(self) -> Array:
        """r (nc, 3), local frame [N s]."""
        return self._all.impulse

    @property
    def shifted(self) -> Array:
        """r̃ (nc, 3), shifted where a law has adhesion [N s]."""
        return self._all.shifted

    @property
    def force(self) -> Array:
        """Mean forces r/h (nc, 3) on the candidates, world axes [N]."""
        return self._all.force

    @property
    def gap(self) -> Array:
        """(nc,) at the end of the step [m]."""
        return self._all.gap

    @property
    def terms(self) -> Terms:
        """The laws of the step, as shift and cone."""
        return self._all.terms

    @property
    def internal(self) -> Array:
        """What the laws remember of each contact (nc, STATE)."""
        return self._all.internal


@dataclass(frozen=True)
class _Touching:
    """The active contacts, their places and laws, W, and the configuration in which they were found."""

    contacts: Contacts
    place: Array
    law: Ints
    operator: RigidDelassus | MixedDelassus
    configuration: State


@dataclass(frozen=True)
class _Solved:
    """A step's contact problem and what came of it."""

    touching: _Touching
    statement: Statement
    solution: ContactSolution
    impulse: Array
    kick: Kick


class Simulation:
    """A scene in motion; `step` takes it one time step on.

    Parameters
    ----------
    model, start : as `build_model` makes them
    clock : takes the time of each stage
    solver : of the contact problems; else what the scene asks for
    elastic_scale : measure how well they are solved against the elastic part of W alone (`mixed_delassus`)
    """

    def __init__(
        self,
        model: Model,
        start: State,
        clock: Clock,
        solver: Solver | None = None,
        elastic_scale: bool = False,
    ) -> None:
        settings = model.scene
        self.model, self.start, self.state, self.clock = model, start, start, clock
        self._step, self._theta = settings.time.step, settings.time.theta
        with clock("assemble"):
            self._compliance = compliances(model, self._step, self._theta)
        self._detector = detector(model)
        self._solve = solver or choose_solver(settings.solver, not model.rigid_only)
        self._elastic_scale = elastic_scale
        self._memory = Memory()
        # what is held while it sleeps has no inverse mass in `_awake`
        self._sleep, self._awake = Sleep.nobody(start), model
        time = settings.time
        self._may_sleep = time.sleep > 0 and not time.relaxation and model.rigid_only
        self._touching: _Touching | None = None
        self._kinetic = 0.0
        self._first = True

    @property
    def asleep(self) -> Bools:
        """Which bodies sleep (nb,)."""
        return self._sleep.asleep

    def halt(self, time: float) -> None:
        """Bring all bodies to a halt, and set the clock of the scene to `time` [s]."""
        own = self.state
        still = np.zeros_like(own.velocity), np.zeros_like(own.node_velocity)
        self.state = replace(own, time=time, velocity=still[0], node_velocity=still[1])

    def take_over(self, other: "Simulation") -> None:
        """Go on from where another run with the same bodies has ended, with its forces and what its laws remember."""
        self.state = replace(other.state, time=self.state.time)
        self._memory = other._memory.at_rest(self._step / other._step)
        self._sleep = Sleep.nobody(self.state)
        self._first = False

    def step(self) -> Step:
        """Predict, detect, state the problem, solve, advance.

        Raises
        ------
        SolverError : if the motion is no longer finite
        """
        h, theta, model = self._step, self._theta, self.model
        with self.clock("advance"):
            predicted = predict(model, self.start, self.state, h * (1 - theta))
        before, rings = self.state, RINGS
        held = self._supports_rest(before, predicted)
        if not held:
            self._wake(self._sleep.asleep, predicted)
        while True:
            solved = self._solved(predicted)
            restless = self._restless(predicted, solved)
            if not restless.any():
                break
            # who wakes bears on others at once: the step is solved anew
            self._wake(self._sleep.around(restless, rings), predicted)
            rings *= 2
        with self.clock("advance"):
            after = advance(model, self.start, predicted, solved.kick, h * theta)
        if not (np.isfinite(after.velocity).all() and np.isfinite(after.node_velocity).all()):
            raise SolverError(
                f"the velocities are not finite at t = {after.time:.6g} s",
                where=model.scene.name,
                remedy="use a smaller time step",
            )
        with self.clock("advance"):
            return self._finish(before, predicted, after, solved, held)

    def _solved(self, predicted: State) -> _Solved:
        """State and solve the contact problem at the predicted configuration."""
        h, theta, model, touching = self._step, self._theta, self.model, self._detect(predicted)
        contacts, operator = touching.contacts, touching.operator
        remembered, internal = self._memory.recall(contacts.key, touching.place)
        with self.clock("assemble"):
            free = free_kick(model, self.start, predicted, self._compliance, h, theta)
            if self._sleep.asleep.any():
                free = replace(free, velocity=np.where(self._sleep.asleep[:, None], 0.0, free.velocity))
            statement = state_laws(
                model, predicted, contacts, gaps(contacts, predicted), touching.law,
                operator, free, internal, self._first,
            )  # fmt: skip
        with self.clock("solve"):
            solution = self._solve(statement.problem, start=statement.started(remembered))
        impulse = statement.real(solution.impulse)
        with self.clock("advance"):
            kick = kicked(
                model, free, touching.configuration.rotation, contacts, operator, impulse, self._compliance
            )
        return _Solved(touching, statement, solution, impulse, kick)

    def _finish(self, before: State, predicted: State, after: State, solved: _Solved, held: bool) -> Step:
        """Let the laws see what came of them, remember, put to sleep, and account."""
        kick, touching, statement, impulse = solved.kick, solved.touching, solved.statement, solved.impulse
        contacts, operator, model, theta = touching.contacts, touching.operator, self.model, self._theta
        u = local_velocity(contacts, operator, kick.velocity, kick.node_velocity)
        internal = model.laws.after(statement.law, statement.approach, solved.solution.impulse, u)
        self._memory.store(contacts.key, replace(solved.solution, impulse=impulse), internal, touching.place)
        self._first = False
        active = self._bearing(solved, after, internal)
        slept = self._sleep
        u_before = local_velocity(contacts, operator, predicted.velocity, predicted.node_velocity)
        mean = theta * kick.velocity + (1 - theta) * predicted.velocity
        driven = np.where(model.fixed[:, None], mean, 0.0)
        driving = local_velocity(contacts, operator, driven, np.zeros_like(after.node))
        self.state, relaxed = self._relax(after)
        if self._may_sleep:
            relaxed += self._put_to_sleep(active, kick, held)
        return Step(
            before=before,
            after=after,
            predicted=predicted,
            kick=kick,
            solution=solved.solution,
            active=active,
            borne=slept.borne,
            resting=None if slept.borne is None else slept.wrench,
            work=float(np.sum(impulse * (theta * u + (1 - theta) * u_before))),
            driven=-float(np.sum(impulse * driving)),
            relaxed=relaxed,
        )

    def _bearing(self, solved: _Solved, state: State, internal: Array) -> Bearing:
        touching, impulse = solved.touching, solved.impulse
        contacts = touching.contacts
        return Bearing(
            contacts,
            touching.law,
            touching.place,
            impulse,
            solved.solution.impulse,
            solved.solution.velocity,
            world_impulse(contacts, impulse) / self._step,
            gaps(contacts, state),
            solved.statement.terms,
            internal,
        )

    def _supports_rest(self, before: State, predicted: State) -> bool:
        """Whether no motion has moved its supports since the last instant."""
        return all(
            np.array_equal(before.centre[bodies], predicted.centre[bodies])
            and np.array_equal(before.rotation[bodies], predicted.rotation[bodies])
            for _, bodies in self.model.motions
        )

    def _restless(self, predicted: State, solved: _Solved) -> Bools:
        """Sleeping bodies (nb,) that a solution of this step leaves out of balance."""
        asleep = self._sleep.asleep
        if not asleep.any():
            return asleep
        with self.clock("advance"):
            touching = solved.touching
            force = world_impulse(touching.contacts, solved.impulse) / self._step
            return self._sleep.restless(self.model, predicted, solved.kick.load, touching.contacts, force)

    def _wake(self, bodies: Bools, state: State) -> None:
        """Let bodies (nb,) take part again, with what they bore."""
        if not bodies.any():
            return
        self._sleep, again = self._sleep.without(bodies, state)
        if again is not None:
            solution = np.hstack([again.impulse, again.dual])
            self._memory.take_up(again.contacts.key, solution, again.internal, again.place)
        self._hold()

    def _put_to_sleep(self, active: Bearing, kick: Kick, held: bool) -> float:
        """Who has rested for long enough falls asleep; the kinetic energy that this takes out [J]."""
        self._wake(self._sleep.uneasy(self.model, self.state, active, kick.load), self.state)
        asleep = self._sleep.asleep
        self._sleep = self._sleep.later(self.model, self.state, active, kick.load, held)
        new = self._sleep.asleep & ~asleep
        if not new.any():
            return 0.0
        self._hold()
        state = self.state
        self.state = replace(state, velocity=np.where(new[:, None], 0.0, state.velocity))
        return kinetic_energy(self.model, state) - kinetic_energy(self.model, self.state)

    def _hold(self) -> None:
        """Sleeping bodies answer no impulse, and contacts between them are left out."""
        model, asleep = self.model, self._sleep.asleep
        self._awake = held_model(model, asleep)
        self._detector = replace(self._detector, fixed=model.fixed | asleep)
        self._touching = None

    def _relax(self, after: State) -> tuple[State, float]:
        """Kinetic damping: bring all bodies to a halt once their kinetic energy has passed a peak (Cundall 1976)."""
        if not self.model.scene.time.relaxation:
            return after, 0.0
        kinetic, last = kinetic_energy(self.model, after), self._kinetic
        if kinetic >= last:
            self._kinetic = kinetic
            return after, 0.0
        self._kinetic = 0.0
        halted = replace(
            after, velocity=np.zeros_like(after.velocity), node_velocity=np.zeros_like(after.node_velocity)
        )
        return halted, kinetic

    def _detect(self, predicted: State) -> _Touching:
        """The contacts at the predicted configuration; found anew only when something has moved."""
        model, known = self._awake, self._touching
        if known is not None and not self._stale(known, predicted):
            return known
        with self.clock("detect"):
            contacts = self._detector(predicted, self._step * speed(model, predicted))
        with self.clock("assemble"):
            operator: RigidDelassus | MixedDelassus
            if model.rigid_only:
                plan = schedule(contacts.bodies, model.inertia.moving)
                contacts = take(contacts, plan.order)
                operator = rigid_delassus(model, predicted, contacts, plan)
            else:
                operator = mixed_delassus(model, predicted, contacts, self._compliance, self._elastic_scale)
        # in the axes of one of the two bodies, the same whichever is the candidate
        side = contacts.bodies.argmin(axis=1)
        place = contacts.arm[np.arange(len(side)), side]
        law = model.laws.of(contacts.bodies)
        self._touching = _Touching(contacts, place, law, operator, predicted)
        return self._touching

    def _stale(self, known: _Touching, predicted: State) -> bool:
        """Whether the known contacts no longer serve."""
        width = float(self.model.surfaces.size.min())
        moved = float(displacement(self.model, known.configuration, predicted).max()) / width
        if self.model.rigid_only:
            return moved > _STALE_RIGID
        pace = self._step * float(speed(self.model, predicted).max()) / width
        return moved > _STALE or (moved > _SETTLED and pace < _SLOWED * moved)


def detector(model: Model) -> Detector:
    """The contact detector of a scene."""
    settings = model.scene.contact
    return Detector(
        model.surfaces,
        model.fixed,
        settings.alert_distance,
        settings.points,
        settings.placement,
        max(law.reach for law in model.laws.laws),
    )
