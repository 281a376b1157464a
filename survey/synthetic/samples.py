"""Synthetic surveys to start from, by name, each with its truth."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from survey.arrays import Array
from survey.records.survey import SolidRecord, Survey
from survey.synthetic.building import Building
from survey.synthetic.buildings.facings import two_facings
from survey.synthetic.buildings.openings import Arch
from survey.synthetic.buildings.quoins import corner
from survey.synthetic.buildings.ribs import WEBS, rib_vault
from survey.synthetic.buildings.tower import tower_storey
from survey.synthetic.buildings.vaults import barrel_vault, semicircular_arch
from survey.synthetic.buildings.walls import wall
from survey.synthetic.frame import Movement, wall_frame
from survey.synthetic.window_bay.sample import make_sample, truth_text

__all__ = ["SAMPLES", "Cause", "Sample", "SampleRecipe", "Site"]


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
class Site:
    """A building at the time of its movement, with what may have moved it.

    Attributes
    ----------
    building : measured
    settled : by code of a stone on the ground its share of the settlement of the left corner, which is the cause [-]
    rival : the same of the right corner, which did not settle; empty if that is not suspected
    facing : (3,) direction in which the front faces, the axis of a tilt to the left or right [-]
    pushed : by query expression the direction (3,) in which the thrust of a vault may have pushed stones; empty if
        there is no vault
    level_break : last course of the first phase of a building that stood as a whole; None: it has one phase
    """

    building: Building
    settled: Mapping[str, float]
    rival: Mapping[str, float]
    facing: Array
    pushed: Mapping[str, Array] = field(default_factory=dict)
    level_break: int | None = None


@dataclass(frozen=True)
class Cause:
    """Settlement of the left corner, and the building that it moves.

    Attributes
    ----------
    settlement : the largest, downwards [m]
    build : the building after a movement; the same is measured again with the seed that may be given
    duration : of the settlement in the scene [s]
    step : of the scene [s]
    stood : last course that stood when the ground settled; those above were laid later, level, in a phase of their
        own; None: all stood
    true_duration, true_step : of the simulation of the truth [s]
    """

    settlement: float
    build: Callable[[Movement, int | None], Site]
    duration: float = 1.0
    step: float = 0.005
    stood: int | None = None
    battered: bool = True
    true_duration: float = 1.0
    true_step: float = 0.005

    def heights(self, site: Site) -> dict[str, float]:
        """Return by code of a stone on the ground its displacement upwards [m]."""
        return {code: round(-self.settlement * share, 6) for code, share in site.settled.items()}

    def sample(self, movement: Movement) -> Sample:
        """Return the sample after a movement, the truth with the causes."""
        site = self.build(movement, None)
        last = self.stood or site.level_break
        knowledge = "" if last is None else _PHASES.format(last=last)
        return Sample(site.building.survey, _truth_of(site.building, self.heights(site)), knowledge)

    def unmoved(self) -> Sample:
        """Return the sample as it was laid."""
        return self.sample({})


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


def _tower(courses: int) -> Callable[[], Sample]:
    """Return the generator of a storey of the tower."""

    def make() -> Sample:
        storey = tower_storey(courses)
        knowledge = _PHASES.format(last=storey.level_break)
        return Sample(storey.building.survey, _truth_of(storey.building), knowledge)

    return make


_PHASES = """\
# What is "known" of the synthetic building besides its geometry; as invented as the building.

[record]
author = "synthetic"
source = "invented for this sample"

[[phase]]
name = "1"
description = "up to the level break"

[[phase]]
name = "2"
description = "from the levelling course on, with lower courses"

[[of_phase]]
phase = "1"
stones = ["course <= {last}"]

[[of_phase]]
phase = "2"
stones = ["course > {last}"]
text = "another height of the courses, above one that levels them"
"""


def _rib_vault() -> Sample:
    vault = rib_vault()
    axes = {f"R{rib}": (np.round(vault.rib_axis(rib, 3), 6) + 0.0).tolist() for rib in range(1, 5)}
    parts = [
        _PART.format(kind="web", code=web, title=f"Web {web}", stones=f"zone = 'web {web}'", ordered="false")
        for web in WEBS
    ]
    count = vault.shape.segments
    for code, (up, down) in {"D1": (1, 3), "D2": (2, 4)}.items():
        row = [f"T{up}", *(f"R{up}-{k:02d}" for k in range(1, count + 1)), "B"]
        row += [*(f"R{down}-{k:02d}" for k in range(count, 0, -1)), f"T{down}"]
        title = f"Diagonal rib from T{up} to T{down}"
        parts.append(
            _PART.format(kind="rib", code=code, title=title, stones='", "'.join(row), ordered="true")
        )
    truth = _truth_of(vault.building, axes=axes)
    return Sample(vault.building.survey, truth, _VAULT + "".join(parts), vault.modelled)


_VAULT = """\
# What is "known" of the synthetic rib vault besides its geometry; as invented as the vault.

[record]
author = "synthetic"
source = "invented for this sample"

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
    settlement: Mapping[str, float] = MappingProxyType({}),
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
    cause = f'"settlement": {json.dumps(dict(settlement))},\n' if settlement else ""
    curves = f'"axes": {json.dumps(dict(axes))},\n' if axes else ""
    return f'{{\n"about": {about},\n{cause}{curves}"stones": [\n{lines}\n]\n}}\n'


