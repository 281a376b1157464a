"""Units in SI, and gravity."""

from collections.abc import Mapping

DECI, CENTI, MILLI = 0.1, 0.01, 0.001
KILO = 1.0 / MILLI
MEGA = KILO * KILO
GIGA = KILO * MEGA

FOOT, INCH = 0.3048, 0.0254
"""International foot and inch [m]."""

SURVEY_FOOT = 1200.0 / 3937.0
"""Foot of surveys in the United States [m]."""

POUND, PSI = 0.45359237, 6894.76
"""Pound [kg]; pound on a square inch [Pa]."""

GRAVITY = 9.81
"""Acceleration of gravity [m/s²]."""

LENGTHS: Mapping[str, float] = {
    "m": 1.0,
    "dm": DECI,
    "cm": CENTI,
    "mm": MILLI,
    "ft": FOOT,
    "in": INCH,
    "us-ft": SURVEY_FOOT,
}
"""Units of length by their abbreviation [m]."""
