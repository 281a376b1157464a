"""Dear tests: the list names tests that are there, and most functions of every file run in `.ci/run`."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest

from tests.costs import COLLECTED, entries, guards
from tests.paths import ROOT

MOST_ABSENT = 3
"""Functions of which no case takes at most 10 s."""


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


def absent() -> dict[str, list[str]]:
    """Return the functions of which no case runs in `.ci/run`, by file."""
    spared = entries()[1]
    runs = {case.split("[")[0] for case in spared}
    return {
        path: sorted(
            name
            for name in names & functions_of(ROOT / path)
            if not (guards(f"{path}::{name}", spared) or f"{path}::{name}" in runs)
        )
        for path, names in listed().items()
    }


def test_of_each_file_half_of_the_functions_run_in_ci() -> None:
    thin = {
        path: names for path, names in absent().items() if 2 * len(names) > len(functions_of(ROOT / path))
    }
    assert not thin, "spare the cheapest case of some: `+` in tests/dear.txt"


def test_functions_of_which_no_case_runs_in_ci_become_fewer() -> None:
    count = sum(map(len, absent().values()))
    assert count <= MOST_ABSENT, (
        "spare the cheapest case of new ones, `+` in tests/dear.txt, or make it cheaper"
    )
