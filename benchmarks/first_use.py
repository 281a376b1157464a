"""First use of MOMA: ``python -m benchmarks.first_use [--record | --record-others | --installed [--write]]``.

The sample is taken in and run with an empty cache of kernels, and again with the full one; the difference is what
compiling takes. ``--record`` renews the lists of kernels in ``ground/kernels``, after a change of what kernels are
called with (Linux): first those of the sample, by command, then what a matrix of small samples, profiles and commands
calls beyond them, which ``--record-others`` renews alone. ``--installed`` measures a wheel (`benchmarks.installation`).
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.report import machine
from ground.kernels.uses import COMMANDS, LISTS, OTHERS
from tests.pipelines.scenes import small_geology

SAMPLE = Path("data/samples/window")

_LINES = """
sample arch --out arch
ingest arch/arch.moma --db sqlite:///arch.db
run arch/arch.toml --db sqlite:///arch.db --out arch-run
assess arch/arch.toml --db sqlite:///arch.db --out arch-limit
trade arch/arch.toml --budget 1 --db sqlite:///arch.db --out arch-trade
ingest {sample}/window.moma --db sqlite:///window.db
run {sample}/window.toml --db sqlite:///window.db --out window
run {sample}/window.toml --profile fast --db sqlite:///window.db --out window-fast
check {sample}/window.toml --db sqlite:///window.db
sample wall --moved settlement --small --out settled
ingest settled/wall.moma --db sqlite:///settled.db
run settled/wall.toml --db sqlite:///settled.db --out settled-run
diagnose settled/diagnosis.toml --db sqlite:///settled.db --out diagnosis
sample tower --small --out tower
ingest tower/tower.moma --db sqlite:///tower.db
record tower/knowledge.toml --db sqlite:///tower.db
propose infill --record --db sqlite:///tower.db
run tower/tower.toml --profile fast --db sqlite:///tower.db --out tower-run
sample rubble-wall --out rubble
ingest --masks rubble/wall.png --size 1x1.2 --depth 0.2 --kind rubble --db sqlite:///rubble.db
pushover rubble/rubble-wall.toml --db sqlite:///rubble.db --out pushed
geology biaxial {geology}/biaxial.toml --out biaxial
geology repose {geology}/repose.toml --out repose
geology wedge {geology}/wedge.toml --out wedge
geology fault {geology}/fault.toml --out fault
geology fold {geology}/fold.toml --out fold
"""
"""Commands in a folder of their own, in this order: every engine, on the smallest sample that comes with it."""

MATRIX = tuple(_LINES.strip().splitlines())

# processor time after which a command of the matrix is ended: it has called its kernels by then [s]
_LONGEST = 60

_RECORDING = """
import json, os, sys
# on one processor no second process compiles what is to be recorded
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:1])
from moma.cli import app
from ground.kernels.uses import recording
with recording() as uses:
    app(sys.argv[2:], prog_name="moma", standalone_mode=False)
with open(sys.argv[1], "w") as file:
    json.dump([vars(one) for one in uses], file)
"""

_CALLED = """
import signal, sys
from moma.cli import app
ended = []
def end(*_):
    ended.append(True)
    raise KeyboardInterrupt
# the signal comes once: that of a limit of the system comes again each second, while results are written
signal.signal(signal.SIGPROF, end)
signal.setitimer(signal.ITIMER_PROF, int(sys.argv[1]))
code = 0
try:
    code = app(sys.argv[2:], prog_name="moma", standalone_mode=False)
except KeyboardInterrupt:
    print("ended after its time", file=sys.stderr)
sys.exit(0 if ended else code)
"""

# what each process of a command writes as it ends or sends an answer, as those of trials are killed afterwards;
# Python imports it by its name
_EACH = """
import atexit, json, os, pathlib, sys
from multiprocessing.connection import Connection
def write():
    if "numba" in sys.modules:
        from ground.kernels.uses import called
        text = json.dumps([vars(one) for one in called()])
        pathlib.Path(__file__).with_name(f"{os.getpid()}.json").write_text(text)
def noted(self, answer, send=Connection.send):
    write()
    send(self, answer)
