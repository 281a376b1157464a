"""Worker processes that are killed, and records that are left."""

import os
import subprocess
import sys

import numpy as np

from pipelines.assess.workers.store import Sample, SampleStore, Snapshot
from tests.paths import ROOT

KILLS = """
import os, signal, sys
from pathlib import Path
from pipelines.assess.workers.pool import Lost, workers

def work(task):
    number, folder = task
    mark = Path(folder) / str(number)
    if number % 5 == 0 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if number == 7:
        os.kill(os.getpid(), signal.SIGKILL)
    return number * number

if __name__ == "__main__":
    tasks = [(number, sys.argv[1]) for number in range(12)]
    with workers(2, work, 2) as run:
        found = dict(run(tasks))
    assert {number for number, answer in found.items() if isinstance(answer, Lost)} == {7}, found
    assert all(answer == number**2 for number, answer in found.items() if number != 7)
    print("all there")
"""


def test_tasks_of_killed_processes_are_worked_on_again(tmp_path):
    (tmp_path / "kills.py").write_text(KILLS, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, tmp_path / "kills.py", tmp_path],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=180,
        check=False,
    )
    assert done.stdout.strip() == "all there", done.stderr


def test_records_come_back_bit_by_bit_and_damaged_ones_do_not(tmp_path):
    snapshot = Snapshot.write(tmp_path, {"scene": "block", "numbers": [0.1, 0.2]})
    store = SampleStore(snapshot)
    point = np.random.default_rng(1).standard_normal(7)
    store.put(Sample(point, {"λ": 0.1 + 0.2}, gradient=point / 3.0, cpu=0.5))
    found = store.get(point, gradient=True)
    assert found is not None
    assert found.values == {"λ": 0.1 + 0.2}
    assert found.gradient is not None
    assert np.array_equal(found.gradient, point / 3.0)
    assert store.get(np.nextafter(point, 1.0)) is None
    (file,) = (tmp_path / "samples").rglob("*.json")
    file.write_text(file.read_text()[:-9])
    assert store.get(point) is None


def test_a_lost_sample_is_taken_again_and_a_failed_one_is_not(tmp_path):
    store = SampleStore(Snapshot.write(tmp_path, {}))
    lost, failed = np.zeros(2), np.ones(2)
    store.put(Sample(lost, {}, "lost", "killed"))
    store.put(Sample(failed, {}, "failed", "friction = -0.1"))
    assert store.get(lost) is None
    kept = store.get(failed)
    assert kept is not None
    assert kept.reason == "friction = -0.1"
