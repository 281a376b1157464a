"""W of rigid and deformable bodies together: rigid sides by their Jacobians, deformable ones by dense blocks."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array

from mechanics.operators._kernels_mixed import apply_delassus, sweep
from mechanics.problem import GaussSeidel
from mechanics.solvers._kernels import local_factors

__all__ = ["ELASTIC", "NONE", "RIGID", "MixedDelassus"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

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

    def elastic_part(self) -> "csc_array[np.float64]":
        """W of the elastic bodies alone, (3 nc, 3 nc)."""
        size = 3 * len(self.body)
        rows, columns, values = [], [], []
        for b in np.flatnonzero(np.diff(self.yptr)):
            contact, side = np.nonzero((self.body == b) & (self.kind == ELASTIC))
            order = np.argsort(self.slot[contact, side])
            contact, sign = contact[order], np.where(side[order] == 0, 1.0, -1.0).repeat(3)
            place = (3 * contact[:, None] + np.arange(3)).ravel().astype(np.int32)
            square = self.block[self.bptr[b] : self.bptr[b + 1]].reshape(len(place), -1)
            values.append((sign[:, None] * square * sign).ravel())
            rows.append(np.repeat(place, len(place)))
            columns.append(np.tile(place, len(place)))
        if not values:
            return csc_array((size, size))
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        return csc_array(entries, shape=(size, size))

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Sweeps forth and back; running velocities are made anew on each call, so that rounding cannot pile up."""
        factors = local_factors(self.diagonal)

        def sweeps(impulse: Array, count: int) -> None:
            _, v, y = apply_delassus(impulse, *self._arrays)
            sweep(
                count, True, impulse, v, y, shift, friction, cohesion, factors, self.diagonal, *self._arrays
            )

        return sweeps
