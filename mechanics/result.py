"""What a simulation gives back."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from mechanics.scene import Fidelity, Scene

__all__ = ["BodyResult", "ContactResult", "Energies", "Errors", "Frame", "History", "Outcome", "Result"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


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
    faces : outward polygons on those points (the corners' polygons, or the mesh's boundary triangles)
    cells : (nc, k) node indices of the finite elements, in VTK's order; empty for rigid and fixed blocks
    stress : (n, 6) recovered nodal stress xx, yy, zz, xy, yz, zx in world axes [Pa]; None if rigid
    von_mises : (n,) Von Mises stress of the recovered nodal stress [Pa]; None if rigid
    volume : [m³]
    mass : [kg]
    balance : unbalanced force, or moment over its smallest width, over its weight [-]
    """

    code: str
    fidelity: Fidelity
    reference: Array
    position: Array
    faces: tuple[tuple[int, ...], ...]
    cells: Ints
    stress: Array | None
    von_mises: Array | None
    volume: float
    mass: float
    balance: float

    @property
    def displacement(self) -> Array:
        """(n, 3) displacement of each point [m]."""
        return self.position - self.reference


@dataclass(frozen=True)
class ContactResult:
    """The contact points at the end of the run.

    Attributes
    ----------
    bodies : (nc, 2) indices into the scene's blocks: candidate, antagonist
    point : (nc, 3) [m]
    normal : (nc, 3) from antagonist to candidate [-]
    force : (nc, 3) mean force over the last step, on the candidate, world axes [N]
    gap : (nc,) [m]
    area : (nc,) tributary area [m²]
    status : (nc,) "open", "stick", "slip", "bonded" or "broken"
    """

    bodies: Ints
    point: Array
    normal: Array
    force: Array
    gap: Array
    area: Array
    status: NDArray[np.str_]


@dataclass(frozen=True)
class Frame:
    """The motion at one instant: positions[i] are the points of body i, as in its BodyResult."""

    time: float
    positions: tuple[Array, ...]


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
    errors : how far the result can be trusted
    energies : where the energy went
    rest_time : when the spell of rest began in which the run ended; None if it did not end at rest [s]
    reaction : total vertical support reaction [N]
    weight : total weight of the blocks that are not fixed [N]
    frames : the motion, at least its first and last instant
    history : one value per step
    wall_time : wall seconds by stage: mesh, assemble, detect, solve, advance, stress
    """

    scene: Scene
    outcome: Outcome
    steps: int
    time: float
    bodies: tuple[BodyResult, ...]
    contacts: ContactResult
    errors: Errors
    energies: Energies
    rest_time: float | None
    reaction: float
    weight: float
    frames: tuple[Frame, ...]
    history: History
    wall_time: dict[str, float]
