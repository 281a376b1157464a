"""The rows of the matrix that are whole runs, with closed forms and principles to hold them against."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.extremes.cells import Cell, Outcome, attempt
from benchmarks.extremes.problems import VELOCITY_TOLERANCE
from benchmarks.extremes.stones import (
    G,
    box,
    column,
    elastic_column,
    ground,
    moved,
    slabs,
    standing,
    wall,
)
from mechanics.results.result import Result
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import ImposedMotion
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import Block, Fidelity, Method, Scene, SolverSettings, Start
from mechanics.simulate import simulate

# what was measured, over what is right where every step is solved
Check = Callable[[Result], float]

# of the size: motions that differ by less are the same
_SAME = 1e-6
_MODELS: dict[tuple[str, SolverSettings], Result] = {}
# how fast walls close in on a stone [m/s], and for how long [s]
_PACE, _SQUEEZE = 0.1, 0.01


@dataclass(frozen=True)
class SceneRow:
    """One row of the matrix.

    Attributes
    ----------
    group, name : what is extreme, and how much
    scene : without its solver
    check : what was measured over what is right where every step is solved; up to 1 is well
    against : another scene, run by the same method, whose motion times `scale` this one must have
    scale : of lengths
    tolerance, velocity_tolerance, iterations : that solvers are asked for, and after how many they give up
    quick : part of what every test run does
    """

    group: str
    name: str
    scene: Scene
    check: Check
    against: Scene | None = None
    scale: float = 1.0
    tolerance: float = 1e-9
    velocity_tolerance: float = VELOCITY_TOLERANCE
    iterations: int = 2000
    quick: bool = True

    def solver(self, method: Method) -> SolverSettings:
        """As this row asks for it."""
        return SolverSettings(method, self.tolerance, self.velocity_tolerance, self.iterations)


def run_cells(row: SceneRow, methods: tuple[Method, ...]) -> dict[str, Cell]:
    """The row, run by each method."""
    return {method.value: attempt(lambda m=method: _run(row, m)) for method in methods}  # type: ignore[misc]


def _run(row: SceneRow, method: Method) -> Cell:
    result = simulate(replace(row.scene, solver=row.solver(method)))
    worst = max(row.check(result), _not_finite(result))
    if row.against is not None:
        model = _model_motion(replace(row.against, solver=row.solver(method)))
        worst = max(worst, _apart(result, model, row.scale) / _SAME)
        result = _less_solved(result, model)
    history, said = result.history, _told(result)
    outcome = Outcome.SOLVED if worst <= 1.0 else Outcome.WRONG
    return Cell(
        Outcome.NOT_CONVERGED if said else outcome,
        float(history.natural_map.max()),
        int(history.iterations.sum()),
        worst,
        seconds=sum(result.wall_time.values()),
        words=said,
    )


def _told(result: Result) -> str:
    """Return the words of the result on itself, where it is not what was asked for."""
    lost = result.errors.unconverged_steps
    if lost:
        return f"{lost} of {result.steps} steps not converged"
    if result.static is not None and not result.static.found:
        return f"no equilibrium found, η {result.static.natural_map:.0e}, balance {result.static.balance:.0e}"
    return ""


def _less_solved(one: Result, other: Result) -> Result:
    """The one of two runs of which fewer steps were solved."""
    return max(one, other, key=lambda result: result.errors.unconverged_steps)


def _not_finite(result: Result) -> float:
    sound = all(np.isfinite(body.position).all() for body in result.bodies)
    return 0.0 if sound else np.inf


def _model_motion(scene: Scene) -> Result:
    """Its run; that of the last scene is kept, for the next row is mostly held against the same."""
    if (scene.name, scene.solver) not in _MODELS:
        _MODELS.clear()
        _MODELS[scene.name, scene.solver] = simulate(scene)
    return _MODELS[scene.name, scene.solver]


def _apart(one: Result, other: Result, scale: float) -> float:
    """Largest difference of the displacements, over the size of the model [-]."""
    return max(
        float(np.abs(a.displacement / scale - b.displacement).max())
        for a, b in zip(one.bodies, other.bodies, strict=True)
    )


def scene_rows() -> list[SceneRow]:
    """All rows, in the order in which they are shown."""
    return [*_resting(), *_sliding(), *_similar(), *_elastic(), *_odd()]


def _rests(group: str, name: str, blocks: Sequence[Block], joints: int, **more: Any) -> SceneRow:
    """Stones that stand: the weight arrives, they stay where they are, and nothing overlaps."""
    quick = more.pop("quick", True)
    scene = standing(blocks, **more)
    friction = scene.contact.law.friction
    through = 2.0 * (1.0 + friction) * joints * VELOCITY_TOLERANCE
    fallen = 0.5 * G * scene.time.duration**2

    def check(result: Result) -> float:
        moved_by = max(float(np.abs(body.displacement).max()) for body in result.bodies)
        # all the velocity that joints let through, in one direction in all steps
        told = result.errors.reaction / through, result.errors.penetration / 1e-4
        return float(max(*told, moved_by / (4 * through * fallen)))

    return SceneRow(group, name, scene, check, quick=quick)


def _resting() -> list[SceneRow]:
    return [
        _rests("column", "10 stones rest", column(10), 10),
        _rests("column", "100 stones rest", column(100), 100, quick=False),
        _rests("mass ratio", "heavy rests on light, 1 : 1e+06", column(2, 1e6), 2),
        _rests("mass ratio", "10 stones rest, 1 : 1e+06", column(10, 1e6), 10, quick=False),
        *(
            _rests("step", f"a wall rests, h = {step:g} s", wall(4, 4), 4, step=step, quick=step == 1e-5)
            for step in (1e-5, 1e-3, 1e-1)
        ),
        _rests("slabs 1:100", "six rest, crossed", slabs(6), 6),
        _rests("size", "a column of 1 mm rests", column(10, size=1e-3), 10, quick=False),
        _rests("size", "a column of 10 km rests", column(10, size=1e4), 10, quick=False),
        _rests("far", "a column rests 1e7 m away", moved(column(10), (1e7, 1e7, 0.0)), 10, quick=False),
    ]


def _moving(scene: Scene, steps: int, step: float = 1e-3) -> Scene:
    time = replace(scene.time, step=step, duration=steps * step, theta=0.5, stop_at_equilibrium=False)
    return replace(scene, time=time)


def _slab(friction: float, slope: float) -> Scene:
    slab = box("slab", [-0.5, -0.5, 0.0], [0.5, 0.5, 0.02])
    return _moving(standing((ground(), slab), friction=friction, slope=slope), 100)


def _reaches(speed: float, pace: float) -> Check:
    """The slab's velocity down the slope, in the time of the run, to 10⁻⁴ of a free one [m/s]."""

    def check(result: Result) -> float:
        return float(np.abs(result.frames[-1].velocities[1][:, 0] - speed).max()) / (1e-4 * pace)

    return check


