"""One version, licence and list of keywords in all files that state them."""

import json
import re
import tomllib

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
