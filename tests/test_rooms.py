"""The layout of the packages: rooms of a dozen entries, public names that exist, docstrings and kernels as agreed."""

import ast
import importlib
import re

import pytest

from tests.paths import ROOT

PACKAGES = ("moma", "survey", "archmodel", "mechanics", "pipelines")
FILES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
ROOMS = sorted({path.parent for path in FILES})

# a newcomer takes in a folder of this many entries at a glance
ENTRIES = 14
# arguments of a compiled function; more are grouped in a NamedTuple
ARGUMENTS = 8
QUESTIONS = ("What", "Which", "Where", "How", "Who", "Whose", "Whether", "When", "Why")
UNCOUNTED = ("__pycache__", "py.typed", "__init__.py")


def name(path):
    return str(path.relative_to(ROOT))


def documented(tree):
    """Modules, classes and functions of a file that have a docstring."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield getattr(node, "name", "module"), text


@pytest.mark.parametrize("room", ROOMS, ids=name)
def test_a_room_has_few_entries_and_says_what_it_is_for(room):
    # what is left of a room that has moved holds caches alone
    there = [entry for entry in room.iterdir() if entry.is_file() or any(entry.rglob("*.*[!cib]"))]
    entries = [entry.name for entry in there if entry.name not in UNCOUNTED]
    assert len(entries) <= ENTRIES, entries
    text = ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8")))
    assert text
    assert len(text.splitlines()[0]) <= 120


@pytest.mark.parametrize("room", ROOMS, ids=name)
def test_the_public_names_of_a_room_exist(room):
    tree = ast.parse((room / "__init__.py").read_text(encoding="utf-8"))
    text = ast.get_docstring(tree) or ""
    found = re.search(r"Public: (.*?)(?:\n\n|\Z)", text, re.DOTALL)
    if found is None:
        modules = [path for path in room.glob("*.py") if path.name[0] != "_"]
        states_its_own = any(isinstance(node, ast.Assign | ast.AnnAssign) for node in tree.body)
        assert not modules or states_its_own or room.name == "_kernels" or room.parent == ROOT
        return
    package = ".".join(room.relative_to(ROOT).parts)
    for group in " ".join(found[1].split()).rstrip(".").split("; "):
        parts = re.fullmatch(r"((?:`\w+`, )*`\w+`) \(([\w.]+)\)", group)
        assert parts, group
        module = importlib.import_module(f"{package}.{parts[2]}")
        assert set(re.findall(r"`(\w+)`", parts[1])) <= set(module.__all__), group


@pytest.mark.parametrize("path", FILES, ids=name)
def test_docstrings_do_not_open_with_a_question(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert [one for one, text in documented(tree) if text.split()[0] in QUESTIONS] == []


@pytest.mark.parametrize("path", [path for path in FILES if "_kernels" in str(path)], ids=name)
def test_compiled_functions_take_few_arguments(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    assert [one.name for one in functions if len(one.args.args) > ARGUMENTS] == []
