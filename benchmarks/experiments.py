"""Walls that laboratories broke beside what MOMA predicts: `python -m benchmarks.experiments [--data DIR] [--only …]`.

Nothing is fitted to a curve: geometry, load and material are as the papers state them, and what they do not state is
the same for all walls (`ASSUMED`). Masks and outlines of rubble walls belong to others, and are read from `--data`;
without them these walls are left out. `--figures DIR` draws each curve, the measured one beside it where its file is
in `curves`. `--write` puts the table into docs/accuracy.md.
"""

import json
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks.report import (
    ROOT,
    Row,
    columns,
    commit,
    guarded,
    machine,
    options_of,
    print_table,
    progress,
    show,
    table_lines,
    write_between,
)
from mechanics.limit.loading_test import LoadingTest, loading_test
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.rig import Head, Rig
from mechanics.scene.scene import ContactSettings, Fidelity, Placement, Scene
from mechanics.scene.shapes import bond, box, wall
from mechanics.stones.materials import Material
from pipelines.assess.pushover.measured import read_curve
from pipelines.assess.pushover.push import push
from pipelines.draw.loading import draw_curve, draw_pushed
from pipelines.ingest.ingest import ingest
from pipelines.ingest.outlined import mask_options
from survey.formats.options import ReadingOptions

__all__ = ["ASSUMED", "main"]

_DATA = ROOT.parent / "shared" / "data" / "experiments"
ASSUMED = {
    "shear over normal stiffness": 0.4,  # of joints and their stones: G/E at ν = 0.25
    "opening at which tension is lost": 1e-4,  # [m]
    "slip at which cohesion is lost": 4e-4,  # [m]
    "friction of dry granite": 0.65,
    "density of granite": 2600.0,  # [kg/m³]
    "distance of contact points": 0.05,  # [m], two or more across each joint
}
"""What the papers do not state."""

_PLACES = (0.002, 0.005, 0.01, 0.02, 0.03)  # displacements at which forces are compared [m]


@dataclass(frozen=True)
class Experiment:
    """A wall, what was measured of it, and how it is predicted.

    Attributes
    ----------
    test : name in its paper, with those of walls that were built and loaded alike
    source : paper
    measured : largest forces, forwards and backwards or of several walls [kN]
    stiffness : initial, as stated [kN/mm]; None: not stated
    forces : at 2, 5, 10, 20 and 30 mm [kN]; empty: not stated
    mechanism : as observed
    assumed : beyond `ASSUMED`
    predict : makes the predictions from the folder of the data and one for work: pushed forwards, and backwards
    curve : file of the measured curve
    """

    test: str
    source: str
    measured: tuple[float, ...]
    predict: Callable[[Path, Path], tuple[LoadingTest, ...]]
    mechanism: str
    stiffness: float | None = None
    forces: tuple[float, ...] = ()
    assumed: str = ""
    curve: str = ""


def _granite(
    load: float,
    stiffness: float,
    *,
    friction: float = ASSUMED["friction of dry granite"],
    spacing: float = ASSUMED["distance of contact points"],
    step: float | None = None,
) -> LoadingTest:
    """Predict the dry ashlar walls of Vasconcelos: 8 courses of 0.20 × 0.15 × 0.20 m in half-unit bond."""
    granite = Material("granite", ASSUMED["density of granite"], 20.2e9, 0.2)
    units = wall(bond(5, 8), 0.2, 0.15, 0.2, granite, slab=False)
    blocks = tuple(replace(unit, fidelity=Fidelity.RIGID) for unit in units)
    shear = ASSUMED["shear over normal stiffness"] * stiffness
    law = ElasticJoint(friction, stiffness, shear, compressive_strength=73e6)
    contact = ContactSettings(law, placement=Placement.AREA, spacing=spacing)
    rig = Rig((1.0, 0.0, 0.0), 1.325, load, Head.TURNS)
    return loading_test(Scene("granite wall", blocks, contact=contact), rig, (0.03,), step)


