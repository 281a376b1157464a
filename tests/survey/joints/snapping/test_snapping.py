"""Snapping of assemblies rounded to a millimetre to the contact planes with which they were made."""

from collections.abc import Callable
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog, minimize
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from ground.errors import UsageError
from survey.arrays import Array
from survey.formats.options import ReadingOptions
from survey.formats.solids.reader import open_solids
from survey.geometry.convex_parts import convex_parts
from survey.geometry.convexity import is_convex
from survey.geometry.half_spaces import intersection
from survey.geometry.plane_network import settle
from survey.geometry.solids import Solid, area_vector, planes_of_solid
from survey.geometry.watertight import check_watertight
from survey.joints.snapping.matching_faces import find_matches
from survey.joints.snapping.snapping import snap
from survey.records.snapping import Snapping
from survey.records.survey import Reject, SolidRecord
from tests.survey.joints.assemblies import dome, groin, obj, prism, rounded, wall
from tests.survey.largest_ball import volume_within


def read(path: Path, text: str, **options: float) -> tuple[list[Solid], Snapping | None]:
    path.write_text(text)
    stream = open_solids(path, ReadingOptions(**options))  # type: ignore[arg-type]
    out = []
    for one in stream.blocks:
        assert isinstance(one, SolidRecord)
        out.append(Solid(one.code, one.vertices, one.faces))
    return out, stream.snapping


def out_of_plane(places: Array) -> float:
    """Return the largest distance from the plane that fits best."""
    centred = places - places.mean(axis=0)
    return float(np.abs(centred @ np.linalg.svd(centred)[2][2]).max())


def common_volume(one: Solid, other: Solid) -> float:
    """Return the common volume of two convex solids, by linear programming and qhull."""
    try:
        return volume_within(np.concatenate([planes_of_solid(one), planes_of_solid(other)]), 1e-9)
    except QhullError:
        return 0.0


def largest_overlap(solids: list[Solid]) -> float:
    parts = [convex_parts(one) for one in solids]
    worst = 0.0
    for i, j in combinations(range(len(solids)), 2):
        low = np.maximum(solids[i].vertices.min(axis=0), solids[j].vertices.min(axis=0))
        high = np.minimum(solids[i].vertices.max(axis=0), solids[j].vertices.max(axis=0))
        if (low < high).all():
            worst = max(worst, sum(common_volume(a, b) for a in parts[i] for b in parts[j]))
    return worst


def faces_of(solids: list[Solid]) -> list[Array]:
    return [one.vertices[list(face)] for one in solids for face in one.faces]


@pytest.mark.parametrize(
    ("build", "tolerance"), [(wall, 0.002), (dome, 0.003), (groin, 0.003)], ids=["wall", "dome", "groin"]
)
def test_contacts_come_back_that_were_lost_by_rounding(
    tmp_path: Path, build: Callable[[], list[Solid]], tolerance: float
) -> None:
    true, _ = read(tmp_path / "true.obj", obj(build(), None))
    got, snapping = read(tmp_path / "got.obj", obj(build(), 3, doubled=True), snap=tolerance)
    lost, _ = read(tmp_path / "lost.obj", obj(build(), 3))
    assert snapping is not None
    contacts = [one for one in find_matches(true, 1e-9) if one.area > 0.0]
    assert [one.faces for one in got] == [one.faces for one in true]
    faces, rough = faces_of(got), faces_of(lost) if build is not dome else None
    assert snapping.contacts == len(contacts)
    assert snapping.left_open == ()
    assert not snapping.folded
    for contact in contacts:
        both = np.concatenate([faces[k] for k in contact.faces])
        assert out_of_plane(both) < 1e-12
    if rough is not None:  # it was not so before
        assert max(out_of_plane(np.concatenate([rough[k] for k in one.faces])) for one in contacts) > 2e-4
    assert max(map(out_of_plane, faces)) < 1e-12  # free faces too
    area = sum(one.area for one in find_matches(got, 1e-9))
    assert area >= 0.99 * sum(one.area for one in contacts)
    moved = [
        np.linalg.norm(a.vertices - np.round(b.vertices, 3), axis=1) for a, b in zip(got, true, strict=True)
    ]
    assert snapping.largest_movement == pytest.approx(max(one.max() for one in moved), rel=1e-9)
    # rounding moved them by less than √3/2 mm; they are no farther from the truth now
    assert (
        max(np.linalg.norm(a.vertices - b.vertices, axis=1).max() for a, b in zip(got, true, strict=True))
        < 1.2e-3
    )
    for one in got:
        check_watertight(one)
    assert largest_overlap(got) < 1e-12


