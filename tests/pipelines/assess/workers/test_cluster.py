"""Samples by the workers of a Dask scheduler: the bits of one process, and none lost where workers are killed."""

import os
import signal
import sys
from pathlib import Path

import pytest

from ground.errors import UsageError
from pipelines.assess.study.study import run_study
from pipelines.assess.workers.cluster import cluster
from tests.pipelines.assess.study.surveys import BOUND, DEEP, FRICTIONAL, block_survey, study_file


def work(task):
    """Square of a number; that of three kills its worker four times first."""
    number, folder = task
    marks = [Path(folder) / f"{number}-{time}" for time in range(4)]
    left = [mark for mark in marks if not mark.exists()]
    if number == 3 and left:
        left[0].touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number


@pytest.fixture(scope="module")
def address():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as local:
        yield local.scheduler_address


@pytest.mark.slow
def test_a_study_by_a_scheduler_has_the_bits_of_one_process(address, tmp_path):
    url = block_survey(tmp_path)
    path = study_file(tmp_path, "monte_carlo", FRICTIONAL, DEEP, BOUND, samples=9)
    here = run_study(path, url, tmp_path / "here")
    there = run_study(path, url, tmp_path / "there", scheduler=address)
    assert there.summary["samples"]["digest"] == here.summary["samples"]["digest"]
    assert there.summary["failure"] == here.summary["failure"]


@pytest.mark.slow
def test_tasks_survive_more_lost_workers_than_dask_allows(address, tmp_path):
    with cluster(address, work, 11) as run:
        found = dict(run([(number, tmp_path) for number in range(4)]))
    assert found == {number: number**2 for number in range(4)}


def test_without_dask_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match="needs Dask") as refused, cluster("tcp://nowhere:1", work):
        pass
    assert "moma-masonry[dask]" in str(refused.value)


def test_a_scheduler_and_processes_here_exclude_each_other(tmp_path):
    url = block_survey(tmp_path)
    path = study_file(tmp_path, "monte_carlo", FRICTIONAL, BOUND, samples=9)
    with pytest.raises(UsageError, match="both a scheduler and processes"):
        run_study(path, url, tmp_path / "out", count=2, scheduler="tcp://nowhere:1")