def _edge_stays(result: Result) -> float:
    """The lower edge on which a cube turns stays, to 10⁻³ of its width, and the cube turns by 1° at least."""
    displacement = result.bodies[1].displacement
    low = np.isclose(result.bodies[1].reference[:, 2], 0.0) & np.isclose(
        result.bodies[1].reference[:, 0], 0.0
    )
    return max(float(np.abs(displacement[low]).max()) / 1e-3, 0.017 / float(np.abs(displacement).max()))


def _sliding() -> list[SceneRow]:
    time = 0.1

    def pulled(degrees: float, friction: float) -> float:
        angle = np.radians(degrees)
        return G * time * max(float(np.sin(angle) - friction * np.cos(angle)), 0.0)

    cube = box("cube", [-1.0, 0.0, 0.0], [0.0, 1.0, 1.0])
    return [
        *(
            SceneRow(
                "friction",
                f"μ = {mu:g}, a slab at {slope:g}°: {name}",
                _slab(mu, slope),
                _reaches(pulled(slope, mu), G * time),
                quick=slope != 84.6,
            )
            for mu, slope, name in (
                (0.0, 25.0, "a = g sin α"),
                (10.0, 84.0, "holds"),
                (10.0, 84.6, "slides"),
            )
        ),
        SceneRow(
            "friction",
            "μ = 10, a cube at 50°: topples",
            _moving(standing((ground(), cube), friction=10.0, slope=50.0), 200),
            _edge_stays,
            iterations=500,
            quick=False,
        ),
    ]


def _turned(block: Block, degrees: Sequence[float]) -> Block:
    """A stone turned about y and then about x [°]."""
    (cy, sy), (cx, sx) = ((np.cos(a), np.sin(a)) for a in np.radians(degrees))
    turn = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return replace(block, vertices=block.vertices @ turn.T)


def _scaled(stones: Sequence[Block], scale: float, friction: float, steps: int) -> Scene:
    """The stones in motion, lengths times `scale`, times as its root (Froude)."""
    time = float(np.sqrt(scale))
    factors = [time] * 3 + [1.0 / time] * 3
    scaled = [
        replace(
            stone,
            vertices=scale * stone.vertices,
            velocity=tuple(f * v for f, v in zip(factors, stone.velocity, strict=True)),
        )
        for stone in stones
    ]
    return _moving(standing(scaled, friction=friction), steps, 1e-3 * time)


def _bumping(scale: float) -> Scene:
    """A block that falls askew on another, slides off and rocks; without friction, so that velocities are unique."""
    lower, upper = box("lower", [0, 0, 0], [0.5, 0.4, 0.3]), box("upper", [0, 0, 0], [0.3, 0.3, 0.4])
    upper = moved([_turned(upper, (12.0, 0.0))], (0.15, 0.06, 0.37))[0]
    upper = replace(upper, velocity=(0.5, 0.1, 0.0, 0.0, 0.0, 0.4))
    return _scaled((ground(3.0), lower, upper), scale, 0.0, 200)


