"""Stored runs against the result of the simulation: a small wall, near the origin and far from it."""

import numpy as np
import pytest
from sqlalchemy import func, select

from archmodel.database.session import open_database
from archmodel.describe.trace import trace
from archmodel.tables.entities import Entity
from archmodel.tables.runs import ContactPoint, EntityResult, JointResult, Run
from archmodel.tables.surveys import Simplification
from mechanics.scene.scene import Fidelity
from pipelines.ingest.ingest import ingest
from pipelines.run import run as run_module
from pipelines.run.assemble import assemble
from pipelines.run.record import surveyed_widths
from pipelines.run.run import run_scene
from pipelines.scene.file import read_scene
from survey.joints.report import ClosingReport
from survey.joints.report import StoneJoint as SurveyedJoint
from survey.joints.settings import JointMode
from tests.pipelines.results_by_hand import joints_of
from tests.pipelines.scenes import THREE_STONES, survey_text

FAR = np.array([652_345.0, 6_862_789.0, 1_040.0])

SCENE = (
    THREE_STONES
    + """\
[time]
step = 0.004
[solver]
tolerance = 1e-9
[output]
pictures = []
"""
)

# lowest left corner and length of the faces [m]; the joints between them are open by 10 mm
FACES = {"LEFT": (1, 0.0, 0.0, 0.5), "RIGHT": (1, 0.51, 0.0, 0.5), "TOP": (2, 0.2, 0.3, 0.6)}


def stone(course, x, z, length):
    rng = np.random.default_rng(course)
    corners = np.array([(x, 0, z), (x + length, 0, z), (x + length, 0, z + 0.29), (x, 0, z + 0.29)])
    inside = np.column_stack([rng.uniform(x, x + length, 6), np.zeros(6), rng.uniform(z, z + 0.29, 6)])
    return course, corners, inside


@pytest.fixture(params=["near", "far"])
def ran(request, new_url, tmp_path, monkeypatch):
    """Yield a session, the result of the simulation, its assembly, and the number of the stored run."""
    stones = {code: stone(*face) for code, face in FACES.items()}
    shift = np.zeros(3) if request.param == "near" else FAR
    (tmp_path / "wall.moma").write_text(survey_text(stones, shift))
    (tmp_path / "scene.toml").write_text(SCENE)
    url, given = new_url(), []
    ingest([tmp_path / "wall.moma"], url)
    simulate = run_module.simulate

    def listening(*asked):
        given.append(simulate(*asked))
        return given[0]

    monkeypatch.setattr(run_module, "simulate", listening)
    done = run_scene(tmp_path / "scene.toml", url, tmp_path / "out")
    with open_database(url) as database:
        with database.session(read_only=True) as session:
            assembly = assemble(read_scene(tmp_path / "scene.toml"), session)
        with database.session(read_only=True) as session:
            yield session, given[0], assembly, done.run


def columns(rows, *names):
    return np.array([[getattr(row, name) for name in names] for row in rows])


def test_everything_of_a_run_is_stored_and_adds_up(ran):
    session, result, assembly, number = ran
    codes = {entity.id: entity.code for entity in session.scalars(select(Entity))}
    run = session.get_one(Run, number)
    check_the_run(run, result)
    points = session.scalars(
        select(ContactPoint).where(ContactPoint.run_id == number).order_by(ContactPoint.number)
    ).all()
    joints = session.scalars(
        select(JointResult).where(JointResult.run_id == number).order_by(JointResult.number)
    ).all()
    assert len(points) == len(result.contacts.gap) == run.contacts >= 8
    assert len(joints) == len(result.joints) >= 2
    check_contact_points(points, result, assembly, codes)
    check_joints(joints, result, assembly, codes)
    check_equilibrium(points, result, assembly, codes)
    check_sums_over_joints(joints, points)
    check_solids(session, number, assembly, codes)


