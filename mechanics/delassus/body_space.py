"""Form of W between rigid bodies for methods that factorise: six velocities for each body that moves."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import block_diag, csc_array, csr_array
from scipy.sparse.linalg import SuperLU, splu

from ground.errors import SolverError
from mechanics.arrays import Array, Ints
from mechanics.delassus._kernels import bodies as kernel
from mechanics.delassus._kernels.rigid import apply
from mechanics.delassus.elimination import elimination
from mechanics.problem.forms import SparseForm
from mechanics.problem.problem import RigidContacts

# refinement steps, at most
_REFINEMENTS = 2
# relative change of velocities due to rounding alone [-]
_VELOCITY_ROUNDING = 1e-14
# smallest pivot accepted, over the largest of its column, so that the elimination order stays [-]
_THRESHOLD = 0.01
# largest relative residual of a solution [-]
_LOST = 1e-9


class BodyForm(SparseForm):
    """Elimination on bodies for W = Hᵀ M⁻¹ H. With (W + Θ) r = b,

        (M + H Θ⁻¹ Hᵀ) v = H Θ⁻¹ b,     r = Θ⁻¹ (b - Hᵀ v)

    so each body has six unknowns whatever the number of its contacts, and W may be singular. Where Θ is small the
    subtraction cancels, so the result is refined in v and r (Björck 1967). Bodies are ordered by least degree on
    their own graph, in a hundredth of the time of an ordering of all unknowns and with less fill-in; many bodies by
    nested dissection, where their centres are known.

    Parameters
    ----------
    contacts : frames, lever arms and inverse inertias
    """

    def __init__(self, contacts: RigidContacts) -> None:
        self._contacts = contacts._replace(geometry=np.ascontiguousarray(contacts.geometry))
        inertia = contacts.inertia
        self._moving = np.flatnonzero(inertia[:, 0] > 0)
        upper = inertia[self._moving][:, [1, 2, 3, 2, 4, 5, 3, 5, 6]].reshape(-1, 3, 3)
        self._mass = np.zeros((len(self._moving), 6, 6))
        self._mass[:, [0, 1, 2], [0, 1, 2]] = 1.0 / inertia[self._moving, :1]
        self._mass[:, 3:, 3:] = np.linalg.inv(upper)

    def scaled(self, unit: Array) -> "BodyForm":
        """Return D W D with the units (nc,) on the diagonal of D; the pattern is shared."""
        scaled = BodyForm.__new__(BodyForm)
        scaled._contacts = self._contacts._replace(geometry=scaled_frames(self._contacts.geometry, unit))
        scaled._moving, scaled._mass = self._moving, self._mass
        scaled.__dict__["_pattern"] = self._pattern
        return scaled

    @cached_property
    def inertia(self) -> "csc_array[np.float64]":
        """M (6 nm, 6 nm) [kg], bodies in their own order."""
        return csc_array(block_diag(list(self._mass), format="csc"))

    @cached_property
    def across(self) -> "csr_array[np.float64]":
        """Hᵀ (3 nc, 6 nm)."""
        place = self._places(self._moving)[self._contacts.body]
        frame = self._contacts.geometry[:, None, :9].reshape(-1, 1, 3, 3)
        arm = self._contacts.geometry[:, 9:].reshape(-1, 2, 1, 3)
        # row · (ω × arm) = (arm × row) · ω
        rows = np.concatenate([np.broadcast_to(frame, (*arm.shape[:2], 3, 3)), np.cross(arm, frame)], axis=-1)
        rows[:, 1] *= -1.0
        c, s = np.nonzero(place >= 0)
        row = 3 * c[:, None, None] + np.arange(3)[:, None] + np.zeros(6, dtype=np.int64)
        column = 6 * place[c, s][:, None, None] + np.zeros((3, 1), dtype=np.int64) + np.arange(6)
        shape = (3 * len(place), 6 * len(self._moving))
        return csr_array((rows[c, s].ravel(), (row.ravel(), column.ravel())), shape=shape)

    @cached_property
    def lift(self) -> "csc_array[np.float64]":
        """H (6 nm, 3 nc)."""
        return csc_array(self.across.T)

    def _places(self, order: Ints) -> Ints:
        place = np.full(len(self._contacts.inertia), -1)
        place[order] = np.arange(len(order))
        return place

    @cached_property
    def _pattern(self) -> kernel.Pattern:
        places = self._places(self._moving)[self._contacts.body]
        pairs = places[(places >= 0).all(axis=1)]
        rank = elimination(pairs, self._moving, self._contacts.centre)
        order = self._moving[np.argsort(rank)]
        side, count = np.ascontiguousarray(self._places(order)[self._contacts.body]), len(order)
        row = np.concatenate([np.arange(count), rank[pairs[:, 0]], rank[pairs[:, 1]]])
        column = np.concatenate([np.arange(count), rank[pairs[:, 1]], rank[pairs[:, 0]]])
        key = np.unique(column * count + row)
        row, column = key % count, key // count
        height = np.bincount(column, minlength=count)
        first = np.concatenate([[0], np.cumsum(height)])
        rows = (6 * row[:, None] + np.arange(6)).ravel()
        # the six columns of a body have the same rows
        spread = np.repeat(first[:-1], 6)[:, None] * 6
        lengths = np.repeat(6 * height, 6)
        indptr = np.concatenate([[0], np.cumsum(lengths)])
        inside = np.arange(indptr[-1]) - np.repeat(indptr[:-1], lengths)
        indices = rows[np.repeat(spread.ravel(), lengths) + inside]
        both = side[:, None, :] * count + side[:, :, None]
        return kernel.Pattern(
            self._mass[np.argsort(rank)],
            side,
            indptr.astype(np.int32),
            indices.astype(np.int32),
            np.searchsorted(key, np.arange(count) * (count + 1)),
            np.searchsorted(key, both),
            36 * first[column] + 6 * (np.arange(len(key)) - first[column]),
            6 * height[column],
        )

    def shifted(self, theta: Array, exact: bool = True) -> Callable[[Array], Array]:
        """Return (W + Θ)⁻¹ as a function of b (3 nc,); `theta` (nc, 3, 3), invertible, not always symmetric [1/kg].

        Elimination on bodies loses accuracy where entries of Θ differ by many orders; `exact` checks each
        solution, and where its residual exceeds rounding solves the larger system of velocities and impulses.

        Raises
        ------
        SolverError : if Θ or the whole is singular
        """
        quick = self._factorised(theta, _THRESHOLD).refined
        if not exact:
            return quick

        def solve(b: Array) -> Array:
            """Solve for forces, refined where rounding has left a residual."""
            x = quick(b)
            r = x.reshape(theta.shape[:2])
            remaining = b - (apply(r, self._contacts) + np.einsum("cij,cj->ci", theta, r)).ravel()
            if np.linalg.norm(remaining) <= _LOST * np.linalg.norm(b):
                return x
            return super(BodyForm, self).shifted(theta)(b)

        return solve

    def _factorised(self, theta: Array, threshold: float) -> "_Factors":
        pattern, soft = self._pattern, kernel.inverses(theta)
        values = kernel.assemble(pattern, self._contacts.geometry, soft)
        if not np.isfinite(values).all():
            raise SolverError("Θ is singular", where="solver", remedy="use another method")
        size = 6 * len(pattern.mass)
        matrix = csc_array((values, pattern.indices, pattern.indptr), shape=(size, size))
        try:
            lu = splu(
                matrix,
                permc_spec="NATURAL",
                diag_pivot_thresh=threshold,
                options={"SymmetricMode": True},
            )
        except RuntimeError as error:
            raise SolverError("W + Θ is singular", where="solver", remedy="use another method") from error
        return _Factors(pattern, self._contacts.geometry, theta, soft, lu)


@dataclass(frozen=True)
class _Factors:
    """Factors of M + H Θ⁻¹ Hᵀ, and the parts of W + Θ."""

    pattern: kernel.Pattern
    geometry: Array
    theta: Array
    soft: Array
    lu: SuperLU

    def once(self, b: Array) -> tuple[Array, Array]:
        """Return v (nm, 6) and r (nc, 3) for one b (nc, 3), without refinement."""
        side = self.pattern.side
        load = kernel.pushed(self.soft, b, side, self.geometry, len(self.pattern.mass))
        v = self.lu.solve(load.ravel()).reshape(-1, 6)
        return v, kernel.softened(self.soft, b, v, side, self.geometry)

    def refined(self, b: Array) -> Array:
        """Return (W + Θ)⁻¹ b (3 nc,)."""
        side, mass, wanted = self.pattern.side, self.pattern.mass, b.reshape(-1, 3)
        v, r = self.once(wanted)
        for _ in range(_REFINEMENTS):
            first, second = kernel.corrected(self.theta, wanted, v, r, mass, side, self.geometry)
            second += kernel.pushed(self.soft, first, side, self.geometry, len(mass))
            step = self.lu.solve(second.ravel()).reshape(-1, 6)
            v += step
            r += kernel.softened(self.soft, first, step, side, self.geometry)
            if np.abs(step).max(initial=0.0) <= _VELOCITY_ROUNDING * np.abs(v).max(initial=0.0):
                break
        result: Array = r.ravel()
        return result


def scaled_frames(geometry: Array, unit: Array) -> Array:
    """Return the geometry (nc, 15) with each frame scaled by a unit (nc,): W becomes D W D."""
    scaled = geometry.copy()
    scaled[:, :9] *= unit[:, None]
    return scaled
