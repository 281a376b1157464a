"""moma export and moma import: what they print, and one line for every mistake."""

import gzip
from pathlib import Path
from random import Random

import pytest

from archmodel.database.session import open_database
from tests.archmodel.random_databases import fill, tables
from tests.moma.commands import answer, fails, invoke, prints


@pytest.fixture
def url(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    with open_database("sqlite:///castle.db") as database, database.session() as session:
        fill(session, Random(1), 3)
    return "sqlite:///castle.db"


def test_both_print_how_many_rows_they_carried(url: str):
    first, *rest = prints("export", "castle.json", "--db", url).splitlines()
    assert first.startswith(f"castle.json: {3 * len(tables())} rows from sqlite:///castle.db (0.")
    assert "         3 contact_point" in rest
    assert len(rest) == len(tables())
    text = prints("import", "castle.json", "--db", "sqlite:///copy.db")
    assert text.startswith(f"castle.json: {3 * len(tables())} rows into sqlite:///copy.db (0.")


def test_json_tells_counts_by_section(url: str):
    told = answer("export", "castle.json", "--db", url)
    size = Path("castle.json").stat().st_size
    rows = {table.name: 3 for table in tables()}
    assert told == {"path": "castle.json", "database": url, "bytes": size, "rows": rows}
    told = answer("import", "castle.json", "--db", "sqlite:///copy.db")
    assert told == {"path": "castle.json", "database": "sqlite:///copy.db", "bytes": size, "rows": rows}


def test_standard_output_gets_the_document_alone(url: str):
    invoke("export", "castle.json", "--db", url)
    invoke("export", "castle.json.gz", "--db", url)
    done = invoke("export", "-", "--db", url)
    assert done.stdout_bytes == Path("castle.json").read_bytes()
    assert gzip.decompress(Path("castle.json.gz").read_bytes()) == done.stdout_bytes
    assert not Path("-").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["export", "no/castle.json"], "no/castle.json: it cannot be written: No such file or directory"),
        (["export", "x.json", "--db", "sqlite:///no.db"], "no.db: there is no database"),
        (["import", "no.json", "--db", "sqlite:///new.db"], "no.json: it cannot be read: No such file"),
        (["import", ".", "--db", "sqlite:///new.db"], ".: it cannot be read: Is a directory"),
        (["import", "castle.db", "--db", "sqlite:///new.db"], "castle.db byte "),
        (["import", "castle.db"], "castle.db byte "),
    ],
)
def test_mistakes_are_one_line_and_leave_nothing(arguments: list[str], said: str, url: str):
    if "--db" not in arguments and arguments[0] == "export":
        arguments = [*arguments, "--db", url]
    assert fails(1, *arguments).startswith(f"moma: error: {said}")
    assert [one.name for one in Path().iterdir()] == ["castle.db"]


def test_a_filled_database_is_refused(url: str):
    invoke("export", "castle.json", "--db", url)
    message = fails(1, "import", "castle.json", "--db", url)
    assert message.startswith(f"moma: error: {url}: it is not empty, its table entry has rows; ")
    assert "--db" in message


EXPORTED = (
    ".json or .json.gz or .ifc or .dxf or .glb or .compas.json or .results.json or .lmgc90.py or .3ddat or .graphml "
    "or .ttl or .gpkg"
)


@pytest.mark.parametrize(
    ("words", "endings"),
    [
        (["export", "castle.skp"], EXPORTED),
        (["export", "castle"], EXPORTED),
        (["export", "castle.gz"], EXPORTED),
        (["view", "--out", "castle.glb"], ".html or .htm"),
        (["view", "--elevation", "castle.dxf"], ".svg"),
        (["ingest", "wall.csv", "--review", "review.xlsx"], ".csv"),
        (["report", "run.html", "--pdf", "--out", "run.docx"], ".pdf"),
    ],
)
def test_a_file_is_never_written_in_another_format_than_its_name_says(
    words: list[str], endings: str, url: str
):
    line = fails(2, *words, *([] if words[0] == "report" else ["--db", url]))
    assert line.endswith(f"give a name that ends in {endings}")
    assert [one.name for one in Path().iterdir()] == ["castle.db"]
