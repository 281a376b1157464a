"""Limit loads beside what is published: `python -m benchmarks.limit [--only W06 …] [--runs] [--json | --write]`.

Walls and façades whose limit loads are published: the limit by the rule of runs, the bound above it and the candidates
of cone programmes, with their times. `--runs` also lets loads about the limit act for hundreds of steps, and compares
the mechanism with the collapse. What was measured is kept, a file a case, and not measured again. `--write` renews the
tables of docs/accuracy.md.
"""

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.report import (
    ROOT,
    Row,
    columns,
    commit,
    environment,
    guarded,
    machine,
    options_of,
    progress,
    show,
    table_lines,
    write_between,
)
from ground.errors import UsageError
from mechanics.limit.assembly import RigidAssembly, assembly
from mechanics.limit.confirm import confirm, likeness
from mechanics.limit.held import HeldLimit, held_limit
from mechanics.limit.limit_load import Flow, LimitLoad, limit_load
from mechanics.limit.live_loads import Acceleration
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene
from mechanics.scene.shapes import bond, box, wall
from mechanics.stones.materials import Material

_PAGE = ROOT / "docs" / "accuracy.md"
_RUNS = 8  # of the dynamics about a limit, at most
_LOADS = columns(
    "case case | stones stones :d | contacts contacts :d | asked_bound bound, published :.5g | "
    "bound bound :.5f | asked_candidate lowest published :.3g | limit held :.4f | limit_lost lost :.4f | "
    "lowest lowest candidate :.4f | candidate highest candidate :.4f | problems problems :d | "
    "limit_s limit, CPU s :.2f | programmes programmes :d | "
    "bound_s bound, CPU s :.2f | candidate_s candidates, CPU s :.2f"
)
_MOTIONS = columns(
    "case case | limit held :.4f | held runs hold :.4f | lost runs lose :.4f | verdict within 3 % | "
    "cosine cosine of mechanism and collapse :.2f | mechanism mass that moves: mechanism :.0% | "
    "collapse collapse :.0% | common common :.0% | runs runs :d | unsolved steps not solved :d | "
    "dynamics_s runs, CPU s :.0f"
)

FRICTION = 0.65
"""Coulomb's μ of the walls."""

