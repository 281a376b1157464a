"""Few tuned numbers in mechanics/solvers: a new one takes the place of another, or raises the bound with a reason."""

import pytest

from tests.mechanics.solvers.numbers import changed, numbers

# the 59th: contacts up to twice as fast as the errors of a motion may be at rest; the 60th: iterations of forces from
# nothing, which decide whether a structure stands
MOST = 60


def test_there_are_no_more_numbers_than_today():
    assert len(numbers()) <= MOST


def test_numbers_of_tuples_stages_and_defaults_are_found():
    found = {(one.name, one.value) for one in numbers()}
    assert {("_LOOSEST", 0.025), ("JOINTS", 1e-4), ("Stage.iterations", 50), ("ROUNDING", 1e-9)} <= found


@pytest.mark.parametrize(
    ("value", "half", "twice"), [(3, 2, 6), (0.1, 0.05, 0.2), (0.98, 0.96, 0.99), (1, 1, 2)]
)
def test_half_and_twice_of_a_number(value, half, twice):
    assert (changed(value, 0.5), changed(value, 2.0)) == pytest.approx((half, twice))
