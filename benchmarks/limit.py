"""Limit loads beside the dynamics: `python -m benchmarks.limit [--only W06 …] [--json | --write]`.

Walls and façades whose limit loads are published: bound and candidate with their times, the loads that the dynamics
hold and lose from rest around the candidate, and how alike the mechanism of the candidate is to the collapse of the
dynamics. What was measured is kept, a file a case, and not measured again. `--write` renews the tables of
docs/accuracy.md.
"""

import argparse
import json
import time
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from benchmarks.limit_scenes import FACADES, WALLS, LimitCase
from benchmarks.report import (
    Row,
    Table,
    commit,
    environment,
    guarded,
    machine,
    print_json,
    print_table,
    progress,
    table_lines,
    write_between,
)
from mechanics.limit.confirm import confirm, likeness
from mechanics.limit.limit_load import Flow, limit_load
from mechanics.scene.scene import Fidelity
from mechanics.scene.shapes import box
from moma.errors import UsageError

__all__ = ["main", "measured"]

_PAGE = Path(__file__).resolve().parents[1] / "docs" / "accuracy.md"
_RUNS = 8  # of the dynamics around a candidate, at most

# a stone that topples at λ = 0.25: its runs compile what the others use
_WARM = LimitCase(
    lambda: (
        box("ground", (-1, -1, -1), (1, 1, 0), fidelity=Fidelity.FIXED),
        box("stone", (0, 0, 0), (0.2, 0.2, 0.8)),
    ),
    1,
    0.6,
    (1.0, 0.0, 0.0),
    None,
    None,
)

_LOADS: Table = (
    ("case", "case", ""),
    ("stones", "stones", "d"),
    ("contacts", "contacts", "d"),
    ("asked_bound", "bound, published", ".5g"),
    ("bound", "bound", ".5f"),
    ("asked_candidate", "candidate, published", ".3g"),
    ("candidate", "candidate", ".4f"),
    ("highest", "other forces hold", ".4f"),
    ("held", "dynamics hold", ".4f"),
    ("lost", "dynamics lose", ".4f"),
    ("verdict", "within 3 %", ""),
)
_MOTIONS: Table = (
    ("case", "case", ""),
    ("cosine", "cosine of mechanism and collapse", ".2f"),
    ("mechanism", "mass that moves: mechanism", ".0%"),
    ("collapse", "collapse", ".0%"),
    ("common", "common", ".0%"),
    ("programmes", "programmes", "d"),
    ("bound_s", "bound, CPU s", ".2f"),
    ("candidate_s", "candidate, CPU s", ".2f"),
    ("runs", "runs", "d"),
    ("unsolved", "steps not solved", "d"),
    ("dynamics_s", "runs, CPU s", ".0f"),
)


def main() -> None:
    """Measure the cases that were not measured yet, and print the tables."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.limit", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/limit"), help="folder of what was measured")
    parser.add_argument("--only", nargs="+", default=[*WALLS, *FACADES], help="names of cases")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each case")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/accuracy.md")
    options = parser.parse_args()
    for name in options.only:
        if name not in WALLS and name not in FACADES:
            known = "; ".join([*WALLS, *FACADES])
            raise UsageError(f"no such case: {name!r}", where="--only", remedy=f"give some of {known}")
    under = commit()  # of the code as it was read, whatever changes while it runs
    rows = [_kept(options.out, name, under) for name in options.only]
    if options.json:
        print_json(rows)
        return
    for table in (_LOADS, _MOTIONS):
        print_table(rows, table)
        print()
    if options.write:
        write_between("limit", _page(rows), _PAGE)


def _page(rows: Sequence[Row]) -> list[str]:
    """Return the tables of docs/accuracy.md, walls and façades apart."""
    machines = ", ".join(dict.fromkeys(row["machine"] for row in rows))
    commits = ", ".join(dict.fromkeys(row["commit"] for row in rows))
    lines = [f"Measured at {commits} on {machines}, one thread, beside other jobs."]
    for cases in (WALLS, FACADES):
        some = [row for row in rows if row["case"] in cases]
        for table in (_LOADS, _MOTIONS):
            lines += ["", *table_lines(some, table)] if some else []
    return lines


def _kept(folder: Path, name: str, under: str) -> Row:
    """Return what was measured of a case; measure it if nothing was."""
    path = folder / f"{name.replace(' ', '').replace(',', '-')}.json"
    if not path.exists():
        progress(f"limit: {name}")
        measured("warm-up", _WARM)
        row = measured(name, WALLS[name] if name in WALLS else FACADES[name]) | {"commit": under}
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(row, indent=1, ensure_ascii=False), encoding="utf-8")
    kept: Row = json.loads(path.read_text(encoding="utf-8"))
    return kept


def measured(name: str, case: LimitCase) -> Row:
    """Measure a case: loads [-], shares of the mass that moves [-], and seconds of processor time."""
    on = case.assembly()
    begin = time.process_time()
    bound = limit_load(on, case.live)
    bounded = time.process_time()
    found = limit_load(on, case.live, Flow.COULOMB, bound)
    iterated = time.process_time()
    around = confirm(on, case.live, found.multiplier, _RUNS)
    done = time.process_time()
    fallen = around.collapse
    return {
        "case": name,
        "stones": len(on.free),
        "contacts": len(on.contacts),
        "asked_bound": case.bound,
        "bound": bound.multiplier,
        "asked_candidate": case.candidate,
        "candidate": found.multiplier,
        "converged": found.converged,
        "beyond": found.beyond,
        "highest": found.highest,
        "programmes": found.programmes,
        "held": around.held or None,
        "lost": None if fallen is None else around.lost,
        "verdict": "yes" if around.agrees(found.multiplier) else "no",
        "runs": len(around.trials),
        "outcomes": [f"{trial.multiplier:.4f} {trial.outcome}" for trial in around.trials],
        "unsolved": sum(trial.unsolved for trial in around.trials),
        **({} if fallen is None else asdict(likeness(on, found.mechanism, fallen.displacement))),
        "bound_s": bounded - begin,
        "candidate_s": iterated - bounded,
        "dynamics_s": done - iterated,
        "machine": machine(),
        "versions": environment("clarabel", "numpy", "numba"),
    }


if __name__ == "__main__":
    guarded(main)
