"""Contact problems made by hand, for which no scene is needed, and what is known of their solutions."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.extremes.stones import G
from benchmarks.stored import StoredDelassus
from mechanics.arrays import Array
from mechanics.delassus.rigid import RigidDelassus, schedule
from mechanics.problem.problem import ContactProblem

# error of the impulses (nc, 3) of a problem against what is known of its solution, relative
Truth = Callable[[ContactProblem, Array], float]

# of a box on the ground, where nothing else is said: half its edges along x, y, z [m], and its mass [kg]
HALF, MASS = (0.25, 0.25, 0.1), 100.0
# n up, t1 along x, t2 along y
_FRAME = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@dataclass(frozen=True)
class Box:
    """A box on the ground.

    Attributes
    ----------
    points : (n, 2) places on its lower face where it is touched [m]
    free : (3,) its velocity without contact, along z, x and y [m/s]
    friction : μ
    mass : [kg]
    half : half its edges along x, y, z [m]
    """

    points: Array
    free: Sequence[float]
    friction: float = 0.6
    mass: float = MASS
    half: Sequence[float] = HALF


def grid(count: int, half: float = HALF[0]) -> Array:
    """count × count points over a face (count², 2) [m]."""
    line = np.linspace(-half, half, count)
    return np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)


def patch(points: Array, free: Sequence[float], friction: float = 0.6, **more: float) -> ContactProblem:
    """One box; see `Box`."""
    return boxes(Box(points, free, friction, **more))  # type: ignore[arg-type]


def boxes(*each: Box) -> ContactProblem:
    """Boxes on the ground that do not touch each other."""
    bodies = np.array([[b + 1, 0] for b, one in enumerate(each) for _ in one.points], dtype=np.int64)
    bodies = bodies.reshape(-1, 2)
    arms = [[x, y, -one.half[2], x, y, 0.0] for one in each for x, y in one.points]
    geometry = np.array([[*_FRAME.ravel(), *arm] for arm in arms]).reshape(-1, 15)
    inertia = np.vstack([np.zeros(7), *(_inverse_inertia(one) for one in each)])
    operator = RigidDelassus(bodies, geometry, inertia, schedule(bodies, np.arange(len(inertia)) > 0))
    return _problem(
        operator,
        np.array([one.free for one in each for _ in one.points], dtype=float).reshape(-1, 3),
        np.array([one.friction for one in each for _ in one.points], dtype=float),
    )


def _inverse_inertia(one: Box) -> Array:
    a, b, c = one.half
    moments = one.mass / 3.0 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    # what cannot be inverted is for the problem to refuse
    with np.errstate(divide="ignore", over="ignore"):
        mass, x, y, z = 1.0 / np.array([one.mass, *moments])
    return np.array([mass, x, 0.0, 0.0, y, 0.0, z])


def _problem(operator: RigidDelassus, free: Array, friction: Array) -> ContactProblem:
    none = np.zeros(len(free))
    return ContactProblem(operator, free, none, friction, none)


def squeezed(friction: float, give: float = -1.0) -> ContactProblem:
    """A stone of 100 kg between two walls; the left one comes on at 1 m/s, the other goes back at `give`."""
    points, half = grid(2), (0.25, 0.25, 0.25)
    frames = [np.array([[s, 0, 0], [0, s, 0], [0, 0, 1.0]]) for s in (1.0, -1.0)]
    geometry = [
        [*frame.ravel(), x, *p, x, *p] for frame, x in zip(frames, (-0.25, 0.25), strict=True) for p in points
    ]
    bodies = np.array([[1, 0]] * 4 + [[1, 2]] * 4)
    inertia = np.vstack([np.zeros(7), _inverse_inertia(Box(points, (), half=half)), np.zeros(7)])
    operator = RigidDelassus(
        bodies, np.array(geometry), inertia, schedule(bodies, np.array([False, True, False]))
    )
    free = np.zeros((8, 3))
    free[:, 0], free[:, 2] = np.repeat([-1.0, give], 4), -G * 1e-3
    return _problem(operator, free, np.full(8, friction))


def stored(block: Array, free: Sequence[float], friction: float, cohesion: float = 0.0) -> ContactProblem:
    """One contact with a given W (3, 3)."""
    operator = StoredDelassus(np.asarray(block, dtype=float)[None], np.array([0]), np.array([0, 1]))
    none = np.zeros(1)
    return ContactProblem(operator, np.array([free], dtype=float), none, none + friction, none + cohesion)


def with_last(problem: ContactProblem, **values: float) -> ContactProblem:
    """The problem, but for the last contact's u_free, bias, friction or cohesion."""
    changed = {name: getattr(problem, name).copy() for name in values}
    for name, value in values.items():
        changed[name][-1] = value
    return replace(problem, **changed)


def one_between_fixed(problem: ContactProblem) -> ContactProblem:
    """The problem of one box, whose last contact is said to be between fixed stones."""
    operator = problem.delassus
    assert isinstance(operator, RigidDelassus)
    bodies = operator.body.copy()
    bodies[-1] = [0, 0]
    other = replace(operator, body=bodies, schedule=schedule(bodies, np.array([False, True])))
    return replace(problem, delassus=other)


def sums(*expected: float) -> Truth:
    """Error of Σ r against (3,), over its size."""
    whole = np.array(expected)
    return lambda _, impulse: float(np.abs(impulse.sum(axis=0) - whole).max() / np.abs(whole).max())


def slides(v: float, s: float, friction: float = 0.6, mass: float = MASS) -> Truth:
    """Σ r of a box that meets the ground with v downwards and s along x: it sticks, or slides at its cone's limit."""
    return sums(mass * v, -min(friction * mass * v, mass * s), 0.0)


def each_sum(counts: Sequence[int], expected: Array) -> Truth:
    """The largest error of Σ r of each box (nb, 3), each over its own size."""
    ends = np.cumsum(counts)[:-1]

    def truth(_: ContactProblem, impulse: Array) -> float:
        found = np.array([part.sum(axis=0) for part in np.split(impulse, ends)])
        return float((np.abs(found - expected).max(axis=1) / np.abs(expected).max(axis=1)).max())

    return truth


def nothing(_: ContactProblem, impulse: Array) -> float:
    """No impulse is needed."""
    return float(np.abs(impulse).max(initial=0.0))


def never(_: ContactProblem, impulse: Array) -> float:
    """There is no solution: whoever has found one is wrong."""
    return float("inf")
