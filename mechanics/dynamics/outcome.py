"""Start and end of a run; a light module, so that results and reports load quickly."""

from dataclasses import dataclass
from enum import StrEnum


class Outcome(StrEnum):
    """End of a run.

    *Equilibrium*: the stones stand as they are drawn, by forces that arise from nothing. *Settled*: they have come to
    rest elsewhere. *Moving*: they have done neither, nor fallen. *Undecided*: the steps that would decide were not
    solved, or deformable stones rest where rigid ones in their place fall. *Interrupted*: ended by its user before its
    time.
    """

    EQUILIBRIUM = "equilibrium"
    SETTLED = "settled"
    MOVING = "moving"
    COLLAPSED = "collapsed"
    UNDECIDED = "undecided"
    INTERRUPTED = "interrupted"

    @property
    def rests(self) -> bool:
        """True where all stones have come to rest without a fall."""
        return self in (Outcome.EQUILIBRIUM, Outcome.SETTLED)

    @property
    def decided(self) -> bool:
        """True where it is known whether the stones stand: they rest, or have collapsed."""
        return self.rests or self is Outcome.COLLAPSED


@dataclass(frozen=True)
class StaticStart:
    """Search for the static equilibrium in which a run begins.

    Attributes
    ----------
    found : there is one; otherwise the run begins with all stones at rest and without stress
    steps, iterations : of the search, and of its solver
    natural_map : η of the last step, r and u measured against the elastic part of W [-]
    balance : unbalanced force of a body over its weight, largest over the bodies [-]
    """

    found: bool
    steps: int
    iterations: int
    natural_map: float
    balance: float
