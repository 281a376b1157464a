import re
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from numpy.typing import NDArray
from sqlalchemy import MetaData, inspect, select, text

from archmodel.database.session import open_database
from archmodel.migrations.migrate import migrate
from archmodel.store.run_record import JointArrays, SimplificationRecord
from archmodel.store.runs import store_run
from archmodel.store.stones import load_stones, store_survey
from archmodel.tables import layout
from archmodel.tables.entities import Corbel, Entity, Joint
from archmodel.tables.entries import new_entry
from archmodel.tables.relations import Relation
from archmodel.tables.surveys import Measurement
from moma.errors import DatabaseError, UsageError
from tests.archmodel.migrations.old_databases import (
    LAYOUTS,
    Rows,
    connected,
    dumped,
    make_old,
    rows_of,
    run_alembic,
)
from tests.archmodel.stones import SHA, box_stone, run_record

NewUrl = Callable[[], str]


def differences(url: str, declared: MetaData) -> list[Any]:
    """What Alembic finds to be other in a database than declared."""
    with connected(url) as connection:
        return list(compare_metadata(MigrationContext.configure(connection), declared))


def by_id(rows: list[dict[str, Any]]) -> dict[int, dict[str, Any]]:
    return {row["id"]: row for row in rows}


def array(stored: bytes, *shape: int) -> NDArray[np.float64]:
    return np.frombuffer(stored).reshape(shape)


@pytest.mark.parametrize("version", [1, 2, 3])
def test_the_frozen_layouts_are_those_that_the_old_programs_made(tmp_path: Path, version: int) -> None:
    url = f"sqlite:///{tmp_path / 'old.db'}"
    make_old(url, version)
    assert differences(url, LAYOUTS[version]) == []


def test_from_nothing_the_steps_lead_to_the_layout_of_the_program(new_url: NewUrl) -> None:
    url = new_url()
    with connected(url) as connection:
        run_alembic(connection, "head")
    assert differences(url, layout.metadata) == []
    with open_database(url, create=False) as database, database.session() as session:
        store_survey(session, "window", "window.moma", SHA, [box_stone("A1")])


@pytest.mark.parametrize("version", [1, 2, 3])
def test_indexes_and_keys_are_named_as_in_a_new_database(new_url: NewUrl, version: int) -> None:
    old, new = new_url(), new_url()
    make_old(old, version)
    migrate(old)
    open_database(new).close()

    def names(url: str) -> set[tuple[str, str | None]]:
        with connected(url) as connection:
            inspector = inspect(connection)
            found = {(table, None) for table in inspector.get_table_names()}
            for table, _ in list(found):
                found |= {(table, one["name"]) for one in inspector.get_indexes(table)}
                found |= {(table, one["name"]) for one in inspector.get_unique_constraints(table)}
                found.add((table, inspector.get_pk_constraint(table)["name"]))
            return (
                found | {("", name) for name in inspector.get_sequence_names()} if "postg" in url else found
            )

    assert names(old) - names(new) == {one for one in names(old) if one[0] == "alembic_version"}
    assert names(new) <= names(old)


@pytest.mark.parametrize("version", [1, 2])
def test_every_row_and_value_is_there_afterwards(new_url: NewUrl, version: int) -> None:
    url, before = new_url(), dumped(version)
    make_old(url, version)
    assert rows_of(url, version) == before
    done = migrate(url)
    assert (done.before, done.after, done.lost) == (version, 4, ())
    after = rows_of(url, 4)
    assert after["moma_schema"] == [{"version": 4}]
    moved = {("survey", "stored_at"), ("survey", "observer"), ("entity", "survey_id")}
    moved |= {("run", "stored_at"), ("run", "version")}
    computed = {("measurement", "covariance")} if version == 1 else set()
    for table, rows in before.items():
        if table == "moma_schema":
            continue
        names = (
            ("entity_id", "run_id")
            if table == "entity_result"
            else ("entity_id",)
            if table == "measurement"
            else ("id",)
        )
        found = {tuple(row[name] for name in names): row for row in after[table]}
        assert len(found) == len(rows) == len(after[table]) > 0
        for row in rows:
            migrated = found[tuple(row[name] for name in names)]
            for name, value in row.items():
                if (table, name) not in moved | computed:
                    assert migrated[name] == value, (table, name)


