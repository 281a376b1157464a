"""One solved step, as observers see it."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import Contacts, gaps, joined, take
from mechanics.delassus.assembly import world_impulse
from mechanics.dynamics.contact_problem import terms_of, unshifted
from mechanics.dynamics.contact_search import Detection
from mechanics.dynamics.stepping import Kick
from mechanics.problem.problem import ContactProblem, ContactSolution
from mechanics.scene.laws.law import Terms
from mechanics.scene.state import State

__all__ = ["ContactForces", "Step"]


@dataclass(frozen=True)
class ContactForces:
    """Contact points of one step with their forces.

    Attributes
    ----------
    contacts : the contact points
    terms : their laws, as shift and cone
    place : (nc, 3) in the axes of one of the two bodies [m]
    impulse : (nc, 3) r, local frame [N s]
    shifted : (nc, 3) r̃, exact at the limits of its cone, so that it tells open and sliding contacts [N s]
    dual : (nc, 3) û, as the solver left it [m/s]
    force : (nc, 3) mean forces r/h on the candidates, world axes [N]
    gap : (nc,) at the end of the step [m]
    internal : (nc, STATE) internal variables of the laws
    """

    contacts: Contacts
    terms: Terms
    place: Array
    impulse: Array
    shifted: Array
    dual: Array
    force: Array
    gap: Array
    internal: Array

    def take(self, rows: Ints) -> "ContactForces":
        """Return some of them, in the order of `rows` (n,)."""
        terms = Terms(*(values[rows] for values in _arrays(self.terms)))
        return ContactForces(take(self.contacts, rows), terms, *(values[rows] for values in _arrays(self)))

    def joined(self, other: "ContactForces") -> "ContactForces":
        """Return these followed by others."""
        return ContactForces(
            joined([self.contacts, other.contacts]),
            Terms(*map(np.concatenate, zip(_arrays(self.terms), _arrays(other.terms), strict=True))),
            *map(np.concatenate, zip(_arrays(self), _arrays(other), strict=True)),
        )


def _arrays(record: ContactForces | Terms) -> list[Array]:
    """Return the fields of a record that are arrays."""
    values = (getattr(record, field.name) for field in fields(record))
    return [value for value in values if isinstance(value, np.ndarray)]


@dataclass(frozen=True)
class Step:
    """One solved step.

    Attributes
    ----------
    duration : h [s]
    before, after : the states between which it lies; relaxation and sleep halt bodies after `after`
    predicted : at the instant of the kick, with the velocities just before it
    kick : velocities just after it
    found : contacts of the awake bodies where they were found, with W
    problem, solution : their contact problem and its solution, in impulses r̃ that are shifted where a law has adhesion
    relative : (nc, 3) u of these contacts just after the kick, local frame [m/s]
    remembered : (nc, STATE) internal variables that their laws left
    asleep : contacts between sleeping bodies; None if there are none
    resting : (nb, 6) forces and moments of these on their bodies; None if there are none [N], [N m]
    relaxed : kinetic energy that relaxation, or sleep, removed at the end of the step [J]
    """

    duration: float
    before: State
    after: State
    predicted: State
    kick: Kick
    found: Detection
    problem: ContactProblem
    solution: ContactSolution
    relative: Array
    remembered: Array
    asleep: ContactForces | None
    resting: Array | None
    relaxed: float = 0.0

    @cached_property
    def active(self) -> ContactForces:
        """Contact points of the awake bodies, those of the problem, with their forces."""
        contacts, problem, solution = self.found.contacts, self.problem, self.solution
        impulse = unshifted(problem, solution.impulse)
        return ContactForces(
            contacts=contacts,
            terms=terms_of(problem),
            place=self.found.place,
            impulse=impulse,
            shifted=solution.impulse,
            dual=solution.velocity,
            force=world_impulse(contacts, impulse) / self.duration,
            gap=gaps(contacts, self.after),
            internal=self.remembered,
        )

    @cached_property
    def _all(self) -> ContactForces:
        return self.active if self.asleep is None else self.active.joined(self.asleep)

    @property
    def contacts(self) -> Contacts:
        """All contact points."""
        return self._all.contacts

    @property
    def impulse(self) -> Array:
        """r (nc, 3) of all contacts, local frame [N s]."""
        return self._all.impulse

    @property
    def shifted(self) -> Array:
        """r̃ (nc, 3) of all contacts, shifted where a law has adhesion [N s]."""
        return self._all.shifted

    @property
    def force(self) -> Array:
        """Mean forces r/h (nc, 3) of all contacts on the candidates, world axes [N]."""
        return self._all.force

    @property
    def gap(self) -> Array:
        """(nc,) of all contacts at the end of the step [m]."""
        return self._all.gap

    @property
    def terms(self) -> Terms:
        """The laws of all contacts, as shift and cone."""
        return self._all.terms

    @property
    def internal(self) -> Array:
        """Internal variables of the laws of all contacts (nc, STATE)."""
        return self._all.internal
