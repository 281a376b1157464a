"""One cell of the matrix: a method on a row, and what an outside judge says of it."""

import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from benchmarks.extremes.laws import judge
from benchmarks.extremes.problems import VELOCITY_TOLERANCE, Row
from ground.errors import MomaError
from mechanics.problem.problem import ContactProblem, ContactStart
from mechanics.problem.residual import natural_map
from mechanics.scene.scene import Method, SolverSettings
from mechanics.solvers.choice import choose_solver

# η that solvers are asked for, and after how many iterations they give up
TOLERANCE, _ITERATIONS = 1e-8, 2000


class Outcome(StrEnum):
    """Outcome of a cell."""

    SOLVED = "solved"
    NOT_CONVERGED = "not converged"
    REFUSED = "refused"
    # claims to be solved, but breaks a law or is not what is known of the solution
    WRONG = "WRONG"
    # ended in an error that nobody foresaw, or in a warning of numpy
    CRASHED = "CRASHED"


@dataclass(frozen=True)
class Cell:
    """Outcome of one method on one row.

    Attributes
    ----------
    outcome : see `Outcome`
    eta : η of the end, computed by `mechanics.problem.residual`; NaN where there is none [-]
    iterations : of the solver, or of all steps
    broken : by how much a law is broken, over what the tolerances allow
    error : against what is known of the solution; None: nothing is
    seconds : of the processor
    words : what was said by what was refused, or failed
    """

    outcome: Outcome
    eta: float = np.nan
    iterations: int = 0
    broken: float = np.nan
    error: float | None = None
    seconds: float = 0.0
    words: str = ""

    @property
    def silent(self) -> bool:
        """True if somebody could be led astray by it."""
        return self.outcome in (Outcome.WRONG, Outcome.CRASHED)


def attempt(run: Callable[[], Cell]) -> Cell:
    """The cell of a run; a foreseen error is a refusal, any other one a crash, and so is a warning."""
    begin = time.process_time()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            return run()
    except MomaError as error:
        return Cell(Outcome.REFUSED, seconds=time.process_time() - begin, words=str(error))
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        return Cell(Outcome.CRASHED, seconds=time.process_time() - begin, words=words)


def refused_cell(make: Callable[[], object]) -> Cell:
    """The cell of what is to be refused: wrong if it can be made and run."""

    def made() -> Cell:
        make()
        return Cell(Outcome.WRONG, words="was taken")

    return attempt(made)


def solved_cells(row: Row, methods: tuple[Method, ...]) -> dict[str, Cell]:
    """The row's problem, solved from its start by each method; refused where it is made, it is so for all."""
    stated: list[ContactProblem] = []

    def state() -> Cell:
        stated.append(row.make())
        return Cell(Outcome.SOLVED)

    made = attempt(state)
    if not stated:
        return {method.value: made for method in methods}
    return {method.value: attempt(lambda m=method: _solved(row, stated[0], m)) for method in methods}  # type: ignore[misc]


def _solved(row: Row, problem: ContactProblem, method: Method) -> Cell:
    settings = SolverSettings(method, TOLERANCE, VELOCITY_TOLERANCE, _ITERATIONS)
    solver = choose_solver(settings, row.deformable)
    impulse = np.full_like(problem.u_free, row.start)
    begin = time.process_time()
    solution = solver(problem, ContactStart(impulse, np.zeros_like(impulse)))
    seconds = time.process_time() - begin
    verdict = judge(problem, solution.impulse, TOLERANCE, VELOCITY_TOLERANCE)
    error = None if row.truth is None else row.truth(problem, solution.impulse)
    outcome = Outcome.NOT_CONVERGED
    if solution.converged:
        right = verdict <= 1.0 and (error is None or error <= row.within)
        outcome = Outcome.SOLVED if right else Outcome.WRONG
    finite = bool(np.isfinite(solution.impulse).all())
    eta = natural_map(problem, solution.impulse) if finite else np.nan
    return Cell(outcome, eta, solution.iterations, verdict, error, seconds)
