"""Fixtures of tests of the documentation."""

import pytest

from tests.paths import ROOT
from tests.pipelines.scenes import small_geology

SCENE = "data/samples/window/window.toml"


@pytest.fixture
def place(tmp_path):
    """A folder in which the documentation's paths exist, with a scene that is quick to run."""
    sample = tmp_path / "data/samples/window"
    sample.mkdir(parents=True)
    (sample / "window.moma").symlink_to(ROOT / "data/samples/window/window.moma")
    (tmp_path / "docs/howto").mkdir(parents=True)
    for folder in ("survey", "query", "assess"):
        (tmp_path / "docs/howto" / folder).symlink_to(ROOT / "docs/howto" / folder)
    (sample / "knowledge.toml").symlink_to(ROOT / "data/samples/window/knowledge.toml")
    text = (ROOT / SCENE).read_text(encoding="utf-8")
    assert 'default = "deformable"' in text
    quick = text.replace('default = "deformable"', 'default = "rigid"').replace(
        "[materials", 'where = ["course <= 3"]\n\n[materials', 1
    )
    (sample / "window.toml").write_text(quick, encoding="utf-8")
    thrust = (ROOT / SCENE).with_name("thrust.toml").read_text(encoding="utf-8")
    rigid = thrust.replace('default = "deformable"', 'default = "rigid"')
    (sample / "thrust.toml").write_text(rigid, encoding="utf-8")
    small_geology(tmp_path / "data/samples/geology")
    return tmp_path
