"""Sleep of stones at rest: they are not moved, and contact forces among them are not solved again.

A sleeping stone has no velocity and keeps the forces with which it fell asleep; its awake neighbours see it as fixed.
Forces that lie in their cones, with u = 0, solve the contact problem of a step as far as they balance the loads, so the
error is known: the force and moment by which a sleeping stone is out of balance. Where that exceeds the scene's
`sleep`, over the stone's weight, the stone is woken within the same step, with those around it, and the step is solved
again. So no step ends with a sleeping stone that is further out of balance (docs/design/rest-and-verdicts.md).
"""

from dataclasses import replace

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.carried import Carried, Carrier
from mechanics.contact.contacts import Contacts, material_points
from mechanics.delassus.assembly import world_impulse
from mechanics.dynamics.observers.equilibrium import displacement, speed, wrenches
from mechanics.dynamics.step import ContactForces, Step
from mechanics.dynamics.stepping import Kick
from mechanics.dynamics.warm_start import Memory
from mechanics.model.model import Model
from mechanics.scene.state import State

_STEPS = 50  # steps over which a stone must rest before it falls asleep
_CALMER = 0.5  # imbalance below which a stone falls asleep, over that from which it is woken [-]: no flutter
_RINGS = 2  # rings of stones that wake around one that wakes; doubled each time that they do not suffice


