"""docs/query.md is true: its kinds, attributes, wall, questions and error are those of the program."""

import re
import shlex
from pathlib import Path

import pytest

from archmodel.database import Database
from archmodel.entities import definition_of, kinds
from archmodel.query import attributes, find, find_rows
from archmodel.store_runs import store_run
from moma.errors import QueryError
from tests.archmodel.stones import run_record

PAGE = (Path(__file__).parents[2] / "docs" / "query.md").read_text(encoding="utf-8")
QUESTIONS = re.findall(r"```sh\n(moma query .*)\n# (.*)\n```", PAGE)


def asked(command: str) -> tuple[str, list[str]]:
    """Kind and expressions of a command line."""
    words = shlex.split(command)
    assert words[:2] == ["moma", "query"]
    assert set(words[3::2]) <= {"--where"}
    return words[2], words[4::2]


def table(heading: str) -> list[list[str]]:
    """Rows of the table whose first column has this heading."""
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in re.split(r"\n(?=\| " + heading + r" \|)", PAGE)[1].split("\n\n")[0].splitlines()
    ]
    return [rows[0], *rows[2:]]


@pytest.fixture
def simulated(filled: Database) -> Database:
    with filled.session() as session:
        store_run(session, run_record({"V1": 9e5, "V2": 8e5, "V3": 7e5}))
        store_run(
            session,
            run_record(
                {"V1": 3e5, "V2": 1.5e5, "V3": None},
                values={"V1": {"utilisation": 0.2}, "V2": {"utilisation": 0.8, "tension_zone": 0.05}},
            ),
        )
    return filled


def test_there_are_enough_questions() -> None:
    assert len(QUESTIONS) == PAGE.count("```sh") >= 14


@pytest.mark.parametrize(("command", "answer"), QUESTIONS)
def test_a_worked_question_has_the_answer_on_the_page(simulated: Database, command: str, answer: str) -> None:
    with simulated.session(read_only=True) as session:
        assert " ".join(stone.code for stone in find(session, *asked(command))) == answer


def test_the_wall_is_the_one_on_the_page(simulated: Database) -> None:
    heading, *rows = table("code")
    with simulated.session(read_only=True) as session:
        stored = find_rows(session, "entity")
    for cells, row in zip(rows, stored, strict=True):
        for name, cell in zip(heading, cells, strict=True):
            value = row[name]
            if isinstance(value, float):
                assert value == pytest.approx(float(cell)), (row["code"], name)
            else:
                assert cell == ("null" if value is None else str(value)), (row["code"], name)


def test_the_attributes_are_those_of_the_program() -> None:
    known = [[f"`{a.name}`", a.unit or "text", a.definition] for a in attributes()]
    assert table("attribute")[1:] == known


def test_the_kinds_are_those_of_the_program() -> None:
    (block,) = re.findall(r"```kinds\n(.*?)\n```", PAGE, re.DOTALL)
    assert [line.split(maxsplit=1) for line in block.splitlines()] == [
        [name, definition_of(cls)] for name, cls in kinds().items()
    ]


def test_the_error_is_the_one_on_the_page(filled: Database) -> None:
    ((command, message),) = re.findall(r"```error\n(.*)\n(.*)\n```", PAGE)
    with filled.session(read_only=True) as session, pytest.raises(QueryError) as caught:
        find(session, *asked(command))
    assert str(caught.value) == message


def test_the_grammar_is_the_one_of_the_module() -> None:
    from archmodel import grammar

    module = re.sub(r"\s+", " ", grammar.__doc__ or "")
    (page,) = re.findall(r"\n( {4}expression .*?)\n\n", PAGE, re.DOTALL)
    assert re.sub(r"\s+", " ", page).strip() in module