def test_what_is_exact_stays_where_it_is() -> None:
    solids = wall()
    snapped, snapping = snap(solids, 0.002)
    assert snapping.largest_movement < 1e-13
    assert snapping.planes == 3 + 14  # beds, of which each is one plane, and head joints
    for one, other in zip(snapped, solids, strict=True):
        np.testing.assert_allclose(one.vertices, other.vertices, atol=1e-13)


def box(code: str, low: tuple[float, float, float], high: tuple[float, float, float]) -> Solid:
    x, y, z = zip(low, high, strict=True)
    front = np.array([(x[0], y[0], z[0]), (x[1], y[0], z[0]), (x[1], y[0], z[1]), (x[0], y[0], z[1])])
    return prism(code, front, front + [0.0, y[1] - y[0], 0.0])  # noqa: RUF005


@pytest.mark.parametrize("tolerance", [0.0, -0.001, float("nan")])
def test_a_tolerance_is_positive(tolerance: float) -> None:
    with pytest.raises(UsageError, match="the tolerance of snapping is"):
        snap(wall(2, 2), tolerance)


def test_two_stones_meet_half_way() -> None:
    lower, upper = box("A", (0, 0, 0), (1, 1, 1)), box("B", (0, 0, 1.001), (1, 1, 2))
    (one, other), snapping = snap([lower, upper], 0.002)
    assert one.vertices[:, 2].max() == pytest.approx(1.0005, abs=1e-12)
    assert other.vertices[:, 2].min() == pytest.approx(1.0005, abs=1e-12)
    assert (snapping.contacts, snapping.planes) == (1, 1)
    assert snapping.moved == pytest.approx({"A": 0.0005, "B": 0.0005})


def test_a_contact_that_would_move_corners_too_far_stays_open_and_is_listed() -> None:
    """Two stones of a course, 6 mm apart in height, under one that lies half-way."""
    low, high = box("A", (0, 0, 0), (1, 1, 1)), box("B", (1.2, 0, 0), (2, 1, 1.006))
    above = box("C", (0, 0, 1.003), (2, 1, 2))
    (_, two, three), snapping = snap([low, high, above], 0.002)
    assert snapping.contacts == 1
    assert [one.stones for one in snapping.left_open] == [("B", "C")]
    assert snapping.left_open[0].area == pytest.approx(0.8, rel=0.01)
    assert snapping.largest_movement <= 0.002
    assert two.vertices[:, 2].max() == pytest.approx(1.006)
    assert out_of_plane(three.vertices[three.vertices[:, 2] < 1.5]) < 1e-12


def test_stones_across_a_corner_do_not_overlap() -> None:
    """Four stones about an edge, where each pair alone could meet in a plane of its own."""
    random = np.random.default_rng(4)
    stones = [box(f"{x}{z}", (x, 0, z), (x + 1, 0.5, z + 1)) for x in (0, 1) for z in (0, 1)]
    shaken = [
        Solid(s.code, s.vertices + random.uniform(-4e-4, 4e-4, s.vertices.shape), s.faces) for s in stones
    ]
    snapped, snapping = snap(shaken, 0.003)
    assert snapping.left_open == ()
    assert snapping.contacts == 4
    assert largest_overlap(list(snapped)) == 0.0


def test_a_free_face_gives_way_before_a_contact_does() -> None:
    """A pyramid's point has four planes; as its base and one side are held, the other sides cannot all stay plane."""
    base = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
    top = [(0.2, 0.2, 0.8), (0.8, 0.2, 0.8), (0.8, 0.8, 0.8), (0.2, 0.8, 0.803)]
    stone = prism("A", np.array(base), np.array(top))
    (one,), snapping = snap([stone], 0.0005)
    assert snapping.folded == {"A": 1} or snapping.largest_movement <= 0.0005
    assert snapping.largest_movement <= 0.0005
    assert max(map(out_of_plane, faces_of([one]))) < 1e-12
    check_watertight(one)


def test_a_stone_alone_and_round_ones_stay_as_they_are() -> None:
    corners = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
    tetrahedron = Solid("T", corners, ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)))
    far = Solid("F", corners + 5.0, tetrahedron.faces)
    for solids in ([tetrahedron], [tetrahedron, far]):
        snapped, snapping = snap(solids, 0.002)
        assert (snapping.contacts, snapping.planes, snapping.left_open) == (0, 0, ())
        assert snapping.largest_movement == 0.0
        for one, other in zip(snapped, solids, strict=True):
            np.testing.assert_array_equal(one.vertices, other.vertices)
            assert one.faces == other.faces
    _, snapping = snap([box("B", (0, 0, 0), (1, 1, 1))], 0.002)
    assert snapping.largest_movement < 1e-14


# --- the least movement ---


