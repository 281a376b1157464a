"""docs/howto/rib-vault.md is true: its commands run, and find what it says."""

import json
import re

import pytest

from tests.docs.pages import blocks, ran

pytestmark = pytest.mark.slow
PAGE = "docs/howto/rib-vault.md"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder in which the commands of the page have run, and what each has printed."""
    folder = tmp_path_factory.mktemp("ribvault")
    return folder, ran(folder, "".join(blocks(PAGE, "bash")))


def after(said, start):
    return next(text for line, text in said.items() if line.startswith(start))


def test_all_joints_close_and_the_vault_rests(place):
    folder, said = place
    (line,) = blocks(PAGE, "text")
    assert line in after(said, "moma check")
    summary = json.loads((folder / "out/ribvault-run/summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"] == "equilibrium"
    assert summary["errors"]["unconverged_steps"] == 0
    assert summary["reaction"]["total_vertical"] == pytest.approx(summary["reaction"]["weight"], rel=1e-6)
    assert (folder / "out/ribvault-run/pressure.png").is_file()


def test_the_queries_find_the_stones_of_a_web_and_of_a_rib(place):
    _, said = place
    found = {line: re.findall(r"^[A-Z][\w-]*", text, re.MULTILINE) for line, text in said.items()}
    on_ribs = after(found, 'moma query web_stone --where "member_of(N) and rests_on')
    # of each half the first stones; at the crown the beds are too steep to bear
    assert sorted(on_ribs) == sorted(f"N{k:02d}{half}-1" for k in range(1, 9) for half in "lr")
    crown = after(found, 'moma query web_stone --where "member_of(kind = web')
    assert {code[:3] for code in crown} == {"N09", "E09", "S09", "W09"}
    assert len(after(found, "moma query rib_segment")) == 2 * 8 + 3
    assert sorted(after(found, 'moma query entity --where "member_of(is_a(wall_rib))')) == ["FE-01", "FN-17"]
    assert after(found, "moma query boss") == ["B"]
    path = after(said, "moma load-path")
    assert re.search(r"\bR1-0\d\b", path)
    assert re.search(r"\bT1\b", path)


def test_the_range_of_the_thrust_holds_what_was_simulated(place):
    folder, _ = place
    (answer,) = json.loads((folder / "out/ribvault-assess/assessment.json").read_text(encoding="utf-8"))[
        "loads"
    ]
    assert answer["outcome"] == "limited"
    assert answer["least"] < answer["greatest"]
