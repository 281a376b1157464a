"""docs/query.md is true: its kinds, attributes, functions, wall, questions and errors are those of the program."""

import re
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from archmodel.database.session import Database, open_database
from archmodel.query import grammar
from archmodel.query.api import MAX_EXPRESSIONS, attributes, find, find_rows
from archmodel.query.functions.usages import STRUCTURE_USAGES, USAGES
from archmodel.query.grammar import MAX_CALLS, MAX_DEPTH
from archmodel.query.scope import MAX_FUNCTIONS, MAX_RUNS
from archmodel.query.tokens import MAX_LENGTH
from archmodel.tables.entities import canon_of, kinds
from archmodel.tables.hierarchy import definition_of, kind_of
from ground.errors import QueryError
from tests.archmodel.conftest import WALL
from tests.archmodel.known_wall import MEMBERS, RELATIONS, STRUCTURES, furnish
from tests.archmodel.stones import store
from tests.paths import ROOT

PAGE = (ROOT / "docs" / "query.md").read_text(encoding="utf-8")
QUESTIONS = re.findall(r"```sh\n(moma query .*)\n# (.*)\n```", PAGE)
ERRORS = re.findall(r"```error\n(.*)\n(.*)\n```", PAGE)
OPTIONS = {"--where", "--run"}


def asked(command: str) -> tuple[str, list[str], int | None]:
    """Kind, expressions and run of a command line."""
    words = shlex.split(command)
    assert words[:2] == ["moma", "query"]
    options = list(zip(words[3::2], words[4::2], strict=True))
    assert {name for name, _ in options} <= OPTIONS
    run = [int(value) for name, value in options if name == "--run"]
    return words[2], [value for name, value in options if name == "--where"], run[0] if run else None


def table(heading: str) -> list[list[str]]:
    """Rows of the table whose first column has this heading."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in re.split(r"\n(?=\| " + heading + r" \|)", PAGE)[1].split("\n\n")[0].splitlines()
    ]
    return [rows[0], *rows[2:]]


@contextmanager
def furnished_wall(url: str) -> Iterator[Database]:
    """The wall of the page in a new database."""
    with open_database(url) as database:
        store(database, WALL, "window")
        furnish(database)
        yield database


@pytest.fixture
def furnished(new_url: Callable[[], str]) -> Iterator[Database]:
    with furnished_wall(new_url()) as database:
        yield database


@pytest.fixture(scope="module")
def example() -> Iterator[Database]:
    with furnished_wall("sqlite://") as database:
        yield database


def test_there_are_enough_questions() -> None:
    assert len(QUESTIONS) == PAGE.count("```sh") >= 35
    assert len(ERRORS) == PAGE.count("```error") >= 3


@pytest.mark.parametrize(("command", "answer"), QUESTIONS)
def test_a_worked_question_has_the_answer_on_the_page(example: Database, command: str, answer: str) -> None:
    with example.session(read_only=True) as session:
        assert " ".join(stone.code for stone in find(session, *asked(command))) == answer


def test_the_answers_are_the_same_on_every_database(furnished: Database) -> None:
    with furnished.session(read_only=True) as session:
        found = [" ".join(stone.code for stone in find(session, *asked(command))) for command, _ in QUESTIONS]
    assert found == [answer for _, answer in QUESTIONS]


@pytest.mark.parametrize(("command", "message"), ERRORS)
def test_an_error_is_the_one_on_the_page(example: Database, command: str, message: str) -> None:
    with example.session(read_only=True) as session, pytest.raises(QueryError) as caught:
        find(session, *asked(command))
    assert str(caught.value) == message


def test_the_wall_is_the_one_on_the_page(example: Database) -> None:
    heading, *rows = table("code")
    with example.session(read_only=True) as session:
        stored = find_rows(session, "entity")
    for cells, row in zip(rows, stored, strict=True):
        for name, cell in zip(heading, cells, strict=True):
            value = row[name]
            if isinstance(value, float):
                assert value == pytest.approx(float(cell)), (row["code"], name)
            else:
                assert cell == ("null" if value is None else str(value)), (row["code"], name)


def test_the_relations_and_structures_are_those_on_the_page() -> None:
    assert table("relation")[1:] == [[kind, subject, other] for kind, subject, other, _ in RELATIONS]
    members = {code: " ".join(stone for stone, of in MEMBERS if of == code) for code, *_ in STRUCTURES}
    assert table("structure")[1:] == [
        [code, kind, parent or "", members[code]] for code, kind, parent, *_ in STRUCTURES
    ]


def test_the_attributes_are_those_of_the_program() -> None:
    lines = [[f"`{a.name}`", a.type_name, a.definition] for a in attributes() if not a.of_run]
    assert table("attribute")[1:] == lines


def test_the_own_attributes_of_kinds_are_those_of_the_program() -> None:
    assert table("kind")[1:] == [
        [kind_of(cls), f"`{own.name}`", own.unit or "text", own.definition]
        for cls in kinds().values()
        for own in cls.__dict__.get("__own__", ())
    ]
    declared = {name: cls for name, cls in kinds().items() if "__canon__" in cls.__dict__}
    assert table("of kind")[1:] == [
        [name, f"`{canon_of(cls)}`"] for name, cls in declared.items() if canon_of(cls) is not None
    ]


@pytest.mark.parametrize(
    ("heading", "usages"), [("function", USAGES), ("function of structures", STRUCTURE_USAGES)]
)
def test_the_functions_are_those_of_the_program(
    heading: str, usages: dict[str, tuple[tuple[str, str], ...]]
) -> None:
    assert table(heading)[1:] == [
        [f"`{usage}`", meaning] for one in usages.values() for usage, meaning in one
    ]


def test_the_kinds_are_those_of_the_program() -> None:
    (block,) = re.findall(r"```kinds\n(.*?)\n```", PAGE, re.DOTALL)
    assert [line.split(maxsplit=1) for line in block.splitlines()] == [
        [name, definition_of(cls)] for name, cls in kinds().items()
    ]


def test_the_grammar_is_the_one_of_the_module() -> None:
    module = re.sub(r"\s+", " ", grammar.__doc__ or "")
    (page,) = re.findall(r"\n( {4}expression .*?)\n\n", PAGE, re.DOTALL)
    assert re.sub(r"\s+", " ", page).strip() in module


def test_the_limits_are_those_of_the_program() -> None:
    (sentence,) = re.findall(r"- (At most .*?)\.\n", PAGE, re.DOTALL)
    limits = [MAX_LENGTH, MAX_DEPTH, MAX_CALLS, MAX_FUNCTIONS, MAX_RUNS, MAX_EXPRESSIONS]
    assert [int(number) for number in re.findall(r"\d+", sentence)] == limits


def test_the_python_of_the_page_runs(
    example: Database, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (program,) = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    with furnished_wall("sqlite:///moma.db"):
        pass
    names: dict[str, object] = {}
    exec(program, names)
    assert names["rows"] == [{"code": "W01-01", "von_mises_p99@2": None}]
    assert [stone.code for stone in names["stones"]] == []  # type: ignore[attr-defined]
