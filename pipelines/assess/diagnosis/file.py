"""Files of a diagnosis: hypotheses on what has moved a building, each a change of a scene with unknown amplitudes."""

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from archmodel.store.lookalikes import explained, plain_form
from ground.errors import SceneError
from ground.settings import Setting
from ground.toml.keys import Table, Texts, read_table
from ground.toml.lines import key_lines, parse_toml, read_text
from ground.toml.schema import TomlDocument, nearest, tables_of
from ground.toml.writer import is_table_array
from pipelines.scene.file import BESIDE
from survey.conventions import FEW

_LONGEST = 500  # characters of a formula
_SHOWN = 60  # characters of a formula in a message

_OPERATORS: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_SHARE = FEW  # of its range by which an unknown is changed for a derivative [-]


@dataclass(frozen=True, kw_only=True)
class DiagnosisTable:
    """Table [diagnosis]."""

    scene: Annotated[
        str | None, Setting("Scene file, beside this one; if not given, the scene is this file.")
    ] = None
    without: Annotated[Texts, Setting("Tables of that scene that are left out, such as loads.")] = ()
    battered: Annotated[bool, Setting("Walls may have been built leaning, each by an angle of its own.")] = (
        False
    )
    level_tolerance: Annotated[
        float,
        Setting("Standard deviation of the slope with which courses were laid.", "-", at_least=0, below=0.1),
    ] = 0.0
    from_rest: Annotated[
        bool,
        Setting(
            "Movements count from where the scene rests without any cause, not from the survey: for joints "
            "that yield under the weight alone."
        ),
    ] = False
    phases: Annotated[
        Texts,
        Setting(
            "Names of building phases, the oldest first; with two or more the movement is dated against them."
        ),
    ] = ()


@dataclass(frozen=True, kw_only=True)
class HypothesisTable:
    """Table [[hypotheses]]."""

    name: Annotated[str, Setting("The hypothesis in words.")]
    scene: Annotated[
        Table,
        Setting(
            "Keys of the scene that it changes; arrays such as `loads` are added to those of the scene. A "
            "text that begins with `=` is a formula of the unknowns: numbers, + - * / and brackets."
        ),
    ]


@dataclass(frozen=True)
class Unknown:
    """Amplitude to be estimated: table [[hypotheses.unknowns]]."""

    name: Annotated[str, Setting("As it stands in formulas.")]
    unit: Annotated[str, Setting("Of its values, for reports.")]
    start: Annotated[float, Setting("Value with which the search begins.")]
    low: Annotated[float, Setting("Least value.")]
    high: Annotated[float, Setting("Largest value.")]
    step: Annotated[
        float | None,
        Setting("Change by which derivatives are taken; if not given, a twentieth of the range.", above=0),
    ] = None
    scan: Annotated[
        int,
        Setting(
            "Number of values across its range that are tried first; the search begins with the best. Where "
            "nothing moves at the start, or its run fails, some are tried in any case.",
            at_least=0,
            at_most=100,
        ),
    ] = 0

    @property
    def change(self) -> float:
        """Change by which derivatives are taken."""
        return self.step or _SHARE * (self.high - self.low)


@dataclass(frozen=True)
class Hypothesis:
    """A change of a scene with unknown amplitudes.

    Attributes
    ----------
    name : in words
    path : its position in the file, for messages
    unknowns : in the order of the amplitudes
    change : of the scene, with formulas
    """

    name: str
    path: tuple[str, ...]
    unknowns: tuple[Unknown, ...]
    change: Mapping[str, Any]

    def scene(self, base: Mapping[str, Any], amplitudes: tuple[float, ...]) -> dict[str, Any]:
        """Return the contents of the scene file with these amplitudes."""
        values = dict(zip((unknown.name for unknown in self.unknowns), amplitudes, strict=True))
        return _merged(base, _filled(self.change, values))