def _bricks(placement: Mapping[str, Any]) -> LoadingTest:
    """Predict the brick wall of Griffith et al., pushed at mid-height out of its plane: 18 courses, each one stone."""
    brick = Material("brick", 1800.0, 10e9, 0.2)
    courses = tuple(
        box(f"course {k + 1}", (0.0, 0.0, k * 1.5 / 18), (0.95, 0.11, (k + 1) * 1.5 / 18), brick)
        for k in range(18)
    )
    friction, stiffness = float(np.tan(np.radians(35.0))), 5e8
    law = ElasticJoint(friction, stiffness, ASSUMED["shear over normal stiffness"] * stiffness)
    scene = Scene("brick wall", courses, contact=ContactSettings(law, **placement))
    return loading_test(scene, Rig((0.0, 1.0, 0.0), 0.75, 0.0, Head.HELD), (0.0606,))


_RUBBLE = """
[scene]
name = "rubble wall"
[materials.stone]
density = 2600.0
young = 20.2e9
poisson = 0.2
[joints]
mode = "mortar"
mortar_density = 1800.0
[contact]
placement = "area"
spacing = {spacing}
[[laws]]
type = "elastic_joint"
friction = {friction}
mortar_young = {young}
mortar_poisson = 0.2
tension = {tension}
shear = {cohesion}
energy_tension = {energy_tension}
energy_shear = {energy_shear}
compressive_strength = {crushing}
[pushover]
height = {height}
load = {load}
head = "{head}"
to = [{to}]
step = {step}
"""


@dataclass(frozen=True)
class Rubble:
    """A rubble wall that is known by a mask or by outlines; called, it is predicted: its stones grow into their mortar.

    Attributes
    ----------
    file : of the mask or outlines
    size : of the wall, as `moma ingest` takes it
    friction, tension, cohesion : of the joints [-], [Pa]
    young : modulus of the mortar [Pa]
    crushing : pressure at which joints crush [Pa]
    height, load, head : of the rig [m], [N]
    to : displacement, forwards and backwards [m]
    """

    file: str
    size: str
    friction: float
    young: float
    tension: float
    cohesion: float
    crushing: float
    height: float
    load: float
    head: Head
    to: float

    def __call__(self, data: Path, folder: Path) -> tuple[LoadingTest, ...]:
        """Return the tests forwards and backwards."""
        url = f"sqlite:///{folder / 'wall.db'}"
        options = mask_options(ReadingOptions(), size=self.size, depth=0.2)
        ingest([data / self.file], url, "masks", options=options)
        return self._pushed(url, folder, self.to), self._pushed(url, folder, -self.to)

    def _pushed(self, url: str, folder: Path, to: float) -> LoadingTest:
        values = asdict(self) | {
            "to": to,
            "step": self.to / 150,
            "spacing": ASSUMED["distance of contact points"],
            "energy_tension": 0.5 * self.tension * ASSUMED["opening at which tension is lost"],
            "energy_shear": 0.5 * self.cohesion * ASSUMED["slip at which cohesion is lost"],
        }
        (folder / "wall.toml").write_text(_RUBBLE.format(**values), encoding="utf-8")
        return push(folder / "wall.toml", url, folder / "out").test


_THESIS = "Vasconcelos 2005, Experimental investigations on the mechanics of stone masonry"
_CYCLIC = "Vasconcelos & Lourenço 2009, 10.1061/(ASCE)ST.1943-541X.0000053"
_ALIKE = "pushed once each way, without cycles; crushing at the strength of the masonry"
_ROCKS = "rocks about the toe, one stepped crack"
# modulus of the mortar by difference, from those of masonry and stone, with two thirds of stone [Pa]
_MORTAR = 0.33 / (1 / 1.25e9 - 0.67 / 20.2e9)


def _rubble_granite(file: str, load: float) -> Rubble:
    """Return a wall of the second kind of Vasconcelos & Lourenço: granite rubble in weak mortar."""
    return Rubble(
        file,
        size="1.0x1.2",
        friction=0.7,
        young=_MORTAR,
        tension=0.1e6,
        cohesion=0.1e6,
        crushing=5.0e6,
        height=1.325,
        load=load,
        head=Head.TURNS,
        to=0.015,
    )


