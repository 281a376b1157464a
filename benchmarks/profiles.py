"""Errors of the profiles, and loads of collapse at each: `python -m benchmarks.profiles [--collapse] [--write]`.

Each reference scene runs at each profile and on a mesh that no profile has. With `--collapse` walls on a table that
tilts, and arches that are made thinner, are held against values of limit analysis; stones are rigid, as in the
references, or with `--elastic` deform at the meshes of the profiles. docs/accuracy.md has the tables. `--write` renews
pipelines/tuning/measured_errors.json, from which `moma run` tells what error to expect.
"""

import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.report import ROOT, Row, columns, guarded, options_of, progress, show
from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, Start, TimeSettings
from mechanics.scene.shapes import bond, box, column, prism, semicircular_arch, voussoir_arch, wall
from mechanics.simulate import simulate
from pipelines.results.quantities import Quantities, differences, quantities, quantities_from
from pipelines.tuning.expected_errors import BOUNDS, TYPICAL, expected_errors, loops, measure
from pipelines.tuning.overlay import Overlay, overlaid_scene
from pipelines.tuning.profiles import PROFILES, Profile

_FINEST = replace(
    PROFILES["accurate"].rest, cells=3.0
)  # a mesh half as fine again as that of the finest profile
_DATA = ROOT / "pipelines/tuning/measured_errors.json"
_GRAVITY, _FRICTION = 9.81, 0.65
# of its width: a stone that has moved so far, and moves on, falls
_FALLS = 0.02
_DURATION = 5.0  # of a hold [s]
_WIDTH = 0.01  # of the reference: where a search ends
_TABLE = columns(
    "scene scene | profile profile | cpu_s CPU s :.1f | stress_error estimated error of the stress :.3f | "
    "free joints free :.2f | "
    + " | ".join(
        f"{name} {name.replace('_', ' ')} :.2g"
        for quantity in (*TYPICAL, *BOUNDS)
        for name in (quantity, f"{quantity}_expected")
    )
)
_LOADS = columns(
    "case case | profile profile | stones stones | value found :.5f | width ±  :.5f | "
    "reference reference :.5f | error error :+.2% | within within its band | holds holds :d | "
    "undecided undecided :d | unsolved unsolved steps :d | cpu_s CPU s :.1f"
)


def main() -> None:
    """Measure, print, and write where that is asked for."""
    parser = options_of("profiles", __doc__)
    parser.add_argument("--held-out", action="store_true", help="scenes that nothing was fitted to")
    names = [*REFERENCE, *HELD_OUT, *(case.name for case in CASES)]
    parser.add_argument(
        "--only", nargs="+", choices=names, default=names, help="scenes, or cases of collapse"
    )
    parser.add_argument("--records", type=Path, help="keep each run in this folder, and take it from there")
    parser.add_argument("--write", action="store_true", help="renew pipelines/tuning/measured_errors.json")
    parser.add_argument("--collapse", action="store_true", help="search loads of collapse instead")
    parser.add_argument("--elastic", action="store_true", help="let the stones of these deform, but in fast")
    options = parser.parse_args()
    if options.collapse:
        cases = [case for case in CASES if case.name in options.only]
        rows = [_load(case, profile, options.elastic) for case in cases for profile in PROFILES.values()]
        show(rows, _LOADS, as_json=options.json)
        return
    scenes = HELD_OUT if options.held_out else REFERENCE
    rows = [
        row
        for name, make in scenes.items()
        if name in options.only
        for row in measured_rows(name, make(), options.records)
    ]
    if options.write:
        _write(rows, _largest_errors(options.records))
    show(rows, _TABLE, as_json=options.json)


def measured_rows(name: str, scene: Scene, records: Path | None = None) -> list[Row]:
    """Return what each profile gives of a scene, against the finest mesh, and what it says of that itself."""
    truth, _, _ = _kept(f"{name} finest", scene, _FINEST, records)
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


def _run(scene: Scene, overlay: Overlay) -> tuple[Quantities, float, float]:
    """Return what users care about, the part of the joints that is free, and the processor time [s]."""
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
    """As `_run`; taken from the folder if it is there, else written into it."""
    path = None if records is None else records / f"{name.replace(' ', '_')}.json"
    if path is not None and path.is_file():
        record = json.loads(path.read_text(encoding="utf-8"))
        return quantities_from(record["quantities"]), record["free"], record["cpu_s"]
    progress(name)
    found, free, seconds = _run(scene, overlay)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps({"quantities": found.as_record(), "free": free, "cpu_s": seconds})
        path.write_text(text, encoding="utf-8")
    return found, free, seconds


