"""The commands of the documentation run as they are written; the main job runs on rigid stones here."""

import importlib
import os
import re
import shlex
import subprocess
import sys

import pytest

from tests.docs.pages import blocks, printed
from tests.moma.commands import invoke
from tests.paths import ROOT

PAGES = (
    "README.md",
    pytest.param("docs/howto/first-run.md", marks=pytest.mark.draws),
    "docs/howto/survey.md",
)


def commands(page):
    """The moma commands of a page, in order."""
    lines = [line.strip() for block in blocks(page, "bash") for line in block.splitlines()]
    return [shlex.split(line, comments=True) for line in lines if line.startswith("moma ")]


def execute(arguments, folder):
    environment = {name: value for name, value in os.environ.items() if name != "MOMA_DB"}
    environment["PYTHONPATH"] = str(ROOT)
    return subprocess.run(arguments, cwd=folder, env=environment, capture_output=True, text=True, check=False)


@pytest.fixture
def here(place, monkeypatch):
    """The folder, in which commands run within this process."""
    monkeypatch.chdir(place)
    monkeypatch.delenv("MOMA_DB", raising=False)
    return place


@pytest.mark.parametrize("page", PAGES)
def test_the_commands_run_in_their_order(page, here):
    found = commands(page)
    assert found
    for command in found:
        done = invoke(*command[1:])
        assert done.exit_code == 0, (command, done.output)
        assert "error" not in done.stderr, (command, done.stderr)


def test_the_first_commands_run_as_processes(place):
    for command in commands("docs/howto/first-run.md")[:2]:
        done = execute([sys.executable, "-m", *command], place)
        assert done.returncode == 0, (command, done.stderr)
        assert "error" not in done.stderr, (command, done.stderr)


def test_the_python_of_the_readme_runs(place):
    (script,) = blocks("README.md", "python")
    assert printed(place, script).startswith("W03-")


@pytest.mark.slow
def test_the_python_of_the_how_to_on_rigid_blocks_prints_what_it_says(place):
    page = "docs/howto/rigid-blocks.md"
    said = "".join(blocks(page, "text")).splitlines()
    energy = said.pop(1)
    found = printed(place, "\n".join(blocks(page, "python"))).splitlines()
    assert float(found.pop(1).split()[-1]) < 1e-12, energy
    assert found == said


@pytest.mark.slow
def test_the_python_of_the_how_to_on_studies_prints_what_it_says(place):
    page = "docs/howto/python.md"
    assert printed(place, "\n".join(blocks(page, "python"))) == "".join(blocks(page, "text"))
    assert (place / "lintel.csv").read_text(encoding="utf-8").startswith("# time [s],x [m]")


def test_what_the_how_to_on_surveys_shows_is_what_the_files_and_commands_say(here):
    page = "docs/howto/survey.md"
    said = [
        path.read_text(encoding="utf-8") for path in (ROOT / "docs/howto/survey").iterdir() if path.is_file()
    ]
    shown_whole = [
        one for one in commands(page) if "data/samples/window/window.moma" in one or "--keep-going" in one
    ]
    said += [invoke(*command[1:]).stdout for command in shown_whole]
    said.append((here / "rejects.txt").read_text(encoding="utf-8"))
    known = set("\n".join(said).splitlines())
    shown = [line for block in blocks(page, "text") for line in block.splitlines()]
    assert len(shown) > 20
    assert [line for line in shown if line not in known] == []