@pytest.mark.parametrize("version", [1, 2])
def test_surveys_and_runs_become_acts_of_recording(new_url: NewUrl, version: int) -> None:
    url, before = new_url(), dumped(version)
    make_old(url, version)
    migrate(url)
    after = rows_of(url, 4)
    entries = by_id(after["entry"])
    assert len(entries) == len(before["survey"]) + len(before["run"])
    times = [entries[number]["recorded_at"] for number in sorted(entries)]
    assert times == sorted(times)
    surveys, runs, entities = (by_id(after[name]) for name in ("survey", "run", "entity"))
    for row in before["survey"]:
        entry = entries[surveys[row["id"]]["entry_id"]]
        assert (entry["action"], entry["source"]) == ("ingest", row["path"])
        assert entry["recorded_at"] == row["stored_at"]
    for row in before["run"]:
        run = runs[row["id"]]
        entry = entries[run["entry_id"]]
        assert (entry["action"], entry["source"], entry["version"]) == ("run", row["scene"], row["version"])
        assert entry["recorded_at"] == row["stored_at"]
        assert run["versions"] == {"moma": row["version"]}
        said = row["summary"]
        assert (run["steps"], run["contacts"]) == (said["steps"], said["contacts"])
        assert (run["simulated"], run["wall"]) == (said["time"]["simulated"], said["time"]["wall"])
        for name in ("natural_map", "penetration", "balance", "reaction", "energy"):
            assert run[name] == said["errors"][name]
    measurements = {row["entity_id"]: row for row in after["measurement"]}
    for row in before["entity"]:
        measured = measurements[row["id"]]
        assert measured["survey_id"] == row["survey_id"]
        assert measured["superseded_id"] is None
        recorded = surveys[row["survey_id"]]["entry_id"]
        assert measured["entry_id"] == entities[row["id"]]["entry_id"] == recorded


def test_planes_of_version_1_are_those_that_version_2_fitted_to_the_same_survey(new_url: NewUrl) -> None:
    url = new_url()
    make_old(url, 1)
    migrate(url, 2)
    codes = {row["id"]: row["code"] for row in dumped(1)["entity"]}
    found = {codes[row["entity_id"]]: row for row in rows_of(url, 2)["measurement"]}
    then = dumped(2)
    codes = {row["id"]: row["code"] for row in then["entity"]}
    truth = {codes[row["entity_id"]]: row for row in then["measurement"]}
    assert found.keys() == truth.keys() - {"P1"}
    assert found["W02-02"]["rejected_vertices"] == truth["W02-02"]["rejected_vertices"] == [2]
    assert found["W02-01"]["rejected"] == truth["W02-01"]["rejected"] != []
    for code, row in found.items():
        same = truth[code]
        assert (row["rejected"], row["rejected_vertices"]) == (same["rejected"], same["rejected_vertices"])
        np.testing.assert_allclose(array(row["centroid"], 3), array(same["centroid"], 3), rtol=0, atol=1e-12)
        np.testing.assert_allclose(array(row["axes"], 2, 3), array(same["axes"], 2, 3), rtol=0, atol=1e-9)
        covariance = array(same["covariance"], 3, 3)
        np.testing.assert_allclose(
            array(row["covariance"], 3, 3), covariance, rtol=1e-9, atol=1e-12 * covariance.max()
        )


def test_what_version_1_did_not_say_is_said_to_be_unknown_or_follows(new_url: NewUrl) -> None:
    url = new_url()
    make_old(url, 1)
    migrate(url, 2)
    after, truth = rows_of(url, 2), dumped(2)
    surveys, then = by_id(after["survey"]), by_id(truth["survey"])
    assert surveys[1]["stations"] == then[1]["stations"] == {"observer": [14.2908, 29.4147, 8.0771]}
    assert surveys[2]["stations"] == {}
    assert [row["frame"] for row in after["survey"]] == [None, None]
    origins = {row["code"]: row["depth_origin"] for row in truth["entity"] if row["code"] != "P1"}
    # the only stone of its kind in its survey, and measured itself: that cannot be seen in version 1
    ambiguous = {"W01-01", "B1"}
    assert origins | dict.fromkeys(ambiguous, "kind") == {
        row["code"]: row["depth_origin"] for row in after["entity"]
    }
    for row in after["measurement"]:
        assert np.isnan(array(row["vertex_sigma"], -1, 3)).all()
        assert len(row["vertex_sigma"]) == len(row["solid_vertices"])
        assert (row["shape"], row["tail"], row["names"], row["image"]) == ("untested", 1.0, [], b"")


