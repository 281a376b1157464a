"""The interior-point method on whole problems; the laws are checked at every contact, not only by η."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ground.errors import SolverError
from mechanics.delassus.assembly import mixed_delassus
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import natural_map, residual
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import ContactSettings
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.central_path import CentralPath
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.scaling import equilibrated
from tests.mechanics.dense_operator import DenseDelassus, products_alone
from tests.mechanics.shapes import TURN, brick, dense_operator, ground, moved, posed, scene
from tests.mechanics.solvers.problems import BACK, FORWARD, SOFT, by_path, cold, few_deformable, velocity_of
from tests.mechanics.solvers.problems import RIGID as HARD
from tests.mechanics.solvers.problems import stack as two_stones

UP = (0, 0, 2.0, 0, 0, 0)


def stack(*fidelities, law=None, **more):
    one = two_stones(*fidelities, **more)
    return one if law is None else replace(one, contact=ContactSettings(law))


SCENES = {
    "at rest": lambda: stack(),
    "elastic on elastic": lambda: stack(SOFT, SOFT),
    "elastic on rigid": lambda: stack(HARD, SOFT),
    "sliding": lambda: stack(below=FORWARD, above=BACK),
    "elastic ones sliding": lambda: stack(SOFT, SOFT, below=FORWARD, above=BACK),
    "upper one lifting off": lambda: stack(above=UP),
    "all lifting off": lambda: stack(below=UP, above=(0, 0, 3.0, 0, 0, 0)),
    "spinning": lambda: stack(above=(0, 0, 0, 0, 0, 4.0)),
    "rocking": lambda: stack(SOFT, SOFT, above=(0, 0, 0, 0.5, 2.0, 0)),
    "without friction": lambda: stack(below=FORWARD, above=BACK, friction=0.0),
    "hardly any friction": lambda: stack(below=FORWARD, above=BACK, friction=1e-3),
    "much friction": lambda: stack(SOFT, SOFT, below=FORWARD, above=BACK, friction=3.0),
    "mortar": lambda: stack(below=FORWARD, above=BACK, law=MortarJoint(0.4, 200.0, 1000.0)),
    "mortar at rest": lambda: stack(law=MortarJoint(0.4, 200.0, 1000.0)),
    "weak mortar": lambda: stack(SOFT, SOFT, below=FORWARD, above=UP, law=MortarJoint(0.4, 20.0, 50.0)),
    "mortar without friction": lambda: stack(below=FORWARD, above=BACK, law=MortarJoint(0.0, 50.0, 100.0)),
    "falling hard": lambda: stack(SOFT, SOFT, below=(0, 0, -3.0, 0, 0, 0), above=(0.5, 0, -5.0, 0, 0, 0)),
}
EVERY = pytest.mark.parametrize("name", SCENES)


@cache
def problem_of(name):
    return posed(SCENES[name]()).problem


def assert_laws_hold(problem, r, tolerance=1e-6):
    """Signorini and Coulomb at each contact, from u = W r + u_free."""
    u = problem.delassus.apply(r) + problem.u_free
    normal, slip = u[:, 0] + problem.bias, np.linalg.norm(u[:, 1:], axis=1)
    speed = np.abs(problem.u_free).max()
    # less than a part in 10⁸ of the impulse that would stop the fastest contact is none
    force = max(np.abs(r).max(), 1e-8 * speed / np.abs(problem.delassus.diagonal).max())
    limit = problem.friction * r[:, 0] + problem.cohesion
    assert r[:, 0].min() >= -1e-9 * force
    assert normal.min() > -tolerance * speed
    assert np.abs(normal * r[:, 0]).max() <= tolerance * force * speed
    assert (np.linalg.norm(r[:, 1:], axis=1) <= limit + 1e-7 * force).all()
    opposed = r[:, 1:] * slip[:, None] + limit[:, None] * u[:, 1:]
    assert np.abs(opposed).max() <= tolerance * force * speed


@EVERY
def test_the_laws_hold_at_every_contact(name):
    """The path comes near; Newton's method ends it, as in every chain."""
    problem = problem_of(name)
    near = InteriorPoint()(problem, cold(problem))
    assert near.iterations <= 30
    assert near.natural_map <= 3e-4
    assert near.natural_map == pytest.approx(natural_map(problem, near.impulse), rel=1e-9, abs=1e-300)
    answer = by_path(problem, cold(problem))
    assert answer.converged
    assert natural_map(problem, answer.impulse) <= 1e-8
    assert_laws_hold(problem, answer.impulse)


