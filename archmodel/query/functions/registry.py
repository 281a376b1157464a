"""Registry of query functions by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from archmodel.query.functions import knowledge, texts
from archmodel.query.functions import relations as related
from archmodel.query.functions import spatial as places
from archmodel.query.functions import stratigraphy as layered
from archmodel.query.functions import structures as whole
from archmodel.query.functions.usages import STRUCTURE_USAGES, USAGES, Ask, Condition
from archmodel.query.grammar import Call

Sql = Callable[[Any, Call, Ask], Condition]


@dataclass(frozen=True)
class Function:
    """Function of query expressions that is true or false of an entity, or of a structure.

    Attributes
    ----------
    name : as users write it
    usages : ways to write it, and what each says
    sql : the condition, of the scope, the call, and what makes conditions of nested expressions
    """

    name: str
    usages: tuple[tuple[str, str], ...]
    sql: Sql


_SQL: Mapping[str, Sql] = {
    "within": places.within,
    "within_box": places.within_box,
    "rests_on": related.related("rests_on", "subject_id", "object_id"),
    "supports": related.related("rests_on", "object_id", "subject_id"),
    "beside": related.related("beside", "subject_id", "object_id"),
    "bonded_with": related.related("bonded_with", "subject_id", "object_id"),
    "across_the_wall": related.related("across_the_wall", "subject_id", "object_id"),
    "above": related.load_path("object_id", "subject_id"),
    "below": related.load_path("subject_id", "object_id"),
    "after": layered.in_time(later=True),
    "before": layered.in_time(later=False),
    "contradicted": layered.contradicted,
    "member_of": related.member_of,
    "has_mark": knowledge.has_mark,
    "observed": knowledge.observed,
    "documented": knowledge.documented,
    "by": knowledge.by,
    "disputed": knowledge.disputed,
    "text": texts.text,
    "corrected": knowledge.corrected,
    "in_mechanism": knowledge.in_mechanism,
    "is_a": knowledge.is_a,
    "canonical": knowledge.canonical,
    "moved_since": places.moved_since,
}

_SQL_OF_STRUCTURES: Mapping[str, Sql] = {
    "part_of": related.part_of,
    "has": whole.has,
    "is_a": knowledge.is_a,
    "above": layered.on_one_another(upwards=True),
    "below": layered.on_one_another(upwards=False),
    "after": layered.in_time(later=True),
    "before": layered.in_time(later=False),
    "contradicted": layered.contradicted,
    "disputed": whole.disputed_structure,
    "changes": whole.changes,
    "canonical": knowledge.canonical,
}

FUNCTIONS: Mapping[str, Function] = {
    name: Function(name, usages, _SQL[name]) for name, usages in USAGES.items()
}
"""What can be asked of an entity."""

STRUCTURE_FUNCTIONS: Mapping[str, Function] = {
    name: Function(name, usages, _SQL_OF_STRUCTURES[name]) for name, usages in STRUCTURE_USAGES.items()
}
"""What can be asked of a structure, in a list of structures and within ``member_of(…)``."""
