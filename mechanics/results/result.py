"""Result of a simulation."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from mechanics.arrays import Array, Ints
from mechanics.dynamics.outcome import Outcome, StaticStart
from mechanics.results.contact_result import ContactResult, JointResult
from mechanics.results.stages import StageResult
from mechanics.results.stress_values import StressValues
from mechanics.scene.scene import Fidelity, Scene
from mechanics.stones.meshing.elements import Element


@dataclass(frozen=True)
class Errors:
    """Error measures of docs/theory.md §4, at the last step unless stated otherwise.

    Attributes
    ----------
    natural_map : η, largest over the last five steps, in which an equilibrium must last [-]
    penetration : deepest overlap over the smallest block's size, largest of the run [-]
    balance : unbalanced force of a block over its weight, largest over the blocks [-]
    reaction : |vertical support reaction - weight and vertical loads| over weight [-]
    energy : energy that no term of the balance explains, over the reference energy, whole run [-]
    unconverged_steps : steps whose solution is above the tolerance of the solver
    """

    natural_map: float
    penetration: float
    balance: float
    reaction: float
    energy: float
    unconverged_steps: int


@dataclass(frozen=True)
class BodyResult:
    """One block at the end of the run.

    Attributes
    ----------
    code, fidelity : as in the scene
    reference : (n, 3) points before the run: corners of a rigid block, mesh nodes of a deformable one [m]
    position : (n, 3) the same points now [m]
    faces : outward polygons on those points (the corners' polygons, or parts of the mesh's boundary facets)
    element : kind of the finite elements; None if rigid
    cells : (nc, k) node indices of the finite elements, in VTK's order; empty for rigid and fixed blocks
    stress : (n, 6) recovered nodal stress xx, yy, zz, xy, yz, zx in world axes [Pa]; None if rigid, or not requested
    von_mises : (n,) Von Mises stress of the recovered nodal stress [Pa]; None without stress
    principal : (n, 3) principal stresses of the same, largest first [Pa]; None without stress
    node_volume : (n,) volume of each node [m³]; None if rigid
    values : the stress in a few numbers; None without stress
    volume : [m³]
    mass : [kg]
    balance : unbalanced force, or moment over its smallest width, over its weight [-]
    """

    code: str
    fidelity: Fidelity
    reference: Array
    position: Array
    faces: tuple[tuple[int, ...], ...]
    element: Element | None
    cells: Ints
    stress: Array | None
    von_mises: Array | None
    principal: Array | None
    node_volume: Array | None
    values: StressValues | None
    volume: float
    mass: float
    balance: float

    @property
    def displacement(self) -> Array:
        """(n, 3) displacement of each point [m]."""
        return self.position - self.reference


@dataclass(frozen=True)
class Frame:
    """One instant.

    Attributes
    ----------
    time : [s]
    positions : of the points of each body, as in its BodyResult [m]
    velocities : (n, 3) of the same points [m/s]
    stresses : (n, 6) as in BodyResult; None without stress [Pa]
    stress_errors : as StressValues.error; None without stress [-]
    contacts : the contact points; joints of the start have the same numbers as at the end
    nodal_forces : (n, 3) of the contacts on the nodes of deformable stones, mean over the last step; None of others [N]
    """

    time: float
    positions: tuple[Array, ...]
    velocities: tuple[Array, ...]
    stresses: tuple[Array | None, ...]
    stress_errors: tuple[float | None, ...]
    contacts: ContactResult
    nodal_forces: tuple[Array | None, ...] = ()


@dataclass(frozen=True)
class StepHistory:
    """One value per step, of stones or of disks.

    Attributes
    ----------
    time : at the end of the step [s]
    kinetic : kinetic energy [J]
    speed : largest speed of a body's points [m/s]
    balance : largest unbalanced force over weight [-]
    natural_map : η after the solve [-]
    iterations : of the contact solver
    contacts : contact points
    penetration : deepest overlap at the end of the step [m]
    """

    time: Array
    kinetic: Array
    speed: Array
    balance: Array
    natural_map: Array
    iterations: Ints
    contacts: Ints
    penetration: Array


@dataclass(frozen=True)
class RunHistory(StepHistory):
    """One value per step.

    Attributes
    ----------
    settlement : largest displacement of a stone along gravity [m]
    """

    settlement: Array


@dataclass(frozen=True)
class Energies:
    """Energy balance of the whole run [J].

    Attributes
    ----------
    external : work of the weight, of the loads and of driven supports
    contact : work of the contacts; negative where they dissipate
    scheme : dissipation of the time integration, of Rayleigh damping and of the relaxation
    """

    external: float
    contact: float
    scheme: float


class Largest(NamedTuple):
    """Largest value of each body during a run.

    Attributes
    ----------
    value : (nb,) NaN where not known
    time : (nb,) of it [s]
    partner : (nb,) the other stone, where it is a value of a joint; -1 otherwise
    """

    value: Array
    time: Array
    partner: Ints


@dataclass(frozen=True)
class Peak:
    """Largest value of a number during a run, its time [s], and the value at the end."""

    value: float
    time: float
    end: float


@dataclass(frozen=True)
class Peaks:
    """Largest values of a whole run; those at its end stand in `Result`.

    They are taken in every step, except the stresses. Forces and pressures are means over a step.

    Attributes
    ----------
    displacement : of the points of stones that are not fixed [m]
    relative : the same seen from the supports, by the mean of their translations [m]
    relative_end : (nb,) that at the end [m]
    opening, sliding : of joints, as in `JointResult` [m]
    pressure : of joints that are not slivers, as `JointResult.pressure_max` [Pa]
    von_mises, tension, compression : largest in the frames of Von Mises stress, σ1 and -σ3; NaN without stress [Pa]
    reaction : of the supports against gravity [N]
    shear : of the supports across gravity: the base shear [N]
    """

    displacement: Largest
    relative: Largest
    relative_end: Array
    opening: Largest
    sliding: Largest
    pressure: Largest
    von_mises: Largest
    tension: Largest
    compression: Largest
    reaction: Peak
    shear: Peak


@dataclass(frozen=True)
class JointSeries:
    """Joints of the start between two of the chosen stones, step by step.

    Attributes
    ----------
    joint : (nj,) as in `JointResult`
    opening, sliding : (steps, nj) [m]
    normal, shear : (steps, nj) forces across, compression positive, and along the joint [N]
    """

    joint: Ints
    opening: Array
    sliding: Array
    normal: Array
    shear: Array


@dataclass(frozen=True)
class Series:
    """Motion of chosen stones, step by step, in the order of `Scene.series`.

    Attributes
    ----------
    body : (n,) indices into the scene's blocks
    start : (n, 3) centres of mass at the start [m]
    time : (steps,) [s]
    centre : (steps, n, 3) of mass [m]
    turn : (steps, n, 3) rotation vector since the start [rad]
    velocity : (steps, n, 6) translation [m/s] and rotation [rad/s], world axes
    joints : those between two of the stones
    """

    body: Ints
    start: Array
    time: Array
    centre: Array
    turn: Array
    velocity: Array
    joints: JointSeries


@dataclass(frozen=True)
class Result:
    """The end of a run, with its history.

    Attributes
    ----------
    scene : what was simulated
    outcome : verdict of the run
    reason : of the outcome, one clause; empty where it needs none
    cautions : facts without which the outcome misleads, the gravest first; they stand beside it wherever it is shown
    steps : time steps done
    time : simulated time [s]
    bodies : one per block, in the scene's order
    contacts : the contact points at the end
    joints : what each joint carries at the end
    errors : error measures
    energies : energy balance
    rest_time : start of the rest in which the run ended; None if it did not end at rest [s]
    reaction : total vertical support reaction [N]
    weight : total weight of the blocks that are not fixed [N]
    frames : the motion, at least its first and last instant
    history : one value per step
    wall_time : wall seconds by stage: mesh, start, assemble, detect, solve, advance, stress, confirm, checkpoint
    static : search for the equilibrium in which the run began; None if it began at rest
    solvers : number of steps by chosen method and reason, most frequent first
    peaks : largest values of the whole run
    series : motion of the stones of `Scene.series`; None without any
    stages : of a building in stages, those that were built; all else is of the last one
    repeated : the same run at half the step; None where it was not repeated
    """

    scene: Scene
    outcome: Outcome
    steps: int
    time: float
    bodies: tuple[BodyResult, ...]
    contacts: ContactResult
    joints: JointResult
    errors: Errors
    energies: Energies
    rest_time: float | None
    reaction: float
    weight: float
    frames: tuple[Frame, ...]
    history: RunHistory
    wall_time: dict[str, float]
    static: StaticStart | None = None
    solvers: Mapping[str, int] = field(default_factory=dict)
    reason: str = ""
    cautions: tuple[str, ...] = ()
    peaks: Peaks | None = None
    series: Series | None = None
    stages: tuple[StageResult, ...] = ()
    repeated: "Result | None" = None
