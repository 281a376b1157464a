"""Observations that cannot be, files that documents name, and proportions as ratios."""

import hashlib
from datetime import date, timedelta
from pathlib import Path

import pytest
from sqlalchemy import select

from archmodel.database.session import open_database
from archmodel.query.api import find
from archmodel.tables.entries import Entry
from archmodel.tables.knowledge import Phase
from ground.errors import QueryError, UsageError
from moma.cli.text.knowledge import record_lines
from pipelines.record.record import record
from tests.archmodel.stones import box_stone, store

STONES = (
    box_stone("A/1", "header", size=(0.4, 0.8, 0.5), at=(0.0, 0.0, 0.0)),
    box_stone("A/2", "header", size=(0.4, 0.4, 0.5), at=(1.0, 0.0, 0.0)),
)
HEAD = '[record]\nauthor = "A"\nsource = "by eye"\n'
OBSERVATION = '[[observation]]\ntype = "crack"\nstones = ["A/1"]\n'


@pytest.fixture
def url(tmp_path: Path) -> str:
    made = f"sqlite:///{tmp_path / 'x.db'}"
    store(made, STONES)
    return made


def recorded(folder: Path, url: str, text: str):
    path = folder / "k.toml"
    path.write_text(HEAD + text, encoding="utf-8")
    return record([path], url)


def test_an_observation_of_a_day_to_come_is_refused(tmp_path: Path, url: str) -> None:
    later = date.today() + timedelta(days=3)
    with pytest.raises(UsageError, match=f"the date {later} is in the future"):
        recorded(tmp_path, url, f"{OBSERVATION}date = {later}\n")
    with pytest.raises(UsageError, match="is in the future"):
        recorded(tmp_path, url, f'[[mark]]\nsign = "x"\nstones = ["A/1"]\ndate = {later}\n')
    recorded(tmp_path, url, f"{OBSERVATION}date = {date.today()}\n")


def test_an_observation_away_from_its_stone_is_refused(tmp_path: Path, url: str) -> None:
    for at in ("[500.0, 0.0, 0.0]", "[0.0, 0.0, -300.0]"):
        with pytest.raises(UsageError, match="m from the stone A/1, more than 50 m") as refused:
            recorded(tmp_path, url, f"{OBSERVATION}at = {at}\n")
        assert "frame of the site" in str(refused.value.remedy)
    recorded(tmp_path, url, f"{OBSERVATION}at = [3.0, 0.0, 0.0]\n")


def test_a_photograph_is_looked_for_beside_the_file_and_hashed(tmp_path: Path, url: str) -> None:
    (tmp_path / "p.jpg").write_bytes(b"picture")
    text = "".join(
        f'[[document]]\ncode = "{code}"\ntype = "photograph"\ntitle = "x"\nplace = "{place}"\n'
        for code, place in (
            ("P1", "p.jpg"),
            ("P2", "does/not/exist.jpg"),
            ("P3", "https://example.org/p.jpg"),
            ("P4", "Archive 12.3"),
        )
    )
    report = recorded(tmp_path, url, text)
    found = {one.document: one.sha256 for one in report.files[0].attachments}
    assert found == {"P1": hashlib.sha256(b"picture").hexdigest(), "P2": None}
    told = [line for line in record_lines(report, verbose=False) if "document" in line]
    assert told == ["  document P2: does/not/exist.jpg is not there, and is taken to be elsewhere"]
    with open_database(url) as database, database.session(read_only=True) as session:
        settings = session.get_one(Entry, report.files[0].entries[0]).settings
        assert settings is not None
        assert settings["attachments"]["P1"]["sha256"] == found["P1"]
        assert settings["attachments"]["P2"]["sha256"] is None


def test_proportions_are_ratios(tmp_path: Path, url: str) -> None:
    kind = (
        '[[kind]]\nname = "binder2"\nparent = "header"\ndefinition = "x."\n'
        'canon = "depth/length > 1.5 and depth / length < 2.5"\n'
        '[[correction]]\nstones = ["kind = header"]\nset = { kind = "binder2" }\n'
    )
    recorded(tmp_path, url, kind)
    with open_database(url) as database, database.session(read_only=True) as session:

        def codes(where: str) -> list[str]:
            return [one.code for one in find(session, "entity", [where])]

        assert codes("canonical()") == ["A/1"]
        assert codes("not canonical()") == ["A/2"]
        assert codes("2*depth/length > 3.9") == ["A/1"]
        assert codes("depth > length/2 + 0.3") == ["A/1"]
        assert codes("abs(depth / length - 2) < 0.1") == ["A/1"]
        assert codes("code = A/1") == ["A/1"]  # a text with a stroke
        assert codes("depth / borne < 1 or not depth / borne < 1") == []  # by zero
        for wrong in (
            "depth/0 > 1",
            "depth*length*height > 1",
            "depth/zone > 1",
            "depth / length / height > 1",
        ):
            with pytest.raises(QueryError):
                codes(wrong)


def test_phases_have_dates_as_people_write_them(tmp_path: Path, url: str) -> None:
    phases = (
        ("I", '"before 1350"', '"../1400"', (None, 1400)),
        ("II", '"circa 1400"', '"1420/1450?"', (1400, 1450)),
        ("III", '"14XX"', '"15XX"', (1400, 1599)),
        ("IV", "1600", '"between 1610 and 1620"', (1600, 1620)),
    )
    text = "".join(f'[[phase]]\nname = "{n}"\nbegins = {b}\nends = {e}\n' for n, b, e, _ in phases)
    recorded(tmp_path, url, text)
    with open_database(url) as database, database.session(read_only=True) as session:
        for name, _, _, bounds in phases:
            phase = session.scalar(select(Phase).where(Phase.name == name))
            assert phase is not None
            assert (phase.begins, phase.ends) == bounds
            if name == "II":
                assert phase.description == "begins circa 1400, ends 1420/1450?"
    for begins, ends in (
        ('"sometime"', "1400"),
        ('"1420/1380"', "1500"),
        ('"14X0"', "1500"),
        ('"15XX"', "1400"),
    ):
        with pytest.raises(UsageError):
            recorded(tmp_path, url, f'[[phase]]\nname = "V"\nbegins = {begins}\nends = {ends}\n')
