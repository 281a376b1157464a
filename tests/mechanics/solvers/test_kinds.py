"""Kinds of contact problem: each has its own chain, which solves it from nothing as an independent method does."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

from mechanics.planar.delassus import PlanarDelassus
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import residual
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings
from mechanics.solvers.auto import Auto
from mechanics.solvers.chain import Begin
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.kinds import FURTHER, chain_of
from tests.mechanics.dense_operator import products_alone
from tests.mechanics.planar.shapes import random_problem
from tests.mechanics.shapes import posed
from tests.mechanics.solvers.problems import (
    BACK,
    FORWARD,
    RIGID,
    SOFT,
    by_path,
    cold,
    few_deformable,
    leaning,
    stack,
    velocity_of,
    yielding,
)

EXACT = 1e-9, 1e-8


def disks(count):
    """Bodies of the plane with levers of all kinds, and friction."""
    bodies, normal, lever, inertia = random_problem(3, 12, count)
    rng = np.random.default_rng(3)
    free, mu = rng.normal(size=(count, 2)), rng.uniform(0.0, 0.8, count)
    none = np.zeros(count)
    return ContactProblem(PlanarDelassus(bodies, normal, lever, inertia), free, none, mu, none)


def wall(count, courses):
    return posed(leaning(0.3, count, courses), step=5e-3).problem


def blocks(*fidelities, **more):
    return posed(stack(*fidelities, below=FORWARD, above=BACK, **more)).problem


@dataclass(frozen=True)
class Kind:
    """A problem, the first link of its chain, links that may solve it from nothing, and an independent method."""

    problem: object
    first: str
    solved: tuple[str, ...]
    other: object = by_path


# Newton's method goes first between stones that deform, but from near alone; a path may need it at its end
ENDED = "interior point", "Newton"
KINDS = {
    "few rigid": Kind(lambda: wall(4, 4), "Newton", ("Newton from soft joints",)),
    "some hundred rigid": Kind(lambda: wall(18, 18), "body ADMM", ("body ADMM",)),
    "few on springs": Kind(lambda: yielding(wall(4, 4), 1e-2), "Newton", ("Newton",)),
    "some hundred on springs": Kind(lambda: yielding(wall(18, 18), 1e-2), "body ADMM", ("body ADMM",)),
    "deformable": Kind(lambda: blocks(SOFT, SOFT), "Newton", ENDED, NSGS(*EXACT, 100_000)),
    "few deformable among rigid": Kind(few_deformable, "interior point", ENDED),
    "few deformable, joints yield": Kind(
        lambda: yielding(few_deformable(), 1e-3), "Newton", "Newton"
    ),
    "disks": Kind(lambda: disks(30), "sweeps", ("sweeps", "ADMM of disks", "Newton"), NSGS(*EXACT, 100_000)),
    "known by products alone": Kind(
        lambda: products_alone(blocks(RIGID, RIGID)), "sweeps", ("sweeps",), NSGS(*EXACT, 5000, depth=0)
    ),
}  # fmt: skip
EVERY = pytest.mark.parametrize("name", KINDS)


@cache
def problem_of(name):
    return KINDS[name].problem()


@cache
def solved(name):
    problem = problem_of(name)
    return Auto(max_iterations=20_000)(problem, cold(problem))


@EVERY
def test_every_kind_is_solved_from_nothing_by_the_method_that_suits_it(name):
    problem, found = problem_of(name), solved(name)
    left = residual(problem, found.impulse)
    assert left.within(1e-6, 1e-5)
    assert found.converged
    assert found.natural_map == pytest.approx(left.natural_map, rel=1e-9)
    assert found.why.split(":")[0] in KINDS[name].solved
    assert chain_of(problem, False, False, 1e-5)[0].name == KINDS[name].first


@EVERY
def test_every_kind_moves_as_an_independent_method_finds(name):
    """Whichever link wins: the velocities are those of another method."""
    problem = problem_of(name)
    found, other = solved(name), KINDS[name].other(problem, cold(problem))
    assert other.converged
    fastest = np.abs(problem.u_free).max()
    # between rigid stones friction leaves some freedom to what slides a little
    close = 1e-3 if "rigid" in name or "yield" in name else 1e-4
    np.testing.assert_allclose(velocity_of(problem, found), velocity_of(problem, other), atol=close * fastest)


@EVERY
def test_a_solution_costs_nothing(name):
    """As far as forces are kept: of rigid stones, to a share of the tolerance that a processor's rounding may miss."""
    problem, usual = problem_of(name), Auto()
    limits = FURTHER * usual.tolerance, FURTHER * usual.velocity_tolerance
    found = Auto(*limits, 20_000)(problem, cold(problem))
    assert found.converged
    again = usual(problem, ContactStart(found.impulse, found.velocity))
    assert again.iterations == 0
    assert again.why == "forces of the last step"
    np.testing.assert_array_equal(again.impulse, found.impulse)


@pytest.mark.parametrize("most", [1, 5, 30])
@EVERY
def test_iterations_of_all_methods_together_are_at_most_those_allowed(name, most):
    problem = problem_of(name)
    found = Auto(1e-300, 1e-300, most)(problem, cold(problem))
    assert not found.converged
    assert found.iterations <= most
    assert found.natural_map == pytest.approx(residual(problem, found.impulse).natural_map, rel=1e-9)


@pytest.mark.parametrize("name", ["few deformable, joints yield", "deformable"])
def test_what_is_nearly_a_solution_takes_fewer_factorisations(name):
    problem, found = problem_of(name), solved(name)
    rng = np.random.default_rng(1)
    near = found.impulse * (1.0 + 1e-4 * rng.normal(size=found.impulse.shape))
    answer = Auto()(problem, ContactStart(near, np.zeros_like(near)))
    assert answer.converged
    assert 1 <= answer.iterations <= 2 * found.iterations / 3


def test_a_motion_of_rigid_bodies_is_followed_from_extrapolated_forces():
    chain = chain_of(problem_of("some hundred rigid"), True, True, 1e-5)
    assert (chain[0].name, chain[0].begin) == ("body ADMM", Begin.AHEAD)
    # of few stones from known forces: ADMM would press stones against what they only touch
    chain = chain_of(problem_of("few rigid"), True, True, 1e-5)
    assert (chain[0].name, chain[0].begin) == ("Newton", Begin.AHEAD)


def test_mortar_is_no_kind_of_its_own():
    one = replace(
        stack(RIGID, RIGID, below=FORWARD), contact=ContactSettings(MortarJoint(0.4, 200.0, 1000.0))
    )
    problem = posed(one).problem
    assert Auto()(problem, cold(problem)).why.startswith("Newton from soft joints:")