EXPERIMENTS = {
    "WS.40": Experiment(
        "WS.40",
        _THESIS,
        (16.3,),
        lambda data, folder: (_granite(40e3, 26.2e9),),
        _ROCKS,
        10.7,
        (11.0, 12.6, 14.5, 15.8, 16.0),
        "stiffness of joints as at 100 kN",
        "WS40_Vasconcelos2005.csv",
    ),
    "WS.100": Experiment(
        "WS.100",
        _THESIS,
        (37.0,),
        lambda data, folder: (_granite(100e3, 26.2e9),),
        _ROCKS,
        12.0,
        (20.8, 29.8, 33.1, 36.5, 36.8),
        "",
        "WS100_Vasconcelos2005.csv",
    ),
    "WS.250": Experiment(
        "WS.250",
        _THESIS,
        (85.9,),
        lambda data, folder: (_granite(250e3, 41.1e9),),
        _ROCKS,
        23.2,
        (35.5, 62.1, 77.3, 84.2, 85.6),
        "",
        "WS250_Vasconcelos2005.csv",
    ),
    "WS1-4.100": Experiment(
        "WS1 to WS4.100",
        _CYCLIC,
        (39.0, 37.8, 38.0, 36.0, -43.3, -40.9, -42.1, -40.1),
        lambda data, folder: (_granite(100e3, 26.2e9),),
        _ROCKS,
        assumed="pushed once, without cycles",
        curve="WS1100_Vasconcelos2009.csv",
    ),
    "WS1-3.250": Experiment(
        "WS1 to WS3.250",
        _CYCLIC,
        (88.7, 87.1, 86.5, -95.7, -94.7, -92.6),
        lambda data, folder: (_granite(250e3, 41.1e9),),
        _ROCKS + ", the toe crushes",
        assumed="pushed once, without cycles",
        curve="WS1250_Vasconcelos2009.csv",
    ),
    "SC1": Experiment(
        "SC1",
        "Godio et al. 2019, 10.1016/j.engstruct.2019.04.041",
        (74.0, -77.0),
        Rubble(
            file="sc1_outlines.json",
            size="0.9x0.9",
            friction=0.5,
            young=0.97e9,
            tension=0.57e6,
            cohesion=0.29e6,
            crushing=10.3e6,
            height=0.95,
            load=139e3,
            head=Head.GUIDED,
            to=0.008,
        ),
        "two crossing diagonal cracks",
        184.0,
        assumed=_ALIKE,
        curve="SC1_Godio2019.csv",
    ),
    "specimen 12": Experiment(
        "specimen 12, out of plane",
        "Griffith et al. 2004",
        (0.138 * 1800 * 9.81 * 1.5 * 0.11 * 0.95 / 1e3,),
        lambda data, folder: (_bricks({"placement": Placement.CENTROID}),),
        "bows, with a hinge at mid-height",
        assumed="points at corners and centroid, as joints are soft; each course one stone",
    ),
    "specimen 12, area": Experiment(
        "specimen 12, points all over its joints",
        "Griffith et al. 2004",
        (0.138 * 1800 * 9.81 * 1.5 * 0.11 * 0.95 / 1e3,),
        lambda data, folder: (_bricks({"placement": Placement.AREA, "spacing": 0.01}),),
        "bows, with a hinge at mid-height",
        assumed="each course one stone",
    ),
    "WR1.100": Experiment(
        "WR1.100",
        _CYCLIC,
        (36.3, -40.4),
        _rubble_granite("masks/WR1_100.png", 100e3),
        "flexure and rocking",
        assumed=_ALIKE + "; modulus of mortar by difference",
        curve="WR1100_Vasconcelos2009.csv",
    ),
    "WR2.250": Experiment(
        "WR2.250",
        _CYCLIC,
        (69.8, -80.4),
        _rubble_granite("masks/WR2_250.png", 250e3),
        "shear",
        assumed=_ALIKE + "; modulus of mortar by difference",
        curve="WR2250_Vasconcelos2009.csv",
    ),
}
"""The walls, by the names of `--only`."""

_TABLE = columns(
    "test wall | measured_text measured, kN | predicted_text predicted, kN | ratio_text predicted over mean measured | "
    "stiffness_measured stiffness measured, kN/mm :.1f | stiffness predicted :.1f | forces over measured at "
    "2, 5, 10, 20, 30 mm | observed observed | mechanism predicted | unsolved steps not solved | seconds time, s :.0f"
)