@pytest.mark.parametrize("version", [1, 2, 3])
def test_the_program_works_with_what_was_migrated(new_url: NewUrl, version: int) -> None:
    url = new_url()
    make_old(url, version)
    with pytest.raises(
        DatabaseError, match=rf"schema version {version}, .* reads version 4; moma migrate --db "
    ):
        open_database(url)
    migrate(url)
    with open_database(url, create=False) as database, database.session() as session:
        measured = select(Entity).where(Entity.measurement.has())
        stones = load_stones(session, session.scalars(measured).all())
        assert len(stones) == {1: 9, 2: 10, 3: 9}[version]
        assert not any(stone.hypothesis for stone in stones)
        store_survey(session, "more", "more.moma", "ef" * 32, [box_stone("A1"), box_stone("A2")])
        session.flush()
        assert session.scalars(select(Entity.code).order_by(Entity.id.desc())).first() == "A2"


@pytest.mark.parametrize("version", [1, 2, 3])
def test_up_and_down_and_up_again_is_the_same(new_url: NewUrl, version: int) -> None:
    url, before = new_url(), dumped(version)
    make_old(url, version)
    migrate(url)
    up = rows_of(url, 4)
    migrate(url, version, lossy=True)
    assert differences(url, LAYOUTS[version]) == []
    assert same_but_for_rounding(rows_of(url, version), lengthened(before))
    migrate(url)
    again = rows_of(url, 4)
    assert same_but_for_rounding(again, up)


def lengthened(value: Any) -> Any:
    """Rows of version 3 with the names that version 4 leaves to a user's own kind and attribute."""
    if isinstance(value, dict):
        rows = {lengthened(name): lengthened(one) for name, one in value.items()}
        return {
            name: sorted(one, key=repr) if name == "kind" and isinstance(one, list) else one
            for name, one in rows.items()
        }
    if isinstance(value, list):
        return [lengthened(one) for one in value]
    if isinstance(value, str):
        return re.sub(r"\b(support|blockiness)\b", r"own_\1", value)
    return value


def same_but_for_rounding(found: Rows, truth: Rows) -> bool:
    """Whether the rows are the same; covariances, which are computed both ways, to 1e-9.

    What stands beside the diagonal has the sign of axes that version 1 did not keep.
    """
    one, other = (
        {row["entity_id"]: np.abs(array(row.pop("covariance"), 9)) for row in rows["measurement"]}
        for rows in (found, truth)
    )
    assert one.keys() == other.keys()
    for number, covariance in one.items():
        np.testing.assert_allclose(covariance, other[number], rtol=1e-9, atol=1e-18)
    assert found == truth
    return True


def test_version_4_leaves_what_was_surveyed_and_run_as_it_was(new_url: NewUrl) -> None:
    url, before = new_url(), lengthened(dumped(3))
    make_old(url, 3)
    assert migrate(url).lost == ()
    after = rows_of(url, 4)
    modes = {"open": "as-surveyed", "close": "close"}
    for row in before["simplification"]:
        row |= {"mode": modes[row["mode"]], "within_tolerance": None}
        row |= dict.fromkeys(("shape", "blockiness", "worst_angle"))
    for row in before["entry"]:
        if row["action"] == "run" and row["settings"]:
            row["settings"]["joints"]["mode"] = modes[row["settings"]["joints"]["mode"]]
    for row in before["entity"]:
        row["hypothesis"] = False
    for row in before["joint_result"]:
        row["width"] = None
    before["moma_schema"] = [{"version": 4}]
    assert {row["mode"] for row in before["simplification"]} == {"close", "as-surveyed"}
    for name, rows in before.items():
        assert len(rows) == len(after[name]) > 0
        assert all(row in after[name] for row in rows), name


