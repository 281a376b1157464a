"""Siconos on one stored problem; a process of its own, run by benchmarks.fc3d with the interpreter that has Siconos.

It needs numpy, scipy and Siconos alone, so that interpreter need not have MOMA. One line of JSON per method.
"""

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np


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
        # made anew for each method: some keep factors or rescale
        blocks = sn.SBM_from_csparse(3, matrix)[1]
        problem = sn.FrictionContactProblem(3, blocks, q.copy(), mu.copy())
        options = sn.SolverOptions(solver)
        options.dparam[sn.SICONOS_DPARAM_TOL] = tolerance
        options.iparam[sn.SICONOS_IPARAM_MAX_ITER] = iterations
        settings(options)
        impulse, velocity = np.zeros(size), np.zeros(size)
        start = time.process_time()
        info = sn.fc3d_driver(problem, impulse, velocity, options)
        cpu = time.process_time() - start
        row = {
            "method": name,
            "solved": info == 0,
            "error": float(options.dparam[sn.SICONOS_DPARAM_RESIDU]),
            "iterations": int(options.iparam[sn.SICONOS_IPARAM_ITER_DONE]),
            "cpu": cpu,
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
