"""From contacts and their laws to the contact problem of one step: a shift, a cone, and W."""

from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import Contacts
from mechanics.delassus.assembly import local_velocity
from mechanics.delassus.mixed import MixedDelassus
from mechanics.delassus.rigid import RigidDelassus
from mechanics.dynamics.stepping import Kick
from mechanics.model.model import Model
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.scene.laws.law import Approach, Terms
from mechanics.scene.state import State
from mechanics.stones.validation import SMALLEST

__all__ = ["Statement", "state_laws"]


# a law that does not act in a step has an infinite bias; solvers get this many times the fastest free velocity
_NEVER = 1e3


@dataclass(frozen=True)
class Statement:
    """The contact problem of one step, and what its laws were told.

    Attributes
    ----------
    problem : for the solver; its impulses are r̃ = r + s n
    law : (nc,) index of the law of each contact
    approach, terms : question to the laws, and their answer
    """

    problem: ContactProblem
    law: Ints
    approach: Approach
    terms: Terms

    def started(self, start: ContactStart) -> ContactStart:
        """A warm start in r̃, from one in r."""
        return ContactStart(self._shifted(start.impulse, 1.0), start.velocity)

    def real(self, impulse: Array) -> Array:
        """r (nc, 3), from the solver's r̃ [N s]."""
        return self._shifted(impulse, -1.0)

    def _shifted(self, impulse: Array, sign: float) -> Array:
        if not self.terms.adhesion.any():
            return impulse
        shifted = impulse.copy()
        shifted[:, 0] += sign * self.terms.adhesion
        return shifted


def state_laws(
    model: Model,
    predicted: State,
    contacts: Contacts,
    gap: Array,
    law: Ints,
    operator: RigidDelassus | MixedDelassus,
    free: Kick,
    memory: Array,
    first: bool,
) -> Statement:
    """Ask every law, and state the problem u = W r̃ + (u_free - W s n)."""
    time = model.scene.time
    approach = Approach(
        gap=gap,
        speed=local_velocity(contacts, operator, predicted.velocity, predicted.node_velocity)[:, 0],
        area=contacts.area,
        size=model.surfaces.size[contacts.bodies].min(axis=1),
        yielding=operator.diagonal[:, 0, 0],
        step=time.step,
        theta=time.theta,
        push_out=time.relaxation,
        first=first,
        state=memory,
    )
    terms = model.laws.terms(law, approach)
    u_free = local_velocity(contacts, operator, free.velocity, free.node_velocity)
    if terms.adhesion.any():
        pull = np.zeros_like(u_free)
        pull[:, 0] = terms.adhesion
        u_free = u_free - operator.apply(pull)
    open_ = ~np.isfinite(terms.bias)
    if open_.any():
        never = _NEVER * (float(np.abs(u_free).max()) + 1e-300)
        terms = replace(terms, bias=np.where(open_, never, terms.bias))
    if max(float(np.abs(one).max(initial=0.0)) for one in (u_free, terms.bias)) < SMALLEST:
        # what is left of a motion that has died out, and could not be squared
        u_free, terms = np.zeros_like(u_free), replace(terms, bias=np.zeros_like(terms.bias))
    problem = ContactProblem(operator, u_free, terms.bias, terms.friction, terms.cohesion, terms.adhesion)
    return Statement(problem, law, approach, terms)
