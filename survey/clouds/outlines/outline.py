"""An outline of a stone, and what its attributes say of the stone."""

import re
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from ground.errors import SurveyError, UsageError
from ground.tables.columns import length_scale, plain, spellings, unit_of
from survey.arrays import Array
from survey.formats.fields import NO_COURSE
from survey.formats.tables.columns import ALIASES
from survey.records.survey import DEPTH_ORIGINS

FIELDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "code": (
            *ALIASES["block"], "code", "name", "label", "number", "nr", "no", "nummer", "bezeichnung", "numero",
            "nom", "codice", "nome", "codigo", "nombre", "text", "id", "fid",
        ),
        "kind": (*ALIASES["kind"], "class", "klasse", "classe"),
        "course": tuple(ALIASES["course"]),
        "zone": (*ALIASES["zone"], "area", "parete"),
        "depth": tuple(ALIASES["depth"]),
        "depth_sigma": tuple(ALIASES["depth_sigma"]),
        "depth_origin": tuple(ALIASES["depth_origin"]),
        "depth_source": tuple(ALIASES["depth_source"]),
        "sigma": tuple(ALIASES["sigma"]),
        "score": ("score", "confidence", "probability"),
    }
)  # fmt: skip
"""Names under which attributes are known: those of columns of tables, and more; in doubt the first.

Numbers that a program gives to features, such as `id`, are codes only where nothing else is.
"""

_SPELLED = {
    meaning: tuple(dict.fromkeys(spelling for name in (meaning, *names) for spelling in spellings(name)))
    for meaning, names in FIELDS.items()
}
_CUT = 10  # characters of a name in a shapefile (dBASE)
_PLACES = frozenset(("layer", "lage", "row", "reihe", "rang", "lit", "fila"))
"""Names that mean other things than courses, too: the layer of a drawing, a place."""

PROPOSED = "proposed from image"
"""Evidence of an outline that a program proposes: a hypothesis, until a person has looked at it."""


@dataclass(frozen=True)
class Attributes:
    """The attributes of an outline.

    Attributes
    ----------
    code : as written; None if there is none
    kind : as written, until `read_outlines` knows it; None if not stated
    course, zone : of the stone; None if not stated
    depth, depth_sigma : measured on the stone, unless `depth_origin` says otherwise [m]; None if not stated
    depth_origin : one of DEPTH_ORIGINS; None if not stated
    depth_source : evidence in words; None if not stated
    sigma : standard deviation of a coordinate of the outline [m]; None if not stated
    score : confidence of the program that drew it, from 0 to 1; None if not stated
    notes : other attributes
    """

    code: str | None = None
    kind: str | None = None
    course: int | None = None
    zone: str | None = None
    depth: float | None = None
    depth_sigma: float | None = None
    depth_origin: str | None = None
    depth_source: str | None = None
    sigma: float | None = None
    score: float | None = None
    notes: Mapping[str, str] = field(default_factory=dict)

    def depth_evidence(self, where: str) -> str | None:
        """Return the evidence for the depth in words, by default its place; None without a depth."""
        return None if self.depth is None else self.depth_source or f"attribute of {where}"


@dataclass(frozen=True)
class Outline:
    """The outline of one stone as it was drawn.

    Attributes
    ----------
    number : of the feature, annotation or label in its file, counted from 1
    code : name of the stone
    corners : (n, 2) in the plane of the wall or picture, or (n, 3) in space, in order, not closed
    said : its attributes
    where : its place in the file, for messages
    doubts : what is odd about it, in words: (reason, text)
    """

    number: int
    code: str
    corners: Array
    said: Attributes
    where: str
    doubts: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class WrongOutline:
    """A feature that is no outline of a stone.

    Attributes
    ----------
    number : as of an outline
    code : of the stone
    corners : (n, 2) or (n, 3) what was drawn, as in the file; empty: nothing
    error : with the place and the remedy
    """

    number: int
    code: str
    corners: Array
    error: SurveyError


