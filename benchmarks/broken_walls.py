"""Walls that laboratories broke: what was measured of them, what they are predicted from, and the prediction.

Every input has an origin: *measured* in the same laboratory or, where so stated, in another; *of a model* of others,
who chose it for their simulation; or *assumed* here, the same for all walls. Nothing is fitted to a curve.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from mechanics.limit.loading_test import LoadingTest, loading_test
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.rig import Head, Rig
from mechanics.scene.scene import ContactSettings, Fidelity, Placement, Scene
from mechanics.scene.shapes import bond, box, wall
from mechanics.stones.materials import Material
from pipelines.assess.pushover.push import push
from pipelines.ingest.ingest import ingest
from pipelines.ingest.outlined import mask_options
from survey.formats.options import ReadingOptions

MEASURED, ASSUMED = "measured", "assumed"


@dataclass(frozen=True)
class Input:
    """A number from which a wall is predicted.

    Attributes
    ----------
    value, unit : as in the scene
    origin : measured, of a model (whose) or assumed, with what else is to be known of it
    """

    value: float
    unit: str
    origin: str


Inputs = Mapping[str, Input]

_SHEAR = Input(0.4, "-", f"{ASSUMED}: G/E at ν = 0.25")
_SPACING = Input(0.05, "m", f"{ASSUMED}: two or more points across each joint")
# of dry joints of split granite in their first loading, walls SW of another laboratory [Pa], [Pa/m]
_FIRST_LOADING = ((0.15e6, 0.5e6, 1.0e6, 1.25e6), (5.9e9, 7.9e9, 12.3e9, 12.9e9))
_SECTION = 0.2  # of the granite walls [m²]


def granite_inputs(load: float) -> Inputs:
    """Return the inputs of a dry ashlar wall of Vasconcelos under a vertical force [N]."""
    pressure = load / _SECTION
    between = "" if pressure in _FIRST_LOADING[0] else ", between those at 0.15 and 0.5 MPa"
    return {
        "density": Input(2600.0, "kg/m³", ASSUMED),
        "friction": Input(0.65, "-", f"{ASSUMED}: 0.55 to 0.70 changes the force by less than 2 %"),
        "normal stiffness": Input(
            float(np.interp(pressure, *_FIRST_LOADING)),
            "Pa/m",
            f"{MEASURED} in another laboratory, dry joints of the same kind in first loading at "
            f"{1e-6 * pressure:g} MPa{between}",
        ),
        "shear over normal stiffness": _SHEAR,
        "compressive strength": Input(73e6, "Pa", f"{MEASURED}, of the dry masonry"),
        "distance of contact points": _SPACING,
    }


def granite(load: float, inputs: Inputs, step: float | None = None) -> LoadingTest:
    """Predict a dry ashlar wall of Vasconcelos: 8 courses of 0.20 × 0.15 × 0.20 m in half-unit bond.

    Parameters
    ----------
    load : vertical force [N]
    inputs : as `granite_inputs`
    step : way of one step; None: the usual one [m]
    """
    value = {name: one.value for name, one in inputs.items()}
    stone = Material("granite", value["density"], 20.2e9, 0.2)
    units = wall(bond(5, 8), 0.2, 0.15, 0.2, stone, slab=False)
    blocks = tuple(replace(unit, fidelity=Fidelity.RIGID) for unit in units)
    stiffness = value["normal stiffness"]
    shear = value["shear over normal stiffness"] * stiffness
    law = ElasticJoint(
        value["friction"], stiffness, shear, compressive_strength=value["compressive strength"]
    )
    contact = ContactSettings(law, placement=Placement.AREA, spacing=value["distance of contact points"])
    rig = Rig((1.0, 0.0, 0.0), 1.325, load, Head.TURNS)
    return loading_test(Scene("granite wall", blocks, contact=contact), rig, (0.03,), step)


_BRICK_WALL: Inputs = MappingProxyType(
    {
        "density": Input(1800.0, "kg/m³", MEASURED),
        "friction": Input(float(np.tan(np.radians(35.0))), "-", "of a model (discrete elements of others)"),
        "normal stiffness": Input(5e8, "Pa/m", "of a model (discrete elements of others)"),
        "shear over normal stiffness": _SHEAR,
    }
)


def _bricks(placement: Placement, spacing: float | None = None) -> LoadingTest:
    """Predict the brick wall of Griffith et al., pushed at mid-height out of its plane: 18 courses, each one stone."""
    value = {name: one.value for name, one in _BRICK_WALL.items()}
    brick = Material("brick", value["density"], 10e9, 0.2)
    courses = tuple(
        box(f"course {k + 1}", (0.0, 0.0, k * 1.5 / 18), (0.95, 0.11, (k + 1) * 1.5 / 18), brick)
        for k in range(18)
    )
    stiffness = value["normal stiffness"]
    law = ElasticJoint(value["friction"], stiffness, value["shear over normal stiffness"] * stiffness)
    scene = Scene("brick wall", courses, contact=ContactSettings(law, placement=placement, spacing=spacing))
    return loading_test(scene, Rig((0.0, 1.0, 0.0), 0.75, 0.0, Head.HELD), (0.0606,))


_RUBBLE = """
[scene]
name = "rubble wall"
[materials.stone]
density = {density}
young = 20.2e9
poisson = 0.2
[joints]
mode = "mortar"
mortar_density = {mortar_density}
[contact]
placement = "area"
spacing = {distance_of_contact_points}
[[laws]]
type = "elastic_joint"
friction = {friction}
mortar_young = {modulus_of_the_mortar}
mortar_poisson = {ratio_of_the_mortar}
tension = {tension}
shear = {cohesion}
energy_tension = {energy_of_opening}
energy_shear = {energy_of_sliding}
compressive_strength = {compressive_strength}
[pushover]
height = {height}
load = {load}
head = "{head}"
to = [{to}]
"""


@dataclass(frozen=True)
class Rubble:
    """A rubble wall that is known by a mask or by outlines; called, it is predicted: its stones grow into their mortar.

    Attributes
    ----------
    file : of the mask or outlines
    size : of the wall, as `moma ingest` takes it
    inputs : of materials and joints
    height, load, head : of the rig [m], [N]
    to : displacement, forwards and backwards [m]
    """

    file: str
    size: str
    inputs: Inputs
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
        values = {name.replace(" ", "_"): one.value for name, one in self.inputs.items()}
        rig = {"height": self.height, "load": self.load, "head": self.head, "to": to}
        (folder / "wall.toml").write_text(_RUBBLE.format(**values, **rig), encoding="utf-8")
        return push(folder / "wall.toml", url, folder / "out").test


_THIRD = "of a model (Rigid-Block-3D)"
_GODIO: Inputs = MappingProxyType(
    {
        "density": Input(2600.0, "kg/m³", ASSUMED),
        "mortar density": Input(1800.0, "kg/m³", ASSUMED),
        "friction": Input(0.5, "-", _THIRD),
        "modulus of the mortar": Input(0.97e9, "Pa", f"{_THIRD}: three times that measured"),
        "ratio of the mortar": Input(0.2, "-", ASSUMED),
        "tension": Input(0.19e6, "Pa", f"{_THIRD}: a third of the mortar's 0.57 MPa, at the face of stones"),
        "cohesion": Input(
            0.0967e6, "Pa", f"{_THIRD}: a third of the mortar's 0.29 MPa, at the face of stones"
        ),
        "energy of opening": Input(12.0, "J/m²", _THIRD),
        "energy of sliding": Input(120.0, "J/m²", _THIRD),
        "compressive strength": Input(4.08e6, "Pa", f"{MEASURED}, of the mortar"),
        "distance of contact points": _SPACING,
    }
)
_SOFT_GODIO: Inputs = MappingProxyType({**_GODIO, "modulus of the mortar": Input(0.323e9, "Pa", MEASURED)})


def _godio(inputs: Inputs) -> Rubble:
    """Return wall SC1 of Godio et al.: one leaf of irregular stones in mortar under a beam that does not turn."""
    return Rubble("sc1_outlines.json", "0.9x0.9", inputs, 0.95, 139e3, Head.GUIDED, 0.008)


_OTHERS = "of a model (of others, for these walls)"
_WEAK: Inputs = MappingProxyType(
    {
        "density": Input(2600.0, "kg/m³", _OTHERS),
        "mortar density": Input(1800.0, "kg/m³", _OTHERS),
        "friction": Input(0.7, "-", _OTHERS),
        "modulus of the mortar": Input(
            0.33 / (1 / 1.25e9 - 0.67 / 20.2e9),
            "Pa",
            f"{MEASURED}, by difference of masonry (1.25 GPa) and stone (20.2 GPa), two thirds of stone {ASSUMED}",
        ),
        "ratio of the mortar": Input(0.2, "-", ASSUMED),
        "tension": Input(0.1e6, "Pa", _OTHERS),
        "cohesion": Input(0.1e6, "Pa", _OTHERS),
        "energy of opening": Input(5.0, "J/m²", f"{ASSUMED}: tension is lost over 0.1 mm"),
        "energy of sliding": Input(20.0, "J/m²", f"{ASSUMED}: cohesion is lost over 0.4 mm"),
        "compressive strength": Input(5.0e6, "Pa", f"{MEASURED}, of the masonry"),
        "distance of contact points": _SPACING,
    }
)


def _rubble_granite(file: str, load: float) -> Rubble:
    """Return a wall of the second kind of Vasconcelos & Lourenço: granite rubble in weak mortar."""
    return Rubble(file, "1.0x1.2", _WEAK, 1.325, load, Head.TURNS, 0.015)


@dataclass(frozen=True)
class Experiment:
    """A wall, what was measured of it, and how it is predicted.

    Attributes
    ----------
    test : name in its paper, with those of walls that were built and loaded alike
    source : paper
    measured : largest forces, forwards and backwards or of several walls [kN]
    predict : makes the predictions from the folder of the data and one for work: pushed forwards, and backwards
    mechanism : as observed
    inputs : of the prediction
    early, stiffness : secants at 15 and at 30 % of the largest force, of one wall or of several [kN/mm]; empty: not
        stated
    forces : at 2, 5, 10, 20 and 30 mm [kN]; empty: not stated
    assumed : of the test, beyond the inputs
    curve : file of the measured curve
    """

    test: str
    source: str
    measured: tuple[float, ...]
    predict: Callable[[Path, Path], tuple[LoadingTest, ...]]
    mechanism: str
    inputs: Inputs
    early: tuple[float, ...] = ()
    stiffness: tuple[float, ...] = ()
    forces: tuple[float, ...] = ()
    assumed: str = ""
    curve: str = ""


_THESIS = "Vasconcelos 2005, Experimental investigations on the mechanics of stone masonry"
_CYCLIC = "Vasconcelos & Lourenço 2009, 10.1061/(ASCE)ST.1943-541X.0000053"
_GODIO_2019 = "Godio et al. 2019, 10.1016/j.engstruct.2019.04.041"
_ALIKE = "pushed once each way, without cycles"
_ROCKS = "rocks about the toe, one stepped crack"
_PEAK = 0.138 * 1800 * 9.81 * 1.5 * 0.11 * 0.95 / 1e3  # of specimen 12 [kN]


def _dry(load: float) -> Callable[[Path, Path], tuple[LoadingTest, ...]]:
    return lambda data, folder: (granite(load, granite_inputs(load)),)


EXPERIMENTS = {
    "WS.40": Experiment(
        "WS.40", _THESIS, (16.3,), _dry(40e3), _ROCKS, granite_inputs(40e3), (10.7,), (6.5,),
        (11.0, 12.6, 14.5, 15.8, 16.0), curve="WS40_Vasconcelos2005.csv",
    ),
    "WS.100": Experiment(
        "WS.100", _THESIS, (37.0,), _dry(100e3), _ROCKS, granite_inputs(100e3), (12.0,), (12.3,),
        (20.8, 29.8, 33.1, 36.5, 36.8), curve="WS100_Vasconcelos2005.csv",
    ),
    "WS.250": Experiment(
        "WS.250", _THESIS, (85.9,), _dry(250e3), _ROCKS, granite_inputs(250e3), (23.2,), (19.0,),
        (35.5, 62.1, 77.3, 84.2, 85.6), curve="WS250_Vasconcelos2005.csv",
    ),
    "WS1-4.100": Experiment(
        "WS1 to WS4.100", _CYCLIC, (39.0, 37.8, 38.0, 36.0, -43.3, -40.9, -42.1, -40.1), _dry(100e3), _ROCKS,
        granite_inputs(100e3), (12.6, 9.2, 11.5, 35.6), assumed="pushed once, without cycles",
        curve="WS1100_Vasconcelos2009.csv",
    ),
    "WS1-3.250": Experiment(
        "WS1 to WS3.250", _CYCLIC, (88.7, 87.1, 86.5, -95.7, -94.7, -92.6), _dry(250e3),
        _ROCKS + ", the toe crushes", granite_inputs(250e3), assumed="pushed once, without cycles",
        curve="WS1250_Vasconcelos2009.csv",
    ),
    "SC1": Experiment(
        "SC1", _GODIO_2019, (74.0, -77.0), _godio(_GODIO), "two crossing diagonal cracks", _GODIO, (184.0,),
        assumed=_ALIKE, curve="SC1_Godio2019.csv",
    ),
    "SC1, soft": Experiment(
        "SC1, modulus of the mortar as measured", _GODIO_2019, (74.0, -77.0), _godio(_SOFT_GODIO),
        "two crossing diagonal cracks", _SOFT_GODIO, (184.0,), assumed=_ALIKE, curve="SC1_Godio2019.csv",
    ),
    "specimen 12": Experiment(
        "specimen 12, out of plane", "Griffith et al. 2004", (_PEAK,),
        lambda data, folder: (_bricks(Placement.CENTROID),), "bows, with a hinge at mid-height", _BRICK_WALL,
        assumed="points at corners and centroid, as joints are soft; each course one stone",
    ),
    "specimen 12, area": Experiment(
        "specimen 12, points all over its joints", "Griffith et al. 2004", (_PEAK,),
        lambda data, folder: (_bricks(Placement.AREA, 0.01),), "bows, with a hinge at mid-height", _BRICK_WALL,
        assumed="each course one stone",
    ),
    "WR1.100": Experiment(
        "WR1.100", _CYCLIC, (36.3, -40.4), _rubble_granite("masks/WR1_100.png", 100e3), "flexure and rocking",
        _WEAK, assumed=_ALIKE, curve="WR1100_Vasconcelos2009.csv",
    ),
    "WR2.250": Experiment(
        "WR2.250", _CYCLIC, (69.8, -80.4), _rubble_granite("masks/WR2_250.png", 250e3), "shear",
        _WEAK, assumed=_ALIKE, curve="WR2250_Vasconcelos2009.csv",
    ),
}  # fmt: skip
"""The walls, by the names of `--only`."""
