"""Contact problems in units of their own for each contact, in which all contacts yield alike.

Where masses differ by a factor of 10⁶, so do the compliances of contacts. With D a number for each contact,

    r = D r̂,     û = D u,     Ŵ = D W D,     k̂ = k / D

is the same problem: Coulomb's cones keep their shape. D makes the mean diagonal of every Ŵ_αα one, so that a penalty,
a regularisation or a start inside the cones that is right for one contact is right for all.
"""

from dataclasses import replace

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem
from mechanics.solvers.scales import ROUNDING


def equilibrated(problem: ContactProblem) -> tuple[ContactProblem, Array]:
    """Return the problem in r̂, and D (nc,), in √kg.

    An operator that is measured against a part of W alone keeps the proportions of its contacts.
    """
    operator = problem.delassus
    diagonals = np.einsum("cii->c", operator.diagonal) / operator.diagonal.shape[1]
    if abs(operator.scale / diagonals.mean() - 1.0) > ROUNDING:
        diagonals = np.full(len(diagonals), operator.scale)
    unit = 1.0 / np.sqrt(diagonals)
    return replace(
        problem,
        delassus=operator.scaled(unit),
        u_free=problem.u_free * unit[:, None],
        bias=problem.bias * unit,
        cohesion=problem.cohesion / unit,
        adhesion=None if problem.adhesion is None else problem.adhesion / unit,
    ), unit
