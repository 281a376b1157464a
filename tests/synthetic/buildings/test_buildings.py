"""Generated buildings: solids without gaps, joints found independently, faces as measured."""

import numpy as np
import pytest

from survey.geometry.solids import area_vector, planes_of_solid
from survey.geometry.watertight import check_watertight
from survey.joints.close import close_joints
from synthetic.building import SyntheticBuilding
from synthetic.buildings.facings import two_facings
from synthetic.buildings.openings import ArchShape
from synthetic.buildings.quoins import corner
from synthetic.buildings.storey_walls import THICKNESS
from synthetic.buildings.tower import TowerStorey, tower_storey
from synthetic.buildings.vaults import barrel_vault, semicircular_arch
from synthetic.buildings.walls import wall
from synthetic.frame import RigidMotion
from tests.survey.unseen.core.two_facings import core_volume
from tests.survey.unseen.statics import area_of, centroid, contacts, near_pairs, overlap_depth
from tests.validation.closing.assemblies import angled_pier, hexagonal_dome

BUILDINGS = {
    "wall": lambda: wall(20),
    "segmental": lambda: wall(70, arch=ArchShape.SEGMENTAL),
    "semicircular": lambda: wall(98, arch=ArchShape.SEMICIRCULAR),
    "sagging": lambda: wall(60, seed=3, sag=0.05),
    "snecked": lambda: wall(100, snecked=0.1),
    "vault": lambda: barrel_vault(9, 3),
    "rings": lambda: barrel_vault(9, 3, bonded=False),
    "arch": semicircular_arch,
    "corner": lambda: corner(4, 2.0),
    "facings": lambda: two_facings(3.0, 5).building,
    "facings with an upper part": lambda: two_facings(2.6, 6, thickness=1.6, upper=(3, 1.1)).building,
    "tower": lambda: tower_storey(11, seed=2, blunders=0.0).building,
    "low tower": lambda: tower_storey(5, blunders=0.0).building,
}


@pytest.fixture(scope="module", params=BUILDINGS)
def building(request: pytest.FixtureRequest) -> SyntheticBuilding:
    return BUILDINGS[request.param]()


def test_solids_are_convex_and_do_not_overlap(building: SyntheticBuilding) -> None:
    for solid in building.solids:
        check_watertight(solid, convex=True)
    solids = building.solids
    assert max(overlap_depth(solids[i], solids[j]) for i, j in near_pairs(solids)) < 1e-9


def test_joints_are_those_that_another_clipping_finds(building: SyntheticBuilding) -> None:
    solids = building.solids
    other = {}
    for i, j in near_pairs(solids):
        area = sum(area_of(polygon) for _, polygon in contacts(solids[i], solids[j]))
        if area > 1e-3:
            other[solids[i].code, solids[j].code] = area
    own: dict[tuple[str, str], float] = {}
    for joint in building.joints:
        own[joint.stones] = own.get(joint.stones, 0.0) + joint.area
    assert {pair for pair, area in own.items() if area > 1e-3} == set(other)
    for pair, area in other.items():
        assert own[pair] == pytest.approx(area, rel=1e-9), pair
    for joint in building.joints:
        first, second = (next(s for s in solids if s.code == code) for code in joint.stones)
        assert (first.vertices.mean(axis=0) - second.vertices.mean(axis=0)) @ joint.normal > 0.0


def test_faces_are_measured_where_they_are(building: SyntheticBuilding) -> None:
    """Planes within a degree; corners at most a joint, a bevel and noise from true ones."""
    for block, solid, record in zip(building.blocks(), building.solids, building.survey.blocks, strict=True):
        assert block.code == solid.code == record.code
        corners = solid.vertices[list(solid.faces[0])]
        normal = area_vector(corners) / np.linalg.norm(area_vector(corners))
        assert block.face.fit.normal @ normal > np.cos(np.radians(1.0)), block.code
        apart = np.linalg.norm(block.face.outline[:, None] - corners[None], axis=2)
        assert apart.min(axis=1).max() < 0.09, block.code


def test_a_building_is_the_same_for_the_same_seed() -> None:
    first, again, other = wall(20), wall(20), wall(20, seed=2)
    for a, b in zip(first.survey.blocks, again.survey.blocks, strict=True):
        assert a.code == b.code
        np.testing.assert_array_equal(a.vertices, b.vertices)
    assert not np.array_equal(first.survey.blocks[0].vertices, other.survey.blocks[0].vertices)


