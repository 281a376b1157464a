"""Blocks, scenes and motions of the validation cases."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mechanics.arrays import Array
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.model.model import Model, build_model
from mechanics.scene import shapes
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import (
    ContactSettings,
    Fidelity,
    Method,
    Scene,
    SolverSettings,
    TimeSettings,
)
from mechanics.scene.shapes import BOX_FACES, box_corners
from mechanics.stones.materials import Material

FACES, CORNERS = BOX_FACES, box_corners((0, 0, 0), (1, 1, 1))
STONE = Material("stone", density=2400.0, young=10e9, poisson=0.2)
G = 9.81


def box(code, low, high, material=STONE, fidelity=Fidelity.RIGID, mesh_size=None, velocity=(0.0,) * 6):
    """An axis-parallel block from corner `low` to corner `high` [m]."""
    return shapes.box(code, low, high, material, fidelity=fidelity, mesh_size=mesh_size, velocity=velocity)


def ground(half=5.0, depth=1.0):
    """A fixed block whose top is z = 0."""
    return box("ground", [-half, -half, -depth], [half, half, 0.0], fidelity=Fidelity.FIXED)


def tilted_gravity(degrees):
    """Gravity as a plane tilted by an angle about y feels it; x points down the slope."""
    angle = np.radians(degrees)
    return (G * float(np.sin(angle)), 0.0, -G * float(np.cos(angle)))


def rotation(axis, degrees):
    """The rotation matrix (3, 3) about an axis (3,) by an angle."""
    x, y, z = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    angle = np.radians(degrees)
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew


def moved(block, turn=None, shift=(0.0, 0.0, 0.0), *, scale=1.0, mirrored=False):
    """A block scaled about the origin, mirrored in y, turned by `turn` (3, 3) and then shifted by `shift` (3,) [m].

    Velocities go along as in a scene of the same gravity: lengths as `scale`, times as its root (Froude).
    """
    turn = np.eye(3) if turn is None else np.asarray(turn)
    mirror = np.diag([1.0, -1.0 if mirrored else 1.0, 1.0])
    linear, angular = np.array(block.velocity[:3]), np.array(block.velocity[3:])
    # the rotation velocity is an axial vector
    angular = np.linalg.det(mirror) * turn @ mirror @ angular / np.sqrt(scale)
    linear = turn @ mirror @ linear * np.sqrt(scale)
    return replace(
        block,
        vertices=scale * block.vertices @ mirror.T @ turn.T + np.asarray(shift),
        faces=tuple(face[::-1] if mirrored else face for face in block.faces),
        velocity=(*linear, *angular),
    )


def dynamic(
    name,
    blocks,
    *,
    friction=0.6,
    restitution=0.0,
    gravity=(0.0, 0.0, -G),
    step=1e-3,
    theta=0.5,
    duration=1.0,
    tolerance=1e-10,
    max_iterations=2000,
    method=Method.NSGS,
    **settings,
):
    """A scene in true motion that does not stop before its time is over.

    Few stones are solved soonest by sweeps alone; many want Method.AUTO.
    """
    return Scene(
        name,
        tuple(blocks),
        gravity=tuple(gravity),
        contact=ContactSettings(DryJoint(friction, restitution=restitution)),
        time=TimeSettings(step, theta, duration, stop_at_equilibrium=False),
        solver=SolverSettings(method, tolerance=tolerance, max_iterations=max_iterations),
        **settings,
    )


@dataclass(frozen=True)
class Path:
    """A motion step by step; row 0 is the start.

    Attributes
    ----------
    model : what moved
    time : (n,) [s]
    centre : (n, nb, 3) [m]
    rotation : (n, nb, 3, 3) since the start [-]
    velocity : (n, nb, 6) [m/s], [rad/s]
    iterations : (n-1,) of the solver
    natural_map : (n-1,) η after each solve [-]
    gap : (n-1,) smallest at the end of each step [m]
    support : (n-1, 3) sum of the contact forces of fixed bodies on the others [N]
    bend : (n-1,) most energy that the curvature of the paths of held points can let in [J]: a point of arm R that is
        held after a kick moves at h ω² R before the next, so a contact may work by ½ ‖r‖ h ω² R, of first order in h
    last : the last step
    """

    model: Model
    time: Array
    centre: Array
    rotation: Array
    velocity: Array
    iterations: Array
    natural_map: Array
    gap: Array
    support: Array
    bend: Array
    last: Step

    @property
    def momentum(self) -> Array:
        """Linear momentum of all bodies that move (n, 3) [N s]."""
        mass = np.where(self.model.fixed, 0.0, self.model.mass)
        return np.einsum("b,nbi->ni", mass, self.velocity[..., :3])

    @property
    def angular_momentum(self) -> Array:
        """Angular momentum about the origin (n, 3) [N m s]."""
        mass = np.where(self.model.fixed, 0.0, self.model.mass)
        orbital = np.einsum("b,nbi->ni", mass, np.cross(self.centre, self.velocity[..., :3]))
        return orbital + self.spin.sum(axis=1)

    @property
    def spin(self) -> Array:
        """Angular momentum of each body about its own centre (n, nb, 3) [N m s]."""
        inertia = np.where(self.model.fixed[:, None, None], 0.0, self.model.inertia.inertia)
        local = np.einsum("nbji,nbj->nbi", self.rotation, self.velocity[..., 3:])
        return np.einsum("nbij,bjk,nbk->nbi", self.rotation, inertia, local)

    @property
    def kinetic(self) -> Array:
        """Kinetic energy (n,) [J]."""
        mass = np.where(self.model.fixed, 0.0, self.model.mass)
        linear = np.einsum("b,nbi,nbi->n", mass, self.velocity[..., :3], self.velocity[..., :3])
        return 0.5 * (linear + np.einsum("nbi,nbi->n", self.spin, self.velocity[..., 3:]))

    @property
    def potential(self) -> Array:
        """Energy of the weight (n,) [J]."""
        mass = np.where(self.model.fixed, 0.0, self.model.mass)
        return -np.einsum("b,nbi,i->n", mass, self.centre, self.model.scene.gravity)

    @property
    def made(self) -> Array:
        """Energy gained in each step beyond `bend` (n-1,), which nothing may give [J]."""
        gained: Array = np.diff(self.kinetic + self.potential) - self.bend
        return gained

    def corners(self, body) -> Array:
        """The corners of a body (n, nv, 3) [m]."""
        start = self.model.scene.blocks[body].vertices - self.centre[0, body]
        return self.centre[:, None, body] + np.einsum("nij,vj->nvi", self.rotation[:, body], start)


def follow(scene: Scene, until: Callable[[Step], bool] | None = None) -> Path:
    """Run a scene step by step for its duration, or until `until` is true of a step, and keep the whole motion."""
    model, state = build_model(scene)
    simulation = Simulation(model, state)
    states, rows = [state], []
    for _ in range(round(scene.time.duration / scene.time.step)):
        step = simulation.step()
        states.append(step.after)
        bodies = step.contacts.bodies
        sign = model.fixed[bodies[:, 1]].astype(float) - model.fixed[bodies[:, 0]]
        solution = step.solution
        rows.append(
            (
                solution.iterations,
                solution.natural_map,
                np.min(step.gap, initial=np.inf),
                *(sign @ step.force),
                _bend(scene.time.step, step),
            )
        )
        if until is not None and until(step):
            break
    table = np.array(rows)
    return Path(
        model,
        np.array([s.time for s in states]),
        np.array([s.centre for s in states]),
        np.array([s.rotation for s in states]),
        np.array([s.velocity for s in states]),
        table[:, 0],
        table[:, 1],
        table[:, 2],
        table[:, 3:6],
        table[:, 6],
        step,
    )


def _bend(duration, step):
    """Σ ½ ‖r‖ h ω² R over the contacts of one step, both sides [J]."""
    rates = np.maximum(*(np.sum(s.velocity[:, 3:] ** 2, axis=1) for s in (step.before, step.after)))
    arms = np.linalg.norm(step.contacts.arm, axis=2)
    pushes = np.linalg.norm(step.impulse, axis=1)
    return 0.5 * duration * float(pushes @ (rates[step.contacts.bodies] * arms).sum(axis=1))
