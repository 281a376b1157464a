"""Synthetic surveys to start from, by name, each with its truth."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from survey.records.survey import SolidRecord, Survey
from survey.synthetic.building import Building
from survey.synthetic.buildings.facings import two_facings
from survey.synthetic.buildings.openings import Arch
from survey.synthetic.buildings.quoins import corner
from survey.synthetic.buildings.ribs import WALL_RIB, WEBS, RibVaultShape, rib_vault
from survey.synthetic.buildings.storey_vault import STANDING
from survey.synthetic.buildings.tower import tower_storey
from survey.synthetic.buildings.vaults import barrel_vault, semicircular_arch
from survey.synthetic.buildings.walls import wall
from survey.synthetic.causes import (
    CORE_SUNK,
    PUSHED,
    SETTLED,
    SETTLED_PHASES,
    SETTLED_SMALL,
    SHAKEN,
    TOWER_SETTLED,
    TOWER_SMALL_SETTLED,
    Cause,
)
from survey.synthetic.frame import Movement
from survey.synthetic.window_bay.sample import make_sample, truth_text

__all__ = ["SAMPLES", "Sample", "SampleRecipe", "moved_sample", "storey_recipe"]


@dataclass(frozen=True)
class Sample:
    """A synthetic survey and what is true of it.

    Attributes
    ----------
    survey : as a surveyor would hand it in
    truth : JSON text: the true geometry of every stone
    knowledge : TOML text: what is known besides the geometry; empty if nothing
    modelled : stones that are not in the survey, as closed solids
    """

    survey: Survey
    truth: str
    knowledge: str = ""
    modelled: tuple[SolidRecord, ...] = ()


@dataclass(frozen=True)
class SampleRecipe:
    """A kind of sample.

    Attributes
    ----------
    title : in words
    fixed : query expression of the stones that stand on the ground
    make : the generator; the sample is the same each time
    core : whether a core between two facings has to be proposed before the scene is run
    cause : of the movement of a building that has moved
    """

    title: str
    fixed: str
    make: Callable[[], Sample]
    core: bool = False
    cause: Cause | None = None


def _of(build: Callable[[], Building]) -> Callable[[], Sample]:
    """Return the generator of a sample that is a building."""

    def make() -> Sample:
        building = build()
        return Sample(building.survey, _truth_of(building))

    return make


def _window() -> Sample:
    sample = make_sample()
    return Sample(sample.survey, truth_text(sample))


def _tower(courses: int, elaborate: bool) -> Callable[[], Sample]:
    """Return the generator of a storey of the tower."""

    def make() -> Sample:
        storey = tower_storey(courses, elaborate=elaborate)
        building = storey.building
        vault = storey.vault
        phases = _PHASES.format(last=storey.level_break, walls="" if vault is None else _NOT_WEBS)
        knowledge = _KNOWN.format(what="building") + phases + "".join(_places(building))
        if vault is not None:
            knowledge += _OF_VAULT + _structures(vault)
        return Sample(building.survey, _truth_of(building), knowledge, building.modelled)

    return make


def _places(building: Building) -> Iterator[str]:
    """Yield corrections that give modelled stones of the walls their zones and courses, which files of solids lack."""
    rows: dict[tuple[str, int], list[str]] = {}
    for one in building.modelled:
        if one.course is None:
            continue
        rows.setdefault((f"{one.code[0]} inner", one.course), []).append(one.code)
    for (zone, course), codes in rows.items():
        yield _PLACE.format(stones='", "'.join(codes), zone=zone, course=course)


_PLACE = """
[[correction]]
stones = ["{stones}"]
set = {{ zone = "{zone}", course = {course} }}
reason = "the file of solids has neither zones nor courses"
"""
_KNOWN = """\
# What is "known" of the synthetic {what} besides its geometry; as invented as the {what}.

[record]
author = "synthetic"
source = "invented for this sample"
"""
_PHASES = """
[[phase]]
name = "1"
description = "up to the level break"

[[phase]]
name = "2"
description = "from the levelling course on, with lower courses"

[[of_phase]]
phase = "1"
stones = ["course <= {last}{walls}"]

[[of_phase]]
phase = "2"
stones = ["course > {last}{walls}"]
text = "another height of the courses, above one that levels them"
"""
_NOT_WEBS = " and kind != web_stone"  # courses of webs are numbered from their springers
_OF_VAULT = """
[[correction]]
stones = ["is_a(rib_segment)"]
set = { zone = "vault" }
reason = "the file of solids has no zones"

[[of_phase]]
phase = "2"
stones = ["is_a(rib_segment) or kind = web_stone"]
text = "the rib vault, after the walls"
"""


def _rib_vault() -> Sample:
    vault = rib_vault(RibVaultShape(wall_rib=WALL_RIB))
    axes = {f"R{rib}": (np.round(vault.rib_axis(rib, 3), 6) + 0.0).tolist() for rib in range(1, 5)}
    truth = _truth_of(vault.building, axes=axes)
    knowledge = _KNOWN.format(what="rib vault") + _structures(vault.shape)
    return Sample(vault.building.survey, truth, knowledge, vault.building.modelled)


def _structures(shape: RibVaultShape) -> str:
    """Return what belongs to which web and rib of a vault with wall ribs."""
    count = shape.segments
    parts = [
        _PART.format(kind="web", code=web, title=f"Web {web}", stones=f"zone = 'web {web}'", ordered="false")
        for web in WEBS
    ]
    for code, (up, down) in {"D1": (1, 3), "D2": (2, 4)}.items():
        row = [f"T{up}", *(f"R{up}-{k:02d}" for k in range(1, count + 1)), "B"]
        row += [*(f"R{down}-{k:02d}" for k in range(count, 0, -1)), f"T{down}"]
        title = f"Diagonal rib from T{up} to T{down}"
        parts.append(
            _PART.format(kind="rib", code=code, title=title, stones='", "'.join(row), ordered="true")
        )
    for web in WEBS:
        row = [f"F{web}-{k:02d}" for k in range(1, 2 * count + 2)]
        parts.append(
            _PART.format(
                kind="wall_rib",
                code=f"F{web}",
                title=f"Wall rib of the web {web}",
                stones='", "'.join(row),
                ordered="true",
            )
        )
    return _VAULT + "".join(parts)


_VAULT = """
[[kind]]
name = "wall_rib"
parent = "rib"
definition = "A rib where a web meets a wall: formeret."

