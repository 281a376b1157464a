from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ground.errors import GeometryError, MomaError, SurveyError
from survey.arrays import Array
from survey.faces.neighbours import Neighbours
from survey.faces.planes import FaceFit, fit_plane
from survey.records.survey import BlockRecord, Photograph, PhotoMark, Station, SurveyHead
from survey.registration.marked_walls import MarkedWall, wall_of_marks
from survey.registration.photographed_stones import LiftedFace, lift, lift_faces, plane_of_wall

FOCAL, MIDDLE = 4000.0, np.array([3000.0, 2000.0])
LENGTH, HEIGHT, JOINT = 0.6, 0.3, 0.01
PLACE: Array = np.array([350.0, -120.0, 44.0])
# x along the wall, y into the wall's outside, z up: turned about z, and leaning a little
FRAME: Array = Rotation.from_rotvec([0.02, -0.03, 0.7]).as_matrix()


@dataclass(frozen=True)
class Face:
    code: str
    fit: FaceFit
    outline: Array


@dataclass(frozen=True)
class Wall:
    """A wall in courses whose faces stand out and lean as drawn, and a camera in front of it."""

    corners: Array  # (n, 4, 3) true corners [m]
    camera: Array  # (3,) [m]
    look: Array  # (3, 3) rows: right, down, ahead
    normal: Array

    def seen(self, points: Array) -> Array:
        local = (points - self.camera) @ self.look.T
        return MIDDLE + FOCAL * local[..., :2] / local[..., 2:]


def build(
    rng: np.random.Generator,
    courses: int = 5,
    stones: int = 6,
    relief: float = 0.006,
    tilt: float = 0.012,
    camera: tuple[float, float, float] = (-1.0, 6.0, 2.5),
    place: Array = PLACE,
) -> Wall:
    corners = []
    for course in range(courses):
        for number in range(stones):
            x, z = number * LENGTH + (course % 2) * LENGTH / 2, course * HEIGHT
            flat = np.array(
                [(0, 0), (LENGTH - JOINT, 0), (LENGTH - JOINT, HEIGHT - JOINT), (0, HEIGHT - JOINT)]
            )
            out = rng.normal(0, relief) + (flat - flat.mean(axis=0)) @ rng.normal(0, tilt, 2)
            corners.append(np.column_stack([x + flat[:, 0], out, z + flat[:, 1]]))
    here = np.array(camera)
    ahead = np.array([stones * LENGTH / 2, 0.0, courses * HEIGHT / 2]) - here
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0.0, 0, 1])
    right /= np.linalg.norm(right)
    look = np.array([right, np.cross(ahead, right), ahead])
    return Wall(place + np.array(corners) @ FRAME.T, place + FRAME @ here, look @ FRAME.T, FRAME[:, 1])


def measured(wall: Wall, rng: np.random.Generator, sigma: float, leave: set[int]) -> list[Face]:
    faces = []
    for i, corners in enumerate(wall.corners):
        if i not in leave:
            between = rng.dirichlet(np.ones(4), 6) @ corners
            points = np.vstack([between, corners])
            noisy = points + rng.normal(0, sigma, points.shape)
            fit = fit_plane(noisy, max(sigma, 1e-4), wall.camera)
            faces.append(Face(f"W{i:02d}", fit, noisy[6:] - np.outer(fit.residuals[6:], fit.normal)))
    return faces


def photograph(
    wall: Wall,
    rng: np.random.Generator,
    sigma: float,
    pixel: float,
    station: str | None = "S1",
    count: int = 12,
) -> Photograph:
    """Marks at the corners of the wall's end stones, and within it, on the true faces."""
    n = len(wall.corners)
    places = [wall.corners[0, 0], wall.corners[5, 1], wall.corners[n - 1, 2], wall.corners[n - 6, 3]]
    places += [wall.corners[i].mean(axis=0) for i in rng.choice(n, max(count - 4, 0), replace=False)]
    marks = [
        PhotoMark(
            wall.seen(p) + rng.normal(0, pixel, 2), p + rng.normal(0, sigma, 3), max(sigma, 1e-4), 10 + i
        )
        for i, p in enumerate(places[:count])
    ]
    return Photograph("P1", max(pixel, 0.01), tuple(marks), station, 9)


