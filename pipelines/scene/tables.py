"""Keys of the tables of a scene file; those of [[laws]], [[loads]] and [[throw]] stand beside what they make."""

from collections.abc import Mapping
from dataclasses import replace

from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Fidelity, SolverSettings, TimeSettings
from mechanics.stones.materials import Material, Orthotropy
from pipelines.scene.keys import keys_of
from pipelines.scene.settings import Fidelities, MaterialRule, MeshSettings, Output, Selection
from pipelines.scene.site import Site
from pipelines.toml.schema import Key, ValueKind
from survey.joints.settings import JointSettings

__all__ = ["ARRAYS", "AUTO", "MATERIAL_KEYS", "MESH_KEYS", "ORTHOTROPY_KEYS", "SITE_KEYS", "TABLES"]

ARRAYS = ("meshes", "laws", "loads", "throw", "stages", "assess")
"""Tables of which a scene may have many."""

AUTO = "auto"
"""Default model of [bodies]: as the outputs need it."""

_default, *_lists = keys_of(Fidelities)
_models = (AUTO, Fidelity.RIGID.value, Fidelity.DEFORMABLE.value)

TABLES: Mapping[str, tuple[Key, ...]] = {
    "scene": (
        Key(
            "name",
            ValueKind.TEXT,
            "Title of reports and pictures; if not given, the file's name.",
            default=None,
        ),
    ),
    "select": keys_of(Selection),
    "bodies": (replace(_default, default=AUTO, choices=_models), *_lists),
    "joints": keys_of(JointSettings),
    "contact": (*keys_of(DryJoint), *keys_of(ContactSettings)),
    "gravity": (
        Key("magnitude", ValueKind.NUMBER, "Acceleration of gravity.", "m/s²", 9.81, at_least=0),
        Key(
            "direction",
            ValueKind.VECTOR,
            "Direction in which things fall; its length does not matter.",
            "-",
            (0.0, 0.0, -1.0),
        ),
    ),
    "mesh": keys_of(MeshSettings),
    "time": keys_of(TimeSettings),
    "solver": keys_of(SolverSettings),
    "output": keys_of(Output),
}

SITE_KEYS = keys_of(Site)

MATERIAL_KEYS = (*keys_of(Material), *keys_of(MaterialRule))

ORTHOTROPY_KEYS = keys_of(Orthotropy)

MESH_KEYS = (
    Key("stones", ValueKind.STONES, "Codes or expressions of the stones that are meshed otherwise."),
    *(
        replace(key, doc=f"As in `[mesh]`, whose `{key.name}` holds if none is given.", default=None)
        for key in keys_of(MeshSettings)
        if key.name != "ring_size"
    ),
)