@pytest.mark.parametrize("backend", ["sqlite", pytest.param("postgresql", marks=pytest.mark.slow)])
def test_the_questions_of_the_how_to_on_queries_have_the_answers_it_shows(
    here, backend, new_url, monkeypatch
):
    if backend == "postgresql":
        monkeypatch.setenv("MOMA_DB", new_url())
    page = "docs/howto/query.md"
    text = (ROOT / page).read_text(encoding="utf-8")
    pieces = re.findall(r"^```(bash|text|python)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    questions = 0
    for (language, block), (following, answer) in zip(pieces, [*pieces[1:], ("", "")], strict=True):
        for number, line in enumerate(block.splitlines() if language == "bash" else []):
            command = shlex.split(line)
            done = invoke(*command[1:])
            assert done.exit_code == 0, (command, done.output)
            shown = answer if following == "text" and number == 0 else ""
            if command[1] == "query" and "--format" not in command:
                assert done.stdout == shown, command  # the whole answer
            else:
                assert set(untimed(shown)) <= set(untimed(done.stdout)), command
            questions += command[1] not in ("ingest", "record", "run")
    assert questions >= 33
    if backend == "postgresql":
        return
    (script,) = blocks(page, "python")
    assert printed(here, script).split() == ["W10-03", "10", "W10-06", "10"]


def untimed(text):
    """Lines without the instants in them, which differ from day to day."""
    return re.sub(r"\d{4}-\d\d-\d\dT[:\d]+\+00:00", "", text).splitlines()


TEXTS = [
    *sorted(ROOT.glob("*.md")),
    *sorted((ROOT / "benchmarks").glob("*.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
]
OUTSIDE = {
    *("http://127.0.0.1:8000", "https://github.com/nschloe/meshio", "https://keepachangelog.com"),
    *("https://semver.org", "https://toml.io", "https://…"),
}
"""Addresses outside the project; whoever adds one opens it before."""


def anchors(page):
    """The names of the headings of a page, as GitHub and the site make them."""
    text = page.read_text(encoding="utf-8")
    for included in re.findall(r"^```\{include\} (\S+)$", text, re.MULTILINE):
        text += (page.parent / included).read_text(encoding="utf-8")
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def test_the_links_of_the_pages_lead_somewhere():
    for page in TEXTS:
        for link, anchor in re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", page.read_text(encoding="utf-8")):
            if "://" not in link:
                there = page.parent / link if link else page
                assert there.exists(), (page.name, link)
                assert not anchor or anchor in anchors(there), (page.name, link, anchor)


def test_the_addresses_outside_are_those_that_were_opened():
    found = {
        one
        for page in TEXTS
        for one in re.findall(r"https?://[^\s)`\"'>]+", page.read_text(encoding="utf-8"))
    }
    assert found == OUTSIDE


def test_the_design_pages_name_files_that_exist_and_all_stand_in_the_index():
    pages = sorted((ROOT / "docs/design").glob("[a-z]*.md"))
    index = (ROOT / "docs/design/README.md").read_text(encoding="utf-8")
    assert pages
    for page in pages:
        assert f"]({page.name})" in index, page.name
        for path in re.findall(r"`(\w+(?:/\w+)+(?:\.\w+)?)`", page.read_text(encoding="utf-8")):
            assert (ROOT / path).exists(), (page.name, path)


def test_tests_and_modules_that_pages_name_exist():
    """Names of tests may lack the first folders; files of changes of the past are not asked for."""
    named = 0
    for page in (*ROOT.glob("docs/**/*.md"), *ROOT.glob("benchmarks/*.md"), ROOT / "CONTRIBUTING.md"):
        text = page.read_text(encoding="utf-8")
        for path in re.findall(r"`((?:\w+/)*test_\w+\.py)`", text):
            named += 1
            assert (ROOT / path).exists() or any(ROOT.glob(f"tests/**/{path}")), (page.name, path)
        for module in re.findall(r"python -m ((?:archmodel|benchmarks|synthetic|tests)(?:\.\w+)*)", text):
            named += 1
            path = ROOT.joinpath(*module.split("."))
            assert path.with_suffix(".py").exists() or (path / "__main__.py").exists(), (page.name, module)
    assert named > 50


def test_things_are_made_where_the_page_on_rooms_says():
    page = (ROOT / "docs/design/packages-and-rooms.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| [^|]+ \| `([\w.]+)` \| `([\w/]+\.py)` \|", page, re.MULTILINE)
    assert len(rows) > 10
    for name, path in rows:
        place: object = importlib.import_module(path.removesuffix(".py").replace("/", "."))
        for part in name.split("."):
            place = getattr(place, part)


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="an archive of the project has no history")
def test_the_commits_that_tables_name_are_of_the_history():
    """Commits that were moved or joined later can be looked up by nobody."""

    def git(*arguments):
        done = subprocess.run(["git", *arguments], capture_output=True, text=True, cwd=ROOT, check=True)
        return done.stdout.split()

    if git("rev-parse", "--is-shallow-repository") == ["true"]:
        pytest.skip("the history was cut off")
    known = git("rev-list", "HEAD")
    pages = [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "benchmarks/README.md"]
    named = {
        (page.name, commit)
        for page in pages
        for commit in re.findall(r"\bcommits? ([0-9a-f]{7,40})\b", page.read_text(encoding="utf-8"))
    }
    assert len(named) > 10
    assert not {one for one in named if not any(commit.startswith(one[1]) for commit in known)}


def test_the_makefile_makes_what_the_readme_says():
    targets = set(re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    asked = {
        line.split()[1]
        for block in blocks("README.md", "bash")
        for line in block.splitlines()
        if "make " in line
    }
    assert asked <= targets
