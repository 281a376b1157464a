"""Files of a diagnosis: hypotheses on what has moved a building, each a change of a scene with unknown amplitudes."""

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from archmodel.store.lookalikes import explained, plain_form
from ground.errors import SceneError
from pipelines.scene.file import BESIDE
from pipelines.toml.lines import key_lines, parse_toml, read_text
from pipelines.toml.schema import Key, TomlDocument, ValueKind, check_table, nearest
from pipelines.toml.writer import is_table_array

__all__ = [
    "DIAGNOSIS_KEYS",
    "HYPOTHESIS_KEYS",
    "UNKNOWN_KEYS",
    "DiagnosisFile",
    "Hypothesis",
    "Unknown",
    "read_diagnosis",
]

DIAGNOSIS_KEYS = (
    Key(
        "scene",
        ValueKind.TEXT,
        "Scene file, beside this one; if not given, the scene is this file.",
        default=None,
    ),
    Key("without", ValueKind.TEXTS, "Tables of that scene that are left out, such as loads.", default=()),
    Key(
        "battered",
        ValueKind.BOOLEAN,
        "Walls may have been built leaning, each by an angle of its own.",
        default=False,
    ),
    Key(
        "level_tolerance",
        ValueKind.NUMBER,
        "Standard deviation of the slope with which courses were laid.",
        "-",
        0.0,
        at_least=0,
        below=0.1,
    ),
    Key(
        "from_rest",
        ValueKind.BOOLEAN,
        "Movements count from where the scene rests without any cause, not from the survey: for joints that yield "
        "under the weight alone.",
        default=False,
    ),
    Key(
        "phases",
        ValueKind.TEXTS,
        "Names of building phases, the oldest first; with two or more the movement is dated against them.",
        default=(),
    ),
)

HYPOTHESIS_KEYS = (
    Key("name", ValueKind.TEXT, "The hypothesis in words."),
    Key(
        "scene",
        ValueKind.TABLE,
        "Keys of the scene that it changes; arrays such as `loads` are added to those of the scene. A text that begins "
        "with `=` is a formula of the unknowns: numbers, + - * / and brackets.",
    ),
)

UNKNOWN_KEYS = (
    Key("name", ValueKind.TEXT, "As it stands in formulas."),
    Key("unit", ValueKind.TEXT, "Of its values, for reports."),
    Key("start", ValueKind.NUMBER, "Value with which the search begins."),
    Key("low", ValueKind.NUMBER, "Least value."),
    Key("high", ValueKind.NUMBER, "Largest value."),
    Key(
        "step",
        ValueKind.NUMBER,
        "Change by which derivatives are taken; if not given, a twentieth of the range.",
        default=None,
        above=0,
    ),
    Key(
        "scan",
        ValueKind.INTEGER,
        "Number of values across its range that are tried first; the search begins with the best. Where nothing moves "
        "at the start, or its run fails, some are tried in any case.",
        default=0,
        at_least=0,
        at_most=100,
    ),
)

_LONGEST = 500  # characters of a formula
_SHOWN = 60  # characters of a formula in a message

_OPERATORS: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_SHARE = 0.05  # of its range by which an unknown is changed for a derivative [-]


@dataclass(frozen=True)
class Unknown:
    """An amplitude to be estimated.

    Attributes
    ----------
    name, unit : for formulas and reports
    start, low, high : first value and bounds
    step : change for derivatives, positive
    scan : number of values across the range that are tried first
    """

    name: str
    unit: str
    start: float
    low: float
    high: float
    step: float
    scan: int = 0


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


@dataclass(frozen=True)
class DiagnosisFile:
    """A diagnosis as its author wrote it, checked.

    Attributes
    ----------
    document : file and lines, for messages
    scene_path : of the scene, for files beside it
    base : contents of the scene file without what is left out
    battered, level_tolerance : how walls and courses were laid
    from_rest : whether movements count from where the scene rests without any cause
    phases : names, the oldest first
    hypotheses : one or more
    """

    document: TomlDocument
    scene_path: str
    base: Mapping[str, Any]
    battered: bool
    level_tolerance: float
    from_rest: bool
    phases: tuple[str, ...]
    hypotheses: tuple[Hypothesis, ...]


