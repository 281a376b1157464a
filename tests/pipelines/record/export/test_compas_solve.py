"""MOMA as a solver of COMPAS, against numbers that compas_dem 0.6 and compas_cra 0.8 gave for the same documents.

The reference values were measured with COMPAS 2.15, compas_dem 0.6.0 and compas_cra 0.8.0: volumes by `mesh_volume`
of compas_cgal 0.10, contact areas by `BlockModel.compute_contacts`, resultants by `rbe_solve` with μ = 0.7.
"""

import json
from itertools import pairwise

import numpy as np
import pytest

from ground.errors import SceneError, UsageError
from mechanics.scene.shapes import LIMESTONE
from pipelines.record.export.compas_problem import read_problem
from pipelines.record.export.compas_solve import moma_solve

QUADS = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
DENSITY, GRAVITY = 2200.0, 9.81  # of compas_dem's limestone, and of all its solvers


def box(low, high):
    (a, b, c), (d, e, f) = low, high
    return [(x, y, z) for z in (c, f) for x, y in ((a, b), (d, b), (d, e), (a, e))]


def block(corners, support=False, faces=QUADS):
    vertex = {str(at): dict(zip("xyz", map(float, one), strict=True)) for at, one in enumerate(corners)}
    mesh = {"vertex": vertex, "face": {str(at): list(one) for at, one in enumerate(faces)}}
    geometry = {"dtype": "compas.datastructures/Mesh", "data": mesh}
    data = {"transformation": None, "features": [], "name": "Block", "material": "m", "is_support": support}
    return {"dtype": "compas_dem.elements/Block", "data": data | {"geometry": geometry}}


def model_of(blocks, edges=(), density=DENSITY):
    guids = [f"g{at}" for at in range(len(blocks))]
    graph = {"node": {str(at): {"element": guid} for at, guid in enumerate(guids)}, "edge": {}}
    for first, second in edges:
        graph["edge"].setdefault(str(first), {})[str(second)] = {}
    data = {
        "transformation": None,
        "elements": dict(zip(guids, blocks, strict=True)),
        "materials": {"m": {"dtype": "compas_dem.material/Stone", "data": {"density": density, "name": "m"}}},
        "tree": {"root": {"children": [{"element": guid} for guid in guids]}},
        "graph": graph,
    }
    return {"dtype": "compas_dem.models/BlockModel", "data": data, "guid": "the model"}


def typed(kind, **data):
    return {"dtype": f"compas_dem.problem/{kind}", "data": data}


def problem_of(*groups, model_id="the model", joint=None, **law):
    law = {"mu": 0.7, "c": None, "t_c": None} | law
    properties = {"contact_model": {"data": law}, "joint_model": joint}
    data = {"name": "test", "model_id": model_id, "solver": None, "contact_properties": {"data": properties}}
    groups = [typed("BoundaryConditionGroup", **one) for one in groups]
    return {
        "dtype": "compas_dem.problem/Problem",
        "data": data | {"boundary_conditions": groups},
        "guid": "p",
    }


def solved(blocks, *groups, edges=(), **law):
    return moma_solve(problem_of(*groups, **law), model_of(blocks, edges))["data"]


def resultant(results, edge):
    return np.array(results["edge_data"][edge]["resultant_global"])


def areas(results):
    return {
        edge: sum(one["data"]["size"] for one in found["contacts"])
        for edge, found in results["edge_data"].items()
    }


def arch(count=30, rise=3.0, span=10.0, thickness=0.5, depth=0.5):
    """Corners of the voussoirs of a segmental arch, as compas_dem's template of this name has them."""
    radius = rise / 2 + span**2 / (8 * rise)
    half = np.arcsin(span / 2 / radius) if rise < radius else np.pi - np.arcsin(span / 2 / radius)
    angles = np.linspace(half, -half, count + 1)
    middle = rise - radius
    rings = [
        [
            (r * np.sin(a), y, middle + r * np.cos(a))
            for r, y in ((radius, 0), (radius, depth), (radius + thickness, depth), (radius + thickness, 0))
        ]
        for a in angles
    ]
    return [[*one, *two] for one, two in pairwise(rings)]


VOUSSOIR = ((0, 1, 2, 3), (7, 6, 5, 4), (3, 7, 4, 0), (6, 2, 1, 5), (7, 3, 2, 6), (5, 1, 0, 4))
COLUMN = [
    box((0.05 * k - 0.8 + 0.1 * k, -0.5, 0.5 * k), (0.05 * k + 0.8 - 0.1 * k, 0.5, 0.5 * k + 0.5))
    for k in range(4)
]
PLATE = box((-1, -1, -0.5), (1, 1, 0))
CUBE = box((-0.5, -0.5, 0), (0.5, 0.5, 1))
WEIGHT = DENSITY * GRAVITY  # of the cube


