"""Questions of an assessment: from [[assess]] of a scene file, or from the words of an option."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ground.errors import SceneError, UsageError
from mechanics.arrays import Array
from mechanics.limit.live_loads import Acceleration, LiveLoad, PointForce, SpreadForce
from pipelines.assess.codes.check import CODES
from pipelines.scene.array_tables import ArrayTable
from pipelines.scene.file import SceneFile
from pipelines.scene.selection import Groups

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class LoadQuestion:
    """Question how far a load may grow.

    Attributes
    ----------
    name : in results
    live : the load
    confirm : its candidate is confirmed by runs
    pushover : its mechanism is led to collapse by a run
    code : by which its mechanism is checked; None: by none
    """

    name: str
    live: LiveLoad
    confirm: bool = False
    pushover: bool = False
    code: str | None = None

    @property
    def whole(self) -> bool:
        """True for a push on all stones, whose mechanism codes can check."""
        return isinstance(self.live, Acceleration) and not self.live.stones


@dataclass(frozen=True)
class ThrustQuestion:
    """Question between which values the thrust on supports lies.

    Attributes
    ----------
    name : in results
    supports : codes of fixed stones
    direction : (3,) of any length
    settles : the supports yield along it, so that the least thrust is what remains
    """

    name: str
    supports: tuple[str, ...]
    direction: Vector
    settles: bool = False


@dataclass(frozen=True)
class Thickness:
    """Question by how much joints may shrink."""

    name: str = "thickness"


Question = LoadQuestion | ThrustQuestion | Thickness

_AXES: Mapping[str, Vector] = {
    "x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}
_QUESTION_KEYS = ("confirm", "pushover", "code")
_DOWN: Vector = (0.0, 0.0, -1.0)
_REMEDY = (
    'give "horizontal x", "horizontal 30" (degrees from x towards y), "tilt y", "force CODE FX FY FZ", '
    '"weight CODE,CODE", "thrust CODE,CODE x", "settlement CODE -z" or "thickness"'
)


def parse_question(words: str) -> Question:
    """Return a question from words, as the option --load has them.

    Raises
    ------
    UsageError : the words are no question

    >>> parse_question("tilt y").live.direction
    (1.0, 0.0, 0.0)
    >>> parse_question("thrust A1,A2 -x").supports
    ('A1', 'A2')
    """
    try:
        match words.split():
            case ["horizontal", direction]:
                return LoadQuestion(words, Acceleration(_horizontal(direction)))
            case ["tilt", axis]:
                return LoadQuestion(words, Acceleration(_downhill(_horizontal(axis))))
            case ["force", stone, *numbers] if len(numbers) == 3:
                x, y, z = map(float, numbers)
                return LoadQuestion(words, PointForce(stone, (x, y, z)))
            case ["weight", stones]:
                return LoadQuestion(words, Acceleration(_DOWN, frozenset(stones.split(","))))
            case ["thrust" | "settlement" as kind, stones, direction] if direction in _AXES:
                return ThrustQuestion(words, tuple(stones.split(",")), _AXES[direction], kind == "settlement")
            case ["thickness"]:
                return Thickness()
    except (ValueError, SceneError):
        pass
    raise UsageError(f"no such load: {words!r}", where="--load", remedy=_REMEDY)


def scene_questions(scene: SceneFile, groups: Groups, origin: Array) -> tuple[Question, ...]:
    """Return the questions of [[assess]]; none where there are none.

    Parameters
    ----------
    scene, groups : the scene, and the codes of the stones that its tables name
    origin : (3,) of the scene, in the frame of the site [m]
    """
    questions = []
    for entry in scene.assess:
        with scene.document.at(*entry.path):
            question = _TYPES[entry.type](entry, _codes(entry, groups), origin)
        if isinstance(question, LoadQuestion):
            question = replace(
                question, **{key: entry.values[key] for key in _QUESTION_KEYS if key in entry.values}
            )
            if question.code is not None:
                _refuse_code(scene, entry, question)
        questions.append(question)
    return tuple(questions)


def _refuse_code(scene: SceneFile, entry: ArrayTable, question: LoadQuestion) -> None:
    """Refuse a check by a code that cannot be made."""
    what, remedy = "", ""
    if question.code not in CODES:
        what, remedy = f"no such code: {question.code!r}", f"give one of {', '.join(CODES)}"
    elif not question.whole:
        what, remedy = "a check by a code of a push on some stones", "leave out code, or stones"
    elif scene.site is None:
        what, remedy = "a check by a code needs the seismic action", "add a table [site] (docs/scene.md)"
    if what:
        scene.document.fail(what, *entry.path, "code", remedy=remedy)


def _codes(entry: ArrayTable, groups: Groups) -> frozenset[str]:
    """Return the codes of the only group of stones that a table names; none without one."""
    named = groups[entry.path]
    return named[0] if named else frozenset()


def _horizontal(word: str) -> Vector:
    if word in _AXES and not word.endswith("z"):
        return _AXES[word]
    angle = np.radians(float(word))
    return float(np.cos(angle)), float(np.sin(angle)), 0.0


def _downhill(axis: Vector) -> Vector:
    """Return the direction towards which a table dips that turns about an axis, right-handed."""
    x, y, z = np.cross(axis, (0.0, 0.0, 1.0)).tolist()
    return x + 0.0, y + 0.0, z + 0.0


def _acceleration(entry: ArrayTable, codes: frozenset[str], origin: Array) -> Question:
    direction = entry.values["direction"]
    return LoadQuestion(_named(entry, direction), Acceleration(direction, codes))


def _tilt(entry: ArrayTable, codes: frozenset[str], origin: Array) -> Question:
    axis = entry.values["axis"]
    return LoadQuestion(_named(entry, axis), Acceleration(_downhill(axis)))


def _weight(entry: ArrayTable, codes: frozenset[str], origin: Array) -> Question:
    return LoadQuestion(f"weight of {_listed(codes)}", Acceleration(_DOWN, codes))


def _force(entry: ArrayTable, codes: frozenset[str], origin: Array) -> Question:
    values, point = entry.values, entry.values["point"]
    if point is None:
        return LoadQuestion(f"force on {_listed(codes)}", SpreadForce(codes, values["force"]))
    if len(codes) > 1:
        raise SceneError(f"a point of {len(codes)} stones", remedy="name the one on which the point lies")
    (stone,) = codes
    x, y, z = (np.asarray(point) - origin).tolist()
    return LoadQuestion(f"force on {stone}", PointForce(stone, values["force"], (x, y, z)))


def _thrust(entry: ArrayTable, codes: frozenset[str], origin: Array) -> Question:
    name = (
        f"{entry.type} of {_listed(codes)}" if entry.type == "settlement" else f"thrust on {_listed(codes)}"
    )
    return ThrustQuestion(name, tuple(sorted(codes)), entry.values["direction"], entry.type == "settlement")


def _thickness(entry: ArrayTable, codes: frozenset[str], origin: Array) -> Question:
    return Thickness()


def _listed(codes: frozenset[str]) -> str:
    few = sorted(codes)
    return ", ".join(few) if len(few) <= 3 else f"{few[0]}, {few[1]} and {len(few) - 2} more"


def _named(entry: ArrayTable, vector: Any) -> str:
    return f"{entry.type} ({', '.join(f'{component:g}' for component in vector)})"


_TYPES: Mapping[str, Callable[[ArrayTable, frozenset[str], Array], Question]] = {
    "horizontal": _acceleration,
    "tilt": _tilt,
    "weight": _weight,
    "force": _force,
    "thrust": _thrust,
    "settlement": _thrust,
    "thickness": _thickness,
}
