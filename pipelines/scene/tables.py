"""Keys of the tables of a scene file; those of [[laws]], [[loads]] and [[throw]] stand beside what they make."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

from ground.settings import Setting
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Fidelity, SolverSettings, TimeSettings
from mechanics.stones.materials import Material, Orthotropy
from pipelines.scene.settings import Fidelities, MaterialRule, MeshSettings, Output, Selection
from pipelines.scene.site import Site
from pipelines.toml.keys import Stones, Vector, keys_of
from pipelines.toml.schema import Key
from survey.joints.settings import JointSettings

ARRAYS = ("meshes", "laws", "loads", "throw", "stages", "assess")
"""Tables of which a scene may have many."""

AUTO = "auto"
"""Default model of [bodies]: as the outputs need it."""

_default, *_lists = keys_of(Fidelities)
_models = (AUTO, Fidelity.RIGID.value, Fidelity.DEFORMABLE.value)


@dataclass(frozen=True, kw_only=True)
class _Title:
    """Table [scene]."""

    name: Annotated[str | None, Setting("Title of reports and pictures; if not given, the file's name.")] = (
        None
    )


@dataclass(frozen=True, kw_only=True)
class _Gravity:
    """Table [gravity]."""

    magnitude: Annotated[float, Setting("Acceleration of gravity.", "m/s²", at_least=0)] = 9.81
    direction: Annotated[
        Vector, Setting("Direction in which things fall; its length does not matter.", "-")
    ] = (0.0, 0.0, -1.0)


@dataclass(frozen=True, kw_only=True)
class _MeshedStones:
    """Stones of a table [[meshes]]."""

    stones: Annotated[Stones, Setting("Codes or expressions of the stones that are meshed otherwise.")]


TABLES: Mapping[str, tuple[Key, ...]] = {
    "scene": keys_of(_Title),
    "select": keys_of(Selection),
    "bodies": (replace(_default, default=AUTO, choices=_models), *_lists),
    "joints": keys_of(JointSettings),
    "contact": (*keys_of(DryJoint), *keys_of(ContactSettings)),
    "gravity": keys_of(_Gravity),
    "mesh": keys_of(MeshSettings),
    "time": keys_of(TimeSettings),
    "solver": keys_of(SolverSettings),
    "output": keys_of(Output),
}

SITE_KEYS = keys_of(Site)

MATERIAL_KEYS = (*keys_of(Material), *keys_of(MaterialRule))

ORTHOTROPY_KEYS = keys_of(Orthotropy)

MESH_KEYS = (
    *keys_of(_MeshedStones),
    *(
        replace(key, doc=f"As in `[mesh]`, whose `{key.name}` holds if none is given.", default=None)
        for key in keys_of(MeshSettings)
        if key.name != "ring_size"
    ),
)
