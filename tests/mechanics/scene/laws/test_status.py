"""The status of a contact in one word."""

import numpy as np

from mechanics.scene.laws.bonds import BROKEN
from mechanics.scene.laws.law import BOND, CRUSHED, STATE, Terms
from mechanics.scene.laws.status import STATUSES, contact_status


def test_each_contact_has_the_status_of_its_bond_and_its_impulse():
    bond = [0, 0, 0, 1.0, 0.3, BROKEN, BROKEN, BROKEN, 0]
    impulse = np.array(
        [
            [0, 0, 0],
            [2, 0.9, 0],
            [2, 0.6, 0.8],
            [0, 0, 0],
            [2, 1, 0],
            [0, 0, 0],
            [2, 0, 0],
            [2, 0, 1],
            [2, 0, 1],
        ]
    )
    state = np.zeros((9, STATE))
    state[:, BOND] = bond
    state[[0, 8], CRUSHED] = 1e-3
    terms = Terms(np.zeros(9), np.full(9, 0.5), np.zeros(9), np.zeros(9))
    found = contact_status(state, terms, impulse.astype(float))
    assert found.tolist() == ["open", "stick", "slip", "bonded", "bonded", "broken", "stick", "slip", "crush"]
    assert set(found.tolist()) == set(STATUSES)


def test_contacts_of_the_plane_have_two_components():
    terms = Terms(np.zeros(2), np.full(2, 0.5), np.zeros(2), np.zeros(2))
    impulse = np.array([[2.0, -1.0], [2.0, 0.5]])
    assert contact_status(np.zeros((2, STATE)), terms, impulse).tolist() == ["slip", "stick"]
