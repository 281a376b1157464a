"""Recording of each table of a file of knowledge."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from archmodel.assertions.arrange import declare_members, declare_relation, declare_structure
from archmodel.assertions.canons import declare_canon, withdraw_canon
from archmodel.assertions.correct import correct
from archmodel.assertions.declare import PropertyValue, declare_document, declare_material, declare_phase
from archmodel.assertions.opinions import decide, set_rule
from archmodel.assertions.register_kind import register_kind
from archmodel.assertions.statements import (
    Remark,
    say_made_of,
    say_mason_mark,
    say_note,
    say_observation,
    say_of_phase,
    say_reference,
    without_replaced,
)
from archmodel.assertions.stratigraphy import (
    Thing,
    say_stratigraphy,
    subjects_named,
    withdraw_stratigraphy,
)
from archmodel.assertions.terms import declare_term, withdraw_term
from archmodel.assertions.withdraw import withdraw_members, withdraw_relations, withdraw_statements
from archmodel.query.api import find
from archmodel.store.find_by_code import Subjects, entity_numbers, held_or_none, structure_numbers, subjects
from archmodel.store.hypotheses import withdraw_hypotheses
from archmodel.store.revisions import NOTHING, RowCounts, withdraw
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import (
    Decision,
    Document,
    MadeOf,
    MasonMark,
    Material,
    MaterialProperty,
    Note,
    Observation,
    OfPhase,
    Phase,
    Reference,
    Statement,
)
from archmodel.tables.relations import RELATIONS
from archmodel.tables.stratigraphy import DEFINITIONS, INVERSE
from archmodel.tables.structures import Structure, structure_kind_named
from archmodel.tables.terms import term_for
from ground.errors import UsageError
from pipelines.record.depth import record_depth
from pipelines.record.file import RecordFile, Table

_CODE = re.compile(r"[\w.:/+-]+")  # a text without blanks or comparison is a code

STATED: Mapping[str, type[Statement]] = {
    "made_of": MadeOf,
    "of_phase": OfPhase,
    "mark": MasonMark,
    "observation": Observation,
    "reference": Reference,
    "note": Note,
    "decision": Decision,
}
"""Kinds of statements by the names of their tables."""

_NAMED: Mapping[str, type[Any]] = {
    "material": Material,
    "property": Material,
    "phase": Phase,
    "document": Document,
    "structure": Structure,
}


@dataclass(frozen=True)
class _Work:
    """A table and its destination."""

    session: Session
    entry: Entry
    file: RecordFile
    table: Table
    before: int | None

    def __getitem__(self, key: str) -> Any:
        return self.table.values[key]

    def remark(self) -> Remark:
        """Return the evidence of a statement; an observation without a date has that of the file."""
        seen, of_file = self["date"], self.file.record["date"]
        if seen is None and self.table.name == "observation":
            seen = of_file
        return Remark(
            self["text"],
            self["document"],
            self["locator"],
            seen,
            stated_on=self["date"] or of_file,
            certainty=self["certainty"],
        )


def record_table(
    session: Session, entry: Entry, file: RecordFile, table: Table, before: int | None = None
) -> RowCounts:
    """Record one table within an entry.

    Parameters
    ----------
    before : number of the entry with which the same file was recorded; then only statements and their withdrawals
        count, and those that their authors replaced since stay replaced

    Raises
    ------
    UsageError
        at the line of the mistake
    """
    with file.at(*table.path):
        return _RECORDERS[table.name](_Work(session, entry, file, table, before))


def _kind(work: _Work) -> RowCounts:
    own = {name: (one["unit"], one["definition"]) for name, one in work["attributes"].items()}
    canon, tolerance = work["canon"], work["tolerance"]
    if tolerance is not None and canon is None:
        raise UsageError("a tolerance without canonical proportions", remedy="give canon = …")
    names = work["name"], work["parent"], work["definition"]
    plain = canon if tolerance is None else None
    outcome = register_kind(work.session, work.entry, *names, canon=plain, attributes=own)
    if tolerance is not None and not outcome.unchanged:
        outcome += declare_canon(work.session, work.entry, work["name"], canon, tolerance)
    return outcome


def _canon(work: _Work) -> RowCounts:
    return declare_canon(work.session, work.entry, work["kind"], work["proportions"], work["tolerance"])


def _term(work: _Work) -> RowCounts:
    return declare_term(
        work.session,
        work.entry,
        work["vocabulary"],
        work["name"],
        work["definition"],
        broader=work["broader"],
        labels=work["labels"],
        iri=work["iri"],
    )


def _material(work: _Work) -> RowCounts:
    properties = {name: PropertyValue(**one) for name, one in work["properties"].items()}
    with work.file.at(*work.table.path, "properties"):
        return declare_material(work.session, work.entry, work["name"], work["description"], properties)


def _phase(work: _Work) -> RowCounts:
    return declare_phase(
        work.session, work.entry, work["name"], work["begins"], work["ends"], work["description"]
    )


def _document(work: _Work) -> RowCounts:
    return declare_document(
        work.session,
        work.entry,
        work["code"],
        work["type"],
        work["title"],
        place=work["place"],
        author=work["by"],
        dated=work["dated"],
    )


def _structure(work: _Work) -> RowCounts:
    with work.file.at(*work.table.path, "kind"):
        # also of the kinds that the database, or this file, registers
        structure_kind_named(work["kind"])
    outcome = declare_structure(
        work.session,
        work.entry,
        work["kind"],
        work["code"],
        title=work["title"],
        parent=work["parent"],
        number=work["number"],
        side=work["side"],
    )
    stones = list(_named_stones(work.session, work.file, work.table).values())
    return outcome + declare_members(work.session, work.entry, work["code"], stones, ordered=work["ordered"])


def _relation(work: _Work) -> RowCounts:
    relations = _stratigraphy(work, (*work["of"], *work["structures"]))
    if relations is not None:
        remark = Remark(stated_on=work.file.record["date"])
        return say_stratigraphy(work.session, work.entry, relations, remark)
    if not work["of"]:
        raise UsageError("the relation has no subject", remedy="give of = […]")
    of, to = (list(_named_stones(work.session, work.file, work.table, key).values()) for key in ("of", "to"))
    return declare_relation(work.session, work.entry, work["kind"], of, to)


def _stratigraphy(work: _Work, subjects: Sequence[str]) -> list[tuple[Thing, str, Thing]] | None:
    """Return the relations between units and stones that a table states; None if they are of stones by geometry.

    Structures rest on one another in the sense of stratigraphy: `rests_on` is `above` for them.
    """
    things = subjects_named(work.session, (*subjects, *work["to"]))
    units = [code for code, (_, structure) in things.items() if structure is not None]
    kind: str = work["kind"]
    if not units and kind in (*RELATIONS, "supports"):
        if missing := set(work.table.values["structures"]) - things.keys():
            structure_numbers(work.session, sorted(missing))
        return None
    kind = {"rests_on": "above", "supports": "below"}.get(kind, kind)
    if kind in ("beside", "across_the_wall"):
        remedy = f"relations of structures are {', '.join((*DEFINITIONS, *INVERSE.values()))}"
        raise UsageError(f"{units[0]} is a structure, and {kind} a relation of stones", remedy=remedy)
    ends = []
    for key, codes in (("of", subjects), ("to", work["to"])):
        named = [things[code] for code in codes if code in things]
        others = tuple(code for code in codes if code not in things)
        stones = _named_stones(work.session, work.file, Table(work.table.path, {key: others}), key)
        ends.append([*named, *((number, None) for number in stones.values())])
    return [(subject, kind, target) for subject in ends[0] for target in ends[1]]


def _depth(work: _Work) -> RowCounts:
    codes = list(_named_stones(work.session, work.file, work.table))
    return record_depth(work.session, work.entry, codes, work["value"], work["sigma"], work.remark())


def _statement(work: _Work) -> RowCounts:
    """Record a statement about stones and structures."""
    session, entry, remark = work.session, work.entry, work.remark()
    about = _named_subjects(session, work.file, work.table, none=work.before is not None)
    if work.before is not None:
        about = without_replaced(session, STATED[work.table.name], about, entry.author)
    match work.table.name:
        case "decision":
            return decide(session, entry, work["about"], about, work["match"], remark)
        case "made_of":
            return say_made_of(session, entry, about, work["material"], remark)
        case "of_phase":
            return say_of_phase(session, entry, about, work["phase"], remark)
        case "mark":
            return say_mason_mark(session, entry, about, work["sign"], work["place"], remark)
        case "observation":
            seen = {key: work[key] for key in ("severity", "place", "at")}
            with work.file.at(*work.table.path, "type"):
                kind = term_for(session, "observation", work["type"])
            return say_observation(session, entry, about, kind, **seen, remark=remark)
        case "reference":
            return say_reference(session, entry, about, remark)
        case _:
            return say_note(session, entry, about, work["key"], remark)


def _correction(work: _Work) -> RowCounts:
    values = {**work["set"], **dict.fromkeys(work["unset"])}
    if not values:
        raise UsageError("empty correction", remedy='give set = { kind = "quoin" }, for example')
    outcome = NOTHING
    for code in _named_stones(work.session, work.file, work.table):
        with work.file.at(*work.table.path, "set"):
            outcome += correct(work.session, work.entry, code, values)
    return outcome


def _withdraw(work: _Work) -> RowCounts:
    what, name = work["what"], work["name"]
    if what in ("canon", "term") and name is None:
        raise UsageError(f"the {what} has no name", remedy="give name = …")
    if what == "canon":
        return withdraw_canon(work.session, work.entry, name)
    if what == "term":
        return withdraw_term(work.session, work.entry, work["vocabulary"] or "observation", name)
    if what in _NAMED:
        return _withdraw_named(work, what)
    if what == "relation":
        if work["kind"] is None:
            raise UsageError("the relation has no kind", remedy='give kind = "beside", for example')
        relations = _stratigraphy(work, (*work["stones"], *work["structures"]))
        if relations is not None:
            return withdraw_stratigraphy(work.session, work.entry, relations)
        of, to = (_named_stones(work.session, work.file, work.table, key) for key in ("stones", "to"))
        return withdraw_relations(
            work.session, work.entry, work["kind"], list(of.values()), list(to.values())
        )
    if what == "hypothesis":
        named = _named_stones(work.session, work.file, work.table)
        return withdraw_hypotheses(work.session, work.entry, named.values())
    about = _named_subjects(work.session, work.file, work.table, none=work.before is not None)
    if what == "member":
        return withdraw_members(work.session, work.entry, about)
    return withdraw_statements(
        work.session, work.entry, STATED[what], about, work["match"], since=work.before or 0
    )


def _rule(work: _Work) -> RowCounts:
    return set_rule(work.session, work.entry, work["about"], work["rule"], work["authors"])


def _withdraw_named(work: _Work, what: str) -> RowCounts:
    """Withdraw a material, one of its properties, a phase, a document or a structure, permanently."""
    cls, name = _NAMED[what], work["name"]
    if name is None:
        raise UsageError(f"the {what} has no name", remedy="give name = …")
    row = held_or_none(work.session, cls, name)
    if row is not None and what == "property":
        row = work.session.scalar(
            select(MaterialProperty).where(
                MaterialProperty.material_id == row.id,
                MaterialProperty.name == work["property"],
                MaterialProperty.superseded_id.is_(None),
            )
        )
    if row is not None:
        return withdraw(work.session, work.entry, row)
    column = cls.name if cls in (Material, Phase) else cls.code
    if work.session.scalar(select(cls.id).where(column == name).limit(1)) is None:
        raise UsageError(
            f"there has never been a {cls.__name__.lower()} {name[:40]!r}", remedy="check its name"
        )
    return RowCounts(unchanged=1)


_RECORDERS: Mapping[str, Callable[[_Work], RowCounts]] = {
    "kind": _kind,
    "canon": _canon,
    "term": _term,
    "withdraw": _withdraw,
    "rule": _rule,
    "correction": _correction,
    "material": _material,
    "phase": _phase,
    "document": _document,
    "structure": _structure,
    "relation": _relation,
    "depth": _depth,
    **dict.fromkeys(STATED, _statement),
}


def _named_stones(
    session: Session, file: RecordFile, table: Table, key: str = "stones", none: bool = False
) -> dict[str, int]:
    """Find the numbers, by code, of the stones that a key names, each once, in the order of the list.

    An expression names at least one, unless `none` is allowed.

    Raises
    ------
    UsageError
        at the key, if an expression cannot be parsed or names no stone
    """
    found: dict[str, int] = {}
    items: Sequence[str] = table.values[key]
    codes = [item for item in items if _CODE.fullmatch(item)]
    with file.at(*table.path, key):
        known = entity_numbers(session, codes)
        for item in items:
            if item in known:
                found[item] = known[item]
                continue
            matching = find(session, "entity", [item])
            if not matching and not none:
                raise UsageError(f"no stone satisfies {item!r}", remedy="try it with: moma query")
            found.update((one.code, one.id) for one in matching)
    return found


def _named_subjects(session: Session, file: RecordFile, table: Table, none: bool = False) -> Subjects:
    """Find the stones and structures of a table, at least one unless `none` is allowed.

    Raises
    ------
    UsageError
        at the key, if it names none
    """
    stones = _named_stones(session, file, table, none=none)
    with file.at(*table.path, "structures"):
        structures = subjects(session, structures=table.values["structures"])
    about = Subjects(tuple(stones.values()), structures.structures)
    with file.at(*table.path):
        if not len(about) and not none:
            remedy = "give stones = […] or structures = […]"
            raise UsageError(f"[[{table.name}]] has no subject", remedy=remedy)
    return about