Connection.send = noted
atexit.register(write)
"""


def main(record: str = "") -> None:
    """Time the first and the second use of the sample, or record kernels: all lists, or that of the others alone."""
    with tempfile.TemporaryDirectory() as folder:
        if record:
            lists = json.loads(LISTS.read_text(encoding="utf-8"))
            if record == "all":
                lists = {command: _recorded(command, Path(folder)) for command in COMMANDS}
            known = [one for command in COMMANDS for one in lists[command]]
            lists[OTHERS] = _matrix(Path(folder), known)
            LISTS.write_text("{\n" + ",\n".join(map(_text, lists.items())) + "\n}\n", encoding="utf-8")
            return
        print(machine())
        for use in ("first", "second"):
            for command in COMMANDS:
                seconds = _timed(
                    [sys.executable, "-m", "moma", *_arguments(command, Path(folder), use)], folder
                )
                print(f"{use} use, moma {command}: {seconds:.1f} s")


def _arguments(command: str, folder: Path, use: str = "") -> list[str]:
    """Return the arguments of a command for the sample."""
    database = ["--db", f"sqlite:///{folder}/{use}.db"]
    if command == "orient":
        bay = folder / "bay"
        if not bay.exists():
            call = [sys.executable, "-m", "moma", "sample", "window", "--photographs", "--out", str(bay)]
            subprocess.run(call, check=True, stdout=subprocess.DEVNULL)
        return [command, f"{bay}/photographs.toml", "--out", f"{folder}/{use}-photographs"]
    if command == "ingest":
        return [command, f"{SAMPLE}/window.moma", *database]
    return [command, f"{SAMPLE}/window.toml", *database, "--out", f"{folder}/{use}"]


def _timed(call: list[str], folder: str) -> float:
    """Return the seconds that a process takes whose kernels are kept in the folder."""
    began = time.perf_counter()
    subprocess.run(
        call, env=_with_cache(folder), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    return time.perf_counter() - began


def _matrix(folder: Path, known: list[dict[str, object]]) -> list[dict[str, object]]:
    """Return the kernels that the commands of the matrix call and that are not known yet, in the user's own cache."""
    small_geology(folder / "geology")
    uses: list[dict[str, object]] = []
    called = folder / "called"
    for line in MATRIX:
        arguments = line.format(sample=SAMPLE.resolve(), geology=folder / "geology").split()
        shutil.rmtree(called, ignore_errors=True)
        called.mkdir()
        (called / "sitecustomize.py").write_text(_EACH, encoding="utf-8")
        path = os.pathsep.join((str(called), os.getcwd(), *filter(None, sys.path)))
        call = [sys.executable, "-c", _CALLED, str(_LONGEST), *arguments]
        environment = os.environ | {"PYTHONPATH": path}
        # a command that fails calls nothing of what it is listed for
        subprocess.run(call, env=environment, cwd=folder, stdout=subprocess.DEVNULL, check=True)
        found = [use for file in sorted(called.glob("*.json")) for use in json.loads(file.read_text("utf-8"))]
        fresh = list[dict[str, object]]()
        for use in found:
            if use not in (*known, *uses, *fresh):
                fresh.append(use)
        print(f"{len(fresh):3d} more kernels: moma {line}", flush=True)
        uses += fresh
    return uses


def _recorded(command: str, folder: Path) -> list[dict[str, object]]:
    """Return the kernels that a command compiles after those before it."""
    found = folder / "uses.json"
    call = [sys.executable, "-c", _RECORDING, str(found), *_arguments(command, folder, "recorded")]
    subprocess.run(call, env=_with_cache(str(folder)), check=True)
    uses: list[dict[str, object]] = json.loads(found.read_text(encoding="utf-8"))
    return uses


def _with_cache(folder: str) -> dict[str, str]:
    return {**os.environ, "NUMBA_CACHE_DIR": f"{folder}/kernels"}


def _text(named: tuple[str, list[dict[str, object]]]) -> str:
    command, uses = named
    return f'"{command}": [\n' + ",\n".join(map(json.dumps, uses)) + "\n]"


if __name__ == "__main__":
    if "--installed" in sys.argv:
        from benchmarks import installation

        installation.main("--write" in sys.argv)
        sys.exit()
    main({"--record": "all", "--record-others": OTHERS}.get(" ".join(sys.argv[1:]), ""))
