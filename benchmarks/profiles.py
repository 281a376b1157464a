"""Errors of the profiles on reference scenes: `python -m benchmarks.profiles [--held-out] [--write] [--json]`.

Each scene runs at each profile and on a mesh that no profile has; docs/accuracy.md has the tables. `--write` renews
pipelines/tuning/measured_errors.py, from which `moma run` tells what error to expect.
"""

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import collapse
from benchmarks.profile_scenes import HELD_OUT, REFERENCE
from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from mechanics.scene.scene import Fidelity, Scene
from mechanics.simulate import simulate
from pipelines.results.quantities import Quantities, differences, quantities, quantities_from
from pipelines.tuning.expected_errors import BOUNDS, TYPICAL, expected_errors, loops, measure
from pipelines.tuning.overlay import Overlay, overlaid_scene
from pipelines.tuning.profiles import PROFILES

__all__ = ["FINEST", "main", "measured_rows", "ratios", "run"]

FINEST = replace(PROFILES["accurate"].rest, cells=3.0)
"""Of the reference: a mesh half as fine again as that of the finest profile."""

_DATA = Path(__file__).resolve().parents[1] / "pipelines/tuning/measured_errors.py"
_TABLE: Table = (
    ("scene", "scene", ""),
    ("profile", "profile", ""),
    ("cpu_s", "CPU s", ".1f"),
    ("stress_error", "estimated error of the stress", ".3f"),
    ("free", "joints free", ".2f"),
    *(
        (name, name.replace("_", " "), ".2g")
        for quantity in (*TYPICAL, *BOUNDS)
        for name in (quantity, f"{quantity}_expected")
    ),
)


def main() -> None:
    """Measure, print, and write where that is asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.profiles", description=__doc__)
    parser.add_argument("--held-out", action="store_true", help="scenes that nothing was fitted to")
    parser.add_argument("--only", nargs="+", choices=[*REFERENCE, *HELD_OUT], default=None)
    parser.add_argument("--records", type=Path, help="keep each run in this folder, and take it from there")
    parser.add_argument("--write", action="store_true", help="renew pipelines/tuning/measured_errors.py")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each run")
    options = parser.parse_args()
    scenes = HELD_OUT if options.held_out else REFERENCE
    rows = [
        row
        for name, make in scenes.items()
        if options.only is None or name in options.only
        for row in measured_rows(name, make(), options.records)
    ]
    if options.write:
        _write(rows, collapse.errors(options.records))
    if options.json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}\n")
    print_table(rows, _TABLE)


def measured_rows(name: str, scene: Scene, records: Path | None = None) -> list[Row]:
    """What each profile gives of a scene, against the finest mesh, and what it says of that itself."""
    truth, _, _ = _kept(f"{name} finest", scene, FINEST, records)
    rows = []
    for profile in PROFILES.values():
        overlay = profile.overlay(scene.time)
        if overlay.fidelity is None:
            overlay = replace(overlay, fidelity=Fidelity.DEFORMABLE)
        found, free, seconds = _kept(f"{name} {profile.name}", scene, overlay, records)
        apart = differences(found, truth)
        expected = expected_errors(profile.name, found, free, rigid=overlay.fidelity is Fidelity.RIGID)
        row: Row = {"scene": name, "profile": profile.name, "cpu_s": seconds, "free": free}
        row |= {"stress_error": found.stress_error, "outcome": found.outcome}
        for quantity in (*TYPICAL, *BOUNDS):
            said = expected.get(quantity)
            row |= {quantity: apart[quantity], f"{quantity}_expected": None if said is None else said.value}
            row[f"{quantity}_measure"] = measure(quantity, found.stress_error, free)
        rows.append(row)
    return rows


def run(scene: Scene, overlay: Overlay) -> tuple[Quantities, float, float]:
    """What users care about, the part of the joints that is free, and the processor time [s]."""
    begun = time.process_time()
    result = simulate(overlaid_scene(scene, overlay))
    return quantities(result), loops(result), time.process_time() - begun


def ratios(rows: Sequence[Row]) -> dict[str, dict[str, tuple[float, float, float]]]:
    """By profile and quantity: error over its measure, and the least and largest error of the reference scenes.

    The ratio of typical errors is their geometric mean, that of bounds the largest.
    """
    found: dict[str, dict[str, tuple[float, float, float]]] = {}
    for profile in PROFILES:
        own = [row for row in rows if row["profile"] == profile]
        found[profile] = {}
        for quantity in (*TYPICAL, *BOUNDS):
            known = [(row[quantity], row[f"{quantity}_measure"]) for row in own if row[quantity] is not None]
            errors = [error for error, _ in known]
            shares = [error / size for error, size in known if size]
            if shares:
                mean = float(np.exp(np.mean(np.log(np.maximum(shares, 1e-12)))))
                ratio = max(shares) if quantity in BOUNDS else mean
                found[profile][quantity] = (ratio, min(errors), max(errors))
    return found


def _kept(name: str, scene: Scene, overlay: Overlay, records: Path | None) -> tuple[Quantities, float, float]:
    """As `run`; taken from the folder if it is there, else written into it."""
    path = None if records is None else records / f"{name.replace(' ', '_')}.json"
    if path is not None and path.is_file():
        record = json.loads(path.read_text(encoding="utf-8"))
        return quantities_from(record["quantities"]), record["free"], record["cpu_s"]
    progress(name)
    found, free, seconds = run(scene, overlay)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"quantities": found.as_record(), "free": free, "cpu_s": seconds})
        path.write_text(text, encoding="utf-8")
    return found, free, seconds


def _write(rows: Sequence[Row], loads: Mapping[str, float]) -> None:
    """The module of the numbers, with three digits."""
    lines = [
        '"""Errors on the reference scenes, written by `python -m benchmarks.profiles --write`, not by hand."""',
        "",
        "from collections.abc import Mapping",
        "",
        '__all__ = ["COLLAPSE", "ERRORS"]',
        "",
        "ERRORS: Mapping[str, Mapping[str, tuple[float, float, float]]] = {",
    ]
    for profile, own in ratios(rows).items():
        lines.append(f'    "{profile}": {{')
        lines += [
            f'        "{quantity}": ({", ".join(_digits(value) for value in values)}),'
            for quantity, values in own.items()
        ]
        lines.append("    },")
    lines += [
        "}",
        '"""By profile and quantity: the ratio of the error to its measure (pipelines.tuning.expected_errors), and',
        'the least and the largest error of the reference scenes."""',
        "",
        "COLLAPSE: Mapping[str, float] = {",
        *(f'    "{profile}": {_digits(value)},' for profile, value in loads.items()),
        "}",
        '"""By profile: the largest error of a load of collapse, or of a least thickness (benchmarks.collapse)."""',
        "",
    ]
    _DATA.write_text("\n".join(lines), encoding="utf-8")


def _digits(value: Any) -> str:
    return repr(float(f"{value:.3g}"))


if __name__ == "__main__":
    guarded(main)
