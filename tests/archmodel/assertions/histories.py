"""Random histories of opinions: acts of several authors, migrations, documents; and a plain model of what holds."""

import copy
import random
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import pytest
from sqlalchemy import insert, select, update
from sqlalchemy.orm import Session

from archmodel.assertions.declare import declare_phase
from archmodel.assertions.opinions import decide, set_rule
from archmodel.assertions.statements import Remark, say_of_phase
from archmodel.assertions.withdraw import withdraw_statements
from archmodel.database.as_known import as_known
from archmodel.database.session import open_database
from archmodel.describe.entity import describe
from archmodel.exchange.reader import import_building
from archmodel.exchange.writer import write_building
from archmodel.migrations.layouts import version1
from archmodel.migrations.migrate import migrate
from archmodel.query.api import find, find_rows
from archmodel.store.find_by_code import subjects
from archmodel.store.stones import store_survey
from archmodel.tables.entries import new_entry
from archmodel.tables.knowledge import OfPhase
from ground.errors import UsageError
from tests.archmodel.migrations import next_version
from tests.archmodel.stones import SHA, box_stone

CODES = ("A", "B", "C")
AUTHORS = ("Ada", "Ben", "Cleo", None)
PHASES = {"I": 1100, "II": 1200, "III": 1300}
FIRST = date(2020, 1, 1)


@dataclass
class Opinion:
    """What one author states of one stone."""

    author: str | None
    phase: str
    day: date
    certainty: float | None
    number: int


@dataclass
class Model:
    """Opinions by stone and author, each with those that it replaced; decisions by stone; the rule."""

    opinions: dict[str, dict[str | None, list[Opinion]]] = field(
        default_factory=lambda: {code: {} for code in CODES}
    )
    decided: dict[str, Opinion] = field(default_factory=dict)
    rule: tuple[str, tuple[str, ...]] = ("latest", ())

    def holding(self, code: str) -> tuple[str | None, bool]:
        """Return the phase that holds, and whether opinions on it differ."""
        held = [chain[-1] for chain in self.opinions[code].values()]
        if not held:
            return None, False
        rule, authors = self.rule
        ranks = [0.0] * len(held)
        if rule == "certainty":
            ranks = [-1.0 if one.certainty is None else one.certainty for one in held]
        elif rule == "author":
            ranks = [-float(authors.index(one.author)) if one.author in authors else -99.0 for one in held]
        best = max(
            zip(held, ranks, strict=True),
            key=lambda pair: (pair[0] is self.decided.get(code), pair[1], pair[0].day, pair[0].number),
        )[0]
        return best.phase, len({one.phase for one in held}) > 1


def play(session: Session, model: Model, chance: random.Random, number: int) -> int:
    """Do one random act in the database and in the model; return its entry."""
    author, code = chance.choice(AUTHORS), chance.choice(CODES)
    entry = new_entry(session, "declaration", str(number), author=author)
    about = subjects(session, [code])
    chains = model.opinions[code]
    match chance.choice(("say", "say", "say", "withdraw", "decide", "rule")):
        case "say":
            phase, day = chance.choice(list(PHASES)), FIRST + timedelta(chance.randrange(50))
            certainty = chance.choice((None, 0.2, 0.9))
            before = chains.get(author)
            say_of_phase(session, entry, about, phase, Remark(stated_on=day, certainty=certainty))
            if before and (before[-1].phase, before[-1].certainty) == (phase, certainty):
                return entry.id  # said already
            chains.setdefault(author, []).append(Opinion(author, phase, day, certainty, number))
        case "withdraw":
            who = author if author in chains else next(iter(chains), None) if len(chains) == 1 else None
            if author not in chains and len(chains) != 1:
                with suppress(UsageError):  # of several other authors, or there is nothing
                    assert not withdraw_statements(session, entry, OfPhase, about).withdrawn
                return entry.id
            withdraw_statements(session, entry, OfPhase, about)
            gone = chains[who].pop()
            if chains[who]:  # held again, as a row that came now
                chains[who][-1] = copy.copy(chains[who][-1])
                chains[who][-1].number = number
            else:
                del chains[who]
            if model.decided.get(code) is gone:
                del model.decided[code]
        case "decide" if chains:
            chosen = chance.choice(list(chains))
            match = {"phase": chains[chosen][-1].phase, "author": chosen}
            decide(session, entry, "of_phase", about, match)
            model.decided[code] = chains[chosen][-1]
        case "rule":
            rule = chance.choice(("latest", "certainty", "author"))
            authors = tuple(chance.sample(AUTHORS[:3], 2)) if rule == "author" else ()
            set_rule(session, entry, "of_phase", rule, authors)
            model.rule = rule, authors
    return entry.id


