"""Runs of the plane that were killed or stopped go on with the bits of an unbroken run."""

import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import replace

import pytest

from ground.errors import UsageError
from mechanics.dynamics.outcome import Outcome
from pipelines.run.planar import run_planar
from tests.mechanics.planar.test_overlaps import pushed_bed
from tests.paths import ROOT

STEPS = 60
NEVER = 0


def child(folder, last=NEVER, threads=1):
    """A run in a process of its own, killed after a step."""
    environment = os.environ | {"NUMBA_NUM_THREADS": str(threads), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "tests.pipelines.run.planar_child", folder, STEPS, last, threads]
    return subprocess.Popen(list(map(str, command)), env=environment, stdout=subprocess.PIPE, text=True)


def ended(process):
    """Its output, after a run that was not killed."""
    text = process.communicate()[0]
    assert process.returncode == 0
    return text


def names(folder):
    return sorted(path.name for path in (folder / "unfinished").glob("checkpoint-*"))


@pytest.mark.slow
def test_a_killed_run_goes_on_with_the_same_bits_on_one_and_two_threads(tmp_path):
    whole = ended(child(tmp_path / "whole"))
    assert not (tmp_path / "whole" / "unfinished").exists()
    for threads, last in ((1, 23), (2, 47)):
        out = tmp_path / f"out{threads}"
        process = child(out, last, threads)
        process.communicate()
        assert process.returncode == -signal.SIGKILL
        done = last - last % 5
        assert names(out) == [f"checkpoint-{step:08d}.h5" for step in (done - 5, done)]
        # threads change no bit, so the run may go on with another number of them
        assert ended(child(out, threads=3 - threads)) == whole


@pytest.mark.slow
@pytest.mark.parametrize("threads", [1, 2])
def test_a_kill_at_any_instant_costs_no_bit(tmp_path, threads):
    begun = time.perf_counter()
    whole = ended(child(tmp_path / "whole"))
    lasts, instants = time.perf_counter() - begun, random.Random(threads)
    for number in range(12):
        out = tmp_path / f"out{number}"
        for _ in range(2):
            process = child(out, threads=threads)
            time.sleep(instants.uniform(0.3, 1.0) * lasts)
            process.kill()
            process.communicate()
        assert ended(child(out, threads=threads)) == whole


def test_a_run_that_was_stopped_is_neither_replaced_by_chance_nor_mixed_with_another(tmp_path):
    bed, count = pushed_bed(6, 4, 20, 20), iter(range(100))
    part, _ = run_planar(bed, tmp_path / "out", stop=lambda: next(count) == 9)
    assert part.outcome is Outcome.INTERRUPTED
    with pytest.raises(UsageError, match="holds an unfinished run"):
        run_planar(bed, tmp_path / "out")
    other = replace(bed, disks=(replace(bed.disks[0], density=2000.0), *bed.disks[1:]))
    with pytest.raises(UsageError, match="disk d0"):
        run_planar(other, tmp_path / "out", resume=True)
    with pytest.raises(UsageError, match=r"time.step 0.025, now 0.01"):
        run_planar(replace(bed, time=replace(bed.time, step=0.01)), tmp_path / "out", resume=True)
    longer = replace(bed, time=replace(bed.time, duration=2 * bed.time.duration))
    found, warnings = run_planar(longer, tmp_path / "out", resume=True)
    assert not warnings
    assert found.steps == 40
    assert not (tmp_path / "out" / "unfinished").exists()
