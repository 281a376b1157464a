"""Dear tests: the list names tests that are there, and most functions of every file run in `.ci/run`."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest

from tests.costs import COLLECTED, entries, guards
from tests.paths import ROOT


def functions_of(path: Path) -> set[str]:
    """Return the names of a file's test functions."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef) and node.name[:4] == "test"}


def listed() -> dict[str, set[str]]:
    """Return what the list names, by file."""
    files = defaultdict[str, set[str]](set)
    for name in frozenset().union(*entries()):
        path, _, test = name.partition("::")
        files[path].add(test)
    return files


def test_listed_functions_are_there() -> None:
    absent = [path for path in listed() if not (ROOT / path).is_file()]
    stale = [
        f"{path}::{name}"
        for path, names in listed().items()
        if path not in absent
        for name in sorted(names)
        if name.split("[")[0] not in functions_of(ROOT / path)
    ]
    assert not absent
    assert not stale, "take these out of tests/dear.txt, or measure anew: python -m tests.costs"


def test_listed_cases_are_there(pytestconfig: pytest.Config) -> None:
    nodes = pytestconfig.stash[COLLECTED]
    whole = {node.split("::")[0] for node in nodes} - {
        one.split("::")[0] for one in pytestconfig.args if "::" in one
    }
    stale = {
        f"{path}::{name}"
        for path, names in listed().items()
        if path in whole
        for name in names
        if "[" in name and f"{path}::{name}" not in nodes
    }
    assert not stale, "take these out of tests/dear.txt, or measure anew: python -m tests.costs"


def test_what_is_spared_is_dear_and_no_guard_already() -> None:
    dear, spared = entries()
    assert {case.split("[")[0] for case in spared} <= dear
    assert not [case for case in sorted(spared) if guards(case)]


def test_of_each_file_half_of_the_functions_run_in_ci() -> None:
    spared = entries()[1]
    runs = {case.split("[")[0] for case in spared}
    thin = {}
    for path, names in listed().items():
        functions = functions_of(ROOT / path)
        absent = [
            name
            for name in names & functions
            if not (guards(f"{path}::{name}", spared) or f"{path}::{name}" in runs)
        ]
        if 2 * len(absent) > len(functions):
            thin[path] = sorted(absent)
    assert not thin, "spare the cheapest case of some: `+` in tests/dear.txt"
