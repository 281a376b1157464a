"""Scene: all input of a simulation, constant during a run."""

from dataclasses import dataclass, field
from enum import StrEnum

from mechanics.arrays import Array
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.loads.load import Loads
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers.choice import Mesher
from mechanics.stones.validation import check_corners, finite, refuse_unless, sane
from moma.errors import SceneError

__all__ = [
    "Block",
    "ContactSettings",
    "Fidelity",
    "LawRule",
    "Method",
    "Part",
    "Placement",
    "Scene",
    "SolverSettings",
    "Start",
    "TimeSettings",
]


# numbers of contact points that two faces can have
_POINTS = (1, 3, 4, 8)


class Fidelity(StrEnum):
    """Mechanical model of a block."""

    FIXED = "fixed"
    RIGID = "rigid"
    DEFORMABLE = "deformable"


@dataclass(frozen=True)
class Part:
    """A convex part of a stone: corners (nv, 3) [m], and faces counter-clockwise seen from outside."""

    vertices: Array
    faces: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class Block:
    """One stone; convex, or a union of convex parts.

    Attributes
    ----------
    code : the stone's name, unique in a scene
    vertices : (nv, 3) corners [m]
    faces : vertex indices of each planar face, counter-clockwise seen from outside
    material : density and elasticity
    fidelity : fixed, rigid or deformable
    mesh_size : target edge length of the finite elements [m]; only for deformable blocks
    element : kind of its finite elements; hexahedra suit blocks whose corners each join three faces
    velocity : (6,) initial translation [m/s] and rotation [rad/s] velocity; not for fixed blocks
    parts : convex parts that fill a non-convex stone without overlap; empty if it is convex
    radius : of a ball, whose surface is the sphere about the mean of its corners; corners and faces serve pictures only
        (`mechanics.model.balls.ball`) [m]. None: a polyhedron
    contact_size : target edge length at the faces that touch other blocks at the start; None: as inside [m]
    growth : growth of the edge length per metre of distance from these faces, up to the mesh size [-]
    mesher : of its tetrahedra
    stress : compute the stress of a deformable block
    """

    code: str
    vertices: Array
    faces: tuple[tuple[int, ...], ...]
    material: Material
    fidelity: Fidelity = Fidelity.RIGID
    mesh_size: float | None = None
    element: Element = Element.TET4
    velocity: tuple[float, ...] = (0.0,) * 6
    parts: tuple[Part, ...] = ()
    radius: float | None = None
    contact_size: float | None = None
    growth: float = 0.5
    mesher: Mesher = Mesher.AUTO
    stress: bool = True

    def __post_init__(self) -> None:
        where, metres = f"stone {self.code}", "give metres greater than 0"
        check_corners(where, self.vertices)
        for part in self.parts:
            check_corners(where, part.vertices)
        refuse_unless(
            where,
            (
                ("velocity", self.velocity, finite(self.velocity, 6), "give six numbers"),
                ("mesh_size", self.mesh_size, self.mesh_size is None or sane(self.mesh_size), metres),
                (
                    "contact_size",
                    self.contact_size,
                    self.contact_size is None or sane(self.contact_size),
                    metres,
                ),
                ("growth", self.growth, sane(self.growth), "give a number greater than 0"),
                ("radius", self.radius, self.radius is None or sane(self.radius), metres),
            ),
        )


class Placement(StrEnum):
    """Placement of the contact points of two flat faces."""

    CORNERS = "corners"
    INERTIA = "inertia"


@dataclass(frozen=True)
class LawRule:
    """Law between two groups of stones, given by their codes; it precedes the scene's general law."""

    first: frozenset[str]
    second: frozenset[str]
    law: Law


@dataclass(frozen=True)
class ContactSettings:
    """Contact between every pair of blocks.

    Attributes
    ----------
    law : of all joints without a rule
    rules : laws of particular joints; of two for the same pair, the later holds
    alert_distance : gap below which a contact is watched, relative to the smaller block's size [-]
    points : largest number of contact points of two rigid faces: 1, 3, 4 or 8
    placement : *corners*: on the edge of the common face, so that a stone rocks about its true edge; *inertia*: inside
        it, where they reproduce its area and second moments exactly, as a uniform pressure does
    """

    law: Law = field(default_factory=DryJoint)
    rules: tuple[LawRule, ...] = ()
    alert_distance: float = 0.05
    points: int = 4
    placement: Placement = Placement.CORNERS

    def __post_init__(self) -> None:
        refuse_unless(
            "contact",
            (
                ("points", self.points, self.points in _POINTS, "give 1, 3, 4 or 8"),
                ("alert_distance", self.alert_distance, sane(self.alert_distance), "give more than 0"),
            ),
        )


class Start(StrEnum):
    """The state in which a run begins."""

    REST = "rest"
    EQUILIBRIUM = "equilibrium"