def stone(wall: Wall, index: int, rng: np.random.Generator, pixel: float) -> BlockRecord:
    image = wall.seen(wall.corners[index]) + rng.normal(0, pixel, (4, 2))
    nothing = np.empty((0, 3))
    return BlockRecord(
        f"W{index:02d}", "stretcher", 1, nothing, nothing, 0.003, line=50, photograph="P1", image=image
    )


def lifted(wall: Wall, index: int, seed: int = 0, station: bool = True) -> LiftedFace:
    rng = np.random.default_rng(seed)
    tied = wall_of_marks(photograph(wall, rng, 0.0, 0.0), wall.camera if station else None, wall.camera)
    return lift(stone(wall, index, rng, 0.0), tied, Neighbours(measured(wall, rng, 0.0, {index})))


# ------------------------------------------------------------------------------------------------------ exact walls


@pytest.mark.parametrize("place", [PLACE, np.array([6.9e6, 5.2e6, 300.0])])
def test_on_a_plane_wall_the_corners_come_out_exactly(place: Array) -> None:
    wall = build(np.random.default_rng(1), relief=0.0, tilt=0.0, place=place)
    face = lifted(wall, 14)
    np.testing.assert_allclose(face.outline, wall.corners[14], atol=1e-8)
    np.testing.assert_allclose(face.fit.normal, wall.normal, atol=1e-8)
    assert face.text.startswith("photograph P1, in the plane of W")
    assert " and W" in face.text


@pytest.mark.parametrize("height", [-0.1, 0.05])
def test_line_of_sight_finds_the_face_that_stands_out_with_its_neighbours(height: float) -> None:
    # the middle of the wall stands out of the plane of the marks, which are around it
    rng = np.random.default_rng(2)
    wall = build(rng, courses=9, stones=9, relief=0.0, tilt=0.0)
    local = (wall.corners - PLACE) @ FRAME
    raised = np.abs(local.mean(axis=1) - local.mean(axis=(0, 1))).max(axis=1) < 1.1
    local[raised, :, 1] += height
    wall = replace(wall, corners=PLACE + local @ FRAME.T)
    index = 40
    assert raised[index]
    ends = [(0, 0), (8, 1), (80, 2), (72, 3)]
    marks = [PhotoMark(wall.seen(wall.corners[i, k]), wall.corners[i, k], 1e-4, 10 + i) for i, k in ends]
    photo = Photograph("P1", 0.01, tuple(marks), "S1", 9)
    faces = Neighbours(measured(wall, rng, 0.0, {index}))
    by_sight = lift(stone(wall, index, rng, 0.0), wall_of_marks(photo, wall.camera), faces)
    np.testing.assert_allclose(by_sight.outline, wall.corners[index], atol=1e-8)
    # without the station: on the right plane, but shifted along it by height × tan(slant of the sight)
    square = lift(stone(wall, index, rng, 0.0), wall_of_marks(photo, None, wall.camera), faces)
    shift = square.outline - wall.corners[index]
    np.testing.assert_allclose(shift @ wall.normal, 0, atol=1e-8)
    rays = wall.corners[index] - wall.camera
    slant = rays / (rays @ wall.normal)[:, None] - wall.normal
    np.testing.assert_allclose(shift, -height * slant, atol=1e-8)
    # and says so: one standard deviation of the unknown sight is 15°
    assert (square.sigma > abs(height) * np.tan(np.radians(14))).all()