_STONE = Material("stone", 2000.0, young=1e10, poisson=0.2)
_WIDTH, _HEIGHT = 0.4, 0.175  # of a whole stone of the walls [m]
_BRICK = (0.08, 0.04, 0.028)  # length, thickness and height of a stone of the façades [m]
_ALONG = (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class LimitCase:
    """Stones, a direction in which they are pushed, and what is known of their limit load.

    Attributes
    ----------
    blocks : makes the stones
    stones : number of those that may move; None: not published
    friction : Coulomb's μ
    direction : (3,) of the acceleration
    bound, candidate : published λ with associative and with Coulomb's friction; None: not published [-]
    """

    blocks: Callable[[], Sequence[Block]]
    stones: int | None
    friction: float
    direction: tuple[float, float, float]
    bound: float | None
    candidate: float | None

    @property
    def live(self) -> Acceleration:
        """Load whose multiple is sought."""
        return Acceleration(self.direction)

    def assembly(self) -> RigidAssembly:
        """Return the stones and their joints."""
        contact = ContactSettings(DryJoint(self.friction))
        return assembly(Scene("limit", tuple(self.blocks()), contact=contact))


def facade(stones: int, courses: int, returns: int) -> tuple[Block, ...]:
    """Return a façade along x with bonded return walls at both ends, on a fixed stone `ground`.

    Parameters
    ----------
    stones, courses : whole stones in a course, and courses
    returns : whole stones in the length of each return wall; 0: none
    """
    length, thick, high = _BRICK
    width, deep = stones * length, returns * length + thick
    blocks = [box("ground", (-2.0, -2.0, -1.0), (2.0, 2.0, 0.0), _STONE, fidelity=Fidelity.FIXED)]
    for course in range(courses):
        whole = course % 2 == 0
        inset = 0.0 if whole else thick
        ends = [(0.0, thick), (width - thick, width)]
        lying = [(a, 0.0, b, thick) for a, b in _row(inset, width - inset)]
        if returns:
            lying += [(x0, a, x1, b) for a, b in _row(thick - inset, deep) for x0, x1 in ends]
        elif not whole:
            lying += [(x0, 0.0, x1, thick) for x0, x1 in ends]
        blocks += [
            box(f"{course}-{number}", (x0, y0, course * high), (x1, y1, (course + 1) * high), _STONE)
            for number, (x0, y0, x1, y1) in enumerate(lying)
        ]
    return tuple(blocks)


def facade_case(
    stones: int, courses: int, returns: int, friction: float, way: str, bound: float | None = None
) -> LimitCase:
    """Return a façade that is pushed *out*, away from its return walls, or *in*; further parameters as `facade`."""
    direction = (0.0, -1.0, 0.0) if way == "out" else (0.0, 1.0, 0.0)
    return LimitCase(partial(facade, stones, courses, returns), None, friction, direction, bound, None)


def _row(start: float, end: float) -> Iterator[tuple[float, float]]:
    return pairwise([*np.arange(start, end - 1e-9, _BRICK[0]), end])


def _wall(courses: Iterable[Sequence[float]]) -> tuple[Block, ...]:
    return wall(list(courses), _WIDTH, _HEIGHT, _HEIGHT, _STONE)


def _with_windows(names: Mapping[str, list[float]], order: str) -> tuple[Block, ...]:
    """Return a wall of courses (F: whole, W: with windows; e: of even ones, u: of uneven ones) from bottom to top."""
    return _wall(names[name] for name in order.split())


_WINDOW = "Wu We Wu We Wu"
_W03: dict[str, list[float]] = {
    "Fe": [1] * 4,
    "Fu": [0.5, 1, 1, 1, 0.5],
    "We": [1, 0.5, -1, 0.5, 1],
    "Wu": [0.5, 1, -1, 1, 0.5],
}
_W04: dict[str, list[float]] = {
    "Fe": [0.5, 1, 1, 1, 1, 0.5],
    "Fu": [1] * 5,
    "Wu": [1, -1, 1, -1, 1],
    "We": [0.5, 0.5, -1, 0.5, 0.5, -1, 0.5, 0.5],
}
_W05: dict[str, list[float]] = {
    "Fe": [0.5, 1, 1, 0.5],
    "Fu": [1] * 3,
    "Wu": [1, -1, 1],
    "We": [0.5, 0.5, -1, 0.5, 0.5],
}
_W06: dict[str, list[float]] = {
    "Fe": [0.5, *[1] * 6, 0.5],
    "Fu": [1] * 7,
    "Wu": [0.5, 1, -1, 1, 1, -1, 1, 0.5],
    "We": [1, 0.5, -1, 0.5, 1, 0.5, -1, 0.5, 1],
}
_TWO_STOREYS = f"Fe Fu Fe {_WINDOW} Fe Fu Fe {_WINDOW} Fe Fu Fe"
_SIX = f"Fe Fu Fe Fu {_WINDOW} Fu Fe Fu {_WINDOW} Fu Fe Fu Fe"
_ONE_STOREY = f"Fe Fu Fe {_WINDOW} Fe Fu Fe"

WALLS: Mapping[str, LimitCase] = {
    name: LimitCase(blocks, stones, FRICTION, _ALONG, bound, candidate)
    for name, blocks, stones, bound, candidate in (
        ("W01", partial(_wall, bond(5, 6, halves_first=True)), 33, 0.64286, 0.64),
        ("W02", partial(_wall, bond(5, 10, halves_first=True)), 55, 0.58, 0.563),
        ("W03", partial(_with_windows, _W03, _ONE_STOREY), 46, 0.40369, 0.356),
        ("W04", partial(_with_windows, _W04, _ONE_STOREY), 55, 0.33195, 0.264),
        ("W05", partial(_with_windows, _W05, _TWO_STOREYS), 61, 0.23964, 0.215),
        ("W06", partial(_with_windows, _W06, _SIX), 146, 0.34782, 0.297),
    )
}
"""The walls of Ferris & Tin-Loi (2001), after Gilbert et al. (2006) and HybriDFEM."""

FACADES: Mapping[str, LimitCase] = {
    f"{stones} × {courses}, {returns}, {friction:g}, {way}": facade_case(
        stones, courses, returns, friction, way, bound
    )
    for stones, courses, returns, friction, way, bound in (
        (4, 6, 0, 0.7, "out", 0.2381),
        (4, 6, 0, 0.7, "in", 0.2381),
        (6, 10, 0, 0.7, "out", 0.14286),
        (6, 10, 0, 0.7, "in", 0.14286),
        (4, 6, 2, 0.7, "out", 0.59992),
        (4, 6, 2, 0.7, "in", 0.68301),
        (4, 10, 2, 0.7, "out", 0.41715),
        (4, 10, 2, 0.7, "in", 0.65024),
        (6, 10, 3, 0.7, "out", 0.46866),
        (6, 10, 3, 0.7, "in", 0.60397),
        (4, 6, 2, 0.4, "out", 0.4),
        (4, 10, 2, 0.4, "out", 0.39076),
        (4, 6, 2, 0.6, "out", None),
    )
}
"""Façades by stones × courses, length of the returns in stones, friction, and the way of the push (W09)."""

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


def main() -> None:
    """Measure the cases that were not measured yet, and print the tables."""
    parser = options_of("limit", __doc__)
    parser.add_argument("--out", type=Path, default=Path("out/limit"), help="folder of what was measured")
    parser.add_argument("--only", nargs="+", default=[*WALLS, *FACADES], help="names of cases")
    parser.add_argument("--runs", action="store_true", help="let loads about the limit act for long")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/accuracy.md")
    options = parser.parse_args()
    for name in options.only:
        if name not in WALLS and name not in FACADES:
            known = "; ".join([*WALLS, *FACADES])
            raise UsageError(f"no such case: {name!r}", where="--only", remedy=f"give some of {known}")
    under = commit()  # of the code as it was read, whatever changes while it runs
    rows = [_kept(options.out, name, under, options.runs) for name in options.only]
    show(rows, _LOADS, *([_MOTIONS] if options.runs else []), as_json=options.json)
    if options.write:
        write_between("limit", _page(rows), _PAGE)


def _page(rows: Sequence[Row]) -> list[str]:
    """Return the tables of docs/accuracy.md: loads of walls and of façades, and of both what runs say."""
    machines = ", ".join(dict.fromkeys(row["machine"] for row in rows))
    commits = ", ".join(dict.fromkeys(row["commit"] for row in rows))
    lines = [f"Measured at {commits} on {machines}, one thread, beside other jobs."]
    tables = [([row for row in rows if row["case"] in cases], _LOADS) for cases in (WALLS, FACADES)]
    for some, table in [*tables, ([row for row in rows if "runs" in row], _MOTIONS)]:
        lines += ["", *table_lines(some, table)] if some else []
    return lines


def _kept(folder: Path, name: str, under: str, runs: bool) -> Row:
    """Return what was measured of a case; measure it if nothing was, or its runs are asked for and were not made."""
    path = folder / f"{name.replace(' ', '').replace(',', '-')}.json"
    kept: Row = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    if not kept or (runs and "runs" not in kept):
        progress(f"limit: {name}")
        measured("warm-up", _WARM, runs)
        case = WALLS[name] if name in WALLS else FACADES[name]
        kept = dict(measured(name, case, runs)) | {"commit": under}
        folder.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(kept, indent=1, ensure_ascii=False), encoding="utf-8")
    return kept


