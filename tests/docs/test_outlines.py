"""docs/howto/outlines.md is true: its commands run, and its tables name what there is."""

import json
import re
from typing import get_args

import pytest

from moma.cli.proposals import MasonryKind
from tests.docs.pages import blocks, ran
from tests.paths import ROOT

PAGE = "docs/howto/outlines.md"
TEXT = (ROOT / PAGE).read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_commands_take_a_scan_to_stones(tmp_path):
    pytest.importorskip("shapely")
    lines = [
        line for block in blocks(PAGE, "bash") for line in block.splitlines() if line.startswith("moma ")
    ]
    said = ran(tmp_path, "\n".join(lines))
    drawn = json.loads((tmp_path / "out/bay-outlines/outlines.json").read_text(encoding="utf-8"))
    assert 95 <= drawn["stones"] <= 105  # of 98
    assert drawn["openings"] == 1
    names = {path.name for path in (tmp_path / "out/bay-outlines").iterdir()}
    table = TEXT.split("| file | what it is |")[1].split("Each stone")[0]
    assert names == set(re.findall(r"`([\w.]+\.\w+)`", table))
    assert "proposed from image" in said["moma show C03-04 --db sqlite:///bay.db"]


def test_every_kind_of_masonry_is_explained():
    row = next(line for line in TEXT.splitlines() if line.startswith("| `--masonry`"))
    assert {*get_args(MasonryKind)} == set(re.findall(r"`(\w+)`", row))


def test_every_key_of_the_page_stands_in_the_table():
    page = (ROOT / "pipelines/reports/outlines/outlines.html").read_text(encoding="utf-8")
    keys = set(re.findall(r"<kbd>([^<]+)</kbd>", page)) - {"0", "Del"}
    table = TEXT.split("| key | what it does |")[1].split("Drag a corner")[0]
    assert keys <= set(re.findall(r"Ctrl \w|\b[A-Z]\b", table))
