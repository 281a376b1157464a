"""docs/howto/stones.md is true: its commands end as it says and print what it shows, and draw its pictures."""

import re
import shlex

import numpy as np
import pytest

from tests.moma.commands import invoke
from tests.paths import ROOT

PAGE = "docs/howto/stones.md"
IMAGES = {
    "stones-moved": "garden/moved",
    "stones-joints": "garden/joints",
    "stones-joints-3d": "garden/joints-3d",
    "stones-gaps": "narrow/joints",
    "stones-proposed": "proposed/joints",
}
"""Pictures of the page, and the files that its commands draw."""


def steps():
    """Each command of the page, and the lines that it shows below the last one of a block."""
    text = (ROOT / PAGE).read_text(encoding="utf-8")
    pieces = re.findall(r"^```(bash|text)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    for (language, block), (following, shown) in zip(pieces, [*pieces[1:], ("", "")], strict=True):
        if language == "bash":
            *earlier, last = block.splitlines()
            yield from ((one, []) for one in earlier)
            yield last, shown.splitlines() if following == "text" else []


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A folder in which the paths of the page exist, and in which its commands run."""
    (tmp_path / "docs/howto").mkdir(parents=True)
    for folder in ("survey", "stones"):
        (tmp_path / "docs/howto" / folder).symlink_to(ROOT / "docs/howto" / folder)
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MOMA_DB", raising=False)
    return tmp_path


def followed(*, whole):
    """Run the commands in their order; if not the whole of them, without pictures and without simulating."""
    for line, shown in steps():
        command = shlex.split(line)
        lines = shown
        if not whole:
            if command[1] == "run":
                return
            if "--pictures" in command:
                at = command.index("--pictures")
                del command[at : at + 2]
                lines = [one for one in shown if not one.startswith("  out/")]
        done = invoke(*command[1:])
        unsound = any(one.startswith("problem:") for one in done.stdout.splitlines())
        assert done.exit_code == int(unsound), (line, done.stderr)
        assert unsound == any(one.startswith("problem:") for one in shown), line
        said = done.stdout.splitlines()
        assert [one for one in lines if one not in said] == [], line


def test_there_are_commands_and_answers():
    found = list(steps())
    assert len(found) >= 10
    assert sum(bool(shown) for _, shown in found) >= 6


def test_the_commands_print_what_the_page_shows(place):
    followed(whole=False)


@pytest.mark.slow
@pytest.mark.draws
def test_all_commands_run_and_draw_the_pictures_of_the_page(place):
    from PIL import Image

    followed(whole=True)
    for name, source in IMAGES.items():
        shown = Image.open(ROOT / "docs/images" / f"{name}.png").convert("RGB")
        drawn = Image.open(place / "out" / f"{source}.png").convert("RGB").resize(shown.size)
        apart = np.abs(np.asarray(shown, dtype=float) - np.asarray(drawn, dtype=float))
        assert apart.mean() < 6.0, name  # other fonts and libraries draw a little otherwise


def test_the_scene_in_mortar_is_the_one_on_the_page():
    (shown,) = re.findall(
        r"^```toml\n(.*?)^```$", (ROOT / PAGE).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    scene = (ROOT / "docs/howto/stones/mortar.toml").read_text(encoding="utf-8").splitlines()
    assert [line for line in shown.splitlines() if line not in scene] == []
