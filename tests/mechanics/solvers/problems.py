"""Contact problems that the tests of several solvers share."""

from dataclasses import replace
from functools import cache

import numpy as np

from mechanics.delassus.compliant import CompliantDelassus
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.scene.scene import Fidelity
from mechanics.scene.shapes import bond, wall
from mechanics.solvers.second_order.interior_point import InteriorPoint
from mechanics.solvers.second_order.newton import Newton
from mechanics.stones.materials import Material
from tests.mechanics.dense_operator import blocks_apart
from tests.mechanics.shapes import brick, ground, partly_deformable_wall, posed, scene

G, STEP = 9.81, 1e-3
SOFT, RIGID = Fidelity.DEFORMABLE, Fidelity.RIGID
SIDE = 0.5  # of the square blocks of a column [m]


def cold(problem):
    """Nothing known of the forces."""
    zero = np.zeros_like(problem.u_free)
    return ContactStart(zero, zero.copy())


def velocity_of(problem, solution):
    """u after a solution."""
    return problem.delassus.apply(solution.impulse) + problem.u_free


def by_path(problem, start, eta=1e-8):
    """The interior point's path, and Newton's method from its end."""
    near = InteriorPoint(eta, 100 * eta)(problem, start)
    found = Newton(eta, 100 * eta)(problem, ContactStart(near.impulse, near.velocity))
    return replace(found, iterations=near.iterations + found.iterations)


def alone(count=3, **given):
    """Contacts that do not feel each other, W = 1, each driven down at 1 and sideways at (1, 3), μ = 0.1."""
    parts = {"friction": np.full(count, 0.1), "cohesion": np.zeros(count), "bias": np.zeros(count)} | given
    u_free = np.tile([-1.0, 1.0, 3.0], (count, 1))
    return ContactProblem(blocks_apart(*[np.eye(3)] * count), u_free, **parts)


def column(densities, heights=None, tilt=0.0, friction=0.6):
    """Square blocks on top of each other, from the lowest up [kg/m³]; the ground is tilted [°]."""
    heights = [0.25] * len(densities) if heights is None else heights
    blocks, level = [ground()], 0.0
    for n, (density, height) in enumerate(zip(densities, heights, strict=True)):
        stone = Material(f"m{n}", density, 1e10, 0.2)
        blocks.append(brick(f"b{n}", (0, 0, level), (SIDE, SIDE, level + height), material=stone))
        level += height
    angle = np.radians(tilt)
    gravity = (G * np.sin(angle), 0.0, -G * np.cos(angle))
    return posed(scene(*blocks, gravity=gravity, friction=friction), STEP, theta=0.5).problem


def carried(problem, impulse):
    """Normal force in each joint of a column, from the lowest up [N]: contacts of one joint share their bodies."""
    upper = problem.delassus.rigid.body.max(axis=1)
    return np.bincount(upper, impulse[:, 0])[1:] / STEP


def leaning(sideways, count=18, courses=18, **time):
    """A wall in running bond on a slab, with a part of its weight along its courses too."""
    blocks = wall(bond(count, courses), 0.5, 0.25, 0.3)
    one = scene(*blocks, gravity=(G * sideways, 0.0, -G), friction=0.65, step=5e-3, relaxation=True)
    return replace(one, name="leaning wall", time=replace(one.time, **time))


def stack(lower=SOFT, upper=RIGID, below=(0.0,) * 6, above=(0.0,) * 6, friction=0.4, **more):
    """Two stones on the ground, the upper one over the edge of the lower."""
    return scene(
        ground(),
        brick("lower", (0, 0, 0), (0.6, 0.4, 0.3), lower, velocity=below, mesh_size=0.3),
        brick("upper", (0.1, 0, 0.3), (0.7, 0.4, 0.6), upper, velocity=above, mesh_size=0.3),
        friction=friction,
        **more,
    )


FORWARD, BACK = (0.3, 0.1, 0, 0, 0, 0), (-1.0, 0, 0, 0, 0, 0)


def yielding(problem, share):
    """The same problem with joints that yield by a share of the mean diagonal of W."""
    each = np.full_like(problem.u_free, share * problem.delassus.scale)
    return replace(problem, delassus=CompliantDelassus(problem.delassus, each))


@cache
def few_deformable():
    """The first step of a wall in which three stones deform."""
    return posed(partly_deformable_wall(), step=5e-3).problem
