"""docs/howto/bay.md is true: a bay deforms within its rigid storey, and its stress is where the page says."""

import json

import pytest

from tests.docs.pages import blocks, ran
from tests.paths import ROOT

PAGE = "docs/howto/bay.md"
SCENE = (ROOT / "docs/howto/bay/bay.toml").read_text(encoding="utf-8")


def test_the_page_quotes_the_scene():
    (quoted,) = blocks(PAGE, "text")
    assert all(line in SCENE for line in quoted.splitlines())


@pytest.mark.slow
def test_the_bay_rests_with_every_step_solved_and_nothing_yields_that_was_not_asked_for(tmp_path):
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    said = ran(tmp_path, "".join(blocks(PAGE, "bash")))
    summary = json.loads((tmp_path / "out/storey-bay/summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"] == "equilibrium"
    assert summary["cautions"] == []
    assert summary["errors"]["unconverged_steps"] == 0
    assert summary["errors"]["reaction"] <= 1e-6
    check = next(text for line, text in said.items() if line.startswith("moma check"))
    assert "728 rigid, 159 deformable" in check
    found = next(text for line, text in said.items() if line.startswith("moma query"))
    assert "AO04-06" in found
    assert (tmp_path / "out/storey-bay/von_mises.png").is_file()
