"""Protocol of the experiments: a sample of a certain shape, and walls and loads that deform it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from mechanics.arrays import Array
from mechanics.planar.scene import Wall
from mechanics.scene.loads.load import Loads
from pipelines.geology.observe import Fields


@dataclass(frozen=True)
class Setup:
    """Walls and loads of an experiment on a sample.

    Attributes
    ----------
    walls : in the order in which results name them
    loads : motions and forces of walls
    smooth : codes of walls without friction
    weightless : nothing weighs any more once the sample is deposited
    rough : disks that stand on y = 0 at the start are glued to it
    membrane : pressure of a membrane on the sides of the sample; 0: there is none [Pa]
    """

    walls: tuple[Wall, ...]
    loads: Loads
    smooth: frozenset[str] = frozenset()
    weightless: bool = False
    rough: bool = False
    membrane: float = 0.0


class Experiment(Protocol):
    """An experiment, made of its table in the scene file."""

    @property
    def length(self) -> float:
        """Length of the box in which the sample is deposited [m]."""

    @property
    def highest(self) -> float:
        """Largest height of the sample [m]."""

    def top(self, x: Array) -> Array:
        """Return the height of the sample at places along x, to which it is cut [m]."""

    def setup(self, step: float, duration: float) -> Setup:
        """Return the walls and loads of a run with this time step and duration [s]."""

    def phases(self, duration: float) -> Mapping[str, tuple[float, float]]:
        """Return the beginning and end of each phase of the run by its name [s]."""

    def measures(
        self, start: Array, radius: Array, instants: Sequence[Fields], whole: Mapping[str, Array]
    ) -> Mapping[str, float]:
        """Return what the experiment is made for, by name with the unit.

        Parameters
        ----------
        start : (nd, 2) centres at the start [m]
        radius : (nd,) [m]
        instants : those that were kept
        whole : columns of the rows of the whole sample
        """


@runtime_checkable
class Observed(Protocol):
    """An experiment that observes more than its cells at each row, as the front of a fold."""

    def observables(self, start: Array, now: Array, radius: Array, time: float) -> Mapping[str, float]:
        """Return what is observed at one instant, by name with the unit; always the same names.

        Parameters
        ----------
        start, now : (nd, 2) centres [m]
        radius : (nd,) [m]
        time : [s]
        """
