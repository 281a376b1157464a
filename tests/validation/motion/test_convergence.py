"""Convergence of the motion with the time step: order 2 in flight, 1 on and through contacts."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.validation.motion.test_rocking import SLENDER, angles, housner, rocking, slenderness
from tests.validation.motion.test_rotation import body_rates, euler, plate
from tests.validation.motion.test_sliding import low_block
from tests.validation.scenes import G, dynamic, follow, ground, moved, tilted_gravity


def order(steps, errors):
    """Slope of log error over log step, by least squares."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def test_free_rotation_is_of_second_order():
    """S10: rates of a tumbling stone after 2 s against Euler's equations; slope 1.8 to 2.2 over a decade, θ = 1/2."""
    inertia, omega = (1.0, 1.7, 2.2), (1.0, -2.0, 0.7)
    steps, errors = np.array([2e-2, 1e-2, 5e-3, 2e-3]), []
    for step in steps:
        block = plate(inertia, (0, 0, 0, *omega))
        path = follow(dynamic("tumble", [block], gravity=(0, 0, 0), step=step, duration=2.0))
        errors.append(np.linalg.norm(body_rates(path)[-1] - euler(inertia, omega, np.array([0, 2.0]))[-1]))
    assert errors[0] < 1e-2
    assert 1.8 < order(steps, errors) < 2.2


def test_turning_about_an_edge_is_of_first_order():
    """S10: motion on a contact: a block that falls over its edge, θ after 0.3 s; slope 0.8 to 1.2 over a decade.

    The normal side is of second order; a held point creeps by h² ω² R/2 a step along the ground, which is of first. The
    error is small: less than 1e-4 of θ with h = 10 ms.
    """
    alpha, p = slenderness(SLENDER)
    start, spin = 1.1 * alpha, 0.5
    exact = solve_ivp(
        lambda _, y: [y[1], p**2 * np.sin(y[0] - alpha)], (0, 0.3), [start, spin], rtol=1e-11, atol=1e-13
    ).y[0, -1]
    steps, errors = np.array([1e-2, 5e-3, 2.5e-3, 1e-3]), []
    for step in steps:
        scene, _ = rocking(SLENDER, start, spin, step=step, duration=0.3)
        errors.append(abs(angles(follow(scene), start)[0][-1] - exact))
    assert errors[0] < 2e-4 * exact
    assert 0.8 < order(steps, errors) < 1.2


def test_a_drop_that_ends_in_a_slide_is_of_first_order_at_least():
    """S10: fall, impact and slide to rest: where it lies; slope above 0.8 over a decade, mean square of four heights.

    Exact: the impact takes μ √(2 g H) of the speed, the slide v²/(2 μ g). Single errors are noisy: they depend on
    where in a step the impact falls. With h = 10 ms the error is below 1e-4 m.
    """
    speed, friction = 2.0, 0.3
    heights = np.array([0.05, 0.077, 0.1, 0.12])
    fall = np.sqrt(2 * heights / G)
    after = speed - friction * G * fall
    exact = speed * fall + after**2 / (2 * friction * G)
    steps, errors = np.array([1e-2, 5e-3, 2e-3, 1e-3]), []
    for step in steps:
        ends = []
        for height in heights:
            block = moved(low_block((speed, *[0.0] * 5)), shift=(0, 0, height))
            path = follow(
                dynamic("drop", (ground(), block), friction=friction, step=step, duration=1.2),
                until=lambda s: np.abs(s.after.velocity).max() < 1e-9,
            )
            assert np.abs(path.velocity[-1]).max() < 1e-6
            ends.append(path.centre[-1, 1, 0])
        errors.append(np.sqrt(np.mean((ends - exact) ** 2)))
    assert errors[0] < 1e-4
    assert order(steps, errors) > 0.8


def test_a_curved_slide_is_of_first_order():
    """A block that starts across a slope with tan α = μ, and turns downhill; slope 0.9 to 1.1 over two octaves.

    Friction is against the velocity at the end of the step, so its direction is ahead by h/2: the descent after 0.5 s
    is 2.3 % short with h = 10 ms. The equation: v' = g sin α x - μ g cos α v/|v|, by scipy.
    """
    friction, across, time = 0.5, 1.0, 0.5
    pull, drag = G * np.array([np.sin(np.arctan(friction)), friction * np.cos(np.arctan(friction))])

    def slide(_, y):
        speed = np.hypot(y[2], y[3])
        return [y[2], y[3], pull - drag * y[2] / speed, -drag * y[3] / speed]

    exact = solve_ivp(slide, (0, time), [0, 0, 0, across], rtol=1e-11, atol=1e-13).y[0, -1]
    steps, errors = np.array([2e-2, 1e-2, 5e-3]), []
    for step in steps:
        block = moved(low_block((0.0, across, *[0.0] * 4)))
        gravity = tilted_gravity(np.degrees(np.arctan(friction)))
        scene = dynamic(
            "curve", (ground(), block), friction=friction, gravity=gravity, step=step, duration=time
        )
        path = follow(scene)
        errors.append(exact - path.centre[-1, 1, 0] + path.centre[0, 1, 0])
    assert errors[1] == pytest.approx(0.0232 * exact, rel=0.05)
    assert 0.9 < order(steps, errors) < 1.1


@pytest.mark.slow
def test_rocking_through_impacts_is_of_first_order():
    """S10: θ after three impacts against Housner's model; slope 0.8 to 1.2 over a decade, from six starts."""
    alpha, _ = slenderness(SLENDER)
    starts, time = np.linspace(0.3, 0.5, 6) * alpha, 1.2
    exact = [housner(SLENDER, start, 0.0, time)[2][-1] for start in starts]
    steps, errors = np.array([5e-3, 2.5e-3, 1e-3, 5e-4, 2e-4]), []
    for step in steps:
        ends = [angles(follow(rocking(SLENDER, s, step=step, duration=time)[0]), s)[0][-1] for s in starts]
        errors.append(np.sqrt(np.mean((np.array(ends) - exact) ** 2)))
    assert errors[-1] < 0.01 * alpha
    assert 0.8 < order(steps, errors) < 1.2