def measured(name: str, case: LimitCase, runs: bool = False) -> Row:
    """Measure a case: loads [-], shares of the mass that moves [-], and seconds of processor time."""
    on = case.assembly()
    clock = [time.process_time()]
    bound = limit_load(on, case.live)
    clock.append(time.process_time())
    limit = held_limit(on, case.live, bound)
    clock.append(time.process_time())
    found = limit_load(on, case.live, Flow.COULOMB, bound)
    clock.append(time.process_time())
    bound_s, limit_s, candidate_s = np.diff(clock).tolist()
    return {
        "case": name,
        "stones": len(on.free),
        "contacts": len(on.contacts),
        "asked_bound": case.bound,
        "bound": bound.multiplier,
        "asked_candidate": case.candidate,
        "limit": limit.held,
        "limit_lost": limit.lost,
        "problems": limit.problems,
        "candidate": found.multiplier,
        "converged": found.converged,
        "beyond": found.beyond,
        "lowest": found.lowest.multiplier,
        "programmes": found.programmes,
        **(_run(on, case, limit, bound) if runs else {}),
        "bound_s": bound_s,
        "limit_s": limit_s,
        "candidate_s": candidate_s,
        "machine": machine(),
        "versions": environment("clarabel", "numpy", "numba"),
    }


def _run(on: RigidAssembly, case: LimitCase, limit: HeldLimit, bound: LimitLoad) -> Row:
    """Let loads about the limit act for long, and compare the mechanism with the collapse."""
    begin = time.process_time()
    around = confirm(on, case.live, limit.held, bound.multiplier, _RUNS)
    fallen, mechanism = around.collapse, limit.mechanism or bound.mechanism
    return {
        "held": around.held or None,
        "lost": around.lost,
        "verdict": "yes" if around.agrees(limit.held) else "no",
        "runs": len(around.trials),
        "outcomes": [f"{trial.multiplier:.4f} {trial.outcome}" for trial in around.trials],
        "unsolved": sum(trial.unsolved for trial in around.trials),
        **({} if fallen is None else asdict(likeness(on, mechanism, fallen.displacement))),
        "dynamics_s": time.process_time() - begin,
    }


if __name__ == "__main__":
    guarded(main)
