"""Results appear whole or not at all, and replace nothing but earlier results."""

import json

import pytest

from moma.errors import UsageError
from pipelines.results.folder import check_replaceable, replacing


def write(folder, name, text="x"):
    (folder / name).write_text(text, encoding="utf-8")


def results(folder, *names):
    """A folder as a run leaves it."""
    folder.mkdir()
    for name in names:
        write(folder, name)
    write(folder, "summary.json", json.dumps({"files": [*names, "summary.json"]}))
    return folder


def test_results_replace_earlier_ones_whole(tmp_path):
    folder = results(tmp_path / "out", "old.png")
    with replacing(folder) as fresh:
        write(fresh, "new.png")
        assert (folder / "old.png").exists()
    assert [one.name for one in folder.iterdir()] == ["new.png"]
    assert [one.name for one in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("failure", [RuntimeError, KeyboardInterrupt])
def test_a_failed_run_leaves_what_was_there(tmp_path, failure):
    folder = results(tmp_path / "out", "old.png")

    def run():
        with replacing(folder) as fresh:
            write(fresh, "new.png")
            raise failure

    with pytest.raises(failure):
        run()
    assert sorted(one.name for one in folder.iterdir()) == ["old.png", "summary.json"]
    assert [one.name for one in tmp_path.iterdir()] == ["out"]


def test_folders_above_are_made_and_an_empty_one_is_taken(tmp_path):
    with replacing(tmp_path / "a/b/c") as fresh:
        write(fresh, "new.png")
    assert (tmp_path / "a/b/c/new.png").exists()
    (tmp_path / "empty").mkdir()
    check_replaceable(tmp_path / "empty")


def test_what_no_run_wrote_is_not_replaced(tmp_path):
    folder = results(tmp_path / "out", "old.png")
    write(folder, "my_state.pvsm")
    with pytest.raises(UsageError, match=r"my_state\.pvsm"):
        check_replaceable(folder)
    with pytest.raises(UsageError), replacing(folder):
        pass
    assert (folder / "my_state.pvsm").exists()
    home = tmp_path / "home"
    home.mkdir()
    write(home, "thesis.tex")
    write(home, "summary.json", "[1]")
    with pytest.raises(UsageError, match=r"summary\.json, thesis\.tex"):
        check_replaceable(home)
    with pytest.raises(UsageError, match="not a folder"):
        check_replaceable(home / "thesis.tex")
