"""Every key of the tables that a scene file may hold many of: [[laws]], [[loads]], [[throw]], by their type.

docs/scene.md is held to these lists by a test.
"""

from collections.abc import Mapping

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.loads.record_files import UNITS
from pipelines.toml.schema import Key, Kind

__all__ = ["ARRAYS", "HISTORY_FILE", "LAW_KEYS", "LAW_TYPES", "LOAD_TYPES", "THROW_KEYS"]

_FRICTION = Key("friction", Kind.NUMBER, "Coulomb's coefficient μ.", "-", at_least=0)
_DYNAMIC = Key(
    "dynamic_friction",
    Kind.NUMBER,
    "μ of a contact that slid in the last step; else the same.",
    "-",
    None,
    at_least=0,
)
_TENSION = Key("tension", Kind.NUMBER, "Tensile strength c_n; no more than c_t/μ is held.", "Pa", at_least=0)
_SHEAR = Key("shear", Kind.NUMBER, "Shear strength without pressure, c_t.", "Pa", at_least=0)

LAW_KEYS = (
    Key(
        "materials",
        Kind.TEXTS,
        "Two names of materials: the law holds between their stones.",
        default=(),
    ),
    Key(
        "between",
        Kind.GROUPS,
        "Two lists of codes or expressions: the law holds between the stones of the one and those of the other.",
        default=(),
    ),
)

LAW_TYPES: Mapping[str, tuple[Key, ...]] = {
    "dry": (
        _FRICTION,
        _DYNAMIC,
        Key(
            "restitution",
            Kind.NUMBER,
            "Newton's ratio e of the velocities after and before an impact.",
            "-",
            DryJoint.restitution,
            at_least=0,
            at_most=1,
        ),
    ),
    "mortar": (_FRICTION, _TENSION, _SHEAR, _DYNAMIC),
    "cohesive_zone": (
        _FRICTION,
        Key("tension", Kind.NUMBER, "Tensile strength σ_N; no more than σ_T/μ is held.", "Pa", above=0),
        Key("shear", Kind.NUMBER, "Shear strength without pressure, σ_T.", "Pa", above=0),
        Key("energy_tension", Kind.NUMBER, "Energy G_I that opening costs.", "J/m²", above=0),
        Key("energy_shear", Kind.NUMBER, "Energy G_II that sliding costs.", "J/m²", above=0),
    ),
    "lennard_jones": (
        _FRICTION,
        Key("force", Kind.NUMBER, "Pull γ of each contact point.", "N", above=0),
        Key("distance", Kind.NUMBER, "Gap d_w within which it acts.", "m", above=0),
    ),
}

_STONES = Key("stones", Kind.STONES, "Codes or expressions of the stones on which it acts.")
_SUPPORTS = Key("stones", Kind.STONES, "Codes or expressions of the fixed stones that move.")
_START = Key("start", Kind.NUMBER, "When it begins.", "s", 0.0, at_least=0)
_DURATION = Key("duration", Kind.NUMBER, "How long it takes.", "s", above=0)

LOAD_TYPES: Mapping[str, tuple[Key, ...]] = {
    "gravity_ramp": (Key("duration", Kind.NUMBER, "Time until gravity is whole.", "s", above=0),),
    "tilt": (
        Key("axis", Kind.VECTOR, "Axis about which the table turns, right-handed.", "-"),
        Key("rate", Kind.NUMBER, "Constant rate; or give `angle`.", "°/s", None, above=0),
        Key("limit", Kind.NUMBER, "Angle at which a constant rate ends.", "°", 90.0, above=0),
        Key("start", Kind.NUMBER, "When a constant rate begins.", "s", 0.0, at_least=0),
        Key("angle", Kind.HISTORY, "Angle with time; or give `rate`.", "°", None),
    ),
    "force": (
        _STONES,
        Key("force", Kind.VECTOR_HISTORY, "Force on each of them, constant or with time.", "N"),
        Key(
            "point",
            Kind.VECTOR,
            "Where it acts on a single stone, which takes the point along; else the centre of mass.",
            "m",
            None,
        ),
        Key("follows", Kind.BOOLEAN, "The force turns with the stone.", default=False),
    ),
    "settlement": (
        _SUPPORTS,
        Key("displacement", Kind.VECTOR, "How far they go.", "m"),
        _DURATION,
        _START,
    ),
    "spreading": (
        Key(
            "first",
            Kind.STONES,
            "Codes or expressions of the fixed stones that go back by half the distance.",
        ),
        Key("second", Kind.STONES, "Codes or expressions of those that go forward by the other half."),
        Key("direction", Kind.VECTOR, "Where the second ones go to; its length does not matter.", "-"),
        Key("distance", Kind.NUMBER, "By how much they part.", "m"),
        _DURATION,
        _START,
    ),
    "motion": (
        _SUPPORTS,
        Key("velocity", Kind.VECTOR_HISTORY, "Velocity, constant or with time.", "m/s", (0.0, 0.0, 0.0)),
        Key("spin", Kind.HISTORY, "Turning velocity, constant or with time; needs `pivot`.", "°/s", 0.0),
        Key("axis", Kind.VECTOR, "Axis of the spin, right-handed.", "-", (0.0, 0.0, 1.0)),
        Key("pivot", Kind.VECTOR, "A point of that axis at the start.", "m", None),
    ),
    "ground_motion": (
        _SUPPORTS,
        Key(
            "x",
            Kind.TEXT,
            "File of the record along x: PEER's .AT2, or a table of time and acceleration.",
            default=None,
        ),
        Key("y", Kind.TEXT, "File of the record along y.", default=None),
        Key("z", Kind.TEXT, "File of the record along z.", default=None),
        Key("unit", Kind.TEXT, "Unit of the acceleration in tables.", default=None, choices=tuple(UNITS)),
        Key("azimuth", Kind.NUMBER, "Angle by which x and y are turned about z first.", "°", 0.0),
        Key("scale", Kind.NUMBER, "Factor on the records.", "-", 1.0),
        _START,
        Key("low", Kind.NUMBER, "Lower corner of a Butterworth filter; else none.", "Hz", None, above=0),
        Key("high", Kind.NUMBER, "Upper corner of a Butterworth filter; else none.", "Hz", None, above=0),
        Key(
            "order", Kind.INTEGER, "Order of the filter, which goes both ways.", "", 4, at_least=1, at_most=10
        ),
        Key(
            "baseline",
            Kind.INTEGER,
            "Degree of the polynomial that is taken out of the displacement, at least 2; 0: none.",
            "",
            0,
            at_least=0,
            at_most=12,
        ),
    ),
}

THROW_KEYS = (
    Key("stones", Kind.STONES, "Codes or expressions of the stones that begin in motion."),
    Key("velocity", Kind.VECTOR, "Velocity of the centre of mass.", "m/s", (0.0, 0.0, 0.0)),
    Key("spin", Kind.VECTOR, "Turning velocity about the axes x, y, z.", "°/s", (0.0, 0.0, 0.0)),
)

ARRAYS = ("meshes", "laws", "loads", "throw")

# what may stand in the inline table of a history, besides time and value
HISTORY_FILE = Key(
    "file", Kind.TEXT, "Text file with a column of times and one of values, or three.", default=None
)