[[structure]]
kind = "rib_vault"
code = "VAULT"
title = "Rib vault"
"""

_PART = """
[[structure]]
kind = "{kind}"
code = "{code}"
title = "{title}"
parent = "VAULT"
stones = ["{stones}"]
ordered = {ordered}
"""


def _truth_of(
    building: Building,
    causes: Mapping[str, object] = MappingProxyType({}),
    axes: Mapping[str, object] = MappingProxyType({}),
) -> str:
    """Return the true stones of a building, one to a line, with what has moved them and how, and the axes of ribs."""
    stones = [
        {
            "code": solid.code,
            "vertices": (np.round(solid.vertices, 6) + 0.0).tolist(),
            "faces": [list(face) for face in solid.faces],
            **_motion_of(building, solid.code),
        }
        for solid in building.solids
    ]
    lines = ",\n".join(json.dumps(stone) for stone in stones)
    about = json.dumps(f"true geometry of the synthetic survey {building.survey.head.path}; metres")
    cause = "".join(f'"{name}": {json.dumps(value)},\n' for name, value in causes.items() if value)
    curves = f'"axes": {json.dumps(dict(axes))},\n' if axes else ""
    return f'{{\n"about": {about},\n{cause}{curves}"stones": [\n{lines}\n]\n}}\n'


def _motion_of(building: Building, code: str) -> dict[str, object]:
    """Return the motion x → rotation x + shift of a stone since it was laid, if it has moved."""
    motion = building.movement.get(code)
    if motion is None:
        return {}
    return {name: (np.round(getattr(motion, name), 9) + 0.0).tolist() for name in ("rotation", "shift")}


def moved_sample(cause: Cause, movement: Movement) -> Sample:
    """Return the sample of a building after a movement, the truth with its causes."""
    site = cause.build(movement, None)
    last = cause.stood or site.level_break
    knowledge = ""
    if last is not None:
        knowledge = _KNOWN.format(what="building") + _PHASES.format(last=last, walls="")
    causes = {"settlement": cause.heights(site), "forces": cause.forces(site), "jerk": cause.jerk(site)}
    truth = _truth_of(site.building, causes)
    return Sample(site.building.survey, truth, knowledge)


def storey_recipe(courses: int, title: str, *, elaborate: bool = True) -> SampleRecipe:
    """Return the recipe of a storey of the tower, of any number of courses; see `tower_storey`."""
    fixed = (
        f"course = 1 and kind != web_stone or code in ({', '.join(STANDING)})" if elaborate else "course = 1"
    )
    return SampleRecipe(title, fixed, _tower(courses, elaborate), core=True)


def _moved(title: str, cause: Cause, fixed: str = "course = 1", core: bool = False) -> SampleRecipe:
    """Return the recipe of a building that has moved, which is made as it was laid."""
    return SampleRecipe(title, fixed, lambda: moved_sample(cause, {}), core, cause)


SAMPLES: Mapping[str, SampleRecipe] = MappingProxyType(
    {
        "arch": SampleRecipe("Semicircular arch", "kind = springer", _of(semicircular_arch)),
        "core-sunk": _moved("Small wall whose core decayed and sank", CORE_SUNK, "course <= 3", core=True),
        "corner": SampleRecipe("Corner of two walls, bonded by quoins", "course = 1", _of(corner)),
        "facings": SampleRecipe(
            "Wall of two facings with a core",
            "course = 1",
            _of(lambda: two_facings(4.0, 8).building),
            core=True,
        ),
        "pushed": _moved("Wall that the thrust of a vault has pushed out", PUSHED),
        "ribvault": SampleRecipe("Rib vault", "kind = rib_springer", _rib_vault),
        "settled": _moved("Wall whose left corner settled", SETTLED),
        "settled-phases": _moved(
            "Wall whose left corner settled before its upper courses were laid", SETTLED_PHASES
        ),
        "settled-small": _moved("Small wall whose left corner settled", SETTLED_SMALL),
        "shaken": _moved("Small wall shaken by an earthquake pulse", SHAKEN),
        "tower": storey_recipe(40, "Storey of a tower"),
        "tower-settled": _moved("Storey of a tower whose left corner settled", TOWER_SETTLED),
        "tower-settled-small": _moved(
            "Storey of a tower, of twelve courses, whose left corner settled", TOWER_SMALL_SETTLED
        ),
        "tower-small": storey_recipe(12, "Storey of a tower, of twelve courses", elaborate=False),
        "vault": SampleRecipe("Barrel vault", "kind = springer", _of(lambda: barrel_vault(seed=2))),
        "wall": SampleRecipe(
            "Wall with an arched opening", "course = 1", _of(lambda: wall(80, arch=Arch.SEGMENTAL))
        ),
        "window": SampleRecipe("Window bay", "course = 1", _window),
    }
)
"""All samples by name."""