def _row(name: str, one: Experiment, data: Path, figures: Path | None) -> Row:
    began = time.process_time()
    with TemporaryDirectory() as folder:
        tests = one.predict(data, Path(folder))
    seconds, test = time.process_time() - began, tests[0]
    predicted = [1e-3 * max(other.strength, key=abs) for other in tests]
    measured = [
        float(np.mean([force for force in one.measured if force * sign > 0])) for sign in _signs(predicted)
    ]
    ratios = [one / two for one, two in zip(predicted, measured, strict=True)]
    found = 1e-3 * test.at(np.array(_PLACES))
    row = {
        "test": one.test,
        "source": one.source,
        "measured": list(one.measured),
        "predicted": predicted,
        "ratio": ratios,
        "stiffness_measured": one.stiffness,
        "stiffness": 1e-6 * test.stiffness,
        "forces": " ".join(f"{a / b:.2f}" for a, b in zip(found, one.forces, strict=True))
        if one.forces
        else None,
        "displacements": [1e3 * place for place in _PLACES],
        "forces_predicted": [None if np.isnan(force) else float(force) for force in found],
        "forces_measured": list(one.forces),
        "observed": one.mechanism,
        "mechanism": f"{100 * test.turning:.0f} % by turning",
        "turning": test.turning,
        "assumed": one.assumed,
        "unsolved": f"{sum(other.unsolved for other in tests)} of {sum(len(other.force) for other in tests)}",
        "energy_error": test.energy_error,
        "seconds": seconds,
        "measured_text": ", ".join(f"{force:.4g}" for force in one.measured),
        "predicted_text": ", ".join(f"{force:.4g}" for force in predicted),
        "ratio_text": ", ".join(f"{ratio:.3f}" for ratio in ratios),
    }
    if figures is not None:
        file = data / "curves" / one.curve
        curve = read_curve(file) if one.curve and file.exists() else None
        draw_curve(figures / f"{name}.png", one.test, test, None, curve)
        draw_pushed(figures / f"{name}-end.png", one.test, test, test.end)
    return row


METHOD: Mapping[str, Mapping[str, float]] = {
    "as predicted": {},
    "half the step": {"step": 0.075e-3},
    "twice the step": {"step": 0.3e-3},
    "half the distance of points": {"spacing": 0.025},
    "twice the distance of points": {"spacing": 0.1},
    "friction 0.55": {"friction": 0.55},
    "friction 0.70": {"friction": 0.70},
}
"""What is changed in WS.100 by --method."""

_EFFECTS = columns("changed changed | strength strength, kN :.2f | effect change, % :+.2f")


def _effects() -> Iterator[Row]:
    first: float | None = None
    for name, changes in METHOD.items():
        progress(name)
        strength = 1e-3 * _granite(100e3, 26.2e9, **changes).strength[0]
        first = first or strength
        yield {"changed": name, "strength": strength, "effect": 100.0 * (strength / first - 1.0)}


def _signs(forces: Iterable[float]) -> list[float]:
    return [float(np.sign(force)) for force in forces]


def _rows(names: Mapping[str, Experiment], data: Path, figures: Path | None) -> Iterator[Row]:
    for name, one in names.items():
        if isinstance(one.predict, Rubble) and not (data / one.predict.file).exists():
            continue
        progress(name)
        yield _row(name, one, data, figures)


def main() -> None:
    """Predict the walls, and print them beside what was measured."""
    options = options_of("experiments", __doc__)
    options.add_argument("--data", type=Path, default=_DATA, help="folder of masks, outlines and curves")
    options.add_argument("--only", nargs="+", choices=sorted(EXPERIMENTS), help="these walls")
    options.add_argument("--figures", type=Path, help="folder for a figure of each wall")
    options.add_argument(
        "--method", action="store_true", help="effects of step, points and friction on WS.100 alone"
    )
    options.add_argument("--write", action="store_true", help="put the table into docs/accuracy.md")
    given = options.parse_args()
    if given.method:
        show(list(_effects()), _EFFECTS, as_json=given.json)
        return
    chosen = {name: one for name, one in EXPERIMENTS.items() if not given.only or name in given.only}
    if given.figures is not None:
        given.figures.mkdir(parents=True, exist_ok=True)
    rows = list(_rows(chosen, given.data, given.figures))
    if given.json:
        print(
            json.dumps(
                {"walls": rows, "assumed": ASSUMED, "machine": machine(), "commit": commit()}, indent=1
            )
        )
        return
    print(f"{commit()}; {machine()}")
    print_table(rows, _TABLE)
    if given.write:
        write_between(
            "experiments",
            [f"{commit()}; {machine()}.", "", *table_lines(rows, _TABLE)],
            ROOT / "docs" / "accuracy.md",
        )


if __name__ == "__main__":
    guarded(main)
