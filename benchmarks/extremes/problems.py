"""The rows of the matrix that are one contact problem each."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.extremes.contacts import (
    Box,
    Truth,
    boxes,
    each_sum,
    grid,
    never,
    nothing,
    one_between_fixed,
    patch,
    slides,
    squeezed,
    stored,
    sums,
    with_last,
)
from benchmarks.extremes.stones import (
    G,
    column,
    elastic_column,
    moved,
    slabs,
    standing,
    volume,
    wall,
)
from benchmarks.scenes import problem_of
from mechanics.arrays import Array
from mechanics.delassus.rigid import RigidDelassus
from mechanics.problem.problem import ContactProblem
from mechanics.scene.scene import Fidelity, Scene

# that solvers are asked for; also what each joint of a column may let through of g h, so of the weight above it
VELOCITY_TOLERANCE = 1e-5


@dataclass(frozen=True)
class Row:
    """One row of the matrix.

    Attributes
    ----------
    group, name : what is extreme, and how much
    make : states the problem; it may be refused there (MomaError)
    truth : error against what is known of the solution; None: the laws alone judge
    within : what `truth` may be where a solver says that it has solved the problem [-]
    start : every component of the impulses with which solvers begin [N s]
    deformable : its stones are
    quick : part of what every test run does
    """

    group: str
    name: str
    make: Callable[[], ContactProblem]
    truth: Truth | None = None
    within: float = 1e-5
    start: float = 0.0
    deformable: bool = False
    quick: bool = True


def rows() -> list[Row]:
    """All rows, in the order in which they are shown."""
    return [
        *_columns(),
        *_settings(),
        *_faces(),
        *_bonds(),
        *_scales(),
        *_starts(),
        *_senseless(),
    ]


def _stands(group: str, name: str, scene: Scene, joints: int, quick: bool = True) -> Row:
    """The first step of rigid stones that stand: what the ground bears is the weight."""
    friction = scene.contact.law.friction
    return Row(
        group,
        name,
        lambda: problem_of(scene),
        lambda problem, impulse: _lost_weight(scene, problem, impulse),
        # each joint from the ground to the top may let a little of the velocity through
        2.0 * (1.0 + friction) * joints * VELOCITY_TOLERANCE,
        quick=quick,
    )


def _lost_weight(scene: Scene, problem: ContactProblem, impulse: Array) -> float:
    operator = problem.delassus
    assert isinstance(operator, RigidDelassus)
    loose = [block for block in scene.blocks if block.fidelity is not Fidelity.FIXED]
    mass = sum(block.material.density * volume(block) for block in loose)
    weight = mass * np.array(scene.gravity) * scene.time.step
    world = np.einsum("cij,ci->cj", operator.geometry[:, :9].reshape(-1, 3, 3), impulse)
    on_ground = (operator.body[:, 1] == 0).astype(float) - (operator.body[:, 0] == 0)
    return float(np.abs(on_ground @ world + weight).max() / np.abs(weight).max())


def _columns() -> list[Row]:
    return [
        *(
            _stands("column", f"{count} equal stones", standing(column(count)), count, count <= 50)
            for count in (10, 50, 100, 200)
        ),
        *(
            _stands("mass ratio", f"{name}, 1 : {ratio:.0e}", standing(column(2, ratio)), 2)
            for name, ratio in (
                ("heavy on light", 1e2),
                ("heavy on light", 1e4),
                ("heavy on light", 1e6),
                ("light on heavy", 1e-6),
            )
        ),
        *(
            _stands(
                "mass ratio",
                f"{count} stones, 1 : {ratio:.0e}",
                standing(column(count, ratio)),
                count,
                count <= 10,
            )
            for count, ratio in ((10, 1e6), (30, 1e3), (100, 1e6))
        ),
    ]


def _settings() -> list[Row]:
    return [
        *(
            _stands("friction", f"μ = {mu:g}, wall", standing(wall(4, 4), friction=mu), 4)
            for mu in (0.0, 0.1, 1.0, 10.0)
        ),
        *(
            _stands("step", f"h = {step:g} s, wall", standing(wall(4, 4), step=step), 4)
            for step in (1e-5, 1e-3, 1e-1)
        ),
        *(
            _stands("size", f"{size:g} m, column of 10", standing(column(10, size=size)), 10)
            for size in (1e-3, 1e4)
        ),
        *(_elastic(young) for young in (1e6, 1e9, 1e12)),
        _stands("slabs 1:100", "six, crossed", standing(slabs(6)), 6),
        _stands("far", "column of 10, 1e7 m away", standing(moved(column(10), (1e7, 1e7, 0.0))), 10),
    ]


def _elastic(young: float) -> Row:
    """Its ground does not bear the whole weight before waves have run through it: the laws alone judge."""
    scene = standing(elastic_column(young))
    return Row("stiffness", f"E = {young:.0e} Pa", lambda: problem_of(scene), deformable=True)


def _faces() -> list[Row]:
    corners, hundred, edge = grid(2), grid(10), grid(2, 0.5)
    flat = (0.5, 0.5, 0.01)

    def steep(degrees: float) -> tuple[float, float, float]:
        angle = np.radians(degrees)
        return -G * 1e-3 * float(np.cos(angle)), G * 1e-3 * float(np.sin(angle)), 0.0

    def on_slope(degrees: float) -> Row:
        v, s, _ = steep(degrees)
        what = "slides" if s > -10.0 * v else "holds"
        return Row(
            "friction",
            f"μ = 10, slab at {degrees:g}°: {what}",
            lambda: boxes(Box(edge, steep(degrees), 10.0, half=flat)),
            slides(-v, s, 10.0),
            # held by friction ten times its pressure, it may creep by the velocity that is let through
            22.0 * VELOCITY_TOLERANCE,
        )

    return [
        on_slope(84.0),
        on_slope(84.6),
        Row(
            "redundant", "100 points on a face, sticks", lambda: patch(hundred, (-1, 0.3, 0)), slides(1, 0.3)
        ),
        Row(
            "redundant",
            "100 points on a face, slides",
            lambda: patch(hundred, (-1, 1, 0), 0.3),
            slides(1, 1, 0.3),
        ),
        Row(
            "redundant",
            "each contact twice",
            lambda: patch(np.repeat(corners, 2, axis=0), (-1, 0.3, 0)),
            slides(1, 0.3),
        ),
        Row("conflict", "driven walls squeeze a stone, μ = 0", lambda: squeezed(0.0), never),
        Row("conflict", "driven walls squeeze a stone, μ = 0.6", lambda: squeezed(0.6), never),
        Row("conflict", "an overlap is pushed out on both sides", _pushed_out_twice, never),
        Row("conflict", "one of the walls gives way", lambda: squeezed(0.6, 2.0)),
    ]


def _pushed_out_twice() -> ContactProblem:
    """A stone between fixed walls that both overlap with it, at rest and without weight."""
    problem = squeezed(0.0)
    return replace(problem, u_free=np.zeros((8, 3)), bias=np.full(8, -1.0))


def _bonds() -> list[Row]:
    whole, pull = np.eye(3), (-1.0, 3.0, 4.0)
    return [
        Row("cohesion", "μ = 0, k = 1: slides", lambda: stored(whole, pull, 0.0, 1.0), sums(1, -0.6, -0.8)),
        Row("cohesion", "μ = 0, k = 9: holds", lambda: stored(whole, pull, 0.0, 9.0), sums(1, -3, -4)),
        Row("cohesion", "μ = 0.5, k = 1: slides", lambda: stored(whole, pull, 0.5, 1.0), sums(1, -0.9, -1.2)),
        Row(
            "cohesion",
            "μ = 0.5, k = 1: opens",
            lambda: stored(whole, (2.0, 3.0, 4.0), 0.5, 1.0),
            sums(0, -0.6, -0.8),
        ),
        Row("cohesion", "μ = 0.5, k = 1e6: holds", lambda: stored(whole, pull, 0.5, 1e6), sums(1, -3, -4)),
    ]


def _scales() -> list[Row]:
    corners, down = grid(2), (-1e-3, 0.0, 0.0)
    return [
        *(
            Row(
                "velocity",
                f"u_free of {v:.0e} m/s",
                lambda v=v: patch(corners, (-v, 0.3 * v, 0.0)),  # type: ignore[misc]
                slides(v, 0.3 * v),
            )
            for v in (1e6, 1e70, 1e100, 1e-70, 1e-100, 1e-310)
        ),
        *(
            Row(
                "mass",
                f"{mass:g} kg",
                lambda m=mass: patch(corners, (-1.0, 0.3, 0.0), mass=m),  # type: ignore[misc]
                slides(1, 0.3, mass=mass) if 0 < mass < np.inf else never,
            )
            for mass in (1e-12, 1e12, 1e100, 1e-310, 0.0, -1.0, np.inf)
        ),
        Row(
            "bias",
            "pushed out at 1e9 m/s",
            lambda: replace(patch(corners, down), bias=np.full(4, -1e9)),
            sums(1e11, 0, 0),
        ),
        Row(
            "bias",
            "1e9 m/s away from closing",
            lambda: replace(patch(corners, down), bias=np.full(4, 1e9)),
            nothing,
            0.0,
        ),
        _unlike(1e3),
        _unlike(1e6),
        Row("few", "no contact", lambda: patch(np.zeros((0, 2)), down), nothing, 0.0),
        Row("few", "one contact", lambda: stored(np.eye(3), (-1, 0.3, 0.4), 0.6), sums(1, -0.3, -0.4)),
        Row("few", "no velocity", lambda: patch(corners, (0, 0, 0)), nothing, 0.0),
    ]


def _unlike(spread: float) -> Row:
    """Three boxes, masses `spread` apart and velocities the other way: all impulses alike; one slides, two stick.

    The slowest is solved to the velocity that the fastest lets through, so nothing is asked of it but to be shown.
    """
    corners, scale = grid(2), np.array([1.0 / spread, 1.0, spread])
    free = scale[::-1, None] * [[-1.0, 0.3, 0.0], [-1.0, 0.9, 0.0], [-1.0, -0.2, 0.1]]
    expected = -100.0 * scale[:, None] * free
    expected[1, 1] = -0.6 * expected[1, 0]
    return Row(
        "unlike contacts",
        f"masses 1 : {spread:.0e} : {spread**2:.0e}",
        lambda: boxes(*(Box(corners, free[i], mass=100.0 * scale[i]) for i in range(3))),
        each_sum([4, 4, 4], expected),
        np.inf,
    )


def _starts() -> list[Row]:
    return [
        Row("start", f"impulses of {value:g} N s", _sticks, slides(1, 0.3), start=value)
        for value in (1e9, -1e9, np.nan)
    ]


def _sticks() -> ContactProblem:
    return patch(grid(2), (-1.0, 0.3, 0.0))


def _senseless() -> list[Row]:
    """Return problems that no solver can make sense of."""
    return [
        *(
            Row(
                "no number",
                f"{value:g} in {name}",
                lambda n=name, v=value: with_last(_sticks(), **{n: v}),  # type: ignore[misc]
                never,
            )
            for value in (np.nan, np.inf)
            for name in ("u_free", "bias", "friction", "cohesion")
        ),
        Row("no number", "nan in W", lambda: stored(np.full((3, 3), np.nan), (-1, 0, 0), 0.6), never),
        *(
            Row("negative", f"{name} = -1", lambda n=name: with_last(_sticks(), **{n: -1.0}), never)  # type: ignore[misc]
            for name in ("friction", "cohesion")
        ),
        Row("no compliance", "along n", lambda: stored(np.diag([0.0, 1, 1]), (-1, 0, 0), 0.6), never),
        Row("no compliance", "between fixed stones", lambda: one_between_fixed(_sticks()), never),
        Row("shape", "μ of three for four", lambda: replace(_sticks(), friction=np.full(3, 0.6)), never),
    ]
