"""Keys of a file of knowledge: type, unit, bounds. A test compares docs/knowledge.md with these lists."""

from collections.abc import Mapping

from archmodel.assertions.declare import DOCUMENT_TYPES
from archmodel.tables.knowledge import OBSERVATIONS
from archmodel.tables.opinions import DISPUTABLE, RULES
from archmodel.tables.relations import RELATIONS
from archmodel.tables.stratigraphy import DEFINITIONS, INVERSE
from pipelines.toml.schema import Key, ValueKind

__all__ = ["ABOUT", "ARRAYS", "ATTRIBUTE", "CITED", "PROPERTY", "RECORD", "WHO", "WITHDRAWN"]

WITHDRAWN = (
    "made_of", "of_phase", "decision", "mark", "observation", "reference", "note", "relation", "member", "material",
    "property", "phase", "document", "structure", "hypothesis",
)  # fmt: skip
"""Records that can be withdrawn; a depth is replaced by another one, a registered kind stays."""

RECORD = (
    Key("author", ValueKind.TEXT, "Author of the statements; `--author` takes precedence.", default=None),
    Key("source", ValueKind.TEXT, "Grounds; default: the name of the file.", default=None),
    Key("date", ValueKind.DATE, "Date of all statements without one.", default=None),
)

WHO = (
    Key("author", ValueKind.TEXT, "Author; default: that of `[record]`.", default=None),
    Key("source", ValueKind.TEXT, "Grounds; default: that of `[record]`.", default=None),
)
"""Keys of every table."""

_STONES = Key("stones", ValueKind.STONES, "Codes or expressions of the stones.")
_STONES_OR_NONE = Key("stones", ValueKind.TEXTS, "Codes or expressions of the stones.", default=())
_STRUCTURES = Key("structures", ValueKind.TEXTS, "Codes of structures.", default=())

ABOUT = (_STONES_OR_NONE, _STRUCTURES)
"""Keys for the subjects of a statement; at least one of them is given."""

CITED = (
    Key("text", ValueKind.TEXT, "In words.", default=None),
    Key("document", ValueKind.TEXT, "Code of the document that states it.", default=None),
    Key("locator", ValueKind.TEXT, "Where in the document: page, number of the figure.", default=None),
    Key("date", ValueKind.DATE, "Date of the observation or opinion.", default=None),
    Key(
        "certainty",
        ValueKind.NUMBER,
        "How sure the author is, from 0 to 1.",
        default=None,
        at_least=0,
        at_most=1,
    ),
)
"""Keys of every statement for its evidence."""

_SAID = (*ABOUT, *CITED, *WHO)

_KIND = (
    Key("name", ValueKind.TEXT, "In small letters, with _ between words."),
    Key("parent", ValueKind.TEXT, "The more general kind, of stones or of structures."),
    Key("definition", ValueKind.TEXT, "One sentence: one word, one role."),
    Key(
        "canon",
        ValueKind.TEXT,
        "Canonical proportions, as a query expression over attributes of the stone; default: those of the parent.",
        default=None,
    ),
    Key(
        "attributes",
        ValueKind.TABLE,
        "Attributes of this kind: `{ name = { unit, definition } }`.",
        default={},
    ),
    *WHO,
)

ATTRIBUTE = (
    Key(
        "unit", ValueKind.TEXT, "Unit, `-` for a number without one; without this key: a text.", default=None
    ),
    Key("definition", ValueKind.TEXT, "Its meaning, in a few words."),
)
"""Keys of one attribute of a registered kind."""

_MATERIAL = (
    Key("name", ValueKind.TEXT, "Its name."),
    Key("description", ValueKind.TEXT, "In words.", default=None),
    Key(
        "properties",
        ValueKind.TABLE,
        "Numbers `{ density = 2350 }`, or tables `{ density = { value, sigma, unit, source } }`.",
        default={},
    ),
    *WHO,
)

PROPERTY = (
    Key("value", ValueKind.NUMBER, "In the unit."),
    Key("sigma", ValueKind.NUMBER, "Standard deviation, in the unit.", default=None, at_least=0),
    Key("unit", ValueKind.TEXT, "SI unit; required for properties that are not listed below.", default=None),
    Key(
        "source", ValueKind.TEXT, "A test, a document, a table; default: that of the material.", default=None
    ),
)
"""Keys of one property of a material."""

_PHASE = (
    Key("name", ValueKind.TEXT, 'Its name, e.g. `"2"` or `"repair of 1860"`.'),
    Key("begins", ValueKind.YEAR, "Earliest year; negative before our era.", default=None),
    Key("ends", ValueKind.YEAR, "Latest year.", default=None),
    Key("description", ValueKind.TEXT, "In words.", default=None),
    *WHO,
)

