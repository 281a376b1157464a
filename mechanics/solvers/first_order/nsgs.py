"""Non-smooth Gauss–Seidel (Jean 1999; Jourdan, Alart & Jean 1998), with safeguarded Anderson acceleration."""

from dataclasses import dataclass

import numpy as np

from mechanics.arrays import Array
from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart, GaussSeidel
from mechanics.problem.residual import Residual, project_on_cone, residual
from mechanics.solvers.scales import LOOK, ROUNDING


class Anderson:
    """Extrapolation from the last iterates of x ← G(x).

    Parameters
    ----------
    depth : number of differences of iterates
    """

    def __init__(self, depth: int) -> None:
        self._depth = depth
        self._images: list[Array] = []
        self._steps: list[Array] = []

    def __call__(self, x: Array, image: Array) -> Array | None:
        """Return the extrapolated iterate, given x and G(x); None as long as too little is known."""
        self._images.append(image.ravel().copy())
        self._steps.append((image - x).ravel())
        del self._images[: -self._depth - 1], self._steps[: -self._depth - 1]
        if len(self._steps) < 2:
            return None
        steps, images = np.diff(self._steps, axis=0), np.diff(self._images, axis=0)
        gram = steps @ steps.T
        size = float(np.trace(gram))
        if size == 0.0:
            return None
        # regularised, as late differences are nearly parallel
        gram += ROUNDING * size * np.eye(len(gram))
        weights = np.linalg.solve(gram, steps @ self._steps[-1])
        extrapolated: Array = (self._images[-1] - weights @ images).reshape(x.shape)
        return extrapolated

    def forget(self) -> None:
        """Start over: after a bad extrapolation the old iterates mislead."""
        del self._images[:-1], self._steps[:-1]


# η of an extrapolation over that of the sweeps above which it is dropped, with the old iterates: one that looks worse
# at first mostly leads on [-]
_BAD = 10.0


@dataclass(frozen=True)
class NSGS:
    """Sweeps over the contacts, each solved exactly with its neighbours frozen, until η ≤ tolerance.

    A block of 250 kg on a floor: in a step of 2 ms its contact impulses add up to m g h.

    >>> import numpy as np
    >>> from mechanics.delassus.rigid import RigidDelassus, schedule
    >>> body, arm = np.tile([1, 0], (4, 1)), [[x, y, -0.25] for x in (-0.25, 0.25) for y in (-0.25, 0.25)]
    >>> geometry = [[0, 0, 1, 1, 0, 0, 0, 1, 0, *a, *a] for a in arm]
    >>> inertia = np.array([[0.0] * 7, [1 / 250, 0.096, 0, 0, 0.096, 0, 0.096]])
    >>> w = RigidDelassus(body, np.array(geometry), inertia, schedule(body, np.array([False, True])))
    >>> zero, fall = np.zeros((4, 3)), np.tile([-9.81 * 2e-3, 0.0, 0.0], (4, 1))
    >>> problem = ContactProblem(w, fall, zero[:, 0], np.full(4, 0.6), zero[:, 0])
    >>> round(float(NSGS()(problem, ContactStart(zero, zero)).impulse[:, 0].sum()), 4)
    4.905

    Attributes
    ----------
    tolerance : natural map η at which the problem counts as solved [-]
    velocity_tolerance : largest velocity by which a contact may break its law, over that of u_free [-]
    max_iterations : limit of the sweeps
    min_iterations : sweeps that are made even where fewer solve the problem
    check_every : sweeps between two looks at η
    depth : past iterates from which Anderson's method extrapolates at each look; an extrapolation is kept unless its
        η is ten times that of the sweeps alone: one that looks worse at first mostly leads on. 0: plain sweeps
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000
    check_every: int = LOOK
    depth: int = 20
    min_iterations: int = 0

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from the impulses of `start`; return the best of all looks."""
        impulse = start.impulse.copy()
        remaining = residual(problem, impulse)
        best, sweeps = (impulse, remaining), 0
        limits = self.tolerance, self.velocity_tolerance
        if self.min_iterations or not remaining.within(*limits):
            shift = problem.biased
            sweep = problem.delassus.gauss_seidel(shift, problem.friction, problem.cohesion)
            look = _Look(problem, sweep, self.depth, limits)
            while sweeps < self.min_iterations or (
                not remaining.within(*limits) and sweeps < self.max_iterations
            ):
                count = min(self.check_every, self.max_iterations - sweeps)
                impulse, remaining = look(impulse, count)
                sweeps += count
                if remaining.natural_map <= best[1].natural_map:
                    best = impulse.copy(), remaining
        if not remaining.within(*limits):
            impulse, remaining = best
        return ContactSolution(
            impulse, remaining.dual, sweeps, remaining.natural_map, remaining.within(*limits)
        )


class _Look:
    """Some sweeps, a look at the residual, and maybe an extrapolation."""

    def __init__(
        self, problem: ContactProblem, sweep: GaussSeidel, depth: int, limits: tuple[float, float]
    ) -> None:
        self._problem, self._sweep, self._limits = problem, sweep, limits
        self._anderson = Anderson(depth) if depth else None

    def __call__(self, impulse: Array, count: int) -> tuple[Array, Residual]:
        """Return the next iterate and its residual; `impulse` may be overwritten."""
        if self._anderson is None:
            self._sweep(impulse, count)
            return impulse, residual(self._problem, impulse)
        swept = impulse.copy()
        self._sweep(swept, count)
        remaining = residual(self._problem, swept)
        candidate = self._anderson(impulse, swept)
        if candidate is None or remaining.within(*self._limits):
            return swept, remaining
        candidate = project_on_cone(candidate, self._problem.friction, self._problem.cohesion)
        bold = residual(self._problem, candidate)
        if bold.natural_map < _BAD * remaining.natural_map:
            return candidate, bold
        self._anderson.forget()
        return swept, remaining