def test_the_joints_of_an_arch_are_thickness_times_depth() -> None:
    joints = semicircular_arch(17, thickness=0.5, depth=0.6).joints
    np.testing.assert_allclose([joint.area for joint in joints], [0.3] * 16, rtol=1e-12)


def test_beds_sag_by_what_was_asked_for() -> None:
    building = wall(120, seed=3, sag=0.08)
    last = building.solids[-1].code[:3]
    # the upper corners of the faces of the top course: those before the last in a face's polygon, and the last
    upper = np.concatenate(
        [s.vertices[list(s.faces[0])][-2:] for s in building.solids if s.code.startswith(last)]
    )
    along = np.linalg.norm(upper[:, :2] - upper[np.argmin(upper[:, 0]), :2], axis=1)
    curvature = np.polyfit(along, upper[:, 2], 2)[0]
    assert curvature * 25.0 == pytest.approx(0.08, rel=0.02)


def test_snecks_reach_through_two_courses() -> None:
    building = wall(100, snecked=0.1)
    tall = [s for s in building.solids if np.ptp(s.vertices[:, 2]) > 0.5]
    assert len(tall) >= 4
    assert {r.code for r in building.survey.blocks} >= {s.code for s in tall}


def test_the_volume_of_a_core_is_what_no_stone_fills() -> None:
    made = two_facings(3.0, 6, storeys=2)
    assert made.storeys == ((1, 3), (4, 6))
    assert len(made.through) >= 1
    solids, rng = made.building.solids, np.random.default_rng(5)
    depth = [np.ptp((s.vertices - s.vertices[0]) @ _out(s)) for s in solids if s.code in made.through]
    assert depth == pytest.approx([made.thickness] * len(depth), abs=1e-9)
    # a box about the wall in its own axes, sampled; what is in no stone and behind both faces is core
    axes = made_axes(solids)
    local = np.concatenate([s.vertices for s in solids]) @ axes.T
    low, high = local.min(axis=0), local.max(axis=0)
    low[2], high[2] = low[2] + 0.02, high[2] - 0.02  # the relief of the faces is a few millimetres
    points = rng.uniform(low, high, (60_000, 3))
    free = np.ones(len(points), bool)
    for solid in solids:
        planes = _planes(solid, axes)
        free &= ((points @ planes[:, :3].T - planes[:, 3]) > 0.0).any(axis=1)
    assert free.mean() * np.prod(high - low) == pytest.approx(core_volume(made), rel=0.02)


def _out(solid) -> np.ndarray:
    vector = area_vector(solid.vertices[list(solid.faces[0])])
    return vector / np.linalg.norm(vector)


def made_axes(solids) -> np.ndarray:
    """Along, up and out of a wall, from a stone's own sides, which are square to the wall."""
    solid = next(s for s in solids if s.code.startswith("T"))
    up = solid.vertices[3] - solid.vertices[0]
    along = solid.vertices[1] - solid.vertices[0]
    axes = np.array([along, up, np.cross(along, up)])
    return axes / np.linalg.norm(axes, axis=1)[:, None]


def _planes(solid, axes) -> np.ndarray:
    rows = []
    for face in solid.faces:
        corners = solid.vertices[list(face)] @ axes.T
        normal = area_vector(corners)
        rows.append([*normal, normal @ corners[0]])
    return np.array(rows)


def test_rounded_assemblies_are_within_half_a_millimetre_of_the_truth() -> None:
    for made in (hexagonal_dome(60), angled_pier()):
        for solid, true in zip(made.solids, made.truth, strict=True):
            check_watertight(solid)
            assert 1e-5 < np.abs(solid.vertices - true.vertices).max() <= 0.5e-3 + 1e-12
        assert all(joint.area > 1e-6 for joint in made.joints)


def test_the_dome_is_half_a_shell_of_mostly_hexagons() -> None:
    made = hexagonal_dome(90, radius=3.0, thickness=0.3)
    for solid in made.truth:
        check_watertight(solid, convex=True)
    volume = sum(centroid(solid)[0] for solid in made.truth)
    # faces are tangent planes: a little more than the shell between two spheres
    assert volume == pytest.approx(2.0 / 3.0 * np.pi * (3.3**3 - 3.0**3), rel=0.03)
    assert sum(len(solid.faces) == 8 for solid in made.truth) > 50
    # every side that does not stand on the ground is a joint: 6 sides of 72 inner stones and so on, each shared by two
    sides = sum(len(solid.faces) - 2 for solid in made.truth) - len(made.base)
    assert len(made.joints) == sides // 2


