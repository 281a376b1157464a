"""Core of a wall as blocks: closed, on common planes with the stones, of the true volume."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ground.errors import GeometryError, UsageError
from pipelines.ingest.records import surveyed_block
from pipelines.propose.propose import core_record
from survey.geometry.solids import volume_of
from survey.geometry.watertight import check_watertight
from survey.joints.close import close_joints
from survey.joints.settings import JointSettings
from survey.unseen.core.facings import facing_stone
from survey.unseen.core.propose import propose_infill
from survey.unseen.core.settings import InfillSettings
from synthetic.buildings.facings import two_facings
from synthetic.buildings.tower import tower_storey
from tests.survey.unseen.core.two_facings import (
    HALF,
    boxes_meet,
    contains,
    core_volume,
    depth_of_overlap,
    facing,
)
from tests.survey.unseen.statics import side_planes

BEDS = [0.0, 0.3, 0.62, 0.9]
FRONT = [
    [(0.7, 0.3), (0.4, 0.5), (0.9, 0.3)],
    [(0.4, 0.5), (0.8, 0.3), (0.8, 0.3)],
    [(0.8, 0.3), (0.4, 0.5), (0.8, 0.25)],
]
BACK = [
    [(0.5, 0.25), (0.9, 0.25), (0.6, 0.4)],
    [(1.0, 0.25), (0.4, 0.4), (0.6, 0.25)],
    [(0.6, 0.25), (0.4, 0.4), (1.0, 0.25)],
]


def core_of(front, back):
    """Return the true volume of the core between facings of whole rows."""
    whole = 2.0 * HALF * 2.0 * BEDS[-1]
    return whole - sum(
        length * depth * (BEDS[k + 1] - BEDS[k])
        for rows in (front, back)
        for k, row in enumerate(rows)
        for length, depth in row
    )


def test_the_core_of_plain_facings_is_what_the_stones_leave():
    stones = facing(FRONT, BEDS) + facing(BACK, BEDS, back=True)
    core = propose_infill(stones)
    assert sum(one.volume for one in core) == pytest.approx(core_of(FRONT, BACK), rel=1e-12)
    assert [one.code for one in core[:2]] == ["I1-01-01", "I1-01-02"]
    assert {one.course for one in core} == {1, 2, 3}
    for one in core:
        check_watertight(one.solid, convex=True)
        assert volume_of(one.solid) == pytest.approx(one.volume, rel=1e-12)


def test_every_block_shares_planes_with_the_stones_that_its_evidence_names():
    stones = {one.code: one for one in facing(FRONT, BEDS) + facing(BACK, BEDS, back=True)}
    for block in propose_infill(list(stones.values())):
        planes = side_planes(block.solid)
        named = [code for code in stones if code in block.evidence]
        assert len(named) == 2
        for code in named:
            hidden = -stones[code].normal
            plane = hidden @ stones[code].solid.vertices[4]
            meets = (planes[:, :3] @ hidden < -1.0 + 1e-12) & (np.abs(planes[:, 3] + plane) < 1e-9)
            assert meets.sum() == 1, (block.code, code)


@settings(max_examples=8, deadline=None)
@given(
    rotation=st.tuples(*[st.floats(-0.06, 0.06)] * 2, st.floats(-3.0, 3.0)),
    shift=st.tuples(*[st.sampled_from([0.0, 3.7, -41.0])] * 3),
    joint=st.sampled_from([0.0, 0.004, 0.008]),
    data=st.data(),
)
def test_no_block_overlaps_anything_wherever_the_wall_stands(rotation, shift, joint, data):
    def row():
        cuts = sorted(data.draw(st.lists(st.integers(6, 34), min_size=1, max_size=4, unique=True)))
        lengths = np.diff([0, *cuts, 40]) * 0.05
        return [(length, data.draw(st.sampled_from([0.22, 0.3, 0.46, 0.6]))) for length in lengths.tolist()]

    rows = [[row() for _ in BEDS[1:]] for _ in range(2)]
    stones = [
        stone
        for back in (False, True)
        for stone in facing(rows[back], BEDS, back=back, joint=joint, placed=(rotation, np.array(shift)))
    ]
    core = propose_infill(stones)
    for block in core:
        check_watertight(block.solid, convex=True)
    solids = [block.solid.vertices for block in core]
    for one, other in combinations(solids, 2):
        assert not boxes_meet(one, other) or depth_of_overlap(one, other) < 1e-7
    for one in solids:
        for stone in stones:
            other = stone.solid.vertices
            assert not boxes_meet(one, other) or depth_of_overlap(one, other) < 1e-7


def test_where_headers_meet_there_is_no_core_and_their_neighbours_keep_theirs():
    front = [[(0.8, 0.3), (0.4, 0.5), (0.8, 0.3)]]
    back = [[(0.8, 0.3), (0.4, 0.5), (0.8, 0.3)]]
    beds = BEDS[:2]
    core = propose_infill(facing(front, beds) + facing(back, beds, back=True))
    assert [round(one.volume, 12) for one in core] == [round(0.8 * 0.3 * 0.4, 12)] * 2
    header = np.array([[1.0, 0.0, 0.15], [1.0, 0.19, 0.15], [1.0, -0.19, 0.15]])
    assert not any(contains(one.solid, header).any() for one in core)


def test_a_stone_that_goes_through_parts_the_core():
    front = [[(0.8, 0.3), (0.4, 1.0), (0.8, 0.3)]]
    back = [[(0.8, 0.3), (0.4, None), (0.8, 0.3)]]
    core = propose_infill(facing(front, BEDS[:2]) + facing(back, BEDS[:2], back=True))
    assert [round(one.volume, 12) for one in core] == [round(0.8 * 0.3 * 0.4, 12)] * 2


def test_neither_an_opening_nor_a_missing_stone_is_filled():
    front = [[(0.7, 0.3), (0.6, None), (0.7, 0.3)]]
    back = [[(1.0, 0.3), (1.0, 0.3)]]
    core = propose_infill(facing(front, BEDS[:2]) + facing(back, BEDS[:2], back=True))
    assert sum(one.volume for one in core) == pytest.approx(1.4 * 0.3 * 0.4, rel=1e-12)


def test_faces_across_a_room_make_no_wall():
    one = facing(FRONT, BEDS)
    other = facing(BACK, BEDS, back=True, placed=((0.0, 0.0, 0.0), np.array([0.0, 3.0, 0.0])))
    assert propose_infill(one + other) == ()
    assert len(propose_infill(one + other, InfillSettings(max_thickness=4.5))) > 0


def test_facings_can_be_named():
    front, back = facing(FRONT, BEDS), facing(BACK, BEDS, back=True)
    named = tuple([stone.code for stone in side] for side in (front, back))
    assert len(propose_infill(front + back, facings=named)) == len(propose_infill(front + back))
    with pytest.raises(UsageError, match="in both facings"):
        propose_infill(front, facings=(named[0], named[0]))
    with pytest.raises(UsageError, match="no stones"):
        propose_infill(front, facings=named)
    with pytest.raises(GeometryError, match="out of parallel"):
        propose_infill(front, facings=(named[0][:4], named[0][4:]))


def test_codes_that_are_taken_are_not_given_again():
    stones = facing(FRONT, BEDS) + facing(BACK, BEDS, back=True)
    assert propose_infill(stones, taken=["I1-01-01"])[0].code == "I2-01-01"


@pytest.mark.parametrize("closed", [False, True])
def test_the_core_of_a_surveyed_wall_is_as_large_as_it_truly_is(closed):
    wall = two_facings(5.0, 6, 4)
    blocks = wall.building.blocks()
    solids = wall.building.solids if closed else [block.solid for block in blocks]
    stones = [facing_stone(block, solid) for block, solid in zip(blocks, solids, strict=True)]
    core = propose_infill(stones)
    # 3 mm of noise on either side of a core of half a metre
    assert sum(one.volume for one in core) == pytest.approx(core_volume(wall), rel=0.006)
    for one in core:
        for stone in stones:
            other = stone.solid.vertices
            assert (
                not boxes_meet(one.solid.vertices, other)
                or depth_of_overlap(one.solid.vertices, other) < 1e-6
            )


def test_the_core_takes_part_in_closing_the_joints():
    wall = two_facings(3.0, 4, 2)
    blocks = wall.building.blocks()
    core = [surveyed_block(core_record(one)) for one in propose_infill([facing_stone(one) for one in blocks])]
    report = close_joints([*blocks, *core], JointSettings()).report
    mine = {one.code for one in core}
    joints = [joint for joint in report.joints if mine & set(joint.stones)]
    closed = sum(joint.area for joint in joints if not joint.left_open)
    assert report.overlaps == ()
    assert closed > 0.95 * sum(joint.area for joint in joints)
    # every block is held by a stone in front and one behind
    for code in mine:
        beside = {other for joint in joints if code in joint.stones for other in joint.stones} - mine
        assert {other[0] for other in beside} >= {"F", "B"}, code


def tower_and_core():
    """The storey of twelve courses: its building, closed alone, with its core, and the codes of the core."""
    building = tower_storey(12).building
    blocks = building.blocks()
    alone = close_joints(blocks)
    assert alone.report.gaps == ()
    stones = [facing_stone(block, solid) for block, solid in zip(blocks, alone.solids, strict=True)]
    core = [surveyed_block(core_record(one)) for one in propose_infill(stones)]
    return building, alone, close_joints([*blocks, *core]), {one.code for one in core}


def test_a_core_makes_beds_of_both_facings_one_and_leaves_all_other_joints_as_they_are_without_it():
    building, alone, closed, mine = tower_and_core()
    moved, error = [], []
    for true, one, other in zip(building.solids, alone.solids, closed.solids, strict=False):
        visible, corners = one.vertices[list(one.faces[0])], true.vertices[list(true.faces[0])]
        moved.append(other.vertices[_nearest(visible, other.vertices)] - visible)
        error.append(
            [
                np.linalg.norm(solid.vertices[_nearest(corners, solid.vertices)] - corners, axis=1).max()
                for solid in (one, other)
            ]
        )
    step = np.concatenate(moved)
    up, aside = np.abs(step[:, 2]), np.linalg.norm(step[:, :2], axis=1)
    # beds shift by less than the noise of a corner, 3 mm, and nearly all by much less; head joints stay where they are
    assert up.max() < 0.003
    assert np.mean(up > 1e-4) < 0.01
    assert np.mean(aside > 1e-5) < 0.01
    # and stones are as near to the true ones as before
    before, after = np.mean(error, axis=0)
    assert after < before + 1e-5
    between = [joint for joint in closed.report.joints if not mine & set(joint.stones)]
    assert not any(joint.left_open for joint in between)
    assert {gap.stones for gap in closed.report.gaps if not mine & set(gap.stones)} == set()


def _nearest(points, among):
    """Return the index of the nearest of some points to each."""
    return np.linalg.norm(points[:, None] - among[None], axis=2).argmin(axis=1)


@pytest.fixture(scope="module")
def wall_and_core():
    """Blocks of a wall of two facings, the solids with its core closed between them, and the courses of the core."""
    blocks = two_facings(5.0, 10).building.blocks()
    alone = close_joints(blocks)
    stones = [facing_stone(block, solid) for block, solid in zip(blocks, alone.solids, strict=True)]
    core = propose_infill(stones)
    closed = close_joints([*blocks, *(surveyed_block(core_record(one)) for one in core)])
    return blocks, closed, {one.code: one.course for one in core}


def test_hidden_sides_of_neighbours_of_one_depth_lie_in_one_plane_beside_a_core(wall_and_core):
    blocks, closed, _ = wall_and_core
    backs = {}
    for block, solid in zip(blocks, closed.solids, strict=False):
        if block.depth.origin == "kind" and block.kind == "stretcher":
            planes = side_planes(solid)
            backs[block.code] = planes[(planes[:, :3] @ block.face.fit.normal).argmin()]
    pairs = [joint.stones for joint in closed.report.joints if set(joint.stones) <= backs.keys()]
    apart = [np.abs(backs[one] - backs[other]).max() for one, other in pairs]
    assert len(pairs) > 50
    # faces differ by their relief, of 2 mm
    assert max(apart) < 1e-7


def test_each_bed_of_a_core_is_one_plane_though_those_of_the_facings_were_measured_apart(wall_and_core):
    _, closed, course = wall_and_core
    tops, bottoms = {}, {}
    for solid in closed.solids:
        if (number := course.get(solid.code)) is not None:
            for face in solid.faces:
                corners = solid.vertices[list(face)]
                up = np.cross(corners[1] - corners[0], corners[2] - corners[1])
                up = up[2] / np.linalg.norm(up)
                if abs(up) > 0.9:
                    (tops if up > 0 else bottoms).setdefault(number + (up > 0), []).append(corners)
    apart = []
    for number in sorted(tops.keys() & bottoms.keys()):
        corners = np.concatenate([*tops[number], *bottoms[number]])
        middle = corners.mean(axis=0)
        normal = np.linalg.svd(corners - middle)[2][-1]
        apart.append(np.abs((corners - middle) @ normal).max())
    assert len(apart) == 9
    # where a bed is bent, the plane of one facing is not that of the other
    assert np.mean(np.array(apart) < 1e-6) > 0.85
    assert max(apart) < 0.002


def test_a_core_block_of_which_two_sides_become_one_is_closed(wall_and_core):
    _, closed, course = wall_and_core
    far = [gap for gap in closed.report.gaps if "it would move a corner" in gap.reason]
    assert [gap.stones for gap in far if set(gap.stones) & course.keys()] == []
