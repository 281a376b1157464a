"""Contact problems that cannot be solved are refused where they are stated, in words that name the contact."""

from dataclasses import replace

import numpy as np
import pytest

from ground.errors import SolverError
from mechanics.problem.problem import ContactProblem
from mechanics.stones.validation import LARGEST, SMALLEST
from tests.mechanics.dense_operator import blocks_apart


def problem(count=3, w=1.0, **given):
    """Contacts that do not feel each other, W = w."""
    each = {"bias": np.zeros(count), "friction": np.full(count, 0.5), "cohesion": np.zeros(count)} | given
    return ContactProblem(
        blocks_apart(*[w * np.eye(3)] * count), np.tile([-1.0, 0.5, 0.0], (count, 1)), **each
    )


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["u_free", "bias", "friction", "cohesion", "adhesion"])
def test_what_is_no_number_is_refused_with_its_contact(name, value):
    sound = replace(problem(), adhesion=np.zeros(3))
    bad = getattr(sound, name).copy()
    bad[1] = value
    with pytest.raises(SolverError, match=f"{name} of contact 1 is {value}"):
        replace(sound, **{name: bad})


@pytest.mark.parametrize("name", ["friction", "cohesion", "adhesion"])
def test_negative_parameters_are_refused(name):
    with pytest.raises(SolverError, match=f"{name} of contact 2 is -0.1; give 0 or more"):
        replace(problem(), **{name: np.array([0.0, 0.0, -0.1])})


def test_shapes_that_do_not_fit_are_refused():
    with pytest.raises(SolverError, match=r"friction has shape \(2,\).*one row for each contact"):
        problem(friction=np.zeros(2))
    with pytest.raises(SolverError, match="W has blocks"):
        replace(problem(), u_free=np.zeros((3, 2)))


def test_contacts_that_do_not_give_way_are_refused():
    class Dead:
        diagonal = np.array([np.eye(3), np.diag([1.0, 0.0, 1.0]), np.eye(3)])

    with pytest.raises(SolverError, match="contact 1 does not give way along axis 1"):
        replace(problem(), delassus=Dead())


@pytest.mark.parametrize("factor", [10 * LARGEST, SMALLEST / 10])
def test_numbers_that_cannot_be_squared_are_refused(factor):
    with pytest.raises(SolverError, match="units"):
        replace(problem(), u_free=factor * problem().u_free)
    with pytest.raises(SolverError, match="units"):
        problem(w=factor)


def test_none_of_this_is_refused():
    """No contact, no velocity, a bond without friction, numbers as large and as small as they may be."""
    assert len(problem(0).u_free) == 0
    replace(problem(), u_free=np.zeros((3, 3)))
    problem(friction=np.zeros(3), cohesion=np.ones(3))
    for factor in (0.1 * LARGEST, 10 * SMALLEST):
        replace(problem(w=factor), u_free=factor * problem().u_free)