def test_marks_out_of_the_plane_do_no_harm_where_the_station_is_known() -> None:
    rng = np.random.default_rng(3)
    wall = build(rng, relief=0.0, tilt=0.0)
    photo = photograph(wall, rng, 0.0, 0.0)
    marks = list(photo.marks)
    marks[5] = replace(marks[5], position=marks[5].position + 0.3 * wall.normal)
    marks[5] = replace(marks[5], image=wall.seen(marks[5].position))
    photo = replace(photo, marks=tuple(marks))
    faces = Neighbours(measured(wall, rng, 0.0, {14}))
    for viewpoint in (wall.camera, None):
        face = lift(stone(wall, 14, rng, 0.0), wall_of_marks(photo, viewpoint, wall.camera), faces)
        np.testing.assert_allclose(face.outline, wall.corners[14], atol=1e-7)


def test_marks_on_the_relief_of_a_wall_are_kept_without_a_station_too() -> None:
    for seed in range(60):
        rng = np.random.default_rng(seed)
        wall = build(rng, relief=0.01)
        tied = wall_of_marks(photograph(wall, rng, 0.001, 0.5), None, wall.camera)
        assert tied.fit.rejected == ()
        assert len(tied.homography.rejected) <= 1  # this sight is some 25° off square
        face = lift(stone(wall, 14, rng, 0.5), tied, Neighbours(measured(wall, rng, 0.001, {14})))
        error = (face.outline - wall.corners[14]) @ face.fit.axes.T
        assert (np.abs(error) < 4 * face.sigma[:, None]).all()


# ------------------------------------------------------------------------------------------------------- precision


@pytest.mark.parametrize("near", [True, False])
def test_corners_are_as_precise_as_predicted(near: bool) -> None:
    # 250 walls: normalised variances 1 ± 0.2, of corners along the plane and of the face's height at the corners
    along, out = [], []
    for seed in range(250):
        rng = np.random.default_rng(seed)
        wall = build(rng)
        leave = {7, 14, 22} if near else {i for i in range(30) if i % 6 in (1, 2, 3, 4)}
        faces = Neighbours(measured(wall, rng, 0.002, leave))
        tied = wall_of_marks(photograph(wall, rng, 0.002, 1.0), wall.camera)
        whole = plane_of_wall(tied, faces)
        for index in (7, 14, 22) if near else (14,):
            face = lift(stone(wall, index, rng, 1.0), tied, faces, whole)
            assert ("of the wall" in face.text) is not near
            error = face.outline - wall.corners[index]
            along.append(error @ face.fit.axes.T / face.sigma[:, None])
            out.append(error @ face.fit.normal / face.fit.height_sigma(face.outline))
    assert np.var(along) == pytest.approx(1.0, abs=0.2)
    assert np.mean(np.array(along) ** 2) == pytest.approx(1.0, abs=0.2)
    assert np.mean(np.array(out) ** 2) == pytest.approx(1.0, abs=0.2)
    assert abs(np.mean(out)) < 4 / np.sqrt(len(out))


def test_precision_is_worse_far_outside_the_marks_and_then_refused() -> None:
    rng = np.random.default_rng(4)
    wall = build(rng, courses=5, stones=30)
    n = len(wall.corners)
    spots = [(60, 0), (66, 1), (126, 2), (120, 3)]
    marks = [PhotoMark(wall.seen(wall.corners[i, k]), wall.corners[i, k], 0.002, 10 + i) for i, k in spots]
    tied = wall_of_marks(Photograph("P1", 1.0, tuple(marks), "S1", 9), wall.camera)
    faces = Neighbours(measured(wall, rng, 0.002, set()))
    inside, outside = (lift(stone(wall, i, rng, 0.0), tied, faces) for i in (63, 69))
    assert outside.sigma.max() > 1.5 * inside.sigma.max()
    with pytest.raises(GeometryError, match=r"px outside the marks, which are \d+ px apart"):
        lift(stone(wall, 89, rng, 0.0), tied, faces)
    assert n == 150