def read_diagnosis(path: str | Path) -> DiagnosisFile:
    """Read and check the file of a diagnosis.

    Raises
    ------
    SceneError : with file and line, at the first mistake
    """
    text = read_text(path, SceneError, missing="no such file")
    given = parse_toml(text, str(path), SceneError, "see docs/howto/diagnose.md for one to start from")
    document = TomlDocument(str(path), key_lines(text))
    head: dict[str, Any] = check_table(document, ("diagnosis",), given.get("diagnosis", {}), DIAGNOSIS_KEYS)
    if head["scene"] is None:
        scene_path, base = str(path), {name: one for name, one in given.items() if name not in BESIDE}
    else:
        beside = Path(path).parent / head["scene"]
        with document.at("diagnosis", "scene"):
            inner = read_text(beside, SceneError, missing="no such scene file")
        scene_path, base = str(beside), parse_toml(inner, str(beside), SceneError, "see docs/scene.md")
        for name in given:
            if name not in BESIDE:
                what = f"unknown table [{name}] beside a scene in another file"
                document.fail(what, name, remedy="write it into the scene, or under [hypotheses.scene]")
    for name in head["without"]:
        if name not in base:
            document.fail(
                f"without: the scene has no {name!r}", "diagnosis", "without", remedy=nearest(name, base)
            )
    return DiagnosisFile(
        document,
        scene_path,
        {name: one for name, one in base.items() if name not in (*BESIDE, *head["without"])},
        head["battered"],
        head["level_tolerance"],
        head["from_rest"],
        _distinct(document, head["phases"]),
        tuple(_hypotheses(document, given)),
    )


def _distinct(document: TomlDocument, phases: tuple[str, ...]) -> tuple[str, ...]:
    if len(phases) == 1 or len(set(phases)) < len(phases):
        what = f"phases = {list(phases)} are not several different ones"
        document.fail(what, "diagnosis", "phases", remedy="name two or more, the oldest first, or none")
    return phases


def _hypotheses(document: TomlDocument, given: Mapping[str, Any]) -> Iterator[Hypothesis]:
    tables = given.get("hypotheses", [])
    if not isinstance(tables, list) or not tables or not all(isinstance(table, dict) for table in tables):
        document.fail("no hypothesis", "hypotheses", remedy="write [[hypotheses]] above each")
    names: dict[str, str] = {}
    for index, table in enumerate(tables):
        path = ("hypotheses", str(index))
        plain = {key: value for key, value in table.items() if key != "unknowns"}
        values: dict[str, Any] = check_table(document, path, plain, HYPOTHESIS_KEYS, "[[hypotheses]]")
        if values["name"] in names.values():
            document.fail(f"two hypotheses {values['name']!r}", *path, "name", remedy="name each differently")
        if (other := names.setdefault(plain_form(values["name"]), values["name"])) != values["name"]:
            what = f"the hypothesis {explained(values['name'], other)}"
            document.fail(what, *path, "name", remedy="name each differently")
        unknowns = tuple(_unknowns(document, path, table.get("unknowns", [])))
        _check_formulas(document, path, values["scene"], [unknown.name for unknown in unknowns])
        yield Hypothesis(values["name"], path, unknowns, values["scene"])


def _unknowns(document: TomlDocument, path: tuple[str, ...], tables: Any) -> Iterator[Unknown]:
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        what = "'unknowns' is not a list of tables"
        document.fail(what, *path, "unknowns", remedy="write [[hypotheses.unknowns]] above each")
    for index, table in enumerate(tables):
        own = (*path, "unknowns", str(index))
        values: dict[str, Any] = check_table(document, own, table, UNKNOWN_KEYS, "[[hypotheses.unknowns]]")
        if not values["name"].isidentifier():
            what = f"name = {values['name']!r} is no name for a formula"
            document.fail(what, *own, "name", remedy="use letters, digits and _")
        if not values["low"] <= values["start"] <= values["high"] or values["low"] == values["high"]:
            what = "start = {start:g} is not between low = {low:g} and high = {high:g}".format(**values)
            document.fail(what, *own, "start", remedy="give low < high, and a start between them")
        span = values["high"] - values["low"]
        values["step"] = values["step"] or _SHARE * span
        if values["step"] > 0.5 * span:
            what = f"step = {values['step']:g} is more than half of the range of {values['name']}"
            document.fail(what, *own, "step", remedy="give less, or leave it out")
        yield Unknown(**values)


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
        for name, one in change.items():
            yield from _formulas(one, (*path, name))
    elif isinstance(change, list):
        for index, one in enumerate(change):
            yield from _formulas(one, (*path, str(index)))


def _filled(change: Any, values: Mapping[str, float]) -> Any:
    """Return a change with numbers in place of formulas."""
    if isinstance(change, str) and change.startswith("="):
        try:
            return _computed(change, values)
        except ValueError as fault:
            raise SceneError(f"{_shortened(change)}: {fault}") from None
    if isinstance(change, Mapping):
        return {key: _filled(one, values) for key, one in change.items()}
    return [_filled(one, values) for one in change] if isinstance(change, list) else change


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
