"""Stones at rest sleep: they are not moved, and what they bear among themselves is not computed again.

A sleeping stone has no velocity and bears the forces with which it fell asleep; its awake neighbours take it for held.
Forces that lie in their cones, with u = 0, solve the contact problem of a step as far as they balance the loads; so
what is left out is known: the force and moment by which a sleeping stone is out of balance. Where that exceeds the
scene's `sleep`, over the stone's weight, the stone is woken within the very step, with those around it, and the step is
solved anew. So no step ends with a sleeping stone that is further out of balance (docs/decisions/027-sleeping.md).
"""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.contact.contacts import Contacts, material_points
from mechanics.dynamics.contact_forces import Bearing, both
from mechanics.dynamics.observers.equilibrium import displacement, speed, wrenches
from mechanics.model.model import Model
from mechanics.scene.state import State

__all__ = ["RINGS", "Sleep", "held_model"]


# steps over which a stone must rest
_STEPS = 50
# a stone falls asleep only if it is so much nearer to balance than one that is woken
_CALMER = 0.5
# with a stone that wakes, so many rings of stones around it wake; twice as many each time that is not enough
RINGS = 2


@dataclass(frozen=True)
class Sleep:
    """Which stones sleep, and what they bear; with state and memory all that a run needs.

    Attributes
    ----------
    asleep : (nb,) which stones sleep
    borne : contact points between sleeping stones, or between these and fixed ones, as they fell asleep
    wrench : (nb, 6) sums of these forces, and of their moments about the centres of mass [N], [N m]
    watched : the state since when it is watched who rests
    steps : taken since then
    """

    asleep: Bools
    borne: Bearing | None
    wrench: Array
    watched: State
    steps: int = 0

    @classmethod
    def nobody(cls, state: State) -> "Sleep":
        """All are awake, and watched from this state on."""
        count = len(state.centre)
        return cls(np.zeros(count, dtype=bool), None, np.zeros((count, 6)), state)

    def restless(self, model: Model, state: State, load: Array, contacts: Contacts, force: Array) -> Bools:
        """Sleeping stones (nb,) that are further out of balance than the scene lets them be.

        `load` (nb, 6) are the loads, weight included; `contacts` those with stones that are awake, with their forces
        (nc, 3), world axes [N].
        """
        out = _out_of_balance(model, state, load + self.wrench + _resultants(state, contacts, force))
        found: Bools = self.asleep & ~(out <= model.scene.time.sleep)
        return found

    def around(self, bodies: Bools, rings: int) -> Bools:
        """Sleeping stones (nb,) among some bodies and, ring by ring, those that bear on them in their sleep."""
        reached = bodies & self.asleep
        pairs = np.zeros((0, 2), dtype=np.int64) if self.borne is None else self.borne.contacts.bodies
        for _ in range(rings):
            touched = reached[pairs].any(axis=1)
            reached[pairs[touched].ravel()] = True
            # nothing is passed on through supports
            reached &= self.asleep
        return reached

    def without(self, bodies: Bools, state: State) -> tuple["Sleep", Bearing | None]:
        """Wake some bodies (nb,); also what those bear that are watched again, for the memory."""
        asleep = self.asleep & ~bodies
        if self.borne is None:
            return replace(self, asleep=asleep), None
        rows = (self.asleep & bodies)[self.borne.contacts.bodies].any(axis=1)
        again, borne = self.borne.take(np.flatnonzero(rows)), self.borne.take(np.flatnonzero(~rows))
        return replace(
            self, asleep=asleep, borne=borne, wrench=_resultants(state, borne.contacts, borne.force)
        ), again

    def uneasy(self, model: Model, state: State, active: Bearing, load: Array) -> Bools:
        """Sleeping stones (nb,) that alone keep a scene from its equilibrium: looked for where nothing else moves.

        They are within `sleep`, but not within the tolerance to which a scene must be in balance to end.
        """
        nobody = np.zeros_like(self.asleep)
        if self.steps + 1 < _STEPS or not (model.scene.time.stop_at_equilibrium and self.asleep.any()):
            return nobody
        if (speed(model, state)[model.inertia.moving] > _pace(model, state)).any():
            return nobody
        out = _out_of_balance(
            model, state, load + self.wrench + _resultants(state, active.contacts, active.force)
        )
        found: Bools = self.asleep & (out > model.scene.time.balance_tolerance)
        return found

    def later(self, model: Model, state: State, active: Bearing, load: Array, held: bool) -> "Sleep":
        """After one more step: who has rested for long enough falls asleep, unless supports move (`held` false)."""
        if not held:
            return replace(self, watched=state, steps=0)
        if self.steps + 1 < _STEPS:
            return replace(self, steps=self.steps + 1)
        tired = self._tired(model, state, active, load)
        asleep = self.asleep | tired
        if not tired.any():
            return replace(self, watched=state, steps=0)
        lying = asleep | model.fixed
        rows = np.flatnonzero(lying[active.contacts.bodies].all(axis=1))
        new = active.take(rows)
        borne = new if self.borne is None else both(self.borne, new)
        return Sleep(asleep, borne, _resultants(state, borne.contacts, borne.force), state)

    def _tired(self, model: Model, state: State, active: Bearing, load: Array) -> Bools:
        """Who has not moved since it is watched, does not move now, and is in balance (nb,)."""
        settings, pace = model.scene.time, _pace(model, state)
        limit = settings.sleep
        if settings.stop_at_equilibrium:
            limit = min(limit, settings.balance_tolerance)
        out = _out_of_balance(
            model, state, load + self.wrench + _resultants(state, active.contacts, active.force)
        )
        return (
            model.inertia.moving
            & ~self.asleep
            & (out <= _CALMER * limit)
            & (speed(model, state) <= pace)
            & (displacement(model, self.watched, state) <= pace * settings.step * _STEPS)
        )


def held_model(model: Model, asleep: Bools) -> Model:
    """The model as it is for those awake: no impulse moves who sleeps."""
    inertia = model.inertia
    inverse_mass = np.where(asleep, 0.0, inertia.inverse_mass)
    inverse_inertia = np.where(asleep[:, None, None], 0.0, inertia.inverse_inertia)
    return replace(
        model, inertia=replace(inertia, inverse_mass=inverse_mass, inverse_inertia=inverse_inertia)
    )


def _resultants(state: State, contacts: Contacts, force: Array) -> Array:
    """Forces and moments (nb, 6) about the centres of mass that contacts exert on their bodies [N], [N m]."""
    points, bodies, count = material_points(contacts, state), contacts.bodies, len(state.centre)
    total = wrenches(state, bodies[:, 0], points[:, 0], force, count)
    total -= wrenches(state, bodies[:, 1], points[:, 1], force, count)
    return total


def _out_of_balance(model: Model, state: State, resultant: Array) -> Array:
    """Larger of force, and of moment over the smallest width, over the weight (nb,) [-]."""
    parts = (
        np.linalg.norm(resultant[:, :3], axis=1),
        np.linalg.norm(resultant[:, 3:], axis=1) / model.surfaces.size,
    )
    out: Array = np.maximum(*parts) / (model.mass * _gravity(model, state.time))
    return out


def _pace(model: Model, state: State) -> float:
    """Below which a stone is at rest: what `sleep` as a part of gravity gives in one step [m/s]."""
    settings = model.scene.time
    return settings.sleep * _gravity(model, state.time) * settings.step


def _gravity(model: Model, time: float) -> float:
    """g, or where there is none 1 m/s²."""
    return float(np.linalg.norm(model.gravity(time))) or 1.0
