"""Keys of a file of knowledge: type, unit, bounds. A test compares docs/knowledge.md with these lists."""

import datetime
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from archmodel.tables.opinions import DISPUTABLE, RULES
from archmodel.tables.relations import RELATIONS
from archmodel.tables.stratigraphy import DEFINITIONS, INVERSE
from archmodel.tables.terms import VOCABULARIES
from ground.settings import Setting
from ground.toml.keys import Stones, Table, Texts, Vector, Year, keys_of
from ground.toml.schema import Key

WITHDRAWN = (
    "made_of", "of_phase", "decision", "mark", "observation", "reference", "note", "relation", "member", "material",
    "property", "phase", "document", "structure", "hypothesis", "canon", "term",
)  # fmt: skip
"""Records that can be withdrawn; a depth is replaced by another one, a registered kind stays."""


@dataclass(frozen=True, kw_only=True)
class _Record:
    """Table [record]."""

    author: Annotated[str | None, Setting("Author of the statements; `--author` takes precedence.")] = None
    source: Annotated[str | None, Setting("Grounds; default: the name of the file.")] = None
    date: Annotated[datetime.date | None, Setting("Date of all statements without one.")] = None


RECORD = keys_of(_Record)


@dataclass(frozen=True, kw_only=True)
class _Who:
    """Keys of every table."""

    author: Annotated[str | None, Setting("Author; default: that of `[record]`.")] = None
    source: Annotated[str | None, Setting("Grounds; default: that of `[record]`.")] = None


WHO = keys_of(_Who)
"""Keys of every table."""


@dataclass(frozen=True, kw_only=True)
class _About:
    """Subjects of a statement; at least one of them is given."""

    stones: Annotated[Texts, Setting("Codes or expressions of the stones.")] = ()
    structures: Annotated[Texts, Setting("Codes of structures.")] = ()


ABOUT = keys_of(_About)
"""Keys for the subjects of a statement; at least one of them is given."""


@dataclass(frozen=True, kw_only=True)
class _Cited:
    """Evidence of every statement."""

    text: Annotated[str | None, Setting("In words.")] = None
    document: Annotated[str | None, Setting("Code of the document that states it.")] = None
    locator: Annotated[str | None, Setting("Where in the document: page, number of the figure.")] = None
    date: Annotated[datetime.date | None, Setting("Date of the observation or opinion.")] = None
    certainty: Annotated[
        float | None, Setting("How sure the author is, from 0 to 1.", at_least=0, at_most=1)
    ] = None


CITED = keys_of(_Cited)
"""Keys of every statement for its evidence."""

_STATEMENT_KEYS = (*ABOUT, *CITED, *WHO)


_TOLERANCE = Setting("Share of the canonical number by which it may be missed.", "-", above=0, below=1)


@dataclass(frozen=True, kw_only=True)
class _CanonTable:
    """Table [[canon]]."""

    kind: Annotated[str, Setting("Kind of stones or of structures.")]
    proportions: Annotated[str, Setting("Query expression over its attributes.")]
    tolerance: Annotated[float | None, _TOLERANCE] = None


@dataclass(frozen=True, kw_only=True)
class _TermTable:
    """Table [[term]]."""

    vocabulary: Annotated[str, Setting("Which one it extends.", choices=tuple(VOCABULARIES))]
    name: Annotated[str, Setting("The term.")]
    definition: Annotated[
        str | None, Setting("One sentence; needed for new types of observations and documents.")
    ] = None
    broader: Annotated[str | None, Setting("The term of which it is a case.")] = None
    labels: Annotated[
        Table,
        Setting(
            'Labels by language, the preferred one first: `{ de = "Riss", fr = ["fissure", "lézarde"] }`.'
        ),
    ] = field(default_factory=dict)
    iri: Annotated[str | None, Setting("Identifier of the concept in a published vocabulary.")] = None


@dataclass(frozen=True, kw_only=True)
class _KindTable:
    """Table [[kind]]."""

    name: Annotated[str, Setting("In small letters, with _ between words.")]
    parent: Annotated[str, Setting("The more general kind, of stones or of structures.")]
    definition: Annotated[str, Setting("One sentence: one word, one role.")]
    canon: Annotated[
        str | None,
        Setting(
            "Canonical proportions, as a query expression over its attributes; default: those of the parent."
        ),
    ] = None
    tolerance: Annotated[float | None, _TOLERANCE] = None
    attributes: Annotated[Table, Setting("Attributes of this kind: `{ name = { unit, definition } }`.")] = (
        field(default_factory=dict)
    )


