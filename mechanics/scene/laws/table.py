"""Table of the laws between bodies, and all laws of a step as one shift and cone."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.scene.laws.law import Approach, Law, Terms

__all__ = ["LawTable", "law_table"]

_PER_CONTACT = ("gap", "speed", "area", "size", "compliance", "state")


@dataclass(frozen=True)
class LawTable:
    """Laws of a scene.

    Attributes
    ----------
    laws : the general law, then that of each rule
    groups : (rules, 2, nb) the bodies of the two groups of each rule
    """

    laws: tuple[Law, ...]
    groups: Bools

    def of(self, bodies: Ints) -> Ints:
        """Return the index of the law of each contact between bodies (nc, 2); of two rules, the later holds."""
        law = np.zeros(len(bodies), dtype=np.int64)
        one, other = bodies[:, 0], bodies[:, 1]
        for rule, (first, second) in enumerate(self.groups):
            law[(first[one] & second[other]) | (first[other] & second[one])] = rule + 1
        return law

    def terms(self, law: Ints, contacts: Approach) -> Terms:
        """State all contacts by their own laws."""
        if len(self.laws) == 1:
            return self.laws[0].terms(contacts)
        values = {one.name: np.zeros(len(law)) for one in fields(Terms)}
        for index in np.unique(law):
            rows = law == index
            part = self.laws[index].terms(_some(contacts, rows))
            for name, value in values.items():
                value[rows] = getattr(part, name)
        return Terms(**values)

    def after(self, law: Ints, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return new internal variables (nc, STATE) of all contacts."""
        if len(self.laws) == 1:
            return self.laws[0].after(contacts, impulse, velocity)
        state = contacts.state.copy()
        for index in np.unique(law):
            rows = law == index
            state[rows] = self.laws[index].after(_some(contacts, rows), impulse[rows], velocity[rows])
        return state


def law_table(general: Law, rules: Sequence[tuple[Bools, Bools, Law]], bodies: int) -> LawTable:
    """Return the table of a general law and of rules, each with the bodies (nb,) of its two groups."""
    groups = np.array([[first, second] for first, second, _ in rules], dtype=bool).reshape(-1, 2, bodies)
    return LawTable((general, *(law for _, _, law in rules)), groups)


def _some(contacts: Approach, rows: Bools) -> Approach:
    parts = {name: getattr(contacts, name)[rows] for name in _PER_CONTACT}
    return Approach(
        **parts,
        step=contacts.step,
        theta=contacts.theta,
        push_out=contacts.push_out,
        first=contacts.first,
    )
