"""Scene: all input of a simulation, constant during a run."""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Annotated

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.loads.load import Loads
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from mechanics.stones.meshing.meshers.choice import Mesher
from mechanics.stones.settings import check_settings
from mechanics.stones.validation import check_corners, finite, refuse_unless

ContactSize = Annotated[
    float | None,
    Setting(
        "Target edge length at faces that touch other stones; if not given, or larger, `size`.", "m", above=0
    ),
]
Growth = Annotated[
    float,
    Setting(
        "Increase of edge length per unit of distance from these faces, until it reaches `size`.",
        "-",
        above=0,
    ),
]


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
    mesh_size : only for deformable blocks
    element : kind of its finite elements; hexahedra suit blocks whose corners each join three faces
    velocity : (6,) initial translation [m/s] and rotation [rad/s] velocity; not for fixed blocks
    parts : convex parts that fill a non-convex stone without overlap; empty if it is convex
    radius : of a ball, whose surface is the sphere about the mean of its corners; corners and faces serve pictures only
        (`mechanics.model.balls.ball`) [m]. None: a polyhedron
    contact_size : target edge length at the faces that touch other blocks at the start; None: as inside [m]
    mesher : of its tetrahedra
    stress : compute the stress of a deformable block
    """

    code: str
    vertices: Array
    faces: tuple[tuple[int, ...], ...]
    material: Material
    fidelity: Fidelity = Fidelity.RIGID
    mesh_size: Annotated[
        float | None, Setting("Target edge length of the finite elements.", "m", above=0)
    ] = None
    element: Element = Element.TET4
    velocity: tuple[float, ...] = (0.0,) * 6
    parts: tuple[Part, ...] = ()
    radius: Annotated[float | None, Setting("Radius of a ball.", "m", above=0)] = None
    contact_size: ContactSize = None
    growth: Growth = 0.5
    mesher: Mesher = Mesher.AUTO
    stress: bool = True

    def __post_init__(self) -> None:
        where = f"stone {self.code}"
        check_corners(where, self.vertices)
        for part in self.parts:
            check_corners(where, part.vertices)
        refuse_unless(where, [("velocity", self.velocity, finite(self.velocity, 6), "give six numbers")])
        check_settings(where, self)


class Placement(StrEnum):
    """Placement of the contact points of two flat faces."""

    CORNERS = "corners"
    INERTIA = "inertia"
    CENTROID = "centroid"
    AREA = "area"


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
    placement : *corners*: on the edge of the common face, so that a stone rocks about its true edge; *inertia*: inside
        it, where they reproduce its area and second moments exactly, as a uniform pressure does; *centroid*: corners,
        and a further point at the centroid, which take shares of the area that carry its second moments, so that
        elastic joints bend like the area and stones still rock about its edge; *area*: one in each cell of a grid, so
        that elastic joints also gap and crush like the area, and one in each corner, about which stones rock. The grid
        lies along the longest edge of the smaller face, from its corner, with two or more cells each way, and stays
        with that face as stones slide and rock
    spacing : the number of cells along a face is its length over `spacing`, rounded up; a joint of two faces has two
        or more each way, of an area of its own
    thickness : of the mortar between two blocks, by their codes, for laws whose stiffness depends on it; by the code of
        one alone, towards blocks that have no outline, such as a base or a beam [m]
    """

    law: Law = field(default_factory=DryJoint)
    rules: tuple[LawRule, ...] = ()
    thickness: Mapping[frozenset[str], float] = field(default_factory=dict)
    alert_distance: Annotated[
        float,
        Setting(
            "Gap below which a contact is watched, relative to the smaller stone's size.",
            "-",
            above=0,
            at_most=1,
        ),
    ] = 0.05
    points: Annotated[
        int,
        Setting(
            "Contact points of two flat faces; at its corners, more where the edge of the common face needs more.",
            choices=(1, 3, 4, 8),
        ),
    ] = 4
    placement: Annotated[
        Placement,
        Setting(
            "corners: at the true edge of the common face; inertia: inside it, where they carry its second moments; "
            "centroid: corners and centroid, which together bend like the face where joints are elastic; "
            "area: corners, and cells all over it, `spacing` wide, so that elastic joints open and crush like the face."
        ),
    ] = Placement.CORNERS
    spacing: Annotated[
        float | None,
        Setting("Largest distance between points where placement is area, which needs it.", "m", above=0),
    ] = None

    def __post_init__(self) -> None:
        check_settings("contact", self)
        for pair, thickness in self.thickness.items():
            if len(pair) not in (1, 2) or not 0.0 < thickness < math.inf:
                raise SceneError(
                    f"thickness {thickness!r} of the joint between {' and '.join(sorted(pair))}",
                    where="contact",
                    remedy="give one code or two, and a thickness greater than 0 [m]",
                )
        if self.placement is Placement.AREA and self.spacing is None:
            raise SceneError(
                'placement = "area" without spacing',
                where="contact",
                remedy="give the largest distance between points, such as a quarter of a stone's length [m]",
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
    theta : 1 leads to a static equilibrium
    relaxation : the fastest way to a static equilibrium, but not the true motion
    start : *rest*: all stones without stress; *equilibrium*: solved for directly, where there is one
    sleep : without effect in relaxations and in scenes with deformable stones
    """

    step: Annotated[float, Setting("Time step h.", "s", above=0)] = 1e-3
    theta: Annotated[float, Setting("θ of the scheme; 1 damps most.", "-", at_least=0.5, at_most=1)] = 1.0
    duration: Annotated[float, Setting("Longest simulated time.", "s", above=0)] = 1.0
    relaxation: Annotated[
        bool,
        Setting("Kinetic damping: all velocities become zero when the kinetic energy has passed a peak."),
    ] = False
    start: Annotated[
        Start,
        Setting(
            "rest: all loads come at once; equilibrium: the stones already bear the loads of the first instant."
        ),
    ] = Start.REST
    lumped_mass: Annotated[
        bool, Setting("Mass of deformable stones at their nodes alone, not along the shape functions.")
    ] = False
    stop_at_equilibrium: Annotated[
        bool, Setting("Stop once every stone is at rest and in balance, or the scene has collapsed.")
    ] = True
    balance_tolerance: Annotated[
        float,
        Setting(
            "Unbalanced force of a stone over its weight below which it is in balance.",
            "-",
            above=0,
            infinite=True,
        ),
    ] = 1e-4
    collapse_displacement: Annotated[
        float,
        Setting(
            "A stone that has sunk by more than this fraction of its width, and falls or lies there, has collapsed.",
            "-",
            above=0,
            infinite=True,
        ),
    ] = 0.5
    sleep: Annotated[
        float,
        Setting(
            "Unbalanced force of a stone over its weight up to which it may sleep once it rests; 0: none sleeps.",
            "-",
            at_least=0,
            at_most=0.1,
        ),
    ] = 0.0

    def __post_init__(self) -> None:
        check_settings("time", self)

    @property
    def steps(self) -> int:
        """Largest number of steps, 1 at least."""
        return max(1, round(self.duration / self.step))


class Method(StrEnum):
    """Solver of the contact problem of a step."""

    AUTO = "auto"
    NSGS = "nsgs"
    ADMM = "admm"
    INTERIOR_POINT = "interior-point"
    NEWTON = "newton"


@dataclass(frozen=True)
class SolverSettings:
    """Solver of the contact problem of each step; docs/theory.md §3 states where each method is strong.

    Attributes
    ----------
    threads : also those that factorise deformable scenes, and iterate between 1,000 moving rigid stones or more. More
        than one pays on idle cores only, as each waits for the slowest
    """

    method: Annotated[
        Method,
        Setting(
            "auto chooses; nsgs: Gauss–Seidel; admm: alternating directions, rigid stones; interior-point; newton."
        ),
    ] = Method.AUTO
    tolerance: Annotated[
        float, Setting("Natural map η at which a step is solved.", "-", above=0, below=1)
    ] = 1e-6
    velocity_tolerance: Annotated[
        float,
        Setting(
            "Largest velocity by which a contact may break its law, over the largest that contacts have to stop; "
            "between rigid stones of a relaxation at most a tenth of `balance_tolerance`.",
            "-",
            above=0,
            infinite=True,
        ),
    ] = 1e-5
    max_iterations: Annotated[
        int,
        Setting("Iterations after which a step is left as it is, and reported as not converged.", at_least=1),
    ] = 2000
    joint_compliance: Annotated[
        float,
        Setting(
            "Compliance of joints over that of stones in one step, where a step with rigid joints cannot be solved and "
            "`method` is auto; 0: joints stay rigid.",
            "-",
            at_least=0,
            at_most=0.1,
        ),
    ] = 1e-3
    threads: Annotated[
        int,
        Setting(
            "Threads that find, sweep and iterate over the contacts of large rigid scenes, and factorise deformable "
            "ones; the results are the same to the last bit.",
            at_least=1,
        ),
    ] = 1
    motion_error: Annotated[
        float | None,
        Setting(
            "Displacement by which the motion of rigid stones may be wrong in the end because of the solver; "
            "without it, all steps keep to both tolerances. Steps at rest always do.",
            "m",
            above=0,
        ),
    ] = None

    def __post_init__(self) -> None:
        check_settings("solver", self)


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
    series : codes of the blocks whose motion is kept in every step
    """

    name: str
    blocks: tuple[Block, ...]
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    contact: ContactSettings = field(default_factory=ContactSettings)
    time: TimeSettings = field(default_factory=TimeSettings)
    solver: SolverSettings = field(default_factory=SolverSettings)
    loads: Loads = field(default_factory=Loads)
    frame_every: int = 0
    series: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        codes = [block.code for block in self.blocks]
        if not codes:
            raise SceneError("the scene has no blocks", where=self.name, remedy="select at least one stone")
        repeated = sorted(code for code, count in Counter(codes).items() if count > 1)
        if repeated:
            raise SceneError(f"block codes used twice: {', '.join(repeated)}", where=self.name)
        refuse_unless(
            self.name,
            (
                ("gravity", self.gravity, finite(self.gravity, 3), "give three numbers"),
                ("frame_every", self.frame_every, self.frame_every >= 0, "give 0 or a number of steps"),
            ),
        )
        unknown = sorted(set(self.series) - set(codes))
        if unknown:
            raise SceneError(f"series names no block: {', '.join(unknown)}", where=self.name)

    @property
    def rigid(self) -> "Scene":
        """The same scene with rigid stones in the place of those that deform."""
        blocks = tuple(
            replace(block, fidelity=Fidelity.RIGID) if block.fidelity is Fidelity.DEFORMABLE else block
            for block in self.blocks
        )
        return replace(self, blocks=blocks)

    @property
    def steady(self) -> bool:
        """True where loads and supports do not change, and no stone begins in motion."""
        return not self.loads.until and not any(any(block.velocity) for block in self.blocks)
