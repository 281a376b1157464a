"""docs/howto/clouds.md is true: its commands run, and say what it says."""

import csv
import re

import pytest

from moma.cli.options import CloudChoices
from tests.docs.pages import blocks, ran
from tests.paths import ROOT

PAGE = "docs/howto/clouds.md"
TEXT = (ROOT / PAGE).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder in which the commands of the page have run, and what each has printed."""
    folder = tmp_path_factory.mktemp("clouds")
    lines = [
        line for block in blocks(PAGE, "bash") for line in block.splitlines() if line.startswith("moma ")
    ]
    return folder, ran(folder, "\n".join(lines))


def after(said, start):
    return next(text for line, text in said.items() if line.startswith(start))


@pytest.mark.slow
def test_the_commands_say_what_the_page_shows(place):
    folder, said = place
    (line,) = blocks(PAGE, "text")
    assert line in after(said, "moma ingest --cloud")
    assert "as good as" in after(said, "moma show V4")
    assert re.search(r"9\d stones of survey 'masks'", after(said, "moma ingest --masks"))
    assert (folder / "out/scan-report/elevation.png").is_file()
    names = {path.name for path in (folder / "out/scan-views").iterdir()}
    table = TEXT.split("| file | what it is |")[1].split("The frame")[0]
    assert names == set(re.findall(r"`([\w.]+\.\w+)`", table))
    with (folder / "out/scan/review.csv").open(encoding="utf-8") as file:
        assert next(csv.reader(file)) == ["code", "reason", "text", "where"]


def test_every_reason_of_the_review_is_explained():
    sources = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "survey/clouds").rglob("*.py"))
    given = set(re.findall(r'Doubtful\(\s*(?:[\w.]+|""),\s*"([a-z ]+)"', sources))
    given |= set(re.findall(r'\(\s*"(in pieces|holes|texts)", f"', sources))
    assert {"overlap", "leak", "rejected", "in pieces", "specks"} <= given
    explained = set(re.findall(r"`([a-z ]+)`", TEXT.split("| reason |")[1].split("Stones without")[0]))
    assert given - {"stretched"} <= explained
    assert "may be repeated" in CloudChoices.__annotations__["cloud"].__metadata__[0].help