PATHS = [name for name in SCENES if name not in ("all lifting off",)]


@pytest.mark.parametrize("name", PATHS)
def test_the_central_path_alone_leads_to_the_solution(name):
    """Complementarity falls to 1e-7 within 40 iterations."""
    problem = problem_of(name)
    path = CentralPath(problem)
    for _ in range(40):
        if path.complementarity < 1e-7:
            break
        path.advance()
    assert path.complementarity < 1e-7
    assert_laws_hold(problem, path.impulse, 1e-3)
    assert natural_map(problem, path.impulse) < 3e-3  # some ten times the root of 1e-7
    # where nothing rubs, nothing at all acts along the joint
    smooth = (problem.friction == 0) & (problem.cohesion == 0)
    np.testing.assert_array_equal(path.impulse[smooth, 1:], 0.0)


def test_the_scenes_open_slide_and_stick():
    """What the others test is there: contacts that are open, slide or stick, with a cone of each kind."""
    seen = set()
    for name in SCENES:
        problem = problem_of(name)
        r = by_path(problem, cold(problem)).impulse
        u = problem.delassus.apply(r) + problem.u_free
        pressed = r[:, 0] > 1e-3 * max(r[:, 0].max(), 1e-300)
        slides = np.linalg.norm(u[:, 1:], axis=1) > 1e-3
        kind = "cohesive" if problem.cohesion.any() else "smooth" if not problem.friction.any() else "dry"
        seen |= {(kind, "slides")} if (pressed & slides).any() else set()
        seen |= {(kind, "sticks")} if (pressed & ~slides).any() else set()
        seen |= {(kind, "open")} if not pressed.all() else set()
    assert {(kind, way) for kind in ("dry", "cohesive") for way in ("slides", "sticks", "open")} <= seen
    assert ("smooth", "slides") in seen


@EVERY
def test_motion_and_forces_are_those_of_sweeps(name):
    """Gauss–Seidel sweeps to 1e-11; forces are compared where W is definite, so that they are unique."""
    problem = problem_of(name)
    answer = by_path(problem, cold(problem))
    other = NSGS(1e-11, 1e-9, 100000)(problem, cold(problem))
    assert answer.converged
    assert other.converged
    u = [velocity_of(problem, one) for one in (answer, other)]
    np.testing.assert_allclose(u[0], u[1], atol=1e-6 * np.abs(problem.u_free).max())


def test_where_w_is_definite_the_impulses_agree():
    """A stone on tetrahedra, one contact on each of its nodes: no two impulses have the same effect."""
    block = brick("a", (0, 0, 0), (0.6, 0.4, 0.3), SOFT, velocity=(0.3, 0.1, 0, 0, 0, 0.5), mesh_size=0.3)
    one = posed(scene(ground(), block))
    w_hat, transpose = dense_operator(one.model, one.state, one.contacts, one.compliance)
    values = np.linalg.eigvalsh(transpose @ w_hat @ transpose.T)
    assert values[0] > 1e-6 * values[-1]
    problem = one.problem
    answer = by_path(problem, cold(problem), 1e-10)
    other = NSGS(1e-12, 1e-9, 200000)(problem, cold(problem))
    np.testing.assert_allclose(answer.impulse, other.impulse, atol=1e-5 * np.abs(other.impulse).max())


