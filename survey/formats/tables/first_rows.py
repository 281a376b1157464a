"""Reading of the rows beneath the names of columns: units, roles by their values, numbers taken for stones."""

import re
from collections.abc import Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import replace
from typing import Any

from ground.errors import SurveyError
from ground.tables.columns import length_unit, plain
from ground.tables.numbers import EMPTY, shown
from ground.tables.rows import ListRows, TextRows
from ground.units import LENGTHS
from survey.conventions import CHECKED, CORNERS, GROUP
from survey.formats.tables.code_template import CodeTemplate
from survey.formats.tables.columns import ColumnMap, Columns, kind_of_column
from survey.formats.tables.point_table import TableStone
from survey.formats.tables.roles import CONTROL, ROLES, STATION, role_of, roles_with

AnyRows = TextRows | ListRows

_ROLE_WORDS = frozenset(
    role for role in ROLES if len(role) > 1 or role in "vp"
)  # other letters may number points
_OF_STONES = {"vertex", "point", STATION, CONTROL}
_FEW_WORDS = GROUP  # unknown ones in a column of roles
_FEWEST = CHECKED  # rows from which a table of a stone for each row is one of points without stones
_NO_CODE = "{block}:{role}:{kind}"  # a template beside which all usual ones are tried
_ADVISED = re.compile(r'--codes "[^"]*"')


def with_role(
    rows: AnyRows,
    ahead: Sequence[tuple[int, Any]],
    names: Sequence[str],
    column_map: ColumnMap,
    codes: bool,
    own_words: Mapping[str, str],
) -> ColumnMap:
    """Return the map of the columns with the one whose values are all roles of points as the role.

    It may have any name, also one of kinds, numbers or names of points. Words of one letter, which may number points or
    abbreviate kinds, and numbered words are roles where stones have some of corners and some of points on the face:
    E1, E2, E3, M. A column that never differs within a stone is of the stone.
    """
    known = [kind_of_column(name) if name else "" for name in names]
    if "role" in (*known, *column_map.names) or column_map.numbered or (codes and "description" in known):
        return column_map
    free = [
        k for k, what in enumerate(known) if what in (None, "kind", "name") and names.count(names[k]) == 1
    ]
    free = [k for k in free if names[k] not in column_map.names.values()]
    by_stone = _words_of_stones(rows, ahead, free, _places_of_stones(names, known, column_map))
    words = {k: set[str]().union(*(stone[k] for stone in by_stone.values())) for k in free}
    all_roles = roles_with(own_words)
    roles = [
        k
        for k in free
        if words[k] and _are_roles([stone[k] for stone in by_stone.values()], all_roles, own_words)
    ]
    if not roles:
        differing = [k for k in free if any(len(stone[k]) > 1 for stone in by_stone.values())]
        asked = {names[k]: words[k] for k in differing if not {plain(names[k]), "*"} & column_map.ignored}
        _check_words(rows.path, asked, all_roles)
    if len(roles) != 1:
        return column_map
    return replace(column_map, names={**column_map.names, "role": names[roles[0]]})


def _places_of_stones(
    names: Sequence[str], kinds: Sequence[str | None], column_map: ColumnMap
) -> tuple[int, ...]:
    """Return the columns that name the stones."""
    stated = column_map.names.get("block", "")
    wanted = (stated, *stated.split("+"))
    places = tuple(k for k, name in enumerate(names) if name in wanted)
    return (
        places or tuple(kinds.index(what) for what in ("block", "description", "name") if what in kinds)[:1]
    )


def _words_of_stones(
    rows: AnyRows, ahead: Sequence[tuple[int, Any]], columns: Sequence[int], stones: Sequence[int]
) -> dict[tuple[str, ...], dict[int, set[str]]]:
    """Return the words in columns by the name of a stone, which may stand in its first row alone."""
    words: dict[tuple[str, ...], dict[int, set[str]]] = {}
    stone: tuple[str, ...] = ()
    for i, (number, row) in enumerate(ahead):
        with suppress(SurveyError):  # told when the row is read
            values = [*rows.cells(row, number), *[""] * (1 + max(columns, default=0))]
            named = tuple(values[k] for k in stones if k < len(values))
            stone = named if any(named) else stone
            of_stone = words.setdefault(stone, {k: set() for k in columns})
            for k in columns:
                word = values[k].casefold()
                of_stone[k] |= {word} if word or i else set()  # the first row may hold units
    return words


def _are_roles(stones: Sequence[Set[str]], roles: Mapping[str, str], own_words: Mapping[str, str]) -> bool:
    """Return whether the words of a column, by stone, are all roles of points."""
    words = set[str]().union(*stones)
    found = {role_of(word, roles) for word in words}
    if not found <= _OF_STONES:
        return False
    differ = any({"vertex", "point"} <= {role_of(word, roles) for word in stone} for stone in stones)
    clear = words <= _ROLE_WORDS | own_words.keys()
    return differ or (clear and not {"vertex", "point"} <= found)


