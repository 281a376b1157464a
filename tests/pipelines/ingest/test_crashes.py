"""Ingests that are killed, that meet, that are watched: the database is as before, or as afterwards."""

import random
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from itertools import count
from pathlib import Path

import pytest
from sqlalchemy import func, select

from archmodel.database.session import open_database
from archmodel.tables.entities import Entity
from archmodel.tables.surveys import Measurement, Survey
from pipelines.ingest.ingest import ingest
from tests.archmodel.stones import contents
from tests.pipelines.ingest.killable_ingest import Ingest, wall_survey
from tests.postgresql import Server

STONES = 150
NewUrl = Callable[[], str]


@pytest.fixture(scope="module")
def surveys(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Write the survey in the database and the one to ingest."""
    folder = tmp_path_factory.mktemp("surveys")
    return wall_survey(folder / "old.moma", "A", 20), wall_survey(folder / "new.moma", "B", STONES, at=50.0)


@pytest.fixture(scope="module")
def usual(surveys: tuple[Path, Path], tmp_path_factory: pytest.TempPathFactory) -> tuple[float, float]:
    """Time an undisturbed ingest: until it writes, and from then on [s]."""
    url = f"sqlite:///{tmp_path_factory.mktemp('usual') / 'moma.db'}"
    for _ in range(2):  # the first time, the process that all others start from is started too
        Path(url.removeprefix("sqlite:///")).unlink(missing_ok=True)
        process = Ingest(surveys[1], url)
        process.wait_until(lambda said: said == "started")
        started = time.monotonic()
        process.wait_until(lambda said: said == "writing")
        writing = time.monotonic()
        process.wait_until(lambda said: said == "done")
        done = time.monotonic()
        process.end()
    return writing - started, done - writing


def kill_somewhere(process: Ingest, draw: random.Random, usual: tuple[float, float]) -> None:
    """Let the process live for a random part of its time; three times of four, until it writes at least."""
    before, writing = usual
    if draw.random() < 0.25:
        process.wait_until(lambda said: said == "started")
        time.sleep(draw.uniform(0.0, before + writing))
    else:
        process.wait_until(lambda said: said in ("writing", "done"))
        time.sleep(draw.uniform(0.0, 1.1 * writing))
    process.kill()


def known(url: str) -> tuple[int, int, int]:
    """Count surveys, entities and measurements."""
    with open_database(url) as database, database.session(read_only=True) as session:
        counted = [
            session.scalar(select(func.count(table.id))) or 0 for table in (Survey, Entity, Measurement)
        ]
    return counted[0], counted[1], counted[2]


def judge(url: str, survey: Path, before: str, said: list[str]) -> str:
    """Return the stage of a killed ingest; check the database, which must be whole, and the next ingest."""
    with open_database(url) as database:
        found = contents(database)
    if found == before:
        moment = "writing" if "writing" in said else "measuring"
        ingest([survey], url)
    else:
        moment = "afterwards"
    surveys, entities, measurements = known(url)
    assert entities == measurements == (STONES + 20 if surveys == 2 else STONES)
    return moment


@contextmanager
def copies(url: str, postgresql: Server | None) -> Iterator[NewUrl]:
    """A function that gives copies of a database that nobody uses."""
    numbers = count()
    with ExitStack() as held:

        def copy() -> str:
            if postgresql is not None:
                name = url.split("?")[0].rpartition("/")[2]
                return held.enter_context(postgresql.database(template=name))
            source = Path(url.removeprefix("sqlite:///"))
            target = source.with_name(f"copy{next(numbers)}.db")
            return f"sqlite:///{shutil.copy(source, target)}"

        yield copy


@pytest.mark.parametrize(
    ("seed", "kills"), [(1, 6), pytest.param(2, 50, marks=pytest.mark.slow)], ids=["some", "many"]
)
def test_a_killed_ingest_leaves_the_database_as_it_was_and_the_next_one_works(
    new_url: NewUrl,
    surveys: tuple[Path, Path],
    usual: tuple[float, float],
    seed: int,
    kills: int,
    request: pytest.FixtureRequest,
) -> None:
    old, new = surveys
    url = new_url()
    ingest([old], url)
    with open_database(url) as database:
        before = contents(database)
    draw = random.Random(seed)
    server = request.getfixturevalue("postgresql") if url.startswith("postgresql") else None
    moments = []
    with copies(url, server) as copy:
        for _ in range(kills):
            there = copy()
            process = Ingest(new, there)
            kill_somewhere(process, draw, usual)
            moments.append(judge(there, new, before, process.said))
    print({moment: moments.count(moment) for moment in sorted(set(moments))})
    assert moments.count("writing") >= max(1, kills // 5)  # how many depends on what else the machine does


@pytest.mark.parametrize("kills", [2, pytest.param(25, marks=pytest.mark.slow)])
def test_an_ingest_killed_while_it_makes_the_database_leaves_one_that_can_be_used(
    new_url: NewUrl, surveys: tuple[Path, Path], usual: tuple[float, float], kills: int
) -> None:
    _, new = surveys
    draw = random.Random(3)
    for _ in range(kills):
        url = new_url()
        process = Ingest(new, url)
        process.wait_until(lambda said: said == "started")
        # the tables are made a little before the first stone is written
        time.sleep(max(0.0, usual[0] + draw.uniform(-0.5, 0.5) * usual[1]))
        process.kill()
        if known(url) != (1, STONES, STONES):
            assert known(url) == (0, 0, 0)
            ingest([new], url)
        assert known(url) == (1, STONES, STONES)


def test_two_ingests_of_different_surveys_at_once_are_both_complete(
    new_url: NewUrl, surveys: tuple[Path, Path]
) -> None:
    url = new_url()
    processes = [Ingest(survey, url) for survey in surveys]
    assert [process.end() for process in processes] == ["done", "done"]
    assert known(url) == (2, STONES + 20, STONES + 20)


def test_of_two_ingests_of_one_survey_at_once_one_is_refused(
    new_url: NewUrl, surveys: tuple[Path, Path]
) -> None:
    url, (_, new) = new_url(), surveys
    processes = [Ingest(new, url) for _ in range(2)]
    done, refused = sorted(process.end() for process in processes)
    assert done == "done"
    assert "this file is in the database already" in refused
    assert known(url) == (1, STONES, STONES)


def test_a_reader_sees_the_old_state_until_all_is_there(new_url: NewUrl, surveys: tuple[Path, Path]) -> None:
    url, (old, new) = new_url(), surveys
    ingest([old], url)
    with open_database(url, lock_timeout=0.01) as database, database.session(read_only=True) as patient:
        before = patient.scalar(select(func.count(Entity.id)))
        process = Ingest(new, url)
        process.wait_until(lambda said: said == "writing")
        seen: list[int] = []
        while not seen or seen[-1] == 20:
            with database.session(read_only=True) as session:
                seen.append(session.scalar(select(func.count(Entity.id))) or 0)
                assert session.scalar(select(func.count(Measurement.id))) == seen[-1]
            assert patient.scalar(select(func.count(Entity.id))) == before == 20
        assert process.end() == "done"
        assert patient.scalar(select(func.count(Entity.id))) == 20
    assert set(seen) == {20, STONES + 20}
    assert seen.count(20) >= 2  # it read while the other wrote