@pytest.mark.parametrize("name", ["at rest", "sliding", "weak mortar", "without friction"])
def test_a_turned_world_has_the_same_solution(name):
    one = SCENES[name]()
    turned = replace(
        one, blocks=tuple(moved(b, TURN, (3, 4, 5)) for b in one.blocks), gravity=tuple(TURN @ one.gravity)
    )
    blocks = tuple(
        replace(b, velocity=(*(TURN @ b.velocity[:3]), *(TURN @ b.velocity[3:]))) for b in turned.blocks
    )
    problem = posed(replace(turned, blocks=blocks)).problem
    answer = by_path(problem, cold(problem))
    assert answer.converged
    assert_laws_hold(problem, answer.impulse)


@pytest.mark.parametrize(
    ("lower", "friction"),
    [(lower, mu) for lower in (SOFT, HARD) for mu in (0.0, 0.05, 0.6, 2.0)],
)
def test_long_steps_are_solved(lower, friction):
    """Steps of 1 s, measured against the elastic part of W: the static problem."""
    settings = stack(lower, SOFT, friction=friction, step=1.0, theta=1.0, relaxation=True)
    one = posed(settings, step=1.0, theta=1.0)
    operator = mixed_delassus(
        one.model, one.state, one.contacts, one.compliance, one.operator.as_rigid.schedule, elastic_scale=True
    )
    problem = replace(one.problem, delassus=operator)
    assert operator.scale < one.operator.scale
    answer = by_path(problem, cold(problem))
    assert answer.converged
    assert_laws_hold(problem, answer.impulse)
    # the ground carries the weight
    contacts = one.contacts
    grounded = (one.model.fixed[contacts.bodies[:, 1]]).astype(float) - one.model.fixed[contacts.bodies[:, 0]]
    world = np.einsum("cij,ci->cj", contacts.frame, answer.impulse)
    weight = 9.81 * one.model.mass[~one.model.fixed].sum()
    assert (grounded @ world)[2] == pytest.approx(weight, rel=1e-6)


@EVERY
def test_from_the_solution_nothing_is_done(name):
    problem = problem_of(name)
    first = by_path(problem, cold(problem), 1e-9)
    again = InteriorPoint(1e-8, 1e-6)(problem, ContactStart(first.impulse, first.velocity))
    assert (first.iterations > 0) == bool(first.impulse.any())
    assert again.iterations == 0
    np.testing.assert_allclose(again.impulse, first.impulse, atol=1e-12 * np.abs(first.impulse).max())


@EVERY
def test_a_wrong_start_does_no_harm(name):
    problem = problem_of(name)
    rng = np.random.default_rng(0)
    size = np.abs(problem.u_free).max() / np.abs(problem.delassus.diagonal).mean()
    start = ContactStart(size * rng.normal(size=problem.u_free.shape), np.zeros_like(problem.u_free))
    kept = start.impulse.copy()
    answer = by_path(problem, start)
    assert answer.converged
    assert_laws_hold(problem, answer.impulse)
    np.testing.assert_array_equal(start.impulse, kept)


@pytest.mark.parametrize("name", ["sliding", "rocking", "mortar"])
def test_it_does_not_depend_on_units(name):
    """Masses and velocities in other units: the same motion in those units."""
    problem = problem_of(name)
    plain = by_path(problem, cold(problem))
    for mass, speed in ((1e6, 1.0), (1.0, 1e-5), (1e-4, 1e3)):
        w = problem.delassus
        w = replace(
            w,
            response=w.response / mass,
            block=w.block / mass,
            mass=w.mass * mass,
            diagonal=w.diagonal / mass,
            scale=w.scale / mass,
        )
        other = replace(
            problem,
            delassus=w,
            u_free=problem.u_free * speed,
            bias=problem.bias * speed,
            cohesion=problem.cohesion * mass * speed,
        )
        answer = by_path(other, cold(other))
        assert answer.converged
        u = [w.apply(answer.impulse) / speed, problem.delassus.apply(plain.impulse)]
        np.testing.assert_allclose(u[0], u[1], atol=1e-5 * np.abs(problem.u_free).max())


def test_few_iterations_are_counted_and_the_best_is_given_back():
    problem = problem_of("sliding")
    for count in (1, 2, 5):
        answer = InteriorPoint(1e-14, 1e-14, count)(problem, cold(problem))
        assert not answer.converged
        assert answer.iterations == count
        assert answer.natural_map == pytest.approx(natural_map(problem, answer.impulse), rel=1e-9)


