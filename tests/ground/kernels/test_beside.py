"""The second process that compiles kernels beside a command."""

import subprocess
import sys
import time

import pytest
from numba.core import event

from ground.kernels import beside
from ground.kernels.uses import COMMANDS, kernels_of


@pytest.fixture
def two_processors(monkeypatch):
    monkeypatch.setattr(beside, "_processors", lambda: 2)


@pytest.fixture
def started(monkeypatch):
    """Processes that stand in for the second one: they answer each line, as it does."""
    processes = []
    true = subprocess.Popen

    def start(command, **options):
        program = "import sys\nfor line in sys.stdin: print('done', flush=True)"
        processes.append(true([sys.executable, "-c", program], **options))
        return processes[-1]

    monkeypatch.setattr(subprocess, "Popen", start)
    return processes


def test_nothing_is_started_where_nothing_is_compiled(two_processors, started):
    with beside.compiling_beside("run"):
        pass
    assert started == []


def test_one_process_is_started_at_the_first_compilation_and_ends_with_the_command(two_processors, started):
    with beside.compiling_beside("run"):
        for _ in range(3):
            with event.trigger_event("numba:compile"):
                pass
        (process,) = started
    assert process.poll() is not None


def test_one_processor_compiles_alone(monkeypatch, started):
    monkeypatch.setattr(beside, "_processors", lambda: 1)
    with beside.compiling_beside("run"), event.trigger_event("numba:compile"):
        pass
    assert started == []


def test_a_machine_without_room_for_a_process_compiles_alone(two_processors, monkeypatch):
    def refuse(*arguments, **options):
        raise OSError("Cannot allocate memory")

    monkeypatch.setattr(subprocess, "Popen", refuse)
    with beside.compiling_beside("run"), event.trigger_event("numba:compile"):
        pass


def test_the_order_begins_at_the_far_end_and_names_every_kernel_once():
    run, ingest = len(kernels_of("run")), len(kernels_of("ingest"))
    assert beside._order("run") == [f"run {place}" for place in range(run - 1, -1, -1)]
    order = beside._order("ingest")
    assert order[0] == f"ingest {ingest - 1}"
    assert order[ingest:] == [f"run {place}" for place in range(run)]
    assert COMMANDS == ("orient", "ingest", "run")


@pytest.mark.slow
def test_the_second_process_ends_by_itself_when_its_command_is_killed():
    command = [sys.executable, "-m", "ground.kernels.beside"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        process.stdin.write("run 9999\n")  # a list of another program
        process.stdin.flush()
        assert process.stdout.readline() == "done\n"
        process.stdin.close()  # as it is when the command is gone
        began = time.monotonic()
        assert process.wait(60) == 0
        assert time.monotonic() - began < 30
