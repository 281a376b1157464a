"""Forces after building in stages against gravity turned on at once, on samples: ``python -m benchmarks.stages``.

The wall with an arched opening is built with its arch on a rigid centring, which is struck before or after the course
above is laid. The corner and the settled wall lose support before or after the upper half of their courses is laid.
Joints are rigid, or springs of 10 and 4 GPa/m across and along them, with which forces are unique.
"""

import json
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from archmodel.database.session import open_database
from benchmarks.report import columns, guarded, options_of, progress, show
from mechanics.arrays import Array
from mechanics.results.result import Result
from mechanics.simulate import simulate_stages
from pipelines.ingest.ingest import ingest
from pipelines.run.assemble import assemble
from pipelines.scene.file import parse_scene
from synthetic.write import write_sample

_TABLE = columns(
    "words case, joints | order order | thrust_shown thrust [kN] :.2f | "
    "supports_shown on other supports, % :.1f | joints_differ_shown change of joints, % :.1f | "
    "top_shown top [mm] :.2f | bed_shown bed [mm] :+.1f | reaction_error reaction :.1e | seconds s :.0f | "
    "outcome outcome"
)

_SCENE = """
[materials.limestone]
density = 2350.0
young = 12e9
poisson = 0.2
[bodies]
default = "rigid"
fixed = ["course = 1"]
[joints]
max_width = 0.04
[time]
step = 0.005
duration = 4.0
relaxation = true
"""
_SPRINGS = """
[contact]
placement = "centroid"
[[laws]]
type = "elastic_joint"
friction = 0.6
normal_stiffness = 10e9
shear_stiffness = 4e9
"""
_ARCH = ("code like 'V%'",)
_FELL = 0.5  # s, of a settlement


@dataclass(frozen=True)
class Case:
    """A sample, and the orders in which it is built; the first is the one to which others are compared.

    Attributes
    ----------
    kind : of the sample
    moved : what has moved it; None: nothing
    orders : by name the TOML text of the stages and loads
    arch : codes of the stones whose thrust on all others is told; empty: none
    """

    kind: str
    orders: Mapping[str, str]
    arch: tuple[str, ...] = ()
    moved: str | None = None


def _stage(name: str, lay: str = "", hold: tuple[str, ...] = ()) -> str:
    held = f"hold = {json.dumps(hold)}\n" if hold else ""
    laid = f"lay = {lay}\n" if lay else ""
    return f'[[stages]]\nname = "{name}"\n{laid}{held}'


def _settles(codes: Mapping[str, float], stage: str) -> str:
    return "".join(
        f'[[loads]]\ntype = "settlement"\nstones = ["{code}"]\ndisplacement = [0, 0, {-down}]\nduration = {_FELL}\n'
        f'stages = ["{stage}"]\n'
        for code, down in codes.items()
    )


def _two_phases(codes: Mapping[str, float]) -> dict[str, str]:
    """Return the orders of a wall of eight courses some of whose foundations sink."""
    low, high, whole = '["course > 1 and course < 5"]', '["course >= 5"]', '["course > 1"]'
    return {
        "weight and settlement at once": _stage("all", whole) + _settles(codes, "all"),
        "settlement under all courses": _stage("all", whole) + _stage("sinks") + _settles(codes, "sinks"),
        "settlement under the lower half, then the upper": _stage("lower", low)
        + _stage("sinks")
        + _stage("upper", high)
        + _settles(codes, "sinks"),
    }


_ABUTMENTS, _ABOVE = '["course > 1 and course < 8"]', '["course = 8"]'
_RING = json.dumps(_ARCH)
CASES = {
    "arch": Case(
        "wall",
        {
            "at once": _stage("all", '["course > 1", "code like \'V%\'"]'),
            "struck, then the course above": _stage("abutments", _ABUTMENTS)
            + _stage("ring", _RING, _ARCH)
            + _stage("struck")
            + _stage("above", _ABOVE),
            "the course above, then struck": _stage("abutments", _ABUTMENTS)
            + _stage("ring", _RING, _ARCH)
            + _stage("above", _ABOVE, _ARCH)
            + _stage("struck"),
        },
        tuple(f"V{number}" for number in range(1, 8)),
    ),
    "corner": Case("corner", _two_phases({"Q01": 0.010, "A01-01": 0.005, "B01-01": 0.005})),
    "settled": Case(
        "wall", _two_phases({"W01-01": 0.030, "W01-02": 0.020, "W01-03": 0.010}), moved="settlement"
    ),
}


