"""The how-tos can be followed one after another in one folder."""

import pytest
from typer.testing import CliRunner

from moma.cli import app
from pipelines.tradeoff import study as trade_module
from pipelines.tradeoff.grid import grid
from tests.docs.test_docs import commands
from tests.paths import ROOT

PAGES = sorted(path.relative_to(ROOT) for path in (ROOT / "docs/howto").glob("*.md"))


def outputs(page):
    """Return the folders that the commands of a page write, each with the command's name."""
    return {
        command[command.index(option) + 1]: command[1]
        for command in commands(page)
        for option in ("--out", "--pictures")
        if option in command
    }


def test_no_how_to_writes_the_results_of_a_run_and_pictures_into_one_folder():
    """Pictures of one page may replace another's, the results of a run not."""
    kinds = {}
    for page in PAGES:
        for folder, command in outputs(page).items():
            kinds.setdefault(folder, set()).add(command)
    assert len(kinds) >= 6
    assert all("run" not in named or len(named) == 1 for named in kinds.values()), kinds


def test_no_two_how_tos_ingest_one_file_into_one_database():
    ingested = [
        (command[2], command[command.index("--db") + 1] if "--db" in command else "moma.db")
        for page in PAGES
        for command in commands(page)
        if command[1] == "ingest"
    ]
    assert len(ingested) >= 5
    assert len(set(ingested)) == len(ingested)


@pytest.mark.slow
def test_the_how_tos_work_one_after_another_in_one_folder(place, monkeypatch):
    monkeypatch.chdir(place)
    (place / "docs/howto/stones").symlink_to(ROOT / "docs/howto/stones")
    monkeypatch.setattr(trade_module, "grid", lambda *of, **asked: grid(*of, **asked)[:1])
    for page in PAGES:
        for command in commands(page):
            done = CliRunner().invoke(app, command[1:])
            unsound = command[1] == "check" and "\nproblem: " in done.stdout
            assert done.exit_code == int(unsound), (page, command, done.output)
