"""Orders of building: those of the arch differ in their forces, and the published table has a row for each order."""

import pytest

from benchmarks.stages import CASES, rows
from tests.paths import ROOT


@pytest.fixture(scope="module")
def arch(tmp_path_factory):
    """Rows of the arch with springs, whose forces are unique."""
    found = rows(("arch",), tmp_path_factory.mktemp("arch"))
    return [next(found) for _ in CASES["arch"].orders]


def test_the_order_of_stages_decides_on_the_thrust(arch):
    assert all(one["outcome"].startswith("equilibrium") for one in arch)
    assert max(one["reaction_error"] for one in arch) < 1e-6
    at_once, struck, later = (one["thrust"] for one in arch)
    assert struck < 0.98 * later < 0.99 * at_once
    assert [one["joints_differ"] > 0.03 for one in arch] == [False, True, True]


def test_the_published_table_is_that_of_the_program(arch):
    text = (ROOT / "docs/accuracy.md").read_text(encoding="utf-8")
    for one in arch:
        row = (
            f"| arch, springs | {one['order']} | {one['thrust'] / 1e3:.2f} | {100 * one['supports']:.1f} % |"
        )
        assert row in text
