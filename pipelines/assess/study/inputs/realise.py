"""A scene and its stones with the values of one sample in place of those that its author and the survey state."""

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.store.stone_record import StoneRecord
from ground.errors import SceneError
from ground.toml.writer import toml_text
from mechanics.arrays import Array
from pipelines.assess.study.inputs.unknowns import PLANE_PARTS, Unknown
from pipelines.assess.study.settings import Acts, InputTable, InputType
from pipelines.scene.file import SceneFile, parse_scene
from pipelines.scene.selection import StoneModel

GEOMETRY = frozenset({InputType.DEPTH, InputType.PLANE, InputType.POINT, InputType.STATION})
"""Inputs that change the shape of stones, so that joints are closed again."""

LAW_KEYS: Mapping[InputType, tuple[str, ...]] = {
    InputType.FRICTION: ("friction",),
    InputType.COHESION: ("shear",),
    InputType.TENSION: ("tension",),
    InputType.STIFFNESS: ("normal_stiffness", "shear_stiffness"),
}
"""Keys of laws that an input changes."""

_MATERIAL: Mapping[InputType, str] = {
    InputType.DENSITY: "density",
    InputType.STRENGTH: "compressive_strength",
    InputType.YOUNG: "young",
}
_LOADED = ("force", "scale", "acceleration", "displacement", "distance", "velocity", "rate")
"""Keys of [[loads]] that the factor of a load multiplies."""


@dataclass(frozen=True)
class Realised:
    """A scene of one sample.

    Attributes
    ----------
    scene, models : with its values
    turn : angle by which pushes turn about the vertical [rad]
    """

    scene: SceneFile
    models: tuple[StoneModel, ...]
    turn: float


def realise(
    scene: SceneFile,
    base: Mapping[str, Any],
    models: tuple[StoneModel, ...],
    inputs: Sequence[InputTable],
    valued: Sequence[tuple[Unknown, float]],
) -> Realised:
    """Return a scene and its stones with values of the unknowns.

    Parameters
    ----------
    scene, base : as their author wrote them, checked, and as the plain contents of the file
    models : stones of the survey
    inputs : of the study
    valued : unknowns with their values

    Raises
    ------
    SceneError : a value is out of the bounds of what it stands for
    """
    tables, turn = deepcopy(dict(base)), 0.0
    for number, table in enumerate(inputs):
        values = [(unknown, value) for unknown, value in valued if unknown.input == number]
        match table.type:
            case kind if kind in LAW_KEYS:
                _change_laws(tables, scene, table, values)
            case InputType.LOAD:
                for _, value in values:
                    _scale_load(tables, table, value)
            case InputType.RECORD:
                for _, value in values:
                    _name_record(tables, scene, table, value)
            case InputType.DIRECTION:
                turn += float(np.radians(sum(value for _, value in values)))
    changed = scene if tables == base else parse_scene(toml_text(tables), scene.document.path)
    return Realised(changed, changed_stones(models, inputs, valued), turn)


def changed_stones(
    models: Sequence[StoneModel], inputs: Sequence[InputTable], valued: Sequence[tuple[Unknown, float]]
) -> tuple[StoneModel, ...]:
    """Return stones of the survey, some or all, with values of the unknowns that act on them.

    Raises
    ------
    SceneError : a value is out of the bounds of what it stands for
    """
    by_code = {model.record.code: model for model in models}
    for number, table in enumerate(inputs):
        values = [(unknown, value) for unknown, value in valued if unknown.input == number]
        if table.type in _MATERIAL:
            _change_stones(by_code, values, _material_changer(_MATERIAL[table.type]))
        elif table.type is InputType.DEPTH:
            _change_stones(by_code, values, _deepened)
        elif table.type in GEOMETRY:
            _shift_stones(by_code, values)
    return tuple(by_code.values())


def law_value(scene: SceneFile, table: InputTable) -> float | None:
    """Return the value of a law's key in the scene; None where it has none."""
    laws = [scene.contact.law, *(rule.law for rule in scene.laws)]
    keys = LAW_KEYS[table.type]
    chosen = laws if table.law is None else laws[table.law : table.law + 1]
    found = {float(value) for law in chosen if (value := getattr(law, keys[0], None)) is not None}
    return found.pop() if len(found) == 1 else None


def records_of(scene: SceneFile, folder: str) -> list[Path]:
    """Return the files of a folder beside the scene, in the order of their names."""
    place = Path(scene.document.path).parent / folder
    return sorted(file for file in place.iterdir() if file.is_file()) if place.is_dir() else []


def _change_laws(
    tables: dict[str, Any],
    scene: SceneFile,
    table: InputTable,
    values: Sequence[tuple[Unknown, float]],
) -> None:
    laws = [(tables.setdefault("contact", {}), scene.contact.law)]
    laws += zip(tables.get("laws", []), (rule.law for rule in scene.laws), strict=True)
    for written, law in laws if table.law is None else laws[table.law : table.law + 1]:
        for key in LAW_KEYS[table.type]:
            old = getattr(law, key, None)
            if old is not None:
                for _, value in values:
                    written[key] = _changed(table.acts, value, old)