@dataclass(frozen=True, kw_only=True)
class _Attribute:
    """Attribute of a registered kind."""

    unit: Annotated[str | None, Setting("Unit, `-` for a number without one; without this key: a text.")] = (
        None
    )
    definition: Annotated[str, Setting("Its meaning, in a few words.")]


ATTRIBUTE = keys_of(_Attribute)
"""Keys of one attribute of a registered kind."""


@dataclass(frozen=True, kw_only=True)
class _MaterialTable:
    """Table [[material]]."""

    name: Annotated[str, Setting("Its name.")]
    description: Annotated[str | None, Setting("In words.")] = None
    properties: Annotated[
        Table,
        Setting("Numbers `{ density = 2350 }`, or tables `{ density = { value, sigma, unit, source } }`."),
    ] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class _Property:
    """Property of a material."""

    value: Annotated[float, Setting("In the unit.")]
    sigma: Annotated[float | None, Setting("Standard deviation, in the unit.", at_least=0)] = None
    unit: Annotated[str | None, Setting("SI unit; required for properties that are not listed below.")] = None
    source: Annotated[str | None, Setting("A test, a document, a table; default: that of the material.")] = (
        None
    )


PROPERTY = keys_of(_Property)
"""Keys of one property of a material."""


@dataclass(frozen=True, kw_only=True)
class _PhaseTable:
    """Table [[phase]]."""

    name: Annotated[str, Setting('Its name, e.g. `"2"` or `"repair of 1860"`.')]
    begins: Annotated[Year | None, Setting("Earliest year; negative before our era.")] = None
    ends: Annotated[Year | None, Setting("Latest year.")] = None
    description: Annotated[str | None, Setting("In words.")] = None


@dataclass(frozen=True, kw_only=True)
class _DocumentTable:
    """Table [[document]]."""

    code: Annotated[str, Setting("Its name in this database.")]
    type: Annotated[str, Setting("What it is: a term of the vocabulary `document`.")]
    title: Annotated[str, Setting("In words.")]
    place: Annotated[str | None, Setting("Where to find it: a path, a URL, an archive number.")] = None
    by: Annotated[str | None, Setting("Author of the document itself.")] = None
    dated: Annotated[str | None, Setting("Date of the document itself, as written there.")] = None


@dataclass(frozen=True, kw_only=True)
class _StructureTable:
    """Table [[structure]]."""

    kind: Annotated[str, Setting("What it is.")]
    code: Annotated[str, Setting("Its name.")]
    title: Annotated[str | None, Setting("In words.")] = None
    parent: Annotated[str | None, Setting("Code of the structure that contains it.")] = None
    number: Annotated[int | None, Setting("Of a course or storey, from the lowest.", at_least=0)] = None
    side: Annotated[
        str | None,
        Setting(
            "Of a facing.",
            choices=(
                "outer",
                "inner",
            ),
        ),
    ] = None
    stones: Annotated[Texts, Setting("Codes or expressions of its members.")] = ()
    ordered: Annotated[
        bool, Setting("Whether the members are given in their order; they get ranks from 1.")
    ] = False


_RELATIONS = tuple(dict.fromkeys((*RELATIONS, "supports", *DEFINITIONS, *INVERSE.values())))


@dataclass(frozen=True, kw_only=True)
class _RelationTable:
    """Table [[relation]]."""

    kind: Annotated[str, Setting("What it is.", choices=_RELATIONS)]
    of: Annotated[Texts, Setting("Codes of the subjects; expressions for stones.")] = ()
    structures: Annotated[Texts, Setting("Codes of structures among the subjects.")] = ()
    to: Annotated[
        Stones,
        Setting("Codes of the objects; expressions for stones; each subject is related to each of them."),
    ]


@dataclass(frozen=True, kw_only=True)
class _CorrectionTable:
    """Table [[correction]]."""

    stones: Annotated[Stones, Setting("Codes or expressions of the stones.")]
    set: Annotated[Table, Setting('New values by attribute: `{ kind = "quoin" }`.')] = field(
        default_factory=dict
    )
    unset: Annotated[Texts, Setting("Attributes that turn out to be unknown.")] = ()
    reason: Annotated[str | None, Setting("Grounds; default: the source.")] = None


@dataclass(frozen=True, kw_only=True)
class _DepthTable:
    """Table [[depth]]."""

    stones: Annotated[Stones, Setting("Codes or expressions of the stones.")]
    value: Annotated[float, Setting("Depth behind the face.", "m", above=0)]
    sigma: Annotated[float | None, Setting("Its standard deviation.", "m", at_least=0)] = None