def answers(session: Session) -> dict[str, tuple[object, bool]]:
    """Return what holds and whether it is disputed, as queries say; descriptions must agree."""
    disputed = {one.code for one in find(session, "entity", ["disputed(phase)"])}
    rows = {row["code"]: row["phase"] for row in find_rows(session, "entity", columns=["code", "phase"])}
    for code in CODES:
        known = describe(session, code)["knowledge"]["phase"]  # type: ignore[index]
        assert (None if known is None else known["name"]) == rows[code]
        assert bool(known and known.get("disputed")) == (code in disputed)
    return {code: (rows[code], code in disputed) for code in CODES}


class History:
    """A database that grows by random acts, and its model.

    Parameters
    ----------
    folder : of its files
    seed : of the acts
    """

    def __init__(self, folder: Path, seed: int) -> None:
        self._folder, self._chance = folder, random.Random(seed)
        self.model, self.states = Model(), dict[int, dict[str, tuple[str | None, bool]]]()
        self._files = 0
        self.url = self._new_url()
        with open_database(self.url) as database, database.session() as session:
            stones = [box_stone(code, at=(x, 0.0, 0.0)) for x, code in enumerate(CODES)]
            store_survey(session, "w", "w.moma", SHA, stones)
            entry = new_entry(session, "declaration", "phases")
            for name, year in PHASES.items():
                declare_phase(session, entry, name, year)

    def _new_url(self) -> str:
        self._files += 1
        return f"sqlite:///{self._folder / f'{self._files}.db'}"

    def act(self, number: int) -> None:
        """Do a random act."""
        with open_database(self.url) as database, database.session() as session:
            entry = play(session, self.model, self._chance, number)
        self._note(entry)

    def _note(self, entry: int) -> None:
        self.states[entry] = {code: self.model.holding(code) for code in CODES}

    def begin_in_version_1(self, acts: int) -> None:
        """Go back to the first layout, let its program record, and migrate: each author's latest then holds again."""
        assert migrate(self.url, 1).lost == ()
        for number in range(acts):
            self._act_of_version_1(number - acts)
        assert migrate(self.url).after == 2

    def _act_of_version_1(self, number: int) -> None:
        """State or withdraw as the first layout did: whoever stated it, the one before is superseded."""
        tables = version1.metadata.tables
        statement, entity, phase = tables["statement"], tables["entity"], tables["phase"]
        author, code = self._chance.choice(AUTHORS), self._chance.choice(CODES)
        chains = self.model.opinions[code]
        day = FIRST + timedelta(self._chance.randrange(50))
        with next_version.connected(self.url) as connection:
            recorded = datetime.combine(day, datetime.min.time(), UTC)
            row = {"action": "declaration", "author": author, "source": "old", "recorded_at": recorded}
            made = connection.execute(insert(tables["entry"]).values(**row, settings={}, version="1"))
            entry = int(made.inserted_primary_key[0])
            stone = connection.scalar(select(entity.c.id).where(entity.c.code == code))
            held = (statement.c.entity_id == stone) & statement.c.superseded_id.is_(None)
            before = connection.execute(select(statement.c.id, tables["entry"].c.author).where(held).where(
                tables["entry"].c.id == statement.c.entry_id)).one_or_none()  # fmt: skip
            connection.execute(update(statement).where(held).values(superseded_id=entry))
            if before is not None and self._chance.random() < 0.3:
                chains.pop(before.author)
            else:
                name = self._chance.choice(list(PHASES))
                said = select(phase.c.id).where(phase.c.name == name).scalar_subquery()
                connection.execute(insert(statement).values(
                    kind="of_phase", entity_id=stone, phase_id=said, entry_id=entry,
                    supersedes_id=None if before is None else before.id,
                ))  # fmt: skip
                chains.setdefault(author, []).append(Opinion(author, name, day, None, number))
        self._note(entry)

    def migrate_there_and_back(self) -> None:
        """Carry the database to a made-up version 3, and back."""
        with pytest.MonkeyPatch.context() as patch:
            next_version.declare(patch)
            assert migrate(self.url).after == 3
            assert migrate(self.url, 2).lost == ()

    def all_answers(self) -> dict[int, dict[str, tuple[object, bool]]]:
        """Return what holds at every entry, as the database says."""
        with open_database(self.url) as database, database.session(read_only=True) as session:
            found = {}
            for entry in self.states:
                with as_known(session, entry) as then:
                    found[entry] = answers(then)
            return found

    def move(self) -> None:
        """Go on in a database that a document was read into."""
        path = self._folder / f"{self._files}.json"
        with (
            open_database(self.url) as database,
            database.session(read_only=True) as session,
            path.open("wb") as file,
        ):
            write_building(session, file)
        self.url = self._new_url()
        with open_database(self.url) as again:
            import_building(path, again)

    def check(self) -> None:
        """Compare what holds with the model, now and at every entry."""
        with open_database(self.url) as database, database.session(read_only=True) as session:
            assert answers(session) == list(self.states.values())[-1]
            for entry, state in self.states.items():
                with as_known(session, entry) as then:
                    assert answers(then) == state, entry
