"""Samples that are shipped are what the generators write."""

import ast
from zipfile import ZipFile

import numpy as np
import pytest

from ground.errors import UsageError
from pipelines.samples.copy import FOLDER, SHIPPED, copy_sample, sample_names
from synthetic.__main__ import LARGE, NAMES, contents, written
from synthetic.samples import SAMPLES
from tests.paths import ROOT

QUICK = ("arch", "block", "corner", "wall", "granite-wall")
DEAR = [name for name in NAMES if name not in QUICK and "--moved" not in name]
MOST = 4e6  # bytes of all archives


def test_all_samples_are_shipped_but_the_large_ones():
    assert sample_names() == NAMES
    assert {name for name in SAMPLES if name not in NAMES} == set(LARGE)
    archives = {path.name for path in SHIPPED.glob("*.zip")}
    assert len(archives) == len(NAMES)
    assert sum(path.stat().st_size for path in SHIPPED.iterdir()) < MOST


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in DEAR)])
def test_a_shipped_sample_is_the_output_of_its_generator(name, tmp_path):
    sample, files = contents(name)
    kind, *options = name.split()
    copied = copy_sample(kind, tmp_path, **{option[2:]: True for option in options})
    assert (copied.title, copied.stones, copied.synthetic) == (sample.title, sample.stones, sample.synthetic)
    assert copied.commands == tuple(one.replace(FOLDER, str(tmp_path)) for one in sample.commands)
    assert copied.files == tuple(str(tmp_path / path) for path in files)
    for path, content in files.items():
        if path.endswith(".toml"):
            content = content.replace(FOLDER.encode(), str(tmp_path).encode())
        assert (tmp_path / path).read_bytes() == content, path


def test_no_folder_of_this_machine_is_shipped():
    for path in SHIPPED.glob("*.zip"):
        with ZipFile(path) as archive:
            for name in archive.namelist():
                assert b"/tmp" not in archive.read(name) or name.endswith((".laz", ".png"))


def test_a_copy_stays_whole_where_its_folder_has_one_of_its_files(tmp_path):
    (tmp_path / "truth.json").write_text("mine")
    with pytest.raises(UsageError, match=r"truth\.json exists; name another folder"):
        copy_sample("block", tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["truth.json"]


def test_a_tower_has_as_many_courses_as_are_asked_for(tmp_path):
    sample = written(["tower", "--courses", "5", "--out", str(tmp_path)])
    assert sample.title == "Storey of a tower, of 5 courses"
    survey = (tmp_path / "tower.moma").read_text(encoding="utf-8")
    courses = [line.split(" course ")[1].split()[0] for line in survey.splitlines() if " course " in line]
    assert np.array_equal(np.unique(np.array(courses, dtype=int)), np.arange(1, 6))
    for options, said in (
        (["wall", "--courses", "3"], "it is for the tower"),
        (["tower", "--courses", "1"], "at least 2"),
    ):
        with pytest.raises(UsageError, match=said):
            written([*options, "--out", str(tmp_path / "none")])


def test_packages_do_not_need_the_generators():
    packages = ("ground", "moma", "survey", "archmodel", "mechanics", "pipelines")
    for path in (path for package in packages for path in (ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            assert not {name.split(".")[0] for name in names} & {"synthetic", "tests"}, path
