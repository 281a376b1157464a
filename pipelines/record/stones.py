"""Stones that a file of knowledge names, by codes and expressions."""

import re
from collections.abc import Sequence

from sqlalchemy.orm import Session

from archmodel.query.api import find
from archmodel.store.find_by_code import Subjects, entity_numbers, subjects
from moma.errors import UsageError
from pipelines.record.file import RecordFile, Table

__all__ = ["named_stones", "named_subjects"]

_CODE = re.compile(r"[\w.:/+-]+")  # a text without blanks or comparison is a code


def named_stones(session: Session, file: RecordFile, table: Table, key: str = "stones") -> dict[str, int]:
    """Find the numbers, by code, of the stones that a key names, each once, in the order of the list.

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
            if not matching:
                raise UsageError(f"no stone satisfies {item!r}", remedy="try it with: moma query")
            found.update((one.code, one.id) for one in matching)
    return found


def named_subjects(session: Session, file: RecordFile, table: Table) -> Subjects:
    """Find the stones and structures of a table, at least one.

    Raises
    ------
    UsageError
        at the key, if it names none
    """
    stones = named_stones(session, file, table)
    with file.at(*table.path, "structures"):
        structures = subjects(session, structures=table.values["structures"])
    about = Subjects(tuple(stones.values()), structures.structures)
    with file.at(*table.path):
        if not len(about):
            remedy = "give stones = […] or structures = […]"
            raise UsageError(f"[[{table.name}]] has no subject", remedy=remedy)
    return about
