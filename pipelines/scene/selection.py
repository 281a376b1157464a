"""Stones of a scene: its expressions evaluated in the database."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from archmodel.query.api import MAX_EXPRESSIONS, find, find_rows
from archmodel.store.stone_record import StoneRecord
from archmodel.store.stones import load_stones
from ground.errors import QueryError, UsageError
from ground.toml.lines import Path
from ground.toml.schema import nearest
from mechanics.scene.scene import Fidelity
from mechanics.stones.materials import Material
from pipelines.scene.file import SceneFile

_CODE = re.compile(r"[\w.:/+-]+")  # a text without blanks or comparison is meant as a code

STRESS = ("output", "stress")
"""Key that names the stones whose stress is wanted."""

SERIES = ("output", "series")
"""Key that names the stones whose motion is wanted in every step."""

# the codes of each group of stones that a table of an array names, by the table's path; those of STRESS and SERIES
Groups = Mapping[Path, tuple[frozenset[str], ...]]


@dataclass(frozen=True)
class StoneModel:
    """One stone of a scene: its record, its material, and its model if a list of [bodies] names it."""

    record: StoneRecord
    material: Material
    listed: Fidelity | None


def select_stones(scene: SceneFile, session: Session) -> tuple[StoneModel, ...]:
    """Select the stones of a scene, in the order of the survey.

    Raises
    ------
    SceneError : at the key whose expression is invalid or names no stone, or where a stone has no material, or two
    """
    records = _selected(scene, session)
    materials = _materials(scene, session, records)
    fidelities = _fidelities(scene, session, records)
    return tuple(
        StoneModel(record, materials[code], fidelities.get(code)) for code, record in records.items()
    )


def select_groups(scene: SceneFile, session: Session, models: Sequence[StoneModel]) -> Groups:
    """Return the selected stones that the arrays of a scene name, and those of its outputs.

    Raises
    ------
    SceneError : at the key whose expression is invalid or names no stone
    """
    records = {model.record.code: model.record for model in models}
    entries = (
        *scene.meshes,
        *(law.entry for law in scene.laws),
        *scene.loads,
        *scene.throws,
        *scene.stages,
        *scene.assess,
    )
    groups: dict[Path, tuple[frozenset[str], ...]] = {
        entry.path: tuple(
            frozenset(_named(scene, session, records, (*entry.path, key), items))
            for key, items in entry.groups
        )
        for entry in entries
    }
    for key, items in ((STRESS, scene.output.stress or ()), (SERIES, scene.output.series)):
        groups[key] = (frozenset(_named(scene, session, records, key, items)),)
    return groups


def _selected(scene: SceneFile, session: Session) -> dict[str, StoneRecord]:
    """Return stones by code: of the kind, satisfying all of `where`, except those excluded."""
    selection, document = scene.selection, scene.document
    try:
        entities = find(session, selection.kind, selection.where)
    except UsageError as error:
        key = "where" if isinstance(error, QueryError) else "kind"
        document.fail(error.what, "select", key, remedy=error.remedy)
    if not entities:
        document.fail(
            f"no stone is selected ({', '.join([f'kind {selection.kind}', *selection.where])})",
            "select",
            remedy="try the selection with: moma query",
        )
    out = _named(
        scene, session, {entity.code: entity for entity in entities}, ("select", "exclude"), selection.exclude
    )
    left = [entity for entity in entities if entity.code not in out]
    if not left:
        document.fail("all selected stones are excluded", "select", "exclude", remedy="exclude fewer")
    return {record.code: record for record in load_stones(session, left)}


def _materials(scene: SceneFile, session: Session, records: Mapping[str, StoneRecord]) -> dict[str, Material]:
    """Return the material of every stone: that of the one rule that names it, or the general one."""
    general: Material | None = None
    materials: dict[str, Material] = {}
    for rule in scene.materials:
        if not rule.stones:
            general = rule.material
            continue
        path = ("materials", rule.material.name, "stones")
        for code in _named(scene, session, records, path, rule.stones):
            if code in materials:
                both = f"{materials[code].name!r} and {rule.material.name!r}"
                scene.document.fail(f"stone {code} is of two materials, {both}", *path, remedy="name it once")
            materials[code] = rule.material
    if general is not None:
        return {code: materials.get(code, general) for code in records}
    without = [code for code in records if code not in materials]
    if without:
        scene.document.fail(
            f"{len(without)} stones have no material, e.g. {without[0]}",
            "materials",
            remedy="leave 'stones' out of one material: it is that of all others",
        )
    return materials


def _fidelities(
    scene: SceneFile, session: Session, records: Mapping[str, StoneRecord]
) -> dict[str, Fidelity]:
    """Return the fidelity of the stones that a list names."""
    lists = {
        Fidelity.RIGID: scene.bodies.rigid,
        Fidelity.DEFORMABLE: scene.bodies.deformable,
        Fidelity.FIXED: scene.bodies.fixed,
    }
    named = {
        fidelity: _named(scene, session, records, ("bodies", str(fidelity)), items)
        for fidelity, items in lists.items()
    }
    both = named[Fidelity.RIGID] & named[Fidelity.DEFORMABLE] - named[Fidelity.FIXED]
    if both:
        scene.document.fail(
            f"stone {min(both)} is both rigid and deformable", "bodies", "deformable", remedy="name it in one"
        )
    # FIXED comes last and so takes precedence over the others
    return {code: fidelity for fidelity, codes in named.items() for code in codes}


def _named(
    scene: SceneFile, session: Session, records: Mapping[str, object], key: Path, items: Sequence[str]
) -> set[str]:
    """Return the codes, keys of `records`, that any of the items, codes or expressions, names."""
    codes: set[str] = set()
    for item in items:
        if item in records:
            codes.add(item)
            continue
        if _CODE.fullmatch(item):
            scene.document.fail(
                f"{key[-1]}: {item!r} is not the code of a selected stone",
                *key,
                remedy=nearest(item, records),
            )
        try:
            matching = _matching(scene, session, item) & records.keys()
        except UsageError as error:
            scene.document.fail(f"{key[-1]}: {error.what}", *key, remedy=error.remedy)
        if not matching:
            what = f"{key[-1]}: no selected stone satisfies {item!r}"
            scene.document.fail(
                what, *key, remedy=_without_course(item, records) or "try it with: moma query"
            )
        codes |= matching
    return codes


def _without_course(item: str, records: Mapping[str, object]) -> str:
    """Return what to do about an expression on courses where no stone has one, as of masks; nothing elsewhere."""
    stones = [record for record in records.values() if isinstance(record, StoneRecord)]
    if not stones or "course" not in item or any(stone.course is not None for stone in stones):
        return ""
    lowest_top = min(float(stone.outline[:, 2].max()) for stone in stones)
    lowest = [stone.code for stone in stones if stone.outline[:, 2].mean() < lowest_top]
    codes = ", ".join(f'"{code}"' for code in lowest)
    return f"no selected stone has a course: name stones by codes; the lowest are [{codes}]"


def _matching(scene: SceneFile, session: Session, item: str) -> set[str]:
    """Return the codes of stones that satisfy an expression and the selection, so that no others are read."""
    selection = scene.selection
    where = [*selection.where[: MAX_EXPRESSIONS - 1], item]
    rows = find_rows(session, selection.kind, where, columns=("code",))
    return {str(row["code"]) for row in rows}
