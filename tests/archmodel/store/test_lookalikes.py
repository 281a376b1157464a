"""Names that look like others are refused, with the character that differs."""

from dataclasses import replace

import pytest

from archmodel.assertions.correct import correct
from archmodel.assertions.declare import declare_material, declare_phase
from archmodel.database.session import open_database
from archmodel.store.lookalikes import plain_form
from archmodel.store.stones import store_survey
from archmodel.tables.entries import new_entry
from ground.errors import DatabaseError, UsageError
from tests.archmodel.stones import SHA, box_stone

CYRILLIC = "\N{CYRILLIC CAPITAL LETTER A}1"
GREEK = "\N{GREEK CAPITAL LETTER ALPHA}1"
WIDE = "\N{FULLWIDTH LATIN CAPITAL LETTER A}1"


def stored(database, number, *codes, again=False):
    with database.session() as session:
        sha = f"{number:02x}{SHA[2:]}"
        store_survey(session, "wall", "wall.moma", sha, [box_stone(code) for code in codes], again=again)


def test_a_code_that_looks_like_another_is_refused_whichever_comes_first(new_url):
    for first, second in (("A1", CYRILLIC), (WIDE, "A1"), (CYRILLIC, GREEK)):
        with open_database(new_url()) as database:
            stored(database, 1, "B1", first)
            with pytest.raises(
                DatabaseError, match=r"wall\.moma:7: the code .1 looks like .1, but has [A-Z]+"
            ):
                stored(database, 2, "B2", second)
            with pytest.raises(DatabaseError, match="looks like"):
                stored(database, 3, "C-1", "C\N{EN DASH}1")
            # what is measured again, or only resembles another, is itself
            stored(database, 4, first, again=True)
            stored(database, 5, "S\N{LATIN SMALL LETTER A WITH DIAERESIS}ule", "Saule", "O1", "01")


def test_a_zone_that_looks_like_another_is_refused(tmp_path):
    with open_database(f"sqlite:///{tmp_path / 'moma.db'}") as database, database.session() as session:
        stones = [
            replace(box_stone(code), zone=zone) for code, zone in (("A", "East"), ("B", None), ("C", "East"))
        ]
        store_survey(session, "wall", "wall.moma", SHA, stones)
        other = replace(box_stone("D"), zone="E\N{CYRILLIC SMALL LETTER A}st")
        with pytest.raises(
            DatabaseError, match=r"the zone .* looks like East, but has CYRILLIC SMALL LETTER A"
        ):
            store_survey(session, "wall", "wall.moma", f"00{SHA[2:]}", [other])


def test_a_code_may_be_corrected_to_what_it_looks_like(tmp_path):
    with open_database(f"sqlite:///{tmp_path / 'moma.db'}") as database:
        stored(database, 1, CYRILLIC, "B1")
        with database.session() as session:
            entry = new_entry(session, "declaration", "a test", author="T")
            with pytest.raises(UsageError, match="the code A1 looks like"):
                correct(session, entry, "B1", {"code": "A1"})
            correct(session, entry, CYRILLIC, {"code": "A1"})


def test_names_of_materials_and_phases_are_told_apart(tmp_path):
    with open_database(f"sqlite:///{tmp_path / 'moma.db'}") as database, database.session() as session:
        entry = new_entry(session, "declaration", "a test", author="T")
        declare_material(session, entry, "tuff")
        declare_phase(session, entry, "tuff")
        with pytest.raises(
            UsageError, match=r"the name .*looks like tuff, but has GREEK SMALL LETTER UPSILON"
        ):
            declare_material(session, entry, "t\N{GREEK SMALL LETTER UPSILON}ff")
        declare_material(session, entry, "tuff", "grey")


def test_plain_forms():
    assert plain_form("W02\N{EN DASH}03") == "W02-03"
    assert plain_form("e\N{COMBINING ACUTE ACCENT}") == plain_form("\N{LATIN SMALL LETTER E WITH ACUTE}")
