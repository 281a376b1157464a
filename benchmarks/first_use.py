"""First use of MOMA: ``python -m benchmarks.first_use [--record]``; see benchmarks/README.md.

The sample is taken in and run with an empty cache of kernels, and again with the full one; the difference is what
compiling takes. ``--record`` renews the lists of kernels in ``moma/kernels``, after a change of what kernels are
called with (Linux).
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.report import machine
from moma.kernels.uses import COMMANDS, LISTS

__all__ = ["main"]

_SAMPLE = Path("data/samples/window")

_RECORDING = """
import json, os, sys
# on one processor no second process compiles what is to be recorded
os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:1])
from moma.cli import app
from moma.kernels.uses import recording
with recording() as uses:
    app(sys.argv[2:], prog_name="moma", standalone_mode=False)
with open(sys.argv[1], "w") as file:
    json.dump([vars(one) for one in uses], file)
"""


def main(record: bool = False) -> None:
    """Time the first and the second use of the sample, or record the kernels that the first one compiles."""
    with tempfile.TemporaryDirectory() as folder:
        if record:
            lists = {command: _recorded(command, Path(folder)) for command in COMMANDS}
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
        return [command, f"{_SAMPLE}/window.moma", *database]
    return [command, f"{_SAMPLE}/window.toml", *database, "--out", f"{folder}/{use}"]


def _timed(call: list[str], folder: str) -> float:
    """Return the seconds that a process takes whose kernels are kept in the folder."""
    began = time.perf_counter()
    subprocess.run(
        call, env=_with_cache(folder), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    return time.perf_counter() - began


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
    main("--record" in sys.argv[1:])