def _skidding(scale: float) -> Scene:
    """A block that lands on one corner and skids, μ = 0.3: one contact, so that velocities are unique."""
    block = _turned(box("block", [0, 0, 0], [0.3, 0.3, 0.4]), (30.0, 25.0))
    block = moved([block], (0.0, 0.0, 1e-3 - float(block.vertices[:, 2].min())))[0]
    return _scaled((ground(3.0), replace(block, velocity=(1.0, 0.5, 0.0, 0.0, 0.0, 0.4))), scale, 0.3, 150)


def _similar() -> list[SceneRow]:
    def moves(scale: float) -> Check:
        """It is a motion worth comparing."""
        return lambda result: 0.05 * scale / float(np.abs(result.bodies[-1].displacement).max())

    def row(group: str, name: str, scene: Scene, one: Scene, scale: float) -> SceneRow:
        return SceneRow(group, name, scene, moves(scale), one, scale, 1e-11, 1e-9, 300, quick=False)

    rows = []
    for name, make in (("bump, μ = 0", _bumping), ("skid on a corner", _skidding)):
        one = replace(make(1.0), name=name)
        rows += [row("size", f"{name}: {scale:g} m as 1 m", make(scale), one, scale) for scale in (1e-3, 1e4)]
        far = replace(one, blocks=moved(one.blocks, (1e7, 1e7, 0.0)))
        rows.append(row("far", f"{name}: 1e7 m away as at the origin", far, one, 1.0))
    return rows


def _elastic() -> list[SceneRow]:
    """Deformable stones that begin in equilibrium, and stay there: the ground bears the weight."""

    def check(result: Result) -> float:
        return max(result.errors.reaction / 1e-4, result.errors.balance / 1e-3)

    def row(name: str, blocks: Sequence[Block], step: float, quick: bool = False) -> SceneRow:
        scene = standing(blocks, steps=10, step=step, start=Start.EQUILIBRIUM)
        return SceneRow("stiffness", name, scene, check, quick=quick)

    return [
        *(
            row(f"E = {young:.0e} Pa rests", elastic_column(young), 1e-3, young == 1e9)
            for young in (1e6, 1e9, 1e12)
        ),
        *(row(f"E = 1e+10 Pa rests, h = {step:g} s", elastic_column(1e10), step) for step in (1e-5, 1e-1)),
        row("1 mm, E = 1e+12 Pa rests, h = 1e-05 s", elastic_column(1e12, 1e-3), 1e-5),
    ]


def _odd() -> list[SceneRow]:
    overlap = standing((ground(), box("stone", [0, 0, -0.01], [0.5, 0.4, 0.29])), steps=500, relaxation=True)
    weightless = replace(standing(column(3)), gravity=(0.0, 0.0, 0.0))
    roof = box("roof", [-1, -1, 0.3], [1, 1, 0.5], fidelity=Fidelity.FIXED)
    hangs = standing((roof, box("stone", [0, 0, 0], [0.5, 0.4, 0.3])), law=MortarJoint(0.0, 1e5, 0.0))
    return [
        SceneRow("overlap", "1 cm gives no push", overlap, _stays),
        SceneRow("weight", "none: nothing moves", weightless, _nothing_moves),
        SceneRow("cohesion", "a stone hangs by mortar, μ = 0", hangs, _hangs),
        SceneRow("conflict", "driven walls squeeze a stone", _squeezed(), _overlap_told, iterations=100),
    ]


def _stays(result: Result) -> float:
    return float(np.abs(result.bodies[1].displacement).max()) / 1e-9


def _nothing_moves(result: Result) -> float:
    return 0.0 if all(not body.displacement.any() for body in result.bodies) else np.inf


def _hangs(result: Result) -> float:
    return max(float(np.abs(result.bodies[1].displacement).max()) / 1e-6, result.errors.reaction / 1e-4)


def _squeezed() -> Scene:
    """A stone between two walls that are driven at it."""
    walls = [
        box(code, [low, 0, 0], [low + 0.5, 0.5, 0.5], fidelity=Fidelity.FIXED)
        for code, low in (("left", -0.5), ("right", 0.5))
    ]
    driven = tuple(
        ImposedMotion(frozenset({code}), History.constant([sign * _PACE, 0.0, 0.0]))
        for code, sign in (("left", 1.0), ("right", -1.0))
    )
    scene = standing((*walls, box("stone", [0, 0, 0], [0.5, 0.5, 0.5])), steps=10, step=_SQUEEZE / 10)
    return replace(scene, loads=Loads(motions=driven))


def _overlap_told(result: Result) -> float:
    """Both walls overlap with it by what they have come, and this is reported."""
    needed = _PACE * _SQUEEZE / 0.5
    return 0.99 * needed / result.errors.penetration if result.errors.penetration > 0 else np.inf
