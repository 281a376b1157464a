"""Contacts of a configuration with their Delassus operator, made again once bodies have moved."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import Contacts, take
from mechanics.contact.detection import Detector
from mechanics.contact.shared_area import Recess, recess_at
from mechanics.delassus.assembly import mixed_delassus, rigid_delassus
from mechanics.delassus.mixed import MixedDelassus
from mechanics.delassus.rigid import RigidDelassus, in_order, schedule
from mechanics.dynamics.observers.equilibrium import displacement, speed
from mechanics.dynamics.progress import Clock
from mechanics.model.deformable import Compliance
from mechanics.model.model import Model
from mechanics.scene.state import State

# displacements since the last detection, over the smallest width, from which contacts are detected again [-]:
_MOVED_RIGID = 1e-6  # rigid stones: at rest nothing changes, in motion W is that of the very instant
# the same where the motion may be wrong by much more in each step: over the speed of such an error, over the one that
# gravity gives in a step, and over its square, where directions of contacts need not be better than forces by far
_PER_SPEED, _MOVED_LOOSE = 2.5e-4, 4e-5
_PER_SQUARE, _MOVED_ROUGH = 1e-3, 2e-3
_MOVED = 1e-3  # deformable stones, whose Delassus operator is expensive
_MOVED_SETTLED = 1e-6  # deformable stones that come to rest, so that the last detection does not lag behind
_SLOWED = 1e-2  # they come to rest where one step moves them by less than this part of that displacement [-]


@dataclass(frozen=True)
class Detection:
    """Contact points where they were detected, with their Delassus operator.

    Attributes
    ----------
    model : the bodies that impulses move there
    configuration : the state
    contacts : the contact points, in the order of the operator
    place : (nc, 3) in the axes of one of the two bodies, the same whichever is the candidate [m]
    law : (nc,) index of the law of each
    operator : W
    recess : (nc,) depth below which a contact acts, of pairs of stones that touch without a common area [m]
    """

    model: Model
    configuration: State
    contacts: Contacts
    place: Array
    law: Ints
    operator: RigidDelassus | MixedDelassus
    recess: Array


def detector(model: Model, bed: float = 0.0) -> Detector:
    """Return the contact detector of a scene; gaps up to `bed` are watched, whatever the size of the stones [m]."""
    settings = model.scene.contact
    return Detector(
        model.surfaces,
        model.fixed,
        settings.alert_distance,
        settings.points,
        settings.placement,
        max(bed, *(law.reach for law in model.laws.laws)),
        model.scene.solver.threads,
        settings.spacing,
    )


def contacts_as_drawn(model: Model, state: State) -> Contacts:
    """Return the contacts of stones where they are drawn; those that touch without a common area have none."""
    find = detector(model)
    contacts = find(state, np.zeros(len(model.mass)))
    return take(contacts, np.flatnonzero(recess_at(find, state).of(contacts) == 0.0))


def detection(
    model: Model,
    state: State,
    contacts: Contacts,
    compliance: Sequence[Compliance],
    elastic_scale: bool = False,
    recess: Recess | None = None,
) -> Detection:
    """Return the contacts of a state with their places, laws and W, in the order of a schedule if rigid bodies move."""
    if model.rigid_only or model.inertia.moving.any():
        plan = schedule(contacts.bodies, model.inertia.moving | (model.elastic & ~model.fixed))
        contacts = take(contacts, plan.order)
    else:
        plan = in_order(len(contacts))
    operator: RigidDelassus | MixedDelassus
    if model.rigid_only:
        operator = rigid_delassus(model, state, contacts, plan)
    else:
        operator = mixed_delassus(model, state, contacts, compliance, plan, elastic_scale)
    side = contacts.bodies.argmin(axis=1)
    place = contacts.arm[np.arange(len(side)), side]
    depth = np.zeros(len(side)) if recess is None else recess.of(contacts)
    return Detection(model, state, contacts, place, model.laws.of(contacts.bodies), operator, depth)


class ContactSearch:
    """Contact detection that keeps the last result while nothing has moved.

    Parameters
    ----------
    model : the scene
    start : where it begins
    compliance : ŵ of every group of equal elastic stones
    clock : takes the time of each stage
    every_step : detect whenever asked
    elastic_scale : as `mixed_delassus` takes it
    bed : as `detector` takes it

    Attributes
    ----------
    recess : of pairs of stones that have touched without a common area since the start
    """

    def __init__(
        self,
        model: Model,
        start: State,
        compliance: Sequence[Compliance],
        clock: Clock,
        every_step: bool = False,
        elastic_scale: bool = False,
        bed: float = 0.0,
    ) -> None:
        self._detector, self._compliance, self._clock = detector(model, bed), compliance, clock
        self._every_step, self._elastic_scale = every_step, elastic_scale
        self._last: Detection | None = None
        with clock("detect"):
            self.recess = recess_at(self._detector, start)

    def __call__(self, model: Model, predicted: State) -> Detection:
        """Return the contacts at a predicted configuration; `model` has sleeping bodies as fixed ones."""
        if self._last is None or self._is_stale(self._last, model, predicted):
            self._last = self._detection(model, predicted)
        return self._last

    def configuration(self, model: Model) -> State | None:
        """Return the configuration of the last detection; None if another one will follow in any case."""
        last = self._last
        return None if last is None or last.model is not model else last.configuration

    def repeat(self, model: Model, configuration: State | None, recess: Recess) -> None:
        """Detect again where another run of the same scene last did, None: nowhere, with the recess that it had."""
        self.recess = recess
        self._last = None if configuration is None else self._detection(model, configuration)

    def _detection(self, model: Model, predicted: State) -> Detection:
        with self._clock("detect"):
            reach = model.scene.time.step * speed(model, predicted)
            contacts = replace(self._detector, fixed=model.fixed)(predicted, reach)
            self.recess = self.recess.after(contacts, predicted, model.surfaces.size)
            contacts = take(contacts, self.recess.acting(contacts, predicted, reach))
        with self._clock("assemble"):
            return detection(model, predicted, contacts, self._compliance, self._elastic_scale, self.recess)

    def continued(self, model: Model, compliance: Sequence[Compliance]) -> "ContactSearch":
        """Return the search for other settings of time; it knows the last result where ŵ is still the same."""
        copied = copy(self)
        copied._compliance = compliance
        if self._last is not None:
            copied._last = replace(self._last, model=model) if compliance is self._compliance else None
        return copied

    def follow(self, earlier: "ContactSearch", model: Model) -> None:
        """Know the last result of another search of the same rigid bodies, with steps as long.

        Slivers of contacts may be found or not after movements of rounding alone, and with them their forces are lost.
        """
        self.recess = earlier.recess
        if earlier._last is not None:
            self._last = replace(earlier._last, model=model)

    def _is_stale(self, last: Detection, model: Model, predicted: State) -> bool:
        if self._every_step or last.model is not model:
            return True
        width = float(model.surfaces.size.min())
        moved = float(displacement(model, last.configuration, predicted).max()) / width
        if model.rigid_only:
            return moved > _rigid_limit(model)
        pace = model.scene.time.step * float(speed(model, predicted).max()) / width
        return moved > _MOVED or (moved > _MOVED_SETTLED and pace < _SLOWED * moved)


def _rigid_limit(model: Model) -> float:
    """Return the displacement over the smallest width from which contacts of rigid stones are detected again [-].

    Where a motion may be wrong by some distance in the end, errors of the solver move resting stones a little in each
    step; the directions of their contacts need not be better than their forces.
    """
    time, error = model.scene.time, model.scene.solver.motion_error
    fall = float(np.linalg.norm(model.scene.gravity)) * time.step * time.duration
    if error is None or time.relaxation or fall == 0.0:
        return _MOVED_RIGID
    slack = error / fall
    loose = min(_PER_SPEED * slack, _MOVED_LOOSE)
    return max(_MOVED_RIGID, loose, min(_PER_SQUARE * slack**2, _MOVED_ROUGH))
