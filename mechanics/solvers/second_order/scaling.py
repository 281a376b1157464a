"""A contact problem in units of its own for each contact, in which all contacts yield alike.

Where masses differ by a factor of 10⁶, so do the compliances of contacts. With D a number for each contact,

    r = D r̂,     û = D u,     Ŵ = D W D,     k̂ = k / D

is the same problem: Coulomb's cones keep their shape. D makes the mean diagonal of every Ŵ_αα one, so that a penalty,
a regularisation or a start inside the cones that is right for one contact is right for all.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mechanics.arrays import Array
from mechanics.delassus.rigid import RigidDelassus
from mechanics.problem.problem import ContactProblem, Delassus, Form, GaussSeidel, scale_of
from mechanics.solvers.second_order.shifted_systems import shifted_system

__all__ = ["equilibrated"]


# an operator that says to be measured against something else than its mean diagonal differs by more than this
_OTHER = 1e-6


def equilibrated(problem: ContactProblem) -> tuple[ContactProblem, Array]:
    """The problem in r̂, and D (nc,), in √kg.

    An operator that is measured against a part of W alone keeps the proportions of its contacts.
    """
    operator = problem.delassus
    own = np.einsum("cii->c", operator.diagonal) / operator.diagonal.shape[1]
    scale = scale_of(operator)
    if abs(scale / own.mean() - 1.0) > _OTHER:
        own = np.full(len(own), scale)
    unit = 1.0 / np.sqrt(own)
    even: Delassus
    form: Callable[[], Form]
    if isinstance(operator, RigidDelassus):
        rigid = operator.scaled(unit)
        even, form = rigid, lambda: rigid.sparse
    else:
        even, form = _Scaled(operator, unit), lambda: _ScaledForm(problem, unit)
    return replace(
        problem,
        delassus=even,
        u_free=problem.u_free * unit[:, None],
        bias=problem.bias * unit,
        cohesion=problem.cohesion / unit,
        sparse=None if problem.sparse is None else form,
        adhesion=None if problem.adhesion is None else problem.adhesion / unit,
    ), unit


@dataclass(frozen=True)
class _Scaled:
    """D W D of any operator."""

    inner: Delassus
    unit: Array

    @property
    def scale(self) -> float:
        """What û over r̂ is measured against: 1 by the choice of D."""
        return 1.0

    @cached_property
    def diagonal(self) -> Array:
        """D_α W_αα D_α (nc, d, d) [-]."""
        blocks: Array = self.inner.diagonal * (self.unit**2)[:, None, None]
        return blocks

    def apply(self, impulse: Array) -> Array:
        """D W D r̂ (nc, d)."""
        return self.unit[:, None] * self.inner.apply(self.unit[:, None] * impulse)

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Sweeps of the operator itself: solving one contact exactly does not depend on its unit."""
        unit = self.unit[:, None]
        inner = self.inner.gauss_seidel(shift / unit, friction, cohesion * self.unit)

        def sweeps(impulse: Array, count: int, /) -> None:
            real = unit * impulse
            inner(real, count)
            impulse[:] = real / unit

        return sweeps


class _ScaledForm:
    """(D W D + Θ̂)⁻¹ = D⁻¹ (W + D⁻¹ Θ̂ D⁻¹)⁻¹ D⁻¹."""

    def __init__(self, problem: ContactProblem, unit: Array) -> None:
        self._system, self._unit = shifted_system(problem, "equilibrated"), unit
        self._axes = problem.u_free.shape[1]
        self._relaxed: dict[float, Callable[[Array], Array]] = {}

    def shifted(self, theta: Array) -> Callable[[Array], Array]:
        """(Ŵ + Θ̂)⁻¹ as a function of b (d nc,)."""
        solve = self._system(theta / (self._unit**2)[:, None, None])
        unit = np.repeat(self._unit, theta.shape[1])
        return lambda b: solve(b / unit) / unit

    def relaxed(self, sigma: float) -> Callable[[Array], Array]:
        """(Ŵ/σ + 1)⁻¹ as a function of b (d nc,); its factors are kept for the next call."""
        if sigma not in self._relaxed:
            solve = self.shifted(np.tile(sigma * np.eye(self._axes), (len(self._unit), 1, 1)))
            self._relaxed[sigma] = lambda b: solve(sigma * b)
        return self._relaxed[sigma]