def check_the_run(run, result):
    assert (run.scene, run.outcome, run.steps) == ("Three stones", "equilibrium", result.steps)
    assert run.scene_text == SCENE
    assert run.simulated == result.time
    assert run.wall > 0
    for name in ("natural_map", "penetration", "balance", "reaction", "energy"):
        assert getattr(run, name) == getattr(result.errors, name)
    assert {"moma", "python", "numpy", "scipy", "numba", "scikit-fem", "gmsh", "sqlalchemy"} <= set(
        run.versions
    )
    assert run.versions["numpy"] == np.__version__
    settings = run.entry.settings
    # what the file says, and what it leaves to the program
    assert settings["time"]["step"] == 0.004
    assert settings["solver"]["tolerance"] == 1e-9
    assert settings["time"]["theta"] == result.scene.time.theta
    assert settings["solver"]["method"] == "auto"
    assert settings["contact"]["law"] == {
        "type": "DryJoint",
        "friction": 0.6,
        "dynamic_friction": None,
        "restitution": 0.0,
    }
    assert settings["joints"]["mode"] == "close"
    assert run.as_of.action == "geometry"  # relations come last when stones are taken in
    assert run.entry.action == "run"


def check_contact_points(points, result, assembly, codes):
    """Each row is the point of the same number of the simulation, in the frame of the site."""
    contacts, order = result.contacts, [body.code for body in result.bodies]
    for side, name in enumerate(("candidate_id", "antagonist_id")):
        assert [codes[getattr(point, name)] for point in points] == [
            order[body] for body in contacts.bodies[:, side]
        ]
    placed = contacts.point + assembly.origin
    np.testing.assert_array_equal(columns(points, "x", "y", "z"), placed)
    np.testing.assert_array_equal(columns(points, "nx", "ny", "nz"), contacts.normal)
    np.testing.assert_array_equal(columns(points, "fx", "fy", "fz"), contacts.force)
    for name in ("area", "gap", "opening", "slide"):
        np.testing.assert_array_equal(columns(points, name)[:, 0], getattr(contacts, name))
    assert [point.status for point in points] == contacts.status.tolist()
    assert [-1 if point.joint is None else point.joint for point in points] == contacts.joint.tolist()


def check_joints(joints, result, assembly, codes):
    given, order = result.joints, [body.code for body in result.bodies]
    assert [(codes[one.first_id], codes[one.second_id]) for one in joints] == [
        (order[first], order[second]) for first, second in given.bodies
    ]
    np.testing.assert_array_equal(columns(joints, "x", "y", "z"), given.centroid + assembly.origin)
    for name in ("pressure_mean", "pressure_max", "kern", "friction_use", "slipping", "open"):
        stored = [getattr(one, name) for one in joints]
        wanted = [None if np.isnan(value) else value for value in getattr(given, name)]
        assert stored == wanted, name
    for name in ("area", "gap", "opening", "sliding", "parted"):
        assert [getattr(one, name) for one in joints] == getattr(given, name).tolist()
    assert columns(joints, "width")[:, 0] == pytest.approx(0.010, abs=1e-6)  # as the faces were surveyed


def check_equilibrium(points, result, assembly, codes):
    """Contact forces on the free stone carry its weight, and have no moment about its centre, in the site's frame."""
    (block,) = (one for one in assembly.scene.blocks if one.fidelity is not Fidelity.FIXED)
    (body,) = (one for one in result.bodies if one.code == block.code)
    # the solid is a hexahedron cut by planes; its weight is that of its volume, found by tetrahedra about a corner
    weight = 2350.0 * 9.81 * tetrahedra(block.vertices, block.faces)[0]
    assert weight == pytest.approx(9.81 * body.mass, rel=1e-12)
    centre = tetrahedra(block.vertices, block.faces)[1] + assembly.origin
    force, moment = np.zeros(3), np.zeros(3)
    for point in points:
        sign = {block.code: 1.0}.get(codes[point.candidate_id], 0.0)
        sign -= {block.code: 1.0}.get(codes[point.antagonist_id], 0.0)
        one = sign * np.array([point.fx, point.fy, point.fz])
        force += one
        moment += np.cross(np.array([point.x, point.y, point.z]) - centre, one)
    np.testing.assert_allclose(force, [0.0, 0.0, weight], atol=1e-4 * weight)
    np.testing.assert_allclose(moment, 0.0, atol=1e-4 * weight * 0.3)


