"""Loads of collapse by slow tilting at each profile: `python -m benchmarks.collapse [--json]`.

Walls on a table that tilts, and arches that are made thinner, against values of limit analysis; docs/accuracy.md has
the table. Stones are rigid, as in the references; with `--elastic` they deform, at the meshes of the profiles.
"""

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from benchmarks.report import Row, Table, environment, guarded, machine, print_json, print_table, progress
from mechanics.dynamics.outcome import Outcome
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, TimeSettings
from mechanics.scene.shapes import bond, semicircular_arch, wall
from mechanics.simulate import simulate
from pipelines.tuning.overlay import overlaid_scene
from pipelines.tuning.profiles import PROFILES, Profile

__all__ = ["CASES", "Case", "Found", "errors", "hold", "main", "search"]

_GRAVITY = 9.81
# of its width: a stone that has moved so far, and moves on, falls
_FALLS = 0.02
_DURATION = 5.0
# of the reference: where a search ends
_WIDTH = 0.01


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
    """What a search found.

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
_TABLE: Table = (
    ("case", "case", ""),
    ("profile", "profile", ""),
    ("stones", "stones", ""),
    ("value", "found", ".5f"),
    ("width", "± ", ".5f"),
    ("reference", "reference", ".5f"),
    ("error", "error", "+.2%"),
    ("within", "within its band", ""),
    ("holds", "holds", "d"),
    ("undecided", "undecided", "d"),
    ("unsolved", "unsolved steps", "d"),
    ("cpu_s", "CPU s", ".1f"),
)


def main() -> None:
    """Search each case at each profile, and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.collapse", description=__doc__)
    parser.add_argument("--cases", nargs="+", choices=[one.name for one in CASES], default=None)
    parser.add_argument("--profiles", nargs="+", choices=list(PROFILES), default=list(PROFILES))
    parser.add_argument(
        "--width", type=float, default=_WIDTH, help=f"where a search ends, relative ({_WIDTH})"
    )
    parser.add_argument("--elastic", action="store_true", help="let the stones deform, but in fast")
    parser.add_argument("--json", action="store_true", help="print an array of objects, one for each search")
    options = parser.parse_args()
    rows = [
        _row(case, PROFILES[name], options.width, options.elastic)
        for case in CASES
        if options.cases is None or case.name in options.cases
        for name in options.profiles
    ]
    if options.json:
        print_json([row | {"machine": machine()} for row in rows])
        return
    print(f"{machine()}; {environment('moma-masonry', 'numba', 'numpy', 'scipy')}\n")
    print_table(rows, _TABLE)


def search(case: Case, profile: Profile, width: float = _WIDTH, elastic: bool = False) -> Found:
    """Halve the range between a value that stands and one that falls until it is `width` of the reference wide."""
    begun = time.process_time()
    # a search that ends at one of these is outside the band
    ends = 0.98 * case.low, 1.02 * case.high
    stood, fell = ends[::-1] if case.stands_above else ends
    holds = undecided = unsolved = 0
    while abs(fell - stood) > width * case.reference:
        value = 0.5 * (stood + fell)
        outcome, left = hold(case, value, profile, elastic)
        holds, undecided = holds + 1, undecided + (outcome is Outcome.MOVING)
        if outcome is Outcome.EQUILIBRIUM:
            stood, unsolved = value, unsolved + left
        else:
            fell = value
    return Found(stood, fell, holds, undecided, unsolved, time.process_time() - begun)


def errors(records: Path | None = None) -> dict[str, float]:
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
                row = _row(case, profile, _WIDTH, elastic=False)
                if path is not None:
                    path.write_text(json.dumps(row), encoding="utf-8")
            largest[name] = max(largest[name], abs(row["error"]) + row["width"] / row["reference"])
    return largest


def hold(case: Case, value: float, profile: Profile, elastic: bool = False) -> tuple[Outcome, int]:
    """Whether the case stands at a value, all loads at once from rest, and how many steps were left unsolved."""
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
    if elastic and overlay.fidelity is not Fidelity.RIGID:
        scene = overlaid_scene(scene, replace(overlay, fidelity=Fidelity.DEFORMABLE))
    else:
        scene = overlaid_scene(scene, replace(overlay, fidelity=Fidelity.RIGID))
    result = simulate(scene)
    return result.outcome, result.errors.unconverged_steps


def _row(case: Case, profile: Profile, width: float, elastic: bool) -> Row:
    progress(f"{case.name}, {profile.name}")
    found = search(case, profile, width, elastic)
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