def test_version_3_has_no_hypotheses_and_no_supports(new_url: NewUrl) -> None:
    url = new_url()
    stones = [box_stone("A1"), replace(box_stone("A2"), provenance="hypothesis", hypothesis=True)]
    with open_database(url) as database, database.session() as session:
        store_survey(session, "wall", "wall.moma", SHA, [*stones, box_stone("G1", "support")])
        run = run_record({"A1": 1e5, "A2": None})
        solid = stones[0].solid_vertices, stones[0].solid_faces
        told = SimplificationRecord("A1", "mortar", 0.004, -0.01, *solid, "hexahedron", 0.98, 0.02, True)
        store_run(session, replace(run, simplifications=(told,), joints=one_joint(0.012)))
    before = rows_of(url, 4)
    lost = (
        r"that entities are hypotheses \(1\); what solids of runs were simplified to \(1\); "
        r"widths of joints as surveyed \(1\); the kind support, which becomes stone \(1\)"
    )
    with pytest.raises(UsageError, match=lost):
        migrate(url, 3)
    assert rows_of(url, 4) == before
    migrate(url, 3, lossy=True)
    assert differences(url, LAYOUTS[3]) == []
    kinds = {row["code"]: row["kind"] for row in rows_of(url, 3)["entity"]}
    assert kinds == {"A1": "header", "A2": "header", "G1": "stone"}
    migrate(url)
    again = rows_of(url, 4)
    for row in before["entity"]:
        row |= {"hypothesis": False, "kind": kinds[row["code"]]}
    for row in before["simplification"]:
        row |= dict.fromkeys(("shape", "blockiness", "worst_angle", "within_tolerance"))
    for row in before["joint_result"]:
        row["width"] = None
    assert again == before


def one_joint(width: float) -> JointArrays:
    numbers = np.ones(1)
    names = [
        one.name for one in fields(JointArrays) if one.name not in ("stones", "centroid", "normal", "parted")
    ]
    arrays = {
        "stones": np.array([[0, 1]]),
        "centroid": np.ones((1, 3)),
        "normal": np.array([[0.0, 0.0, 1.0]]),
    }
    return JointArrays(
        **arrays, **dict.fromkeys(names, numbers) | {"parted": np.array([False]), "width": np.array([width])}
    )


def test_going_down_says_what_is_lost_and_asks_first(new_url: NewUrl) -> None:
    url = new_url()
    with open_database(url) as database, database.session() as session:
        wall = [box_stone("H1"), box_stone("C1", "corbel"), box_stone("B1", "base")]
        store_survey(session, "window", "window.moma", SHA, wall)
        entry = new_entry(session, "declaration", "a test")
        first, second = session.scalars(select(Entity).where(Entity.code.in_(["H1", "C1"]))).all()
        session.add(Relation(kind="beside", subject=first, object=second, declared=True, entry=entry))
        session.add(Joint(code="J1", entry=entry, thickness=0.01))
        old = session.scalars(select(Measurement).where(Measurement.entity_id == first.id)).one()
        old.superseded_by = entry
        session.flush()
        session.add(measured_again(old, entry.id))
    assert Corbel  # declared, so that its kind is known
    before = rows_of(url, 4)
    with pytest.raises(
        UsageError, match=r"relations \(1\).*superseded \(1\).*not measured.*\(1\)"
    ) as refused:
        migrate(url, 2)
    assert "acts of recording besides surveys and runs (1)" in str(refused.value)
    assert "attributes that not every kind has: tail_length, rank, … (1)" in str(refused.value)
    assert "the kind base, which becomes entity (1)" in str(refused.value)
    assert "the kind corbel, which becomes ashlar (1)" in str(refused.value)
    assert rows_of(url, 4) == before
    migrate(url, 2, lossy=True)
    after = rows_of(url, 2)
    assert {row["code"]: row["kind"] for row in after["entity"]} == {
        "H1": "header",
        "C1": "ashlar",
        "B1": "entity",
    }
    assert sorted(row["line"] for row in after["measurement"]) == [7, 7, 99]


def measured_again(old: Measurement, entry: int) -> Measurement:
    names = [column.key for column in inspect(Measurement).columns if column.key != "id"]
    values = {name: getattr(old, name) for name in names}
    return Measurement(
        **values | {"line": 99, "entry_id": entry, "superseded_id": None, "survey_id": old.survey_id}
    )


