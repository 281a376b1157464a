"""Scene files: TOML text → a SceneFile in which every key has been checked.

Nothing runs and no database is read here; stones are still expressions. docs/scene.md lists the keys.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from archmodel.store.lookalikes import explained, plain_form
from ground.errors import SceneError
from ground.settings import Setting
from ground.toml.keys import Stones, Vector, build, keys_of, typed_values
from ground.toml.lines import key_lines, parse_toml, read_text
from ground.toml.schema import Key, TomlDocument, check_table, nearest
from ground.units import GRAVITY
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Fidelity, SolverSettings, TimeSettings
from mechanics.stones.materials import Material, Orthotropy
from pipelines.draw.catalogue import PICTURES
from pipelines.scene.array_tables import ArrayTable, read_entries
from pipelines.scene.laws import BONDS, JointLaw, read_laws
from pipelines.scene.loads import ASSESS_TYPES, read_loads, read_throws
from pipelines.scene.pushover import Pushing, read_pushover
from pipelines.scene.settings import Fidelities, MaterialRule, MeshSettings, Output, Selection
from pipelines.scene.site import Site
from pipelines.scene.stages import read_stages
from survey.joints.settings import JointMode, JointSettings

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

    magnitude: Annotated[float, Setting("Acceleration of gravity.", "m/s²", at_least=0)] = GRAVITY
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


BESIDE = ("diagnosis", "hypotheses")
"""Tables that may stand in a scene file and are read by `moma diagnose` alone."""


@dataclass(frozen=True)
class SceneFile:
    """A scene as its author wrote it, checked, with all defaults filled in.

    Attributes
    ----------
    document : file and lines, for error messages
    text : the file, as it is kept with the run
    name : title
    gravity : (3,) acceleration [m/s²]
    mesh : finite elements of deformable stones that no entry of `meshes` names
    meshes : finite elements of particular groups of stones
    laws : of particular joints; the general law is in `contact`
    loads, throws : actions besides gravity, and initial motions
    stages : of building; none: all stones stand from the beginning
    assess : live loads whose limits are sought
    site : seismic action for the check by a code; None: not stated
    pushover : test rig and displacements of `moma pushover`; None: there is none
    """

    document: TomlDocument
    text: str
    name: str
    selection: Selection
    materials: tuple[MaterialRule, ...]
    bodies: Fidelities
    joints: JointSettings
    contact: ContactSettings
    gravity: tuple[float, float, float]
    mesh: MeshSettings
    meshes: tuple[ArrayTable, ...]
    time: TimeSettings
    solver: SolverSettings
    output: Output
    laws: tuple[JointLaw, ...]
    loads: tuple[ArrayTable, ...]
    throws: tuple[ArrayTable, ...]
    stages: tuple[ArrayTable, ...]
    assess: tuple[ArrayTable, ...]
    site: Site | None
    pushover: Pushing | None


def read_scene(path: str | Path) -> SceneFile:
    """Read and check a scene file.

    Raises
    ------
    SceneError : with file and line, at the first mistake

    >>> scene = read_scene("data/samples/window/window.toml")
    >>> scene.name, scene.bodies.fixed, scene.materials[0].material.density
    ('Window bay', ('course = 1',), 2350.0)
    """
    return parse_scene(read_text(path, SceneError, missing="no such scene file"), str(path))


def parse_scene(text: str, path: str) -> SceneFile:
    """Check the text of a scene file; `path` is for the messages.

    >>> scene = parse_scene('''
    ... [materials.limestone]
    ... density = 2350.0
    ... young = 12e9
    ... poisson = 0.2
    ... ''', "tower.toml")
    >>> scene.name, scene.contact.law.friction, scene.time.step
    ('tower', 0.6, 0.001)
    """
    toml = parse_toml(text, path, SceneError, "see docs/scene.md for a scene to start from")
    document = TomlDocument(path, key_lines(text))
    tables = _checked_tables(document, toml)
    laws = read_laws(document, toml)
    loads, throws = read_loads(document, toml), read_throws(document, toml)
    return SceneFile(
        document=document,
        text=text,
        name=tables["scene"]["name"] or Path(path).stem,
        selection=build(Selection, tables["select"]),
        materials=_materials(document, toml),
        bodies=_fidelities(tables["bodies"]),
        joints=_joints(document, laws, tables["joints"]),
        contact=_contact(document, tables["contact"]),
        gravity=_gravity(document, **tables["gravity"]),
        mesh=build(MeshSettings, tables["mesh"]),
        meshes=read_entries(document, toml, "meshes", {"mesh": MESH_KEYS}),
        time=_time(document, tables["time"]),
        solver=build(SolverSettings, tables["solver"]),
        output=_output(document, tables["output"]),
        laws=laws,
        loads=loads,
        throws=throws,
        stages=read_stages(document, toml, loads, throws),
        assess=read_entries(document, toml, "assess", ASSESS_TYPES),
        site=_site(document, toml),
        pushover=read_pushover(document, toml),
    )


def _fidelities(values: dict[str, Any]) -> Fidelities:
    default = None if values["default"] == AUTO else values["default"]
    return build(Fidelities, values | {"default": default})


def _checked_tables(document: TomlDocument, toml: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    allowed = [*TABLES, "materials", "site", "pushover", *ARRAYS, *BESIDE]
    for name, content in toml.items():
        if name in (*ARRAYS, *BESIDE):
            continue
        if name not in allowed:
            what = f"unknown table [{name}]" if isinstance(content, dict | list) else f"unknown key {name!r}"
            document.fail(what, name, remedy=nearest(name, allowed))
        if not isinstance(content, dict):
            document.fail(f"{name!r} is not a table", name, remedy=f"write [{name}] on a line of its own")
    return {name: check_table(document, (name,), toml.get(name, {}), keys) for name, keys in TABLES.items()}


def _site(document: TomlDocument, toml: Mapping[str, Any]) -> Site | None:
    if "site" not in toml:
        return None
    values: dict[str, Any] = check_table(document, ("site",), toml["site"], SITE_KEYS)
    with document.at("site"):
        return Site(**typed_values(Site, values))


def _materials(document: TomlDocument, toml: Mapping[str, Any]) -> tuple[MaterialRule, ...]:
    tables = toml.get("materials", {})
    if not tables:
        document.fail("no material", "materials", remedy="add a table such as [materials.limestone]")
    rules, forms = [], dict[str, str]()
    for name, content in tables.items():
        if (earlier := forms.setdefault(plain_form(name), name)) != name:
            what = f"the material {explained(name, earlier)}"
            document.fail(what, "materials", name, remedy="write both with the same characters")
        if not isinstance(content, dict):
            document.fail(
                f"{name!r} stands in no material", "materials", name, remedy="write it under [materials.NAME]"
            )
        plain = {key: value for key, value in content.items() if key != "orthotropy"}
        values: dict[str, Any] = check_table(document, ("materials", name), plain, MATERIAL_KEYS)
        orthotropy = _orthotropy(document, name, content["orthotropy"]) if "orthotropy" in content else None
        with document.at("materials", name, "orthotropy"):
            material = Material(name, **typed_values(Material, values), orthotropy=orthotropy)
            rules.append(MaterialRule(material, values["stones"]))
    general = [rule.material.name for rule in rules if not rule.stones]
    if len(general) > 1:
        document.fail(
            f"materials {' and '.join(map(repr, general))} both lack 'stones'",
            "materials",
            general[1],
            remedy="only one material can be that of all other stones",
        )
    return tuple(rules)


def _orthotropy(document: TomlDocument, material: str, content: Any) -> Orthotropy:
    path = ("materials", material, "orthotropy")
    if not isinstance(content, dict):
        document.fail("'orthotropy' is not a table", *path, remedy=f"write [{'.'.join(path)}]")
    values: dict[str, Any] = check_table(document, path, content, ORTHOTROPY_KEYS)
    axes = np.array(values.pop("axes"))
    lengths = np.linalg.norm(axes, axis=1)
    if len(axes) != 3 or not lengths.all():
        document.fail(
            "axes are not three directions", *path, "axes", remedy="give for example [[1, 0, 0], …]"
        )
    return Orthotropy(**values, axes=tuple(map(tuple, (axes / lengths[:, None]).tolist())))


def _joints(document: TomlDocument, laws: Sequence[JointLaw], values: Mapping[str, Any]) -> JointSettings:
    settings = build(JointSettings, values)
    if settings.mode is JointMode.MORTAR and not any(law.entry.type in BONDS for law in laws):
        document.fail(
            'mode = "mortar", but no law says how mortar bonds',
            "joints",
            "mode",
            remedy='add [[laws]] of type "mortar", "cohesive_zone" or "elastic_joint"',
        )
    return settings


def _contact(document: TomlDocument, values: Mapping[str, Any]) -> ContactSettings:
    with document.at("contact", "dynamic_friction"):
        law = build(DryJoint, values)
    with document.at("contact", "placement"):
        return replace(build(ContactSettings, values), law=law)


def _gravity(
    document: TomlDocument, magnitude: float, direction: tuple[float, float, float]
) -> tuple[float, float, float]:
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        document.fail("direction has no length", "gravity", "direction", remedy="give for example [0, 0, -1]")
    x, y, z = (magnitude * component / length for component in direction)
    return x, y, z


def _time(document: TomlDocument, values: dict[str, Any]) -> TimeSettings:
    if values["duration"] < values["step"]:
        document.fail(
            f"duration = {values['duration']:g} s is shorter than step = {values['step']:g} s",
            "time",
            "duration",
            remedy="give at least one step",
        )
    if not math.isfinite(values["duration"] / values["step"]):
        document.fail(
            f"step = {values['step']:g} s is too short to count the steps of {values['duration']:g} s",
            "time",
            "step",
            remedy="usual steps are 0.5 to 10 ms",
        )
    return build(TimeSettings, values)


def _output(document: TomlDocument, values: Mapping[str, Any]) -> Output:
    for name in values["pictures"] or ():
        if name not in PICTURES:
            document.fail(f"unknown picture {name!r}", "output", "pictures", remedy=nearest(name, PICTURES))
    return build(Output, values)
