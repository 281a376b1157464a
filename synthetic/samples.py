"""Synthetic surveys to start from, by name and options, each with its truth."""

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ground.errors import UsageError
from mechanics.dynamics.progress import Listener, silent
from survey.records.survey import SolidRecord, Survey
from synthetic.building import SyntheticBuilding
from synthetic.buildings.block import block_on_ground
from synthetic.buildings.facings import two_facings
from synthetic.buildings.openings import ArchShape
from synthetic.buildings.quoins import corner
from synthetic.buildings.ribs import WALL_RIB, WEBS, RibVaultShape, rib_vault
from synthetic.buildings.storey_vault import STANDING
from synthetic.buildings.tower import tower_storey
from synthetic.buildings.vaults import barrel_vault, semicircular_arch
from synthetic.buildings.walls import wall
from synthetic.buildings.window import make_window, truth_text
from synthetic.causes import (
    CORE_SUNK,
    PUSHED,
    SETTLED,
    SETTLED_PHASES,
    SETTLED_SMALL,
    SHAKEN,
    Cause,
    tower_settled,
)
from synthetic.granite_wall import GRANITE_WALL
from synthetic.rubble_wall import RUBBLE_WALL
from synthetic.scan import Scan, scan_window
from synthetic.true_movement import true_movement

_COURSES = 40  # of the tower
_SMALL = 12  # courses of the small one
_MIN_COURSES = 2  # courses that a tower may have


@dataclass(frozen=True)
class Sample:
    """A synthetic survey and what is true of it.

    Attributes
    ----------
    survey : as a surveyor would hand it in
    truth : JSON text: the true geometry of every stone
    knowledge : TOML text: what is known besides the geometry; empty if nothing
    modelled : stones that are not in the survey, as closed solids
    scan : a scan of the same stones, with drawn outlines
    """

    survey: Survey
    truth: str
    knowledge: str = ""
    modelled: tuple[SolidRecord, ...] = ()
    scan: Scan | None = None


@dataclass(frozen=True)
class Recipe:
    """A kind of sample.

    Attributes
    ----------
    title : in words
    fixed : query expression of the stones that stand on the ground
    make : the generator, told of every step of a simulation; the sample is the same each time
    core : whether a core between two facings has to be proposed before the scene is run
    cause : of the movement of a building that has moved
    scan : whether it comes with a scan
    """

    title: str
    fixed: str
    make: Callable[[Listener], Sample]
    core: bool = False
    cause: Cause | None = None
    scan: bool = False


def recipe_of(
    kind: str,
    *,
    moved: str | None = None,
    small: bool = False,
    phases: bool = False,
    scan: bool = False,
    courses: int | None = None,
) -> Recipe:
    """Look up a sample.

    Parameters
    ----------
    kind : name of the building
    moved : cause of its movement; None: it stands as built
    small : a smaller building, plainer
    phases : its upper courses were laid after it moved
    scan : it was scanned too, and outlines were drawn
    courses : number of courses of the tower; None: 40, or 12 of a small one

    Raises
    ------
    UsageError
        if there is no such sample
    """
    options = [f"--moved {moved}"] * (moved is not None) + ["--small"] * small + ["--phases"] * phases
    options += ["--scan"] * scan
    name = " ".join([kind, *options])
    if kind not in SAMPLES:
        kinds = [*(sample for sample in SAMPLES if " " not in sample), RUBBLE_WALL, GRANITE_WALL]
        raise UsageError(f"no sample {kind!r}", remedy=f"the samples are {', '.join(kinds)}")
    if name not in SAMPLES:
        known = [f"'{sample}'" for sample in SAMPLES if sample.split()[0] == kind]
        raise UsageError(f"no sample {name!r}", remedy=f"there is {', '.join(known)}")
    if courses is None:
        return SAMPLES[name]
    if kind != "tower":
        raise UsageError(f"--courses with the sample {kind!r}", remedy="it is for the tower")
    if courses < _MIN_COURSES:
        raise UsageError(f"a tower of {courses} courses", remedy=f"give at least {_MIN_COURSES}")
    return _tower_settled(courses) if moved else _tower(courses, elaborate=not small)


def _places(building: SyntheticBuilding) -> Iterator[str]:
    """Yield corrections that give modelled stones of the walls their zones and courses, which files of solids lack."""
    rows: dict[tuple[str, int], list[str]] = {}
    for block in building.modelled:
        if block.course is None:
            continue
        rows.setdefault((f"{block.code[0]} inner", block.course), []).append(block.code)
    for (zone, course), codes in rows.items():
        yield _PLACE.format(stones='", "'.join(codes), zone=zone, course=course)


