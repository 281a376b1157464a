"""What is not a whole and right document is refused at its place, and nothing of it is left behind."""

import gzip
import json
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random
from typing import Any

import pytest

from archmodel.database.session import Database, open_database
from archmodel.exchange.head import FRAME, UNITS
from archmodel.exchange.reader import import_building
from archmodel.exchange.writer import export_building
from archmodel.tables.layout import SCHEMA_VERSION
from archmodel.tables.registered import all_kinds, release_registered
from ground.errors import ExchangeError, MomaError
from tests.archmodel.random_databases import everything, fill, tables
from tests.postgresql import Server

Edit = Callable[[dict[str, Any]], None]
Refused = Callable[..., str]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A document with three rows in every table."""
    path = tmp_path_factory.mktemp("written") / "building.json"
    with open_database("sqlite://") as database:
        with database.session() as session:
            fill(session, Random(5), 3)
        with database.session(read_only=True) as session:
            export_building(session, path)
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def memory() -> Iterator[Database]:
    """A database that stays empty, since nothing is ever taken in."""
    with open_database("sqlite://") as database:
        yield database


@pytest.fixture
def refused(memory: Database, tmp_path: Path) -> Refused:
    """The one line with which a document is refused; the database stays as it was."""
    return lambda document, suffix=".json": refused_by(memory, document, tmp_path / f"given{suffix}")


def refused_by(database: Database, document: str | bytes, path: Path) -> str:
    path.write_bytes(document if isinstance(document, bytes) else document.encode())
    with pytest.raises(ExchangeError) as caught:
        import_building(path, database)
    assert not any(everything(database).values())
    assert not any(name.startswith("own_kind") for name in all_kinds())
    return str(caught.value).replace(str(path), "given")


def edited(written: str, edit: Edit) -> str:
    """The document after a change of its contents, a row in a line still."""
    document = json.loads(written)
    edit(document)
    if not isinstance(document.get("tables"), dict):
        return json.dumps(document)
    tables = document.pop("tables")
    head = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in document.items())
    rows = (
        f'"{name}": [\n' + ",\n".join(json.dumps(row) for row in table) + "]" if isinstance(table, list)
        else f'"{name}": {json.dumps(table)}'
        for name, table in tables.items()
    )  # fmt: skip
    return "{" + head + ',\n"tables": {\n' + ",\n".join(rows) + "}}"


def set_at(path: str, value: Any) -> Edit:
    """A change of one value, at a path as `tables.entity.0.depth`; DROP removes it."""

    def edit(document: Any) -> None:
        *steps, last = [int(step) if step.isdigit() else step for step in path.split(".")]
        for step in steps:
            document = document[step]
        if value is DROP:
            del document[last]
        else:
            document[last] = value

    return edit


DROP = object()

WRONG = (
    # path, value, what is said
    ("format", "a diary", r"given \$\.format: is 'a diary', expected 'moma building'; give a document that"),
    ("format_version", 2, r"\$\.format_version: is 2, expected 1; use the version of MOMA"),
    ("format_version", True, r"\$\.format_version: is true, expected 1"),
    ("schema_version", 3, rf"\$\.schema_version: is 3, expected {SCHEMA_VERSION}; .*; this one reads 1 and 2"),
    ("schema_version", DROP, r"\$\.schema_version: is missing"),
    ("recorded_until", "today", r"\$\.recorded_until: is 'today', expected the instant"),
    ("moma", 7, r"\$\.moma: is 7"),
    ("units", UNITS | {"length": "mm"}, r"\$\.units: is an object of 7, expected .*; convert the numbers"),
    ("frame", FRAME.replace("z", "y"), r"\$\.frame: .*; carry the coordinates into that frame"),
    ("tables", DROP, r"\$\.tables: is missing"),
    ("tables", [], r"given:\d+ character \d+: found '\[', expected {"),
    ("unit", {}, r"unknown key 'unit'; did you mean units\?|found section|unknown key"),
    ("tables.relation", DROP, r"found section membership, expected relation; the order is entry, kind, canon, survey"),
    ("tables.mechanism_stone", DROP, r"\$\.tables\.mechanism_stone: is missing; write \[\] if it is empty"),
    ("tables.statue", [], r"given:\d+ character \d+: unknown key 'statue'; did you mean"),
    ("tables.entity", {}, r"given:\d+ character \d+: found '{', expected \["),
    ("tables.entity", 3, r"found '3', expected \["),
    ("tables.entity.1", 3, r"given:\d+ \$\.tables\.entity\[1\]: is 3, expected an object"),
    ("tables.entity.1", None, r"\$\.tables\.entity\[1\]: is null, expected an object"),
    ("tables.entity.1.heigth", 0.3, r"\$\.tables\.entity\[1\]: unknown key 'heigth'; did you mean height\?"),
    ("tables.entity.1.code", DROP, r"\$\.tables\.entity\[1\]\.code: is missing or null"),
    ("tables.entity.1.code", None, r"\$\.tables\.entity\[1\]\.code: is missing or null"),
    ("tables.entity.1.code", 5, r"\.code: is 5, expected a text"),
    ("tables.entity.1.code", "half \ud800", r"\.code: has half of a surrogate pair"),
    ("tables.entity.1.kind", "gargoyle", r"\.kind: is 'gargoyle', which is no kind; known are"),
    ("tables.entity.1.kind", "headr", r"\.kind: is 'headr', which is no kind; did you mean header\?"),
    ("tables.structure.1.kind", "own_kind_0", r"structure\[1\]\.kind: is 'own_kind_0', which is no kind"),
    ("tables.entity.1.kind", "own_kind_1", r"entity\[1\]\.kind: is 'own_kind_1', which is no kind"),
    ("tables.structure.1.kind", "own_kind_9", r"structure\[1\]\.kind: is 'own_kind_9', which is no kind"),
    ("tables.canon.0.proportions", "depth >", r"canon\[0\]\.proportions: "),
    ("tables.kind.1.attributes", {"a": ["m", "x"]}, r"own_kind_1 is a kind of structure.* leave out attributes"),
    ("tables.kind.0.name", "arch", r"\$\.tables\.kind: the kind arch means something else here than in this"),
    ("tables.statement.1.kind", "statement", r"statement\[1\]\.kind: is 'statement', which is no kind"),
    ("tables.entity.1.depth", "deep", r"\.depth: is 'deep', expected a number"),
    ("tables.entity.1.depth", True, r"\.depth: is true, expected a number"),
    ("tables.entity.1.depth", 10**400, r"\.depth: is a whole number of more than 40 digits, expected a number"),
    ("tables.entity.1.depth", [1.0], r"\.depth: is a list of 1, expected a number"),
    ("tables.entity.1.course", 1.5, r"\.course: is 1\.5, expected a whole number"),
    ("tables.entity.1.course", 2**63, r"\.course: is 9223372036854775808, expected a whole number of 64 bits"),
    ("tables.entity.1.course", True, r"\.course: is true, expected a whole number"),
    ("tables.entity.1.id", 1, r"entity\[1\]: id 1 comes after 1; sort the rows by id"),
    ("tables.entity.1.entry_id", 99, r"entity\[1\]\.entry_id: there is no entry 99"),
    ("tables.relation.0.declared", 1, r"relation\[0\]\.declared: is 1, expected true or false"),
    ("tables.relation.2.object_id", 99, r"relation\[2\]\.object_id: there is no entity 99"),
    ("tables.relation.0.subject", "W99", r"relation\[0\]\.subject: is 'W99', but subject_id \d is '.*'; correct one"),
    ("tables.relation.0.subject", 7, r"relation\[0\]\.subject: is 7, expected a text"),
    ("tables.structure.0.parent_id", 99, r"structure\[0\]\.parent_id: there is no structure 99"),
    ("tables.structure.2.supersedes_id", -5, r"structure\[2\]\.supersedes_id: there is no structure -5"),
    ("tables.measurement.0.points", [[1.0, 2.0]], r"points\[0\]: is a list of 2, expected .*numbers, 3 of"),
    ("tables.measurement.0.points", [[1.0, 2.0, "x"]], r"points\[0\]\[2\]: is 'x', expected a number.*or null"),
    ("tables.measurement.0.points", [[1.0, 2.0, [3.0]]], r"points\[0\]\[2\]: is a list of 1, expected a number"),
    ("tables.measurement.0.points", "no", r"points: is 'no', expected a list of lists of 3 numbers"),
    ("tables.measurement.0.axes", [[0.0] * 3] * 3, r"axes: is a list of 3, expected a list of .*, 2 of them"),
    ("tables.measurement.0.rejected", [1, "2"], r"rejected\[1\]: is a text, expected a whole number"),
    ("tables.measurement.0.solid_faces", [[1, 2], [3, None]], r"solid_faces\[1\]\[1\]: is null, expected a whole"),
    ("tables.measurement.0.notes", {"edge": 1}, r"notes\.edge: is a number, expected a text"),
    ("tables.kind.0.attributes", {"a": ["m"]}, r"kind\[0\]\.attributes\.a: is a list, expected a list of 2"),
    ("tables.kind.0.name", "Own Kind", r"kind\[0\]\.name: is 'Own Kind', which is not the name of a kind"),
    ("tables.kind.0.parent", "nobody", r"\$\.tables\.kind: the kind own_kind_0 is a case of nobody"),
    ("tables.kind.0.canon", "depth >", r"kind\[0\]\.canon: "),
    ("tables.entry.0.recorded_at", "yesterday", r"recorded_at: is 'yesterday', expected an instant in UTC"),
    ("tables.entry.0.recorded_at", "2026-13-01T00:00:00Z", r"recorded_at: is '2026-13-01T00:00:00Z', expected"),
    ("tables.entry.0.recorded_at", "2026-01-01T00:00:00", r"recorded_at: is .*, expected an instant in UTC"),
    ("tables.statement.0.observed_on", "1.1.2026", r"observed_on: is '1.1.2026', expected a date"),
    ("tables.statement.0.observed_on", "2026-02-30", r"observed_on: is '2026-02-30', expected a date"),
)  # fmt: skip


@pytest.mark.parametrize(
    ("path", "value", "said"), WRONG, ids=[f"{one[0]}-{n}" for n, one in enumerate(WRONG)]
)
def test_what_is_wrong_is_said_at_its_place(path: str, value: Any, said: str, written: str, refused: Refused):
    document = edited(written, set_at(path, value))
    assert re.search(said, refused(document)), refused(document)


def test_postgresql_refuses_the_same(postgresql: Server, written: str, tmp_path: Path):
    with postgresql.database() as url, open_database(url) as database:
        for path, value, said in WRONG:
            if "there is no" not in said and "correct one" not in said:
                continue  # refused before the database is asked
            document = edited(written, set_at(path, value))
            assert re.search(said, refused_by(database, document, tmp_path / "given.json")), path


def test_the_line_is_that_of_the_row(written: str, refused: Refused):
    document = edited(written, set_at("tables.measurement.2.rms", "large"))
    line = next(n for n, text in enumerate(document.splitlines(), 1) if '"rms": "large"' in text)
    assert refused(document).startswith(f"given:{line} $.tables.measurement[2].rms: is 'large'")


@pytest.mark.parametrize("ring", [(0,), (0, 1), (2, 0, 1)])
def test_a_structure_that_is_a_part_of_itself_is_refused(
    ring: tuple[int, ...], written: str, refused: Refused
):
    def close(document: Any) -> None:
        rows = document["tables"]["structure"]
        for row, whole in zip(ring, (*ring[1:], ring[0]), strict=True):
            rows[row]["parent_id"] = rows[whole]["id"]

    said = refused(edited(written, close))
    assert re.match(
        r"given \$\.tables\.structure: structure (\d) refers to itself by parent_id: \1( → \d)* → \1$", said
    )


def test_codes_that_come_twice_are_refused(written: str, refused: Refused):
    code = json.loads(written)["tables"]["entity"][0]["code"]
    document = edited(written, set_at("tables.entity.2.code", code))
    assert re.search(r"entity\[2\]: code .* is also that of id 1; each may be there once", refused(document))


def test_names_that_are_held_twice_are_refused(written: str, refused: Refused):
    def twice(document: Any) -> None:
        for row in document["tables"]["material"]:
            row["name"] = "tuff"
            row.pop("superseded_id", None)

    assert re.search(r"material\[1\]: name 'tuff' is also that of id 1", refused(edited(written, twice)))


def test_a_key_that_comes_twice_is_refused(written: str, refused: Refused):
    twice = written.replace('"code":', '"code": "other", "code":', 1)
    assert "the key 'code' comes twice in one object" in refused(twice)
    twice = written.replace('"moma":', '"moma": "1", "moma":', 1)
    assert "the key moma comes twice" in refused(twice)


NOT_JSON = (
    ("", "it ends before {"),
    ("[]", r"found '\[', expected {"),
    ("{", "it ends"),
    ("{}", r"\$\.format: is missing"),
    ("null", "found 'n', expected {"),
    ('{"format": NaN}', "NaN is no JSON"),
    ('{"format": 1e999}', "format: is inf|digits|missing"),
    ('{"format": -}', "this is no JSON: Expecting value"),
    ('{"format": "\\x"}', "this is no JSON: Invalid"),
    ('{"format" 1}', "found '1', expected :"),
    ("{'format': 1}", "found \"'\", expected \""),
    ('{"format": ' + "[" * 100_000, "nested too deeply"),
    ('{"format": ' + '{"a":' * 100_000, "nested too deeply"),
    ('{"format": ' + "1" * 5000 + "}", "a number has too many digits"),
    ("\x00" * 10, "expected {"),
)  # fmt: skip


@pytest.mark.parametrize(("text", "said"), NOT_JSON, ids=[text[:20] for text, _ in NOT_JSON])
def test_what_is_no_document_is_refused(text: str, said: str, refused: Refused):
    assert re.search(said, refused(text)), refused(text)


def test_bytes_that_are_no_text_are_refused_with_their_place(written: str, refused: Refused):
    raw = written.encode()
    assert (
        refused(raw[:100] + b"\xff" + raw[100:]) == "given byte 100: this is not UTF-8 (invalid start byte)"
    )


def test_more_after_the_end_is_refused(written: str, refused: Refused):
    assert "found '{', expected the end" in refused(written + "{}")


@pytest.mark.parametrize("share", [0.001, 0.02, 0.1, 0.3, 0.5, 0.8, 0.99, 0.9999])
def test_a_document_that_was_cut_is_refused(share: float, written: str, refused: Refused):
    raw = written.rstrip().encode()
    said = refused(raw[: int(share * len(raw))])
    assert re.match(r"given(:\d+ character \d+| byte \d+)?: (it ends|this is not UTF-8)", said)


def test_a_compressed_document_that_was_cut_is_refused(written: str, refused: Refused):
    packed = gzip.compress(written.encode())
    for broken in (packed[: len(packed) // 2], b"", b"PK" + packed, packed[:-8] + b"\0" * 8):
        assert re.match(r"given.*: (it cannot be read|it ends before)", refused(broken, ".json.gz"))


def test_a_filled_database_is_refused_and_stays_as_it_was(filled: Database, tmp_path: Path, written: str):
    path = tmp_path / "given.json"
    path.write_text(written, encoding="utf-8")
    before = everything(filled)
    with pytest.raises(
        ExchangeError, match=r"not empty, its table entry has rows; .*name a new one with --db"
    ):
        import_building(path, filled)
    assert everything(filled) == before


def test_a_number_that_the_database_cannot_hold_is_refused_at_its_row(
    written: str, empty: Database, tmp_path: Path
):
    """PostgreSQL's whole numbers have 32 bits, SQLite's 64."""
    path = tmp_path / "given.json"
    path.write_text(edited(written, set_at("tables.entity.1.course", 2**40)), encoding="utf-8")
    if empty.engine.dialect.name == "sqlite":
        import_building(path, empty)
        return
    with pytest.raises(
        ExchangeError, match=r"\$\.tables\.entity\[1\]: the database refuses this row: .*integer"
    ):
        import_building(path, empty)
    assert not any(everything(empty).values())


def test_a_text_with_a_null_character_is_refused_by_postgresql_at_its_row(
    written: str, empty: Database, tmp_path: Path
):
    path = tmp_path / "given.json"
    path.write_text(edited(written, set_at("tables.entity.1.zone", "a\0b")), encoding="utf-8")
    if empty.engine.dialect.name == "sqlite":
        import_building(path, empty)
        return
    with pytest.raises(ExchangeError, match=r"\$\.tables\.entity\[1\]: the database refuses this row: .*NUL"):
        import_building(path, empty)


# --- documents that were changed at random ---


def mutations(written: str, random: Random) -> Iterator[bytes]:
    """Endless: bytes changed, taken out, repeated, cut off; values, keys and rows exchanged."""
    raw = written.encode()
    document = json.loads(written)
    while True:
        if random.random() < 0.5:
            yield _broken_bytes(raw, random)
        else:
            copy = json.loads(json.dumps(document))
            for _ in range(random.choice((1, 1, 1, 2, 5))):
                _break(copy, random)
            yield json.dumps(copy, ensure_ascii=random.random() < 0.5).encode("utf-8", "surrogatepass")


def _broken_bytes(raw: bytes, random: Random) -> bytes:
    start = random.randrange(len(raw))
    end = min(len(raw), start + random.choice((1, 1, 2, 10, 1000)))
    inside = random.choice(
        (b"", bytes([random.randrange(256)]), raw[start:end] * 2, b"\x00", b'"', b"[" * 50, b"9" * 400, b"1e999",
         b"-", b"null", b"]", b"}", b",", b"\\ud800", b"\xed\xa0\x80", b"NaN", b"true", b"{}")
    )  # fmt: skip
    if random.random() < 0.1:
        return raw[:start]
    return raw[:start] + inside + raw[end if random.random() < 0.7 else start :]


JUNK: tuple[Any, ...] = (
    *(
        None,
        True,
        False,
        0,
        1,
        -1,
        2,
        7,
        2**31,
        2**63,
        10**30,
        0.5,
        -0.0,
        1e308,
        *("", "x", "1", "header", "NaN"),
    ),
    *(
        *("Infinity", "2026-01-01", "2026-01-01T00:00:00Z", "9999-12-31T23:59:59.999999Z", "\ud800"),
        "\0",
        "é" * 500,
    ),
    *(
        [],
        [[]],
        [1],
        [[1.0, 2.0, 3.0]],
        [None],
        {},
        {"a": {}},
        [[[[[[[[]]]]]]]],
        "own_kind_0",
        "'; DROP TABLE entity",
    ),
)


def _break(value: Any, random: Random) -> None:
    """Change one thing somewhere in nested lists and objects."""
    while True:
        places = [*value] if isinstance(value, dict) else [*range(len(value))]
        if not places:
            return
        place = random.choice(places)
        if isinstance(value[place], dict | list) and value[place] and random.random() < 0.85:
            value = value[place]
            continue
        act = random.randrange(5)
        if act == 0:
            del value[place]
        elif act == 1 and isinstance(value, dict):
            value[random.choice((*value, "id", "code", "nonsense"))] = value.pop(place)
        elif act == 1:
            value.append(value[place])
        elif act == 2:
            value[place] = value[random.choice(places)]
        else:
            value[place] = random.choice(JUNK)
        return


def endure(written: str, count: int, seed: int, folder: Path) -> tuple[int, int]:
    """How many mutated documents were taken in, how many refused; a document that is taken in comes out again."""
    path, again = folder / "given.json", folder / "again.json"
    source = mutations(written, Random(seed))
    taken = refused = 0
    with open_database("sqlite://") as database:
        for raw, _ in zip(source, range(count), strict=False):
            path.write_bytes(raw)
            if (error := refusal(path, database)) is not None:
                assert error.startswith(str(path))
                assert len(error) < 3000
                refused += 1
                continue
            taken += 1
            with open_database("sqlite://") as other:
                with database.session(read_only=True) as session:
                    export_building(session, again)
                import_building(again, other)
                assert everything(other) == everything(database)
            _clear(database)
        assert not any(everything(database).values())
    return taken, refused


def refusal(path: Path, database: Database) -> str | None:
    """Why a document is refused; None if it is taken in."""
    try:
        import_building(path, database)
    except MomaError as error:
        return str(error)
    return None


def _clear(database: Database) -> None:
    release_registered(database.engine)
    with database.session() as session:
        session.connection().exec_driver_sql("PRAGMA defer_foreign_keys = ON")
        for table in reversed(tables()):
            session.execute(table.delete())


def test_mutated_documents_are_refused_or_right(written: str, tmp_path: Path):
    taken, refused = endure(written, 40, 1, tmp_path)
    assert taken > 1
    assert refused > 20


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_ten_thousand_mutated_documents_are_refused_or_right(seed: int, written: str, tmp_path: Path):
    taken, refused = endure(written, 1000, 1000 + seed, tmp_path)
    assert taken > 20
    assert refused > 400
