"""Design points: the most probable points of failure, by the iteration of Hasofer, Lind, Rackwitz and Fiessler.

Where stones may fall in several ways there are several. The search begins at the mean first, and then from points along
each of the largest unknowns.

Where g is larger at the next point than the tangent says, failure asks for more than one tangent: two states must be
lost at once, or the limit state is curved towards the mean. So tangents are kept until a point fails, and the next
point is the nearest to the mean in which all of them fail; the iteration would else go to and fro between two states.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls
from scipy.stats import norm

from mechanics.arrays import Array
from pipelines.assess.study.methods.failure import Evaluate, Failure
from survey.conventions import MANY, MOST, NOTICEABLE, PER_MILLE, SIGNIFICANT, TENTH

_STILL = PER_MILLE
"""Change of the point at which it stands, and g over its change along one unit, at which it is zero [-].

P changes by β times as much, less than a hundredth.
"""
_MAX_SAMPLES = MANY  # samples of a search
_STARTS = 8
"""Unknowns along which further searches begin, at most."""
_OUT = SIGNIFICANT  # distance of their starts from the mean [-]
_BELOW = MOST
"""Distance of g below the tangent, in standard deviations, from which another way to fail is sought [-]."""
_DISTINCT = TENTH
"""Distance from which two design points are two [-]."""
_RELEVANT = NOTICEABLE
"""Excess of β over the least up to which a design point counts: beyond, P is less than a hundredth of the largest."""


@dataclass(frozen=True)
class Design:
    """Design point.

    Attributes
    ----------
    point : (n,) in standard normal space
    gradient : (n,) of g there
    converged : g is zero there, and its gradient points to the mean
    evaluations : samples of the search
    index : β, negative where the mean fails
    """

    point: Array
    gradient: Array
    converged: bool
    evaluations: int
    index: float

    @property
    def probability(self) -> float:
        """Φ(-β)."""
        return float(norm.sf(self.index))

    @property
    def shares(self) -> Array:
        """Squares (n,) of the direction cosines: by how much each unknown decides."""
        squares: Array = self.gradient**2
        return squares / (float(squares.sum()) or 1.0)


@dataclass(frozen=True)
class _Tangent:
    """Tangent of g at a point (n,).

    Attributes
    ----------
    point : where it touches
    gradient : (n,) of g there
    state : g there
    """

    point: Array
    gradient: Array
    state: float

    @property
    def distance(self) -> float:
        """Distance of the point from where the tangent is zero, negative where it fails."""
        return self.state / float(np.linalg.norm(self.gradient))

    @property
    def goal(self) -> Array:
        """Point (n,) nearest to the mean at which the tangent is zero."""
        square = float(self.gradient @ self.gradient)
        nearest: Array = (float(self.gradient @ self.point) - self.state) / square * self.gradient
        return nearest


def design_point(evaluate: Evaluate, failure: Failure, start: Array) -> Design | None:
    """Return the design point that a search from a start (n,) comes to; None where there is no gradient."""
    point, previous = start.copy(), None
    tangents: list[_Tangent] = []
    used = 0
    while used < _MAX_SAMPLES:
        (sample,) = evaluate(point[None], gradient=True)
        used += 1
        state, gradient = failure.state(sample), failure.gradient(sample)
        if gradient is None or not np.isfinite(state):
            if previous is None:
                return None
            # half of the way back to where there was one
            point = 0.5 * (point + previous)
            continue
        tangent = _Tangent(point, gradient, state)
        tangents = [*(tangents if tangent.distance > -_STILL else []), tangent]
        goal, gradient = _nearest(tangents)
        if float(np.linalg.norm(goal - point)) < _STILL * max(1.0, float(np.linalg.norm(goal))):
            return _designed(goal, gradient, True, used)
        previous, point = point, goal
    return _designed(tangents[-1].point, tangents[-1].gradient, False, used)


def design_points(
    evaluate: Evaluate, failure: Failure, dimension: int, along: Sequence[int] = ()
) -> tuple[Design, ...]:
    """Return the design points that matter, the most probable first; none where there is no gradient.

    Parameters
    ----------
    along : unknowns along which further searches begin, on either side of the mean
    """
    first = design_point(evaluate, failure, np.zeros(dimension))
    if first is None:
        return ()
    found = [first]
    for start in _lower(evaluate, failure, first, _starts(along, dimension)):
        other = design_point(evaluate, failure, start)
        if other is None or not other.converged:
            continue
        apart = [float(np.linalg.norm(other.point - known.point)) for known in found]
        if min(apart) > _DISTINCT * max(1.0, other.index):
            found.append(other)
    found.sort(key=lambda design: design.index)
    return tuple(design for design in found if design.index <= found[0].index + _RELEVANT)


def _lower(evaluate: Evaluate, failure: Failure, first: Design, starts: Sequence[Array]) -> list[Array]:
    """Return the starts at which g is less than the tangent at the first design point says: something else governs."""
    if not starts:
        return []
    states = failure.states(evaluate(np.array(starts)))
    slope = float(np.linalg.norm(first.gradient))
    return [
        start
        for start, state in zip(starts, states.tolist(), strict=True)
        if state < float(first.gradient @ (start - first.point)) - _BELOW * slope
    ]


def _starts(along: Sequence[int], dimension: int) -> Sequence[Array]:
    """Return points along the axes of some unknowns."""
    if dimension < 2:
        return []
    starts = []
    for number in along[:_STARTS]:
        for sign in (-1.0, 1.0):
            start = np.zeros(dimension)
            start[number] = sign * _OUT
            starts.append(start)
    return starts


def _nearest(tangents: list[_Tangent]) -> tuple[Array, Array]:
    """Return the point nearest to the mean at which no tangent is above zero, and what stands for the gradient there.

    A problem of least distance (Lawson & Hanson 1974, §23.4). Where tangents leave no such point, and where the mean
    fails, the last decides.
    """
    last = tangents[-1]
    if len(tangents) == 1:
        return last.goal, last.gradient
    slopes = np.array([np.linalg.norm(one.gradient) for one in tangents])
    normals = -np.array([one.gradient for one in tangents]) / slopes[:, None]
    reach = np.array([one.distance for one in tangents])
    reach += np.einsum("ij,ij->i", normals, [one.point for one in tangents])
    if reach[-1] <= 0.0:
        return last.goal, last.gradient
    system = np.vstack([normals.T, reach])
    wanted = np.zeros(len(system))
    wanted[-1] = 1.0
    rest = system @ nnls(system, wanted)[0] - wanted
    if abs(rest[-1]) <= _STILL**2:
        return last.goal, last.gradient
    goal: Array = -rest[:-1] / rest[-1]
    return goal, -goal * slopes[-1] / np.linalg.norm(goal)


def _designed(point: Array, gradient: Array, converged: bool, used: int) -> Design:
    # the mean fails where g falls towards it
    outwards = -float(gradient @ point) >= 0.0
    index = float(np.linalg.norm(point)) * (1.0 if outwards else -1.0)
    return Design(point, gradient, converged, used, index)
