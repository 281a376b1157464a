"""docs/howto/mask.md is true: its commands run and print what it shows."""

import csv
import re
import shlex

import pytest

from tests.docs.pages import blocks
from tests.moma.commands import prints

PAGE = "docs/howto/mask.md"


COARSE = (
    ("to = [0.01]     # m", "to = [0.002]\nstep = 1e-3"),
    ("to = [0.03]", "to = [0.003]\nstep = 1e-3"),
)


def said_in(folder, coarse):
    """Return what each command of the page prints, the last where one stands twice; nothing of a check is drawn."""
    out = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.delenv("MOMA_DB", raising=False)
        for line in (line for block in blocks(PAGE, "bash") for line in block.splitlines()):
            command = shlex.split(line)[1:]
            if "--pictures" in command:
                at = command.index("--pictures")
                del command[at : at + 2]
            if coarse and command[0] == "pushover":
                scene = folder / command[1]
                text = scene.read_text(encoding="utf-8")
                for old, new in COARSE:
                    text = text.replace(old, new)
                scene.write_text(text, encoding="utf-8")
            out[" ".join(command[:2])] = out[command[0]] = prints(*command)
        with (folder / "out/rubble/review.csv").open(encoding="utf-8") as file:
            out["review"] = list(csv.reader(file))
        out["scene"] = (folder / "out/rubble/rubble-wall.toml").read_text(encoding="utf-8")
    return out


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """What the commands print, the tests in a few long steps."""
    return said_in(tmp_path_factory.mktemp("mask"), coarse=True)


def test_the_commands_say_what_the_page_shows(said):
    assert "40 stones of survey 'wall' (40 rubble)" in said["ingest --masks"]
    assert said["review"] == [["code", "reason", "text", "where"]]
    shown = next(block for block in blocks(PAGE, "text") if "leaf of" in block)
    assert not [line for line in shown.splitlines() if line not in said["check"]]


def test_the_tables_of_the_page_are_those_of_the_sample(said):
    joints, laws = blocks(PAGE, "toml")
    assert joints in said["scene"]
    assert laws in said["scene"]
    assert "measured forwards 36.8 kN" in said["pushover"]


@pytest.mark.slow
def test_the_wall_bears_what_the_page_shows(tmp_path):
    said = said_in(tmp_path, coarse=False)
    shown = next(block for block in blocks(PAGE, "text") if "bears" in block)
    assert shown.splitlines()[0].split(" kN")[0] in said["pushover out/rubble/rubble-wall.toml"]
    (ratio,) = re.findall(r"predicted over it ([0-9.]+)", said["pushover"])
    assert float(ratio) == pytest.approx(34.3 / 36.8, abs=0.02)  # 34.3 kN of the page, of its last point
