"""moma migrate."""

import json
from collections.abc import Callable

import pytest
from sqlalchemy import insert

from tests.archmodel.migrations import next_version
from tests.archmodel.migrations.next_version import connected, rows_of
from tests.archmodel.stones import box_stone, store
from tests.moma.commands import invoke


@pytest.fixture
def old(new_url: Callable[[], str], monkeypatch: pytest.MonkeyPatch) -> str:
    """The URL of a database of version 2, for a program of the made-up version 3."""
    url = new_url()
    store(url, [box_stone("W01-01")])
    next_version.declare(monkeypatch)
    return url


def test_an_old_database_is_refused_with_the_command_that_helps(old: str) -> None:
    refused = invoke("query", "header", "--db", old)
    assert refused.exit_code == 1
    command = refused.stderr.partition("; moma ")[2].split()
    done = invoke(*command)
    assert done.exit_code == 0, done.stderr
    assert "from version 2 to 3" in done.stdout
    assert "W01-01" in invoke("query", "header", "--db", old).stdout
    assert "has version 3 already" in invoke(*command).stdout


def test_going_down_asks_for_consent_where_something_is_lost(old: str) -> None:
    assert invoke("migrate", "--db", old).exit_code == 0
    with connected(old) as connection:
        connection.execute(insert(next_version.metadata.tables["photograph"]).values(entity_id=1, path="1"))
    before = rows_of(old, 3)
    refused = invoke("migrate", "--db", old, "--to", "2")
    assert refused.exit_code == 2
    assert "cannot hold: photographs (1); " in refused.stderr
    assert "give --yes" in refused.stderr
    assert rows_of(old, 3) == before
    done = invoke("migrate", "--db", old, "--to", "2", "--yes", "--json")
    assert done.exit_code == 0
    told = json.loads(done.stdout)
    assert (told["before"], told["after"], told["lost"]) == (3, 2, ["photographs (1)"])
    assert (told["backup"] is None) == old.startswith("postgresql")


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--yes"], 2, "--yes without --to"),
        (["--to", "9"], 2, "version 9 of the layout is not known; name one up to 2"),
        (["--to", "0"], 2, "version 0 of the layout is not known"),
        (["--db", "sqlite:///none.db"], 1, "there is no database"),
    ],
)
def test_wrong_use_is_one_line(
    arguments: list[str], code: int, said: str, monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    monkeypatch.chdir(str(tmp_path))
    refused = invoke("migrate", *arguments)
    assert refused.exit_code == code
    assert said in refused.stderr
    assert refused.stderr.count("\n") == 1