@pytest.fixture(scope="module")
def of_arch():
    blocks = [block(one, at in (0, 29), VOUSSOIR) for at, one in enumerate(arch())]
    return solved(blocks, edges=[(at, at + 1) for at in range(29)])


def test_the_weights_and_areas_of_an_arch_are_those_of_compas(of_arch):
    volumes = np.array(list(of_arch["metadata"]["volumes"].values()))
    assert len(volumes) == 30
    assert np.abs(volumes / 0.10649052810078458 - 1).max() < 1e-6
    found = areas(of_arch)
    assert len(found) == 29
    assert np.abs(np.array(list(found.values())) / 0.25 - 1).max() < 1e-6


def test_the_thrust_of_an_arch_is_that_of_rbe(of_arch):
    # compas_cra gives the force on the second block of an edge; both choose the state of least squares
    assert of_arch["metadata"]["outcome"] == "equilibrium"
    for edge, wanted in (("0,1", (-24911.58, 0.0, 32174.88)), ("14,15", (-24911.58, 0.0, -1.02))):
        assert np.abs(-resultant(of_arch, edge) - wanted).max() < 0.01 * np.linalg.norm(wanted)


def test_a_column_has_the_weights_areas_and_resultants_of_compas():
    results = solved([block(one, at == 0) for at, one in enumerate(COLUMN)], edges=[(0, 1), (1, 2), (2, 3)])
    assert np.allclose(list(results["metadata"]["volumes"].values()), [0.8, 0.7, 0.6, 0.5], rtol=1e-6)
    assert areas(results) == pytest.approx({"0,1": 1.4, "1,2": 1.2, "2,3": 1.0}, rel=1e-6)
    # statically determinate: RBE gives these to the last digit
    for edge, wanted in (("0,1", 38847.6), ("1,2", 23740.2), ("2,3", 10791.0)):
        assert resultant(results, edge) == pytest.approx((0.0, 0.0, -wanted), rel=1e-4, abs=1e-4 * wanted)


@pytest.mark.slow
def test_a_block_between_two_posts_falls_which_rbe_does_not_see():
    # the H of compas_cra: RBE presses the posts together with 22.2 kN that nothing in the model causes
    post = [box((-1.1, -0.5, -1.0), (-0.9, 0.5, 1.4)), box((0.9, -0.5, -1.0), (1.1, 0.5, 1.4))]
    beam = box((-0.9, -0.5, -0.2), (0.9, 0.5, 0.6))
    results = solved([block(post[0], True), block(post[1], True), block(beam)], edges=[(0, 2), (1, 2)])
    assert results["metadata"]["outcome"] == "collapsed"
    assert areas(results) == pytest.approx({"0,2": 0.8, "1,2": 0.8})
    moved = results["node_data"]["2"]["transformation"]["data"]["matrix"]
    assert moved[2][3] < -0.1


@pytest.mark.parametrize(
    ("group", "wanted"),
    [
        ({"g": 5.0}, (0, 0, -5.0 * DENSITY)),
        ({"body_forces": [typed("BodyForce", acceleration=[1.0, 0, 0])]}, (DENSITY, 0, -WEIGHT)),
        (
            {"point_loads": [typed("PointLoad", block_index=1, force=[0, 300.0, -900.0])]},
            (0, 300, -900 - WEIGHT),
        ),
        # the top of the cube is its face 1
        (
            {"surface_loads": [typed("SurfaceLoad", block_index=1, face_index=1, load=[0, 0, -800.0])]},
            (0, 0, -800 - WEIGHT),
        ),
        ({"point_loads": [typed("PointLoad", block_index=0, force=[0, 0, -900.0])]}, (0, 0, -WEIGHT)),
    ],
    ids=["gravity", "body force", "point load", "surface load", "on a support"],
)
def test_the_joint_below_a_cube_carries_its_weight_and_loads(group, wanted):
    results = solved([block(PLATE, True), block(CUBE)], group, edges=[(0, 1)])
    assert results["metadata"]["outcome"] == "equilibrium"
    assert resultant(results, "0,1") == pytest.approx(wanted, rel=1e-3, abs=1e-3 * WEIGHT)


@pytest.mark.parametrize(
    "load",
    [
        typed("PointLoad", block_index=1, force=[0, 0, -WEIGHT], point=[0.25, 0.0, 1.0]),
        typed("PointLoad", block_index=1, force=[0, 0, -WEIGHT], moment=[0, 0.25 * WEIGHT, 0]),
    ],
    ids=["point", "moment"],
)
def test_a_load_off_the_middle_moves_the_centre_of_pressure(load):
    results = solved([block(PLATE, True), block(CUBE)], {"point_loads": [load]}, edges=[(0, 1)])
    edge = results["edge_data"]["0,1"]
    points, normal = np.array(edge["contact_points"]), np.array(edge["force_normal"])
    centre = normal @ points / normal.sum()
    # half of all acts at 0.25 m
    assert centre == pytest.approx((0.125, 0.0, 0.0), abs=1e-3)


