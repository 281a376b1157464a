"""The scene: everything that a simulation needs, and nothing that changes while it runs."""

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
    """How a block is modelled."""

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
    radius : of a ball, whose surface is the sphere about the mean of its corners; corners and faces are for pictures
        (mechanics.balls makes them) [m]. None: a polyhedron
    contact_size : target edge length at the faces that touch other blocks where the scene begins; None: as inside [m]
    growth : by how much edges get longer per metre away from these faces, up to the mesh size [-]
    mesher : of its tetrahedra
    stress : whether the stress of a deformable block is wanted; if not, it is not computed
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
    """Where the contact points of two flat faces lie."""

    CORNERS = "corners"
    INERTIA = "inertia"


@dataclass(frozen=True)
class LawRule:
    """The law between two groups of stones, given by their codes; it goes before the scene's general law."""

    first: frozenset[str]
    second: frozenset[str]
    law: Law


@dataclass(frozen=True)
class ContactSettings:
    """Contact between every pair of blocks.

    Attributes
    ----------
    law : where no rule says otherwise
    rules : laws of particular joints; of two that name the same pair, the later holds
    alert_distance : gap below which a contact is watched, relative to the smaller block's size [-]
    points : contact points of two rigid faces: 1, 3, 4 or 8, at most
    placement : *corners*: at the true edge of the common face, so that a stone rocks about its very edge; *inertia*:
        inside it, where they carry its area and its second moments exactly, as a uniform pressure does
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
    theta : integration parameter θ, 1/2 ≤ θ ≤ 1; 1 damps most and finds a static equilibrium
    duration : longest simulated time [s]
    relaxation : kinetic damping: all velocities are set to zero each time the kinetic energy has passed a peak;
        leads to a static equilibrium soonest, but the way there is no longer the true motion
    start : *rest*: all stones without stress, loads come at once; *equilibrium*: in the static equilibrium under the
        loads of the first instant, found at once where there is one
    lumped_mass : mass of deformable stones on the diagonal, instead of the consistent one
    stop_at_equilibrium : stop as soon as every block is at rest and in balance, or the scene has collapsed
    balance_tolerance : unbalanced force of a block over its weight below which it is in balance [-]
    collapse_displacement : a block that moved by more than this fraction of its smallest dimension
        while still moving counts as collapsed [-]
    sleep : unbalanced force over weight up to which a stone may sleep once it has come to rest; 0: none sleeps. Not in
        relaxations, and not in scenes with deformable stones [-]
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
    """How the contact problem of a step is solved."""

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
        interior-point, newton, cone (cone programmes: the reference). docs/theory.md §3 says which suits what
    tolerance : natural map η (unit-free) at which a step counts as solved [-]
    velocity_tolerance : largest velocity by which a contact may still break its law, over the largest velocity that
        the contacts have to stop [-]
    max_iterations : sweeps or iterations after which a step is left as it is and reported as not converged
    threads : that sweep rigid scenes of many contacts, or factorise deformable ones, at most; sweeps give the same to
        the last bit. More than one pays on idle cores only: where others use them, each waits for the slowest
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

    Attributes
    ----------
    name : shown in reports
    blocks : the stones; contacts are found between all pairs that are not both fixed
    gravity : (3,) acceleration [m/s²]
    contact, time, solver : settings
    loads : what acts besides gravity
    frame_every : keep a frame of the motion every so many steps; 0 keeps the first and last only
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
