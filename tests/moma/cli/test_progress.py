"""Progress on stderr, and Ctrl-C that ends a run after its step."""

import json
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import numba
import pytest
from numba.core import event

from archmodel.database.session import open_database
from archmodel.describe.runs import list_runs
from mechanics.dynamics.progress import Progress
from moma.cli import progress as progress_module
from moma.cli import scenes as scenes_module
from moma.cli.progress import Interruption, _Stages, progress_bars
from pipelines.ingest.ingest import ingest
from tests.moma.commands import invoke
from tests.paths import ROOT
from tests.pipelines.scenes import TWO_COURSES

SCENE = (
    TWO_COURSES
    + """\
[time]
duration = 600.0
stop_at_equilibrium = false
[output]
pictures = []
"""
)


@pytest.fixture
def place(tmp_path):
    """A folder with a database and a scene that takes hours."""
    ingest([ROOT / "data/samples/window/window.moma"], f"sqlite:///{tmp_path / 'moma.db'}")
    (tmp_path / "long.toml").write_text(SCENE, encoding="utf-8")
    return tmp_path


def outcomes(place):
    with open_database(f"sqlite:///{place / 'moma.db'}") as database, database.session() as session:
        return [one["outcome"] for one in list_runs(session)]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_ends_a_run_after_its_step_with_all_results(place, monkeypatch, number):
    heard = []

    @contextmanager
    def pressing():
        def listen(report):
            heard.append(report)
            if (report.stage, report.done) == ("step", 3):
                signal.raise_signal(number)

        yield listen

    monkeypatch.setattr(scenes_module, "progress_bars", pressing)
    before = signal.getsignal(number)
    done = invoke(
        "run", place / "long.toml", "--db", f"sqlite:///{place / 'moma.db'}", "--out", place / "out"
    )
    assert done.exit_code == 1, done.output
    assert done.stdout.startswith("Two courses: interrupted after ")
    assert "Ctrl-C again aborts" in done.stderr
    assert max(report.done for report in heard if report.stage == "step") == 3
    summary = json.loads((place / "out/summary.json").read_text(encoding="utf-8"))
    assert (summary["outcome"], summary["steps"]) == ("interrupted", 3)
    assert outcomes(place) == ["interrupted"]
    assert signal.getsignal(number) is before


def test_ctrl_c_before_the_first_step_ends_the_program():
    stop = Interruption()
    listen = stop.listening(lambda report: None)
    with stop.handled():
        listen(Progress("mesh", 1, 10))
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        assert not stop()
        listen(Progress("step", 1, 10))
        signal.raise_signal(signal.SIGINT)
        assert stop()
        # the second ends the program, even within a kernel
        assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_without_a_terminal_a_line_appears_now_and_then_and_names_stage_and_time_left(monkeypatch, capsys):
    monkeypatch.setattr(progress_module, "_FIRST", 0.05)
    monkeypatch.setattr(progress_module, "_EVERY", 0.1)
    monkeypatch.setattr(progress_module, "_MEASURED", 0.05)
    with progress_bars() as listener:
        listener(Progress("blocks", 0, None, "closing the joints of 9 stones"))
        time.sleep(0.12)
        for count in range(40):
            listener(Progress("step", count, 80, "balance 1e-3"))
            time.sleep(0.01)
    lines = capsys.readouterr().err.splitlines()
    assert 3 <= len(lines) <= 8  # 41 reports in half a second
    assert "blocks, closing the joints of 9 stones" in lines[0]
    assert "step" in lines[-1]
    assert " of 80, at most 0." in lines[-1]
    assert lines[-1].endswith("left, balance 1e-3")
    assert all(line.startswith("moma: [") for line in lines)


def test_a_command_of_less_than_a_second_is_silent(capsys):
    with progress_bars() as listener:
        listener(Progress("step", 1, 2))
    assert capsys.readouterr().err == ""