def test_an_angled_pier_is_full() -> None:
    made = angled_pier(courses=6, wing=2.2, height=0.3)
    volume = sum(centroid(solid)[0] for solid in made.parts)
    assert volume == pytest.approx(6 * 0.3 * (2.2 * 0.4 + 1.8 * 0.4), rel=1e-12)
    bed = sum(joint.area for joint in made.joints if abs(joint.normal[2]) > 0.9)
    assert bed == pytest.approx(5 * (2.2 * 0.4 + 1.8 * 0.4), rel=1e-9)


def test_the_storey_is_bonded_at_its_corners_and_through_its_walls() -> None:
    storey = tower_storey(12)
    solids = {solid.code: solid for solid in storey.building.solids}
    records = {record.code: record for record in storey.building.survey.blocks}
    quoins = [code for code, record in records.items() if record.kind == "quoin"]
    # a quoin and a bonder at each of two corners, in each course; the bonder is as deep as the wall
    assert len(quoins) == 2 * 2 * 12
    deep = [code for code in quoins if records[code].depth is not None]
    assert len(deep) == 2 * 12
    touching = {frozenset(joint.stones) for joint in storey.building.joints}
    for course in range(1, 13):
        pairs = [
            pair
            for pair in touching
            if {code[0] for code in pair} in ({"A", "B"}, {"A", "C"})
            and pair <= set(quoins)
            and all(code[2:4] == f"{course:02d}" for code in pair)
        ]
        assert len(pairs) == 2, course
    through = [
        code for code, record in records.items() if record.kind == "header" and record.depth is not None
    ]
    assert len(through) >= 2
    for code in (*through, *deep):
        assert _depth(solids[code]) == pytest.approx(THICKNESS, abs=1e-9)
    heights = {record.course: np.ptp(solids[code].vertices[:, 2]) for code, record in records.items()}
    assert heights[storey.level_break + 1] == pytest.approx(0.15, abs=2e-3)
    assert min(heights[course] for course in range(1, storey.level_break)) > 0.25


def _depth(solid) -> float:
    return float(np.ptp((solid.vertices - solid.vertices[0]) @ _out(solid)))


def test_storeys_of_less_than_ten_courses_have_no_openings() -> None:
    for courses in (2, 5, 9, 10):
        records = tower_storey(courses).building.survey.blocks
        assert max(record.course or 0 for record in records) == courses
        assert any(record.kind in ("jamb", "voussoir") for record in records) == (courses == 10)


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_narrow_stretches_beside_openings_are_filled_whatever_the_seed(seed: int) -> None:
    """From the corner to the stone beside an opening there may be too little room for another stone."""
    for courses in (10, 12):
        widths = [
            float(np.linalg.norm(solid.vertices[1] - solid.vertices[0]))
            for storey in (tower_storey(courses, seed), tower_storey(courses, seed, elaborate=True))
            for solid, record in _pairs(storey.building)
            if record.kind in ("header", "stretcher")
        ]
        assert min(widths) > 0.30
        assert max(widths) < 0.82


def _pairs(building: SyntheticBuilding):
    """Stones that were measured by their faces, with their records."""
    return zip(building.solids, building.survey.blocks, strict=False)


def test_a_semicircular_barrel_vault_spans_the_passage() -> None:
    """Its joints lie in planes through the axis of one half circle, and its stones bond through the wall."""
    building = tower_storey(12, elaborate=True).building
    vault = [pair for pair in _pairs(building) if pair[1].code.startswith(("CO-V", "CI-V"))]
    outer = [solid for solid, record in vault if record.code.startswith("CO")]
    left, right = outer[0].vertices[0], outer[-1].vertices[1]
    assert left[2] == pytest.approx(right[2], abs=1e-9)
    centre, across = 0.5 * (left + right), (right - left) / np.linalg.norm(right - left)
    flat = np.array([across, [0.0, 0.0, 1.0]])
    for solid, record in vault:
        inner, back = ((solid.vertices[k] - centre) @ flat.T for k in ([0, 1, 4, 5], [3, 2, 7, 6]))
        assert np.linalg.norm(inner, axis=1) == pytest.approx(np.full(4, 0.6), abs=1e-9), record.code
        assert inner[:, 0] * back[:, 1] - inner[:, 1] * back[:, 0] == pytest.approx(np.zeros(4), abs=1e-9)
    count = len(outer)
    assert len(vault) == 2 * count
    depths = {record.code: _depth(solid) for solid, record in vault}
    for number in range(1, count + 1):
        leaves = depths[f"CO-V{number}"], depths[f"CI-V{count + 1 - number}"]
        assert sorted(leaves) == pytest.approx([0.47, 0.63], abs=1e-9)
        assert (leaves[0] > leaves[1]) == (number % 2 == 0)
    # no thin stretcher bears its thrust, and two courses weigh upon it
    touching = {frozenset(joint.stones) for joint in building.joints if abs(joint.normal[2]) < 1e-6}
    ends = {"CO-V1", "CI-V1", f"CO-V{count}", f"CI-V{count}"}
    beside = {other for pair in touching if pair & ends for other in pair if "V" not in other}
    assert len(beside) >= 4
    assert {record.kind for _, record in _pairs(building) if record.code in beside} == {"springer"}
    top = max(solid.vertices[:, 2].max() for solid, _ in vault)
    above = {record.course for solid, record in _pairs(building) if solid.vertices[:, 2].min() > top - 1e-6}
    assert len(above) >= 2