def tetrahedra(vertices, faces):
    """Volume and centroid of a convex solid, from the tetrahedra between its first corner and its faces."""
    apex, volume, first = vertices[0], 0.0, np.zeros(3)
    for face in faces:
        for i in range(1, len(face) - 1):
            a, b, c = vertices[[face[0], face[i], face[i + 1]]] - apex
            part = np.linalg.det([a, b, c]) / 6.0
            volume += part
            first += part * (a + b + c) / 4.0
    return volume, apex + first / volume


def check_sums_over_joints(joints, points):
    """The force of a joint is the sum over its points, taken on its first stone."""
    for joint in joints:
        own = [point for point in points if point.joint == joint.number]
        assert own
        turned = [1.0 if point.candidate_id == joint.first_id else -1.0 for point in own]
        total = np.array(turned) @ columns(own, "fx", "fy", "fz")
        normal = np.array([joint.nx, joint.ny, joint.nz])
        scale = np.linalg.norm(total) + 1.0
        assert joint.force_normal == pytest.approx(total @ normal, abs=1e-9 * scale)
        across = total - (total @ normal) * normal
        assert joint.force_shear == pytest.approx(np.linalg.norm(across), abs=1e-9 * scale)
        assert joint.area == pytest.approx(sum(point.area for point in own), rel=1e-6)


def check_solids(session, number, assembly, codes):
    """Joints of 10 mm were closed: corners on them moved by half of that, others not at all."""
    solids = session.scalars(select(Simplification).where(Simplification.run_id == number)).all()
    blocks = {block.code: block for block in assembly.scene.blocks}
    assert {codes[one.entity_id] for one in solids} == set(FACES)
    for one in solids:
        block = blocks[codes[one.entity_id]]
        np.testing.assert_array_equal(one.vertices, block.vertices + assembly.origin)
        assert [tuple(face) for face in one.faces] == list(block.faces)
        assert one.mode == "close"
        assert 0.004 < one.displacement_max < 0.01
        volume = tetrahedra(block.vertices, block.faces)[0]
        length = FACES[block.code][3]
        assert one.volume_change == pytest.approx(volume / (length * 0.29 * 0.4) - 1.0, abs=1e-6)
        # the faces are rectangles
        assert (one.shape, one.blockiness, one.within_tolerance) == ("hexahedron", 1.0, True)
        assert one.worst_angle == pytest.approx(0.0, abs=1e-6)


def test_the_surveyed_width_of_a_joint_is_that_of_the_same_stones_in_like_orientation():
    """Stones a and b face each other across a bed and beside it; b and c were measured into each other; d is alone."""
    up, along = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    surveyed = tuple(
        SurveyedJoint(stones, number, width, 0.5, 1.0, np.zeros(3), normal, "")
        for number, (stones, width, normal) in enumerate(
            ((("a", "b"), 0.03, along), (("b", "a"), 0.01, up), (("b", "c"), -0.004, up))
        )
    )
    closing = ClosingReport(JointMode.CLOSE, surveyed, {}, {}, ("d",), (), ())
    joints = joints_of([(1, 0), (2, 1), (3, 2)], np.tile([0.0, 0.0, 900.0], (3, 1)), [1.0, 2.0, 3.0])
    widths = surveyed_widths(joints, ["a", "b", "c", "d"], closing)
    assert widths == pytest.approx([0.01, np.nan, np.nan], nan_ok=True)


def test_a_result_leads_back_to_the_points_that_were_measured(ran):
    session, _, assembly, number = ran
    told = trace(session, "TOP")
    assert (told.run.id, told.result.fidelity) == (number, "rigid")
    (model,) = (one for one in assembly.models if one.record.code == "TOP")
    np.testing.assert_array_equal(told.measurement.points, model.record.points)
    assert len(told.measurement.residuals) == 6
    assert told.place.endswith(f"wall.moma:{model.record.line}")
    assert not told.is_outdated
    assert session.scalar(select(func.count()).select_from(EntityResult)) == 3
