"""Kinds in header files: words of five languages and abbreviations, and depths of kinds without a stone."""

from pathlib import Path

import pytest

from tests.moma.commands import answer, invoke

PLACES = ((0, 0), (0.5, 0), (0.5, 0.3), (0, 0.3))


def wall(at: Path, kinds: tuple[str, str], rules: str) -> list[object]:
    """Return the words that take in two stones, whose depths are stated in a header file."""
    rows = [
        f"{4 * n + k},{0.6 * n + x:.3f},{0.001 * k:.3f},{z:.3f},W{n} {kinds[n]} v"
        for n in (0, 1)
        for k, (x, z) in enumerate(PLACES)
    ]
    (at / "p.txt").write_text("\n".join(rows))
    (at / "head.moma").write_text(f"moma-survey 1\nobserver 1 -20 1\n{rules}\n", encoding="utf-8")
    options = ["--format", "penzd", "--codes", "{block} {kind} {role}", "--header", at / "head.moma"]
    return ["ingest", at / "p.txt", *options, "--db", f"sqlite:///{at}/a.db"]


@pytest.mark.parametrize(
    ("kinds", "binder", "more"),
    [
        (("Binder", "Läufer"), "Binder", []),
        (("boutisse", "panneresse"), "header", []),
        (("B", "L"), "B", ["--kinds", "B=header,L=stretcher"]),
    ],
)
def test_depths_are_of_kinds_in_any_language(
    tmp_path: Path, kinds: tuple[str, str], binder: str, more: list[str]
):
    rules = f"depth {binder} 0.55 source broken end\ndepth * 0.38 source jamb of the door"
    done = invoke(*wall(tmp_path, kinds, rules), *more)
    assert done.exit_code == 0, done.output
    assert "without a stone" not in done.output
    rows = answer("query", "entity", "--columns", "code,depth", "--db", f"sqlite:///{tmp_path}/a.db")
    assert {row["code"]: row["depth"] for row in rows} == {"W0": 0.55, "W1": 0.38}


def test_a_depth_of_a_kind_without_a_stone_is_told(tmp_path: Path):
    rules = "depth springer 0.55 source broken end\ndepth * 0.38 source jamb of the door"
    done = invoke(*wall(tmp_path, ("header", "stretcher"), rules))
    assert (
        "depths are stated for kinds without a stone: springer (line 3); kinds are header, stretcher"
        in done.output
    )
