"""Form of W for methods that factorise: impulses of contacts where stones deform, velocities of the rigid ones."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.sparse import block_diag, csc_array, csr_array

from mechanics.arrays import Array, Ints
from mechanics.delassus._kernels.mixed import ELASTIC, RIGID
from mechanics.delassus.condensed import assembled
from mechanics.delassus.multifrontal import Cliques, Factors, Fronts, fronts, fronts_of_graph

# refinement steps, at most
_REFINEMENTS = 2
# relative change of velocities due to rounding alone [-]
_VELOCITY_ROUNDING = 1e-14


class MixedPattern:
    """Unknowns of W + Θ in groups, and their elimination order.

    A group holds the contacts of two stones, at least one of them deformable, or one rigid body.

    Parameters
    ----------
    bodies : (nc, 2) of each contact
    kind : (nc, 2) NONE, RIGID or ELASTIC, of each side
    centre : (nb, 3) of all bodies [m]

    Attributes
    ----------
    soft, hard : contacts with a deformable side, and the others
    moving : (nm,) rigid bodies that move
    place : (nc, 2) index of the body of a side among them; -1 where it is fixed or deformable
    elastic : contacts of each deformable body
    own : of each rigid body, its sides of soft contacts (two sides a contact)
    pair : index of each hard contact among the pairs of bodies
    pairs : (np, 2) indices of two bodies, in order; -1 as in `place`
    unknowns : of the blocks of deformable bodies, of rigid ones with their soft contacts, and of pairs
    """

    def __init__(self, bodies: Ints, kind: Ints, centre: Array) -> None:
        soft = (kind == ELASTIC).any(axis=1)
        self.soft, self.hard = np.flatnonzero(soft), np.flatnonzero(~soft)
        self.moving = np.unique(bodies[kind == RIGID])
        self.place = np.where(kind == RIGID, np.searchsorted(self.moving, bodies), -1)
        among = np.cumsum(soft) - 1
        self.elastic = _by_body(bodies.ravel(), np.flatnonzero(kind.ravel() == ELASTIC))
        count, moving = len(self.soft), len(self.moving)
        velocities = count + np.arange(2 * moving).reshape(-1, 2)
        sides = np.argsort(self.place[self.soft].ravel(), kind="stable")
        ends = np.searchsorted(self.place[self.soft].ravel()[sides], np.arange(moving + 1))
        self.own = [sides[a:b] for a, b in pairwise(ends)]
        coupled = [np.concatenate([slots // 2, velocities[b]]) for b, slots in enumerate(self.own)]
        both = np.sort(self.place[self.hard], axis=1)
        self.pairs, pair = np.unique(both, axis=0, return_inverse=True)
        self.pair = pair.ravel()
        joints = [velocities[pair[pair >= 0]].ravel() for pair in self.pairs]
        self.unknowns = (*(among[slots // 2] for slots in self.elastic), *coupled, *joints)
        joined, group = np.unique(np.sort(bodies[self.soft], axis=1), axis=0, return_inverse=True)
        rigid = np.repeat(np.arange(moving) + len(joined), 2)
        self._group = np.concatenate([group.ravel(), rigid])
        self._middle = np.concatenate([centre[joined].mean(axis=1), centre[self.moving]])

    @cached_property
    def fronts(self) -> Fronts:
        """Fronts of the factors."""
        return fronts_of_graph(self._group, self.unknowns, self._middle)


def mixed_fronts(bodies: Ints, kind: Ints, centre: Array) -> Fronts:
    """Return the fronts of W + Θ; the same parameters as for `MixedPattern`."""
    pattern = MixedPattern(bodies, kind, centre)
    return (
        pattern.fronts if len(pattern.moving) else fronts(bodies, [sides // 2 for sides in pattern.elastic])
    )


def _by_body(body: Ints, sides: Ints) -> list[Ints]:
    """Return the selected sides by body (2 nc,), ascending."""
    sides = sides[np.argsort(body[sides], kind="stable")]
    return np.split(sides, np.flatnonzero(np.diff(body[sides])) + 1) if len(sides) else []


class MixedForm:
    """Elimination with few unknowns for W = W_e + A M⁻¹ Aᵀ, W_e that of deformable stones.

    Impulses r between rigid stones (h) follow from their velocities v, so that only those of other contacts (s)
    remain. With (W + Θ) r = b,

        [ W_e + Θ_s   A_s               ] [ r_s ]   [ b_s           ]
        [ -A_sᵀ       M + A_hᵀ Θ_h⁻¹ A_h ] [ v   ] = [ A_hᵀ Θ_h⁻¹ b_h ],     r_h = Θ_h⁻¹ (b_h - A_h v)

    six unknowns for each rigid stone, whatever the number of its contacts. In r and -v it is as symmetric as Θ. The
    result is refined in r and v, as in `BodyForm`.

    Parameters
    ----------
    pattern : of its unknowns
    jacobian : (nc, 2, 3, 6) local velocity of a rigid side from its body's velocity
    mass : (nm, 6, 6) of the rigid bodies that move, world axes [kg, kg m²]
    blocks : of each deformable body, symmetric, between its sides (3s, 3s) [1/kg]
    threads : that factorise; the factors are the same to the last bit
    """

    def __init__(
        self, pattern: MixedPattern, jacobian: Array, mass: Array, blocks: Sequence[Array], threads: int = 1
    ) -> None:
        self._pattern, self._mass, self._threads = pattern, mass, threads
        sign = np.array([1.0, -1.0])[:, None, None]
        self._jacobian = np.where(pattern.place[..., None, None] >= 0, sign * jacobian, 0.0)
        self._elastic = Cliques([sides // 2 for sides in pattern.elastic], blocks)

    @cached_property
    def _across(self) -> "csr_array[np.float64]":
        """A (3 nc, 6 nm): relative velocities of the contacts from those of the rigid bodies."""
        place = self._pattern.place
        c, s = np.nonzero(place >= 0)
        column = np.broadcast_to((6 * place[c, s])[:, None, None] + np.arange(6), (len(c), 3, 6))
        row = np.broadcast_to((3 * c[:, None] + np.arange(3))[:, :, None], column.shape)
        shape = (3 * len(place), 6 * len(self._mass))
        return csr_array((self._jacobian[c, s].ravel(), (row.ravel(), column.ravel())), shape=shape)

    @property
    def matrix(self) -> "csc_array[np.float64]":
        """W (3 nc, 3 nc) [1/kg]."""
        rigid = self._across @ block_diag(list(np.linalg.inv(self._mass)), format="csr") @ self._across.T
        return csc_array(rigid) + assembled(self._elastic, len(self._pattern.place))

    @cached_property
    def _constant(self) -> list[Array]:
        """Blocks of the deformable bodies, and of the rigid ones with their soft contacts."""
        jacobian = self._jacobian[self._pattern.soft].reshape(-1, 3, 6)
        blocks = list(self._elastic.blocks)
        for mass, unknowns in zip(self._mass, self._pattern.own, strict=True):
            many = 3 * len(unknowns)
            block = np.zeros((many + 6, many + 6))
            block[:many, many:] = -jacobian[unknowns].reshape(-1, 6)
            block[many:, :many] = block[:many, many:].T
            block[many:, many:] = -mass
            blocks.append(block)
        return blocks

    def shifted(self, theta: Array, exact: bool = True) -> Callable[[Array], Array]:
        """Return (W + Θ)⁻¹ as a function of b (3 nc,); `theta` (nc, 3, 3), invertible, not always symmetric [1/kg].

        Raises
        ------
        SolverError : if Θ or the whole is singular
        """
        return self._factorised(theta).refined

    def _factorised(self, theta: Array) -> "_Factors":
        pattern = self._pattern
        soft, hard = pattern.soft, pattern.hard
        inverse: Array = np.linalg.inv(theta[hard]).astype(np.float64, copy=False)
        padded = np.zeros((len(soft) + 2 * len(self._mass), 3, 3))
        padded[: len(soft)] = theta[soft]
        cliques = Cliques(pattern.unknowns, [*self._constant, *self._joints(inverse)])
        factors = pattern.fronts.factorise(cliques, padded, self._threads)
        return _Factors(pattern, self._across, self._mass, self._elastic, theta, inverse, factors)

    @cached_property
    def _paired(self) -> Array:
        """Rows (nh, 3, 12) of A of the hard contacts, bodies of a pair in the order of their indices."""
        pattern = self._pattern
        across = self._jacobian[pattern.hard].transpose(0, 2, 1, 3)
        turn = np.argsort(pattern.place[pattern.hard], axis=1, kind="stable")
        return np.take_along_axis(across, turn[:, None, :, None], axis=2).reshape(-1, 3, 12)

    def _joints(self, inverse: Array) -> Iterable[Array]:
        """Return -A_hᵀ Θ_h⁻¹ A_h of each pair of rigid bodies, transposed."""
        pattern = self._pattern
        across = self._paired
        stiff = across.transpose(0, 2, 1) @ (inverse @ across)
        order = np.argsort(pattern.pair, kind="stable")
        first = np.searchsorted(pattern.pair[order], np.arange(len(pattern.pairs)))
        for block, moving in zip(
            np.add.reduceat(stiff[order], first, axis=0), pattern.pairs >= 0, strict=True
        ):
            axes = np.repeat(moving, 6)
            yield -np.ascontiguousarray(block[axes][:, axes].T)


@dataclass(frozen=True)
class _Factors:
    """Factors of the system of r_s and -v, and the parts of W + Θ.

    Attributes
    ----------
    across : A (3 nc, 6 nm)
    mass : (nm, 6, 6)
    elastic : W_e
    theta : (nc, 3, 3)
    inverse : (nh, 3, 3) Θ_h⁻¹
    """

    pattern: MixedPattern
    across: "csr_array[np.float64]"
    mass: Array
    elastic: Cliques
    theta: Array
    inverse: Array
    factors: Factors

    def once(self, first: Array, second: Array) -> tuple[Array, Array]:
        """Return r (3 nc,) and v (6 nm,) with (W_e + Θ) r + A v = `first` and M v - Aᵀ r = `second`."""
        soft, hard = self.pattern.soft, self.pattern.hard
        wanted = first.reshape(-1, 3)
        pushed = np.zeros_like(wanted)
        pushed[hard] = _product(self.inverse, wanted[hard])
        load = second + self.across.T @ pushed.ravel()
        x = self.factors.solve(np.concatenate([wanted[soft].ravel(), load]))
        v = -x[3 * len(soft) :]
        r, remaining = np.empty_like(wanted), wanted - (self.across @ v).reshape(-1, 3)
        r[soft] = x[: 3 * len(soft)].reshape(-1, 3)
        r[hard] = _product(self.inverse, remaining[hard])
        return r.ravel(), v

    def refined(self, b: Array) -> Array:
        """Return (W + Θ)⁻¹ b (3 nc,)."""
        r, v = self.once(b, np.zeros(self.across.shape[1]))
        for _ in range(_REFINEMENTS):
            product = _product(self.theta, r.reshape(-1, 3)).ravel() + self._yielded(r)
            first = b - product - self.across @ v
            second = self.across.T @ r - _product(self.mass, v.reshape(-1, 6)).ravel()
            change, step = self.once(first, second)
            r += change
            v += step
            if np.abs(step).max(initial=0.0) <= _VELOCITY_ROUNDING * np.abs(v).max(initial=0.0):
                break
        return r

    def _yielded(self, r: Array) -> Array:
        """Return W_e r (3 nc,)."""
        impulse = r.reshape(-1, 3)
        velocity = np.zeros_like(impulse)
        for contacts, block in zip(self.elastic.contacts, self.elastic.blocks, strict=True):
            velocity[contacts] += (block @ impulse[contacts].ravel()).reshape(-1, 3)
        return velocity.ravel()


def _product(blocks: Array, vectors: Array) -> Array:
    """Return the products (n, d) of blocks (n, d, d) with vectors (n, d)."""
    products: Array = np.matmul(blocks, vectors[:, :, None])[:, :, 0]
    return products
