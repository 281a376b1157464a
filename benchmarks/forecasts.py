"""Promises of `moma check`, and what `moma run` takes: `python -m benchmarks.forecasts [--only NAME …]`.

Time is processor time of the whole command, from its start to its last picture; memory is its peak. A promise is kept
if the time lies within a factor of three of the likely value, or, where `moma check` says that the time cannot be
known, within the range that it gives. A run is ended after 90 s; what it took until then bounds the promise from below.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.cost_scenes import KINDS
from benchmarks.generated import box_faces
from benchmarks.report import Row, Table, guarded, machine, print_json, print_table, progress
from mechanics.arrays import Array

__all__ = ["main"]

_LIMIT = 90.0  # processor time after which a run is ended [s]
_FACTOR = 3.0  # between promise and truth [-]
_ELASTIC = 'default = "deformable"'
_STATIC = 'start = "equilibrium"\n'
_LAST = "stop_at_equilibrium = false\n"
_SHAKE = "\n".join(
    [
        "[[loads]]",
        'type = "ground_motion"',
        'stones = ["kind = support"]',
        'x = "quake.csv"',
        'unit = "m/s2"',
    ]
)
_SLOPE = "[gravity]\ndirection = [0.9, 0.0, -1.0]"
_TABLE: Table = (
    ("scene", "scene", ""),
    ("stones", "stones", "d"),
    ("outcome", "outcome", ""),
    ("seconds", "measured s", ".3g"),
    ("low", "promised: low", ".3g"),
    ("likely", "likely", ".3g"),
    ("high", "high", ".3g"),
    ("said", "of the end", ""),
    ("memory_mb", "measured MB", ".0f"),
    ("promised_mb", "promised MB", ".0f"),
    ("kept", "kept", ""),
)


@dataclass(frozen=True)
class _Scene:
    """One scene: stones of `benchmarks.cost_scenes`, their flaws, and lines of its file."""

    name: str
    kind: str
    stones: int
    time: str
    rough: float = 0.0
    bodies: str = 'default = "rigid"'
    size: float = 0.2
    loads: str = ""

    def text(self) -> str:
        """Return the scene file."""
        return "\n".join(
            [
                f'[scene]\nname = "{self.name}"',
                "[materials.stone]\ndensity = 2400.0\nyoung = 5e9\npoisson = 0.2",
                f'[bodies]\n{self.bodies}\nfixed = ["kind = support"]',
                f"[mesh]\nsize = {self.size}" if self.bodies == _ELASTIC else "",
                '[joints]\nmode = "as-surveyed"',
                f"[time]\n{self.time}",
                self.loads,
                "",
            ]
        )

    def obj(self) -> str:
        """Return the stones as solids; `rough` moves every corner of a stone about its centre [of its size]."""
        rng, lines = np.random.default_rng(7), []
        for number, (corners, fixed) in enumerate(KINDS[self.kind](self.stones)):
            middle: Array = corners.mean(axis=0)
            scale = 1.0 if fixed else 1.0 - self.rough * rng.random()
            kind = "support" if fixed else "ashlar"
            lines.append(f"o b{number}:{kind}")
            lines += [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in middle + scale * (corners - middle)]
            lines += [f"f {' '.join(str(i - 8) for i in face)}" for face in box_faces()]
        return "\n".join(lines) + "\n"


_SCENES = (
    _Scene("sliding column", "column", 25, f"step = 0.002\nduration = 1.0\n{_LAST}", loads=_SLOPE),
    _Scene("pillars in an earthquake", "pillars", 24, f"step = 0.002\nduration = 1.0\n{_LAST}", loads=_SHAKE),
    _Scene("elastic wall, motion", "wall", 12, f"duration = 0.03\n{_LAST}", bodies=_ELASTIC),
    _Scene("wall in an earthquake", "wall", 30, f"step = 0.002\nduration = 0.5\n{_LAST}", loads=_SHAKE),
    _Scene("long rest", "portals", 30, f"step = 0.005\nduration = 5.0\n{_LAST}"),
    _Scene("arch in free motion", "arch", 25, f"duration = 0.5\n{_LAST}"),
    _Scene("vault with imperfect contacts, motion", "vault", 45, f"duration = 0.1\n{_LAST}", rough=0.002),
    _Scene("arch, static", "arch", 50, _STATIC),
    _Scene("wall, static", "wall", 60, _STATIC),
    _Scene("wall with a core, static", "leaves", 60, _STATIC),
    _Scene("elastic wall, static", "wall", 20, _STATIC, bodies=_ELASTIC),
    _Scene("elastic vault, static", "vault", 30, _STATIC, bodies=_ELASTIC, size=0.25),
    _Scene("opening, relaxation", "opening", 60, "relaxation = true\n"),
    _Scene("wall, from rest", "wall", 40, "step = 0.002\n"),
    _Scene("vault, static", "vault", 60, _STATIC),
    _Scene("vault with imperfect contacts, static", "vault", 45, f"{_STATIC}duration = 0.2\n", rough=0.002),
    _Scene("elastic pillars, relaxation", "pillars", 12, "relaxation = true\n", bodies=_ELASTIC, size=0.2),
)


def main() -> None:
    """Print the table of promises and truths."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.forecasts", description=__doc__)
    parser.add_argument("--only", nargs="*", help="names of scenes")
    parser.add_argument("--rows", type=Path, help="file of measured runs, which are not run again")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each scene")
    options = parser.parse_args()
    known = _known(options.rows)
    rows = []
    for scene in _SCENES:
        if options.only and scene.name not in options.only:
            continue
        progress(scene.name)
        with tempfile.TemporaryDirectory() as folder:
            rows.append(_row(scene, Path(folder), known.get(scene.name), options.rows))
    if options.json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    print(f"{machine()}\n")
    print_table(rows, _TABLE)
    kept = sum(row["kept"] == "yes" for row in rows)
    print(f"\n{kept} of {len(rows)} promises kept")