@dataclass(frozen=True)
class TimeSettings:
    """Time integration.

    Attributes
    ----------
    step : time step h [s]
    theta : integration parameter θ, 1/2 ≤ θ ≤ 1; 1 damps most and leads to a static equilibrium
    duration : longest simulated time [s]
    relaxation : kinetic damping: all velocities are set to zero each time the kinetic energy has passed a peak; the
        fastest way to a static equilibrium, but not the true motion
    start : *rest*: all stones without stress, loads applied at once; *equilibrium*: the static equilibrium under the
        loads of the first instant, solved for directly, where there is one
    lumped_mass : mass of deformable stones on the diagonal, instead of the consistent one
    stop_at_equilibrium : stop as soon as every block is at rest and in balance, or the scene has collapsed
    balance_tolerance : unbalanced force of a block over its weight, below which it is in balance [-]
    collapse_displacement : displacement over the smallest dimension of a block, above which it counts as collapsed if
        it still moves [-]
    sleep : unbalanced force over weight up to which a stone at rest may sleep; 0: no stone sleeps. Without effect in
        relaxations and in scenes with deformable stones [-]
    """

    step: float = 1e-3
    theta: float = 1.0
    duration: float = 1.0
    relaxation: bool = False
    start: Start = Start.REST
    lumped_mass: bool = False
    stop_at_equilibrium: bool = True
    balance_tolerance: float = 1e-4
    collapse_displacement: float = 0.5
    sleep: float = 0.0

    def __post_init__(self) -> None:
        refuse_unless(
            "time",
            (
                ("step", self.step, sane(self.step), "give seconds greater than 0"),
                ("theta", self.theta, 0.5 <= self.theta <= 1, "give from 0.5 to 1"),
                ("duration", self.duration, sane(self.duration), "give seconds greater than 0"),
                (
                    "balance_tolerance",
                    self.balance_tolerance,
                    self.balance_tolerance > 0,
                    "give a number greater than 0",
                ),
                (
                    "collapse_displacement",
                    self.collapse_displacement,
                    self.collapse_displacement > 0,
                    "give a number greater than 0",
                ),
                ("sleep", self.sleep, 0 <= self.sleep < 1, "give from 0 up to 1"),
            ),
        )


class Method(StrEnum):
    """Solver of the contact problem of a step."""

    AUTO = "auto"
    NSGS = "nsgs"
    ADMM = "admm"
    APGD = "apgd"
    INTERIOR_POINT = "interior-point"
    NEWTON = "newton"
    CONE = "cone"


@dataclass(frozen=True)
class SolverSettings:
    """Solver of the contact problem of each step.

    Attributes
    ----------
    method : auto chooses; nsgs (Gauss–Seidel), admm (alternating directions), apgd (accelerated projected gradients),
        interior-point, newton, cone (cone programmes: the reference); docs/theory.md §3 compares them
    tolerance : natural map η (unit-free) at which a step counts as solved [-]
    velocity_tolerance : largest velocity by which a contact may violate its law, over the largest velocity that the
        contacts have to stop [-]
    max_iterations : sweeps or iterations after which a step is accepted as it is and reported as not converged
    threads : largest number of threads that sweep rigid scenes of many contacts, or factorise deformable ones; results
        of sweeps do not depend on it. More than one pays on idle cores only, as each thread waits for the slowest
    """

    method: Method = Method.AUTO
    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    threads: int = 1

    def __post_init__(self) -> None:
        refuse_unless(
            "solver",
            (
                ("tolerance", self.tolerance, 0 < self.tolerance < 1, "give a number between 0 and 1"),
                (
                    "velocity_tolerance",
                    self.velocity_tolerance,
                    self.velocity_tolerance > 0,
                    "give a number greater than 0",
                ),
                ("max_iterations", self.max_iterations, self.max_iterations >= 1, "give 1 or more"),
                ("threads", self.threads, self.threads >= 1, "give 1 or more"),
            ),
        )


@dataclass(frozen=True)
class Scene:
    """Bodies, laws, loads and settings of one simulation.

    >>> import numpy as np
    >>> from mechanics.stones.materials import Material
    >>> corners, faces = np.vstack([np.zeros(3), np.eye(3)]), ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2))
    >>> stone = Block("tetrahedron", corners, faces, Material("stone", density=2000.0, young=10e9, poisson=0.2))
    >>> scene = Scene("fall", (stone,), time=TimeSettings(step=2e-3))
    >>> len(scene.blocks), scene.time.step
    (1, 0.002)

    Attributes
    ----------
    name : shown in reports
    blocks : the stones; contacts are detected between all pairs that are not both fixed
    gravity : (3,) acceleration [m/s²]
    contact, time, solver : settings
    loads : all loads besides gravity
    frame_every : number of steps between two frames of the motion; 0 keeps the first and last only
    """

    name: str
    blocks: tuple[Block, ...]
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    contact: ContactSettings = field(default_factory=ContactSettings)
    time: TimeSettings = field(default_factory=TimeSettings)
    solver: SolverSettings = field(default_factory=SolverSettings)
    loads: Loads = field(default_factory=Loads)
    frame_every: int = 0

    def __post_init__(self) -> None:
        codes = [block.code for block in self.blocks]
        if not codes:
            raise SceneError("the scene has no blocks", where=self.name, remedy="select at least one stone")
        repeated = sorted({code for code in codes if codes.count(code) > 1})
        if repeated:
            raise SceneError(f"block codes used twice: {', '.join(repeated)}", where=self.name)
        refuse_unless(
            self.name,
            (
                ("gravity", self.gravity, finite(self.gravity, 3), "give three numbers"),
                ("frame_every", self.frame_every, self.frame_every >= 0, "give 0 or a number of steps"),
            ),
        )
