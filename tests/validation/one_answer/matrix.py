"""Every scene at every setting gives one answer: run it as `python -m tests.validation.one_answer.matrix --help`."""

import argparse
import itertools
import sys
import time
from collections import Counter
from dataclasses import dataclass, replace

from ground.errors import MomaError
from mechanics.scene.scene import Method, Scene, Start
from mechanics.simulate import simulate
from pipelines.tuning.overlay import overlaid_scene
from pipelines.tuning.profiles import PROFILES
from tests.validation.one_answer.scenes import SCENES
from tests.validation.wild.matrix import Mark
from tests.validation.wild.scene_list import Truth, Wild

STEPS = (1e-3, 2e-3, 5e-3, 1e-2)
ANSWERS = {Truth.STANDS: ("equilibrium",), Truth.FALLS: ("collapsed", "moving", "settled")}
OPEN = ("moving", "undecided")
"""Verdicts that say of themselves that nothing is decided."""


@dataclass(frozen=True)
class Setting:
    """Settings of one run; a profile says nothing of its method and step."""

    profile: str
    method: str
    relaxation: bool
    static: bool
    step: float

    def __str__(self) -> str:
        halting = "relaxed" if self.relaxation else "plain"
        begin = "static" if self.static else "rest"
        return f"{self.profile}-{self.method}-{halting}-{begin}-{1e3 * self.step:g}ms"


SETTINGS = tuple(
    Setting(profile, method, *rest)
    for profile, method, *rest in itertools.product(
        PROFILES, map(str, Method), (False, True), (False, True), STEPS
    )
    # a method of its own is asked for without a profile's
    if method == "auto" or profile == "balanced"
)


def at(entry: Wild, setting: Setting) -> Scene:
    """The scene of an entry at a setting."""
    plain = entry.build()
    start = Start.EQUILIBRIUM if setting.static else Start.REST
    asked = replace(plain.time, relaxation=setting.relaxation, start=start)
    scene = overlaid_scene(replace(plain, time=asked), PROFILES[setting.profile].overlay(asked), frozenset())
    if setting.method != "auto":
        scene = replace(scene, solver=replace(scene.solver, method=Method(setting.method)))
    return replace(scene, name=entry.name, time=replace(scene.time, step=setting.step))


def answer(entry: Wild, setting: Setting) -> tuple[Mark, str]:
    """Whether a run gives the true answer, and what it says."""
    began = time.perf_counter()
    try:
        result = simulate(at(entry, setting))
    except MomaError as error:
        return Mark.REFUSED, f"refused: {error}"
    told = f"{result.outcome} after {result.time:.3g} s, {result.errors.unconverged_steps}/{result.steps} unsolved"
    told += f"; {result.reason}" * bool(result.reason) + "; ".join(("", *result.cautions))
    mark = Mark.RIGHT if result.outcome in ANSWERS[entry.truth] else Mark.WRONG
    if mark is Mark.WRONG and result.outcome in OPEN:
        mark = Mark.OPEN
    return mark, f"{time.perf_counter() - began:.1f} s, {told}"


def rotating() -> list[tuple[str, Setting]]:
    """One quick setting for each scene, each scene another."""
    quick = [one for one in SETTINGS if one.profile != "accurate" and one.step > STEPS[1]]
    return [(name, quick[(7 * k) % len(quick)]) for k, name in enumerate(SCENES)]


def main(arguments: list[str] | None = None) -> int:
    """Run a part of the matrix, print each answer that is not right, and count; 1 if there is one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="", help="only names that contain this")
    parser.add_argument(
        "--setting", default="", help="only settings that contain all these words, apart by blanks"
    )
    parser.add_argument("--quick", action="store_true", help="one setting for each scene")
    asked = parser.parse_args(arguments)
    cells = rotating() if asked.quick else itertools.product(SCENES, SETTINGS)
    words, count = asked.setting.split(), Counter[Mark]()
    for name, setting in cells:
        if asked.scene not in name or not all(word in str(setting).split("-") for word in words):
            continue
        mark, told = answer(SCENES[name], setting)
        count[mark] += 1
        if mark is not Mark.RIGHT:
            print(f"{name:32s} {SCENES[name].truth:7s} {setting!s:40s} {mark}: {told}", flush=True)
    print(", ".join(f"{number} {mark}" for mark, number in count.most_common()))
    return 1 if count[Mark.WRONG] else 0


if __name__ == "__main__":
    sys.exit(main())