@pytest.mark.slow
def test_a_support_that_is_displaced_takes_its_blocks_along():
    sunk = typed("Translation", block_index=0, translation=[None, None, -0.02])
    results = solved([block(PLATE, True), block(CUBE)], {"displacements": [sunk]}, edges=[(0, 1)])
    for node in ("0", "1"):
        matrix = np.array(results["node_data"][node]["transformation"]["data"]["matrix"])
        assert matrix[:3, 3] == pytest.approx((0, 0, -0.02), abs=1e-4)
        assert np.abs(matrix[:3, :3] - np.eye(3)).max() < 1e-4


def test_laws_follow_from_strengths_and_stiffnesses():
    def law(**given):
        blocks = [block(PLATE, True), block(CUBE)]
        return read_problem(problem_of(**given), model_of(blocks)).scene.contact.law

    assert type(law()).__name__ == "DryJoint"
    mortar = law(c=7e4, t_c=2e4)
    assert (mortar.friction, mortar.shear, mortar.tension) == (0.7, 7e4, 2e4)
    assert law(c=7e4).tension == pytest.approx(1e5)  # no cutoff: the apex of the cone
    springs = law(joint={"data": {"kn": 1e9, "kt": 4e8}})
    assert (springs.normal_stiffness, springs.shear_stiffness) == (1e9, 4e8)


def test_forces_follow_the_direction_of_the_edge_of_the_model():
    blocks = [block(PLATE, True), block(CUBE)]
    forward, backward = (
        resultant(solved(blocks, edges=[edge]), name) for edge, name in (((0, 1), "0,1"), ((1, 0), "1,0"))
    )
    assert forward[2] < 0 < backward[2]
    assert forward == pytest.approx(-backward)


def test_a_text_gives_a_text_and_the_same_bytes_again():
    problem, model = problem_of(), model_of([block(PLATE, True), block(CUBE)], [(0, 1)])
    text = moma_solve(json.dumps(problem), json.dumps(model))
    assert text == moma_solve(json.dumps(problem), json.dumps(model))
    document = json.loads(text)
    assert document["dtype"] == "compas_dem.problem/Results"
    assert (document["data"]["model_id"], document["data"]["problem_id"]) == ("the model", "p")


@pytest.mark.parametrize(
    ("problem", "model", "said"),
    [
        (problem_of(model_id="other"), model_of([block(CUBE)]), "of another model"),
        (problem_of({"g": 9.81}, {"g": 1.0}), model_of([block(CUBE)]), "different gravities: 1, 9.81"),
        (problem_of(), model_of([block(CUBE)], density=None), "block 0: no density"),
        (problem_of(mu=None, phi=None), model_of([block(CUBE)]), "malformed: TypeError"),
        (
            problem_of({"point_loads": [typed("PointLoad", block_index=7, force=[0, 0, 1])]}),
            model_of([block(CUBE)]),
            "there is no block 7",
        ),
        (
            problem_of({"displacements": [typed("Translation", block_index=0, translation=[1, 0, 0])]}),
            model_of([block(CUBE)]),
            "is no support; make it a support",
        ),
    ],
)
def test_what_cannot_be_simulated_is_refused_with_the_way_out(problem, model, said):
    with pytest.raises(SceneError, match=said):
        moma_solve(problem, model)


def test_a_problem_without_a_contact_model_is_refused():
    problem = problem_of()
    problem["data"]["contact_properties"]["data"]["contact_model"] = None
    with pytest.raises(SceneError, match="no contact model"):
        moma_solve(problem, model_of([block(CUBE)]))


def test_what_is_no_document_is_refused():
    with pytest.raises(UsageError, match="list is no document of COMPAS"):
        moma_solve([], model_of([block(CUBE)]))


def test_a_step_is_shorter_than_what_a_survey_sees_and_a_search_longer_than_any_fall():
    """A block falls by less than 0.3 mm in a step, a fifth of a survey's millimetres, and 300 m within the search."""
    cube = [block(box((0, 0, 0), (1, 1, 1)), True), block(box((0, 0, 1), (1, 1, 2)))]
    time = read_problem(problem_of(), model_of(cube)).scene.time
    assert 1e-4 < GRAVITY * time.step**2 < 3e-4
    assert 300.0 < GRAVITY * time.duration**2 / 2.0 < 900.0
    assert time.steps == 2000


def test_a_material_without_moduli_is_a_sound_limestone():
    cube = [block(box((0, 0, 0), (1, 1, 1)), True), block(box((0, 0, 1), (1, 1, 2)))]
    material = read_problem(problem_of(), model_of(cube)).scene.blocks[1].material
    assert (material.young, material.poisson) == (LIMESTONE.young, LIMESTONE.poisson)
