"""Independent reference: contact with friction as a sequence of cone programmes (Clarabel, Goulart & Chen 2024).

With the de Saxcé shift s = μ‖u_T‖ held, the laws are the optimality conditions of a convex programme in r
(Acary, Brémond & Huber 2018, §5),

    minimise  ½ rᵀ W r + (u_free + (bias + s) n)ᵀ r    over    ‖r_T‖ ≤ μ r_N + k,   r_N ≥ 0

whether W is singular or not. Each programme gives a new u_T, and with it the next shift, until the friction is
Coulomb's own. Where W is Hᵀ Â⁻¹ H, the velocities y = Â⁻¹ H r are unknowns too, ½ yᵀ Â y stands for ½ rᵀ W r, and
nothing dense is made.
"""

from dataclasses import dataclass, replace

import clarabel
import numpy as np
from scipy.sparse import block_array, block_diag, csc_array, diags_array, eye_array, triu, vstack

from mechanics.problem.forms import SparseForm
from mechanics.problem.problem import ContactSolution, ContactStart
from mechanics.problem.residual import residual
from mechanics.solvers.first_order.nsgs import Anderson
from mechanics.solvers.second_order.newton import Newton

# gap and infeasibility asked of Clarabel, which it can just reach; η is about the root of it [-]
_GAP = 1e-12
# κ/τ asked of Clarabel [-]
_KAPPA = 1e-14
# largest opening velocity over the fastest closing one; faster ones count as this, and η would show an error [-]
_FAR = 100.0
# smallest unit of velocity over the largest velocity [-]
_LEAST = 1e-3
# past shifts from which the next one is extrapolated
_DEPTH = 5
# η at which Newton's method may end it [-]
_NEAR = 0.1
# η over that of the last try from which Newton's method is tried again [-]
_NEARER = 0.7
# Newton's steps in one try
_NEWTON_STEPS = 40
# programmes in a row without a gain, after which rounding has won
_IN_VAIN = 30


@dataclass(frozen=True)
class ConeProgram:
    """Reference solver: slow, and as accurate as double precision allows.

    Interior points are exact to some 1e-5 where contacts are at the edge between two states, so Newton's method
    on the natural map ends it from there (`polish`).

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : interior-point iterations of all programmes, and Newton's steps, together
    polish : whether Newton's method ends it; False: the result of the programmes alone
    """

    tolerance: float = 1e-10
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    polish: bool = True

    def __call__(self, problem, start):
        """Solve; of the start its shift alone is used. Returns the best of all iterates."""
        limits = self.tolerance, self.velocity_tolerance
        left = residual(problem, start.impulse)
        best = ContactSolution(start.impulse, left.dual, 0, left.natural_map, left.within(*limits))
        if best.converged:
            return best
        programme, shifts = Programme(problem), Anderson(_DEPTH)
        shift, asked, vain, last, bold = shift_of(problem, start.impulse), _NEAR, 0, np.inf, True
        while not best.converged and vain < _IN_VAIN and programme.iterations < self.max_iterations:
            r = programme(shift, self.max_iterations - programme.iterations)
            found, vain = self.judged(problem, r), vain + 1
            if found.natural_map < best.natural_map:
                best, vain = found, 0
            if self.polish and not best.converged and found.natural_map < asked:
                asked = _NEARER * found.natural_map
                ended = self.newton(problem, found, self.max_iterations - programme.iterations)
                programme.iterations += ended.iterations
                best = ended if ended.natural_map < best.natural_map else best
            image = shift_of(problem, r)
            # where friction is much, extrapolations lead astray
            bold = bold and found.natural_map <= last
            bolder = shifts(shift, image) if bold else None
            shift, last = image if bolder is None else np.maximum(bolder, 0.0), found.natural_map
        return replace(best, iterations=programme.iterations)

    def judged(self, problem, impulse):
        left = residual(problem, impulse)
        within = left.within(self.tolerance, self.velocity_tolerance)
        return ContactSolution(impulse, left.dual, 0, left.natural_map, within)

    def newton(self, problem, found, most):
        newton = Newton(self.tolerance, self.velocity_tolerance, max(0, min(_NEWTON_STEPS, most)))
        return newton(problem, ContactStart(found.impulse, found.velocity))


def shift_of(problem, impulse):
    """Return μ‖u_T‖ (nc,) of some impulses."""
    u = problem.delassus.apply(impulse) + problem.u_free
    return problem.friction * np.sqrt((u[:, 1:] ** 2).sum(axis=1))