def test_the_compilation_of_kernels_is_announced_once_after_an_installation(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path / "kernels"))

    def compile_some():
        with progress_bars():
            for _ in range(10):
                with event.trigger_event("numba:compile"):
                    pass
        return capsys.readouterr().err.splitlines()

    (line,) = compile_some()
    assert "compiling kernels, once" in line
    # the next command compiles others
    assert compile_some() == []
    (tmp_path / "kernels/moma-kernels-announced").write_text("moma 0.0.1", encoding="utf-8")
    assert len(compile_some()) == 1


@pytest.fixture
def clock(monkeypatch):
    """A clock that a test sets, as a list of one time."""
    now = [100.0]
    monkeypatch.setattr(progress_module.time, "monotonic", lambda: now[0])
    return now


def reported(clock, stages, *reports):
    """Report progress at times; return the time left after the last."""
    for at, report in reports:
        clock[0] = 100.0 + at
        stages(report)
    return stages.left()


def test_the_time_left_is_that_of_the_stage_that_is_running(clock):
    stages = _Stages()
    deposit = [(10.0 * k, Progress("deposit", k, None)) for k in range(3)]
    steps = [(30.0 + 0.5 * k, Progress("step", k, 100)) for k in range(1, 11)]
    assert reported(clock, stages, *deposit, *steps) == "at most 45 s left"
    # the same stage begins again, as the next run of a confirmation does
    again = [(40.0 + 2.0 * k, Progress("step", k, 100)) for k in range(1, 3)]
    assert reported(clock, stages, *again) == "at most 3.3 min left"
    assert reported(clock, stages, (60.0, Progress("write", 0, 3)), (70.0, Progress("write", 1, 3))) == ""


def test_time_in_which_kernels_are_compiled_does_not_count(clock):
    stages = _Stages()
    reported(clock, stages, (0.0, Progress("step", 0, 100)))
    stages.compiling(True)
    clock[0] += 60.0
    assert stages.left() == "compiling kernels"
    stages.compiling(False)
    steps = [(60.0 + k, Progress("step", k, 100)) for k in range(1, 11)]
    assert reported(clock, stages, *steps) == "at most 90 s left"


def test_the_time_left_follows_the_latest_rate(clock):
    stages = _Stages()
    slow = [(10.0 * k, Progress("run", k, 1000)) for k in range(6)]
    fast = [(50.0 + 0.1 * k, Progress("run", 5 + k, 1000)) for k in range(1, 901)]
    # of 95 remaining ones at ten a second, not at the 6.5 a second of the whole
    assert reported(clock, stages, *slow, *fast) == "about 9.5 s left"
    # nothing has come for longer than that: nobody knows
    clock[0] += 30.0
    assert stages.left() == ""


def test_results_are_printed_as_they_come_in_longer_commands(monkeypatch, capsys):
    with progress_bars() as listener:
        listener(Progress("assess", 1, 2, found="of a short command"))
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(progress_module, "_FIRST", 0.0)
    with progress_bars() as listener:
        listener(Progress("assess", 1, 2, found="[east]: λ ≤ 0.5"))
        assert "s] [east]: λ ≤ 0.5" in capsys.readouterr().err
        listener(Progress("assess", 2, 2, found="west: λ ≤ 0.6"))
        assert "west: λ ≤ 0.6" in capsys.readouterr().err


def test_sigterm_ends_any_command_as_ctrl_c_does_in_one_line():
    code = (
        "import os, signal\n"
        "from moma.cli import main, relations\n"
        "import archmodel.database.session as session\n"
        f"session.open_database = lambda *_, **__: os.kill(os.getpid(), {int(signal.SIGTERM)})\n"
        "main()\n"
    )
    command = [sys.executable, "-c", code, "relate", "--db", "sqlite:///none.db"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "moma: interrupted\n")


@pytest.mark.slow
def test_a_second_ctrl_c_ends_the_program_at_once(place):
    command = [sys.executable, "-m", "moma", "run", "long.toml", "--db", "sqlite:///moma.db"]
    with subprocess.Popen(command, cwd=place, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if "] step " in line:
                process.send_signal(signal.SIGINT)
                process.send_signal(signal.SIGINT)
                break
        process.stderr.read()
    assert process.returncode != 0
