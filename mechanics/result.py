"""What a simulation gives back."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from mechanics.meshing.elements import Element
from mechanics.scene import Fidelity, Scene
from mechanics.stress_values import StressValues

__all__ = [
    "BodyResult",
    "ContactResult",
    "Energies",
    "Errors",
    "Frame",
    "History",
    "JointResult",
    "Outcome",
    "Result",
    "StaticStart",
]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# by this much a number that may be at most one may exceed it
_ROUNDING = 1e-9


class Outcome(StrEnum):
    """How a run ended."""

    EQUILIBRIUM = "equilibrium"
    MOVING = "moving"
    COLLAPSED = "collapsed"


@dataclass(frozen=True)
class Errors:
    """The error measures of docs/theory.md §4, at the last step unless it says otherwise.

    Attributes
    ----------
    natural_map : η, largest over the last five steps, those in which an equilibrium must last [-]
    penetration : deepest overlap over the smallest block's size, largest of the run [-]
    balance : unbalanced force of a block over its weight, largest over the blocks [-]
    reaction : |vertical support reaction - weight| over weight [-]
    energy : energy that no term of the balance explains, over the reference energy, whole run [-]
    unconverged_steps : steps that the solver left above its tolerance
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
    stress : (n, 6) recovered nodal stress xx, yy, zz, xy, yz, zx in world axes [Pa]; None if rigid
    von_mises : (n,) Von Mises stress of the recovered nodal stress [Pa]; None if rigid
    principal : (n, 3) principal stresses of the same, largest first [Pa]; None if rigid
    node_volume : (n,) volume that each node stands for [m³]; None if rigid
    values : the stress in a few numbers; None if rigid
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
class ContactResult:
    """The contact points at one instant.

    Attributes
    ----------
    bodies : (nc, 2) indices into the scene's blocks: candidate, antagonist
    point : (nc, 3) [m]
    normal : (nc, 3) from antagonist to candidate [-]
    force : (nc, 3) mean force over the last step, on the candidate, world axes [N]
    gap : (nc,) [m]
    area : (nc,) tributary area; zero between edges [m²]
    pressure : (nc,) normal force over area; NaN between edges [Pa]
    opening : (nc,) how much its gap has grown since the start [m]
    slide : (nc,) how far its two material points have moved along each other since the start [m]
    status : (nc,) "open", "stick", "slip", "bonded" or "broken"
    joint : (nc,) the joint that it belongs to; -1: none, as between edges
    """

    bodies: Ints
    point: Array
    normal: Array
    force: Array
    gap: Array
    area: Array
    pressure: Array
    opening: Array
    slide: Array
    status: NDArray[np.str_]
    joint: Ints


@dataclass(frozen=True)
class JointResult:
    """The joints at the end of the run: pairs of flat faces of two stones that touch, or that touched at the start.

    Attributes
    ----------
    bodies : (nj, 2) indices into the scene's blocks, the lower first
    parted : (nj,) it was closed at the start and is now open beyond the distance in which contacts are watched; its
        polygon is that of the start, carried along by the second stone
    polygon : the common polygon of both faces, (k, 3) corners for each joint [m]
    frame : (nj, 3, 3) rows n, t1, t2; n from the second to the first stone, t1 along the larger second moment [-]
    centroid : (nj, 3) of the polygon [m]
    area : (nj,) [m²]
    second_moment : (nj, 2) ∫ y₁² and ∫ y₂² along t1 and t2 about the centroid [m⁴]
    force : (nj, 3) resultant on the first stone, world axes [N]
    moment : (nj, 3) about the centroid [N m]
    centre_of_pressure : (nj, 3) where the resultant meets the joint; NaN without compression [m]
    eccentricity : (nj, 2) the same from the centroid, along t1 and t2; NaN without compression [m]
    kern : (nj,) largest tension that a linear pressure would have, over the mean pressure: 0 if centred, up to 1
        within the kern; NaN without compression [-]
    edge : (nj,) how far out the centre of pressure lies: 0 at the centroid, 1 at the edge; NaN without compression [-]
    pressure_mean : (nj,) compression over area; negative: tension [Pa]
    pressure_max : (nj,) largest around a contact point, as mechanics.contact_patches has it [Pa]
    gap : (nj,) largest gap, not less than zero [m]
    opening : (nj,) by how much the gap has grown since the start, at most; of joints found later, their gap [m]
    sliding : (nj,) largest slide of a contact point since the start [m]
    slipping, open : (nj,) part of the area of the watched contact points that slips, or that bears nothing [-]
    friction_use : (nj,) shear force over what friction and cohesion can bear; NaN where that is nothing [-]
    """

    bodies: Ints
    parted: NDArray[np.bool_]
    polygon: tuple[Array, ...]
    frame: Array
    centroid: Array
    area: Array
    second_moment: Array
    force: Array
    moment: Array
    centre_of_pressure: Array
    eccentricity: Array
    kern: Array
    edge: Array
    pressure_mean: Array
    pressure_max: Array
    gap: Array
    opening: Array
    sliding: Array
    slipping: Array
    open: Array
    friction_use: Array

    def __len__(self) -> int:
        return len(self.bodies)

    @property
    def pressed(self) -> NDArray[np.bool_]:
        """(nj,) it bears compression."""
        return np.isfinite(self.kern)

    @property
    def in_kern(self) -> NDArray[np.bool_]:
        """(nj,) it bears compression, within the kern."""
        inside: NDArray[np.bool_] = self.kern <= 1.0 + _ROUNDING
        return inside