def rows(names: tuple[str, ...], folder: Path) -> Iterator[dict[str, Any]]:
    """Yield the numbers of each order of each case, with rigid joints and with springs."""
    for name in names:
        case = CASES[name]
        place = folder / name
        write_sample(case.kind, place, moved=case.moved)
        url = f"sqlite:///{place}/sample.db"
        ingest([place / f"{case.kind}.moma"], url)
        with open_database(url, create=False) as database, database.session(read_only=True) as session:
            for joints, law in (("springs", _SPRINGS), ("rigid", "")):
                first: Result | None = None
                for order, stages in case.orders.items():
                    built = assemble(parse_scene(_SCENE + law + stages, f"{name}.toml"), session)
                    progress(f"{name}, {joints}: {order}")
                    began = time.process_time()
                    result = simulate_stages(built.stages)
                    first = first or result
                    yield {
                        "case": name,
                        "joints": joints,
                        "order": order,
                        "outcome": f"{result.outcome} ({len(result.stages)} of {len(built.stages)} stages)",
                        "reaction_error": max(one.reaction_error for one in result.stages),
                        "thrust": _thrust(result, case.arch),
                        "supports": _differ(result, first),
                        "joints_differ": _joints_differ(result, first),
                        "top": _top(result),
                        "bed": max((one.bed for one in result.stages), key=abs),
                        "seconds": time.process_time() - began,
                    }


def _thrust(result: Result, arch: tuple[str, ...]) -> float | None:
    """Return the mean horizontal force that the arch exerts to either side on stones beside it [N]."""
    if not arch:
        return None
    codes = [body.code for body in result.bodies]
    own = np.array([code in arch for code in codes])
    bodies, force = result.contacts.bodies, result.contacts.force
    out = own[bodies[:, 0]] != own[bodies[:, 1]]
    # of the joints with stones below its crown, those of the course above are left out
    above = np.array([code.startswith("W08") for code in codes])
    out &= ~above[bodies].any(axis=1)
    return 0.5 * float(np.abs(force[out, 0]).sum())


def _differ(result: Result, other: Result) -> float:
    """Return the share of the weight that other supports bear [-]."""
    one, two = (
        dict(zip(end.supports, end.forces[:, 2], strict=True))
        for end in (result.stages[-1], other.stages[-1])
    )
    moved = sum(abs(float(one.get(code, 0.0) - two.get(code, 0.0))) for code in {*one, *two})
    return 0.5 * moved / other.weight


def _joints_differ(result: Result, other: Result) -> float:
    """Return the mean change of the resultants of joints, over the mean resultant [-]."""
    one, two = _resultants(result), _resultants(other)
    none = np.zeros(3)
    changes = [float(np.linalg.norm(one.get(pair, none) - two.get(pair, none))) for pair in {*one, *two}]
    return sum(changes) / sum(float(np.linalg.norm(force)) for force in two.values())


def _resultants(result: Result) -> dict[tuple[str, str], Array]:
    """Return the force (3,) between each two stones on the one whose code comes first [N]."""
    found: dict[tuple[str, str], Array] = {}
    for (first, second), force in zip(result.contacts.bodies.tolist(), result.contacts.force, strict=True):
        one, other = result.bodies[first].code, result.bodies[second].code
        pair, own = ((one, other), force) if one < other else ((other, one), -force)
        found[pair] = found.get(pair, np.zeros(3)) + own
    return found


def _top(result: Result) -> float:
    """Return the largest displacement of a stone of the last course since it was laid [m]."""
    last = [body for body in result.bodies if body.code[1:3] == "08"]
    return max(float(np.linalg.norm(body.displacement, axis=1).max()) for body in last)


def main() -> None:
    """Print a table, or JSON."""
    parser = options_of("stages", __doc__)
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=list(CASES))
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        found = list(rows(tuple(options.cases), Path(folder)))
    for one in found:
        one |= {"words": f"{one['case']}, {one['joints']}"}
        for key, unit in (
            ("thrust", 1e-3),
            ("supports", 100.0),
            ("joints_differ", 100.0),
            ("top", 1e3),
            ("bed", 1e3),
        ):
            one[f"{key}_shown"] = None if one[key] is None else unit * one[key]
    show(found, _TABLE, as_json=options.json)


if __name__ == "__main__":
    guarded(main)