def test_the_network_moves_corners_by_as_little_as_a_general_minimiser_does() -> None:
    """Two wedges on a slanting plane that neither knows exactly; 48 coordinates and the plane's three."""
    random = np.random.default_rng(2)
    solids = [one for one in rounded(wall(2, 2), 2) if one.code in ("W0-0", "W1-0")]
    vertices = np.concatenate([one.vertices for one in solids])
    vertices = vertices + random.uniform(-2e-3, 2e-3, vertices.shape)
    rows = [
        (i + 8 * k, 6 * k + f)
        for k, one in enumerate(solids)
        for f, face in enumerate(one.faces)
        for i in face
    ]
    table = np.array([(i, 0 if p in (4, 8) else p + 1) for i, p in rows], dtype=np.int64)
    _, table[:, 1] = np.unique(table[:, 1], return_inverse=True)
    settled = settle(vertices, table[:, 0], table[:, 1])
    assert np.abs(settled.residual).max() < 1e-13
    planes = [settled.vertices[table[table[:, 1] == p, 0]] for p in range(table[:, 1].max() + 1)]
    assert max(map(out_of_plane, planes)) < 1e-13

    def distances(unknown: Array) -> Array:
        x, n = unknown[:48].reshape(-1, 3), unknown[48:].reshape(-1, 4)
        on = (x[table[:, 0]] * n[table[:, 1], :3]).sum(axis=1) - n[table[:, 1], 3]
        return np.concatenate([on, (n[:, :3] ** 2).sum(axis=1) - 1.0])

    start = [vertices.ravel()]
    for p in range(table[:, 1].max() + 1):
        own = vertices[table[table[:, 1] == p, 0]]
        normal = np.linalg.svd(own - own.mean(axis=0))[2][2]
        start.append(np.array([*normal, normal @ own.mean(axis=0)]))
    best = minimize(
        lambda unknown: 1e4 * float(((unknown[:48] - vertices.ravel()) ** 2).sum()),
        np.concatenate(start),
        constraints={"type": "eq", "fun": distances},
        method="SLSQP",
        options={"maxiter": 200, "ftol": 1e-14},
    )
    own = 1e4 * float(((settled.vertices - vertices) ** 2).sum())
    assert own == pytest.approx(best.fun, rel=1e-5)
    assert own > 1e-3


# --- which faces match ---


def shared_area(one: Array, other: Array) -> float:
    """Return the common area of two opposite convex polygons, seen square to the mean of their planes, by qhull."""
    normal = area_vector(other) - area_vector(one)
    axes = np.linalg.svd(normal[None, :])[2][1:]
    rows = []
    for polygon in (one, other):
        flat = polygon @ axes.T
        rows.append(ConvexHull(flat).equations)
    planes = np.concatenate(rows)
    ball = linprog(
        [0, 0, -1],
        A_ub=np.column_stack([planes[:, :2], np.ones(len(planes))]),
        b_ub=-planes[:, 2],
        bounds=[(None, None)] * 2 + [(0, None)],
    )
    if ball.status != 0 or ball.x[2] < 1e-6:
        return 0.0
    return float(ConvexHull(HalfspaceIntersection(planes, ball.x[:2]).intersections).volume)


def test_matches_are_those_that_a_slow_search_finds() -> None:
    solids, tolerance = rounded(wall(), 3), 0.002
    faces = faces_of(solids)
    owner = [k for k, one in enumerate(solids) for _ in one.faces]
    expected = {}
    for i, j in combinations(range(len(faces)), 2):
        both = np.concatenate([faces[i], faces[j]])
        opposite = area_vector(faces[i]) @ area_vector(faces[j]) < 0.0
        if owner[i] != owner[j] and opposite and out_of_plane(both) <= tolerance:
            area = shared_area(faces[i], faces[j])
            if area > 0.01:
                expected[i, j] = area
    found = {one.faces: one.area for one in find_matches(solids, tolerance) if one.area > 0.0}
    assert found.keys() == expected.keys()
    assert len(found) == 38
    for pair, area in found.items():
        assert area == pytest.approx(expected[pair], rel=1e-3)


# --- anything ---