def _changed(acts: Acts, value: float, old: float) -> float:
    match acts:
        case Acts.VALUE:
            return value
        case Acts.FACTOR:
            return old * value
        case Acts.CHANGE:
            return old + value


def _change_stones(
    by_code: dict[str, StoneModel],
    values: Sequence[tuple[Unknown, float]],
    change: Callable[[StoneModel, Callable[[float], float]], StoneModel],
) -> None:
    """Change an attribute of stones by what they have in common first, and by the scatter of each then."""
    for unknown, value in values:
        scatters = unknown.part == "scatter"
        acts = unknown.acts
        if scatters:
            acts, value = (Acts.FACTOR, 1.0 + value) if acts is Acts.FACTOR else (Acts.CHANGE, value)
        new = partial(_changed, acts, value)
        for code in by_code.keys() & set(unknown.stones):
            by_code[code] = change(by_code[code], new)


def _material_changer(name: str) -> Callable[[StoneModel, Callable[[float], float]], StoneModel]:
    def change(model: StoneModel, new: Callable[[float], float]) -> StoneModel:
        """Return a stone with a material whose value is changed."""
        old = getattr(model.material, name)
        if old is None:
            raise SceneError(f"{model.record.code}: its material states no {name}", remedy="state one")
        changed: dict[str, Any] = {name: new(old)}
        return replace(model, material=replace(model.material, **changed))

    return change


def _deepened(model: StoneModel, new: Callable[[float], float]) -> StoneModel:
    record = model.record
    depth = new(record.depth)
    if depth <= 0.0:
        raise SceneError(f"{record.code}: depth = {depth:.3g} m", remedy="give depths a smaller sigma")
    if record.provenance in ("points", "photograph"):
        return replace(model, record=replace(record, depth=depth))
    # a solid grows along the normal of its face
    behind = (record.solid_vertices - record.centroid) @ record.normal
    moved = record.solid_vertices + np.outer(behind * (depth / record.depth - 1.0), record.normal)
    return replace(model, record=replace(record, depth=depth, solid_vertices=moved))


def _scale_load(tables: dict[str, Any], table: InputTable, factor: float) -> None:
    entries = tables.get("loads", [])
    chosen = entries if table.entry is None else entries[table.entry - 1 : table.entry]
    for entry in chosen:
        for key in _LOADED:
            if key in entry:
                entry[key] = _scaled(entry[key], factor)
        if entry.get("type") == "ground_motion":
            entry.setdefault("scale", factor)


def _scaled(value: Any, factor: float) -> Any:
    if isinstance(value, Mapping):
        return {**value, "value": _scaled(value["value"], factor)}
    if isinstance(value, list):
        return [_scaled(entry, factor) for entry in value]
    return factor * value


def _name_record(tables: dict[str, Any], scene: SceneFile, table: InputTable, value: float) -> None:
    files = records_of(scene, table.folder or "")
    entry = tables["loads"][(table.entry or 1) - 1]
    key = next((axis for axis in ("x", "y", "z", "station") if axis in entry), "x")
    entry[key] = str(files[min(int(value * len(files)), len(files) - 1)].resolve())


def _shift_stones(by_code: dict[str, StoneModel], values: Sequence[tuple[Unknown, float]]) -> None:
    """Move the measured points of faces: by heights and tilts of their plane, by corner, or as a whole."""
    for unknown, value in values:
        for code in by_code.keys() & set(unknown.stones):
            model = by_code[code]
            by_code[code] = replace(model, record=_shifted(model.record, unknown.part, value))


def _shifted(record: StoneRecord, part: str, value: float) -> StoneRecord:
    if part in ("x", "y", "z"):
        move = value * np.eye(3)["xyz".index(part)]
        return _moved(record, lambda points: np.tile(move, (len(points), 1)))
    if part in PLANE_PARTS:
        which, normal, centre = PLANE_PARTS.index(part), record.normal, record.centroid
        along = None if which == 2 else record.axes[which]

        def lifted(points: Array) -> Array:
            """Return the displacements of points of a face along its normal [m]."""
            heights = value * (np.ones(len(points)) if along is None else (points - centre) @ along)
            return np.outer(heights, normal)

        return _moved(record, lifted)
    corner, axis = part.split()
    vertices = record.vertices.copy()
    vertices[int(corner), "xyz".index(axis)] += value
    return replace(record, vertices=vertices)


def _moved(record: StoneRecord, move: Callable[[Array], Array]) -> StoneRecord:
    """Return a stone whose measured points and solid are moved."""
    names = ("vertices", "points", "outline", "solid_vertices")
    changed: dict[str, Any] = {
        name: getattr(record, name) + move(getattr(record, name))
        for name in names
        if len(getattr(record, name))
    }
    centroid = record.centroid + move(record.centroid[None])[0]
    changed |= {"centroid": centroid, "offset": float(record.normal @ centroid)}
    return replace(record, **changed)
