"""A wall that a laboratory broke: dry granite ashlar under 100 kN, from its stated dimensions (WS.100).

Vasconcelos, G. (2005): Experimental investigations on the mechanics of stone masonry. Thesis, Universidade do Minho.
"""

from itertools import pairwise

import numpy as np

from mechanics.scene.shapes import bond

GRANITE_WALL = "granite-wall"
"""Name of the sample."""

_LENGTH, _HEIGHT = 0.2, 0.15  # of a unit [m]
_UNITS, _COURSES = 5, 8  # in a course, and courses

MEASURED = ((2.0, 20.8), (5.0, 29.8), (10.0, 33.1), (20.0, 36.5), (30.0, 36.8))
"""Points of the measured curve: displacement [mm] and force [kN]; the largest force was 37.0 kN."""

GRANITE_SCENE = """\
# Granite wall WS.100: dry ashlar of 1.0 × 1.2 × 0.2 m under 100 kN, pushed at the top (Vasconcelos 2005).
# Each value is measured in that laboratory, unless it says where else, or assumed. Nothing is fitted to the curve.
{commands}
[scene]
name = "Granite wall WS.100"

[materials.granite]
density = 2600.0   # kg/m³; assumed
young = 20.2e9     # Pa; measured, of the units (without effect: units count as rigid)
poisson = 0.2      # assumed (without effect)

[joints]
mode = "as-surveyed"

[contact]
placement = "area"  # joints open and crush like their area
spacing = 0.05      # m; assumed: half of it changes the force by less than 1 %

[[laws]]
type = "elastic_joint"
friction = 0.65              # assumed: 0.55 to 0.70 changes the force by less than 2 %
# In first loading, measured in another laboratory on dry joints of the same kind at 0.5 MPa, which is the load over the
# section of the wall: 5.9e9 at 0.15, 7.9e9 at 0.5, 12.3e9 at 1.0, 12.9e9 at 1.25 MPa. Moduli of loading cycles give
# three times as much, and are too stiff for a first push.
normal_stiffness = 7.9e9     # Pa/m; measured elsewhere
shear_stiffness = 3.16e9     # Pa/m; assumed: 0.4 of the normal one
compressive_strength = 73e6  # Pa; measured, of the dry masonry

[pushover]
height = 1.325       # m above the base, where the beam was pushed
load = 100e3         # N
head = "turns"       # the beam was free to turn
to = [0.03]          # m
measured = "measured.csv"
"""
"""Scene of the sample."""


def units() -> dict[str, tuple[float, float, float, float]]:
    """Return left, bottom, right and top of each unit by its code [m]: half-unit bond, odd courses of whole units."""
    stones = {}
    for course, lengths in enumerate(bond(_UNITS, _COURSES)):
        ends = _LENGTH * np.concatenate([[0.0], np.cumsum(lengths)])
        for number, (left, right) in enumerate(pairwise(ends.tolist()), start=1):
            stones[f"{course + 1}-{number}"] = (left, _HEIGHT * course, right, _HEIGHT * (course + 1))
    return stones


def units_text() -> str:
    """Return the outlines of all units as CSV: code, x and y [m]."""
    lines = ["code,x,y"]
    for code, (left, bottom, right, top) in units().items():
        lines += [
            f"{code},{x:.4f},{y:.4f}" for x, y in ((left, bottom), (right, bottom), (right, top), (left, top))
        ]
    return "\n".join(lines) + "\n"
