"""Progress on stderr, and Ctrl-C that ends a run after its step."""

import json
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from numba.core import event

from archmodel.database.session import open_database
from archmodel.describe.runs import list_runs
from mechanics.dynamics.progress import Progress
from moma.cli import progress as progress_module
from moma.cli import scenes as scenes_module
from moma.cli.progress import Interruption, progress_bars
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


def test_ctrl_c_ends_a_run_after_its_step_with_all_results(place, monkeypatch):
    heard = []

    @contextmanager
    def pressing():
        def listen(report):
            heard.append(report)
            if (report.stage, report.done) == ("step", 3):
                signal.raise_signal(signal.SIGINT)

        yield listen

    monkeypatch.setattr(scenes_module, "progress_bars", pressing)
    before = signal.getsignal(signal.SIGINT)
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
    assert signal.getsignal(signal.SIGINT) is before


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


def test_the_compilation_of_kernels_is_announced_once(capsys):
    with progress_bars():
        for _ in range(10):
            with event.trigger_event("numba:compile"):
                pass
    (line,) = capsys.readouterr().err.splitlines()
    assert "compiling kernels, once" in line


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
