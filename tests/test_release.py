"""One version, licence and list of keywords in all files that state them."""

import json
import os
import re
import tomllib

import pytest

from moma.cli import app
from tests.paths import ROOT


def test_citation_and_deposit_state_the_version_and_the_licence_of_the_package():
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)["project"]
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    deposit = json.loads((ROOT / ".zenodo.json").read_text(encoding="utf-8"))
    assert (
        re.search(r"^version: (.*)$", citation, re.MULTILINE)[1] == project["version"] == deposit["version"]
    )
    assert (
        re.search(r"^license: (.*)$", citation, re.MULTILINE)[1] == project["license"] == deposit["license"]
    )
    words = re.findall(r"^  - (?!name)(.*)$", citation, re.MULTILINE)
    assert words == deposit["keywords"]
    assert set(words) <= set(project["keywords"])


def test_the_readme_says_under_which_licence_gmsh_comes():
    assert "GPL-2.0-or-later" in (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_changelog_has_a_part_for_what_is_to_come_and_later_parts_have_versions():
    parts = re.findall(r"^## \[(.*?)\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert parts[0] == "Unreleased"
    assert all(re.fullmatch(r"\d+\.\d+\.\d+", version) for version in parts[1:])
    with (ROOT / "pyproject.toml").open("rb") as file:
        version = tomllib.load(file)["project"]["version"]
    # the version in the making is the latest that the changelog has, or none was released yet
    assert not parts[1:] or parts[1] == version


def test_the_packages_that_were_asked_for_stand_in_the_base():
    with (ROOT / "pyproject.toml").open("rb") as file:
        needed = tomllib.load(file)["project"]["dependencies"]
    names = {re.split(r"[<>=~ ]", one)[0] for one in needed}
    assert {"gmsh", "meshio", "pyvista", "numpy", "scipy", "numba", "sqlalchemy"} <= names


WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.stem)
def test_jobs_use_pinned_actions_and_no_addresses(path):
    text = path.read_text(encoding="utf-8")
    used = re.findall(r"uses: (.*)", text)
    assert used
    # commits of tags of the actions' own repositories
    assert set(used) <= {
        "actions/checkout@3d3c42e5aac5ba805825da76410c181273ba90b1 # v7.0.1",
        "actions/setup-python@5fda3b95a4ea91299a34e894583c3862153e4b97 # v7.0.0",
        "actions/upload-artifact@bbbca2ddaa5d8feaa63e36b76fdaad77386f024f # v7.0.0",
    }
    assert "://" not in text.replace("sqlite:///", "")


def test_the_main_job_runs_on_windows_and_macos_and_wheels_are_built_for_each_python():
    checks = (ROOT / ".github/workflows/checks.yml").read_text(encoding="utf-8")
    assert "windows-2022" in checks
    assert "macos-15" in checks
    assert ".ci/main-job" in checks
    with (ROOT / "pyproject.toml").open("rb") as file:
        project = tomllib.load(file)
    assert project["tool"]["cibuildwheel"]["build"] == [f"cp3{minor}-*" for minor in (11, 12, 13, 14)]


def test_every_script_target_and_command_of_the_jobs_is_there():
    text = "".join(path.read_text(encoding="utf-8") for path in WORKFLOWS)
    scripts, targets, commands = (
        set(re.findall(rf"(?<![\w/]){start}", text))
        for start in (r"(\.ci/[\w-]+)", r"make (\w+)", r"moma ([\w-]+)")
    )
    assert scripts == {".ci/run", ".ci/main-job"}
    assert all(os.access(ROOT / one, os.X_OK) for one in scripts)
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    assert targets == {"site"} <= set(re.findall(r"^(\w+):", makefile, re.MULTILINE))
    assert commands == {"warm-up", "trade", "export"}
    assert commands <= {one.name for one in app.registered_commands}
