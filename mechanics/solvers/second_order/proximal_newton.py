"""Newton's method for rigid bodies, and deformable ones among them, however many contacts two of them share.

W of rigid bodies is singular: four contacts hold a stone in place three times over. So W + α stands for W in the
derivative of the non-smooth Newton method of Alart & Curnier (1991), with α as small as η, as in the method of
Levenberg and Marquardt (Fan & Yuan 2005): the steps stay near to where they began, and near the solution nothing is
lost. A line search keeps them from going astray; where it has to shorten steps, α grows. The equations of each step are
those of the bodies (mechanics/solvers/_kernels/body_newton.py). Of compliant joints, W + E for W, E adds to α there.

Where bodies deform, W is that of rigid ones and what they yield, of which the diagonal alone is, like E, a compliance
of the joints. The equations with that are solved as above, and lead a Krylov method (GMRES, Saad & Schultz 1986) to the
step within some five products with W. Factors that only lead may be of single precision, and those of an earlier step
as long as next to no contact has turned since.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from mechanics.arrays import Array, Ints
from mechanics.delassus.compliant import CompliantDelassus, simplified
from mechanics.delassus.elimination import elimination
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart, Delassus, RigidContacts
from mechanics.problem.residual import Residual, project_on_cone, residual
from mechanics.solvers._kernels import block_fronts as fronts
from mechanics.solvers._kernels import body_newton as bodies
from mechanics.solvers.second_order.scaling import solved_evenly
from mechanics.solvers.second_order.sparse_blocks import SparseBlocks
from moma.errors import SolverError

__all__ = ["ProximalNewton", "polished"]


# tolerances to which solutions are polished, over those asked for: what they leave would be a creep [-]
_FURTHER = 1e-3
# α over η and the scale of W, at first and at least [-]
_SHARE = 0.1
# α over the scale of W while a cold start holds every contact [-]
_HOLD = 1e-4
# smallest α over the scale of W; below it rounding would win [-]
_LEAST = 1e-11
# part of a step below which α counts as too small [-]
_SHORT = 0.2
# factor by which α then grows, and falls again after whole steps
_ADAPT = 4.0
# largest α over η and the scale of W [-]
_MOST = 1e6
# iterates to which the line search looks back
_MEMORY = 5
# gain that a step must bring, over what it promises [-]
_GAIN = 1e-4
# most numbers in the fronts of a factorisation, 3 GB; beyond, the method gives up and another one must solve
_ROOM = 400_000_000
# bodies from which sparse factors take less time than dense fronts, and a tenth of their memory
_MANY = 300
# shortest part of a step [-]
_SHORTEST = 1e-3
# error to which the equations of bodies that deform are solved, over their right side [-], and most products with W
_INEXACT, _PRODUCTS = 1e-2, 30
# change of a contact's derivatives that makes it unlike before [-], contacts that may be so while the factors of an
# earlier step lead, most products with W that those took when they were new, and then, which take as long as a
# factorisation and the products after it
_UNLIKE, _TURNED, _NEW, _AGAIN = 0.3, 3, 6, 12


@dataclass(frozen=True)
class ProximalNewton:
    """Proximal Newton method: high accuracy, between rigid bodies from any start, others from near a solution.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : limit of the steps, with a factorisation each as a rule
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 100

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`; return the best of all iterates.

        Raises
        ------
        SolverError : if W is not that of bodies
        """
        if problem.delassus.rigid is None and problem.delassus.as_rigid is None:
            raise SolverError(
                "W is not that of bodies", where="proximal Newton", remedy='use the method "interior-point"'
            )
        limits = self.tolerance, self.velocity_tolerance
        run = _Run(problem, start.impulse)
        best = run.left, run.r
        if not run.left.within(*limits) and not start.impulse.any():
            run.hold()
        while not run.left.within(*limits) and run.iterations < self.max_iterations and run.step():
            if run.left.natural_map < best[0].natural_map:
                best = run.left, run.r
        if run.left.natural_map < best[0].natural_map:
            best = run.left, run.r
        left, impulse = best
        return ContactSolution(impulse, left.dual, run.iterations, left.natural_map, left.within(*limits))


def polished(
    problem: ContactProblem, start: ContactStart, limits: tuple[float, float], most: int
) -> ContactSolution:
    """Solve by so many steps of Newton's method at `most`, to a thousandth of the tolerances (η, velocities)."""
    solver = ProximalNewton(_FURTHER * limits[0], _FURTHER * limits[1], most)
    found = solved_evenly(solver, problem, start)
    left = residual(problem, found.impulse)
    within = left.within(*limits)
    return replace(found, velocity=left.dual, natural_map=left.natural_map, converged=within)


class _Run:
    """Iterates of one solution.

    Attributes
    ----------
    r : (nc, 3) impulses [N s]
    left : their residual
    iterations : steps so far
    """

    def __init__(self, problem: ContactProblem, impulse: Array) -> None:
        self._problem, self._delassus = problem, problem.delassus
        self._free = problem.biased
        self._scale = problem.delassus.scale
        diagonal = problem.delassus.diagonal
        self._rho = np.column_stack([1.0 / diagonal[:, 0, 0], 2.0 / (diagonal[:, 1, 1] + diagonal[:, 2, 2])])
        self._first, self._second = np.zeros((2, len(impulse), 3, 3))
        self._merits: list[float] = []
        self.iterations, self._share = 0, _SHARE
        self._take(impulse, residual(problem, impulse))

    def _take(self, impulse: Array, left: Residual) -> None:
        self.r, self.left = impulse, left
        self._error = np.empty_like(impulse)
        self._u = self._delassus.apply(impulse) + self._free
        self._merits.append(self._look(impulse, self._u, self._error))

    @cached_property
    def _system(self) -> "_System":
        operator = self._delassus
        if operator.rigid is not None:
            return _System(operator.rigid, operator.joint_compliance)
        simple = simplified(operator)
        assert simple is not None
        return _YieldingSystem(operator, simple)

    def hold(self) -> None:
        """Begin as if every contact held.

        At rest without impulses only the lowest contact is seen to be pressed, and each step would find one more.
        """
        problem = self._problem
        self._first[:], self._second[:] = 0.0, np.eye(3)
        step = self._system.step(self._first, self._second, self._free, _HOLD * self._scale)
        if step is None:
            return
        self.iterations += 1
        held = project_on_cone(step, problem.friction, problem.cohesion)
        self._merits.clear()
        self._take(held, residual(problem, held))

    def step(self) -> bool:
        """Make one step of Newton's method; return whether there was one."""
        alpha = max(self._share * min(self.left.natural_map, 1.0), _LEAST) * self._scale
        step = self._system.step(self._first, self._second, self._error, alpha)
        if step is None:
            return False
        self.iterations += 1
        change = self._delassus.apply(step)
        length, limit, error = 1.0, max(self._merits[-_MEMORY:]), np.empty_like(step)
        merit = self._look(self.r + step, self._u + change, error)
        while not merit < (1.0 - _GAIN * length) * limit and length > _SHORTEST:
            length *= 0.5
            merit = self._look(self.r + length * step, self._u + length * change, error)
        if not np.isfinite(merit):
            return False
        if length < _SHORT:
            self._share = min(self._share * _ADAPT, _MOST)
        elif length == 1.0:
            self._share = max(self._share / _ADAPT, _SHARE)
        impulse = self.r + length * step
        self._take(impulse, residual(self._problem, impulse))
        return True

    def _look(self, r: Array, u: Array, error: Array) -> float:
        problem = self._problem
        merit: float = bodies.alart_curnier(
            r, u, problem.friction, problem.cohesion, self._rho, error, self._first, self._second
        )
        return merit


class _System:
    """Equations of the bodies' velocities: pattern, matrix, factors."""

    _single = False  # precision of the factors

    def __init__(self, contacts: RigidContacts, compliance: Array | None) -> None:
        self._contacts, inertia = contacts, contacts.inertia
        self._compliance = np.zeros((len(contacts.body), 3)) if compliance is None else compliance
        moving = np.flatnonzero(inertia[:, 0] > 0)
        place = np.full(len(inertia), -1)
        place[moving] = np.arange(len(moving))
        own = np.zeros((len(moving), 2, 3, 3))
        own[:, 0] = np.eye(3) / inertia[moving, 0][:, None, None]
        upper = inertia[moving][:, [1, 2, 3, 2, 4, 5, 3, 5, 6]].reshape(-1, 3, 3)
        own[:, 1] = np.linalg.inv(upper)
        side = place[contacts.body]
        blocks, width, indices, indptr = _pattern(side, len(moving))
        self._blocks = bodies.BodyBlocks(place, blocks, own, width)
        nc = len(contacts.body)
        self._inverse, self._gain = np.empty((2, nc, 3, 3))
        self._value = np.empty((len(indices), 3, 3))
        self._factors: SparseBlocks | _Fronts
        if len(moving) >= _MANY:
            rank = elimination(side[(side >= 0).all(axis=1)], moving, contacts.centre)
            each = (2 * rank[:, None] + np.arange(2)).ravel()
            self._factors = SparseBlocks(indices, indptr, each)
        else:
            self._factors = _Fronts(indices, indptr)

    def step(self, first: Array, second: Array, error: Array, alpha: float) -> Array | None:
        """Return Δr (nc, 3); None if the equations are singular, or their factors too large."""
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


class _YieldingSystem(_System):
    """Equations of bodies of which some deform, A Δr + B (W + α) Δr = -error, led by those of W in simple terms."""

    def __init__(self, operator: Delassus, simple: CompliantDelassus) -> None:
        assert simple.rigid is not None
        super().__init__(simple.rigid, simple.joint_compliance)
        self._operator = operator
        self._led: tuple[Array, Array] | None = None
        self._lasts = True
        self._single = isinstance(self._factors, SparseBlocks)

    def step(self, first: Array, second: Array, error: Array, alpha: float) -> Array | None:
        """Return Δr (nc, 3); None if the equations are singular, or their factors too large."""
        if self._lasts and self._led is not None and _turned(self._led[0], first) <= _TURNED:
            found, products = self._found(first, second, error, alpha, _AGAIN)
            if products <= _AGAIN:
                return found
            self._lasts = False
        self._led = None
        if self._factorise(first, second, alpha):
            self._led = first.copy(), second.copy()
            found, products = self._found(first, second, error, alpha, _PRODUCTS)
            self._lasts &= products <= _NEW
            # the matrix may be too badly conditioned for single precision, as where joints hardly yield
            self._single &= products <= _PRODUCTS
            return found
        if not self._single:
            return None
        self._single = False
        return self.step(first, second, error, alpha)

    def _found(self, first: Array, second: Array, error: Array, alpha: float, most: int) -> tuple[Array, int]:
        """Return Δr (nc, 3) and the products that it took; one more than `most` where these did not suffice."""
        assert self._led is not None
        leading, made = self._led[1], 0

        def before(y: Array) -> Array:
            return self._solve(leading, -y.reshape(-1, 3))

        def product(y: Array) -> Array:
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


def _turned(old: Array, new: Array) -> int:
    """Return the number of contacts that open, slide or stick unlike before, by derivatives (nc, 3, 3) for impulses."""
    return int(np.count_nonzero(np.abs(new - old).max(axis=(1, 2)) > _UNLIKE))


class _Fronts:
    """Dense fronts of few bodies, in the order of least degree."""

    def __init__(self, indices: Ints, indptr: Ints) -> None:
        self._plan = fronts.analyse(indices, indptr)
        self._fits = int(self._plan.aptr[-1]) <= _ROOM
        self._factor = np.empty(self._plan.aptr[-1] if self._fits else 0)
        self._pivot = np.empty(3 * (len(indptr) - 1), dtype=np.int64)
        self._work = np.empty(int(self._plan.whole.max()))

    def factorise(self, value: Array) -> bool:
        """Factorise the matrix of these blocks (nnz, 3, 3); return whether it is regular, and its fronts fit."""
        return self._fits and bool(fronts.factorise(value, False, self._plan, self._factor, self._pivot))

    def solve(self, x: Array) -> None:
        """Replace a right side (n, 3) by the solution."""
        fronts.solve(x, self._plan, self._factor, self._pivot, self._work)


def _pattern(side: Ints, count: int) -> tuple[Ints, Ints, Ints, Ints]:
    """Return `blocks` and `width` of `BodyBlocks`, and the block rows (indices, indptr) of all bodies.

    `side` (nc, 2) are the places of the bodies of each contact among the `count` that move.
    """
    s, t = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    row, column = side[:, s], side[:, t]
    known = (row >= 0) & (column >= 0)
    own = np.arange(count) * (count + 1)
    keys, where = np.unique(np.concatenate([own, (row * count + column)[known]]), return_inverse=True)
    degree = np.bincount(keys // count, minlength=count)
    before = np.concatenate([[0], np.cumsum(degree)[:-1]]).astype(np.int64)
    within = np.arange(len(keys)) - before[keys // count]
    at = 4 * before[keys // count] + 2 * within
    blocks = np.full((len(side), 4), -1)
    blocks[known] = at[where[count:]]
    width = np.column_stack([2 * degree, at[where[:count]]]).astype(np.int64)
    columns = 2 * (keys % count)
    both = np.column_stack([columns, columns + 1]).ravel()
    parts = np.split(both, 2 * before[1:])
    indices = np.concatenate([part for part in parts for _ in range(2)]).astype(np.int64)
    indptr = np.concatenate([[0], np.cumsum(np.repeat(2 * degree, 2))]).astype(np.int64)
    return blocks, width, indices, indptr
