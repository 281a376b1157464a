"""Elastic blocks, their scenes at rest and in motion, and means of their stress."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array, Bools
from mechanics.dynamics.simulation import Simulation
from mechanics.dynamics.step import Step
from mechanics.model.model import Model, build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.scene import ContactSettings, Fidelity, Scene, SolverSettings, TimeSettings
from mechanics.scene.shapes import box
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from tests.validation.scenes import G

ELEMENTS = [*Element]


def elastic_box(code, low, high, material, size, element=Element.HEX8, velocity=(0.0,) * 6):
    """An axis-parallel deformable block from corner `low` to corner `high` [m]."""
    more = {"mesh_size": size, "element": element, "velocity": velocity}
    return box(code, low, high, material, fidelity=Fidelity.DEFORMABLE, **more)


def resting(
    name, blocks, law: Law | None = None, *, step=2e-3, duration=2.0, gravity=(0.0, 0.0, -G),
    tolerance=1e-7, max_iterations=2000, balance=1e-4, rules=(), loads=None,
):  # fmt: skip
    """The result of a run that ends in the static equilibrium, if there is one."""
    scene = Scene(
        name,
        tuple(blocks),
        gravity=tuple(gravity),
        contact=ContactSettings(law or DryJoint(0.6), rules=tuple(rules)),
        time=TimeSettings(step, 1.0, duration, relaxation=True, balance_tolerance=balance),
        solver=SolverSettings(tolerance=tolerance, max_iterations=max_iterations),
        **({} if loads is None else {"loads": loads}),
    )
    return simulate(scene)


def cell_volumes(body) -> Array:
    """(nc,) of the parallelepipeds or tetrahedra of a body's mesh before the run [m³]."""
    nodes = body.reference[body.cells]
    # the corners next to corner 0 in VTK's order
    tetrahedra = body.cells.shape[1] in (4, 10)
    along = (1, 2, 3) if tetrahedra else (1, 3, 4)
    edges = np.stack([nodes[:, k] - nodes[:, 0] for k in along], axis=1)
    return np.abs(np.linalg.det(edges)) / (6.0 if tetrahedra else 1.0)


def mean_stress(body) -> Array:
    """Mean (6,) of the recovered stress over the volume, linear between the corners of the cells [Pa]."""
    corners = 4 if body.cells.shape[1] in (4, 10) else 8
    volume = cell_volumes(body)
    return volume @ body.stress[body.cells[:, :corners]].mean(axis=1) / volume.sum()


def mean_between(body, low, high) -> Array:
    """Mean (6,) of the recovered stress over the cells whose middle lies between two heights [Pa]."""
    corners = 4 if body.cells.shape[1] in (4, 10) else 8
    middle = body.reference[body.cells[:, :corners], 2].mean(axis=1)
    part = cell_volumes(body) * ((middle > low) & (middle < high))
    return part @ body.stress[body.cells[:, :corners]].mean(axis=1) / part.sum()


def inner(body, margin) -> Bools:
    """(n,) which nodes lie farther than `margin` from the block's sides, in x and y [m]."""
    low, high = body.reference.min(axis=0) + margin, body.reference.max(axis=0) - margin
    inside = (body.reference > low) & (body.reference < high)
    return inside[:, 0] & inside[:, 1]


def joint_force(result, first, second) -> Array:
    """Total force (3,) that body `second` puts on body `first` (indices) [N]."""
    bodies, force = result.contacts.bodies, result.contacts.force
    sign = ((bodies == [first, second]).all(axis=1)).astype(float)
    sign -= (bodies == [second, first]).all(axis=1)
    return sign @ force


def base_force(result) -> Array:
    """Total force (3,) of the fixed bodies on the others [N]."""
    fixed = np.array([body.fidelity is Fidelity.FIXED for body in result.bodies])
    bodies = result.contacts.bodies
    return (fixed[bodies[:, 1]].astype(float) - fixed[bodies[:, 0]]) @ result.contacts.force


@dataclass(frozen=True)
class ElasticPath:
    """A motion of a scene with one deformable body, step by step; row 0 is the start.

    Attributes
    ----------
    model : what moved
    body : index of the deformable body
    time : (n,) [s]
    node : (n, nn, 3) places of its nodes [m]
    velocity : (n, nn, 3) [m/s]
    support : (n-1, 3) force of fixed bodies on the others [N]
    natural_map : (n-1,) η after each solve [-]
    last : the last step
    """

    model: Model
    body: int
    time: Array
    node: Array
    velocity: Array
    support: Array
    natural_map: Array
    last: Step

    @property
    def _mass(self):
        return self.model.stones[self.body].operators.mass

    @property
    def momentum(self) -> Array:
        """p (n, 3) of the body [N s]."""
        return np.array([(self._mass @ v.ravel()).reshape(-1, 3).sum(axis=0) for v in self.velocity])

    @property
    def angular_momentum(self) -> Array:
        """Of the body about the origin (n, 3) [N m s]."""
        return np.array(
            [
                np.cross(x, (self._mass @ v.ravel()).reshape(-1, 3)).sum(axis=0)
                for x, v in zip(self.node, self.velocity, strict=True)
            ]
        )

    @property
    def kinetic(self) -> Array:
        """(n,) [J]."""
        return np.array([0.5 * v.ravel() @ (self._mass @ v.ravel()) for v in self.velocity])


def elastic_follow(scene: Scene, body=None, start=None) -> ElasticPath:
    """Run a scene for its duration and keep the motion of its deformable body.

    `start`: a function that gives the places and velocities of the nodes from those of a scene at rest.
    """
    model, state = build_model(scene)
    if start is not None:
        state = start(model, state)
    simulation = Simulation(model, state)
    index = next(b for b, stone in enumerate(model.stones) if stone is not None) if body is None else body
    rows = model.nodes_of(index)
    states, support, eta = [state], [], []
    for _ in range(round(scene.time.duration / scene.time.step)):
        step = simulation.step()
        states.append(step.after)
        bodies = step.contacts.bodies
        sign = model.fixed[bodies[:, 1]].astype(float) - model.fixed[bodies[:, 0]]
        support.append(sign @ step.force)
        eta.append(step.solution.natural_map)
    return ElasticPath(
        model,
        index,
        np.array([s.time for s in states]),
        np.array([s.node[rows] for s in states]),
        np.array([s.node_velocity[rows] for s in states]),
        np.array(support),
        np.array(eta),
        step,
    )


def bar(length, side, material, size, element=Element.HEX8, velocity=(0.0,) * 6):
    """A bar about the origin along x."""
    half = np.array([length, side, side]) / 2
    return elastic_box("bar", -half, half, material, size, element, velocity)


SOFT = Material("soft", density=2000.0, young=1e9, poisson=0.0)
