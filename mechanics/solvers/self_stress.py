"""Forces without self-stress: the smallest that load the bodies alike."""

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem
from mechanics.problem.residual import project_on_cone
from mechanics.solvers.scales import CORRECTIONS, ROUNDING
from mechanics.solvers.second_order.scaling import equilibrated


def without_self_stress(problem: ContactProblem, impulse: Array) -> Array:
    """Return the smallest impulses (nc, d) that load the bodies alike, projected on the cones.

    (W + α) Δ = W (r - r̂) a few times (Riley 1955), in units in which all contacts yield alike: what no body feels stays
    out, to 10⁻⁶ where masses differ by 10⁶. Stones that clamp each other at the edge of sliding leave less friction to
    the rest, which no residual shows where all but the lightest are far heavier.

    Raises
    ------
    SolverError : if W is known by its products alone, or W + α is singular
    """
    even, each = equilibrated(problem)
    unit, size = each[:, None], impulse.shape[1]
    theta = np.tile(ROUNDING * even.delassus.scale * np.eye(size), (len(impulse), 1, 1))
    system, wanted = even.form("forces without self-stress").shifted(theta), impulse / unit
    least = np.zeros_like(wanted)
    for _ in range(CORRECTIONS):
        least += system(even.delassus.apply(wanted - least).ravel()).reshape(wanted.shape)
    return project_on_cone(unit * least, problem.friction, problem.cohesion)