_DOCUMENT = (
    Key("code", ValueKind.TEXT, "Its name in this database."),
    Key("type", ValueKind.TEXT, "What it is.", choices=DOCUMENT_TYPES),
    Key("title", ValueKind.TEXT, "In words."),
    Key("place", ValueKind.TEXT, "Where to find it: a path, a URL, an archive number.", default=None),
    Key("by", ValueKind.TEXT, "Author of the document itself.", default=None),
    Key("dated", ValueKind.TEXT, "Date of the document itself, as written there.", default=None),
    *WHO,
)

_STRUCTURE = (
    Key("kind", ValueKind.TEXT, "What it is."),
    Key("code", ValueKind.TEXT, "Its name."),
    Key("title", ValueKind.TEXT, "In words.", default=None),
    Key("parent", ValueKind.TEXT, "Code of the structure that contains it.", default=None),
    Key("number", ValueKind.INTEGER, "Of a course or storey, from the lowest.", default=None, at_least=0),
    Key("side", ValueKind.TEXT, "Of a facing.", default=None, choices=("outer", "inner")),
    Key("stones", ValueKind.TEXTS, "Codes or expressions of its members.", default=()),
    Key(
        "ordered",
        ValueKind.BOOLEAN,
        "Whether the members are given in their order; they get ranks from 1.",
        default=False,
    ),
    *WHO,
)

_RELATIONS = tuple(dict.fromkeys((*RELATIONS, "supports", *DEFINITIONS, *INVERSE.values())))

_RELATION = (
    Key("kind", ValueKind.TEXT, "What it is.", choices=_RELATIONS),
    Key("of", ValueKind.TEXTS, "Codes of the subjects; expressions for stones.", default=()),
    Key("structures", ValueKind.TEXTS, "Codes of structures among the subjects.", default=()),
    Key(
        "to",
        ValueKind.STONES,
        "Codes of the objects; expressions for stones; each subject is related to each of them.",
    ),
    *WHO,
)

_CORRECTION = (
    _STONES,
    Key("set", ValueKind.TABLE, 'New values by attribute: `{ kind = "quoin" }`.', default={}),
    Key("unset", ValueKind.TEXTS, "Attributes that turn out to be unknown.", default=()),
    Key("reason", ValueKind.TEXT, "Grounds; default: the source.", default=None),
    *WHO,
)

_DEPTH = (
    _STONES,
    Key("value", ValueKind.NUMBER, "Depth behind the face.", "m", above=0),
    Key("sigma", ValueKind.NUMBER, "Its standard deviation.", "m", None, at_least=0),
    *CITED,
    *WHO,
)

_OBSERVATION = (
    Key("type", ValueKind.TEXT, "Type of damage or remark.", choices=tuple(OBSERVATIONS)),
    Key(
        "severity",
        ValueKind.INTEGER,
        "From 0 (traces) to 4 (lost, or about to be).",
        default=None,
        at_least=0,
        at_most=4,
    ),
    Key("place", ValueKind.TEXT, "Where on the stone, in words.", default=None),
    Key("at", ValueKind.VECTOR, "Position in the frame of the site.", "m", None),
    *_SAID,
)

_OPINIONS = Key("about", ValueKind.TEXT, "Kind of the opinions.", choices=tuple(DISPUTABLE))

_DECISION = (
    _OPINIONS,
    Key(
        "match",
        ValueKind.TABLE,
        'The opinion that holds, by its author or value: `{ author = "A. Mason" }`, `{ phase = "2" }`.',
    ),
    *_SAID,
)

_RULE = (
    _OPINIONS,
    Key("rule", ValueKind.TEXT, "The one that holds, where none is decided.", choices=RULES),
    Key("authors", ValueKind.TEXTS, "In the order in which they count, for `author`.", default=()),
    *WHO,
)

_WITHDRAW = (
    Key("what", ValueKind.TEXT, "What is withdrawn.", choices=WITHDRAWN),
    Key(
        "name",
        ValueKind.TEXT,
        "Of a material, phase, document or structure; or of the property's material.",
        default=None,
    ),
    Key("property", ValueKind.TEXT, "Name of the property.", default=None),
    *ABOUT,
    Key("kind", ValueKind.TEXT, "Of the relation.", default=None, choices=_RELATIONS),
    Key("to", ValueKind.TEXTS, "The objects of the relation.", default=()),
    Key("match", ValueKind.TABLE, 'Only statements with these values: `{ sign = "A" }`.', default={}),
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
    "rule": _RULE,
    "made_of": (Key("material", ValueKind.TEXT, "Name of the material."), *_SAID),
    "of_phase": (Key("phase", ValueKind.TEXT, "Name of the phase."), *_SAID),
    "mark": (
        Key("sign", ValueKind.TEXT, "Name of the mark, the same for the same mark."),
        Key("place", ValueKind.TEXT, "Where on the stone, in words.", default=None),
        *_SAID,
    ),
    "observation": _OBSERVATION,
    "reference": _SAID,
    "note": (Key("key", ValueKind.TEXT, "Subject of the note, e.g. `edge`."), *_SAID),
    "decision": _DECISION,
}
"""Keys of every array of tables, in the order of recording."""
