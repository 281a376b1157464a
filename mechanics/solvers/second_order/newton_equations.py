"""Equations of a step of Newton's method: those of rigid bodies, of bodies of which some deform, or of W itself.

    A Δr + B (W + α) Δr = -F

Between rigid bodies they are those of the bodies' velocities, however many contacts two of them share
(mechanics/solvers/_kernels/body_newton.py). Where bodies deform, W is that of rigid ones and what they yield, of which
the diagonal alone is a compliance of the joints: the equations with that lead a Krylov method (GMRES, Saad & Schultz
1986) to the step within some five products with W. Factors that only lead may be of single precision, and those of an
earlier step as long as no contact has changed since. Where most bodies deform, W + B⁻¹ A + α is factorised.
"""

from typing import Protocol

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import LinearOperator, SuperLU, gmres, splu

from ground.errors import SolverError
from mechanics.arrays import Array, Ints
from mechanics.delassus.compliant import CompliantDelassus, simplified
from mechanics.delassus.elimination import elimination
from mechanics.problem.forms import Form
from mechanics.problem.problem import ContactProblem, Delassus, RigidContacts
from mechanics.solvers._kernels import body_newton as bodies
from mechanics.solvers.scales import ROUNDING


class SparseBlocks:
    """Pattern of a matrix of 3 × 3 blocks whose structure is symmetric, and its latest factors.

    Parameters
    ----------
    indices : (nnz,) columns of the blocks, row by row
    indptr : (n + 1,) where each row begins
    rank : (n,) place of each row of blocks in the order of elimination
    """

    def __init__(self, indices: Ints, indptr: Ints, rank: Ints) -> None:
        row, column = np.repeat(rank, np.diff(indptr)), rank[indices]
        each = np.arange(3)
        rows = (3 * row[:, None, None] + each[:, None] + 0 * each).ravel()
        columns = (3 * column[:, None, None] + 0 * each[:, None] + each).ravel()
        size = 3 * len(rank)
        numbers = coo_array((np.arange(len(rows), dtype=float), (rows, columns)), shape=(size, size)).tocsc()
        self._source = numbers.data.astype(np.int64)
        self._rows, self._starts, self._size = numbers.indices, numbers.indptr, size
        self._place = np.argsort(rank)
        self._factors: SuperLU | None = None
        self._precision = np.dtype(float)

    def factorise(self, value: Array) -> bool:
        """Factorise the matrix of these blocks (nnz, 3, 3) in their precision; return whether it is regular.

        Factors of single precision take 0.6 of the time, and only lead to a solution.
        """
        # those of the matrix before make room for them
        self._factors = None
        self._precision = value.dtype
        data = value.ravel()[self._source]
        if not np.isfinite(data).all():
            return False
        matrix = csc_array((data, self._rows, self._starts), shape=(self._size, self._size))
        try:
            self._factors = splu(
                matrix,
                permc_spec="NATURAL",
                # the order of elimination stays
                diag_pivot_thresh=0.0,
                options={"SymmetricMode": True},
            )
        except RuntimeError:
            return False
        return True

    def solve(self, x: Array) -> None:
        """Replace a right side (n, 3) by the solution."""
        assert self._factors is not None
        with np.errstate(over="ignore"):
            right = x[self._place].ravel().astype(self._precision, copy=False)
        x[self._place] = self._factors.solve(right).reshape(-1, 3)


# error of the equations of bodies that deform over their right side: Newton's steps correct it [-]
_INEXACT = 1e-2
# most products with W for them
_PRODUCTS = 30
# change of a contact's derivatives from which it opens, slides or sticks unlike before [-]
_UNLIKE = 0.3
# most products with W while the factors of an earlier step lead: as long as a factorisation and the products after it
_AGAIN = 12


class Equations(Protocol):
    """Linear equations of a step."""

    def step(self, first: Array, second: Array, error: Array, alpha: float) -> Array | None:
        """Return Δr (nc, 3) from A, B and F; None if the equations are singular."""


