"""`moma record` and `moma show`: what a person and a program are told."""

from pathlib import Path

import pytest

from archmodel.database.session import open_database
from archmodel.store.stones import store_survey
from tests.archmodel.stones import SHA, box_stone
from tests.moma.commands import answer, fails, invoke, prints

KNOWLEDGE = """
[record]
author = "A"
source = "by eye"

[[kind]]
name = "merlon"
parent = "coping"
definition = "A stone of a merlon."
attributes.slit_width = { unit = "m", definition = "of the slit" }

[[correction]]
stones = ["V1"]
set = { kind = "merlon", slit_width = 0.12 }
reason = "seen from above"

[[material]]
name = "tuff"
properties = { density = { value = 1900, sigma = 50, source = "cores" }, poisson = 0.2 }

[[phase]]
name = "2"
begins = 1240

[[structure]]
kind = "wall"
code = "WALL"
title = "The wall"
stones = ["V1", "V2"]

[[made_of]]
material = "tuff"
structures = ["WALL"]

[[of_phase]]
phase = "2"
stones = ["V1"]

[[observation]]
type = "crack"
severity = 3
place = "left"
at = [1, 2, 3.5]
date = 2024-05-14
stones = ["V1"]
"""


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder with a database of two stones and a file of knowledge."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MOMA_DB", raising=False)
    with open_database("sqlite:///moma.db") as database, database.session() as session:
        stones = [box_stone("V1", "voussoir"), box_stone("V2", "voussoir", at=(5.0, 0.0, 0.0))]
        store_survey(session, "window", "window.moma", SHA, stones)
    Path("wall.toml").write_text(KNOWLEDGE, encoding="utf-8")


def test_record_says_what_was_new_and_what_was_known() -> None:
    tried = invoke("record", "wall.toml", "--dry-run").stdout
    assert tried.startswith("wall.toml: 11 new, 1 replaced, as entries 2, 3 (dry run: nothing was kept)\n")
    assert "\n  material: 3 new\n" in tried
    done = invoke("record", "wall.toml")
    assert done.stdout.splitlines()[0] == "wall.toml: 11 new, 1 replaced, as entries 2, 3"
    again = invoke("record", "wall.toml").stdout
    assert again == "wall.toml: recorded before, as entry 2; nothing changed\n"
    Path("more.toml").write_text(KNOWLEDGE + "\n", encoding="utf-8")
    assert invoke("record", "more.toml").stdout == "more.toml: all of it was known; nothing changed\n"
    (file,) = answer("record", "more.toml")["files"]
    assert file["tables"]["kind"] == {"new": 0, "replaced": 0, "unchanged": 1, "withdrawn": 0}


def test_tables_and_vocabularies_are_recorded_with_and_without_options() -> None:
    Path("t.csv").write_text("Stein;Gestein\nV1;tuff\n", encoding="utf-8")
    Path("u.csv").write_text("Inventar;Zustand\nV1;worn\n", encoding="utf-8")
    skos = "@prefix s: <http://www.w3.org/2004/02/skos/core#> .\n<http://e/1> s:prefLabel 'Sinter'@de ."
    Path("v.ttl").write_text(skos, encoding="utf-8")
    who = ("--author", "A", "--source", "x")
    assert invoke("record", "t.csv", *who).stdout.startswith("t.csv: 2 new, as entry 2\n")
    assert prints("record", "u.csv", *who, "--columns", "code=Inventar,remark=Zustand").startswith(
        "u.csv: 1 new"
    )
    assert prints("record", "v.ttl", *who, "--vocabulary", "material") == "v.ttl: 1 new, as entry 4\n"
    assert "unknown vocabulary 'rock'" in fails(2, "record", "v.ttl", *who, "--vocabulary", "rock")
    prints("export", "terms.ttl")
    assert "Sinter" in Path("terms.ttl").read_text(encoding="utf-8")


def test_record_fails_with_the_line() -> None:
    Path("wrong.toml").write_text(
        KNOWLEDGE.replace('"tuff"\nstructures', '"tuf"\nstructures'), encoding="utf-8"
    )
    message = fails(2, "record", "wrong.toml")
    line = KNOWLEDGE[: KNOWLEDGE.index("[[made_of]]")].count("\n") + 1
    assert message == f"moma: error: wrong.toml:{line}: there is no material 'tuf'; did you mean tuff?"
    assert answer("show", "V1")["kind"] == "voussoir"


def test_show_tells_what_is_known_and_of_what_it_is_said() -> None:
    invoke("record", "wall.toml", "--author", "B")
    text = invoke("show", "V1").stdout
    for line in (
        *("kind               merlon", "  slit width         0.12 m", "  1                  wall WALL"),
        *("    density            1900 ± 50 kg/m³ (cores)", "    poisson            0.2 (by eye)"),
        *("    evidence           inherited from WALL", "    years              1240–?"),
        "    1                  type crack, severity 3, place left, at (1, 2, 3.5), seen 2024-05-14 "
        "[entry 2, B, by eye]",
        "  1                  kind voussoir → merlon [entry 3, B, seen from above]",
    ):
        assert line in text.splitlines()
    wall = invoke("show", "WALL").stdout
    assert "members            V1  V2" in wall
    assert "title              The wall" in wall


def test_show_goes_back_in_time() -> None:
    invoke("record", "wall.toml")
    assert answer("show", "V1", "--at", "1")["kind"] == "voussoir"
    history = invoke("show", "V1", "--history").stdout
    assert history.startswith("history of V1\nentry 1, ")
    assert "\n  corrected kind: voussoir → merlon\n" in history
    assert "\n  said membership: structure WALL\n" in history
    events = answer("show", "V1", "--history")
    assert [one["entry"] for one in events] == sorted(one["entry"] for one in events)
    assert {"recorded", "measured", "corrected", "said"} == {one["event"] for one in events}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("show", "WALLL"), "there is no stone 'WALLL' in the database; did you mean WALL?"),
        (("show", "V1", "--at", "99"), "there is no entry 99"),
        (("show", "V1", "--at", "1", "--history"), "--history and --at exclude each other"),
        (("record", "none.toml"), "none.toml: no such file"),
    ],
)
def test_wrong_use_ends_in_one_line(arguments: tuple[str, ...], message: str) -> None:
    invoke("record", "wall.toml")
    assert message in fails(2, *arguments)


@pytest.mark.parametrize("command", ["record", "show"])
def test_the_commands_explain_themselves(command: str) -> None:
    done = invoke(command, "--help")
    assert done.exit_code == 0
    assert "--db" in done.stdout
