"""Frictional contact problem of one step: pure algebra between physics and algorithm.

    find (u, r):  u = W r + u_free,   0 ≤ u_N + bias ⊥ r_N ≥ 0,   ‖r_T‖ ≤ μ r_N + k,  r_T opposes u_T at the limit

W = Hᵀ ŵ H is behind the protocol `Delassus`; mechanics/delassus holds its operators. Laws with adhesion state r shifted
by the largest tension, so that r_N ≥ 0 (mechanics/scene/laws/law.py).
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from ground.errors import SolverError
from mechanics.arrays import Array, Ints
from mechanics.problem.forms import Form, ScaledForm
from mechanics.problem.validation import check_problem


class GaussSeidel(Protocol):
    """Passes of non-smooth Gauss–Seidel on one problem."""

    def __call__(self, impulse: Array, count: int, /) -> None:
        """Sweep `impulse` (nc, d) in place, `count` times."""


class RigidContacts(NamedTuple):
    """Contacts between rigid bodies, from which W = Hᵀ M⁻¹ H follows; an argument of compiled loops.

    Attributes
    ----------
    body : (nc, 2) int64, candidate and antagonist
    geometry : (nc, 15) float64, rows n, t1, t2 of the frame [-], then the lever arms from the two centres of mass [m],
        world axes
    inertia : (nb, 7) float64, inverse mass [1/kg] and upper triangle of the inverse inertia [1/(kg m²)], world axes;
        zero for bodies that no impulse moves
    centre : (nb, 3) float64, centres of mass, by which factors are ordered; (0, 3) where not known [m]
    """

    body: Ints
    geometry: Array
    inertia: Array
    centre: Array


class PlaneContacts(NamedTuple):
    """Contacts between rigid bodies of the plane, from which W = Hᵀ M⁻¹ H follows.

    Attributes
    ----------
    body : (nc, 2) int64, candidate and antagonist
    normal : (nc, 2) float64, n; t is n turned by +90° [-]
    lever : (nc, 4) float64, a × n and a × t of the candidate, then of the antagonist [m]
    inertia : (nb, 2) float64, inverse mass and moment of inertia; zero for bodies that no impulse moves
    centre : (nb, 2) float64, by which factors are ordered; (0, 2) where not known [m]
    """

    body: Ints
    normal: Array
    lever: Array
    inertia: Array
    centre: Array


class Delassus(Protocol):
    """W = Hᵀ ŵ H, the relative velocities that impulses cause; d is 3, or 2 in the plane.

    Products, sweeps and the diagonal are known of every operator. `form`, `rigid` and `plane` are capabilities that not
    every operator has; solvers ask for them and never for a class.

    Attributes
    ----------
    diagonal : (nc, d, d) W_αα [1/kg]
    scale : reference against which u is measured over r [1/kg]; as a rule the mean diagonal of W (`mean_diagonal`)
    form : W ready to be factorised, made at the first use; None where W is known by its products alone
    rigid : contacts in terms of bodies, where every body is rigid and in space; None for other operators
    plane : the same in the plane
    joint_compliance : (nc, d) diagonal of E where the operator is W + E (`CompliantDelassus`), which `rigid` leaves
        out; None for others [1/kg]
    mostly_rigid : some bodies deform, and more of those that move do not
    as_rigid : W if no body deformed, where some do; W less it is what they yield, positive semidefinite. None for
        others
    """

    @property
    def diagonal(self) -> Array:
        """W_αα (nc, d, d) [1/kg]."""

    @property
    def scale(self) -> float:
        """Reference against which u is measured over r [1/kg]."""

    @property
    def form(self) -> Form | None:
        """W ready to be factorised, or None."""

    @property
    def rigid(self) -> RigidContacts | None:
        """Contacts in terms of rigid bodies, or None."""

    @property
    def plane(self) -> PlaneContacts | None:
        """Contacts in terms of rigid bodies of the plane, or None."""

    @property
    def joint_compliance(self) -> Array | None:
        """Diagonal of E (nc, d) [1/kg], or None."""

    @property
    def mostly_rigid(self) -> bool:
        """True where some bodies deform, and more do not."""

    @property
    def as_rigid(self) -> "Delassus | None":
        """W if no body deformed, or None."""

    def apply(self, impulse: Array) -> Array:
        """Return W r (nc, d) [m/s]."""

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Return sweeps that solve each contact exactly with its neighbours frozen.

        Parameters
        ----------
        shift : (nc, d) u_free, with the bias added to its normal part [m/s]
        friction, cohesion : (nc,) μ [-] and k [N s]
        """

    def scaled(self, unit: Array) -> "Delassus":
        """Return D W D with the units (nc,) of the contacts on the diagonal of D, with the same capabilities."""


def mean_diagonal(diagonal: Array) -> float:
    """Return the mean of the diagonals of the blocks (nc, d, d) [1/kg]; 1 without contacts."""
    if len(diagonal) == 0:
        return 1.0
    return float(np.einsum("cii->", diagonal) / (len(diagonal) * diagonal.shape[1]))