_PLACE = """
[[correction]]
stones = ["{stones}"]
set = {{ zone = "{zone}", course = {course} }}
reason = "the file of solids has neither zones nor courses"
"""
_KNOWLEDGE = """\
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


def _window() -> Sample:
    sample = make_window()
    return Sample(sample.survey, truth_text(sample))


def _scanned_window() -> Sample:
    sample = make_window()
    return Sample(sample.survey, truth_text(sample), scan=scan_window(sample))


def _rib_vault() -> Sample:
    vault = rib_vault(RibVaultShape(wall_rib=WALL_RIB))
    axes = {f"R{rib}": (np.round(vault.rib_axis(rib, 3), 6) + 0.0).tolist() for rib in range(1, 5)}
    truth = _truth_of(vault.building, axes=axes)
    knowledge = _KNOWLEDGE.format(what="rib vault") + _structures(vault.shape)
    return Sample(vault.building.survey, truth, knowledge, vault.building.modelled)


def _structures(shape: RibVaultShape) -> str:
    """Return what belongs to which web and rib of a vault with wall ribs."""
    count = shape.segments
    parts = [
        _STRUCTURE.format(
            kind="web", code=web, title=f"Web {web}", stones=f"zone = 'web {web}'", ordered="false"
        )
        for web in WEBS
    ]
    for code, (up, down) in {"D1": (1, 3), "D2": (2, 4)}.items():
        row = [f"T{up}", *(f"R{up}-{k:02d}" for k in range(1, count + 1)), "B"]
        row += [*(f"R{down}-{k:02d}" for k in range(count, 0, -1)), f"T{down}"]
        title = f"Diagonal rib from T{up} to T{down}"
        parts.append(
            _STRUCTURE.format(kind="rib", code=code, title=title, stones='", "'.join(row), ordered="true")
        )
    for web in WEBS:
        row = [f"F{web}-{k:02d}" for k in range(1, 2 * count + 2)]
        parts.append(
            _STRUCTURE.format(
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

_STRUCTURE = """
[[structure]]
kind = "{kind}"
code = "{code}"
title = "{title}"
parent = "VAULT"
stones = ["{stones}"]
ordered = {ordered}
"""


def _truth_of(
    building: SyntheticBuilding,
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


def _motion_of(building: SyntheticBuilding, code: str) -> dict[str, object]:
    """Return the motion x → rotation x + shift of a stone since it was laid, if it has moved."""
    motion = building.movement.get(code)
    if motion is None:
        return {}
    return {name: (np.round(getattr(motion, name), 9) + 0.0).tolist() for name in ("rotation", "shift")}


def _built(title: str, fixed: str, build: Callable[[], SyntheticBuilding], core: bool = False) -> Recipe:
    """Return the recipe of a building as it was laid."""

    def make(progress: Listener = silent) -> Sample:
        building = build()
        return Sample(building.survey, _truth_of(building))

    return Recipe(title, fixed, make, core)


def _tower(courses: int, elaborate: bool) -> Recipe:
    """Return the recipe of a storey of the tower."""

    def make(progress: Listener = silent) -> Sample:
        storey = tower_storey(courses, elaborate=elaborate)
        building, vault = storey.building, storey.vault
        phases = _PHASES.format(last=storey.level_break, walls="" if vault is None else _NOT_WEBS)
        knowledge = _KNOWLEDGE.format(what="building") + phases + "".join(_places(building))
        if vault is not None:
            knowledge += _OF_VAULT + _structures(vault)
        return Sample(building.survey, _truth_of(building), knowledge, building.modelled)

    fixed = (
        f"course = 1 and kind != web_stone or code in ({', '.join(STANDING)})" if elaborate else "course = 1"
    )
    return Recipe(_storey(courses), fixed, make, core=True)


def _tower_settled(courses: int) -> Recipe:
    title = f"{_storey(courses)}{',' if courses != _COURSES else ''} whose left corner settled"
    return _moved(title, tower_settled(courses))


def _storey(courses: int) -> str:
    return "Storey of a tower" + (f", of {courses} courses" if courses != _COURSES else "")


def _moved(title: str, cause: Cause, fixed: str = "course = 1", core: bool = False) -> Recipe:
    """Return the recipe of a building that has moved, the truth with its causes."""

    def make(progress: Listener = silent) -> Sample:
        site = cause.build(true_movement(cause, progress), None)
        last = cause.stood or site.level_break
        knowledge = ""
        if last is not None:
            knowledge = _KNOWLEDGE.format(what="building") + _PHASES.format(last=last, walls="")
        causes = {"settlement": cause.heights(site), "forces": cause.forces(site), "jerk": cause.jerk(site)}
        return Sample(site.building.survey, _truth_of(site.building, causes), knowledge)

    return Recipe(title, fixed, make, core, cause)


SAMPLES: Mapping[str, Recipe] = MappingProxyType(
    {
        "arch": _built("Semicircular arch", "kind = springer", semicircular_arch),
        "block": _built("Block on the ground", "course = 1", block_on_ground),
        "corner": _built("Corner of two walls, bonded by quoins", "course = 1", corner),
        "facings": _built(
            "Wall of two facings with a core", "course = 1", lambda: two_facings(4.0, 8).building, core=True
        ),
        "facings --moved settlement": _moved(
            "Small wall whose core decayed and sank", CORE_SUNK, "course <= 3", core=True
        ),
        "ribvault": Recipe("Rib vault", "kind = rib_springer", lambda _: _rib_vault()),
        "tower": _tower(_COURSES, elaborate=True),
        "tower --small": _tower(_SMALL, elaborate=False),
        "tower --moved settlement": _tower_settled(_COURSES),
        "tower --moved settlement --small": _tower_settled(_SMALL),
        "vault": _built("Barrel vault", "kind = springer", lambda: barrel_vault(seed=2)),
        "wall": _built(
            "Wall with an arched opening", "course = 1", lambda: wall(80, arch=ArchShape.SEGMENTAL)
        ),
        "wall --moved settlement": _moved("Wall whose left corner settled", SETTLED),
        "wall --moved settlement --small": _moved("Small wall whose left corner settled", SETTLED_SMALL),
        "wall --moved settlement --phases": _moved(
            "Wall whose left corner settled before its upper courses were laid", SETTLED_PHASES
        ),
        "wall --moved thrust": _moved("Wall that the thrust of a vault has pushed out", PUSHED),
        "wall --moved earthquake": _moved("Small wall shaken by an earthquake pulse", SHAKEN),
        "window": Recipe("Window bay", "course = 1", lambda _: _window()),
        "window --scan": Recipe("Window bay", "course = 1", lambda _: _scanned_window(), scan=True),
    }
)
"""All samples by what is written after `moma sample`."""