def _write(rows: Sequence[Row], loads: Mapping[str, float]) -> None:
    """Write the numbers, with three digits."""
    errors = {
        profile: {quantity: list(map(_digits, values)) for quantity, values in own.items()}
        for profile, own in ratios(rows).items()
    }
    collapse = {profile: _digits(load) for profile, load in loads.items()}
    text = json.dumps({"errors": errors, "collapse": collapse}, indent=2)
    _DATA.write_text(f"{text}\n", encoding="utf-8")


def _digits(value: float) -> float:
    return float(f"{value:.3g}")


# --- the scenes: all corners are sharp; stones stand on fixed blocks as wide as they are ---


def _two_spans() -> tuple[Block, ...]:
    """Two segmental arches of seven voussoirs over 1.5 m on a pier and two abutments, each of three courses.

    The lowest course is fixed.
    """
    centre, low, high = 1.2, np.radians(40.0), np.radians(140.0)
    (x0, z0), (x1, z1) = ((r * np.cos(low), r * np.sin(low)) for r in (1.0, 1.3))
    inner, outer, edge = centre + x0, centre + x1, centre + x0 + 0.9
    at, back = centre - x0, centre - x1
    cap = [(-at, 0.3), (at, 0.3), (at, z0), (back, z1), (-back, z1), (-at, z0)]
    abutment = np.array([(inner, 0.3), (edge, 0.3), (edge, z1), (outer, z1), (inner, z0)])
    stones = [
        prism("P3", cap, 0.3),
        prism("R3", abutment, 0.3),
        prism("L3", abutment[::-1] * [-1.0, 1.0], 0.3),
    ]
    for name, a, b in (("P", -at, at), ("R", inner, edge), ("L", -edge, -inner)):
        stones += [
            box(f"{name}1", (a, -0.15, -0.5), (b, 0.15, -0.1), fidelity=Fidelity.FIXED),
            box(f"{name}2", (a, -0.15, -0.1), (b, 0.15, 0.3)),
        ]
    spans = (
        voussoir_arch(7, (1.0, 1.3), 0.3, (float(low), float(high)), centre=(x, 0.0), prefix=name)
        for name, x in (("A", -centre), ("B", centre))
    )
    return (*stones, *(stone for span in spans for stone in span))


def _pier(rows: int = 6) -> tuple[Block, ...]:
    """Courses of two stones that cross those below, a slab on them, and a stone in one corner of it.

    The lowest course is fixed.
    """
    wide, height = 0.8, 0.35
    stones: list[Block] = []
    for row in range(rows):
        for k in (0, 1):
            x = (0.0, wide) if row % 2 else (k * wide / 2, (k + 1) * wide / 2)
            y = (k * wide / 2, (k + 1) * wide / 2) if row % 2 else (0.0, wide)
            low, high = (x[0], y[0], row * height), (x[1], y[1], (row + 1) * height)
            fidelity = Fidelity.RIGID if row else Fidelity.FIXED
            stones.append(box(f"{row + 1}-{k + 1}", low, high, fidelity=fidelity))
    top = rows * height
    stones.append(box("slab", (0, 0, top), (wide, wide, top + 0.25)))
    return (*stones, box("load", (0.05, 0.1, top + 0.25), (0.55, 0.5, top + 0.85)))


def _flying_arch() -> tuple[Block, ...]:
    """Six voussoirs of a sixth of a circle that lean from a fixed foot against a wall of three stones with a coping."""
    low, high = float(np.radians(30.0)), float(np.radians(90.0))
    on = [(r * np.cos(low), r * np.sin(low)) for r in (1.5, 1.8)]
    (x0, z0), (x1, z1) = on
    foot = prism(
        "foot",
        [(x0, z0 - 0.4), (x1 + 0.3, z0 - 0.4), (x1 + 0.3, z1), (x1, z1), (x0, z0)],
        0.3,
        fidelity=Fidelity.FIXED,
    )
    leaning = [box("wall 1", (-1.0, -0.2, 0.7), (0.0, 0.2, 1.1), fidelity=Fidelity.FIXED)]
    leaning += [
        box(f"wall {k + 2}", (-1.0, -0.2, 1.1 + 0.4 * k), (0.0, 0.2, 1.5 + 0.4 * k)) for k in range(2)
    ]
    coping = box("coping", (-1.0, -0.2, 1.9), (-0.1, 0.2, 2.2))
    return (foot, *leaning, coping, *voussoir_arch(6, (1.5, 1.8), 0.3, (low, high)))


