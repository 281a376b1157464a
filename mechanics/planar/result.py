"""Results of a simulation of the plane."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechanics.arrays import Array, Ints
from mechanics.dynamics.outcome import Outcome
from mechanics.planar.scene import PlanarScene
from mechanics.results.result import Errors, StepHistory


@dataclass(frozen=True)
class PlanarContactResult:
    """The contact points at the end of the run.

    Attributes
    ----------
    bodies : (nc, 2) candidate and antagonist: disks, then walls, in the scene's order
    point, normal : (nc, 2) [m], and from antagonist to candidate [-]
    force : (nc, 2) mean force over the last step, on the candidate, in x and y [N]
    gap : (nc,) [m]
    area : (nc,) [m²]
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
class PlanarFrame:
    """The motion at one instant: `position` (nb, 3) is x, y [m] and the angle [rad] of each body."""

    time: float
    position: Array


@dataclass(frozen=True)
class PlanarInstant:
    """The bodies, contacts and forces at the end of a step, for observers.

    Attributes
    ----------
    step : its number, from 1
    time : [s]
    position : (nb, 3) x, y [m] and angle [rad] of disks, then walls
    velocity : (nb, 3) vx, vy [m/s] and ω [rad/s]
    contacts : the contact points, with the mean forces over the step
    """

    step: int
    time: float
    position: Array
    velocity: Array
    contacts: PlanarContactResult


@dataclass(frozen=True)
class PlanarHistory(StepHistory):
    """One value per step; penetration is over the width of the smaller disk [-].

    Attributes
    ----------
    overlap, mean_overlap : deepest overlap at the end of the step, and their mean over the contacts that touch [m]
    lifted : work against the loads by moving disks apart that overlap too far; mostly potential energy [J]
    """

    overlap: Array
    mean_overlap: Array
    lifted: Array


@dataclass(frozen=True)
class PlanarResult:
    """The end of a run, with its history.

    Attributes
    ----------
    scene : what was simulated
    outcome : equilibrium, moving, or interrupted where its user stopped it
    steps, time : time steps done, and simulated time [s]
    position : (nb, 3) x, y [m] and angle [rad] of disks, then walls
    velocity : (nb, 3) vx, vy [m/s] and ω [rad/s]
    contacts : the contact points at the end
    errors : how far the result can be trusted
    reaction : force of fixed and driven bodies against gravity [N]
    weight : of the disks that are not fixed [N]
    frames : the motion, at least its first and last instant
    history : one value per step
    wall_time : wall seconds by stage: detect, assemble, solve, advance, observe, checkpoint
    """

    scene: PlanarScene
    outcome: Outcome
    steps: int
    time: float
    position: Array
    velocity: Array
    contacts: PlanarContactResult
    errors: Errors
    reaction: float
    weight: float
    frames: tuple[PlanarFrame, ...]
    history: PlanarHistory
    wall_time: dict[str, float]
