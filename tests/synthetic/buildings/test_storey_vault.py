"""The rib vault of a storey: clear of walls and openings, borne by corbels in their corners, with joints that close."""

import numpy as np
import pytest

from survey.geometry.solids import area_vector
from survey.geometry.watertight import check_watertight
from survey.joints.close import close_joints
from synthetic.buildings.storey_vault import STANDING
from synthetic.buildings.storey_walls import THICKNESS
from synthetic.buildings.tower import TowerStorey, tower_storey
from tests.survey.unseen.statics import near_pairs, overlap_depth

CORBELS = {"T3": "AI08-K1", "T2": "AI08-K2"}
VAULT = {"boss", "rib_segment", "rib_springer", "web_stone"}


@pytest.fixture(scope="module")
def storey() -> TowerStorey:
    return tower_storey(17, seed=3, elaborate=True)


@pytest.fixture(scope="module")
def touching(storey: TowerStorey) -> dict[frozenset[str], np.ndarray]:
    """Area times normal of the true joint of each pair of stones [m²]."""
    out: dict[frozenset[str], np.ndarray] = {}
    for joint in storey.building.joints:
        pair = frozenset(joint.stones)
        out[pair] = out.get(pair, np.zeros(3)) + joint.area * np.abs(joint.normal)
    return out


def kinds_of(storey: TowerStorey) -> dict[str, str]:
    building = storey.building
    return {one.code: one.kind for one in (*building.survey.blocks, *building.modelled)}


def beside(touching, code):
    return {other: area for pair, area in touching.items() if code in pair for other in pair - {code}}


def test_low_storeys_and_plain_ones_have_none() -> None:
    for low in (tower_storey(16, elaborate=True), tower_storey(17)):
        assert low.vault is None
        assert not {"corbel", *VAULT} & set(kinds_of(low).values())


def test_no_stones_overlap(storey: TowerStorey) -> None:
    kinds = kinds_of(storey)
    solids = storey.building.solids
    # one side of the vault stands for all, see test_ribs.py
    own = {solid.code for solid in solids if solid.code[0] in "TS" or solid.code[:2] in ("FS", "R2", "R3")}
    own |= set(CORBELS.values())
    assert {kinds[code] for code in own} == {"corbel", *VAULT} - {"boss"}
    for code in own:
        check_watertight(next(one for one in solids if one.code == code), convex=True)
    pairs = [(i, j) for i, j in near_pairs(solids) if own & {solids[i].code, solids[j].code}]
    assert max(overlap_depth(solids[i], solids[j]) for i, j in pairs) < 1e-9


def test_springers_stand_on_corbels_and_lean_against_both_walls(storey: TowerStorey, touching) -> None:
    kinds = kinds_of(storey)
    for springer, corbel in CORBELS.items():
        near = beside(touching, springer)
        (solid,) = (one for one in storey.building.solids if one.code == springer)
        foot = min(solid.faces, key=lambda face: solid.vertices[list(face), 2].max())
        assert near[corbel] == pytest.approx(np.abs(area_vector(solid.vertices[list(foot)])), abs=1e-9)
        for letter in ("A", "B" if springer == "T3" else "C"):
            out = np.abs(storey.outward[letter])
            leaning = [
                area for other, area in near.items() if other.startswith(f"{letter}I") and other != corbel
            ]
            assert all(area == pytest.approx(area @ out * out, abs=1e-9) for area in leaning)
            assert sum(float(np.linalg.norm(area)) for area in leaning) > 0.4
    for springer in STANDING:
        assert not any(
            area[2] > 1e-9 for other, area in beside(touching, springer).items() if kinds[other] not in VAULT
        )
        assert springer in storey.building.base


def test_corbels_are_built_into_the_corners(storey: TowerStorey, touching) -> None:
    """Their tails lie on the stone that goes through the corner below, and under that of the course above."""
    solids = {one.code: one for one in storey.building.solids}
    depths = {record.code: record.depth for record in storey.building.survey.blocks}
    for corbel in CORBELS.values():
        near = beside(touching, corbel)
        tail = (0.5 * THICKNESS) ** 2
        middle = solids[corbel].vertices[:, 2].mean()
        bonders = [
            (other, area[2])
            for other, area in near.items()
            if depths.get(other) is not None and area[2] == pytest.approx(tail, abs=1e-9)
        ]
        assert sorted(solids[other].vertices[:, 2].mean() > middle for other, _ in bonders) == [False, True]
        # quoins of both walls close the corner behind it
        behind = [other for other, area in near.items() if other[1] == "O" and area[2] < 1e-9]
        assert len({other[0] for other in behind}) == 2


def test_webs_and_wall_ribs_stand_clear_of_walls_and_openings(storey: TowerStorey, touching) -> None:
    kinds, solids = kinds_of(storey), storey.building.solids
    for pair in touching:
        own = {code for code in pair if kinds[code] in VAULT}
        assert own in (set(), pair) or kinds[min(own)] == "rib_springer", pair
    walls = [one for one in solids if one.code[1:2] == "I" and kinds[one.code] not in {"corbel", *VAULT}]
    for web, letter in (("S", "A"), ("W", "B"), ("E", "C")):
        out = storey.outward[letter]
        ribs = [one for one in solids if one.code.startswith(f"F{web}-")]
        face = min((one.vertices @ out).min() for one in walls if one.code[0] == letter)
        # stones of the wall stand out by some millimetres
        assert face - max((one.vertices @ out).max() for one in ribs) == pytest.approx(0.055, abs=0.005)
        along = np.cross(out, [0.0, 0.0, 1.0])
        for arch in (one for one in walls if one.code.startswith(f"{letter}I-V")):
            intrados = arch.vertices[:2]
            left, right = np.sort(intrados @ along)
            over = [
                one for one in ribs if max(one.vertices @ along) > left and min(one.vertices @ along) < right
            ]
            assert over
            assert intrados[:, 2].max() < min(one.vertices[:, 2].min() for one in over)


def test_all_its_joints_close_in_the_storey(storey: TowerStorey, touching) -> None:
    kinds, blocks = kinds_of(storey), storey.building.blocks()
    own = {code for code, kind in kinds.items() if kind in {"corbel", *VAULT}}
    report = close_joints(blocks).report
    assert not [gap for gap in report.gaps if own & set(gap.stones)]
    assert not report.overlaps
    found = {frozenset(joint.stones) for joint in report.joints if own & set(joint.stones)}
    true = {pair: float(np.linalg.norm(area)) for pair, area in touching.items() if pair & own}
    assert len(true) > 600
    # strips of a few square centimetres are lost
    assert {pair for pair, area in true.items() if area > 5e-3} <= found <= set(true)
