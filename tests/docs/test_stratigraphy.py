"""docs/howto/stratigraphy.md is true: its files are recorded as it shows, and its picture is the one that is drawn."""

from pathlib import Path

from tests.docs.pages import blocks
from tests.moma.commands import prints
from tests.paths import ROOT

PAGE = "docs/howto/stratigraphy.md"


def test_the_matrix_of_the_page_is_made_by_its_commands(tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MOMA_DB", raising=False)
    (tmp_path / "units.toml").write_text(*blocks(PAGE, "toml"), encoding="utf-8")
    (tmp_path / "harris.csv").write_text(*blocks(PAGE, "csv"), encoding="utf-8")
    (session,) = blocks(PAGE, "session")
    prints("ingest", str(ROOT / "data/samples/window/window.moma"))
    printed = prints("record", "units.toml")
    printed += prints("record", "harris.csv", "--author", "A. Mason", "--source", "seen from the scaffold")
    printed += prints("matrix", "--out", "harris.svg")
    shown = [line for line in session.splitlines() if not line.startswith("moma ")]
    assert printed.splitlines() == shown
    drawn = (tmp_path / "harris.svg").read_text(encoding="utf-8")
    assert drawn == (ROOT / "docs/images/harris.svg").read_text(encoding="utf-8")
