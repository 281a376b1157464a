"""Forces on stones."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from ground.errors import SceneError
from ground.settings import Setting
from mechanics.arrays import Array
from mechanics.scene.loads.load import Course
from mechanics.scene.loads.time_series import History
from mechanics.stones.validation import finite, refuse_unless


@dataclass(frozen=True)
class StoneForce:
    """Force on each of some stones, at a point that moves with the stone.

    Attributes
    ----------
    stones : codes
    force : (3,) with time [N]
    arm : (3,) from the centre of mass to where it acts, in the axes of the start [m]
    follows : the force turns with the stone; otherwise its direction is fixed in the world
    """

    stones: frozenset[str]
    force: History
    arm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    follows: Annotated[bool, Setting("The force turns with the stone.")] = False

    def __post_init__(self) -> None:
        if self.force.components != 3:
            raise SceneError(
                f"a force of {self.force.components} components", where="force", remedy="give x, y and z"
            )
        refuse_unless("force", [("arm", self.arm, finite(self.arm, 3), "give x, y and z")])

    @property
    def until(self) -> float:
        """Time from which the force is constant [s]."""
        return self.force.until

    @property
    def course(self) -> Course | None:
        """Course of the force; None if it is constant."""
        if not self.until:
            return None
        stones = ", ".join(sorted(self.stones)[:2]) + ", …" * (len(self.stones) > 2)
        return Course.of(f"force on {stones}", self.force.time, self.force.value, self.until)

    def __call__(self, time: float, centre: Array, rotation: Array) -> tuple[Array, Array]:
        """Return the force (n, 3) [N] and its moment (n, 3) [N m] about the centre of mass, world axes."""
        force = np.broadcast_to(self.force(time), centre.shape)
        if self.follows:
            force = np.einsum("nij,nj->ni", rotation, force)
        arm = np.einsum("nij,j->ni", rotation, np.array(self.arm))
        return force, np.cross(arm, force)
