"""From a study file and a database to the problem that its samples share, and to the snapshot that workers read."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from archmodel.query.api import find_rows
from archmodel.store.stone_record import StoneRecord
from ground.errors import SceneError, UsageError
from ground.toml.keys import build
from ground.toml.writer import toml_text
from mechanics.scene.scene import Fidelity
from mechanics.stones.materials import Material, Orthotropy
from pipelines.assess.kept import Kept
from pipelines.assess.study.file import Correlation, StudyFile
from pipelines.assess.study.inputs.distributions import correlation_root
from pipelines.assess.study.inputs.realise import LAW_KEYS, law_value
from pipelines.assess.study.inputs.unknowns import Unknown, Unknowns, expand
from pipelines.assess.study.problem import Problem
from pipelines.assess.study.settings import Acts, InputTable, InputType, QuantityTable
from pipelines.assess.workers.store import Snapshot
from pipelines.run.record import versions
from pipelines.scene.file import parse_scene
from pipelines.scene.selection import Groups, StoneModel, select_groups, select_stones

_RECORDS = (StoneModel, StoneRecord, Material, Orthotropy)
_MATERIAL: Mapping[InputType, str] = {
    InputType.DENSITY: "density",
    InputType.STRENGTH: "compressive_strength",
    InputType.YOUNG: "young",
}


def snapshot_content(file: StudyFile, session: Session) -> dict[str, Any]:
    """Return all that decides on the samples of a study, as plain values.

    Raises
    ------
    SceneError : the scene or an input names no stone, or a value that its stones do not share
    """
    models = select_stones(file.scene, session)
    groups = select_groups(file.scene, session, models)
    named = [_stones(file, number, models, session) for number in range(len(file.inputs))]
    kept = Kept(Path(), _RECORDS)
    return {
        "path": str(Path(file.scene.document.path).resolve()),
        "base": file.base,
        "models": kept.plain(models),
        "groups": [[list(path), [sorted(codes) for codes in sets]] for path, sets in groups.items()],
        "inputs": [asdict(table) for table in file.inputs],
        "stones": [sorted(codes) for codes in named],
        "quantities": [asdict(table) for table in file.quantities],
        "correlations": [
            [list(correlation.inputs), correlation.matrix.tolist()] for correlation in file.correlations
        ],
        "versions": dict(versions()),
    }


@lru_cache(maxsize=2)
def problem_of(snapshot: Snapshot) -> Problem:
    """Return the problem of a snapshot; once in a process.

    Raises
    ------
    UsageError : the file is damaged
    SceneError : an input cannot be, as its distribution or its correlation says
    """
    content = snapshot.content()
    revived = Kept(Path(), _RECORDS).revived(content["models"])
    models = tuple(
        StoneModel(model.record, model.material, None if model.listed is None else Fidelity(model.listed))
        for model in revived
    )
    groups: Groups = {
        tuple(path): tuple(frozenset(codes) for codes in sets) for path, sets in content["groups"]
    }
    scene = parse_scene(toml_text(content["base"]), content["path"])
    inputs = tuple(build(InputTable, _tuples(table)) for table in content["inputs"])
    each: list[Unknown] = []
    for number, table in enumerate(inputs):
        stones = frozenset(content["stones"][number])
        base = law_value(scene, table) if table.type in LAW_KEYS else _shared(table, models, stones)
        each += expand(number, table, models, stones, 0.0 if base is None else base)
    correlations = [
        Correlation(tuple(numbers), np.array(matrix)) for numbers, matrix in content["correlations"]
    ]
    quantities = tuple(build(QuantityTable, _tuples(table)) for table in content["quantities"])
    unknowns = _correlated(each, inputs, correlations)
    return Problem(scene, content["base"], models, groups, inputs, quantities, unknowns)


def _tuples(table: Mapping[str, Any]) -> dict[str, Any]:
    return {name: tuple(value) if isinstance(value, list) else value for name, value in table.items()}


def _stones(file: StudyFile, number: int, models: Sequence[StoneModel], session: Session) -> frozenset[str]:
    """Return the codes of the stones of an input: those that it names and whose depth its rule gives."""
    table, path = file.inputs[number], ("inputs", str(number), "stones")
    known = frozenset(model.record.code for model in models)
    if table.type in LAW_KEYS or table.type in (InputType.LOAD, InputType.DIRECTION, InputType.RECORD):
        return frozenset()
    codes = known if not table.stones else frozenset[str]()
    for item in table.stones:
        if item in known:
            codes |= {item}
            continue
        try:
            rows = find_rows(session, file.scene.selection.kind, [item], columns=("code",))
        except UsageError as error:
            file.document.fail(f"stones: {error.what}", *path, remedy=error.remedy)
        found = {str(row["code"]) for row in rows} & known
        if not found:
            file.document.fail(
                f"no selected stone satisfies {item!r}", *path, remedy="try it with: moma query"
            )
        codes |= found
    if table.rule is not None:
        ruled = {
            model.record.code
            for model in models
            if model.record.depth_origin != "stone"
            and table.rule in (model.record.kind, model.record.depth_source)
        }
        codes &= ruled
        if not codes:
            file.document.fail(
                f"no stone has its depth from the rule {table.rule!r}",
                *path[:2],
                "rule",
                remedy="name the kind of stones of a line 'depth KIND …' of the survey",
            )
    with file.document.at(*path[:2]):
        _shared(table, models, codes)
    return codes


def _shared(table: InputTable, models: Sequence[StoneModel], codes: frozenset[str]) -> float | None:
    """Return the value that the stones of an input share, where it needs one.

    Raises
    ------
    SceneError : they do not share it
    """
    if table.acts is not Acts.VALUE:
        return None
    chosen = [model for model in models if model.record.code in codes]
    if table.type in _MATERIAL:
        values = {getattr(model.material, _MATERIAL[table.type]) for model in chosen}
    elif table.type is InputType.DEPTH and (table.sigma is not None or table.cov is not None):
        values = {model.record.depth for model in chosen}
    else:
        return None
    if None in values:
        raise SceneError(f"{table.type} is not stated for all its stones", remedy="state it in the scene")
    if table.mean is None and len(values) > 1:
        raise SceneError(
            f"its stones have {len(values)} values of {table.type}",
            remedy="give acts = 'factor' or 'change', a mean, or name fewer stones",
        )
    return float(next(iter(values))) if len(values) == 1 else None


def _correlated(
    each: Sequence[Unknown], inputs: Sequence[InputTable], correlations: Sequence[Correlation]
) -> Unknowns:
    """Return the unknowns, with the common ones of correlated inputs correlated."""
    if not correlations:
        return Unknowns(tuple(each))
    rows: list[int] = []
    blocks: list[Any] = []
    for correlation in correlations:
        places = []
        for number in correlation.inputs:
            common = [
                place
                for place, unknown in enumerate(each)
                if unknown.input == number and unknown.part == "common"
            ]
            if len(common) != 1:
                name = inputs[number].name or str(inputs[number].type)
                raise SceneError(
                    f"the input {name!r} has {len(common)} common unknowns, so its correlation has no meaning",
                    remedy="correlate inputs with one value each",
                )
            places += common
        rows += places
        blocks.append(correlation.matrix)
    matrix = np.eye(len(rows))
    start = 0
    for block in blocks:
        matrix[start : start + len(block), start : start + len(block)] = block
        start += len(block)
    return Unknowns(tuple(each), np.array(rows), correlation_root(matrix))