def field_map(text: str | None) -> dict[str, str]:
    """Read which attribute is which column, e.g. "code=Stein_Nr,course=Lage"; a code may be of several, "code=Lage+Nr".

    Raises
    ------
    UsageError
        if it is written otherwise, or names an attribute that there is not
    """
    out = {}
    for word in (text or "").split(","):
        if not word.strip():
            continue
        name, _, column = (one.strip() for one in word.partition("="))
        if name not in FIELDS or not column:
            what = f"cannot be read at {word.strip()!r}"
            remedy = f"write e.g. code=Stein_Nr,course=Lage with {', '.join(FIELDS)}"
            raise UsageError(what, where="--fields", remedy=remedy)
        out[name] = column
    return out


def attributes_of(values: Mapping[str, Any], chosen: Mapping[str, str], where: str) -> Attributes:
    """Find what the attributes of a feature mean.

    Parameters
    ----------
    values : by name, as the file has them
    chosen : names that the user has given, by meaning
    where : for messages

    Raises
    ------
    SurveyError
        if a chosen attribute is missing, or a value cannot be read
    """
    columns = columns_of(tuple(values), chosen, where)
    texts = {
        meaning: joined_code(values, name) if meaning == "code" else _text(values[name])
        for meaning, name in columns.items()
    }
    if "zone" not in chosen and _is_measure(texts.get("zone")):
        del texts["zone"], columns["zone"]  # an area that a program computed
    word = texts.get("course")
    if word is not None and (
        word.casefold() in NO_COURSE
        or ("course" not in chosen and plain(columns.get("course", "")) in _PLACES and not _is_count(word))
    ):
        del texts["course"], columns["course"]
    used = {*columns.values(), *_parts(columns.get("code", ""), values)}
    notes = {
        _key(name): text[:200]
        for name, value in values.items()
        if name not in used and (text := _text(value)) is not None
    }
    sigma, depth, depth_sigma = (
        _length(texts, columns, meaning, where) for meaning in ("sigma", "depth", "depth_sigma")
    )
    return Attributes(
        code=texts.get("code"),
        kind=texts.get("kind"),
        course=_course(texts.get("course"), where),
        zone=texts.get("zone"),
        depth=None if depth is None else _positive(depth, "depth", where),
        depth_sigma=depth_sigma,
        depth_origin=None if depth is None else _origin(texts.get("depth_origin"), where),
        depth_source=None if depth is None else texts.get("depth_source"),
        sigma=None if sigma is None else _positive(sigma, "sigma", where),
        score=_number(texts, "score", where),
        notes=notes,
    )


def made_code(text: str) -> str:
    """Make the code of a stone of what people write: what a code cannot have becomes a hyphen.

    >>> made_code("Stein 12 °a")
    'Stein-12-a'
    >>> made_code("12.0")
    '12'
    """
    plain = re.sub(r"\.0+$", "", text.strip()) if re.fullmatch(r"\d+\.0+", text.strip()) else text
    return re.sub(r"[^\w.+/:-]+", "-", plain.strip()).strip("-_")[:64].strip("-_")


def joined_code(values: Mapping[str, Any], name: str) -> str | None:
    """Return the name of a stone by that of its attribute, or of several: "Lage+Nr" joins them by hyphens.

    >>> joined_code({"Lage": 5, "Nr": 3.0}, "Lage+Nr")
    '5-3'
    """
    if name in values:
        return _text(values[name])
    texts = [_text(values.get(column)) for column in name.split("+")]
    return "-".join(made_code(text) for text in texts if text) or None


def _parts(name: str, names: Container[str]) -> tuple[str, ...]:
    """Return the attributes that a code is made of; none if it is of one, or one is missing."""
    parts = tuple(name.split("+"))
    return parts if len(parts) > 1 and name not in names and all(column in names for column in parts) else ()