def test_a_migration_that_fails_changes_nothing(new_url: NewUrl, monkeypatch: pytest.MonkeyPatch) -> None:
    url, before = new_url(), dumped(1)
    make_old(url, 1)

    def fail(*arguments: object) -> None:
        raise ZeroDivisionError

    # Alembic loads the scripts of the steps anew, so they take it from here
    monkeypatch.setattr("archmodel.migrations.steps.end_layout", fail)
    with pytest.raises(ZeroDivisionError):
        migrate(url)
    assert rows_of(url, 1) == before
    assert differences(url, LAYOUTS[1]) == []


def test_a_copy_of_the_file_is_kept_and_replaces_none(tmp_path: Path) -> None:
    file = tmp_path / "old.db"
    url = f"sqlite:///{file}"
    make_old(url, 1)
    earlier = tmp_path / "old.db.v1.bak"
    earlier.write_text("kept by hand")
    done = migrate(url)
    assert done.backup == f"{file}.v1.2.bak"
    assert earlier.read_text() == "kept by hand"
    assert rows_of(f"sqlite:///{done.backup}", 1) == dumped(1)
    assert migrate(url).backup is None  # there was nothing to do
    assert sorted(one.name for one in tmp_path.iterdir()) == ["old.db", "old.db.v1.2.bak", "old.db.v1.bak"]


def test_a_database_that_refers_to_nothing_is_refused_and_unchanged(tmp_path: Path) -> None:
    file = tmp_path / "old.db"
    url = f"sqlite:///{file}"
    make_old(url, 1)
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("UPDATE entity_result SET run_id = 77 WHERE entity_id = 1")
    before = rows_of(url, 1)
    with pytest.raises(DatabaseError, match=r"entity_result refers to a row of run that is not there"):
        migrate(url)
    assert rows_of(url, 1) == before
    assert [one.name for one in tmp_path.iterdir()] == ["old.db"]


def test_a_migration_waits_for_a_writer_no_longer_than_asked(new_url: NewUrl) -> None:
    url = new_url()
    with open_database(url) as database, database.session() as session:
        new_entry(session, "declaration", "a test")
        with pytest.raises(DatabaseError, match="locked by another program"):
            migrate(url, 2, lock_timeout=0.05)


def test_what_cannot_be_migrated_is_said(new_url: NewUrl, tmp_path: Path) -> None:
    url = new_url()
    with pytest.raises(DatabaseError, match=r"there is no database|the database is empty"):
        migrate(url)
    with pytest.raises(UsageError, match="version 5 of the layout is not known; name one up to 4"):
        migrate(url, 5)
    with connected(url) as connection:
        connection.execute(text("CREATE TABLE photo (id INTEGER)"))
    with pytest.raises(DatabaseError, match="is not a MOMA database"):
        migrate(url)
    newer = new_url()
    with open_database(newer) as database, database.session() as session:
        session.execute(text("UPDATE moma_schema SET version = 99"))
    with pytest.raises(
        DatabaseError, match="schema version 99, this program knows versions up to 4; install"
    ):
        migrate(newer)


PROGRAM = """
import sys
from archmodel.migrations.migrate import migrate
print("ready", flush=True)
sys.stdin.readline()
migrate(sys.argv[1], int(sys.argv[2]), lossy=True)
"""


@pytest.mark.parametrize("part", [0.2, 0.5, 0.8])
def test_a_migration_that_is_killed_leaves_all_or_nothing(new_url: NewUrl, part: float) -> None:
    url, before = new_url(), dumped(1)
    make_old(url, 1)
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, url, "4"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdin is not None
        assert process.stdout.readline() == "ready\n"
        process.stdin.write("\n")
        process.stdin.flush()
        time.sleep(part * 0.25)  # it takes about 0.25 s
        process.kill()
    with connected(url) as connection:
        version = connection.execute(text("SELECT version FROM moma_schema")).scalar_one()
    assert version in (1, 4)
    if version == 1:
        assert rows_of(url, 1) == before
        assert migrate(url).before == 1
    assert len(rows_of(url, 4)["measurement"]) == 9
