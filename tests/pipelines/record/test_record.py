"""Files of knowledge: all of a file or none of it, once, with errors at their lines."""

from collections.abc import Callable
from pathlib import Path

import pytest
from sqlalchemy import func, select

from archmodel.database.session import open_database
from archmodel.describe.entity import describe
from archmodel.query.api import find
from archmodel.store.revisions import RowCounts
from archmodel.store.stones import store_survey
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import Correction, MasonMark, Material, Observation, Phase, Statement
from archmodel.tables.relations import Relation
from archmodel.tables.structures import Structure
from ground.errors import UsageError
from pipelines.record.file import read_record
from pipelines.record.record import record
from tests.archmodel.stones import SHA, box_stone, store

STONES = (
    box_stone("W01-01", "header", course=1, at=(0.0, 0.0, 0.0)),
    box_stone("W01-02", "stretcher", course=1, at=(1.0, 0.0, 0.0)),
    box_stone("W02-01", "stretcher", course=2, at=(0.0, 0.0, 1.0)),
    box_stone("V1", "voussoir", course=None, at=(0.0, 0.0, 2.0)),
)
WALL = """
[record]
author = "A"
source = "by eye"
date = 2024-05-14

[[material]]
name = "tuff"
properties = { density = 1900, young = { value = 5e9, sigma = 1e9, source = "cores" } }

[[structure]]
kind = "wall"
code = "WALL"
stones = ["course >= 1"]

[[made_of]]
material = "tuff"
structures = ["WALL"]

[[mark]]
sign = "star"
stones = ["W01-01", "kind = stretcher"]

[[observation]]
type = "crack"
severity = 2
stones = ["V1"]
"""


@pytest.fixture
def url(new_url: Callable[[], str]) -> str:
    made = new_url()
    store(made, STONES, "window")
    return made


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    numbers = iter(range(100))

    def file(text: str) -> Path:
        path = tmp_path / f"{next(numbers)}.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return file


Write = Callable[[str], Path]


def counts(url: str) -> dict[str, int]:
    """Count the rows of each table."""
    with open_database(url) as database, database.session(read_only=True) as session:
        tables = (Entry, Material, Structure, Statement, Correction, Relation, Phase)
        return {cls.__name__: session.scalar(select(func.count()).select_from(cls)) or 0 for cls in tables}


def test_a_file_is_recorded_with_who_says_so(url: str, write: Write) -> None:
    (file,) = record([write(WALL)], url).files
    assert file.outcome == RowCounts(new=3 + 4 + 1 + 3 + 1)
    assert file.tables["mark"] == RowCounts(new=3)
    with open_database(url) as database, database.session(read_only=True) as session:
        (entry,) = session.scalars(select(Entry).where(Entry.action == "declaration"))
        assert (entry.author, entry.source, (entry.id,)) == ("A", "by eye", file.entries)
        told = describe(session, "W01-01")["knowledge"]
        assert told["material"]["name"] == "tuff"  # type: ignore[index]
        assert told["material"]["said_of"] == "WALL"  # type: ignore[index]
        (seen,) = session.scalars(select(Observation))
        assert str(seen.observed_on) == "2024-05-14"
        assert [one.code for one in find(session, "entity", ["member_of(WALL)"])] == [
            "W01-01",
            "W01-02",
            "W02-01",
        ]


def test_the_same_file_changes_nothing_and_a_longer_one_only_adds(url: str, write: Write) -> None:
    path = write(WALL)
    (first,) = record([path], url).files
    before = counts(url)
    (again,) = record([path], url).files
    assert (again.recorded_before, again.entries, again.tables) == (first.entries[0], (), {})
    # the same in other words: nothing is new, and no entry is made
    (same,) = record([write(WALL + "# checked\n")], url).files
    assert (same.entries, same.outcome) == ((), RowCounts(unchanged=first.outcome.new))
    assert counts(url) == before
    more = '\n[[phase]]\nname = "2"\n\n[[of_phase]]\nphase = "2"\nstones = ["V1"]\n'
    (longer,) = record([write(WALL + more)], url).files
    assert longer.outcome == RowCounts(new=2, unchanged=first.outcome.new)


def test_all_files_or_none(url: str, write: Write) -> None:
    before = counts(url)
    wrong = write('[[mark]]\nsign = "x"\nstones = ["W09-09"]\n')
    with pytest.raises(UsageError, match=r"\.toml:3: there is no stone 'W09-09'"):
        record([write(WALL), wrong], url)
    assert counts(url) == before


