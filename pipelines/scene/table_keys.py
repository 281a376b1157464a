"""Every key of a scene file: type, unit, bounds, default. docs/scene.md is held to this list by a test."""

from collections.abc import Mapping

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import (
    ContactSettings,
    Fidelity,
    Method,
    Placement,
    SolverSettings,
    Start,
    TimeSettings,
)
from pipelines.scene.stone_keys import MESH
from pipelines.toml.schema import Key, Kind
from survey.joints.settings import JointMode, JointSettings

__all__ = ["AUTO", "PICTURES", "STRESS_PICTURES", "TABLES"]

AUTO = "auto"
"""[bodies] default: what the outputs need."""

STRESS_PICTURES = ("von_mises", "principal_tension", "principal_compression", "utilisation", "error")
"""Those that show nothing of rigid stones."""

PICTURES = (
    "von_mises",
    "displacement",
    "principal_tension",
    "principal_compression",
    "utilisation",
    "error",
    "pressure",
    "resultants",
)

_SCENE = (Key("name", Kind.TEXT, "Title of reports and pictures; else the file's name.", default=None),)

_SELECT = (
    Key("kind", Kind.TEXT, "Kind of the stones; its subkinds belong to it.", default="entity"),
    Key("where", Kind.TEXTS, "Expressions that every stone must satisfy.", default=()),
    Key("exclude", Kind.TEXTS, "Codes or expressions; stones named by any of them are left out.", default=()),
)

_BODIES = (
    Key(
        "default",
        Kind.TEXT,
        "Model of stones that no list below names; auto: rigid, but where an output needs their stress.",
        default=AUTO,
        choices=(AUTO, Fidelity.RIGID.value, Fidelity.DEFORMABLE.value),
    ),
    Key("rigid", Kind.TEXTS, "Codes or expressions of stones that move but do not deform.", default=()),
    Key("deformable", Kind.TEXTS, "Codes or expressions of stones with finite elements.", default=()),
    Key("fixed", Kind.TEXTS, "Codes or expressions of stones that never move: the supports.", default=()),
    Key(
        "ring",
        Kind.INTEGER,
        "With auto, stones within so many joints of one named by `stress` in `[output]` deform too.",
        "",
        3,
        at_least=0,
    ),
)

_JOINTS = (
    Key(
        "mode",
        Kind.TEXT,
        "close: neighbours share contact planes; mortar: so too, with the width kept as the mortar's thickness; "
        "as-surveyed: stones keep their measured sides.",
        default=JointSettings.mode.value,
        choices=tuple(one.value for one in JointMode),
    ),
    Key(
        "max_width",
        Kind.NUMBER,
        "Faces farther apart do not make a joint.",
        "m",
        JointSettings.max_width,
        above=0,
    ),
    Key(
        "max_angle",
        Kind.NUMBER,
        "Faces that open wider do not make a joint.",
        "°",
        JointSettings.max_angle,
        above=0,
        below=45,
    ),
    Key(
        "min_overlap",
        Kind.NUMBER,
        "Narrowest strip in which two faces must face each other.",
        "m",
        JointSettings.min_overlap,
        at_least=0,
    ),
    Key(
        "straightness",
        Kind.NUMBER,
        "Largest distance of a corner from its joint that still counts as plane; a bed that is less so is bent.",
        "m",
        JointSettings.straightness,
        above=0,
        at_most=0.1,
    ),
    Key(
        "max_displacement",
        Kind.NUMBER,
        "Largest distance by which closing may move a corner.",
        "m",
        JointSettings.max_displacement,
        above=0,
    ),
)

_CONTACT = (
    Key("friction", Kind.NUMBER, "Coulomb's coefficient μ.", "-", DryJoint.friction, at_least=0),
    Key(
        "dynamic_friction",
        Kind.NUMBER,
        "μ of a contact that slid in the last step; else the same.",
        "-",
        DryJoint.dynamic_friction,
        at_least=0,
    ),
    Key(
        "restitution",
        Kind.NUMBER,
        "Newton's ratio e of the velocities after and before an impact.",
        "-",
        DryJoint.restitution,
        at_least=0,
        at_most=1,
    ),
    Key(
        "alert_distance",
        Kind.NUMBER,
        "Gap below which a contact is watched, relative to the smaller stone's size.",
        "-",
        ContactSettings.alert_distance,
        above=0,
        at_most=1,
    ),
    Key(
        "points",
        Kind.INTEGER,
        "Contact points of two flat faces, at most.",
        default=ContactSettings.points,
        choices=(1, 3, 4, 8),
    ),
    Key(
        "placement",
        Kind.TEXT,
        "corners: at the true edge of the common face; inertia: inside it, where they carry its second moments.",
        default=ContactSettings.placement.value,
        choices=tuple(one.value for one in Placement),
    ),
)

