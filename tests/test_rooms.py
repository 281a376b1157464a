"""The layout of the packages: rooms of a dozen entries, public names that exist, docstrings and kernels as agreed."""

import ast
import re

from tests.paths import ROOT

PACKAGES = ("ground", "moma", "survey", "archmodel", "mechanics", "pipelines")
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


def tree_of(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def documented(tree):
    """Modules, classes and functions of a file that have a docstring."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield getattr(node, "name", "module"), text


def test_rooms_have_few_entries_and_say_what_they_are_for():
    crowded, unexplained = {}, []
    for room in ROOMS:
        # what is left of a room that has moved holds caches alone
        there = [entry for entry in room.iterdir() if entry.is_file() or any(entry.rglob("*.*[!cib]"))]
        entries = [entry.name for entry in there if entry.name not in UNCOUNTED]
        if len(entries) > ENTRIES:
            crowded[name(room)] = entries
        text = ast.get_docstring(tree_of(room / "__init__.py"))
        if not text or len(text.splitlines()[0]) > 120:
            unexplained.append(name(room))
    assert not crowded
    assert not unexplained


def test_the_public_names_of_rooms_exist():
    wrong = {name(room): said for room in ROOMS if (said := wrong_names(room))}
    assert not wrong


def wrong_names(room):
    """Return what is wrong with the list of public names of a room; an empty list where nothing is."""
    tree = tree_of(room / "__init__.py")
    found = re.search(r"Public: (.*?)(?:\n\n|\Z)", ast.get_docstring(tree) or "", re.DOTALL)
    if found is None:
        modules = [path for path in room.glob("*.py") if path.name[0] != "_"]
        states_its_own = any(isinstance(node, ast.Assign | ast.AnnAssign) for node in tree.body)
        scripts = room.name == "versions"  # which Alembic runs
        exempt = states_its_own or scripts or room.name == "_kernels" or room.parent == ROOT
        return ["names none"] if modules and not exempt else []
    wrong = []
    for group in " ".join(found[1].split()).rstrip(".").split("; "):
        parts = re.fullmatch(r"((?:`\w+`, )*`\w+`) \(([\w.]+)\)", group)
        if parts is None:
            wrong.append(group)
            continue
        defined = assigned(tree_of(room.joinpath(*parts[2].split(".")).with_suffix(".py")))
        wrong += [
            one for one in re.findall(r"`(\w+)`", parts[1]) if one.startswith("_") or one not in defined
        ]
    return wrong


def assigned(tree):
    """Return the names that a module itself defines: functions, classes, values."""
    nodes = [
        node for node in ast.walk(tree) if not isinstance(node, ast.Name) or isinstance(node.ctx, ast.Store)
    ]
    return {
        getattr(node, "name", getattr(node, "id", None)) for node in nodes if not isinstance(node, ast.alias)
    }


def test_docstrings_do_not_open_with_a_question():
    asking = [
        (name(path), one)
        for path in FILES
        for one, text in documented(tree_of(path))
        if text.split()[0] in QUESTIONS
    ]
    assert not asking


def test_compiled_functions_take_few_arguments():
    kernels = [path for path in FILES if "_kernels" in str(path)]
    assert kernels
    wide = [
        (name(path), node.name)
        for path in kernels
        for node in ast.walk(tree_of(path))
        if isinstance(node, ast.FunctionDef) and len(node.args.args) > ARGUMENTS
    ]
    assert not wide
