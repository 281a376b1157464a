"""Strategy for rigid stones at rest: keep the forces of the last step, and balance them exactly now and then.

Forces that balance up to a tolerance, kept from step to step, push stones by that tolerance in every step: velocities
grow with the number of steps and gaps with its square, until rigid stones rest on contacts that have opened by less
than an ångström. The problem is then as hard as it is void of meaning: thousands of redundant contacts, of which each
is open or closed. So velocities at rest are held far below what a step may leave, by the factors of the first step at
rest, before any gap counts.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.problem.residual import residual

__all__ = ["settled"]


# velocity of stones at rest from which their forces are balanced again, over the fastest of u_free [-]: gaps that it
# opens stay below the tolerance for thousands of steps
_CALM = 3e-9
# its change in one step, likewise [-]: forces that have stopped a motion would push stones back in the next step
_STEADY = 1e-9
# measures of the residual over their tolerances, up to which stones count as settled [-]: a motion is far beyond
_NEAR = 30.0
# part of the velocity tolerance up to which a gap counts as closed [-]; the other part is for velocities
_CLOSED = 0.5

_Solver = Callable[[ContactProblem, ContactStart], ContactSolution]


def settled(
    problem: ContactProblem, start: ContactStart, limits: tuple[float, float], balance: _Solver
) -> ContactSolution | None:
    """Return the forces of the last step if they hold the stones, or balanced again; None if neither is a solution.

    Parameters
    ----------
    problem, start : of rigid stones, with the impulses of the last step
    limits : tolerances of η and of velocities
    balance : solver for contacts that stay in touch, far more exact than `limits`
    """
    left, pace = residual(problem, start.impulse), float(np.abs(problem.u_free).max())
    if not left.within(_NEAR * limits[0], _NEAR * limits[1]):
        return None
    small = _CLOSED * limits[1] * pace
    closed = replace(problem, bias=np.where(np.abs(problem.bias) <= small, 0.0, problem.bias))
    calm = residual(closed, start.impulse)
    kept = ContactSolution(
        start.impulse, calm.dual, 0, left.natural_map, left.within(*limits), "kept: warm start"
    )
    change = float(np.abs(calm.dual - start.velocity).max())
    if kept.converged and calm.velocity <= min(_CALM, limits[1]) and change <= _STEADY * pace:
        return kept
    found = balance(closed, start)
    left = residual(problem, found.impulse)
    if left.within(*limits):
        why = f"balanced: velocities stood at {calm.velocity:.0e}"
        return replace(found, natural_map=left.natural_map, converged=True, why=why)
    return kept if kept.converged else None
