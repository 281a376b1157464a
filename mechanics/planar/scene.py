"""The scene of the plane: disks and walls, laws, loads and settings; SI units, y up, angles counter-clockwise."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.law import Law
from mechanics.scene.loads.load import Loads
from mechanics.scene.scene import LawRule, Method, SolverSettings
from mechanics.stones.settings import check_settings


@dataclass(frozen=True)
class Disk:
    """A homogeneous disk.

    Attributes
    ----------
    code : its name, unique in a scene
    centre : (x, y) [m]
    radius : [m]
    density : [kg/m³]
    angle : [rad]
    velocity : vx, vy [m/s] and ω [rad/s]; zero if fixed
    fixed : impulses do not move it; a load may (`Loads.motions`)
    """

    code: str
    centre: tuple[float, float]
    radius: float
    density: float = 2400.0
    angle: float = 0.0
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    fixed: bool = False

    def __post_init__(self) -> None:
        where = f"disk {self.code!r}"
        for quantity, value, ok, remedy in (
            ("centre", self.centre, np.shape(self.centre) == (2,), "give x and y"),
            ("velocity", self.velocity, np.shape(self.velocity) == (3,), "give vx, vy and ω"),
            ("radius", self.radius, self.radius > 0, "give metres greater than 0"),
            ("density", self.density, self.density > 0, "give kg/m³ greater than 0"),
        ):
            if not ok:
                raise SceneError(f"{quantity} = {value!r}", where=where, remedy=remedy)
        _check_finite(where, *self.centre, *self.velocity, self.radius, self.density, self.angle)
        if self.fixed and any(self.velocity):
            raise SceneError(
                "fixed, and has a velocity", where=where, remedy="move it by a motion in the scene's loads"
            )


@dataclass(frozen=True)
class Wall:
    """A straight segment, met from both sides; fixed unless a load moves it (`Loads.motions`), or it has a mass.

    A wall with a mass moves by what pushes it, without turning: with a force on it, it is a piston or a platen. Disks
    stop it, other walls do not.

    A polyline is several walls that share end points. What rolls along it meets no end between two of them. What comes
    farther than its radius in a step may get through a wall if its law has restitution, which acts on closed contacts.

    Attributes
    ----------
    code : its name, unique in a scene
    start, end : (x, y) of its ends [m]
    mass : in the slice; 0: it is fixed [kg]
    """

    code: str
    start: tuple[float, float]
    end: tuple[float, float]
    mass: float = 0.0

    def __post_init__(self) -> None:
        where = f"wall {self.code!r}"
        if np.shape(self.start) != (2,) or np.shape(self.end) != (2,):
            raise SceneError(
                f"ends {self.start!r} and {self.end!r}", where=where, remedy="give x and y of each"
            )
        _check_finite(where, *self.start, *self.end, self.mass)
        if self.mass < 0:
            raise SceneError(f"mass = {self.mass!r}", where=where, remedy="give kg, or 0 for a fixed wall")
        if tuple(self.start) == tuple(self.end):
            raise SceneError("has no length", where=where, remedy="give two different ends")


def _check_finite(where: str, *values: float) -> None:
    if not np.isfinite(values).all():
        raise SceneError("has a value that is not finite", where=where, remedy="give numbers")


@dataclass(frozen=True)
class PlanarTime:
    """Time integration.

    Attributes
    ----------
    step : time step h [s]
    theta : integration parameter θ, 1/2 ≤ θ ≤ 1; 1/2 flies exactly, 1 lands without overlap and damps most
    duration : longest simulated time [s]
    stop_at_equilibrium : stop as soon as every disk is at rest and in balance
    balance_tolerance : unbalanced force of a disk over its weight below which it is in balance [-]
    """

    step: float = 1e-3
    theta: float = 1.0
    duration: float = 1.0
    stop_at_equilibrium: bool = True
    balance_tolerance: float = 1e-4

    def __post_init__(self) -> None:
        for quantity, value, ok, remedy in (
            ("step", self.step, 0 < self.step < np.inf, "give seconds greater than 0"),
            ("theta", self.theta, 0.5 <= self.theta <= 1, "give from 0.5 to 1"),
            ("duration", self.duration, 0 < self.duration < np.inf, "give seconds greater than 0"),
            ("balance_tolerance", self.balance_tolerance, self.balance_tolerance > 0, "give more than 0"),
        ):
            if not ok:
                raise SceneError(f"{quantity} = {value!r}", where="time", remedy=remedy)

    @property
    def steps(self) -> int:
        """Largest number of steps, 1 at least."""
        return max(1, round(self.duration / self.step))


@dataclass(frozen=True)
class PlanarScene:
    """Disks, walls, laws, loads and settings of one simulation.

    Attributes
    ----------
    name : shown in reports
    disks, walls : the bodies; contacts are found between disks, and between disks and walls
    gravity : (gx, gy) [m/s²]
    law : contact law where no rule says otherwise
    rules : laws between two groups of bodies, by their codes; of two that name the same pair, the later holds
    start_overlap : disks that overlap more at the start, or lie across a wall, are refused when the run begins
    largest_overlap : beyond it disks are moved apart after a step, at unchanged velocities; overlaps of the start stay
    alert_distance : gap below which a contact is watched, relative to the smaller radius [-]
    thickness : of the slice; masses and areas are for it [m]
    time, solver : settings; *auto* sweeps, and goes on with ADMM and Newton where 500 sweeps do not solve a step. Fewer
        `max_iterations` are sweeps alone, as slow flows of many disks are run
    min_sweeps : sweeps of each step at least, with the method nsgs
    start_iterations : of ADMM, at most, by which the forces of the disks at rest are found before the first step: a
        limited number of sweeps does not carry the weight of a hundred rows in one step; 0: it begins without forces
    loads : what acts besides gravity; the plane is z = 0 of their space, moments and turns are about z
    rolling : disks turn; False: their rotation is blocked, the limit of a strong resistance to rolling
    frame_every : keep a frame of the motion every so many steps; 0 keeps the first and last only
    """

    name: str
    disks: tuple[Disk, ...]
    walls: tuple[Wall, ...] = ()
    gravity: tuple[float, float] = (0.0, -9.81)
    law: Law = field(default_factory=DryJoint)
    rules: tuple[LawRule, ...] = ()
    alert_distance: float = 0.05
    start_overlap: Annotated[
        float,
        Setting(
            "Overlap at the start over the smaller radius beyond which the scene is refused; infinite: it never is.",
            "-",
            above=0,
            infinite=True,
        ),
    ] = 0.3
    largest_overlap: Annotated[
        float,
        Setting(
            "Overlap over the smallest radius that no step leaves: disks are moved apart; infinite: they never are.",
            "-",
            above=0,
            infinite=True,
        ),
    ] = 0.01
    thickness: float = 1.0
    time: PlanarTime = field(default_factory=PlanarTime)
    solver: SolverSettings = field(default_factory=SolverSettings)
    min_sweeps: int = 0
    start_iterations: int = 0
    loads: Loads = field(default_factory=Loads)
    rolling: bool = True
    frame_every: int = 0

    def __post_init__(self) -> None:
        if not self.disks:
            raise SceneError("the scene has no disks", where=self.name, remedy="give at least one")
        codes = self.codes
        distinct = set(codes)
        if len(distinct) < len(codes):
            repeated = sorted(code for code, times in Counter(codes).items() if times > 1)
            raise SceneError(f"codes used twice: {', '.join(repeated)}", where=self.name)
        for quantity, value, ok, remedy in (
            ("gravity", self.gravity, np.isfinite(self.gravity).all(), "give two numbers"),
            ("alert_distance", self.alert_distance, 0 <= self.alert_distance < np.inf, "give 0 or more"),
            ("thickness", self.thickness, 0 < self.thickness < np.inf, "give metres greater than 0"),
            (
                "min_sweeps",
                self.min_sweeps,
                self.min_sweeps == 0
                or (0 < self.min_sweeps <= self.solver.max_iterations and self.solver.method is Method.NSGS),
                "give 0, or up to max_iterations with the method nsgs",
            ),
            (
                "start_iterations",
                self.start_iterations,
                self.start_iterations >= 0,
                "give 0 or a number of iterations",
            ),
            ("frame_every", self.frame_every, self.frame_every >= 0, "give 0 or a number of steps"),
        ):
            if not ok:
                raise SceneError(f"{quantity} = {value!r}", where=self.name, remedy=remedy)
        check_settings(self.name, self)
        self._check_named(distinct)

    def _check_named(self, bodies: set[str]) -> None:
        """Check that rules and loads name bodies of the scene, and motions only fixed ones."""
        named = [(rule.first | rule.second, "a contact rule") for rule in self.rules]
        named += [(force.stones, "a force") for force in self.loads.forces]
        named += [(motion.stones, "a motion") for motion in self.loads.motions]
        for codes, what in named:
            missing = sorted(codes - bodies)
            if missing:
                raise SceneError(f"{what} names {missing[0]!r}, which is not there", where=self.name)
        free = {disk.code for disk in self.disks if not disk.fixed}
        free |= {wall.code for wall in self.walls if wall.mass > 0}
        disks, driven = {disk.code for disk in self.disks}, set[str]()
        for motion in self.loads.motions:
            for code in sorted(motion.stones):
                if code in free:
                    what = "disk" if code in disks else "wall"
                    remedy = "fix it" if code in disks else "give it no mass"
                    raise SceneError(
                        "has an imposed motion, but is not fixed", where=f"{what} {code!r}", remedy=remedy
                    )
                if code in driven:
                    raise SceneError(f"{code!r} has two imposed motions", where=self.name)
                driven.add(code)

    @property
    def codes(self) -> list[str]:
        """Codes of all bodies: disks, then walls; bodies are numbered in this order."""
        return [disk.code for disk in self.disks] + [wall.code for wall in self.walls]
