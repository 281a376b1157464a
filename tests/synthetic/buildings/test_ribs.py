"""The rib vault: convex stones without gaps, webs that rest on seats square to their thrust, a survey that closes."""

import math
from itertools import pairwise

import numpy as np
import pytest

from ground.errors import GeometryError
from survey.geometry.solids import planes_of_solid
from survey.geometry.watertight import check_watertight
from survey.joints.close import close_joints
from synthetic.buildings.ribs import RibVaultShape, SyntheticRibVault, rib_vault
from tests.survey.unseen.statics import near_pairs, overlap_depth


@pytest.fixture(scope="module")
def vault() -> SyntheticRibVault:
    return rib_vault()


def test_stones_are_convex_and_do_not_overlap(vault: SyntheticRibVault) -> None:
    solids = vault.building.solids
    for solid in solids:
        check_watertight(solid, convex=True)
    # eight-fold symmetry: one rib and the stones beside it stand for all
    some = [one for one in solids if one.code[0] in "NE" or one.code[:2] in ("T1", "R1", "B")]
    assert max(overlap_depth(some[i], some[j]) for i, j in near_pairs(some)) < 1e-9


def test_each_course_ends_on_a_seat_in_the_plane_of_its_bed(vault: SyntheticRibVault) -> None:
    """The first stone of a half course rests on the segment below, or on the springer, square to its thrust."""
    joints = {frozenset(joint.stones): joint for joint in vault.building.joints}
    for web, right, left in (("N", 1, 4), ("E", 2, 1), ("S", 3, 2), ("W", 4, 3)):
        for course, bed in enumerate(vault.shape.beds()[:-1], start=1):
            for half, rib in (("r", right), ("l", left)):
                below = f"T{rib}" if course == 1 else f"R{rib}-{course - 1:02d}"
                codes = [
                    code
                    for pair in joints
                    if below in pair
                    for code in pair - {below}
                    if code.startswith(f"{web}{course:02d}{half}")
                ]
                seats = [joints[frozenset((below, code))] for code in codes]
                assert seats, (web, course, half)
                for seat in seats:
                    assert abs(seat.normal[2]) == pytest.approx(-bed.along[2], abs=1e-12)


def test_bed_joint_of_the_rib_and_end_of_the_course_meet_in_one_line() -> None:
    """The line in which bed and joint meet is upright over the end of the course, and square to the web."""
    for bed in RibVaultShape().beds():
        line = np.cross(bed.along, bed.joint)
        assert line / np.linalg.norm(line) == pytest.approx(bed.up * np.sign(line @ bed.up), abs=1e-12)


def test_ribs_have_an_axis_of_their_own(vault: SyntheticRibVault) -> None:
    """An arc of a circle in an upright plane, which runs inside the segments."""
    shape = vault.shape
    for rib in range(1, 5):
        axis = vault.rib_axis(rib, 101)
        radius = shape.radius - shape.drop + 0.5 * shape.height
        assert np.linalg.norm(axis - vault.foot, axis=1) == pytest.approx(np.full(101, radius), abs=1e-12)
        flat = axis[:, :2] - vault.foot[:2]
        assert np.linalg.matrix_rank(flat, tol=1e-9) == 1
        planes = [planes_of_solid(one) for one in vault.building.solids if one.code.startswith(f"R{rib}-")]
        for place in axis[1:-1]:
            # the arc between two joints rises a centimetre above its chord, in a section of 0.34 m
            assert any((one[:, :3] @ place <= one[:, 3] + 1e-9).all() for one in planes)


@pytest.mark.parametrize(("seed", "wall_rib"), [(1, 0.0), (2, 0.0), (1, 0.22)])
def test_all_joints_of_the_survey_close(seed: int, wall_rib: float) -> None:
    vault = rib_vault(RibVaultShape(wall_rib=wall_rib), seed)
    closed = close_joints(vault.building.blocks())
    true: dict[frozenset[str], float] = {}
    found: dict[frozenset[str], float] = {}
    for joint in vault.building.joints:
        true[frozenset(joint.stones)] = true.get(frozenset(joint.stones), 0.0) + joint.area
    for link in closed.report.joints:
        found[frozenset(link.stones)] = found.get(frozenset(link.stones), 0.0) + link.area
    assert closed.report.gaps == ()
    assert closed.report.overlaps == ()
    assert found.keys() == true.keys()
    assert sum(found.values()) == pytest.approx(sum(true.values()), rel=0.015)
    between = [
        pair for pair in true if len({code[0] in "RTB" for code in pair}) == 2 and "F" not in "".join(pair)
    ]
    # of each web: seats under two halves and the crown, ends beside the segments and the boss
    assert len(between) == 4 * (2 * (2 * vault.shape.segments + 1) + 1)
    assert sum(found[pair] for pair in between) == pytest.approx(
        sum(true[pair] for pair in between), rel=0.04
    )


def test_wall_ribs_are_arches_from_springer_to_springer_beside_the_webs() -> None:
    shape = RibVaultShape(wall_rib=0.22)
    vault = rib_vault(shape)
    solids = {one.code: one for one in vault.building.solids}
    joints = {frozenset(joint.stones): joint for joint in vault.building.joints}
    section = shape.wall_rib * (shape.thickness + shape.wall_drop)
    count = 2 * shape.segments + 1
    for web, left, right in (("N", 4, 1), ("E", 1, 2), ("S", 2, 3), ("W", 3, 4)):
        row = [f"T{left}", *(f"F{web}-{k:02d}" for k in range(1, count + 1)), f"T{right}"]
        for pair in pairwise(row):
            # square to the web's slope at the bed, so a little more than square to a chord
            assert joints[frozenset(pair)].area == pytest.approx(section, rel=0.01), pair
        for number, code in enumerate(row[1:-1], start=1):
            check_watertight(solids[code], convex=True)
            beside = {other for pair in joints if code in pair for other in pair - {code}} - set(row)
            course = min(number, count + 1 - number)
            half = "" if number == shape.segments + 1 else "lr"[number > shape.segments]
            # only stones of its own web and course, whose ends it meets
            assert beside, code
            assert all(other.startswith(f"{web}{course:02d}{half}-") for other in beside), code
            own, stone = solids[code].vertices, solids[min(beside)].vertices
            assert own[:, 2].min() < stone[:, 2].min() - 0.5 * shape.wall_drop or number != shape.segments + 1
    some = [one for one in solids.values() if one.code[:2] in ("FN", "T1", "T4") or one.code[0] == "N"]
    assert max(overlap_depth(some[i], some[j]) for i, j in near_pairs(some)) < 1e-9


def test_shapes_whose_stones_would_lie_in_each_other_are_refused() -> None:
    with pytest.raises(GeometryError, match=r"webs 0\.3 m thick meet behind ribs 0\.26 m wide"):
        rib_vault(RibVaultShape(thickness=0.3))
    with pytest.raises(GeometryError, match=r"ends 1\.86 m from the axis, the wall is at 2 m"):
        rib_vault(RibVaultShape(springing=math.radians(62.0), thickness=0.1))
    with pytest.raises(GeometryError, match=r"ends 1\.62 m from the axis, the wall rib is at 1\.75 m"):
        rib_vault(RibVaultShape(wall_rib=0.25))


def test_a_vault_is_the_same_for_the_same_seed(vault: SyntheticRibVault) -> None:
    again, other = rib_vault(), rib_vault(seed=2)
    for a, b in zip(vault.building.modelled, again.building.modelled, strict=True):
        np.testing.assert_array_equal(a.vertices, b.vertices)
    assert not np.array_equal(vault.building.modelled[0].vertices, other.building.modelled[0].vertices)