def test_a_stone_that_is_known_too_badly_is_refused() -> None:
    rng = np.random.default_rng(5)
    wall = build(rng)
    photo = replace(photograph(wall, rng, 0.0, 0.0), sigma=60.0)
    tied = wall_of_marks(photo, wall.camera)
    with pytest.raises(GeometryError, match=r"is known to 0\.\d+ m only, of a stone of 0\.6"):
        lift(stone(wall, 14, rng, 0.0), tied, Neighbours(measured(wall, rng, 0.0, {14})))


# ----------------------------------------------------------------------------------------------------------- planes


def test_without_measured_faces_the_plane_is_that_of_the_marks() -> None:
    rng = np.random.default_rng(6)
    wall = build(rng, relief=0.0, tilt=0.0)
    tied = wall_of_marks(photograph(wall, rng, 0.0, 0.0), wall.camera)
    face = lift(stone(wall, 14, rng, 0.0), tied, Neighbours([]))
    assert face.text == "photograph P1, in the plane of its marks"
    np.testing.assert_allclose(face.outline, wall.corners[14], atol=1e-7)
    assert face.fit.redundancy == 0
    assert face.fit.rejected == ()
    assert face.fit.residuals.shape == face.fit.standardised.shape == (0,)
    assert np.isnan(face.fit.sigma0)


def test_faces_of_another_wall_are_no_neighbours() -> None:
    rng = np.random.default_rng(7)
    wall = build(rng, relief=0.0, tilt=0.0)
    faces = measured(wall, rng, 0.0, {14})
    behind = [replace(f, fit=replace(f.fit, normal=-f.fit.normal)) for f in faces]  # the wall's back
    yard = [
        replace(
            f,
            outline=f.outline + 8 * wall.normal,
            fit=replace(f.fit, centroid=f.fit.centroid + 8 * wall.normal),
        )
        for f in faces
    ]
    tied = wall_of_marks(photograph(wall, rng, 0.0, 0.0), wall.camera)
    for others in (behind, yard, faces[:2]):
        assert plane_of_wall(tied, Neighbours(others)) is None
        assert lift(stone(wall, 14, rng, 0.0), tied, Neighbours(others)).text.endswith("its marks")
    assert lift(stone(wall, 14, rng, 0.0), tied, Neighbours(faces)).text.count("W") >= 6


def test_neighbours_are_those_within_half_the_stones_size() -> None:
    # slow reference: sample both outlines densely
    rng = np.random.default_rng(8)
    wall = build(rng, courses=8, stones=10)
    faces = measured(wall, rng, 0.001, {35})
    found = Neighbours(faces).near(wall.corners[35], wall.normal)

    def sampled(polygon: Array) -> Array:
        part = np.linspace(0, 1, 60, endpoint=False)[:, None, None]
        return ((1 - part) * polygon + part * np.roll(polygon, -1, axis=0)).reshape(-1, 3)

    reach = 0.5 * np.linalg.norm(wall.corners[35, 2] - wall.corners[35, 0])
    mine = sampled(wall.corners[35])
    expected = [
        i
        for i, face in enumerate(faces)
        if np.linalg.norm(mine[:, None] - sampled(face.outline)[None], axis=2).min() <= reach
    ]
    assert found.tolist() == expected
    assert 6 <= len(expected) <= 20


def test_a_wall_that_nobody_stood_before_faces_the_way_of_its_stones() -> None:
    rng = np.random.default_rng(9)
    wall = build(rng)
    photo = photograph(wall, rng, 0.0005, 0.2, station=None)
    faces = measured(wall, rng, 0.001, {14})
    head = SurveyHead("w", "w.moma", photographs=(photo,))
    ((_, face),) = lift_faces([stone(wall, 14, rng, 0.2)], head.photographs, faces, head)
    assert isinstance(face, LiftedFace)
    assert face.fit.normal @ wall.normal > 0.99


