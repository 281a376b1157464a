"""A law of its own is one class: springs behind another class behave as those of an elastic joint."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.law import Approach, Joint, Terms
from mechanics.scene.laws.table import law_table

INNER = ElasticJoint(0.6, 1e9, 5e8, damping_time=1e-3, compressive_strength=2e6)


@dataclass(frozen=True)
class Wrapped(Joint):
    """An elastic joint behind another class."""

    friction: float = 0.6

    @property
    def sprung(self) -> bool:
        return True

    @property
    def crushes(self) -> bool:
        return True

    @property
    def damping_time(self) -> float:
        return INNER.damping_time

    def crushing(self, contacts: Approach, impulse: Array | None = None) -> Array:
        return INNER.crushing(contacts, impulse)

    def terms(self, contacts: Approach) -> Terms:
        return INNER.terms(contacts)

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        return INNER.after(contacts, impulse, velocity)


@dataclass(frozen=True)
class Plain(Joint):
    """A law that says only what every law says."""

    friction: float = 0.4

    def terms(self, contacts: Approach) -> Terms:
        return DryJoint(0.4).terms(contacts)

    def after(self, contacts: Approach, impulse: Array, velocity: Array) -> Array:
        return contacts.state


def test_a_table_asks_a_law_and_not_its_class():
    sides = np.zeros(2, dtype=bool), np.ones(2, dtype=bool)
    for law in (INNER, Wrapped()):
        table = law_table(DryJoint(0.5), [(*sides, law)], 2)
        assert table.sprung
        assert table.crushes
    table = law_table(Plain(), [], 2)
    assert not table.sprung
    assert not table.crushes
    assert table.makes_bonds(np.zeros(3, dtype=np.int64)).tolist() == [False] * 3
    assert Plain().without_bond(False) == Plain()
    assert Plain().softening == np.inf