def _motion_of(building: Building, code: str) -> dict[str, object]:
    """Return the motion x → rotation x + shift of a stone since it was laid, if it has moved."""
    motion = building.movement.get(code)
    if motion is None:
        return {}
    return {name: (np.round(getattr(motion, name), 9) + 0.0).tolist() for name in ("rotation", "shift")}


def _moved_wall(stones: int, shares: Sequence[float]) -> Callable[[Movement, int | None], Site]:
    """Return the generator of a wall that has moved, with shares of the settlement from its corner inwards."""

    def build(movement: Movement, measured: int | None) -> Site:
        built = wall(stones, movement=movement, measured=measured)
        settled, rival = (dict(zip(codes, shares, strict=False)) for codes in (built.base, built.base[::-1]))
        return Site(built, settled, rival, wall_frame().axes[2])

    return build


def _moved_tower(courses: int) -> Callable[[Movement, int | None], Site]:
    """Return the generator of a storey of the tower that has moved."""

    def build(movement: Movement, measured: int | None) -> Site:
        storey = tower_storey(courses, movement=movement, measured=measured)
        # through stones below the uppermost courses, which alone tie the facings
        tied = f"depth > {_TIED} and course > {round(_HEADS * courses)}"
        pushed = {f"zone = '{letter} outer' and {tied}": storey.outward[letter] for letter in "BC"}
        laid = tower_storey(courses) if movement else storey
        settled = _around(laid.building, storey.corners[0])
        return Site(storey.building, settled, {}, storey.outward["A"], pushed, storey.level_break)

    return build


def _around(building: Building, corner: Array) -> dict[str, float]:
    """Return shares of a settlement that falls off linearly from a corner of a building."""
    solids = {solid.code: solid for solid in building.solids}
    shares = {}
    for code in building.base:
        apart = solids[code].vertices.mean(axis=0) - corner
        share = 1.0 - math.hypot(apart[0], apart[1]) / _REACH
        if share > 0.0:
            shares[code] = round(share, 3)
    return shares


_REACH = 2.5  # distance from the corner of the tower at which its settlement ends [m]
_HEADS = 0.75  # share of the courses of the tower below the heads of its walls
_TIED = 1.0  # depth beyond which a stone goes through the wall [m]

_SETTLED = Cause(0.030, _moved_wall(90, (1.0, 2.0 / 3.0, 1.0 / 3.0)))
_SETTLED_SMALL = Cause(0.030, _moved_wall(30, (1.0, 0.5)), 0.5, 0.02)
_SETTLED_PHASES = Cause(0.020, _moved_wall(42, (1.0, 0.5)), 0.5, 0.02, stood=3)


_TOWER_SETTLED, _TOWER_SMALL_SETTLED = (
    Cause(0.030, _moved_tower(courses), 0.2, 0.05, battered=False, true_duration=0.2, true_step=0.025)
    for courses in (40, 12)
)

SAMPLES: Mapping[str, SampleRecipe] = MappingProxyType(
    {
        "arch": SampleRecipe("Semicircular arch", "kind = springer", _of(semicircular_arch)),
        "corner": SampleRecipe("Corner of two walls, bonded by quoins", "course = 1", _of(corner)),
        "facings": SampleRecipe(
            "Wall of two facings with a core",
            "course = 1",
            _of(lambda: two_facings(4.0, 8).building),
            core=True,
        ),
        "ribvault": SampleRecipe("Rib vault", "kind = rib_springer", _rib_vault),
        "settled": SampleRecipe(
            "Wall whose left corner settled", "course = 1", _SETTLED.unmoved, cause=_SETTLED
        ),
        "settled-phases": SampleRecipe(
            "Wall whose left corner settled before its upper courses were laid",
            "course = 1",
            _SETTLED_PHASES.unmoved,
            cause=_SETTLED_PHASES,
        ),
        "settled-small": SampleRecipe(
            "Small wall whose left corner settled", "course = 1", _SETTLED_SMALL.unmoved, cause=_SETTLED_SMALL
        ),
        "tower": SampleRecipe("Storey of a tower", "course = 1", _tower(40), core=True),
        "tower-settled": SampleRecipe(
            "Storey of a tower whose left corner settled",
            "course = 1",
            _TOWER_SETTLED.unmoved,
            cause=_TOWER_SETTLED,
        ),
        "tower-settled-small": SampleRecipe(
            "Storey of a tower, of twelve courses, whose left corner settled",
            "course = 1",
            _TOWER_SMALL_SETTLED.unmoved,
            cause=_TOWER_SMALL_SETTLED,
        ),
        "tower-small": SampleRecipe(
            "Storey of a tower, of twelve courses", "course = 1", _tower(12), core=True
        ),
        "vault": SampleRecipe("Barrel vault", "kind = springer", _of(lambda: barrel_vault(seed=2))),
        "wall": SampleRecipe(
            "Wall with an arched opening", "course = 1", _of(lambda: wall(80, arch=Arch.SEGMENTAL))
        ),
        "window": SampleRecipe("Window bay", "course = 1", _window),
    }
)
"""All samples by name."""