@pytest.fixture(scope="module")
def splayed() -> TowerStorey:
    return tower_storey(12, elaborate=True)


def test_windows_widen_along_splayed_jambs_below_a_rear_arch(splayed: TowerStorey) -> None:
    building = splayed.building
    solids = {solid.code: solid for solid in building.solids}
    assert building.modelled
    assert {one.code[:2] for one in building.modelled} == {"AI", "BI"}
    for one in building.modelled:
        solid, out = solids[one.code], splayed.outward[one.code[0]]
        check_watertight(solid, convex=True)
        along = np.cross([0.0, 0.0, 1.0], out)
        (reveal,) = (plane[:3] for plane in planes_of_solid(solid) if 0.1 < abs(plane[:3] @ out) < 0.9)
        # by 0.2 m in the half of the wall; towards the inside and the axis of the window
        assert reveal @ out == pytest.approx(-0.2 / np.hypot(0.2, 0.5 * THICKNESS), abs=1e-9)
        assert reveal[2] == pytest.approx(0.0, abs=1e-9)
        before = [other for other in solids.values() if other.code[:4] == f"{one.code[0]}O{one.code[2:4]}"]
        # it continues the jamb of the outer facing, which is straight
        edges = [solid.vertices @ along for solid in before]
        end = solid.vertices[list(solid.faces[1])] @ along
        assert min(abs(edge[:, None] - end).min() for edge in edges) < 1e-9, one.code
    stones = building.solids
    assert max(overlap_depth(stones[i], stones[j]) for i, j in near_pairs(stones)) < 1e-9


def test_splayed_jambs_keep_their_reveals_when_joints_close(splayed: TowerStorey) -> None:
    building = splayed.building
    blocks = building.blocks()
    closed = close_joints(blocks)
    assert closed.report.gaps == closed.report.overlaps == ()
    mine = {one.code for one in building.modelled}
    for block, solid in zip(blocks, closed.solids, strict=True):
        out = splayed.outward[block.code[0]]
        if block.code in mine:
            # their face is that of the wall, so that a core may be proposed behind their facing
            assert block.face.fit.normal @ -out > np.cos(np.radians(1.0)), block.code
            angles = [np.degrees(np.arcsin(abs(plane[:3] @ out))) for plane in planes_of_solid(solid)]
            assert sum(19.0 < angle < 21.0 for angle in angles) == 1, (block.code, angles)
    true, found = dict[frozenset[str], float](), dict[frozenset[str], float]()
    for joints, areas in ((building.joints, true), (closed.report.joints, found)):
        for joint in joints:
            if mine & set(joint.stones):
                areas[frozenset(joint.stones)] = areas.get(frozenset(joint.stones), 0.0) + joint.area
    # head joints over each other by less than a centimetre are lost
    assert {pair for pair, area in true.items() if area > 2e-3} <= found.keys() <= true.keys()
    assert sum(found.values()) == pytest.approx(sum(true.values()), rel=0.015)


def test_a_splayed_jamb_moves_with_the_storey(splayed: TowerStorey) -> None:
    motion = RigidMotion(np.eye(3), np.array([0.1, -0.2, 0.3]))
    moved = tower_storey(
        12, elaborate=True, movement=dict.fromkeys((s.code for s in splayed.building.solids), motion)
    )
    for one, other in zip(splayed.building.modelled, moved.building.modelled, strict=True):
        assert np.abs(motion.place(one.vertices) - other.vertices).max() < 2e-5
