"""Keys of a file of knowledge: type, unit, bounds. A test compares docs/knowledge.md with these lists."""

from collections.abc import Mapping

from archmodel.assertions.declare import DOCUMENT_TYPES
from archmodel.tables.knowledge import OBSERVATIONS
from archmodel.tables.relations import RELATIONS
from pipelines.toml.schema import Key, Kind

__all__ = ["ABOUT", "ARRAYS", "ATTRIBUTE", "CITED", "PROPERTY", "RECORD", "WHO", "WITHDRAWN"]

WITHDRAWN = (
    "made_of", "of_phase", "mark", "observation", "reference", "note", "relation", "member", "material", "property",
    "phase", "document", "structure", "hypothesis",
)  # fmt: skip
"""Records that can be withdrawn; a depth is replaced by another one, a registered kind stays."""

RECORD = (
    Key("author", Kind.TEXT, "Author of the statements; `--author` takes precedence.", default=None),
    Key("source", Kind.TEXT, "Grounds; default: the name of the file.", default=None),
    Key("date", Kind.DATE, "Date of all observations without one.", default=None),
)

WHO = (
    Key("author", Kind.TEXT, "Author; default: that of `[record]`.", default=None),
    Key("source", Kind.TEXT, "Grounds; default: that of `[record]`.", default=None),
)
"""Keys of every table."""

_STONES = Key("stones", Kind.STONES, "Codes or expressions of the stones.")
_STONES_OR_NONE = Key("stones", Kind.TEXTS, "Codes or expressions of the stones.", default=())
_STRUCTURES = Key("structures", Kind.TEXTS, "Codes of structures.", default=())

ABOUT = (_STONES_OR_NONE, _STRUCTURES)
"""Keys for the subjects of a statement; at least one of them is given."""

CITED = (
    Key("text", Kind.TEXT, "In words.", default=None),
    Key("document", Kind.TEXT, "Code of the document that states it.", default=None),
    Key("locator", Kind.TEXT, "Where in the document: page, number of the figure.", default=None),
    Key("date", Kind.DATE, "Date of the observation.", default=None),
)
"""Keys of every statement for its evidence."""

_SAID = (*ABOUT, *CITED, *WHO)

_KIND = (
    Key("name", Kind.TEXT, "In small letters, with _ between words."),
    Key("parent", Kind.TEXT, "The more general kind, of stones or of structures."),
    Key("definition", Kind.TEXT, "One sentence: one word, one role."),
    Key(
        "canon",
        Kind.TEXT,
        "Canonical proportions, as a query expression over attributes of the stone; default: those of the parent.",
        default=None,
    ),
    Key("attributes", Kind.TABLE, "Attributes of this kind: `{ name = { unit, definition } }`.", default={}),
    *WHO,
)

ATTRIBUTE = (
    Key("unit", Kind.TEXT, "Unit, `-` for a number without one; without this key: a text.", default=None),
    Key("definition", Kind.TEXT, "Its meaning, in a few words."),
)
"""Keys of one attribute of a registered kind."""

_MATERIAL = (
    Key("name", Kind.TEXT, "Its name."),
    Key("description", Kind.TEXT, "In words.", default=None),
    Key(
        "properties",
        Kind.TABLE,
        "Numbers `{ density = 2350 }`, or tables `{ density = { value, sigma, unit, source } }`.",
        default={},
    ),
    *WHO,
)

PROPERTY = (
    Key("value", Kind.NUMBER, "In the unit."),
    Key("sigma", Kind.NUMBER, "Standard deviation, in the unit.", default=None, at_least=0),
    Key("unit", Kind.TEXT, "SI unit; required for properties that are not listed below.", default=None),
    Key("source", Kind.TEXT, "A test, a document, a table; default: that of the material.", default=None),
)
"""Keys of one property of a material."""

_PHASE = (
    Key("name", Kind.TEXT, 'Its name, e.g. `"2"` or `"repair of 1860"`.'),
    Key("begins", Kind.INTEGER, "Earliest year; negative before our era.", default=None),
    Key("ends", Kind.INTEGER, "Latest year.", default=None),
    Key("description", Kind.TEXT, "In words.", default=None),
    *WHO,
)

