"""The matrix of wild scenes and settings: run it as `python -m tests.validation.wild.matrix --help`."""

import argparse
import itertools
import sys
import time
import traceback
from collections import Counter
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from ground.errors import MomaError
from mechanics.scene.scene import Scene, Start
from mechanics.simulate import simulate
from pipelines.tuning.overlay import overlaid_scene
from pipelines.tuning.profiles import PROFILES
from tests.validation.wild import driven, imperfect, limits, motions, sizes, supports  # noqa: F401 they enter scenes
from tests.validation.wild.scene_list import SCENES, Truth, Wild

STEPS = (1e-3, 2e-3, 5e-3)
MUCH = 0.5  # displacement over the smallest width of a stone that a verdict of rest must not conceal [-]


class Mark(StrEnum):
    """A verdict against the truth."""

    RIGHT = "right"
    OPEN = "open"  # still moving as the duration ends, where the truth is rest or fall
    UNDECIDED = "undecided"
    REFUSED = "refused"
    SILENT = "no caution"  # rest, after a move or a failed static start that no caution tells
    WRONG = "WRONG"


@dataclass(frozen=True)
class Setting:
    """Settings of one run; the step is multiplied by the scene's pace."""

    profile: str
    relaxation: bool
    static: bool
    step: float

    def __str__(self) -> str:
        halting = "relaxed" if self.relaxation else "plain"
        return f"{self.profile}-{halting}-{'static' if self.static else 'rest'}-{1e3 * self.step:g}ms"


@dataclass(frozen=True)
class Run:
    """One cell of the matrix."""

    scene: str
    setting: Setting
    truth: Truth
    outcome: str
    mark: Mark
    seconds: float
    note: str


SETTINGS = tuple(
    Setting(*values) for values in itertools.product(PROFILES, (False, True), (False, True), STEPS)
)


def at(entry: Wild, setting: Setting) -> Scene:
    """The scene of an entry at a setting."""
    plain = entry.build()
    asked = replace(
        plain.time, relaxation=setting.relaxation, start=Start.EQUILIBRIUM if setting.static else Start.REST
    )
    # forces act on rigid stones
    pushed = frozenset[str]().union(*(force.stones for force in plain.loads.forces))
    scene = overlaid_scene(replace(plain, time=asked), PROFILES[setting.profile].overlay(asked), pushed)
    return replace(scene, name=entry.name, time=replace(scene.time, step=entry.pace * setting.step))


def judged(truth: Truth, outcome: str) -> Mark:
    """Hold a verdict against the truth."""
    if outcome in ("undecided", "interrupted"):
        return Mark.UNDECIDED
    right = {
        Truth.STANDS: ("equilibrium",),
        Truth.RESTS: ("equilibrium", "settled"),
        Truth.FALLS: ("collapsed",),
        Truth.SLIDES: ("moving", "collapsed"),
    }[truth]
    if outcome in right:
        return Mark.RIGHT
    return Mark.OPEN if outcome == "moving" else Mark.WRONG


def run(name: str, setting: Setting) -> Run:
    """Simulate one scene at one setting, and judge it."""
    entry, began = SCENES[name], time.perf_counter()
    try:
        result = simulate(at(entry, setting))
    except MomaError as error:
        return Run(name, setting, entry.truth, "-", Mark.REFUSED, time.perf_counter() - began, str(error))
    mark = judged(entry.truth, result.outcome.value)
    # supports that move take stones along
    still = not result.scene.loads.motions
    ratios = [
        float(np.linalg.norm(b.displacement, axis=1).max() / np.ptp(b.reference, axis=0).min())
        for b in result.bodies
    ]
    moved = max(ratios) if still else 0.0
    unfound = result.static is not None and not result.static.found
    if (
        mark is Mark.RIGHT
        and entry.truth in (Truth.STANDS, Truth.RESTS)
        and (moved > MUCH or unfound)
        and not (result.cautions or result.reason)
    ):
        mark = Mark.SILENT
    note = f"t = {result.time:.3g} s, {result.errors.unconverged_steps}/{result.steps} unsolved, moved {moved:.2g}"
    note += ", static start not found" * unfound + f"; {result.reason}" * bool(result.reason)
    return Run(name, setting, entry.truth, result.outcome.value, mark, time.perf_counter() - began, note)


def line(cell: Run) -> str:
    """A row of the table."""
    return (
        f"{cell.scene:38s} {cell.setting!s:32s} {cell.truth:7s} {cell.outcome:12s} {cell.mark:10s}"
        f" {cell.seconds:7.1f} s  {cell.note}"
    )


def rotating(names) -> list[tuple[str, Setting]]:
    """One quick setting for each scene, each scene another."""
    quick = [one for one in SETTINGS if one.profile != "accurate" and one.step > STEPS[0]]
    return [(name, quick[(5 * k) % len(quick)]) for k, name in enumerate(names)]


def main(arguments: list[str] | None = None) -> int:
    """Run a part of the matrix, print a row for each cell and their count; 1 if a verdict is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="", help="only names that contain this")
    parser.add_argument(
        "--setting", default="", help="only settings that contain all these words, apart by blanks"
    )
    parser.add_argument("--quick", action="store_true", help="one setting for each scene")
    parser.add_argument("--bad", action="store_true", help="print no right cells")
    asked = parser.parse_args(arguments)
    names = [name for name in SCENES if asked.scene in name]
    cells = rotating(SCENES) if asked.quick else itertools.product(SCENES, SETTINGS)
    words, count = asked.setting.split(), Counter[Mark]()
    for name, setting in cells:
        if name not in names or not all(word in str(setting).split("-") for word in words):
            continue
        try:
            cell = run(name, setting)
        except Exception:
            traceback.print_exc()
            count[Mark.WRONG] += 1
            print(f"{name} {setting}: a traceback", flush=True)
            continue
        count[cell.mark] += 1
        if not (asked.bad and cell.mark is Mark.RIGHT):
            print(line(cell), flush=True)
    print(", ".join(f"{number} {mark}" for mark, number in count.most_common()))
    return 1 if count[Mark.WRONG] else 0


if __name__ == "__main__":
    sys.exit(main())
