"""Contact points together with what they bear."""

from dataclasses import dataclass, fields

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.contact.contacts import Contacts, joined, take
from mechanics.scene.laws.law import Terms

__all__ = ["Bearing", "both"]


@dataclass(frozen=True)
class Bearing:
    """Contact points of one step and what they bear.

    Attributes
    ----------
    contacts : the contact points
    law : (nc,) index of the law of each
    place : (nc, 3) in the axes of one of the two bodies [m]
    impulse : (nc, 3) r, local frame [N s]
    shifted : (nc, 3) r̃, by which an open or sliding contact is told: exact at the limits of its cone [N s]
    dual : (nc, 3) û, as the solver left it [m/s]
    force : (nc, 3) mean forces r/h on the candidates, world axes [N]
    gap : (nc,) at the end of the step [m]
    terms : their laws, as shift and cone
    internal : (nc, STATE) what the laws remember of each
    """

    contacts: Contacts
    law: Ints
    place: Array
    impulse: Array
    shifted: Array
    dual: Array
    force: Array
    gap: Array
    terms: Terms
    internal: Array

    def take(self, rows: Ints) -> "Bearing":
        """Some of them, in the order of `rows` (n,)."""
        terms = self.terms
        return Bearing(
            take(self.contacts, rows),
            self.law[rows],
            self.place[rows],
            self.impulse[rows],
            self.shifted[rows],
            self.dual[rows],
            self.force[rows],
            self.gap[rows],
            Terms(terms.bias[rows], terms.friction[rows], terms.cohesion[rows], terms.adhesion[rows]),
            self.internal[rows],
        )


def both(one: Bearing, other: Bearing) -> Bearing:
    """The contact points of both, those of the first before those of the other."""
    terms = one.terms, other.terms
    return Bearing(
        joined([one.contacts, other.contacts]),
        np.concatenate([one.law, other.law]),
        np.concatenate([one.place, other.place]),
        np.concatenate([one.impulse, other.impulse]),
        np.concatenate([one.shifted, other.shifted]),
        np.concatenate([one.dual, other.dual]),
        np.concatenate([one.force, other.force]),
        np.concatenate([one.gap, other.gap]),
        Terms(*(np.concatenate([getattr(own, name.name) for own in terms]) for name in fields(Terms))),
        np.concatenate([one.internal, other.internal]),
    )
