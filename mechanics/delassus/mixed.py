"""W of rigid and deformable bodies together: rigid sides by their Jacobians, deformable ones by dense blocks."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mechanics.arrays import Array, Ints
from mechanics.delassus._kernels.mixed import apply_delassus, sweep
from mechanics.delassus.condensed import CondensedForm
from mechanics.delassus.multifrontal import Cliques
from mechanics.problem._kernels import local_factors
from mechanics.problem.problem import GaussSeidel

__all__ = ["ELASTIC", "NONE", "RIGID", "MixedDelassus"]


NONE, RIGID, ELASTIC = 0, 1, 2


@dataclass(frozen=True)
class MixedDelassus:
    """W = Hᵀ ŵ H in factored form; side 0 (candidate) counts positive, side 1 (antagonist) negative.

    A rigid body answers through its six velocities; a deformable one through the dense compliance between the
    contact sides that lie on it.

    Attributes
    ----------
    body : (nc, 2) bodies of the two sides
    kind : (nc, 2) NONE (fixed), RIGID or ELASTIC
    jacobian : (nc, 2, 3, 6) local velocity of a rigid side from its body's velocity
    response : (nc, 2, 6, 3) body velocity from the local impulse, ŵ times the transpose of `jacobian`
    slot : (nc, 2) place of an elastic side among those of its body
    yptr : (nb+1,) where each body's elastic velocities begin (three for each side)
    bptr : (nb+1,) where each body's compliance block begins
    block : flat symmetric compliance blocks of the elastic bodies, between their contact sides [1/kg]
    diagonal : (nc, 3, 3) W_αα [1/kg]
    scale : what u over r is measured against [1/kg]
    """

    body: Ints
    kind: Ints
    jacobian: Array
    response: Array
    slot: Ints
    yptr: Ints
    bptr: Ints
    block: Array
    diagonal: Array
    scale: float

    @property
    def _arrays(self) -> tuple[NDArray[np.generic], ...]:
        return self.body, self.kind, self.jacobian, self.response, self.slot, self.yptr, self.bptr, self.block

    def apply(self, impulse: Array) -> Array:
        """W r (nc, 3) [m/s]."""
        velocity: Array = apply_delassus(impulse, *self._arrays)[0]
        return velocity

    def rigid_change(self, impulse: Array) -> Array:
        """Velocities (nb, 6) that the impulses give to the rigid bodies [m/s, rad/s]."""
        change: Array = apply_delassus(impulse, *self._arrays)[1]
        return change

    @cached_property
    def cliques(self) -> Cliques:
        """W as a sum of blocks, one for each body that moves, between its contacts."""
        contacts, blocks = [], []
        bodies = self.body.ravel()
        order = np.argsort(bodies, kind="stable")
        for b, sides in enumerate(
            np.split(order, np.cumsum(np.bincount(bodies, minlength=len(self.yptr) - 1))[:-1])
        ):
            if not len(sides) or self.kind.ravel()[sides[0]] == NONE:
                continue
            sign = np.where(sides % 2 == 0, 1.0, -1.0).repeat(3)
            if self.kind.ravel()[sides[0]] == ELASTIC:
                # slots ascend with the sides
                square = self.block[self.bptr[b] : self.bptr[b + 1]].reshape(len(sign), -1)
            else:
                square = self.jacobian.reshape(-1, 3, 6)[sides].reshape(-1, 6)
                square = square @ self.response.reshape(-1, 6, 3)[sides].transpose(1, 0, 2).reshape(6, -1)
            contacts.append(sides // 2)
            blocks.append(sign[:, None] * square * sign)
        return Cliques(tuple(contacts), tuple(blocks))

    @cached_property
    def sparse(self) -> CondensedForm:
        """W for methods that factorise."""
        return CondensedForm(self.body, self.cliques)

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Sweeps forth and back; running velocities are made anew on each call, so that rounding cannot pile up."""
        factors = local_factors(self.diagonal)

        def sweeps(impulse: Array, count: int) -> None:
            _, v, y = apply_delassus(impulse, *self._arrays)
            sweep(
                count, True, impulse, v, y, shift, friction, cohesion, factors, self.diagonal, *self._arrays
            )

        return sweeps