@dataclass(frozen=True)
class ScaledDelassus:
    """D W D of any operator, by its own products and sweeps.

    Attributes
    ----------
    inner : W
    unit : (nc,) diagonal of D
    """

    inner: Delassus
    unit: Array
    rigid = None
    plane = None
    joint_compliance = None
    # by the choice of D
    scale = 1.0

    @cached_property
    def diagonal(self) -> Array:
        """D_α W_αα D_α (nc, d, d) [-]."""
        blocks: Array = self.inner.diagonal * (self.unit**2)[:, None, None]
        return blocks

    @property
    def mostly_rigid(self) -> bool:
        """As that of the operator itself."""
        return self.inner.mostly_rigid

    @cached_property
    def as_rigid(self) -> Delassus | None:
        """D W D if no body deformed, or None."""
        rigid = self.inner.as_rigid
        return None if rigid is None else rigid.scaled(self.unit)

    @cached_property
    def form(self) -> ScaledForm | None:
        """D W D ready to be factorised, where W is."""
        inner = self.inner.form
        return None if inner is None else ScaledForm(inner, self.unit, self.inner.diagonal.shape[1])

    def apply(self, impulse: Array) -> Array:
        """Return D W D r̂ (nc, d)."""
        return self.unit[:, None] * self.inner.apply(self.unit[:, None] * impulse)

    def gauss_seidel(self, shift: Array, friction: Array, cohesion: Array) -> GaussSeidel:
        """Return sweeps of the operator itself: solving one contact exactly does not depend on its unit."""
        unit = self.unit[:, None]
        inner = self.inner.gauss_seidel(shift / unit, friction, cohesion * self.unit)

        def sweeps(impulse: Array, count: int, /) -> None:
            """Sweep in the units of the problem that is scaled."""
            real = unit * impulse
            inner(real, count)
            impulse[:] = real / unit

        return sweeps

    def scaled(self, unit: Array) -> "ScaledDelassus":
        """Return this operator in units (nc,) of these units."""
        return ScaledDelassus(self.inner, self.unit * unit)


@dataclass(frozen=True)
class ContactProblem:
    """Statement of one step's contacts for a solver.

    Attributes
    ----------
    delassus : W
    u_free : (nc, d) relative velocity without contact impulses, local frame (n, t1, t2), or (n, t) [m/s]
    bias : (nc,) shift of u_N in Signorini's condition [m/s]
    friction : (nc,) Coulomb's μ [-]
    cohesion : (nc,) k, the tangential impulse carried at r_N = 0 [N s]
    adhesion : (nc,) shift of r_N, r̃ = r + s n; None where no contact has one [N s]

    Raises
    ------
    SolverError : if it cannot be solved: shapes that do not fit, NaN, contacts that do not give way, negative friction
    """

    delassus: Delassus
    u_free: Array
    bias: Array
    friction: Array
    cohesion: Array
    adhesion: Array | None = None

    def __post_init__(self) -> None:
        check_problem(
            self.delassus.diagonal,
            self.u_free,
            bias=self.bias,
            friction=self.friction,
            cohesion=self.cohesion,
            adhesion=self.adhesion,
        )

    @property
    def biased(self) -> Array:
        """u_free with the bias in its normal part (nc, d), not to be written [m/s]."""
        if not self.bias.any():
            return self.u_free
        velocity = self.u_free.copy()
        velocity[:, 0] += self.bias
        return velocity

    def form(self, solver: str) -> Form:
        """Return W ready to be factorised.

        Raises
        ------
        SolverError : naming the solver that asks, if W is known by its products alone
        """
        form = self.delassus.form
        if form is None:
            raise SolverError("the problem has no sparse form", where=solver, remedy='use the method "nsgs"')
        return form


@dataclass(frozen=True)
class ContactStart:
    """Initial guess of a solver: values remembered of the same contacts, zero for new ones.

    Attributes
    ----------
    impulse : (nc, d) r [N s]
    velocity : (nc, d) û = u + (bias + μ‖u_T‖) n, the velocity that is dual to r [m/s]
    motion : steps that still count as part of a motion, as the last solution had it (`ContactSolution`); None where it
        is not a motion that the steps follow
    ahead : r and û extrapolated from the last two steps, in a motion; None where only one is known
    """

    impulse: Array
    velocity: Array
    motion: int | None = None
    ahead: "ContactStart | None" = None


@dataclass(frozen=True)
class ContactSolution:
    """Result of a solver.

    Attributes
    ----------
    impulse : (nc, d) r, on the candidate, local frame [N s]
    velocity : (nc, d) û, dual to r, as the solver knows it [m/s]
    iterations : Gauss–Seidel sweeps, or the iterations of another method
    natural_map : η of `impulse`, as mechanics.problem.residual computes it
    converged : η, and the velocity error where a solver checks it, are within their tolerances
    why : method that found the solution and the reason for its choice; empty where there was no choice
    motion : number of steps to come that count as part of a motion: contacts slide or open in it, and the forces of one
        step no longer solve the next
    """

    impulse: Array
    velocity: Array
    iterations: int
    natural_map: float
    converged: bool
    why: str = ""
    motion: int = 0