@st.composite
def cut_boxes(draw: st.DrawFn) -> list[Solid]:
    """Cut a box by planes, each through a piece that is already there: many stones, no regularity."""
    random = np.random.default_rng(draw(st.integers(0, 10**6)))
    low, high = np.zeros(3), np.array([2.0, 1.2, 1.5])
    pieces: list[list[tuple[float, float, float, float]]] = [[]]
    for _ in range(draw(st.integers(1, 5))):
        k = int(random.integers(len(pieces)))
        here = intersection("A", pieces[k], low, high, 1e-12)
        assert here is not None
        normal = random.normal(size=3)
        normal /= np.linalg.norm(normal)
        a, b, c = normal.tolist()
        d = float(normal @ here.vertices.mean(axis=0))
        pieces[k : k + 1] = [[*pieces[k], (a, b, c, d)], [*pieces[k], (-a, -b, -c, -d)]]
    out = []
    for k, planes in enumerate(pieces):
        one = intersection(f"P{k}", planes, low, high, 1e-12)
        assert one is not None
        # rounded to a millimetre, edges of a few are no edges any more
        lengths = [
            np.linalg.norm(one.vertices[face[i]] - one.vertices[face[i - 1]])
            for face in one.faces
            for i in range(len(face))
        ]
        assume(min(lengths) > 0.05)
        out.append(one)
    return out


@settings(max_examples=20, deadline=None)
@given(cut_boxes())
def test_boxes_cut_anyhow_and_rounded_keep_their_shape_and_meet(solids: list[Solid]) -> None:
    tolerance = 0.004
    snapped, snapping = snap(rounded(solids), tolerance)
    given_ = rounded(solids)
    assert snapping.largest_movement <= tolerance
    for one, before in zip(snapped, given_, strict=True):
        assert len(one.vertices) == len(before.vertices)
        assert np.linalg.norm(one.vertices - before.vertices, axis=1).max() <= tolerance
        check_watertight(one)
        assert max(map(out_of_plane, faces_of([one]))) < 1e-11
    contacts = [one for one in find_matches(solids, 1e-9) if one.area > 0.0]
    open_ = {frozenset(one.stones) for one in snapping.left_open}
    after = {one.solids: one for one in find_matches(snapped, 1e-10)}
    for contact in contacts:
        if contact.area > 0.01 and frozenset(solids[k].code for k in contact.solids) not in open_:
            assert contact.solids in after
    if not snapping.left_open:
        area = sum(one.area for one in after.values())
        assert area >= 0.95 * sum(one.area for one in contacts)
        if all(map(is_convex, snapped)):
            assert largest_overlap(list(snapped)) < 1e-6


def test_a_plate_thinner_than_the_tolerance_is_not_squeezed_to_nothing() -> None:
    thin = [
        box("A", (0, 0, 0), (1, 1, 1)),
        box("B", (0, 0, 1), (1, 1, 1.003)),
        box("C", (0, 0, 1.003), (1, 1, 2)),
    ]
    (_, plate, _), snapping = snap(thin, 0.01)
    assert np.ptp(plate.vertices[:, 2]) == pytest.approx(0.003, abs=1e-12)
    assert snapping.contacts == 2


def test_a_solid_that_snapping_would_spoil_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def flattened(solids: list[Solid], tolerance: float) -> tuple[list[Solid], Snapping]:
        flat = [Solid(one.code, one.vertices * [1.0, 1.0, 0.0], one.faces) for one in solids]
        return flat, Snapping(tolerance, 0, 0, {one.code: 1.0 for one in solids}, {}, ())

    monkeypatch.setattr("survey.formats.solids.reader.snap", flattened)
    path = tmp_path / "a.obj"
    path.write_text(obj([box("A", (0, 0, 0), (1, 1, 1))]))
    (found,) = open_solids(path, ReadingOptions(snap=0.01)).blocks
    assert isinstance(found, Reject)
    assert "a.obj:1: solid A: within 0.01 m of its corners its volume is 0 m³" in str(found.error)
    assert found.error.remedy == "give a smaller tolerance with --snap"


def test_changes_of_a_solid_are_reported_with_it(tmp_path: Path) -> None:
    path = tmp_path / "dome.obj"
    path.write_text(obj(dome(2), 3, doubled=True))
    stream = open_solids(path, ReadingOptions(snap=0.003))
    for one in stream.blocks:
        assert isinstance(one, SolidRecord)
        assert one.remarks[0] == "8 faces were there twice"
        assert one.remarks[1] == "2 faces that are not plane were folded"
        assert one.remarks[2].startswith("snapped within 0.003 m: corners moved by up to 0.000")


@pytest.mark.parametrize(("unit", "factor"), [(0.001, 1000.0), (0.0254, 1 / 0.0254)])
def test_solids_may_be_given_in_any_unit(tmp_path: Path, unit: float, factor: float) -> None:
    given_ = wall(2, 2)
    scaled = [Solid(one.code, one.vertices * factor, one.faces) for one in given_]
    for one, other in zip(read(tmp_path / "a.obj", obj(scaled, None), unit=unit)[0], given_, strict=True):
        np.testing.assert_allclose(one.vertices, other.vertices, atol=1e-14)