def test_impulses_that_are_no_numbers_never_count_as_solved():
    problem = problem_of("sliding")
    one = np.zeros_like(problem.u_free)
    one[3, 1] = np.nan
    for impulse in (one, np.full_like(one, np.nan), np.full_like(one, np.inf)):
        with np.errstate(all="ignore"):
            assert not residual(problem, impulse).within(1e-6, 1e-5)
            answer = InteriorPoint(1e-8, 1e-6)(problem, ContactStart(impulse, one))
        assert np.isfinite(answer.impulse).all() or not answer.converged


def test_a_result_repeats_bit_for_bit():
    problem = problem_of("sliding")
    one, other = (InteriorPoint(1e-8, 1e-6)(problem, cold(problem)) for _ in range(2))
    np.testing.assert_array_equal(one.impulse, other.impulse)


def test_without_contacts_there_is_nothing_to_solve():
    problem = posed(scene(ground(), brick("a", (0, 0, 5), (1, 1, 6), SOFT))).problem
    answer = InteriorPoint()(problem, cold(problem))
    assert answer.converged
    assert (answer.iterations, answer.natural_map, answer.impulse.shape) == (0, 0.0, (0, 3))


def test_stones_that_nothing_presses_are_left_alone():
    """No gravity, no velocity: no impulses, or next to none where rounding makes some free velocity."""
    one = posed(stack(SOFT, SOFT, gravity=(0, 0, 0)))
    still = replace(one.problem, u_free=np.zeros_like(one.problem.u_free))
    for problem in (one.problem, still):
        answer = by_path(problem, cold(problem))
        assert answer.converged
        assert np.abs(answer.impulse).max() < 1e-10 * 2e-3 * 9.81 * one.model.mass[1]


def test_a_problem_that_cannot_be_factorised_is_refused():
    problem = products_alone(problem_of("sliding"))
    with pytest.raises(SolverError, match="interior point: the problem has no sparse form"):
        InteriorPoint()(problem, cold(problem))


# --- few deformable stones among many rigid ones ---


@cache
def mixed():
    return InteriorPoint(1e-5, 1e-4)(few_deformable(), cold(few_deformable()))


def test_a_wall_of_which_three_stones_deform_is_solved_from_nothing():
    problem = few_deformable()
    assert problem.delassus.mostly_rigid
    assert mixed().converged
    assert residual(problem, mixed().impulse).within(1e-5, 1e-4)


def test_a_path_that_begins_near_the_impulses_of_the_last_step_is_shorter():
    problem, rng = few_deformable(), np.random.default_rng(1)
    near = mixed().impulse * (1.0 + 1e-3 * rng.normal(size=mixed().impulse.shape))
    assert not residual(problem, near).within(1e-5, 1e-4)
    answer = InteriorPoint(1e-5, 1e-4)(problem, ContactStart(near, np.zeros_like(near)))
    assert answer.converged
    assert answer.iterations <= 2 * mixed().iterations / 3


@pytest.mark.parametrize("level", [1e-2, 1e-6])
def test_complementarity_of_a_path_that_begins_near_impulses_is_that_asked_for(level):
    even, unit = equilibrated(few_deformable())
    path = CentralPath(even, mixed().impulse / unit[:, None], level)
    assert path.complementarity == pytest.approx(level, rel=1e-6)
    assert path.advance() > 0.0


def test_where_laws_contradict_each_other_the_path_ends_and_says_so():
    """Two fixed supports drive a stone between them from both sides: no impulse opens both contacts."""
    across = np.diag([-1.0, 0, 0])
    operator = DenseDelassus(np.block([[np.eye(3), across], [across, np.eye(3)]]))
    free, none = np.array([[-1.0, 0, 0], [-1.0, 0, 0]]), np.zeros(2)
    problem = ContactProblem(operator, free, none, none, none)
    with np.errstate(all="ignore"):
        answer = InteriorPoint(1e-8, 1e-6)(problem, cold(problem))
    assert not answer.converged
    assert np.isfinite(answer.impulse).all()
