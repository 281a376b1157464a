"""Files of studies: TOML text → a StudyFile in which every key has been checked, without a database."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from archmodel.store.stone_record import StoneRecord
from ground.errors import SceneError, UsageError
from ground.toml.keys import read_table
from ground.toml.lines import key_lines, parse_toml, read_text
from ground.toml.schema import TomlDocument, nearest, tables_of
from mechanics.arrays import Array
from pipelines.assess.study.inputs.distributions import Distribution, correlation_root
from pipelines.assess.study.inputs.realise import LAW_KEYS, law_value, records_of
from pipelines.assess.study.quantities import live_load, quantity_name
from pipelines.assess.study.settings import (
    Acts,
    CorrelationTable,
    InputTable,
    InputType,
    Method,
    QuantityTable,
    QuantityType,
    Shape,
    StudyTable,
)
from pipelines.scene.file import SceneFile, parse_scene

_LIMITS = (QuantityType.BOUND, QuantityType.CANDIDATE, QuantityType.HELD)
_TABLES = ("study", "inputs", "correlations", "quantities")
_SURVEYED = (InputType.DEPTH, InputType.PLANE, InputType.POINT)
_BOUNDED = (Shape.UNIFORM, Shape.TRIANGULAR)
_AGGREGATED = ("depth", "area", "length", "height", "offset", "rms")


@dataclass(frozen=True)
class Correlation:
    """Correlation of inputs.

    Attributes
    ----------
    inputs : their numbers
    matrix : (k, k) [-]
    """

    inputs: tuple[int, ...]
    matrix: Array


@dataclass(frozen=True)
class StudyFile:
    """A study as its author wrote it, checked.

    Attributes
    ----------
    document : file and lines, for messages
    text : of the file
    study : method, samples and seed
    scene, base : the scene, checked, and as the plain contents of its file
    inputs, quantities : one or more
    correlations : of inputs
    """

    document: TomlDocument
    text: str
    study: StudyTable
    scene: SceneFile
    base: Mapping[str, Any]
    inputs: tuple[InputTable, ...]
    quantities: tuple[QuantityTable, ...]
    correlations: tuple[Correlation, ...]


def read_study(path: str | Path) -> StudyFile:
    """Read and check the file of a study.

    Raises
    ------
    SceneError : with file and line, at the first mistake
    """
    text = read_text(path, SceneError, missing="no such study file")
    given = parse_toml(text, str(path), SceneError, "see docs/howto/study.md for one to start from")
    document = TomlDocument(str(path), key_lines(text))
    for name in given:
        if name not in _TABLES:
            document.fail(f"unknown table [{name}]", name, remedy=nearest(name, _TABLES))
    study = read_table(document, ("study",), given.get("study", {}), StudyTable)
    beside = Path(path).parent / study.scene
    with document.at("study", "scene"):
        inner = read_text(beside, SceneError, missing="no such scene file")
    scene = parse_scene(inner, str(beside))
    base = parse_toml(inner, str(beside), SceneError, "see docs/scene.md")
    inputs = _inputs(document, given, scene)
    return StudyFile(
        document,
        text,
        study,
        scene,
        base,
        inputs,
        _quantities(document, given, study.method, study.controls),
        _correlations(document, given, inputs),
    )


def _inputs(document: TomlDocument, given: Mapping[str, Any], scene: SceneFile) -> tuple[InputTable, ...]:
    inputs: list[InputTable] = []
    for path, table in tables_of(document, given, "inputs"):
        made = read_table(document, path, table, InputTable, "[[inputs]]")
        name = made.name or str(made.type)
        if name in [other.name or str(other.type) for other in inputs]:
            document.fail(f"two inputs {name!r}", *path, remedy="name each differently: name = …")
        with document.at(*path):
            _check_input(made, scene)
        inputs.append(made)
    if not inputs:
        document.fail("no input", "inputs", remedy="write [[inputs]] above each thing that is not known")
    return tuple(inputs)


def _check_input(table: InputTable, scene: SceneFile) -> None:
    bounded = table.distribution in _BOUNDED
    if bounded and (table.low is None or table.high is None):
        raise SceneError(f"a {table.distribution} input needs low and high", remedy="give both")
    if bounded and (table.sigma is not None or table.cov is not None):
        raise SceneError(f"a {table.distribution} input has no sigma", remedy="leave out sigma and cov")
    if table.sigma is not None and table.cov is not None:
        raise SceneError("both sigma and cov", remedy="give one of them")
    spread = bounded or bool(table.sigma) or bool(table.cov) or table.scatter > 0.0
    if not spread and table.type not in (*_SURVEYED, InputType.RECORD):
        raise SceneError(f"{table.type} is certain", remedy="give sigma, cov or scatter, or leave it out")
    if bounded:
        low, high = table.low or 0.0, table.high or 0.0
        mode = 0.5 * (low + high) if table.mode is None else table.mode
        Distribution(table.distribution, low=low, high=high, mode=mode)
    if table.type in LAW_KEYS:
        _check_law(table, scene)
    if table.type is InputType.RECORD:
        files = records_of(scene, table.folder or "")
        if not files or (table.entry or 1) > len(scene.loads):
            raise SceneError(
                f"no record in the folder {table.folder!r}, or no such entry of [[loads]]",
                remedy="name a folder beside the scene, and the entry of [[loads]] with the ground motion",
            )
    if table.type is InputType.LOAD and (table.entry or 1) > len(scene.loads):
        raise SceneError("no such entry of [[loads]]", remedy=f"the scene has {len(scene.loads)}")


def _check_law(table: InputTable, scene: SceneFile) -> None:
    keys, laws = LAW_KEYS[table.type], [scene.contact.law, *(rule.law for rule in scene.laws)]
    chosen = laws if table.law is None else laws[table.law : table.law + 1]
    if all(getattr(law, keys[0], None) is None for law in chosen):
        raise SceneError(f"no joint has the key {keys[0]!r}", remedy="add a law of joints that has it")
    if table.stones or table.scatter:
        raise SceneError(
            f"{table.type} is of joints, not of stones",
            remedy="give the joints an entry of [[laws]] in the scene, and its number as law",
        )
    if table.acts is Acts.VALUE and table.mean is None and law_value(scene, table) is None:
        raise SceneError(
            f"joints have several values of {keys[0]}",
            remedy="name one entry by law, or give acts = 'factor'",
        )


def _quantities(
    document: TomlDocument, given: Mapping[str, Any], method: Method, controls: int
) -> tuple[QuantityTable, ...]:
    found: list[QuantityTable] = []
    for path, table in tables_of(document, given, "quantities"):
        made = read_table(document, path, table, QuantityTable, "[[quantities]]")
        with document.at(*path):
            _check_quantity(made)
        if quantity_name(made) in map(quantity_name, found):
            document.fail(f"two quantities {quantity_name(made)!r}", *path, remedy="name each differently")
        found.append(made)
    if not found:
        document.fail("no quantity", "quantities", remedy="write [[quantities]] above each that is asked for")
    first = found[0]
    needs = method in (Method.FORM, Method.FIRST_ORDER)
    if needs and first.type is not QuantityType.BOUND:
        what = f"{method} needs a gradient, and {first.type} has none"
        document.fail(what, "study", "method", remedy="ask for a bound first, or give method = 'subset'")
    if controls and not any(table.type is QuantityType.BOUND for table in found):
        what = "controls without a bound among the quantities"
        document.fail(
            what, "study", "controls", remedy='write [[quantities]] with type = "bound", or leave it out'
        )
    fails = first.fails_below is not None or first.fails_above is not None
    if method in (Method.FORM, Method.SUBSET) and not fails:
        what = f"{method} needs to know when the first quantity fails"
        document.fail(what, "quantities", "0", remedy="give fails_below or fails_above")
    return tuple(found)


def _check_quantity(table: QuantityTable) -> None:
    if table.type in _LIMITS:
        if table.load is None:
            raise SceneError(f"a {table.type} of no load", remedy='give load = "horizontal x", for example')
        try:
            live_load(table)
        except UsageError as error:
            raise SceneError(error.what, remedy=error.remedy) from None
    if table.type is QuantityType.SUMMARY and not table.key:
        raise SceneError("a number of the summary without its key", remedy="give key, as in summary.json")
    if table.type is QuantityType.AGGREGATE:
        if table.key not in _AGGREGATED or table.key not in StoneRecord.__dataclass_fields__:
            raise SceneError(
                f"key = {table.key!r} is no number of stones", remedy=nearest(str(table.key), _AGGREGATED)
            )
        if table.of not in ("sum", "mean", "min", "max"):
            raise SceneError(f"of = {table.of!r}", remedy="give sum, mean, min or max")
    if table.fails_below is not None and table.fails_above is not None:
        raise SceneError("both fails_below and fails_above", remedy="give one of them")


def _correlations(
    document: TomlDocument, given: Mapping[str, Any], inputs: Sequence[InputTable]
) -> tuple[Correlation, ...]:
    names = [table.name or str(table.type) for table in inputs]
    found, used = [], set[int]()
    for path, table in tables_of(document, given, "correlations"):
        made = read_table(document, path, table, CorrelationTable)
        for name in made.inputs:
            if name not in names:
                document.fail(f"no such input: {name!r}", *path, "inputs", remedy=nearest(name, names))
        numbers = tuple(names.index(name) for name in made.inputs)
        if used & set(numbers) or len(set(numbers)) < max(2, len(numbers)):
            document.fail(
                "inputs of a correlation are not two or more, each in one group",
                *path,
                "inputs",
                remedy="write one [[correlations]] with a matrix for all that are correlated",
            )
        used |= set(numbers)
        with document.at(*path):
            matrix = _matrix(made)
            correlation_root(matrix)
        found.append(Correlation(numbers, matrix))
    return tuple(found)


def _matrix(table: CorrelationTable) -> Array:
    count = len(table.inputs)
    if (table.value is None) == (not table.matrix):
        raise SceneError("a correlation needs either value or matrix", remedy="give one of them")
    if table.value is not None:
        matrix: Array = np.full((count, count), table.value)
        np.fill_diagonal(matrix, 1.0)
        return matrix
    if len(table.matrix) != count**2:
        raise SceneError(
            f"a matrix of {len(table.matrix)} numbers for {count} inputs",
            remedy=f"give {count**2}, row by row",
        )
    return np.array(table.matrix, dtype=float).reshape(count, count)
