"""How a static case is decided: does the structure stand, or does it fall?

Step and hold: the stones start at rest, exactly touching, and gravity is whole and tilted by atan λ at once. Rigid
stones take up their forces at once too: where they are in equilibrium, the first step finds it. So a hold is over
when decided.

*Stands*: `Outcome.EQUILIBRIUM`, i. e. in five solved steps in a row the contact forces, which lie in their Coulomb
cones, balance the weight of every single stone to 10⁻⁴ of it (inertia left out), and no corner has moved by more
than 10⁻⁴ of its stone's width. Every step must be solved to η ≤ 10⁻⁶, those five also to 10⁻⁵ of the velocity g h.

*Falls*: `Outcome.COLLAPSED`, i. e. a stone has moved by a twentieth of its width and is fast, with a kinetic energy
that grew in each of the last ten steps, and no overlaps. Solvers are at their worst in a falling wall, so a step
may stay a little above the tolerance, but what is left unsolved must be far too little to be the reason: η times
all contact forces is less than a twentieth of the force that some stone lacks for its balance.
"""

import numpy as np

from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Fidelity, Method, Scene, SolverSettings, TimeSettings
from mechanics.simulate import simulate

G = 9.81
TOLERANCE, VELOCITY_TOLERANCE = 1e-6, 1e-5
DOWN, ALONG = (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)


def hold(
    blocks,
    friction,
    multiplier=0.0,
    direction=ALONG,
    *,
    step=1e-2,
    duration=5.0,
    law=None,
    loads=None,
    **contact,
):
    """Simulate `blocks` under their weight and `multiplier` times their weight along `direction`."""
    gravity = G * (np.array(DOWN) + multiplier * np.array(direction))
    more = {} if loads is None else {"loads": loads}
    return simulate(
        Scene(
            "hold",
            tuple(blocks),
            gravity=tuple(gravity),
            contact=ContactSettings(law or DryJoint(friction), **contact),
            time=TimeSettings(step, theta=1.0, duration=duration, collapse_displacement=0.05),
            solver=SolverSettings(Method.AUTO, TOLERANCE, VELOCITY_TOLERANCE, max_iterations=5000),
            **more,
        )
    )


def largest_move(result):
    """Largest displacement of a corner over the smallest extent of its stone along an axis [-]."""
    return max(
        float(np.linalg.norm(b.displacement, axis=1).max() / np.ptp(b.reference, axis=0).min())
        for b in result.bodies
    )


def unsolved_force(result):
    """η of the worst step times the norm of all contact forces, over the weight of the lightest stone [-]."""
    lightest = min(b.mass for b in result.bodies if b.fidelity is not Fidelity.FIXED) * G
    return float(result.history.natural_map.max() * np.linalg.norm(result.contacts.force) / lightest)


def stands(result):
    """In balance, where it was, and every step solved."""
    return (
        result.outcome is Outcome.EQUILIBRIUM
        and bool(result.history.natural_map.max() <= TOLERANCE)
        and result.errors.balance <= 1e-4
        and result.errors.reaction <= 1e-3
        and largest_move(result) < 1e-4
    )


def falls(result):
    """Moved far, getting faster, without overlaps; and the solver is not the reason."""
    return (
        result.outcome is Outcome.COLLAPSED
        and bool(np.all(np.diff(result.history.kinetic[-10:]) > 0))
        and result.errors.penetration < 1e-3
        and unsolved_force(result) < 0.05 * result.errors.balance
    )


def report(result):
    """One line for a failed assertion."""
    eta = result.history.natural_map
    return (
        f"{result.outcome} after {result.steps} steps, {result.errors.unconverged_steps} of them unconverged "
        f"(η up to {eta.max():.1e}); balance {result.errors.balance:.1e}, unsolved {unsolved_force(result):.1e}, "
        f"moved {largest_move(result):.1e}, overlap {result.errors.penetration:.1e}"
    )