def equations_of(problem: ContactProblem, rho: Array) -> Equations:
    """Return the equations of a problem; ρ (nc, 2) are those of Alart and Curnier [kg].

    Raises
    ------
    SolverError : if W is known by its products alone
    """
    operator = problem.delassus
    if operator.rigid is not None:
        return _BodyEquations(operator.rigid, operator.joint_compliance)
    # joints that do not yield leave W singular between rigid stones: factors in simple terms would lead astray
    if operator.mostly_rigid and operator.joint_compliance is not None:
        simple = simplified(operator)
        if simple is not None:
            return _YieldingEquations(operator, simple)
    return _FormEquations(problem.form("Newton's method"), rho)


class _FormEquations:
    """Equations of the impulses, (W + B⁻¹ A + α) Δr = -B⁻¹ F."""

    def __init__(self, form: Form, rho: Array) -> None:
        self._form, self._rho = form, rho

    def step(self, first: Array, second: Array, error: Array, alpha: float) -> Array | None:
        """Return Δr (nc, 3); None if the equations are singular."""
        unit = np.eye(error.shape[1])
        # B is singular where a contact is open
        inverse = np.linalg.inv(second + ROUNDING * self._rho[:, [0, 1, 1]][:, : len(unit), None] * unit)
        theta, right = inverse @ first + alpha * unit, -np.einsum("cij,cj->ci", inverse, error)
        try:
            return self._form.shifted(theta)(right.ravel()).reshape(error.shape)
        except SolverError:
            return None


class _BodyEquations:
    """Equations of the bodies' velocities: pattern, matrix, factors."""

    _single = False  # precision of the factors

    def __init__(self, contacts: RigidContacts, compliance: Array | None) -> None:
        self._contacts, inertia = contacts, contacts.inertia
        self._compliance = np.zeros((len(contacts.body), 3)) if compliance is None else compliance
        moving = np.flatnonzero(inertia[:, 0] > 0)
        place = np.full(len(inertia), -1)
        place[moving] = np.arange(len(moving))
        diagonal = np.zeros((len(moving), 2, 3, 3))
        diagonal[:, 0] = np.eye(3) / inertia[moving, 0][:, None, None]
        upper = inertia[moving][:, [1, 2, 3, 2, 4, 5, 3, 5, 6]].reshape(-1, 3, 3)
        diagonal[:, 1] = np.linalg.inv(upper)
        side = place[contacts.body]
        blocks, width, indices, indptr = _pattern(side, len(moving))
        self._blocks = bodies.BodyBlocks(place, blocks, diagonal, width)
        nc = len(contacts.body)
        self._inverse, self._gain = np.empty((2, nc, 3, 3))
        self._value = np.empty((len(indices), 3, 3))
        rank = elimination(side[(side >= 0).all(axis=1)], moving, contacts.centre)
        self._factors = SparseBlocks(indices, indptr, (2 * rank[:, None] + np.arange(2)).ravel())

    def step(self, first: Array, second: Array, error: Array, alpha: float) -> Array | None:
        """Return Δr (nc, 3); None if the equations are singular."""
        return self._solve(second, error) if self._factorise(first, second, alpha) else None

    def _factorise(self, first: Array, second: Array, alpha: float) -> bool:
        if not bodies.inverse_blocks(first, second, alpha + self._compliance, self._inverse, self._gain):
            return False
        bodies.body_matrix(self._contacts, self._gain, self._blocks, self._value)
        if not self._single:
            return self._factors.factorise(self._value)
        with np.errstate(over="ignore"):
            return self._factors.factorise(self._value.astype(np.float32))

    def _solve(self, second: Array, error: Array) -> Array:
        contacts, place = self._contacts, self._blocks.place
        velocity, step = np.empty((2 * len(self._blocks.own), 3)), np.empty_like(error)
        bodies.body_load(contacts, self._inverse, error, place, velocity)
        self._factors.solve(velocity)
        bodies.contact_step(contacts, self._inverse, second, error, place, velocity, step)
        return step