_GRAVITY = (
    Key("magnitude", Kind.NUMBER, "Acceleration of gravity.", "m/s²", 9.81, at_least=0),
    Key("direction", Kind.VECTOR, "Where things fall to; its length does not matter.", "-", (0.0, 0.0, -1.0)),
)

_TIME = (
    Key("step", Kind.NUMBER, "Time step h.", "s", TimeSettings.step, above=0),
    Key(
        "theta",
        Kind.NUMBER,
        "θ of the scheme; 1 damps most.",
        "-",
        TimeSettings.theta,
        at_least=0.5,
        at_most=1,
    ),
    Key("duration", Kind.NUMBER, "Longest simulated time.", "s", TimeSettings.duration, above=0),
    Key(
        "relaxation",
        Kind.BOOLEAN,
        "Kinetic damping: all velocities become zero when the kinetic energy has passed a peak.",
        default=TimeSettings.relaxation,
    ),
    Key(
        "start",
        Kind.TEXT,
        "rest: all loads come at once; equilibrium: the stones already bear the loads of the first instant.",
        default=TimeSettings.start.value,
        choices=tuple(one.value for one in Start),
    ),
    Key(
        "lumped_mass",
        Kind.BOOLEAN,
        "Mass of deformable stones at their nodes alone, not along the shape functions.",
        default=TimeSettings.lumped_mass,
    ),
    Key(
        "stop_at_equilibrium",
        Kind.BOOLEAN,
        "Stop once every stone is at rest and in balance, or one has collapsed.",
        "",
        TimeSettings.stop_at_equilibrium,
    ),
    Key(
        "balance_tolerance",
        Kind.NUMBER,
        "Unbalanced force of a stone over its weight below which it is in balance.",
        "-",
        TimeSettings.balance_tolerance,
        above=0,
    ),
    Key(
        "collapse_displacement",
        Kind.NUMBER,
        "A stone that moved by more than this fraction of its smallest side and still moves has collapsed.",
        "-",
        TimeSettings.collapse_displacement,
        above=0,
    ),
    Key(
        "sleep",
        Kind.NUMBER,
        "Unbalanced force of a stone over its weight up to which it may sleep once it rests; 0: none sleeps.",
        "-",
        TimeSettings.sleep,
        at_least=0,
        at_most=0.1,
    ),
)

_SOLVER = (
    Key(
        "method",
        Kind.TEXT,
        "auto chooses; nsgs: Gauss–Seidel; admm: alternating directions; apgd: accelerated gradients; interior-point; "
        "newton; cone: cone programmes, the reference.",
        default=SolverSettings.method.value,
        choices=tuple(one.value for one in Method),
    ),
    Key(
        "tolerance",
        Kind.NUMBER,
        "Natural map η at which a step is solved.",
        "-",
        SolverSettings.tolerance,
        above=0,
        below=1,
    ),
    Key(
        "velocity_tolerance",
        Kind.NUMBER,
        "Largest velocity by which a contact may break its law, over the largest that contacts have to stop.",
        "-",
        SolverSettings.velocity_tolerance,
        above=0,
    ),
    Key(
        "max_iterations",
        Kind.INTEGER,
        "Iterations after which a step is left as it is, and reported as not converged.",
        "",
        SolverSettings.max_iterations,
        at_least=1,
    ),
    Key(
        "threads",
        Kind.INTEGER,
        "Threads that sweep rigid scenes of many contacts; the results are the same to the last bit.",
        "",
        SolverSettings.threads,
        at_least=1,
    ),
)

_OUTPUT = (
    Key(
        "frame_every",
        Kind.INTEGER,
        "Keep motion, stresses and contacts every so many steps; 0: first and last.",
        "",
        0,
        at_least=0,
    ),
    Key(
        "stress",
        Kind.TEXTS,
        "Codes or expressions of the stones whose stress is wanted; else that of all that deform.",
        default=None,
    ),
    Key(
        "pictures",
        Kind.TEXTS,
        "Pictures to draw, see below; else displacement, and von_mises where a stone deforms.",
        default=None,
    ),
)

TABLES: Mapping[str, tuple[Key, ...]] = {
    "scene": _SCENE,
    "select": _SELECT,
    "bodies": _BODIES,
    "joints": _JOINTS,
    "contact": _CONTACT,
    "gravity": _GRAVITY,
    "mesh": MESH,
    "time": _TIME,
    "solver": _SOLVER,
    "output": _OUTPUT,
}
