"""State of a simulation: the quantities that change from step to step."""

from dataclasses import dataclass

from mechanics.arrays import Array


@dataclass(frozen=True)
class State:
    """Configuration and velocity at one instant; replaced as a whole each step.

    A deformable body has its nodes, and a frame that follows their mean motion; a rigid body has its frame alone.

    Attributes
    ----------
    time : [s]
    centre : (nb, 3) centre of mass of each body [m]
    rotation : (nb, 3, 3) from body axes (those of the start) to world axes [-]
    velocity : (nb, 6) of rigid bodies: translation [m/s] and rotation [rad/s], world axes; zero for others
    node : (nn, 3) nodes of all deformable bodies, one body after the other [m]
    node_velocity : (nn, 3) [m/s]
    """

    time: float
    centre: Array
    rotation: Array
    velocity: Array
    node: Array
    node_velocity: Array