def _trilith() -> tuple[Block, ...]:
    """Two posts of two stones each, of which the lower is fixed, a lintel on them, and a stone on one half of it."""
    stones = []
    for name, x in (("L", 0.0), ("R", 1.5)):
        stones += [
            box(f"{name}1", (x, 0, 0), (x + 0.45, 0.4, 0.6), fidelity=Fidelity.FIXED),
            box(f"{name}2", (x, 0, 0.6), (x + 0.45, 0.4, 1.3)),
        ]
    lintel = box("lintel", (-0.1, 0, 1.3), (2.05, 0.4, 1.7))
    return (*stones, lintel, box("load", (0.3, 0.05, 1.7), (0.9, 0.35, 2.2)))


# an opening of one stone, three courses high, under a lintel of two
_OPENING: list[list[float]] = [
    [0.5, 1, 1, 1, 0.5],
    [1, 1, 1, 1],
    [0.5, 1, -1, 1, 0.5],
    [0.75, 0.75, -1, 0.75, 0.75],
    [0.5, 1, -1, 1, 0.5],
    [1, 2, 1],
    [0.5, 1, 1, 1, 0.5],
    [1, 1, 1, 1],
]


def _scene(name: str, blocks: tuple[Block, ...], sideways: float = 0.0) -> Scene:
    """At rest from the start; `sideways` is a part of the weight that pushes along x."""
    return Scene(
        name,
        blocks,
        gravity=(sideways * _GRAVITY, 0.0, -_GRAVITY),
        contact=ContactSettings(DryJoint(_FRICTION)),
        time=TimeSettings(start=Start.EQUILIBRIUM, relaxation=True),
    )


REFERENCE: Mapping[str, Callable[[], Scene]] = {
    "running bond": lambda: _scene(
        "running bond", wall(bond(4, 6, halves_first=True), 0.5, 0.25, 0.3, slab=False), 0.15
    ),
    "pier": lambda: _scene("pier", _pier()),
    "two spans": lambda: _scene("two spans", _two_spans()),
    "flying arch": lambda: _scene("flying arch", _flying_arch()),
    "trilith": lambda: _scene("trilith", _trilith()),
    "pinnacle": lambda: _scene("pinnacle", column(4, 0.7, 0.45, top=0.35, sides=6), 0.08),
}
"""Those that the estimates were fitted to."""

HELD_OUT: Mapping[str, Callable[[], Scene]] = {
    "arch": lambda: _scene("arch", semicircular_arch(11, 0.3, 1.2)),
    "wall with opening": lambda: _scene("wall with opening", wall(_OPENING, 0.6, 0.3, 0.4, slab=False)),
    "column": lambda: _scene("column", column(6, 0.8, 0.5, top=0.6), 0.05),
}
"""Those that nothing was fitted to."""


# --- loads of collapse ---


@dataclass(frozen=True)
class Case:
    """A structure with one number that decides whether it stands.

    Attributes
    ----------
    name, source : of the case, and where its reference comes from
    low, high : a right load of collapse, or a right thickness, lies between them
    reference : the value to which errors refer
    stones : at a value of the number
    multiplier : of the weight that pushes sideways, at a value of the number
    friction : Coulomb's μ
    stands_above : it stands above its value, not below
    """

    name: str
    source: str
    low: float
    high: float
    reference: float
    stones: Callable[[float], tuple[Block, ...]]
    multiplier: Callable[[float], float]
    friction: float
    stands_above: bool = False


@dataclass(frozen=True)
class Found:
    """Result of a search.

    Attributes
    ----------
    stood, fell : the last value at which it stood, and the first at which it did not
    holds : values that were tried
    undecided : of them neither at rest nor fallen when their time was over
    unsolved : steps above the tolerance of the profile, of all holds that stood
    seconds : of processor time
    """

    stood: float
    fell: float
    holds: int
    undecided: int
    unsolved: int
    seconds: float

    @property
    def value(self) -> float:
        """Half-way between the two."""
        return 0.5 * (self.stood + self.fell)