@dataclass(frozen=True)
class Frame:
    """One instant.

    Attributes
    ----------
    time : [s]
    positions : of the points of each body, as in its BodyResult [m]
    velocities : (n, 3) of the same points [m/s]
    stresses : (n, 6) as in BodyResult; None if rigid [Pa]
    stress_errors : as StressValues.error; None if rigid [-]
    contacts : the contact points; joints of the start have the same numbers as at the end
    """

    time: float
    positions: tuple[Array, ...]
    velocities: tuple[Array, ...]
    stresses: tuple[Array | None, ...]
    stress_errors: tuple[float | None, ...]
    contacts: ContactResult


@dataclass(frozen=True)
class History:
    """One value per step.

    Attributes
    ----------
    time : at the end of the step [s]
    kinetic : kinetic energy [J]
    speed : largest speed of a block's points [m/s]
    balance : largest unbalanced force over weight [-]
    natural_map : η after the solve [-]
    iterations : of the contact solver
    contacts : contact points
    penetration : deepest overlap at the end of the step [m]
    settlement : how far the stone that sank most has sunk along gravity [m]
    """

    time: Array
    kinetic: Array
    speed: Array
    balance: Array
    natural_map: Array
    iterations: Ints
    contacts: Ints
    penetration: Array
    settlement: Array


@dataclass(frozen=True)
class Energies:
    """Where the energy of the run came from and went, up to its end [J].

    Attributes
    ----------
    external : work of the weight, of the loads and of what drives supports
    contact : work of the contacts; negative: they dissipate
    scheme : dissipation of the time integration, of Rayleigh's damping and of the relaxation
    """

    external: float
    contact: float
    scheme: float


@dataclass(frozen=True)
class StaticStart:
    """How the static equilibrium was sought.

    Attributes
    ----------
    found : whether there is one; else the run begins with all stones at rest and without stress
    steps, iterations : of the search, and of its solver
    natural_map : η of the last step, r and u measured against the elastic part of W [-]
    balance : unbalanced force of a body over its weight, largest over the bodies [-]
    """

    found: bool
    steps: int
    iterations: int
    natural_map: float
    balance: float


@dataclass(frozen=True)
class Result:
    """The end of a run, with its history.

    Attributes
    ----------
    scene : what was simulated
    outcome : equilibrium, moving or collapsed
    steps : time steps done
    time : simulated time [s]
    bodies : one per block, in the scene's order
    contacts : the contact points at the end
    joints : what each joint carries at the end
    errors : how far the result can be trusted
    energies : where the energy went
    rest_time : when the spell of rest began in which the run ended; None if it did not end at rest [s]
    reaction : total vertical support reaction [N]
    weight : total weight of the blocks that are not fixed [N]
    frames : the motion, at least its first and last instant
    history : one value per step
    wall_time : wall seconds by stage: mesh, assemble, detect, solve, advance, stress
    static : the search for the equilibrium in which the run began; None if it began at rest
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
    history: History
    wall_time: dict[str, float]
    static: StaticStart | None = None
