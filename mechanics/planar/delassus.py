"""W between rigid bodies of the plane, and its Gauss–Seidel sweeps."""

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
from scipy.sparse import csr_array, diags_array

from mechanics.arrays import Array, Ints
from mechanics.delassus._kernels.strips import cut
from mechanics.planar._kernels.sweep import (
    SweepOrder,
    apply,
    diagonals,
    layout_of,
    records,
    relative_velocity,
    sweep,
    sweep_parallel,
    velocity_change,
)
from mechanics.problem.forms import SparseForm
from mechanics.problem.problem import PlaneContacts, ScaledDelassus, mean_diagonal

# contacts of a part from which another thread pays: 0.1 ms of work
_THREAD_BATCH = 10_000
# parts at most: the contacts between them are swept by one thread
_PARTS = 4


@dataclass(frozen=True)
class PlanarDelassus:
    """W = Hᵀ M⁻¹ H, matrix-free.

    Attributes
    ----------
    bodies : (nc, 2) candidate and antagonist
    normal : (nc, 2) n, from antagonist to candidate; t is n turned by +90°
    lever : (nc, 4) a × n and a × t of the candidate, then of the antagonist, with a from the body's centre to the
        contact point [m]
    inertia : (nb, 2) inverse mass and inverse moment of inertia; zero for fixed and driven bodies [1/kg, 1/(kg m²)]
    threads : that may sweep at once, at most; the result is the same to the last bit
    centre : (nb, 2) of the bodies, by which factors are ordered; None if not known [m]
    """

    bodies: Ints
    normal: Array
    lever: Array
    inertia: Array
    threads: int = 1
    centre: Array | None = None
    rigid = None
    joint_compliance = None
    mostly_rigid = False
    as_rigid = None

    @property
    def plane(self) -> PlaneContacts:
        """Contacts in terms of rigid bodies."""
        centre = np.zeros((0, 2)) if self.centre is None else self.centre
        return PlaneContacts(self.bodies, self.normal, self.lever, self.inertia, centre)

    @cached_property
    def diagonal(self) -> Array:
        """W_αα (nc, 2, 2) [1/kg]."""
        result: Array = diagonals(self.bodies, self.lever, self.inertia)
        return result

    def apply(self, impulse: Array) -> Array:
        """Return W r (nc, 2) [m/s]."""
        result: Array = apply(impulse, self.bodies, self.normal, self.lever, self.inertia)
        return result

    def velocity_change(self, impulse: Array) -> Array:
        """Return M⁻¹ H r (nb, 3): the change of vx, vy [m/s] and ω [rad/s]."""
        result: Array = velocity_change(impulse, self.bodies, self.normal, self.lever, self.inertia)
        return result

    def relative_velocity(self, velocity: Array) -> Array:
        """Return u = Hᵀ v (nc, 2) [m/s] of the bodies' velocities (nb, 3)."""
        result: Array = relative_velocity(velocity, self.bodies, self.normal, self.lever)
        return result

    @cached_property
    def layout(self) -> SweepOrder:
        """Order of the sweeps; it depends on the contacts alone, never on the number of threads."""
        parts = min(max(len(self.bodies) // _THREAD_BATCH, 1), _PARTS)
        order, start, rank = cut(self.bodies, self.inertia[:, 0] > 0, parts, True)
        made: SweepOrder = layout_of(order, start, rank, self.bodies, self.inertia)
        return made

    @cached_property
    def scale(self) -> float:
        """Mean diagonal of W [1/kg]."""
        return mean_diagonal(self.diagonal)

    def scaled(self, unit: Array) -> ScaledDelassus:
        """Return D W D with the units (nc,) of the contacts on the diagonal of D."""
        return ScaledDelassus(self, unit)

    @cached_property
    def form(self) -> SparseForm:
        """W with sparse matrices: three velocities for each body that moves."""
        moving = np.flatnonzero(self.inertia[:, 0] > 0)
        place = np.full(len(self.inertia), -1)
        place[moving] = np.arange(len(moving))
        n = self.normal
        tangent = np.column_stack([-n[:, 1], n[:, 0]])
        # rows of u_N and u_T: along n and t, and the levers
        rows = np.stack([np.stack([n, tangent], axis=1)] * 2, axis=1)
        rows = np.concatenate([rows, self.lever.reshape(-1, 2, 2, 1)], axis=-1)
        rows[:, 1] *= -1.0
        c, s = np.nonzero(place[self.bodies] >= 0)
        row = 2 * c[:, None, None] + np.arange(2)[:, None] + np.zeros(3, dtype=np.int64)
        column = 3 * place[self.bodies[c, s]][:, None, None] + np.zeros((2, 1), dtype=np.int64) + np.arange(3)
        shape = (2 * len(n), 3 * len(moving))
        across = csr_array((rows[c, s].ravel(), (row.ravel(), column.ravel())), shape=shape)
        mass = 1.0 / self.inertia[moving][:, [0, 0, 1]].ravel()
        return SparseForm(diags_array(mass, format="csc"), across.T.tocsc())

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> "PlanarGaussSeidel":
        """Prepare sweeps on u = W r + shift with Coulomb's μ and the cohesion k, each (nc,)."""
        layout = self.layout
        record, partner = records(layout, shift, friction, cohesion, self.lever, self.normal, self.diagonal)
        return PlanarGaussSeidel(layout, record, partner, self.threads)


@dataclass(frozen=True)
class PlanarGaussSeidel:
    """Passes over the contacts, always in the same order.

    The contacts are cut into parts that share no body that moves, and the contacts between parts. Parts may be swept by
    several threads; the result is the same, bit by bit, for any number of them.

    Attributes
    ----------
    layout : the order
    record : (ng, 12, 8) what the kernel needs of each contact, in that order
    other : (ng, 3, 8) and of contacts that are not those of disks; (0, 3, 8) where all are
    threads : that may sweep at once, at most
    """

    layout: SweepOrder
    record: Array
    other: Array
    threads: int = 1

    def __call__(self, impulse: Array, sweeps: int) -> None:
        """Sweep `impulse` (nc, 2) in place."""
        threads = min(self.threads, numba.config.NUMBA_NUM_THREADS)
        if threads == 1 or len(self.layout.start) == 3:
            sweep(sweeps, impulse, self.record, self.other, self.layout)
            return
        before = numba.get_num_threads()
        numba.set_num_threads(threads)
        try:
            sweep_parallel(sweeps, impulse, self.record, self.other, self.layout)
        finally:
            numba.set_num_threads(before)
