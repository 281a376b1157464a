"""One judge for every program: how well a run solved its contact problems, from its motion and its contacts alone."""

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import ClassVar

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.scenes import BlockScene
from mechanics.arrays import Array, Bools, Ints
from mechanics.delassus.rigid import RigidDelassus, schedule
from mechanics.problem.problem import ContactProblem
from mechanics.problem.residual import natural_map
from mechanics.stones.polyhedra import mass_properties

_ARRAYS = ("cpu", "sweeps", "centre", "frame", "contacts", "solved", "compliant")


@dataclass(frozen=True)
class Touch:
    """The contacts of one step, at the instant where they were found.

    Attributes
    ----------
    body : (nc, 2) candidate and antagonist
    point : (nc, 3) [m]
    frame : (nc, 3, 3) rows n and two tangents; n points from the antagonist to the candidate
    gap : (nc,) [m]
    force : (nc, 3) mean force of the step on the candidate, in that frame [N]
    """

    body: Ints
    point: Array
    frame: Array
    gap: Array
    force: Array


@dataclass(frozen=True)
class Trace:
    """One run.

    Attributes
    ----------
    cpu : (n,) processor time of each step, user and system [s]
    sweeps : (n,) passes of Gauss–Seidel in each step; -1 unknown
    centre : (n+1, nb, 3) a point of each body at the start and after each step [m]
    frame : (n+1, nb, 3, 3) three axes of each body in rows, turning with it; that of the start alone if unknown [-]
    kept : contacts of some steps, counted from 1
    program : name and version of what ran
    contacts : (n,) their number in each step; -1 unknown
    solved : (n,) steps that met their tolerance within their limit of sweeps
    compliant : (n,) steps that needed compliant joints
    """

    cpu: Array
    sweeps: Ints
    centre: Array
    frame: Array
    kept: dict[int, Touch]
    program: str
    contacts: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    solved: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool))
    compliant: Bools = field(default_factory=lambda: np.zeros(0, dtype=bool))


def read_trace(path: Path) -> Trace:
    """Read what a run has written."""
    with np.load(path) as data:
        kept = {
            int(n): Touch(*(data[f"{key}_{n}"] for key in ("body", "point", "frame", "gap", "force")))
            for n in data["kept"]
        }
        arrays = {key: data[key] for key in _ARRAYS}
        return Trace(kept=kept, program=str(data["program"]), **arrays)


@dataclass(frozen=True)
class Verdict:
    """Outcome that a run reached; the largest of the steps at its end, whose contacts were kept.

    Attributes
    ----------
    contacts : number of contact points at the end
    eta_first, eta : natural map of the step's contact problem at the impulses of the run; of the first step, and at
        the end [-]
    penetration : deepest overlap at the end of a step over the smallest block size [-]
    drift : largest mean velocity of a corner over one step [m/s]
    displacement : of a corner since the start, largest [m]
    balance : force that is left on a block over its weight, or moment over weight × size [-]
    reaction : |support reaction - weight| / weight [-]
    momentum : largest mismatch of M Δv and the impulses, weight included, over the weight's; whether motion and
        contacts were read rightly [-]
    """

    contacts: int
    eta_first: float
    eta: float
    penetration: float
    drift: float
    displacement: float
    balance: float
    reaction: float
    momentum: float


@dataclass(frozen=True)
class _Instant:
    """A body's motion at one step, from the trace: states before and after."""

    centre: Array
    rotation: Array
    before: Array
    after: Array