def test_a_dry_run_tells_and_keeps_nothing(url: str, write: Write) -> None:
    before, path = counts(url), write(WALL + CORRECTION)
    tried = record([path], url, dry_run=True)
    assert counts(url) == before
    assert tried.files[0].outcome == record([path], url).files[0].outcome


CORRECTION = """
[[correction]]
stones = ["course = 1"]
set = { zone = "north" }
unset = ["course"]
reason = "the course was cut"
"""


def test_each_author_and_source_has_an_entry_and_the_command_line_goes_first(url: str, write: Write) -> None:
    other = '\n[[mark]]\nsign = "arrow"\nstones = ["V1"]\nauthor = "B"\nsource = "P1"\n'
    record([write(WALL + CORRECTION + other)], url, author="C")
    with open_database(url) as database, database.session(read_only=True) as session:
        entries = session.scalars(select(Entry).where(Entry.action.in_(("declaration", "correction"))))
        told = [(one.action, one.author, one.source) for one in entries]
        corrected = session.scalars(select(Correction).order_by(Correction.id))
        changed = [(one.entity.code, one.attribute, one.before, one.after) for one in corrected]
    assert told == [
        ("correction", "C", "the course was cut"),
        ("declaration", "C", "by eye"),
        ("declaration", "B", "P1"),
    ]
    assert changed[:4] == [
        ("W01-01", "zone", None, "north"),
        ("W01-01", "course", 1, None),
        ("W01-02", "zone", None, "north"),
        ("W01-02", "course", 1, None),
    ]


def test_withdrawals_undo_and_are_done_once(url: str, write: Write) -> None:
    relation = '\n[[relation]]\nkind = "supports"\nof = ["W01-01"]\nto = ["W02-01"]\n'
    record([write(WALL + relation + '\n[[phase]]\nname = "2"\n')], url)
    undo = """
[[withdraw]]
what = "mark"
stones = ["W01-01"]
match = { sign = "star" }

[[withdraw]]
what = "relation"
kind = "rests_on"
stones = ["W02-01"]
to = ["W01-01"]
"""
    rest = """
[[withdraw]]
what = "member"
stones = ["W02-01"]
structures = ["WALL"]

[[withdraw]]
what = "property"
name = "tuff"
property = "young"

[[withdraw]]
what = "made_of"
structures = ["WALL"]

[[withdraw]]
what = "material"
name = "tuff"

[[withdraw]]
what = "phase"
name = "2"

[[withdraw]]
what = "structure"
name = "WALL"
"""
    (done,) = record([write(undo + rest)], url).files
    # with the material goes its other property, with the structure its other members
    assert done.outcome == RowCounts(withdrawn=8 + 1 + 2)
    (again,) = record([write(undo)], url).files
    assert again.outcome == RowCounts(unchanged=2)
    with open_database(url) as database, database.session(read_only=True) as session:
        for cls in (Material, Phase, Structure, Relation):
            assert session.scalars(select(cls).where(cls.superseded_id.is_(None))).all() == [], cls
        held = session.scalars(select(MasonMark).where(MasonMark.superseded_id.is_(None)))
        assert [one.entity.code for one in held if one.entity] == ["W01-02", "W02-01"]


