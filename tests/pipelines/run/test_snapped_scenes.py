"""From a rounded file of solids to equilibrium: folded stones of a dome, and groin stones with an arm in two vaults."""

from pathlib import Path

import pytest

from mechanics.stones.polyhedra import mass_properties
from pipelines.ingest.ingest import ingest
from pipelines.ingest.kind_rules import kind_rules
from pipelines.ingest.reading_options import solid_options
from pipelines.run.run import run_scene
from survey.formats.options import ReadingOptions
from survey.geometry.solids import Solid
from tests.pipelines.scenes import assembled
from tests.survey.joints.assemblies import dome, groin, obj

SCENE = """
[scene]
name = "Vault"
[materials.limestone]
density = 2000.0
young = 12e9
poisson = 0.2
[bodies]
default = "rigid"
fixed = ["kind = support"]
[joints]
mode = "as-surveyed"
[contact]
friction = 0.8
[time]
step = 0.01
duration = 0.2
start = "equilibrium"
relaxation = true
[output]
pictures = []
"""


def taken_in(folder: Path, solids: list[Solid], support: str) -> str:
    (folder / "vault.obj").write_text(obj(solids, 3, doubled=True))
    (folder / "vault.toml").write_text(SCENE)
    url = f"sqlite:///{folder / 'vault.db'}"
    rules = kind_rules(supports=[support])
    ingest(
        [folder / "vault.obj"],
        url,
        "solids",
        options=solid_options(ReadingOptions(), snap=0.003),
        rules=rules,
    )
    return url


def test_a_dome_rounded_to_a_millimetre_stands_and_moves_by_nothing(tmp_path: Path) -> None:
    url = taken_in(tmp_path, dome(2, 8), "z < 0.6")
    blocks = assembled(url, SCENE).scene.blocks
    assert all(len(block.parts) == 2 for block in blocks)
    summary = run_scene(tmp_path / "vault.toml", url, tmp_path / "out").summary
    assert summary["bodies"] == {"rigid": 8, "deformable": 0, "fixed": 8}
    assert summary["outcome"] == "equilibrium"
    assert (
        summary["displacement"]["max"] < 1e-6
    )  # a millimetre of misfit would move stones by a good part of that
    true = [mass_properties(one.vertices, one.faces).volume for one in _folded(dome(2, 8))]
    weight = 2000.0 * 9.81 * sum(true[8:])
    assert summary["reaction"]["weight"] == pytest.approx(weight, rel=1e-3)
    assert summary["reaction"]["total_vertical"] == pytest.approx(weight, rel=1e-3)


def test_groin_stones_rest_on_each_other_with_both_arms(tmp_path: Path) -> None:
    """Beds slant by at most 0.1 rad: steeper, the outer stones tip, and only self-stress could hold them."""
    stones = groin(2, (0.0, 0.1))
    url = taken_in(tmp_path, stones, "code like '%0'")
    blocks = assembled(url, SCENE).scene.blocks
    assert {block.code: len(block.parts) for block in blocks} == {
        **dict.fromkeys(("G0", "G1"), 2),
        **dict.fromkeys(("A0", "A1", "B0", "B1"), 0),
    }
    summary = run_scene(tmp_path / "vault.toml", url, tmp_path / "out").summary
    assert summary["outcome"] == "equilibrium"
    assert summary["displacement"]["max"] < 1e-6
    weight = 2000.0 * 9.81 * sum(mass_properties(one.vertices, one.faces).volume for one in stones[3:])
    # corners are rounded to a millimetre
    assert summary["reaction"]["total_vertical"] == pytest.approx(weight, rel=2e-3)


def _folded(solids: list[Solid]) -> list[Solid]:
    """Both hexagons of each stone in two trapezoids, along the meridian."""
    out = []
    for one in solids:
        first, second, *sides = one.faces
        halves = [half for face in (first, second) for half in _halves(one, face)]
        out.append(Solid(one.code, one.vertices, (*halves, *sides)))
    return out


def _halves(one: Solid, face: tuple[int, ...]) -> list[tuple[int, ...]]:
    k = next(
        k for k, i in enumerate(face) if i % 6 == 1
    )  # the middle of the lower side, then of the upper one
    turned = face[k:] + face[:k]
    assert turned[3] % 6 == 4
    return [turned[:4], (*turned[3:], turned[0])]