class Judge:
    """Knows a scene's masses, and judges the runs of it.

    Parameters
    ----------
    scene : the blocks
    step, theta : h [s] and θ
    """

    MEASURES: ClassVar = tuple(one.name for one in fields(Verdict))
    """Names of what is judged."""

    def __init__(self, scene: BlockScene, step: float, theta: float) -> None:
        properties = [
            mass_properties(v, f, "block") for v, f in zip(scene.vertices, scene.faces, strict=True)
        ]
        self._scene, self._step, self._theta = scene, step, theta
        self._centre = np.array([p.centroid for p in properties])
        self._mass = scene.density * np.array([p.volume for p in properties])
        self._inertia = scene.density * np.array([p.inertia for p in properties])
        self._moving = ~scene.support
        self.size = min(
            _width(vertices, faces) for vertices, faces in zip(scene.vertices, scene.faces, strict=True)
        )

    def __call__(self, trace: Trace) -> Verdict:
        """Judge one run."""
        centre, rotation = self._motion(trace)
        velocity = self._velocities(centre, rotation)
        corners = [self._corners(centre[n], rotation[n]) for n in (0, -2, -1)]
        steps = {
            n: self._judge_step(touch, _Instant(centre[n - 1], rotation[n - 1], velocity[n - 1], velocity[n]))
            for n, touch in trace.kept.items()
        }
        last = [value for n, value in steps.items() if n > 1] or list(steps.values())
        eta, penetration, balance, reaction, momentum = np.array(last).max(axis=0)
        return Verdict(
            contacts=len(trace.kept[max(trace.kept)].gap),
            eta_first=steps[min(steps)][0],
            eta=eta,
            penetration=max(penetration, 0.0),
            drift=float(np.linalg.norm(corners[2] - corners[1], axis=1).max()) / self._step,
            displacement=float(np.linalg.norm(corners[2] - corners[0], axis=1).max()),
            balance=balance,
            reaction=reaction,
            momentum=momentum,
        )

    def _motion(self, trace: Trace) -> tuple[Array, Array]:
        """Centres of mass (n+1, nb, 3) and rotations from the start (n+1, nb, 3, 3)."""
        rotation = trace.frame.transpose(0, 1, 3, 2) @ trace.frame[0]
        offset = self._centre - trace.centre[0]
        return trace.centre + np.einsum("nbij,bj->nbi", rotation, offset), rotation

    def _velocities(self, centre: Array, rotation: Array) -> Array:
        """(n+1, nb, 6) at the ends of the steps: q_{i+1} - q_i = h [θ v_{i+1} + (1-θ) v_i], from rest."""
        turns = rotation[1:] @ rotation[:-1].transpose(0, 1, 3, 2)
        vectors = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_rotvec().reshape(*turns.shape[:2], 3)
        mean = np.concatenate([np.diff(centre, axis=0), vectors], axis=2) / self._step
        velocity = np.zeros((len(centre), centre.shape[1], 6))
        for n, one in enumerate(mean):
            velocity[n + 1] = (one - (1 - self._theta) * velocity[n]) / self._theta
        return velocity

    def _corners(self, centre: Array, rotation: Array) -> Array:
        """Corners (nv, 3) of all blocks that move."""
        blocks = zip(self._scene.vertices, self._centre, centre, rotation, self._moving, strict=True)
        return np.concatenate([c + (v - c0) @ turn.T for v, c0, c, turn, moving in blocks if moving])

    def _judge_step(self, touch: Touch, at: _Instant) -> tuple[float, ...]:
        """η, penetration, balance, reaction and momentum of one step."""
        h, theta, moving = self._step, self._theta, self._moving
        centre = at.centre + h * (1 - theta) * at.before[:, :3]
        turn = Rotation.from_rotvec(h * (1 - theta) * at.before[:, 3:]).as_matrix() @ at.rotation
        operator = self._operator(touch, centre, turn)
        impulse = h * touch.force
        free = at.before.copy()
        free[moving, 2] -= h * self._scene.gravity
        u_free = operator.relative_velocity(free)
        none = np.zeros(len(touch.gap))
        bias = np.maximum(touch.gap, 0.0) / h
        friction = np.full(len(touch.gap), self._scene.friction)
        problem = ContactProblem(operator, u_free, bias, friction, none)
        u_n = operator.apply(impulse)[:, 0] + u_free[:, 0]
        # at its end the flight after the kick has changed the gap by hθ u_N
        overlap = float(np.max(-(touch.gap + h * theta * u_n), initial=0.0)) / self.size
        kick = (free + operator.rigid_change(impulse) - at.after)[moving]
        mismatch = max(np.abs(kick[:, :3]).max(), self.size * np.abs(kick[:, 3:]).max())
        balance, reaction = self._equilibrium(touch, centre)
        return natural_map(problem, impulse), overlap, balance, reaction, mismatch / (h * self._scene.gravity)

    def _operator(self, touch: Touch, centre: Array, rotation: Array) -> RigidDelassus:
        arms = touch.point[:, None] - centre[touch.body]
        inverse = rotation @ np.linalg.inv(self._inertia) @ rotation.transpose(0, 2, 1)
        upper = np.triu_indices(3)
        inertia = np.column_stack([1.0 / self._mass, inverse[:, upper[0], upper[1]]])
        inertia[~self._moving] = 0.0
        geometry = np.column_stack([touch.frame.reshape(-1, 9), arms.reshape(-1, 6)])
        body = touch.body.astype(np.int64)
        return RigidDelassus(body, geometry, inertia, schedule(body, self._moving))

    def _equilibrium(self, touch: Touch, centre: Array) -> tuple[float, float]:
        """Largest force or moment left on a block, and the error of the support reaction."""
        force = np.einsum("ckj,ck->cj", touch.frame, touch.force)
        wrench = np.zeros((len(centre), 6))
        for side, sign in ((0, 1.0), (1, -1.0)):
            body = touch.body[:, side]
            moment = np.cross(touch.point - centre[body], sign * force)
            np.add.at(wrench, body, np.column_stack([sign * force, moment]))
        weight = self._mass * self._scene.gravity
        carried = -wrench[~self._moving, 2].sum()
        whole = weight[self._moving].sum()
        wrench[:, 2] -= weight
        left = wrench[self._moving] / weight[self._moving, None]
        worst = max(
            np.linalg.norm(left[:, :3], axis=1).max(), np.linalg.norm(left[:, 3:], axis=1).max() / self.size
        )
        return worst, abs(carried / whole - 1)


def _width(vertices: Array, faces: tuple[tuple[int, ...], ...]) -> float:
    """Smallest width of a convex block across its faces."""
    normals = np.array(
        [np.cross(vertices[f[1]] - vertices[f[0]], vertices[f[2]] - vertices[f[0]]) for f in faces]
    )
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    along = vertices @ normals.T
    return float((along.max(axis=0) - along.min(axis=0)).min())