@pytest.mark.parametrize(
    ("text", "line", "message"),
    [
        ("", 1, "nothing is recorded; add a table such as"),
        ("[[matrial]]\n", 1, "unknown table .matrial.; did you mean 'material'"),
        ("[material]\nname = 'x'\n", 1, "'material' is not a list of tables; write ..material.."),
        ("x = \n", 1, "not TOML"),
        ("[[mark]]\nsing = 'x'\n", 2, "unknown key 'sing' in ..mark..; did you mean 'sign'"),
        ("[[mark]]\nstones = ['V1']\n", 1, "..mark.. has no 'sign'"),
        ("[[mark]]\nsign = 'x'\n", 1, "..mark.. has no subject"),
        ("\n[[mark]]\nsign = 'x'\nstones = ['V2']\n", 4, "no stone 'V2' in the database; did you mean V1"),
        (
            "[[mark]]\nsign = 'x'\nstones = ['detph > 1']\n",
            3,
            "unknown attribute 'detph'; did you mean depth",
        ),
        ("[[mark]]\nsign = 'x'\nstones = ['course = 9']\n", 3, "no stone satisfies 'course = 9'"),
        ("[[mark]]\nsign = 'x'\nstructures = ['W']\n", 3, "there is no structure 'W'"),
        ("[[made_of]]\nmaterial = 'x'\nstones = ['V1']\n", 1, "there is no material 'x'"),
        ("[[observation]]\ntype = 'crakc'\nstones = ['V1']\n", 2, "did you mean crack"),
        (
            "[[observation]]\ntype = 'crack'\nseverity = 5\nstones = ['V1']\n",
            3,
            "severity = 5 is out of range",
        ),
        (
            "[[observation]]\ntype = 'crack'\ndate = '2024'\nstones = ['V1']\n",
            3,
            "is not a date without quotes",
        ),
        ("[[phase]]\nname = '2'\nbegins = 1300\nends = 1200\n", 1, "begins in 1300 and ends in 1200"),
        (
            "[[material]]\nname = 'x'\n[material.properties]\nyoung = { valeu = 1 }\n",
            4,
            "did you mean 'value'",
        ),
        ("[[material]]\nname = 'x'\n[material.properties]\nyoung = -1\n", 3, "young is -1.0"),
        ("[[correction]]\nstones = ['V1']\n", 1, "empty correction"),
        ("[[correction]]\nstones = ['V1']\nset = { knid = 'x' }\n", 3, "did you mean kind"),
        ("[[correction]]\nstones = ['V1']\nset = { depth = 1.0 }\n", 3, "record it as a depth"),
        ("[[kind]]\nname = 'x'\nparent = 'y'\ndefinition = 'z'\n", 1, "unknown kind 'y'"),
        (
            "[[kind]]\nname='x'\nparent='sill'\ndefinition='z'\nattributes={ a = 'm' }\n",
            5,
            "has no 'definition'",
        ),
        ("[[withdraw]]\nwhat = 'mark'\nstones = ['V1']\n", 1, "there is no such mason_mark to withdraw"),
        ("[[withdraw]]\nwhat = 'phase'\n", 1, "the phase has no name"),
        ("[[withdraw]]\nwhat = 'phase'\nname = 'x'\n", 1, "there has never been a phase 'x'"),
        (
            "[[withdraw]]\nwhat = 'relation'\nstones = ['V1']\nto = ['W01-01']\n",
            1,
            "the relation has no kind",
        ),
        ("[[relation]]\nkind = 'beside'\nof = ['V1']\nto = ['V1']\n", 1, "in relation to themselves"),
        ("[[structure]]\nkind = 'wal'\ncode = 'W'\n", 2, "kind of structure 'wal'; did you mean wall"),
        (
            "[[kind]]\nname = 'wall_rib'\nparent = 'rib'\ndefinition = 'z'\n"
            "[[structure]]\nkind = 'wallrib'\ncode = 'R'\n",
            6,
            "unknown kind of structure 'wallrib'; did you mean wall_rib",
        ),
        (
            "[[kind]]\nname='x'\nparent='rib'\ndefinition='z'\ncanon = 'depth > 1'\n",
            1,
            "unknown attribute 'depth'; the attributes are code, kind",
        ),
        ("[[phase]]\nname = 'x'\nauthor = \"\\u0000\"\n", 1, "author '.x00' has no visible character"),
        ("[[depth]]\nstones = ['V1']\nvalue = 0\n", 3, "value = 0 is out of range"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(
    filled_once: str, write: Write, text: str, line: int, message: str
) -> None:
    path = write(text)
    with pytest.raises(UsageError, match=message) as caught:
        record([path], filled_once)
    assert caught.value.where == f"{path}:{line}"


@pytest.fixture(scope="module")
def filled_once(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A database that no test changes."""
    url = f"sqlite:///{tmp_path_factory.mktemp('wall') / 'moma.db'}"
    store(url, STONES, "window")
    return url


def test_no_such_file_and_no_text(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such file"):
        record([tmp_path / "none.toml"], "sqlite://")
    (tmp_path / "x.toml").write_bytes(b"\xff")
    with pytest.raises(UsageError, match="byte 0 is not UTF-8"):
        record([tmp_path / "x.toml"], "sqlite://")
    with pytest.raises(UsageError, match="no file; name at least one"):
        record([], "sqlite://")


def test_a_file_with_a_byte_order_mark_is_read(write: Write) -> None:
    (table,) = read_record(write("\ufeff[[phase]]\nname = '1'\n")).tables
    assert (table.name, table.values["name"]) == ("phase", "1")


def test_kinds_can_be_registered_before_there_is_a_survey(new_url: Callable[[], str], write: Write) -> None:
    url = new_url()
    kind = "[[kind]]\nname = 'merlon'\nparent = 'coping'\ndefinition = 'A stone of a merlon.'\n"
    assert record([write(kind)], url).files[0].outcome == RowCounts(new=1)
    with open_database(url) as database, database.session() as session:
        store_survey(session, "w", "w.moma", SHA, [box_stone("M1", "merlon")])
        assert [one.code for one in find(session, "coping")] == ["M1"]
