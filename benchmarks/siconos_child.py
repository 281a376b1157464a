"""Siconos on one stored problem; a process of its own, run by benchmarks.fc3d with the interpreter that has Siconos.

It needs numpy, scipy and Siconos alone, so that interpreter need not have MOMA. One line of JSON per method. `timed` is
how benchmarks.fc3d times our solvers too.
"""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

# calls after the first, as many as all of them end within so many seconds
_CALLS, _LONG = 5, 1.0


def timed(prepared: Callable[[], Callable[[], Any]]) -> tuple[Any, float, float]:
    """Call a solve once, and again some times.

    Parameters
    ----------
    prepared : returns the solve, from what knows nothing of earlier calls; it is not timed

    Returns
    -------
    what it returns, processor time of the first call [s], median of the later ones; that of the first if it is long [s]
    """
    times: list[float] = []
    result = None
    while not times or (len(times) <= _CALLS and sum(times) + times[-1] <= _LONG):
        solve = prepared()
        start = time.process_time()
        result = solve()
        times.append(time.process_time() - start)
    return result, times[0], float(np.median(times[1:] or times))


def main() -> None:
    """`siconos_child.py PROBLEM TOLERANCE MAX_ITERATIONS`."""
    import scipy.sparse as sparse
    import siconos.numerics as sn

    path, tolerance, iterations = sys.argv[1], float(sys.argv[2]), int(sys.argv[3])
    with np.load(path) as data:
        size = 3 * int(data["nc"])
        rows = sparse.bsr_matrix((data["data"], data["indices"], data["indptr"]), shape=(size, size))
        q, mu = data["q"], data["mu"]
    matrix = rows.tocsc()
    for name, (solver, settings) in _methods(sn).items():

        def prepared(solver: int = solver, settings: Callable[[Any], None] = settings) -> Callable[[], Any]:
            # made for each call: some methods keep factors or rescale
            blocks = sn.SBM_from_csparse(3, matrix)[1]
            problem = sn.FrictionContactProblem(3, blocks, q.copy(), mu.copy())
            options = sn.SolverOptions(solver)
            options.dparam[sn.SICONOS_DPARAM_TOL] = tolerance
            options.iparam[sn.SICONOS_IPARAM_MAX_ITER] = iterations
            settings(options)
            impulse, velocity = np.zeros(size), np.zeros(size)
            return lambda: (sn.fc3d_driver(problem, impulse, velocity, options), options)

        (info, options), first, cpu = timed(prepared)
        row = {
            "method": name,
            "solved": info == 0,
            "error": float(options.dparam[sn.SICONOS_DPARAM_RESIDU]),
            "iterations": int(options.iparam[sn.SICONOS_IPARAM_ITER_DONE]),
            "cpu": cpu,
            "cpu_first": first,
        }
        print("ROW " + json.dumps(row), flush=True)


def _methods(sn: Any) -> dict[str, tuple[int, Callable[[Any], None]]]:
    """NSGS as a fair judge of NSGS, and the methods that are its best on most problems (siconos.csv)."""

    def nsgs(options: Any) -> None:
        full = sn.SICONOS_FRICTION_3D_NSGS_ERROR_EVALUATION_FULL
        options.iparam[sn.SICONOS_FRICTION_3D_IPARAM_ERROR_EVALUATION] = full
        options.iparam[sn.SICONOS_FRICTION_3D_IPARAM_ERROR_EVALUATION_FREQUENCY] = 10

    def balanced(options: Any) -> None:
        strategy = sn.SICONOS_FRICTION_3D_ADMM_RHO_STRATEGY_RESIDUAL_BALANCING
        options.iparam[sn.SICONOS_FRICTION_3D_ADMM_IPARAM_RHO_STRATEGY] = strategy

    def plain(_: Any) -> None:
        pass

    return {
        "NSGS:err=FULL:freq=10": (sn.SICONOS_FRICTION_3D_NSGS, nsgs),
        "ADMM": (sn.SICONOS_FRICTION_3D_ADMM, plain),
        "ADMM:rho=RESIDUAL_BALANCING": (sn.SICONOS_FRICTION_3D_ADMM, balanced),
        "PROX": (sn.SICONOS_FRICTION_3D_PROX, plain),
        "NSN_AC": (sn.SICONOS_FRICTION_3D_NSN_AC, plain),
    }


if __name__ == "__main__":
    main()
