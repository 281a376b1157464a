"""docs/exchange.md is true: its commands run, its example is what they write, its sections are all there are."""

import gzip
import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from archmodel.exchange.sections import sections
from archmodel.tables.layout import SCHEMA_VERSION
from moma.cli import app
from tests.docs.pages import printed
from tests.paths import ROOT

PAGE = (ROOT / "docs/exchange.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    (found,) = re.findall(rf"^```{language}\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return str(found)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where the commands of the page have been run, in their order."""
    place = tmp_path_factory.mktemp("page")
    (place / "data").symlink_to(ROOT / "data")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        patch.delenv("MOMA_DB", raising=False)
        for line in block("bash").splitlines():
            done = CliRunner().invoke(app, shlex.split(line)[1:])
            assert done.exit_code == 0, (line, done.output)
    return place


def test_the_copy_is_what_was_exported(folder: Path):
    assert gzip.decompress((folder / "again.json.gz").read_bytes()) == (folder / "window.json").read_bytes()


def test_the_example_is_the_document_cut_short(folder: Path):
    lines = iter((folder / "window.json").read_text(encoding="utf-8").splitlines())
    for shown in block("json").splitlines():
        if shown == "…":
            continue
        pattern = re.escape(shown).replace("…", ".*")
        assert any(re.match(pattern, line) for line in lines), shown


def test_the_python_reads_it(folder: Path):
    said = printed(folder, block("python")).splitlines()
    first = said[0].split()
    assert re.fullmatch(r"W\d\d-\d\d", first[0])
    assert float(first[1]) >= 0.5
    assert said[3].startswith("[[")


def test_the_sections_are_all_there_are():
    assert re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE) == [section.name for section in sections()]


def test_the_errors_are_those_that_are_said(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(folder)
    whole = (folder / "window.json").read_text(encoding="utf-8")
    broken = (
        '{"format": no}',
        whole.replace(f'"schema_version": {SCHEMA_VERSION}', '"schema_version": 99'),
        whole.replace('"course"', '"coarse"', 1),
        whole.replace('"entity_id": 3, "entity": "', '"entity_id": 4000, "entity": "', 1),
    )
    said = block("error").splitlines()
    assert len(said) == len(broken)
    for document, expected in zip(broken, said, strict=True):
        (folder / "broken.json").write_text(document, encoding="utf-8")
        done = CliRunner().invoke(app, ["import", "broken.json", "--db", "sqlite:///no.db"])
        assert done.exit_code == 1
        line = re.sub(r":\d+ \$", ":0 $", done.stderr.replace("moma: error: broken.json", "window.json"))
        pattern = re.escape(re.sub(r":\d+ \$", ":0 $", expected)).replace("…", ".*")
        assert re.match(pattern, line), line
        assert not (folder / "no.db").exists()
