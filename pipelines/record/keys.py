"""Keys of a file of knowledge: type, unit, bounds. A test compares docs/knowledge.md with these lists."""

from collections.abc import Mapping

from archmodel.assertions.declare import DOCUMENT_TYPES
from archmodel.tables.knowledge import OBSERVATIONS
from archmodel.tables.relations import RELATIONS
from archmodel.tables.structures import structure_kinds
from pipelines.toml.schema import Key, Kind

__all__ = ["ABOUT", "ARRAYS", "ATTRIBUTE", "CITED", "PROPERTY", "RECORD", "WHO", "WITHDRAWN"]

WITHDRAWN = (
    "made_of",
    "of_phase",
    "mark",
    "observation",
    "reference",
    "note",
    "relation",
    "member",
    "material",
    "property",
    "phase",
    "document",
    "structure",
    "hypothesis",
)
"""Records that can be withdrawn; a depth is replaced by another one, a registered kind stays."""

RECORD = (
    Key("author", Kind.TEXT, "Who says all this; `--author` goes before it.", default=None),
    Key("source", Kind.TEXT, "On what grounds; else the name of the file.", default=None),
    Key("date", Kind.DATE, "Date of all observations that do not give their own.", default=None),
)

WHO = (
    Key("author", Kind.TEXT, "Who says so; else that of `[record]`.", default=None),
    Key("source", Kind.TEXT, "On what grounds; else that of `[record]`.", default=None),
)
"""Keys of every table."""

_STONES = Key("stones", Kind.STONES, "Codes or expressions of the stones.")
_STONES_OR_NONE = Key("stones", Kind.TEXTS, "Codes or expressions of the stones.", default=())
_STRUCTURES = Key("structures", Kind.TEXTS, "Codes of structures.", default=())

ABOUT = (_STONES_OR_NONE, _STRUCTURES)
"""Keys for the subjects of a statement; at least one of them is given."""

CITED = (
    Key("text", Kind.TEXT, "In words.", default=None),
    Key("document", Kind.TEXT, "Code of the document that says so.", default=None),
    Key("locator", Kind.TEXT, "Where in the document: page, number of the figure.", default=None),
    Key("date", Kind.DATE, "Date on which it was seen.", default=None),
)
"""Keys of every statement for its evidence."""

_SAID = (*ABOUT, *CITED, *WHO)

_KIND = (
    Key("name", Kind.TEXT, "In small letters, with _ between words."),
    Key("parent", Kind.TEXT, "The kind that it is a case of."),
    Key("definition", Kind.TEXT, "One sentence: one word, one role."),
    Key(
        "canon",
        Kind.TEXT,
        "Canonical proportions, as a query expression about attributes of the stone; else those of the parent.",
        default=None,
    ),
    Key("attributes", Kind.TABLE, "Its own: `{ name = { unit, definition } }`.", default={}),
    *WHO,
)

ATTRIBUTE = (
    Key("unit", Kind.TEXT, "Its unit, `-` for a number without one; left out: a text.", default=None),
    Key("definition", Kind.TEXT, "What it is, in a few words."),
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
    Key("unit", Kind.TEXT, "SI; needed for properties that are not listed below.", default=None),
    Key("source", Kind.TEXT, "A test, a document, a table; else that of the material.", default=None),
)
"""Keys of one property of a material."""

_PHASE = (
    Key("name", Kind.TEXT, 'Its name, e.g. `"2"` or `"repair of 1860"`.'),
    Key("begins", Kind.INTEGER, "Year, at the earliest; negative before our era.", default=None),
    Key("ends", Kind.INTEGER, "Year, at the latest.", default=None),
    Key("description", Kind.TEXT, "In words.", default=None),
    *WHO,
)

_DOCUMENT = (
    Key("code", Kind.TEXT, "Its name in this database."),
    Key("type", Kind.TEXT, "What it is.", choices=DOCUMENT_TYPES),
    Key("title", Kind.TEXT, "In words."),
    Key("place", Kind.TEXT, "Where it can be found: a path, a URL, an archive's number.", default=None),
    Key("by", Kind.TEXT, "Author of the document itself.", default=None),
    Key("dated", Kind.TEXT, "Date of the document itself, as it gives it.", default=None),
    *WHO,
)

_STRUCTURE = (
    Key("kind", Kind.TEXT, "What it is.", choices=tuple(structure_kinds())),
    Key("code", Kind.TEXT, "Its name."),
    Key("title", Kind.TEXT, "In words.", default=None),
    Key("parent", Kind.TEXT, "Code of the structure that it is a part of.", default=None),
    Key("number", Kind.INTEGER, "Of a course or storey, from the lowest.", default=None, at_least=0),
    Key("side", Kind.TEXT, "Of a facing.", default=None, choices=("outer", "inner")),
    Key("stones", Kind.TEXTS, "Codes or expressions of its members.", default=()),
    Key(
        "ordered", Kind.BOOLEAN, "The members are given in their order; they get ranks from 1.", default=False
    ),
    *WHO,
)

_RELATION = (
    Key("kind", Kind.TEXT, "What it is.", choices=(*RELATIONS, "supports")),
    Key("of", Kind.STONES, "Codes or expressions of the stones that are in relation."),
    Key("to", Kind.STONES, "Codes or expressions of the stones that each of them is in relation to."),
    *WHO,
)

_CORRECTION = (
    _STONES,
    Key("set", Kind.TABLE, 'New values by attribute: `{ kind = "quoin" }`.', default={}),
    Key("unset", Kind.TEXTS, "Attributes that are not known after all.", default=()),
    Key("reason", Kind.TEXT, "On what grounds; else the source.", default=None),
    *WHO,
)

_DEPTH = (
    _STONES,
    Key("value", Kind.NUMBER, "How far they reach into the wall.", "m", above=0),
    Key("sigma", Kind.NUMBER, "Its standard deviation.", "m", None, at_least=0),
    *CITED,
    *WHO,
)

_OBSERVATION = (
    Key("type", Kind.TEXT, "What was seen.", choices=tuple(OBSERVATIONS)),
    Key(
        "severity",
        Kind.INTEGER,
        "From 0 (traces) to 4 (lost, or about to be).",
        default=None,
        at_least=0,
        at_most=4,
    ),
    Key("place", Kind.TEXT, "Where on the stone, in words.", default=None),
    Key("at", Kind.VECTOR, "Where, in the frame of the site.", "m", None),
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
    Key("match", Kind.TABLE, 'Only what says this: `{ sign = "A" }`.', default={}),
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
    "note": (Key("key", Kind.TEXT, "What the word is about, e.g. `edge`."), *_SAID),
}
"""Keys of every array of tables, in the order of recording."""
