"""A run in the database: whole or not at all, and every number where it belongs."""

from dataclasses import replace

import pytest

from archmodel.database import Database
from archmodel.run_records import RunRecord
from archmodel.runs import EntityResult, Run
from archmodel.store_runs import store_run
from moma.errors import DatabaseError
from tests.archmodel.stones import contents, run_record


def test_a_run_is_kept_with_its_results(filled: Database) -> None:
    with filled.session() as session:
        first = store_run(session, run_record({"V1": 3e5, "V2": None}))
        second = store_run(session, run_record({"V1": 1e5}, scene="again"))
    assert second > first
    with filled.session(read_only=True) as session:
        run = session.get_one(Run, first)
        assert (run.scene, run.outcome, run.summary["contacts"]) == ("window", "equilibrium", 12)
        assert {r.entity.code: r.von_mises_max for r in run.results} == {"V1": 3e5, "V2": None}
        assert run.results[0].values == {"weight": 900.5}


@pytest.mark.parametrize(
    ("run", "message"),
    [
        (run_record({"V1": 1e5, "V9": 1e5}), "run of window: stone V9 is not in the database"),
        (run_record({"V1": float("nan")}), "run of window, stone V1: von_mises_max is nan"),
        (replace(run_record({}), results=run_record({"V1": 1.0}).results * 2), "two results for stone V1"),
        (replace(run_record({}), summary={"weight": float("inf")}), "the summary cannot be stored"),
        (replace(run_record({}), summary={"weight": object()}), "the summary cannot be stored"),
        (
            replace(run_record({}), results=(replace(run_record({"V1": 1.0}).results[0], fidelity="soft"),)),
            "fidelity 'soft' is none of fixed, rigid, deformable",
        ),
    ],
)
def test_a_run_is_kept_whole_or_not_at_all(filled: Database, run: RunRecord, message: str) -> None:
    before = contents(filled)
    with filled.session() as session, pytest.raises(DatabaseError, match=message):
        store_run(session, run)
    assert contents(filled) == before


def test_results_of_another_stone_are_not_mixed_up(filled: Database) -> None:
    with filled.session() as session:
        store_run(session, run_record({"V3": 3.0, "W01-01": 1.0}))
    with filled.session(read_only=True) as session:
        assert {r.entity.code: r.von_mises_max for r in session.query(EntityResult)} == {
            "V3": 3.0,
            "W01-01": 1.0,
        }
