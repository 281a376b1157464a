"""Arrays of a scene of the plane: those that stay constant while it runs, and the state."""

from dataclasses import dataclass

import numpy as np

from ground.errors import SceneError
from mechanics.arrays import Array, Bools
from mechanics.planar.scene import PlanarScene
from mechanics.scene.laws.table import LawTable, law_table

_BLOCKED = 1e9  # of the moment of inertia of disks that do not turn [-]


@dataclass(frozen=True)
class PlanarState:
    """Places and velocities of the bodies; disks first, then walls.

    Attributes
    ----------
    time : [s]
    centre : (nb, 2) of a wall, the middle of its ends [m]
    angle : (nb,) [rad]
    velocity : (nb, 3) vx, vy [m/s] and ω [rad/s]
    """

    time: float
    centre: Array
    angle: Array
    velocity: Array


@dataclass(frozen=True)
class PlanarModel:
    """Constant data of a scene of the plane.

    Attributes
    ----------
    scene : it
    radius : (nd,) [m]
    mass, moment : (nb,) in the slice; the moment of inertia is ½ m R² of a disk, and of a wall that of a rod, although
        none turns: its contacts have no lever [kg, kg m²]
    fixed : (nb,) bodies that impulses do not move
    inertia : (nb, 2) 1/mass and 1/moment, zero for fixed bodies
    half : (nw, 2) from the middle of a wall to its second end, at angle 0 [m]
    laws : contact laws, and between which bodies they hold
    """

    scene: PlanarScene
    radius: Array
    mass: Array
    moment: Array
    fixed: Bools
    inertia: Array
    half: Array
    laws: LawTable

    @property
    def walls_move(self) -> bool:
        """Truth of walls that change their places: they are driven, or have a mass."""
        return bool(self.scene.loads.motions) or not self.fixed[len(self.radius) :].all()

    def ends(self, state: PlanarState) -> Array:
        """Return the ends of the walls (nw, 2, 2) [m]."""
        nd = len(self.radius)
        turn, middle = state.angle[nd:], state.centre[nd:]
        half = np.column_stack(
            [
                np.cos(turn) * self.half[:, 0] - np.sin(turn) * self.half[:, 1],
                np.sin(turn) * self.half[:, 0] + np.cos(turn) * self.half[:, 1],
            ]
        )
        return np.stack([middle - half, middle + half], axis=1)


def build_planar_model(scene: PlanarScene) -> tuple[PlanarModel, PlanarState]:
    """Build the arrays of a scene, and its state at the start."""
    disks, nw = scene.disks, len(scene.walls)
    radius = np.array([disk.radius for disk in disks], dtype=float)
    density = np.array([disk.density for disk in disks], dtype=float)
    walls = np.array([(wall.start, wall.end) for wall in scene.walls], dtype=float).reshape(-1, 2, 2)
    none = np.zeros(nw)
    of_walls = np.array([wall.mass for wall in scene.walls], dtype=float)
    mass = np.append(density * scene.thickness * np.pi * radius**2, of_walls)
    half = 0.5 * (walls[:, 1] - walls[:, 0])
    moment = mass * np.append(0.5 * radius**2, (half**2).sum(axis=1) / 3.0)
    if not scene.rolling:
        moment[: len(disks)] *= _BLOCKED
    fixed = np.append([disk.fixed for disk in disks], of_walls == 0.0)
    inertia = np.zeros((len(fixed), 2))
    inertia[~fixed] = np.column_stack([1.0 / mass[~fixed], 1.0 / moment[~fixed]])
    model = PlanarModel(scene, radius, mass, moment, fixed, inertia, half, _laws(scene))
    start = PlanarState(
        0.0,
        np.vstack([np.array([disk.centre for disk in disks], dtype=float), walls.mean(axis=1)]),
        np.append([float(disk.angle) for disk in disks], none),
        np.vstack([np.array([disk.velocity for disk in disks], dtype=float), np.zeros((nw, 3))]),
    )
    return model, start


def _laws(scene: PlanarScene) -> LawTable:
    codes = scene.codes
    rules = [
        (
            np.array([code in rule.first for code in codes]),
            np.array([code in rule.second for code in codes]),
            rule.law,
        )
        for rule in scene.rules
    ]
    laws = law_table(scene.law, rules, len(codes))
    if laws.sprung:
        raise SceneError(
            "a law with springs",
            where=scene.name,
            remedy="joints of stones alone have stiffness; give disks a dry, a mortar or a cohesive law",
        )
    return laws