def joined_names(outlines: Sequence[Outline], names: Sequence[str], chosen: Mapping[str, str]) -> str | None:
    """Return the attributes that name a stone together, "Lage+Nr", where numbers begin anew in each course.

    Parameters
    ----------
    outlines : of a file
    names : of their attributes
    chosen : names that the user has given, by meaning

    Returns
    -------
    as `--fields` has them; None if most stones have a code of their own, or nothing says in which course they are
    """
    columns = columns_of(names, chosen, "")
    courses: dict[str, list[int | None]] = {}
    for outline in outlines:
        courses.setdefault(outline.code, []).append(outline.said.course)
    shared = sum(len(set(numbers)) > 1 for numbers in courses.values())
    if not {"course", "code"} <= columns.keys() or 2 * shared <= len(courses):
        return None
    return f"{columns['course']}+{columns['code']}"


def columns_of(names: Sequence[str], chosen: Mapping[str, str], where: str) -> dict[str, str]:
    """Find the names of attributes by what they mean.

    Raises
    ------
    SurveyError
        if a chosen one is missing
    """
    spelled: dict[str, str] = {}
    for name in names:
        for spelling in (plain(name), plain(unit_of(name)[0])):
            spelled.setdefault(spelling, name)
    cut = {plain(name): name for name in names if len(name) == len(plain(name)) == _CUT}
    out = {}
    for meaning, words in _SPELLED.items():
        if meaning in chosen:
            if chosen[meaning] not in names and not (meaning == "code" and _parts(chosen[meaning], names)):
                known = ", ".join(names) or "none"
                raise SurveyError(
                    f"no attribute {chosen[meaning]!r}", where=where, remedy=f"attributes are: {known}"
                )
            out[meaning] = chosen[meaning]
            continue
        for spelling in words:
            attribute = spelled.get(spelling) or cut.get(spelling[:_CUT])
            if attribute is not None and attribute not in (*out.values(), *chosen.values()):
                out[meaning] = attribute
                break
    return out


def _text(value: Any) -> str | None:
    """Return a value as text; None if it says nothing."""
    if value is None or (isinstance(value, float | np.floating) and not np.isfinite(value)):
        return None
    text = " ".join(str(value).split())
    return text if text and text.isprintable() else None


def _key(name: str) -> str:
    return re.sub(r"\s+", "_", name.strip()) or "attribute"


def _number(found: Mapping[str, str | None], meaning: str, where: str) -> float | None:
    text = found.get(meaning)
    if text is None:
        return None
    try:
        return float(text.replace(",", "."))
    except ValueError as error:
        raise SurveyError(
            f"{meaning} is {text!r}, not a number", where=where, remedy="write e.g. 0.3"
        ) from error


def _length(
    found: Mapping[str, str | None], columns: Mapping[str, str], meaning: str, where: str
) -> float | None:
    """Return a length [m], in the unit that the name of its attribute states; None if it is not stated."""
    value = _number(found, meaning, where)
    return None if value is None else (length_scale(columns[meaning], where) or 1.0) * value


def _positive(value: float, meaning: str, where: str) -> float:
    if not 0.0 < value < 10.0:
        what = f"{meaning} is {value:g} m"
        raise SurveyError(
            what,
            where=where,
            remedy=f"give it in metres, or name its unit, as in {meaning}_cm; or leave it empty",
        )
    return value


def _is_measure(text: str | None) -> bool:
    """Return whether a text is a decimal number."""
    return text is not None and re.fullmatch(r"-?\d*[.,]\d+(e-?\d+)?", text) is not None


def _is_count(text: str | None) -> bool:
    """Return whether a text is a whole number, or says nothing."""
    return text is None or re.fullmatch(r"\d+(\.0*)?", text) is not None


def _origin(text: str | None, where: str) -> str | None:
    if text is not None and text not in DEPTH_ORIGINS:
        remedy = f"write one of {', '.join(DEPTH_ORIGINS)}; or leave it out"
        raise SurveyError(f"origin of a depth {text[:40]!r}", where=where, remedy=remedy)
    return text


def _course(text: str | None, where: str) -> int | None:
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = -0.5
    if value != int(value) or not 0 <= value < 1e6:
        remedy = "count courses from the ground: 1, 2, …; or name another attribute with --fields"
        raise SurveyError(f"course {text!r} is not a whole number", where=where, remedy=remedy)
    return int(value)
