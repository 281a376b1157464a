"""Delassus operator of stones with compliant joints: W + E, with a diagonal E."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, diags_array

from mechanics.arrays import Array
from mechanics.problem.forms import Form
from mechanics.problem.problem import Delassus, GaussSeidel, RigidContacts


class CompliantForm:
    """W + E in any form; E is added to Θ.

    Parameters
    ----------
    inner : W
    compliance : (nc, d) diagonal of E [1/kg]
    """

    def __init__(self, inner: Form, compliance: Array) -> None:
        self._inner, self._compliance = inner, compliance

    @property
    def matrix(self) -> "csc_array[np.float64] | None":
        """W + E where W is assembled."""
        inner = self._inner.matrix
        return None if inner is None else csc_array(inner + diags_array(self._compliance.ravel()))

    def shifted(self, theta: Array, exact: bool = True) -> Callable[[Array], Array]:
        """Return (W + E + Θ)⁻¹ as a function of b (d nc,)."""
        return self._inner.shifted(theta + _blocks(self._compliance), exact)


@dataclass(frozen=True)
class CompliantDelassus:
    """W + E: impulses move the stones and compress their joints.

    Attributes
    ----------
    inner : W
    joint_compliance : (nc, d) diagonal of E [1/kg]
    """

    inner: Delassus
    joint_compliance: Array
    plane = None

    @property
    def rigid(self) -> RigidContacts | None:
        """Contacts in terms of rigid bodies, without their compliance, or None."""
        return self.inner.rigid

    @property
    def scale(self) -> float:
        """Scale of W [1/kg]."""
        return self.inner.scale

    @property
    def mostly_rigid(self) -> bool:
        """That of W."""
        return self.inner.mostly_rigid

    @property
    def as_rigid(self) -> Delassus | None:
        """W with all bodies rigid, without E, or None."""
        return self.inner.as_rigid

    @cached_property
    def diagonal(self) -> Array:
        """W_αα + E_α (nc, d, d) [1/kg]."""
        blocks: Array = self.inner.diagonal + _blocks(self.joint_compliance)
        return blocks

    @cached_property
    def form(self) -> CompliantForm | None:
        """W + E for methods that factorise, where W has such a form."""
        inner = self.inner.form
        return None if inner is None else CompliantForm(inner, self.joint_compliance)

    def apply(self, impulse: Array) -> Array:
        """Return (W + E) r (nc, d) [m/s]."""
        return self.inner.apply(impulse) + self.joint_compliance * impulse

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Return sweeps of W with E r lagged by one sweep; they converge where E is smaller than W."""

        def sweeps(impulse: Array, count: int, /) -> None:
            """Sweep, with the shift of the joints' compliance brought up to date before each pass."""
            for _ in range(count):
                late = shift + self.joint_compliance * impulse
                self.inner.gauss_seidel(late, friction, cohesion)(impulse, 1)

        return sweeps

    def scaled(self, unit: Array) -> "CompliantDelassus":
        """Return D (W + E) D with the units (nc,) of the contacts on the diagonal of D."""
        return CompliantDelassus(self.inner.scaled(unit), self.joint_compliance * (unit**2)[:, None])


def simplified(operator: Delassus) -> CompliantDelassus | None:
    """Return W with all bodies rigid, and E as the diagonal compliance of bodies and joints; None if not known."""
    rigid = operator.as_rigid
    if rigid is None:
        return None
    yielding = np.einsum("cii->ci", operator.diagonal - rigid.diagonal)
    return CompliantDelassus(rigid, np.maximum(yielding, 0.0))


def _blocks(diagonal: Array) -> Array:
    """Return the diagonal blocks (nc, d, d) of a diagonal (nc, d)."""
    blocks: Array = diagonal[:, :, None] * np.eye(diagonal.shape[1])
    return blocks
