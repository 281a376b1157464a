"""docs/howto/mask.md is true: its commands run and print what it shows."""

import csv
import shlex

import pytest

from tests.docs.pages import blocks
from tests.moma.commands import prints

PAGE = "docs/howto/mask.md"


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """What each command of the page prints; nothing is drawn."""
    folder = tmp_path_factory.mktemp("mask")
    out = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.delenv("MOMA_DB", raising=False)
        for line in (line for block in blocks(PAGE, "bash") for line in block.splitlines()):
            command = shlex.split(line)[1:]
            if "--pictures" in command:
                at = command.index("--pictures")
                del command[at : at + 2]
            out[command[0]] = prints(*command)
        with (folder / "out/rubble/review.csv").open(encoding="utf-8") as file:
            out["review"] = list(csv.reader(file))
        out["scene"] = (folder / "out/rubble/rubble-wall.toml").read_text(encoding="utf-8")
    return out


def test_the_commands_say_what_the_page_shows(said):
    assert "40 stones of survey 'wall' (40 rubble)" in said["ingest"]
    assert said["review"] == [["code", "reason", "text", "where"]]
    shown = next(block for block in blocks(PAGE, "text") if "leaf of" in block)
    assert not [line for line in shown.splitlines() if line not in said["check"]]


def test_the_joints_of_the_page_are_those_of_the_sample(said):
    (joints,) = blocks(PAGE, "toml")
    assert joints in said["scene"]