def _wall(name: str, rows: int, associative: float, published: float) -> Case:
    """Band: 0.97 of the lowest load without dilatancy, 1.01 of the associative one (contact at sharp corners)."""
    stones = wall(bond(5, rows, halves_first=True), 0.4, 0.175, 0.175)
    return Case(
        name,
        "Ferris & Tin-Loi 2001, Gilbert et al. 2006",
        0.97 * published,
        1.01 * associative,
        published,
        lambda _: stones,
        lambda value: value,
        0.65,
    )


def _arch(count: int, least: float) -> Case:
    """Stable at 1.03 of the least thickness over the mean radius, falling at 0.97; hinges only."""
    return Case(
        f"arch of {count}",
        "linear programme; Gilbert et al. 2006 for 27",
        0.97 * least,
        1.03 * least,
        least,
        lambda value: semicircular_arch(count, value),
        lambda _: 0.0,
        0.7,
        stands_above=True,
    )


CASES = (
    _wall("W01", 6, 0.64286, 0.64),
    _wall("W02", 10, 0.58, 0.563),
    _arch(7, 0.0957),
    _arch(15, 0.10607),
    _arch(27, 0.10672),
)


def search(case: Case, profile: Profile, elastic: bool = False) -> Found:
    """Halve the range between a value that stands and one that falls until it is 1 % of the reference wide."""
    begun = time.process_time()
    # a search that ends at one of these is outside the band
    ends = 0.98 * case.low, 1.02 * case.high
    stood, fell = ends[::-1] if case.stands_above else ends
    holds = undecided = unsolved = 0
    while abs(fell - stood) > _WIDTH * case.reference:
        value = 0.5 * (stood + fell)
        outcome, left = _hold(case, value, profile, elastic)
        holds, undecided = holds + 1, undecided + (outcome is Outcome.MOVING)
        if outcome is Outcome.EQUILIBRIUM:
            stood, unsolved = value, unsolved + left
        else:
            fell = value
    return Found(stood, fell, holds, undecided, unsolved, time.process_time() - begun)


def _largest_errors(records: Path | None = None) -> dict[str, float]:
    """By profile, the largest relative error of all cases; half of what a search leaves open counts as error."""
    largest = dict.fromkeys(PROFILES, 0.0)
    for case in CASES:
        for name, profile in PROFILES.items():
            path = (
                None if records is None else records / f"collapse_{case.name}_{name}.json".replace(" ", "_")
            )
            if path is not None and path.is_file():
                row: Row = json.loads(path.read_text(encoding="utf-8"))
            else:
                row = _load(case, profile, elastic=False)
                if path is not None:
                    path.write_text(json.dumps(row), encoding="utf-8")
            largest[name] = max(largest[name], abs(row["error"]) + row["width"] / row["reference"])
    return largest


def _hold(case: Case, value: float, profile: Profile, elastic: bool = False) -> tuple[Outcome, int]:
    """Return whether the case stands at a value, all loads at once from rest, and how many steps were left unsolved."""
    stones = case.stones(value)
    sideways = case.multiplier(value) * _GRAVITY
    scene = Scene(
        case.name,
        stones,
        gravity=(sideways, 0.0, -_GRAVITY),
        contact=ContactSettings(DryJoint(case.friction)),
        time=TimeSettings(duration=_DURATION, collapse_displacement=_FALLS),
    )
    overlay = profile.overlay(scene.time)
    deforms = elastic and overlay.fidelity is not Fidelity.RIGID
    fidelity = Fidelity.DEFORMABLE if deforms else Fidelity.RIGID
    result = simulate(overlaid_scene(scene, replace(overlay, fidelity=fidelity)))
    return result.outcome, result.errors.unconverged_steps


def _load(case: Case, profile: Profile, elastic: bool) -> Row:
    progress(f"{case.name}, {profile.name}")
    found = search(case, profile, elastic)
    deforms = elastic and profile.rest.fidelity is not Fidelity.RIGID
    return {
        "case": case.name,
        "profile": profile.name,
        "stones": "elastic" if deforms else "rigid",
        "value": found.value,
        "width": 0.5 * abs(found.fell - found.stood),
        "reference": case.reference,
        "error": found.value / case.reference - 1.0,
        "low": case.low,
        "high": case.high,
        "within": "yes" if case.low <= found.value <= case.high else "no",
        "holds": found.holds,
        "undecided": found.undecided,
        "unsolved": found.unsolved,
        "cpu_s": found.seconds,
    }


if __name__ == "__main__":
    guarded(main)