def _known(file: Path | None) -> dict[str, Row]:
    lines = file.read_text(encoding="utf-8").splitlines() if file and file.exists() else []
    return {row["scene"]: row for row in map(json.loads, lines)}


def _row(scene: _Scene, folder: Path, known: Row | None, kept: Path | None) -> Row:
    (folder / "stones.obj").write_text(scene.obj(), encoding="utf-8")
    (folder / "scene.toml").write_text(scene.text(), encoding="utf-8")
    times = np.arange(0.0, 3.0, 0.01)
    shaking = [f"{t:.3f},{1.5 * np.sin(12.0 * t):.5f}" for t in times]
    (folder / "quake.csv").write_text("\n".join(shaking) + "\n", encoding="utf-8")
    _moma(folder, "ingest", "stones.obj", "--format", "solids")
    plan = json.loads(_moma(folder, "check", "scene.toml", "--json").stdout)
    measured = known or _run(scene, folder)
    if kept is not None and known is None:
        with kept.open("a", encoding="utf-8") as file:
            file.write(json.dumps(measured) + "\n")
    cost = plan["cost"]
    low, likely, high = cost["seconds"]
    took, ended = measured["seconds"], measured["outcome"] != "stopped"
    if cost.get("unknown"):
        right = low <= took and (took <= high or not ended)
    else:
        right = likely / _FACTOR <= took * (1.0 if ended else np.inf) and took <= _FACTOR * likely
    return measured | {
        "low": low,
        "likely": likely,
        "high": high,
        "said": "not known" if cost.get("unknown") else "known",
        "promised_mb": cost["peak"] / 1e6,
        "kept": "yes" if right else "no",
    }


def _moma(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "moma", *words, "--db", "sqlite:///moma.db"]
    return subprocess.run(
        command, cwd=folder, env=_environment(), capture_output=True, text=True, check=False
    )


def _environment() -> dict[str, str]:
    root = str(Path(__file__).resolve().parents[1])
    return os.environ | dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS"), "1") | {"PYTHONPATH": root}


def _run(scene: _Scene, folder: Path) -> Row:
    """Run the scene as a command that ends itself after the limit; return its cost."""
    command = [sys.executable, "-m", "moma", "run", "scene.toml", "--db", "sqlite:///moma.db", "--json"]
    command += ["--accept-unsound"]

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (int(_LIMIT), int(_LIMIT) + 1))

    with (folder / "summary.json").open("w", encoding="utf-8") as out:
        process = subprocess.Popen(
            command, cwd=folder, env=_environment(), stdout=out, stderr=subprocess.DEVNULL, preexec_fn=limit
        )
        _, process.returncode, used = os.wait4(process.pid, 0)
    output = (folder / "summary.json").read_text(encoding="utf-8")
    try:
        summary = json.loads(output)
    except ValueError:
        summary = {"outcome": "stopped", "bodies": {}, "steps": None, "time": {}}
    return {
        "scene": scene.name,
        "stones": sum(summary["bodies"].values()) or scene.stones,
        "outcome": summary["outcome"],
        "steps": summary["steps"],
        "by_stage": summary["time"].get("by_stage"),
        "seconds": used.ru_utime + used.ru_stime,
        "memory_mb": used.ru_maxrss * 1024 / 1e6,
    }


if __name__ == "__main__":
    guarded(main)
