"""moma warm-up compiles the listed kernels once, and says how many were there."""

import pytest

from ground.kernels import uses
from ground.kernels.uses import COMMANDS, OTHERS, KernelUse, all_kernels, kernels_of
from tests.moma.commands import answer, invoke


def test_all_kernels_are_those_of_every_list_each_once():
    found = [(use.module, use.name, repr(use.types)) for use in all_kernels()]
    assert len(set(found)) == len(found) == sum(len(kernels_of(name)) for name in (*COMMANDS, OTHERS))


@pytest.fixture
def two(monkeypatch):
    """Two kernels in place of all: one that is there, one of an older program."""
    there = min(all_kernels(), key=lambda use: len(use.types))
    gone = KernelUse(there.module, "gone", ())
    monkeypatch.setattr(uses, "all_kernels", lambda: (there, gone))


def test_warm_up_counts_kernels_and_names_those_that_are_gone(two):
    said = answer("warm-up")
    assert (said["kernels"], said["failed"]) == (2, 1)
    done = invoke("warm-up")
    assert done.exit_code == 0
    assert "gone: AttributeError" in done.stderr
    # the second time in a process, nothing is left to compile
    assert "2 kernels: 0 compiled now, 2 were there" in done.stdout