@dataclass(frozen=True, kw_only=True)
class DiagnosisFile(DiagnosisTable):
    """A diagnosis as its author wrote it, checked.

    Attributes
    ----------
    document : file and lines, for messages
    scene_path : of the scene, for files beside it
    base : contents of the scene file without what is left out
    hypotheses : one or more
    """

    document: TomlDocument
    scene_path: str
    base: Mapping[str, Any]
    hypotheses: tuple[Hypothesis, ...]


def read_diagnosis(path: str | Path) -> DiagnosisFile:
    """Read and check the file of a diagnosis.

    Raises
    ------
    SceneError : with file and line, at the first mistake
    """
    text = read_text(path, SceneError, missing="no such file")
    toml = parse_toml(text, str(path), SceneError, "see docs/howto/diagnose.md for one to start from")
    document = TomlDocument(str(path), key_lines(text))
    head = read_table(document, ("diagnosis",), toml.get("diagnosis", {}), DiagnosisTable)
    if head.scene is None:
        scene_path, base = str(path), {name: content for name, content in toml.items() if name not in BESIDE}
    else:
        beside = Path(path).parent / head.scene
        with document.at("diagnosis", "scene"):
            inner = read_text(beside, SceneError, missing="no such scene file")
        scene_path, base = str(beside), parse_toml(inner, str(beside), SceneError, "see docs/scene.md")
        for name in toml:
            if name not in BESIDE:
                what = f"unknown table [{name}] beside a scene in another file"
                document.fail(what, name, remedy="write it into the scene, or under [hypotheses.scene]")
    for name in head.without:
        if name not in base:
            document.fail(
                f"without: the scene has no {name!r}", "diagnosis", "without", remedy=nearest(name, base)
            )
    _check_phases(document, head.phases)
    return DiagnosisFile(
        document=document,
        scene_path=scene_path,
        base={name: content for name, content in base.items() if name not in (*BESIDE, *head.without)},
        hypotheses=tuple(_hypotheses(document, toml)),
        **vars(head),
    )


def _check_phases(document: TomlDocument, phases: Texts) -> None:
    if len(phases) == 1 or len(set(phases)) < len(phases):
        what = f"phases = {list(phases)} are not several different ones"
        document.fail(what, "diagnosis", "phases", remedy="name two or more, the oldest first, or none")


def _hypotheses(document: TomlDocument, toml: Mapping[str, Any]) -> Iterator[Hypothesis]:
    if not toml.get("hypotheses"):
        document.fail("no hypothesis", "hypotheses", remedy="write [[hypotheses]] above each")
    names: dict[str, str] = {}
    for path, table in tables_of(document, toml, "hypotheses"):
        plain = {key: value for key, value in table.items() if key != "unknowns"}
        head = read_table(document, path, plain, HypothesisTable, "[[hypotheses]]")
        if head.name in names.values():
            document.fail(f"two hypotheses {head.name!r}", *path, "name", remedy="name each differently")
        if (first := names.setdefault(plain_form(head.name), head.name)) != head.name:
            what = f"the hypothesis {explained(head.name, first)}"
            document.fail(what, *path, "name", remedy="name each differently")
        unknowns = tuple(_unknowns(document, path, table))
        _check_formulas(document, path, head.scene, [unknown.name for unknown in unknowns])
        yield Hypothesis(head.name, path, unknowns, head.scene)


def _unknowns(document: TomlDocument, path: tuple[str, ...], table: Mapping[str, Any]) -> Iterator[Unknown]:
    for table_path, content in tables_of(document, table, "unknowns", path):
        unknown = read_table(document, table_path, content, Unknown, "[[hypotheses.unknowns]]")
        low, start, high = unknown.low, unknown.start, unknown.high
        if not unknown.name.isidentifier():
            what = f"name = {unknown.name!r} is no name for a formula"
            document.fail(what, *table_path, "name", remedy="use letters, digits and _")
        if not low <= start <= high or low == high:
            what = f"start = {start:g} is not between low = {low:g} and high = {high:g}"
            document.fail(what, *table_path, "start", remedy="give low < high, and a start between them")
        if unknown.change > 0.5 * (high - low):
            what = f"step = {unknown.change:g} is more than half of the range of {unknown.name}"
            document.fail(what, *table_path, "step", remedy="give less, or leave it out")
        yield unknown


