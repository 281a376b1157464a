"""Runs of a confirmation that neither rest nor collapse."""

import numpy as np
import pytest

from mechanics.dynamics.outcome import Outcome
from mechanics.limit.confirm import Confirmation, ConfirmationRun
from pipelines.assess.answers import _confirmed


@pytest.mark.parametrize(
    ("outcomes", "count"),
    [
        ((), 0),
        ((Outcome.EQUILIBRIUM, Outcome.SETTLED), 0),
        ((Outcome.EQUILIBRIUM, Outcome.MOVING), 1),
        ((Outcome.MOVING, Outcome.INTERRUPTED, Outcome.EQUILIBRIUM), 2),
    ],
)
def test_runs_that_still_move_decide_nothing(outcomes, count):
    trials = tuple(ConfirmationRun(0.1, outcome, 10, 0, np.zeros((2, 3))) for outcome in outcomes)
    found = Confirmation(0.1, np.inf, trials)
    told = _confirmed(None, found, type("Candidate", (), {"multiplier": 0.1}))
    assert told["undecided"] == count
    assert [run["outcome"] for run in told["runs"]] == [str(outcome) for outcome in outcomes]
    assert (told["held"], told["lost"], told["likeness"]) == (0.1, None, None)
