"""Table of the laws between bodies, and all laws of a step as one shift and cone."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mechanics.arrays import Array, Bools, Ints
from mechanics.scene.laws.law import Approach, Law, Springs, Terms

_PER_CONTACT = ("gap", "speed", "slide", "area", "size", "compliance", "state", "pair", "first")
_IF_KNOWN = ("thickness", "crushing")
_NUMBERS = ("bias", "friction", "cohesion", "adhesion")


@dataclass(frozen=True)
class LawTable:
    """Laws of a scene.

    Attributes
    ----------
    laws : the general law, then that of each rule
    groups : (rules, 2, nb) the bodies of the two groups of each rule
    beds : thickness of mortar between two bodies, by their numbers, the lower first [m]
    """

    laws: tuple[Law, ...]
    groups: Bools
    beds: Mapping[tuple[int, int], float] = field(default_factory=dict)

    @property
    def sprung(self) -> bool:
        """True where a law has springs, so that joints yield."""
        return any(law.sprung for law in self.laws)

    @property
    def crushes(self) -> bool:
        """True where joints have a compressive strength."""
        return any(law.crushes for law in self.laws)

    def thickness(self, law: Ints, bodies: Ints) -> Array | None:
        """Return the thickness of mortar (nc,) between bodies (nc, 2), zero where no law needs it; None: anywhere [m].

        Not a number where it is needed, but not known.
        """
        by_thickness = [law if law.by_thickness else None for law in self.laws]
        if not any(by_thickness):
            return None
        otherwise = np.array(
            [0.0 if joint_law is None else joint_law.thickness or np.nan for joint_law in by_thickness]
        )[law]
        needed = np.array([one is not None for one in by_thickness])[law]
        if not self.beds:
            return otherwise
        pairs, wide = self._wide
        count = int(max(bodies.max(initial=0), pairs.max())) + 1
        stored, asked = pairs @ [count, 1], np.sort(bodies, axis=1) @ [count, 1]
        at = np.minimum(np.searchsorted(stored, asked), len(stored) - 1)
        return np.where(needed & (stored[at] == asked), wide[at], otherwise)

    @cached_property
    def _wide(self) -> tuple[Ints, Array]:
        """Pairs of bodies (n, 2) in order, and the thickness of the mortar between them (n,) [m]."""
        pairs = np.array(sorted(self.beds), dtype=np.int64)
        return pairs, np.array([self.beds[first, second] for first, second in pairs.tolist()])

    def crushing(self, law: Ints, contacts: Approach, impulse: Array | None = None) -> Bools:
        """Return the contacts (nc,) whose joints crush in a step with r̃, as `Law.crushing` does."""
        crushing = np.zeros(len(law), dtype=bool)
        for index, rows in _groups(law):
            part = None if impulse is None else impulse[rows]
            crushing[rows] = self.laws[index].crushing(_some(contacts, rows), part)
        return crushing

    def makes_bonds(self, law: Ints) -> Bools:
        """Return the contacts (n,) whose law bonds stones that meet at the start."""
        return np.array([law.bonded for law in self.laws])[law]

    def of(self, bodies: Ints) -> Ints:
        """Return the index of the law of each contact between bodies (nc, 2); of two rules, the later holds."""
        law = np.zeros(len(bodies), dtype=np.int64)
        candidate, antagonist = bodies[:, 0], bodies[:, 1]
        for rule, (first, second) in enumerate(self.groups):
            law[(first[candidate] & second[antagonist]) | (first[antagonist] & second[candidate])] = rule + 1
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


def law_table(
    general: Law,
    rules: Sequence[tuple[Bools, Bools, Law]],
    bodies: int,
    beds: Mapping[tuple[int, int], float] | None = None,
) -> LawTable:
    """Return the table of a general law and of rules, each with the bodies (nb,) of its two groups, and of beds.

    Rules that say what the general law says anyway are left out where all do.
    """
    rules = () if all(law == general for _, _, law in rules) else rules
    groups = np.array([[first, second] for first, second, _ in rules], dtype=bool).reshape(-1, 2, bodies)
    return LawTable((general, *(law for _, _, law in rules)), groups, dict(beds or {}))


def _groups(law: Ints) -> Iterator[tuple[int, Ints]]:
    """Yield each law in use, and its contacts."""
    for index in np.flatnonzero(np.bincount(law)).tolist():
        yield index, np.flatnonzero(law == index)


def _some(contacts: Approach, rows: Ints) -> Approach:
    parts = {name: getattr(contacts, name)[rows] for name in _PER_CONTACT}
    known = {name: getattr(contacts, name) for name in _IF_KNOWN}
    parts |= {name: None if value is None else value[rows] for name, value in known.items()}
    return Approach(
        **parts,
        step=contacts.step,
        theta=contacts.theta,
        push_out=contacts.push_out,
    )
