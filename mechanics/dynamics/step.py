"""One solved step, as observers see it."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import Contacts, gaps, joined, take
from mechanics.delassus.assembly import local_velocity, world_impulse
from mechanics.dynamics.contact_problem import spring_axes, terms_of, turned_springs, unshifted
from mechanics.dynamics.contact_search import Detection
from mechanics.dynamics.stepping import Kick
from mechanics.problem.problem import ContactProblem, ContactSolution
from mechanics.scene.laws.law import Approach, Terms
from mechanics.scene.state import State


@dataclass(frozen=True)
class ContactForces:
    """Contact points of one step with their forces.

    Attributes
    ----------
    contacts : the contact points
    terms : their laws, as shift and cone
    place : (nc, 3) in the axes of one of the two bodies [m]
    impulse : (nc, 3) r, local frame [N s]
    shifted : (nc, 3) r̃, exact at the limits of its cone, which identifies open and sliding contacts [N s]
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
        bias, friction, cohesion, adhesion = (values[rows] for values in _arrays(self.terms))
        terms = Terms(bias, friction, cohesion, adhesion)
        return ContactForces(take(self.contacts, rows), terms, *(values[rows] for values in _arrays(self)))

    def joined(self, following: "ContactForces") -> "ContactForces":
        """Return these followed by others."""
        bias, friction, cohesion, adhesion = map(
            np.concatenate, zip(_arrays(self.terms), _arrays(following.terms), strict=True)
        )
        return ContactForces(
            joined([self.contacts, following.contacts]),
            Terms(bias, friction, cohesion, adhesion),
            *map(np.concatenate, zip(_arrays(self), _arrays(following), strict=True)),
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
    before, predicted, after : states at the start, at the kick with the velocities just before it, and at the end;
        relaxation and sleep halt bodies after that
    kick : velocities just after it
    found : contacts of the awake bodies where they were found, with W
    approach : these contacts as their laws see them before the kick
    problem, solution : their contact problem and its solution, in impulses r̃ that are shifted where a law has adhesion
    asleep : contacts between sleeping bodies; None if there are none
    resting : (nb, 6) forces and moments of these on their bodies; None if there are none [N], [N m]
    relaxed : kinetic energy that relaxation, or sleep, removed at the end of the step [J]
    """

    before: State
    predicted: State
    after: State
    kick: Kick
    found: Detection
    approach: Approach
    problem: ContactProblem
    solution: ContactSolution
    asleep: ContactForces | None
    resting: Array | None
    relaxed: float = 0.0

    @property
    def duration(self) -> float:
        """h [s]."""
        return self.approach.step

    @cached_property
    def relative(self) -> Array:
        """u (nc, 3) of the contacts of the awake bodies just after the kick, local frame [m/s]."""
        detection, kick = self.found, self.kick
        return local_velocity(detection.contacts, detection.operator, kick.velocity, kick.node_velocity)

    @cached_property
    def active(self) -> ContactForces:
        """Contact points of the awake bodies, those of the problem, with their forces."""
        detection, problem, solution = self.found, self.problem, self.solution
        contacts, laws = detection.contacts, detection.model.laws
        impulse = unshifted(problem, solution.impulse)
        internal = laws.after(detection.law, self.approach, solution.impulse, self.relative)
        if laws.sprung:
            back = spring_axes(contacts, self.predicted).transpose(0, 2, 1)
            internal = turned_springs(internal, back)
        return ContactForces(
            contacts=contacts,
            terms=terms_of(problem),
            place=detection.place,
            impulse=impulse,
            shifted=solution.impulse,
            dual=solution.velocity,
            force=world_impulse(contacts, impulse) / self.duration,
            gap=gaps(contacts, self.after),
            internal=internal,
        )

    @property
    def gave_way(self) -> Array | None:
        """Compliance ε (nc, 3) of joints that no law asks for [1/kg]; None where the step was solved without."""
        return None if self.found.model.laws.sprung else self.problem.delassus.joint_compliance

    @cached_property
    def compression(self) -> Array:
        """ε h r_N = ε h² F (nc,), overlap by the compliance of joints that no law asks for [m]."""
        compliance = self.gave_way
        if compliance is None:
            return np.zeros(len(self.found.contacts))
        pressed: Array = np.maximum(self.active.impulse[:, 0], 0.0)
        return compliance[:, 0] * self.duration * pressed

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
