"""Delassus operator of rigid and deformable bodies: rigid sides by Jacobians, deformable ones by dense blocks."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mechanics.arrays import Array, Ints
from mechanics.delassus._kernels.mixed import ELASTIC, RIGID, Sides, apply_delassus, sweep
from mechanics.delassus.condensed import CondensedForm
from mechanics.delassus.mixed_form import MixedForm, MixedPattern
from mechanics.delassus.multifrontal import Cliques
from mechanics.delassus.rigid import RigidDelassus
from mechanics.problem._kernels import Laws, local_factors
from mechanics.problem.problem import GaussSeidel, ScaledDelassus


@dataclass(frozen=True)
class MixedDelassus:
    """W = Hᵀ ŵ H in factored form; side 0 (candidate) counts positive, side 1 (antagonist) negative.

    A rigid body responds with its six velocities, a deformable one with the dense compliance between its contact
    sides.

    Attributes
    ----------
    body : (nc, 2) bodies of the two sides
    kind : (nc, 2) NONE (fixed), RIGID or ELASTIC
    jacobian : (nc, 2, 3, 6) local velocity of a rigid side from its body's velocity
    response : (nc, 2, 6, 3) body velocity from the local impulse, ŵ times the transpose of `jacobian`
    slot : (nc, 2) index of an elastic side among those of its body
    yptr : (nb+1,) offset of each body's elastic velocities (three for each side)
    bptr : (nb+1,) offset of each body's compliance block
    block : flat symmetric compliance blocks of the elastic bodies, between their contact sides [1/kg]
    mass : (nb, 6, 6) of the rigid bodies that move, world axes; zero for others [kg, kg m²]
    centre : (nb, 3) of the bodies [m]
    diagonal : (nc, 3, 3) W_αα [1/kg]
    scale : reference for u over r [1/kg]
    as_rigid : W of the same contacts with all bodies rigid
    threads : that factorise W
    """

    body: Ints
    kind: Ints
    jacobian: Array
    response: Array
    slot: Ints
    yptr: Ints
    bptr: Ints
    block: Array
    mass: Array
    centre: Array
    diagonal: Array
    scale: float
    as_rigid: RigidDelassus
    threads: int = 1

    rigid = None
    plane = None
    joint_compliance = None

    @cached_property
    def mostly_rigid(self) -> bool:
        """True where more rigid bodies than deformable ones move."""
        rigid, elastic = (len(np.unique(self.body[self.kind == kind])) for kind in (RIGID, ELASTIC))
        return 0 < elastic < rigid

    @cached_property
    def _sides(self) -> Sides:
        return Sides(
            self.body, self.kind, self.jacobian, self.response, self.slot, self.yptr, self.bptr, self.block
        )

    def apply(self, impulse: Array) -> Array:
        """Return W r (nc, 3) [m/s]."""
        velocity: Array = apply_delassus(np.ascontiguousarray(impulse), self._sides)[0]
        return velocity

    def rigid_change(self, impulse: Array) -> Array:
        """Return the velocities (nb, 6) that the impulses give to the rigid bodies [m/s, rad/s]."""
        change: Array = apply_delassus(np.ascontiguousarray(impulse), self._sides)[1]
        return change

    @cached_property
    def form(self) -> CondensedForm | MixedForm:
        """W for methods that factorise."""
        pattern = MixedPattern(self.body, self.kind, self.centre)
        blocks = [self._signed(sides) for sides in pattern.elastic]
        if not len(pattern.moving):
            cliques = Cliques([sides // 2 for sides in pattern.elastic], blocks)
            return CondensedForm(self.body, cliques, self.threads)
        mass = self.mass[pattern.moving]
        return MixedForm(pattern, self.jacobian, mass, blocks, self.threads)

    def _signed(self, sides: Ints) -> Array:
        """Return the compliance (3s, 3s) of a deformable body between its sides, in the order of their slots."""
        sign = np.where(sides % 2 == 0, 1.0, -1.0).repeat(3)
        b = self.body.ravel()[sides[0]]
        square = self.block[self.bptr[b] : self.bptr[b + 1]].reshape(len(sign), -1)
        signed: Array = sign[:, None] * square * sign
        return signed

    def scaled(self, unit: Array) -> ScaledDelassus:
        """Return D W D with the units (nc,) of the contacts on the diagonal of D."""
        return ScaledDelassus(self, unit)

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Return sweeps forth and back; each call recomputes velocities, so that rounding does not accumulate."""
        laws = Laws(shift, friction, cohesion, local_factors(self.diagonal))

        def sweeps(impulse: Array, count: int) -> None:
            """Sweep over the contacts of rigid and elastic bodies."""
            _, v, y = apply_delassus(impulse, self._sides)
            sweep(count, impulse, v, y, laws, self.diagonal, self._sides)

        return sweeps
