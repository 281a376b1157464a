"""Strategy for disks of the plane: sweeps, and where information has far to go, ADMM and Newton's method."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from mechanics.problem.problem import ContactProblem, ContactSolution, ContactStart
from mechanics.solvers.first_order.disk_admm import DiskADMM
from mechanics.solvers.first_order.nsgs import NSGS
from mechanics.solvers.second_order.newton import Newton
from mechanics.solvers.strategies.rigid import moving_admm

__all__ = ["Planar"]


# sweeps with which a solution begins; they cost what 50 iterations of ADMM cost
_SWEEPS = 500
# sweeps between two looks at η
_LOOK = 20
# penalty of ADMM over the compliance of each contact for heaps that fall and settle [-]
_SETTLING = 0.05
# iterations with it
_SETTLE = 500
# penalty for slow flows: where many contacts are at the edge of sliding, a smaller one stands at η of 10⁻⁴ [-]
_FLOWING = 0.1
# iterations of ADMM with a balanced penalty: a stack of 100, and 10⁴ kg on 1 kg, take half of them
_BALANCED = 200
# contacts up to which a balanced penalty is tried: its iterations take three times as long
_SOME = 1000
# contacts up to which Newton's method is tried: its factorisations take as long as all the rest beyond
_FEW = 300
# its steps
_NEWTON = 30

_SETTLED, _FLOW = "admm of disks", "admm of disks, larger penalty"

_Solver = Callable[[ContactProblem, ContactStart], ContactSolution]


@dataclass(frozen=True)
class Planar:
    """Methods in turn until one has solved the problem; the best result counts.

    A sweep over disks costs a tenth of an iteration of ADMM, and propagates information by one disk. It solves impacts
    and small heaps. Compiled ADMM follows, from where the last step ended: it solves heaps that settle, and gets slow
    flows of thousands of disks, with a larger penalty, farther than any other method. Stacks, and heavy disks on light
    ones, need ADMM with a balanced penalty, or Newton's method.
    docs/design/disks.md has measurements.

    Attributes
    ----------
    tolerance, velocity_tolerance : as in `NSGS`
    max_iterations : sweeps and iterations together; up to 500 there are sweeps alone
    """

    tolerance: float = 1e-6
    velocity_tolerance: float = 1e-5
    max_iterations: int = 2000

    def __call__(self, problem: ContactProblem, start: ContactStart) -> ContactSolution:
        """Solve from `start`; `why` names the method that solved it, and what the one before left."""
        best = ContactSolution(start.impulse, start.velocity, 0, np.inf, False)
        done, before, settled = 0, "start", start
        for name, solve in self._stages(len(start.impulse)):
            # the larger penalty goes on where the smaller one ended
            found = solve(self.max_iterations - done)(problem, settled if name == _FLOW else start)
            done += found.iterations
            found = replace(found, why=f"{name}: {before}")
            before = f"{name} stood at η {found.natural_map:.0e}"
            best = min(found, best, key=lambda one: (not one.converged, one.natural_map))
            if found.converged or done >= self.max_iterations:
                break
            if name == _SETTLED:
                settled = ContactStart(found.impulse, found.velocity)
        return replace(best, iterations=done)

    def _stages(self, contacts: int) -> Iterator[tuple[str, Callable[[int], _Solver]]]:
        """Yield names, and solvers by their largest number of iterations."""
        limits = self.tolerance, self.velocity_tolerance
        yield "sweeps", lambda most: NSGS(*limits, min(_SWEEPS, most), _LOOK, 0)
        yield _SETTLED, lambda most: DiskADMM(*limits, min(_SETTLE, most), _SETTLING)
        if contacts <= _SOME:
            yield "admm, balanced penalty", lambda most: moving_admm(*limits, min(_BALANCED, most))
        if contacts <= _FEW:
            yield "Newton", lambda most: Newton(*limits, min(_NEWTON, most))
        yield _FLOW, lambda most: DiskADMM(*limits, most, _FLOWING)