@dataclass(frozen=True, kw_only=True)
class _ObservationTable:
    """Table [[observation]]."""

    type: Annotated[str, Setting("Type of damage or remark: a term of the vocabulary `observation`.")]
    severity: Annotated[
        int | None, Setting("From 0 (traces) to 4 (lost, or about to be).", at_least=0, at_most=4)
    ] = None
    place: Annotated[str | None, Setting("Where on the stone, in words.")] = None
    at: Annotated[Vector | None, Setting("Position in the frame of the site.", "m")] = None


@dataclass(frozen=True, kw_only=True)
class _DecisionTable:
    """Table [[decision]]."""

    about: Annotated[str, Setting("Kind of the opinions.", choices=tuple(DISPUTABLE))]
    match: Annotated[
        Table,
        Setting(
            'The opinion that holds, by its author or value: `{ author = "A. Mason" }`, `{ phase = "2" }`.'
        ),
    ]


@dataclass(frozen=True, kw_only=True)
class _RuleTable:
    """Table [[rule]]."""

    about: Annotated[str, Setting("Kind of the opinions.", choices=tuple(DISPUTABLE))]
    rule: Annotated[str, Setting("The one that holds, where none is decided.", choices=RULES)]
    authors: Annotated[Texts, Setting("In the order in which they count, for `author`.")] = ()


@dataclass(frozen=True, kw_only=True)
class _WithdrawTable:
    """Table [[withdraw]]."""

    what: Annotated[str, Setting("What is withdrawn.", choices=WITHDRAWN)]
    name: Annotated[
        str | None,
        Setting(
            "Of a material, phase, document, structure, term or kind with a canon; or of the property's material."
        ),
    ] = None
    property: Annotated[str | None, Setting("Name of the property.")] = None
    vocabulary: Annotated[str | None, Setting("Of the term.", choices=tuple(VOCABULARIES))] = None
    kind: Annotated[str | None, Setting("Of the relation.", choices=_RELATIONS)] = None
    to: Annotated[Texts, Setting("The objects of the relation.")] = ()
    match: Annotated[Table, Setting('Only statements with these values: `{ sign = "A" }`.')] = field(
        default_factory=dict
    )


@dataclass(frozen=True, kw_only=True)
class _MadeOfTable:
    """Table [[made_of]]."""

    material: Annotated[str, Setting("Name of the material.")]


@dataclass(frozen=True, kw_only=True)
class _OfPhaseTable:
    """Table [[of_phase]]."""

    phase: Annotated[str, Setting("Name of the phase.")]


@dataclass(frozen=True, kw_only=True)
class _MarkTable:
    """Table [[mark]]."""

    sign: Annotated[str, Setting("Name of the mark, the same for the same mark.")]
    place: Annotated[str | None, Setting("Where on the stone, in words.")] = None


@dataclass(frozen=True, kw_only=True)
class _NoteTable:
    """Table [[note]]."""

    key: Annotated[str, Setting("Subject of the note, e.g. `edge`.")]


ARRAYS: Mapping[str, tuple[Key, ...]] = {
    "kind": (*keys_of(_KindTable), *WHO),
    "canon": (*keys_of(_CanonTable), *WHO),
    "term": (*keys_of(_TermTable), *WHO),
    "withdraw": (*keys_of(_WithdrawTable), *ABOUT, *WHO),
    "correction": (*keys_of(_CorrectionTable), *WHO),
    "material": (*keys_of(_MaterialTable), *WHO),
    "phase": (*keys_of(_PhaseTable), *WHO),
    "document": (*keys_of(_DocumentTable), *WHO),
    "structure": (*keys_of(_StructureTable), *WHO),
    "relation": (*keys_of(_RelationTable), *WHO),
    "depth": (*keys_of(_DepthTable), *CITED, *WHO),
    "rule": (*keys_of(_RuleTable), *WHO),
    "made_of": (*keys_of(_MadeOfTable), *_STATEMENT_KEYS),
    "of_phase": (*keys_of(_OfPhaseTable), *_STATEMENT_KEYS),
    "mark": (*keys_of(_MarkTable), *_STATEMENT_KEYS),
    "observation": (*keys_of(_ObservationTable), *_STATEMENT_KEYS),
    "reference": _STATEMENT_KEYS,
    "note": (*keys_of(_NoteTable), *_STATEMENT_KEYS),
    "decision": (*keys_of(_DecisionTable), *_STATEMENT_KEYS),
}
"""Keys of every array of tables, in the order of recording."""