_DOCUMENT = (
    Key("code", Kind.TEXT, "Its name in this database."),
    Key("type", Kind.TEXT, "What it is.", choices=DOCUMENT_TYPES),
    Key("title", Kind.TEXT, "In words."),
    Key("place", Kind.TEXT, "Where to find it: a path, a URL, an archive number.", default=None),
    Key("by", Kind.TEXT, "Author of the document itself.", default=None),
    Key("dated", Kind.TEXT, "Date of the document itself, as written there.", default=None),
    *WHO,
)

_STRUCTURE = (
    Key("kind", Kind.TEXT, "What it is."),
    Key("code", Kind.TEXT, "Its name."),
    Key("title", Kind.TEXT, "In words.", default=None),
    Key("parent", Kind.TEXT, "Code of the structure that contains it.", default=None),
    Key("number", Kind.INTEGER, "Of a course or storey, from the lowest.", default=None, at_least=0),
    Key("side", Kind.TEXT, "Of a facing.", default=None, choices=("outer", "inner")),
    Key("stones", Kind.TEXTS, "Codes or expressions of its members.", default=()),
    Key(
        "ordered",
        Kind.BOOLEAN,
        "Whether the members are given in their order; they get ranks from 1.",
        default=False,
    ),
    *WHO,
)

_RELATION = (
    Key("kind", Kind.TEXT, "What it is.", choices=(*RELATIONS, "supports")),
    Key("of", Kind.STONES, "Codes or expressions of the subject stones."),
    Key(
        "to",
        Kind.STONES,
        "Codes or expressions of the object stones; each subject is related to each of them.",
    ),
    *WHO,
)

_CORRECTION = (
    _STONES,
    Key("set", Kind.TABLE, 'New values by attribute: `{ kind = "quoin" }`.', default={}),
    Key("unset", Kind.TEXTS, "Attributes that turn out to be unknown.", default=()),
    Key("reason", Kind.TEXT, "Grounds; default: the source.", default=None),
    *WHO,
)

_DEPTH = (
    _STONES,
    Key("value", Kind.NUMBER, "Depth behind the face.", "m", above=0),
    Key("sigma", Kind.NUMBER, "Its standard deviation.", "m", None, at_least=0),
    *CITED,
    *WHO,
)

_OBSERVATION = (
    Key("type", Kind.TEXT, "Type of damage or remark.", choices=tuple(OBSERVATIONS)),
    Key(
        "severity",
        Kind.INTEGER,
        "From 0 (traces) to 4 (lost, or about to be).",
        default=None,
        at_least=0,
        at_most=4,
    ),
    Key("place", Kind.TEXT, "Where on the stone, in words.", default=None),
    Key("at", Kind.VECTOR, "Position in the frame of the site.", "m", None),
    *_SAID,
)

_WITHDRAW = (
    Key("what", Kind.TEXT, "What is withdrawn.", choices=WITHDRAWN),
    Key(
        "name",
        Kind.TEXT,
        "Of a material, phase, document or structure; or of the property's material.",
        default=None,
    ),
    Key("property", Kind.TEXT, "Name of the property.", default=None),
    *ABOUT,
    Key("kind", Kind.TEXT, "Of the relation.", default=None, choices=(*RELATIONS, "supports")),
    Key("to", Kind.TEXTS, "The other stones of the relation.", default=()),
    Key("match", Kind.TABLE, 'Only statements with these values: `{ sign = "A" }`.', default={}),
    *WHO,
)

ARRAYS: Mapping[str, tuple[Key, ...]] = {
    "kind": _KIND,
    "withdraw": _WITHDRAW,
    "correction": _CORRECTION,
    "material": _MATERIAL,
    "phase": _PHASE,
    "document": _DOCUMENT,
    "structure": _STRUCTURE,
    "relation": _RELATION,
    "depth": _DEPTH,
    "made_of": (Key("material", Kind.TEXT, "Name of the material."), *_SAID),
    "of_phase": (Key("phase", Kind.TEXT, "Name of the phase."), *_SAID),
    "mark": (
        Key("sign", Kind.TEXT, "Name of the mark, the same for the same mark."),
        Key("place", Kind.TEXT, "Where on the stone, in words.", default=None),
        *_SAID,
    ),
    "observation": _OBSERVATION,
    "reference": _SAID,
    "note": (Key("key", Kind.TEXT, "Subject of the note, e.g. `edge`."), *_SAID),
}
"""Keys of every array of tables, in the order of recording."""