@pytest.mark.parametrize("count", [1, 2, 8])
def test_points_measured_on_the_face_fix_its_plane(count: int) -> None:
    rng = np.random.default_rng(10)
    wall = build(rng)
    raised = wall.corners.copy()
    raised[14] += 0.03 * wall.normal
    wall = replace(wall, corners=raised)
    faces = Neighbours(measured(wall, rng, 0.001, {14}))
    tied = wall_of_marks(photograph(wall, rng, 0.0, 0.0), wall.camera)
    plain = stone(wall, 14, rng, 0.0)
    points = rng.dirichlet(np.ones(4), count) @ wall.corners[14] + rng.normal(0, 1e-4, (count, 3))
    own = lift(replace(plain, points=points, sigma=1e-3), tied, faces)
    without = lift(plain, tied, faces)
    assert np.abs((points - own.fit.centroid) @ own.fit.normal).max() < 0.002
    assert np.abs((own.outline - wall.corners[14]) @ wall.normal).max() < 0.012
    assert np.abs((without.outline - wall.corners[14]) @ wall.normal).max() > 0.02
    assert own.fit.height_sigma(points).max() < 0.5 * without.fit.height_sigma(points).max()
    assert own.fit.redundancy == max(count - 3, 0)
    assert f"{count} point{'s' if count > 1 else ''} measured on it" in own.text


def test_covariance_as_a_fit_gives_the_heights_precision_everywhere() -> None:
    # by adding the 3 × 3 covariance of tilts and height up at each corner
    rng = np.random.default_rng(11)
    wall = build(rng)
    faces = Neighbours(measured(wall, rng, 0.002, {14, 20, 21, 15}))
    tied = wall_of_marks(photograph(wall, rng, 0.002, 1.0), wall.camera)
    whole = plane_of_wall(tied, faces)
    assert whole is not None
    bare = lift(stone(wall, 29, rng, 1.0), tied, Neighbours([]), whole)
    on_marks, _ = tied.on_plane(stone(wall, 29, rng, 0.0).image)
    expected = whole.face_at(on_marks.mean(axis=0), "").height_sigma(bare.outline)
    np.testing.assert_allclose(bare.fit.height_sigma(bare.outline), expected, rtol=1e-3)
    assert bare.fit.covariance[0, 1] == bare.fit.covariance[0, 2] == 0.0


# ----------------------------------------------------------------------------------------------------------- errors


def tied_and_faces(seed: int) -> tuple[Wall, MarkedWall, list[Face], SurveyHead]:
    rng = np.random.default_rng(seed)
    wall = build(rng)
    photo = photograph(wall, rng, 0.001, 0.5)
    head = SurveyHead("w", "w.moma", stations=(Station("S1", wall.camera),), photographs=(photo,))
    return wall, wall_of_marks(photo, wall.camera), measured(wall, rng, 0.001, {14, 15}), head


def test_stones_come_in_order_and_errors_with_them() -> None:
    wall, _, faces, head = tied_and_faces(12)
    rng = np.random.default_rng(0)
    good, other = stone(wall, 14, rng, 0.5), stone(wall, 15, rng, 0.5)
    far = replace(stone(wall, 15, rng, 0.5), code="far", image=good.image + 9000.0)
    lost = replace(good, code="lost", photograph="P7")
    out = list(lift_faces([good, far, lost, other], head.photographs, faces, head))
    assert [record.code for record, _ in out] == ["W14", "far", "lost", "W15"]
    assert isinstance(out[0][1], LiftedFace)
    assert isinstance(out[3][1], LiftedFace)
    assert isinstance(out[1][1], GeometryError)
    assert str(out[1][1]).startswith("stone far (line 50), photograph P1: corner")
    assert isinstance(out[2][1], SurveyError)
    assert "no photograph 'P7'; photographs of this survey: P1" in str(out[2][1])


