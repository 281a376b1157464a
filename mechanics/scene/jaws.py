"""Path of the jaws of a test rig: displacements in turn at a constant speed."""

from collections.abc import Sequence

import numpy as np

from mechanics.arrays import Array
from mechanics.scene.loads.load import Pose


class JawPath:
    """Motion of jaws to given displacements in turn, at a constant speed; they rise with what they push.

    Parameters
    ----------
    stones : codes of the jaws
    direction : (3,) unit vector
    to : displacements in turn [m]
    speed : [m/s]

    Attributes
    ----------
    rise : of the jaws so far [m]
    course : None: a test runs to its end
    """

    course = None

    def __init__(self, stones: frozenset[str], direction: Array, to: Sequence[float], speed: float) -> None:
        self.stones, self._direction = stones, direction
        self._path = np.concatenate([[0.0], to])
        self._time = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(self._path)))]) / speed
        self.rise = 0.0

    @property
    def until(self) -> float:
        """Time at which they come to rest [s]."""
        return float(self._time[-1])

    def at(self, time: float) -> float:
        """Return the displacement at `time` [m]."""
        return float(np.interp(time, self._time, self._path))

    def pose(self, time: float) -> Pose:
        """Return the pose at `time` [s]."""
        return Pose(self.at(time) * self._direction + [0.0, 0.0, self.rise], np.eye(3), np.zeros(3))