class Sleepers(Carrier):
    """The sleeping stones of a run; no stone sleeps in relaxations, nor in scenes with deformable stones.

    Parameters
    ----------
    whole, start : the scene, and the state from which on its stones are watched
    memory : warm start of the contacts, to which those of woken stones return

    Attributes
    ----------
    model : the scene as awake stones see it: sleeping ones are fixed and answer no impulse
    asleep : (nb,) sleeping stones
    forces : contacts among sleeping stones, or of these with fixed ones, as they fell asleep; None if there are none
    """

    CARRIED = ("_rings", "_steps", "_supports_rest", "_watched", "_wrench", "asleep", "forces")
    REBUILT = ("_may_sleep", "_memory", "_whole", "model")

    def __init__(self, whole: Model, start: State, memory: Memory) -> None:
        time, count = whole.scene.time, len(whole.mass)
        self._whole, self._memory = whole, memory
        self._may_sleep = time.sleep > 0 and not time.relaxation and whole.rigid_only
        self.model = whole
        self.asleep: Bools = np.zeros(count, dtype=bool)
        self.forces: ContactForces | None = None
        self._wrench = np.zeros((count, 6))
        self._watched, self._steps = start, 0
        self._supports_rest, self._rings = True, _RINGS

    def restore(self, carried: Carried) -> None:
        """Take over the sleeping stones of another run of the same scene, and hold these."""
        super().restore(carried)
        if self.asleep.any():
            self._hold_asleep()

    @property
    def wrench(self) -> Array | None:
        """Sums (nb, 6) of `forces`, and of their moments about the centres of mass [N], [N m]; None without forces."""
        return None if self.forces is None else self._wrench

    def begin(self, before: State, predicted: State) -> None:
        """Begin a step: supports that have moved since the last one wake all stones."""
        self._rings = _RINGS
        self._supports_rest = all(
            np.array_equal(before.centre[bodies], predicted.centre[bodies])
            and np.array_equal(before.rotation[bodies], predicted.rotation[bodies])
            for _, bodies in self._whole.motions
        )
        if not self._supports_rest:
            self._wake(self.asleep, predicted)

    def wake_all(self, state: State) -> None:
        """Wake all stones; the memory takes up the forces that they kept."""
        self._wake(self.asleep, state)

    def hold(self, free: Kick) -> Kick:
        """Return a free motion in which sleeping stones stay at rest."""
        if not self.asleep.any():
            return free
        return replace(free, velocity=np.where(self.asleep[:, None], 0.0, free.velocity))

    def wake_disturbed(self, predicted: State, kick: Kick, contacts: Contacts, impulse: Array) -> bool:
        """Wake the stones that a solution leaves out of balance by more than `sleep`; return true if there are any.

        `contacts` are those of the awake stones, with their impulses r (nc, 3), local frame [N s].
        """
        if not self.asleep.any():
            return False
        force = world_impulse(contacts, impulse) / self._whole.scene.time.step
        out = self._imbalance(predicted, kick.load, contacts, force)
        disturbed = self.asleep & ~(out <= self._whole.scene.time.sleep)
        if not disturbed.any():
            return False
        # a stone that wakes pushes others at once, so the step must be solved again
        self._wake(self._around(disturbed, self._rings), predicted)
        self._rings *= 2
        return True

    def settle(self, step: Step) -> State:
        """Put to sleep the stones that have rested for long enough; return the state with which the run goes on."""
        state = step.after
        if not self._may_sleep:
            return state
        self._steps += 1
        if self._steps >= _STEPS:
            self._wake(self._uneasy(step), state)
        if not self._supports_rest:
            self._watched, self._steps = state, 0
        if self._steps < _STEPS:
            return state
        tired = self._tired(step)
        if tired.any():
            self._put_to_sleep(tired, step)
        self._watched, self._steps = state, 0
        return (
            replace(state, velocity=np.where(tired[:, None], 0.0, state.velocity)) if tired.any() else state
        )

    def _uneasy(self, step: Step) -> Bools:
        """Return the sleeping stones (nb,) that alone keep a scene at rest from its equilibrium.

        They are within `sleep`, but not within the tolerance to which a scene must be in balance to end.
        """
        model, state, time = self._whole, step.after, self._whole.scene.time
        at_rest = not (speed(model, state)[model.inertia.moving] > _pace(model, state)).any()
        if not (time.stop_at_equilibrium and self.asleep.any() and at_rest):
            return np.zeros_like(self.asleep)
        uneasy: Bools = self.asleep & (self._imbalance_after(step) > time.balance_tolerance)
        return uneasy

    def _tired(self, step: Step) -> Bools:
        """Return the stones (nb,) that have not moved since they are watched, do not move, and are in balance."""
        model, state, time = self._whole, step.after, self._whole.scene.time
        pace, limit = _pace(model, state), time.sleep
        if time.stop_at_equilibrium:
            limit = min(limit, time.balance_tolerance)
        return (
            model.inertia.moving
            & ~self.asleep
            & (self._imbalance_after(step) <= _CALMER * limit)
            & (speed(model, state) <= pace)
            & (displacement(model, self._watched, state) <= pace * time.step * _STEPS)
        )

    def _put_to_sleep(self, bodies: Bools, step: Step) -> None:
        """Let bodies (nb,) fall asleep with the forces of a step."""
        self.asleep = self.asleep | bodies
        lying = self.asleep | self._whole.fixed
        new = step.active.take(np.flatnonzero(lying[step.active.contacts.bodies].all(axis=1)))
        self._keep(new if self.forces is None else self.forces.joined(new), step.after)

    def _wake(self, bodies: Bools, state: State) -> None:
        """Wake bodies (nb,); the memory takes up the forces that they kept."""
        if not bodies.any():
            return
        forces, woken = self.forces, self.asleep & bodies
        self.asleep = self.asleep & ~bodies
        if forces is not None:
            rows = woken[forces.contacts.bodies].any(axis=1)
            again = forces.take(np.flatnonzero(rows))
            solution = np.hstack([again.impulse, again.dual])
            self._memory.take_up(again.contacts.key, solution, again.internal, again.place)
            forces = forces.take(np.flatnonzero(~rows))
        self._keep(forces, state)

    def _keep(self, forces: ContactForces | None, state: State) -> None:
        """Keep the forces among sleeping stones; the awake ones see these as fixed."""
        self.forces = forces
        if forces is not None:
            self._wrench = _resultants(state, forces.contacts, forces.force)
        self._hold_asleep()

    def _hold_asleep(self) -> None:
        """Make the scene as awake stones see it."""
        model, asleep = self._whole, self.asleep
        inertia = replace(
            model.inertia,
            inverse_mass=np.where(asleep, 0.0, model.inertia.inverse_mass),
            inverse_inertia=np.where(asleep[:, None, None], 0.0, model.inertia.inverse_inertia),
        )
        self.model = replace(model, inertia=inertia, fixed=model.fixed | asleep)

    def _around(self, bodies: Bools, rings: int) -> Bools:
        """Return the sleeping stones (nb,) among some bodies and, ring by ring, those in contact with them."""
        reached = bodies & self.asleep
        pairs = np.zeros((0, 2), dtype=np.int64) if self.forces is None else self.forces.contacts.bodies
        for _ in range(rings):
            touched = reached[pairs].any(axis=1)
            reached[pairs[touched].ravel()] = True
            # supports pass nothing on
            reached &= self.asleep
        return reached

    def _imbalance_after(self, step: Step) -> Array:
        active = step.active
        return self._imbalance(step.after, step.kick.load, active.contacts, active.force)

    def _imbalance(self, state: State, load: Array, contacts: Contacts, force: Array) -> Array:
        """Return the larger of force, and of moment over the smallest width, over the weight (nb,) [-]."""
        model = self._whole
        resultant = load + self._wrench + _resultants(state, contacts, force)
        parts = (
            np.linalg.norm(resultant[:, :3], axis=1),
            np.linalg.norm(resultant[:, 3:], axis=1) / model.surfaces.size,
        )
        out: Array = np.maximum(*parts) / (model.mass * _gravity(model, state.time))
        return out


def _resultants(state: State, contacts: Contacts, force: Array) -> Array:
    """Return forces and moments (nb, 6) about the centres of mass that contacts exert on their bodies [N], [N m]."""
    # sleepers are rigid, and rigid stones meet half-way between their material points
    point, bodies, count = material_points(contacts, state).mean(axis=1), contacts.bodies, len(state.centre)
    total = wrenches(state, bodies[:, 0], point, force, count)
    total -= wrenches(state, bodies[:, 1], point, force, count)
    return total


def _pace(model: Model, state: State) -> float:
    """Return the speed below which a stone is at rest: `sleep` as a part of gravity, over one step [m/s]."""
    settings = model.scene.time
    return settings.sleep * _gravity(model, state.time) * settings.step


def _gravity(model: Model, time: float) -> float:
    """Return g, or 1 m/s² without gravity."""
    return float(np.linalg.norm(model.gravity(time))) or 1.0