def test_a_photograph_that_cannot_be_tied_is_the_error_of_all_its_stones() -> None:
    wall, _, faces, head = tied_and_faces(13)
    rng = np.random.default_rng(0)
    few = replace(head.photographs[0], marks=head.photographs[0].marks[:3])
    for photo in (few, replace(head.photographs[0], station="S9")):
        errors = [
            e for _, e in lift_faces([stone(wall, 14, rng, 0), stone(wall, 15, rng, 0)], [photo], faces, head)
        ]
        assert all(isinstance(error, MomaError) for error in errors)
        assert "stone W15 (line 50)" in str(errors[1])


def test_marks_that_contradict_each_other_are_named_by_their_lines() -> None:
    wall, _, _, head = tied_and_faces(14)
    marks = list(head.photographs[0].marks[:5])
    marks[1] = replace(marks[1], image=marks[1].image + 80.0)
    with pytest.raises(
        GeometryError, match=r"photograph P1 \(line 9\), mark at line 10.*contradict each other"
    ):
        wall_of_marks(replace(head.photographs[0], marks=tuple(marks)), wall.camera)


def test_a_station_behind_the_wall_is_refused() -> None:
    _, _, _, head = tied_and_faces(15)
    photo = head.photographs[0]
    beside = photo.marks[0].position + FRAME @ np.array([40.0, 0.5, 0.0])
    with pytest.raises(GeometryError, match="at less than 10°"):
        wall_of_marks(photo, beside)


def test_a_stone_without_corners_on_the_photograph_is_refused() -> None:
    wall, tied, faces, _ = tied_and_faces(16)
    empty = replace(stone(wall, 14, np.random.default_rng(0), 0), image=np.empty((2, 2)))
    with pytest.raises(GeometryError, match="2 corners on the photograph"):
        lift(empty, tied, Neighbours(faces))


def test_corners_that_coincide_are_refused() -> None:
    wall, tied, _, _ = tied_and_faces(17)
    spot = replace(stone(wall, 14, np.random.default_rng(0), 0), image=np.tile(tied.marks[0], (4, 1)))
    with pytest.raises(GeometryError, match="corners on the photograph coincide"):
        lift(spot, tied, Neighbours([]))


def test_a_blunder_among_points_measured_on_the_face_is_left_out_and_told() -> None:
    rng = np.random.default_rng(10)
    wall = build(rng)
    faces = Neighbours(measured(wall, rng, 0.001, {14}))
    tied = wall_of_marks(photograph(wall, rng, 0.0, 0.0), wall.camera)
    points = rng.dirichlet(np.ones(4), 8) @ wall.corners[14]
    points[3] += 0.29 * wall.normal
    # so imprecise that they correct the prediction and do not replace it
    lifted = lift(replace(stone(wall, 14, rng, 0.0), points=points, sigma=0.02), tied, faces)
    assert "corrected by 8 points measured on it, 1 of them left out" in lifted.text
    assert np.abs((lifted.outline - wall.corners[14]) @ wall.normal).max() < 0.01


def test_one_mark_off_the_plane_of_the_others_does_not_turn_it() -> None:
    rng = np.random.default_rng(0)
    across, off, up = rng.uniform(0.0, 5.0, 30), rng.normal(0.0, 0.002, 30), rng.uniform(0.0, 5.0, 30)
    off[3] += 0.5
    marks = tuple(
        PhotoMark((x, z), np.array([x, y, z]), 1e-3, 10 + i)
        for i, (x, y, z) in enumerate(zip(across, off, up, strict=True))
    )
    tied = wall_of_marks(Photograph("P1", 0.01, marks, None, 9), None, np.array([2.5, 20.0, 2.5]))
    tilt = np.degrees(np.arccos(abs(tied.fit.normal[1])))
    assert tilt < 0.1  # by least squares of all marks 1.0°
