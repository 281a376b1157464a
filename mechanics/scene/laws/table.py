"""Table of the laws between bodies, and all laws of a step as one shift and cone."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import Approach, Law, Springs, Terms
from mechanics.scene.laws.mortar import MortarJoint

__all__ = ["LawTable", "law_table"]

_PER_CONTACT = ("gap", "speed", "slide", "area", "size", "compliance", "state", "pair", "first")
_NUMBERS = ("bias", "friction", "cohesion", "adhesion")


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

    @property
    def sprung(self) -> bool:
        """True where a law has springs, so that joints yield."""
        return any(isinstance(law, ElasticJoint) for law in self.laws)

    def makes_bonds(self, law: Ints) -> Bools:
        """Return the contacts (n,) whose law bonds stones that meet at the start."""
        bonds = [
            one.bonded if isinstance(one, ElasticJoint) else isinstance(one, MortarJoint | CohesiveZone)
            for one in self.laws
        ]
        return np.array(bonds)[law]

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
        values = {name: np.zeros(len(law)) for name in _NUMBERS}
        springs = Springs(np.zeros((len(law), 3)), np.zeros((len(law), 2))) if self.sprung else None
        for index, rows in _groups(law):
            part = self.laws[index].terms(_some(contacts, rows))
            for name, value in values.items():
                value[rows] = getattr(part, name)
            if springs is not None and part.springs is not None:
                springs.compliance[rows], springs.shift[rows] = part.springs.compliance, part.springs.shift
        return Terms(**values, springs=springs)

    def after(self, law: Ints, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        """Return new internal variables (nc, STATE) of all contacts."""
        if len(self.laws) == 1:
            return self.laws[0].after(contacts, impulse, velocity)
        state = contacts.state.copy()
        for index, rows in _groups(law):
            state[rows] = self.laws[index].after(_some(contacts, rows), impulse[rows], velocity[rows])
        return state


def law_table(general: Law, rules: Sequence[tuple[Bools, Bools, Law]], bodies: int) -> LawTable:
    """Return the table of a general law and of rules, each with the bodies (nb,) of its two groups.

    Rules that say what the general law says anyway are left out where all do.
    """
    rules = () if all(law == general for _, _, law in rules) else rules
    groups = np.array([[first, second] for first, second, _ in rules], dtype=bool).reshape(-1, 2, bodies)
    return LawTable((general, *(law for _, _, law in rules)), groups)


def _groups(law: Ints) -> Iterator[tuple[int, Ints]]:
    """Yield each law in use, and its contacts."""
    for index in np.flatnonzero(np.bincount(law)).tolist():
        yield index, np.flatnonzero(law == index)


def _some(contacts: Approach, rows: Ints) -> Approach:
    parts = {name: getattr(contacts, name)[rows] for name in _PER_CONTACT}
    return Approach(
        **parts,
        step=contacts.step,
        theta=contacts.theta,
        push_out=contacts.push_out,
    )
