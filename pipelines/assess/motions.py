"""Motion of each stone in a run, at any point: what a comparison with a survey needs of a simulation."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.results.result import BodyResult


@dataclass(frozen=True)
class Motions:
    """Displacement of stones, affine over each.

    Attributes
    ----------
    middle : (3,) of each stone, by code, in the frame of the site [m]
    field : (4, 3) of each: displacement of its middle [m], and its gradient
    """

    middle: Mapping[str, Array]
    field: Mapping[str, Array]

    def displacement(self, code: str, points: Array) -> Array:
        """Return the displacement (n, 3) of points (n, 3) of a stone; stones that took no part have not moved [m]."""
        if code not in self.field:
            return np.zeros_like(points)
        at: Array = np.column_stack([np.ones(len(points)), points - self.middle[code]]) @ self.field[code]
        return at

    def since(self, earlier: "Motions") -> "Motions":
        """Return the motions since an earlier state of the same stones; those that took no part in it count whole."""
        field = {
            code: displacement - earlier.field.get(code, 0.0) for code, displacement in self.field.items()
        }
        return Motions(self.middle, field)


def stone_motions(bodies: Iterable[BodyResult], origin: Array) -> Motions:
    """Return the motions of the stones of a run; `origin` (3,) of the scene in the frame of the site [m]."""
    middle, field = {}, {}
    for body in bodies:
        centre = body.reference.mean(axis=0)
        arms = np.column_stack([np.ones(len(body.reference)), body.reference - centre])
        middle[body.code] = centre + origin
        field[body.code] = np.linalg.lstsq(arms, body.displacement, rcond=None)[0]
    return Motions(middle, field)