class _YieldingEquations(_BodyEquations):
    """Equations of bodies of which some deform, A Δr + B (W + α) Δr = -error, led by those of W in simple terms."""

    def __init__(self, operator: Delassus, simple: CompliantDelassus) -> None:
        assert simple.rigid is not None
        super().__init__(simple.rigid, simple.joint_compliance)
        self._operator = operator
        # derivatives for impulses and velocities (nc, 3, 3) at which the factors were made
        self._led: tuple[Array, Array] | None = None
        self._lasts = True
        self._single = True

    def step(self, first: Array, second: Array, error: Array, alpha: float) -> Array | None:
        """Return Δr (nc, 3); None if the equations are singular."""
        if self._lasts and self._led is not None and np.abs(first - self._led[0]).max() <= _UNLIKE:
            change, products = self._found(first, second, error, alpha, _AGAIN)
            if products <= _AGAIN:
                return change
            self._lasts = False
        self._led = None
        if self._factorise(first, second, alpha):
            self._led = first.copy(), second.copy()
            change, products = self._found(first, second, error, alpha, _PRODUCTS)
            self._lasts &= products <= _AGAIN
            # the matrix may be too badly conditioned for single precision, as where joints hardly yield
            self._single &= products <= _PRODUCTS
            return change
        if not self._single:
            return None
        self._single = False
        return self.step(first, second, error, alpha)

    def _found(self, first: Array, second: Array, error: Array, alpha: float, most: int) -> tuple[Array, int]:
        """Return Δr (nc, 3) and the products that it took; one more than `most` where these did not suffice."""
        assert self._led is not None
        leading, made = self._led[1], 0

        def before(y: Array) -> Array:
            """Return the forces of the preconditioner."""
            return self._solve(leading, -y.reshape(-1, 3))

        def product(y: Array) -> Array:
            """Return the product of the preconditioned equations."""
            nonlocal made
            made += 1
            r = before(y)
            u = self._operator.apply(r) + alpha * r
            both: Array = np.matmul(first, r[:, :, None]) + np.matmul(second, u[:, :, None])
            return both.ravel()

        equations = LinearOperator((error.size, error.size), matvec=product, dtype=float)
        y, unsolved = gmres(equations, -error.ravel(), rtol=_INEXACT, restart=most, maxiter=1)
        # the last product checks what the others found
        return before(y), min(made, most) if unsolved == 0 else most + 1


def _pattern(side: Ints, count: int) -> tuple[Ints, Ints, Ints, Ints]:
    """Return `blocks` and `width` of `BodyBlocks`, and the block rows (indices, indptr) of all bodies.

    `side` (nc, 2) are the places of the bodies of each contact among the `count` that move.
    """
    s, t = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    row, column = side[:, s], side[:, t]
    valid = (row >= 0) & (column >= 0)
    diagonal = np.arange(count) * (count + 1)
    keys, where = np.unique(np.concatenate([diagonal, (row * count + column)[valid]]), return_inverse=True)
    degree = np.bincount(keys // count, minlength=count)
    before = np.concatenate([[0], np.cumsum(degree)[:-1]]).astype(np.int64)
    within = np.arange(len(keys)) - before[keys // count]
    at = 4 * before[keys // count] + 2 * within
    blocks = np.full((len(side), 4), -1)
    blocks[valid] = at[where[count:]]
    width = np.column_stack([2 * degree, at[where[:count]]]).astype(np.int64)
    columns = 2 * (keys % count)
    both = np.column_stack([columns, columns + 1]).ravel()
    parts = np.split(both, 2 * before[1:])
    indices = np.concatenate([index for index in parts for _ in range(2)]).astype(np.int64)
    indptr = np.concatenate([[0], np.cumsum(np.repeat(2 * degree, 2))]).astype(np.int64)
    return blocks, width, indices, indptr
