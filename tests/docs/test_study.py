"""docs/howto/study.md is true: its commands run, its study can be read, and its tables list all keys."""

import re

import pytest

from ground.toml.keys import keys_of
from pipelines.assess.study.settings import CorrelationTable, InputTable, QuantityTable, StudyTable
from tests.docs.pages import blocks, ran
from tests.paths import ROOT

PAGE = "docs/howto/study.md"


@pytest.mark.slow
def test_the_commands_run(tmp_path):
    said = ran(tmp_path, "".join(blocks(PAGE, "bash")))
    headline = next(text for line, text in said.items() if line.startswith("moma study"))
    assert headline.startswith("P(bound horizontal y below 0.3) = ")
    assert "core through BLOCK" in headline
    assert (tmp_path / "out/block-study/report.html").exists()


def test_the_tables_list_all_keys_and_their_meaning():
    text = (ROOT / PAGE).read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| `(\w+)` \| .*? \| .*? \| (.*) \|$", text, re.MULTILINE))
    for owner in (StudyTable, InputTable, CorrelationTable, QuantityTable):
        for key in keys_of(owner):
            assert key.name in rows
            assert f"| {key.doc} |" in text