def _check_formulas(document: TomlDocument, path: tuple[str, ...], change: Any, names: list[str]) -> None:
    """Refuse formulas that cannot be read, and unknowns that stand in none."""
    used: set[str] = set()
    for place, text in _formulas(change, (*path, "scene")):
        remedy = f"use numbers, + - * / ( ) and {', '.join(names) or 'no names'}"
        if len(text) > _LONGEST:
            document.fail(f"a formula of {len(text)} characters", *place, remedy=f"write {_LONGEST} at most")
        try:
            # with values that no formula divides by
            _computed(text, dict.fromkeys(names, 0.7310585))
        except ValueError as fault:
            document.fail(f"{_shortened(text)}: {fault}", *place, remedy=remedy)
        used |= {node.id for node in ast.walk(_parsed(text)) if isinstance(node, ast.Name)}
    for index, name in enumerate(names):
        if name not in used or names.count(name) > 1:
            what = f"unknown {name!r} stands in no formula" if name not in used else f"two unknowns {name!r}"
            remedy = (
                "keep one" if name in used else f'write "= {name}" where it belongs in [hypotheses.scene]'
            )
            document.fail(what, *path, "unknowns", str(index), "name", remedy=remedy)


def _formulas(change: Any, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield the formulas of a change with their places."""
    if isinstance(change, str) and change.startswith("="):
        yield path, change
    elif isinstance(change, Mapping):
        for name, entry in change.items():
            yield from _formulas(entry, (*path, name))
    elif isinstance(change, list):
        for index, entry in enumerate(change):
            yield from _formulas(entry, (*path, str(index)))


def _filled(change: Any, values: Mapping[str, float]) -> Any:
    """Return a change with numbers in place of formulas."""
    if isinstance(change, str) and change.startswith("="):
        try:
            return _computed(change, values)
        except ValueError as fault:
            raise SceneError(f"{_shortened(change)}: {fault}") from None
    if isinstance(change, Mapping):
        return {key: _filled(entry, values) for key, entry in change.items()}
    return [_filled(entry, values) for entry in change] if isinstance(change, list) else change


def _shortened(formula: str) -> str:
    """Return a formula for a message of one line."""
    return repr(formula if len(formula) <= _SHOWN else formula[: _SHOWN - 3] + "...")


def _parsed(formula: str) -> ast.expr:
    return ast.parse(formula[1:].strip(), mode="eval").body


def _computed(formula: str, values: Mapping[str, float]) -> float:
    """Return the value of a formula.

    Raises
    ------
    ValueError : it cannot be read, or has no finite value
    """
    try:
        number = _value(_parsed(formula), values)
    except SyntaxError:
        raise ValueError("not a formula") from None
    except (RecursionError, MemoryError):
        raise ValueError("it is nested too deeply") from None
    except ArithmeticError:
        number = math.nan
    if not math.isfinite(number):
        at = ", ".join(f"{name} = {value:g}" for name, value in values.items())
        raise ValueError("it has no finite value" + (f" at {at}" if at else ""))
    return number


def _value(node: ast.expr, values: Mapping[str, float]) -> float:
    match node:
        case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
            return float(number)
        case ast.Name(id=name) if name in values:
            return values[name]
        case ast.Name(id=name):
            raise ValueError(f"{name!r} is none of its unknowns")
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_value(inner, values)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATORS:
            return _OPERATORS[type(op)](_value(left, values), _value(right, values))
    raise ValueError("not a formula")


def _merged(base: Mapping[str, Any], change: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table with a change: tables are merged, arrays of tables added, other values replaced."""
    merged = dict(base)
    for key, value in change.items():
        old = merged.get(key)
        if isinstance(old, Mapping) and isinstance(value, Mapping):
            merged[key] = _merged(old, value)
        elif is_table_array(old) and is_table_array(value):
            merged[key] = [*old, *value]  # type: ignore[misc]
        else:
            merged[key] = value
    return merged