class Programme:
    """Programme of one problem, for one shift after the other; the pattern is analysed once.

    Unknowns are y and r in units in which the largest closing velocity and the mean diagonal of W are 1. A contact
    without friction has r_N only.
    """

    def __init__(self, problem):
        self.problem, self.iterations = problem, 0
        pushed = -(problem.u_free[:, 0] + problem.bias)
        # contacts that open may slide far faster than those that have to be stopped
        self.pace = float(max(pushed.max(), _LEAST * np.abs(problem.u_free).max(), 1e-300))
        self.scale = problem.delassus.scale
        rough = (problem.friction > 0) | (problem.cohesion > 0)
        d = problem.u_free.shape[1]
        self.kept = np.flatnonzero(np.column_stack([np.ones(len(rough), bool), *[rough] * (d - 1)]).ravel())
        energy, balance = energy_of(problem, self.kept, self.scale)
        self.extra = energy.shape[0] - len(self.kept)
        rows, right, cones = cones_of(problem, rough, self.kept, self.scale / self.pace)
        wide = csc_array((rows.shape[0], self.extra))
        rows = block_array([[wide, rows]]) if self.extra else rows
        if balance is not None:
            rows, right = vstack([balance, rows]), np.concatenate([np.zeros(self.extra), right])
            cones = [clarabel.ZeroConeT(self.extra), *cones]
        self.settings = exact_settings()
        self.solver = clarabel.DefaultSolver(
            csc_array(triu(energy)),
            np.zeros(energy.shape[0]),
            csc_array(rows),
            right,
            cones,
            self.settings,
        )
        self.most = int(self.settings.max_iter)

    def __call__(self, shift, most):
        """Return the impulses r (nc, d) of the programme with one shift (nc,), within `most` iterations."""
        problem = self.problem
        free = problem.u_free.copy()
        # contacts far from closing count as a little nearer: large numbers would hide the small ones
        free[:, 0] = np.minimum(free[:, 0] + problem.bias, _FAR * self.pace) + shift
        linear = np.concatenate([np.zeros(self.extra), free.ravel()[self.kept] / self.pace])
        self.settings.max_iter = min(most, self.most)
        self.solver.update(q=linear, settings=self.settings)
        found = self.solver.solve()
        self.iterations += int(found.iterations)
        impulse = np.zeros(problem.u_free.size)
        impulse[self.kept] = np.asarray(found.x)[self.extra :] * (self.pace / self.scale)
        return impulse.reshape(problem.u_free.shape)


def exact_settings():
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads, settings.presolve_enable = False, 1, False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = _GAP
    settings.tol_ktratio = _KAPPA
    return settings


def energy_of(problem, kept, scale):
    """Return the quadratic part over (y, r) or r alone, in units of `scale`, and Â y - H r = 0 where y is there."""
    form = problem.delassus.form
    if isinstance(form, SparseForm):
        # each velocity in the unit in which its mass is 1
        unit = diags_array(1.0 / np.sqrt(form.inertia.diagonal()))
        inertia, lift = unit @ form.inertia @ unit, (unit @ form.lift)[:, kept] / np.sqrt(scale)
        none = csc_array((len(kept), len(kept)))
        return block_diag([inertia, none]), csc_array(block_array([[inertia, -lift]]))
    return form.matrix[kept][:, kept] / scale, None


def cones_of(problem, rough, kept, unit):
    """Return rows, right side and kinds of: (μ r_N + k, r_T) in a second-order cone, r_N ≥ 0."""
    d, k = problem.u_free.shape[1], problem.cohesion
    # without cohesion r_N ≥ 0 follows from the cone
    side = np.flatnonzero(~rough | (k > 0))
    factor = np.ones(problem.u_free.shape)
    factor[:, 0] = problem.friction
    identity = eye_array(problem.u_free.size, format="csr")
    cone = (d * np.flatnonzero(rough)[:, None] + np.arange(d)).ravel()
    rows = vstack([diags_array(factor.ravel()).tocsr()[cone], identity[d * side]])[:, kept]
    right = np.zeros((int(rough.sum()), d))
    right[:, 0] = k[rough] * unit
    kinds = [clarabel.SecondOrderConeT(d)] * int(rough.sum())
    if len(side):
        kinds.append(clarabel.NonnegativeConeT(len(side)))
    return -rows, np.concatenate([right.ravel(), np.zeros(len(side))]), kinds