def _check_words(path: str, columns: Mapping[str, Set[str]], roles: Mapping[str, str]) -> None:
    """Ask for the words of a column of which some are roles of corners, and others none that is known."""
    for name, words in columns.items():
        unknown = sorted(word for word in words if role_of(word, roles) is None)
        corners = [word for word in words if len(word) > 1 and roles.get(word) == "vertex"]
        if corners and "" not in words and 0 < len(unknown) <= _FEW_WORDS:
            pairs = ",".join(f"{word}=point" for word in unknown)
            raise SurveyError(
                f"column {shown(name)} holds {', '.join((*corners, *unknown))}: are these corners and other points?",
                where=path,
                remedy=f'if so, give --roles "{pairs}"; if not, --columns "ignore={name}"',
            )


def with_units(rows: AnyRows, ahead: Sequence[tuple[int, Any]], columns: Columns) -> tuple[int, Columns]:
    """Return the number of rows that state units, one or none, and the columns with them."""
    if not ahead or not {*"xyz"} <= columns.at.keys():
        return 0, columns
    number, row = ahead[0]
    try:
        values = [*rows.cells(row, number), *[""] * columns.count]
    except SurveyError:  # told when the row is read
        return 0, columns
    stated = {what: _unit(values[k]) for what, k in columns.at.items()}
    name = values[columns.at["block"]] if "block" in columns.at else ""
    if not all(stated[axis] for axis in "xyz") or name.lower() not in EMPTY | {""}:
        return 0, columns
    return 1, replace(
        columns, scales={**columns.scales, **{k: LENGTHS[unit] for k, unit in stated.items() if unit}}
    )


def are_headed(rows: AnyRows, ahead: Sequence[tuple[int, Any]], columns: Columns) -> bool:
    """Return whether the name of a stone stands in the first of its rows alone: most rows have none."""
    named: list[bool] = []
    if columns.joined or not {"block", *"xyz"} <= columns.at.keys() or "description" in columns.at:
        return False
    for number, row in ahead:
        with suppress(SurveyError):  # told when the row is read
            values = [*rows.cells(row, number), *[""] * columns.count]
            if all(values[columns.at[axis]] for axis in "xyz"):
                named.append(bool(values[columns.at["block"]]))
    return bool(named) and named[0] and CORNERS * sum(named) <= len(named)


def _unit(text: str) -> str | None:
    """Return the unit of length that a cell states, such as [m] or m a.s.l.; None if it states none."""
    words = text.strip("[]() ").split()
    return length_unit(words[0]) if words else None


def check_stones_repeat(
    path: str,
    columns: Columns,
    names: Sequence[str],
    stones: Mapping[str, TableStone],
    column_map: str | None,
) -> None:
    """Refuse a table in which every row is a stone of its own: its column of stones numbers the points.

    Parameters
    ----------
    path : of the table, for errors
    columns, names : of the table
    stones : that were read
    column_map : as the user gave it

    Raises
    ------
    SurveyError
        with the column that repeats as names of stones do, or that holds codes
    """
    sound = [stone for stone in stones.values() if stone.error is None]
    if len(sound) < _FEWEST or any(len(one.vertices) + len(one.points) > 3 for one in sound):
        return
    before = f"{column_map}," if column_map else ""
    remedy = 'name the column of the stones, e.g. --columns "block=…"'
    for _, name in columns.notes:
        texts = [next(iter((one.notes or {}).get(note_key(name), {})), "") for one in sound]
        if not all(texts):
            continue
        advice = _ADVISED.search(CodeTemplate(_NO_CODE).expected(texts[0], texts[1:]))
        if advice is not None and "{role" in advice[0]:
            remedy = f'if {shown(name)} holds codes, give --columns "{before}description={name}" {advice[0]}'
            break
        if len(texts) >= CORNERS * len(set(texts)) > CORNERS:
            remedy = f'name the column of the stones: --columns "{before}block={name}"'
            break
    at = columns.at["block"]
    what = shown(names[at]) if at < len(names) else str(at + 1)
    raise SurveyError(f"each of {len(sound)} rows is a stone of its own: column {what} numbers the points",
                      where=path, remedy=remedy)  # fmt: skip


def check_names(path: str, title: str, stones: Mapping[str, TableStone]) -> None:
    """Refuse codes that were taken for names: a column of descriptions that holds stones and the roles of points.

    Parameters
    ----------
    path : of the table, for errors
    title : of the column that names the stones
    stones : that were read

    Raises
    ------
    SurveyError
        with the template that reads them
    """
    names = [stone.name for stone in stones.values() if stone.name]
    if len(names) < _FEWEST:
        return
    expected = CodeTemplate(_NO_CODE).expected(names[0], names[1:])
    advice = _ADVISED.search(expected)
    if advice is None or "{role" not in advice[0]:
        return
    template = CodeTemplate(advice[0].removeprefix('--codes "').removesuffix('"'))
    roles: dict[str, set[str]] = {}
    for fields in filter(None, map(template.parse, names)):
        roles.setdefault(fields.block, set()).add(fields.role)
    if any({"vertex", "point"} <= one for one in roles.values()):
        what = f"column {shown(title)} holds codes of stones and roles, such as {shown(names[0])}"
        raise SurveyError(what, where=path, remedy=f"give {expected[advice.start() :]}")


def note_key(name: str) -> str:
    """Return the key of a note, one word, from the name of a column."""
    return re.sub(r"[^\w-]+", "_", name.strip()).strip("_").lower() or "note"
