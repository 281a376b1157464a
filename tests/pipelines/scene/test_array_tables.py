"""Laws, loads and throws in scene files: the objects they make, and the line of every mistake."""

import re

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.scene.laws.cohesive_zone import CohesiveZone
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.lennard_jones import LennardJones
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.scene import Block, Fidelity, Placement
from mechanics.stones.meshing.elements import Element
from mechanics.stones.polyhedra import mass_properties
from moma.cli.text.checks import check_lines
from pipelines.run.check import check_scene
from pipelines.scene.file import parse_scene
from pipelines.scene.laws import law_rules
from tests.paths import ROOT
from tests.pipelines.scenes import TWO_COURSES, assembled, fails_at_line

STONE = "[materials.stone]\ndensity = 2000\nyoung = 1e10\npoisson = 0.2\n"
MORTAR = '[[laws]]\ntype = "mortar"\nfriction = 0.5\ntension = 1e5\nshear = 2e5\n'
SPRINGS = '[[laws]]\ntype = "elastic_joint"\nfriction = 0.5\nnormal_stiffness = 1e9\nshear_stiffness = 4e8\n'
SETTLEMENT = '[[loads]]\ntype = "settlement"\nstones = ["S1"]\ndisplacement = [0, 0, -0.02]\nduration = 5\n'

FORCE = "[[loads]]\ntype = 'force'\nstones = ['S']\n"
MOTION = "[[loads]]\ntype = 'motion'\nstones = ['S']\npivot = [0, 0, 0]\n"


def parsed(text):
    return parse_scene(text + STONE, "scene.toml")


def test_every_law_is_made_of_its_keys():
    scene = parsed(
        MORTAR
        + 'dynamic_friction = 0.4\n[[laws]]\ntype = "dry"\nfriction = 0.3\nrestitution = 0.1\n'
        + '[[laws]]\ntype = "cohesive_zone"\nfriction = 0.5\ntension = 3e5\nshear = 4e5\n'
        + "energy_tension = 50\nenergy_shear = 80\n"
        + SPRINGS
        + '[[laws]]\ntype = "elastic_joint"\nfriction = 0.7\nmortar_young = 1e9\nthickness = 0.01\n'
        + "tension = 1e5\nshear = 2e5\nenergy_tension = 5\nenergy_shear = 50\ncompressive_strength = 3e6\n"
        + '[[laws]]\ntype = "lennard_jones"\nfriction = 0.2\nforce = 5\ndistance = 1e-3\n'
    )
    assert [one.law for one in scene.laws] == [
        MortarJoint(0.5, 1e5, 2e5, 0.4),
        DryJoint(0.3, None, 0.1),
        CohesiveZone(0.5, 3e5, 4e5, 50.0, 80.0),
        ElasticJoint(0.5, 1e9, 4e8),
        ElasticJoint(0.7, None, None, 0.0, 1e5, 2e5, None, 5.0, 50.0, 3e6, mortar_young=1e9, thickness=0.01),
        LennardJones(0.2, 5.0, 1e-3),
    ]


def test_laws_hold_between_materials_or_groups_or_everywhere():
    scene = parsed(
        MORTAR
        + 'materials = ["stone", "brick"]\n'
        + MORTAR
        + 'between = [["A1", "A2"], "course = 1"]\n'
        + MORTAR
        + "[materials.brick]\ndensity = 1\nyoung = 1\npoisson = 0\nstones = ['B1']\n"
    )
    assert [one.entry.groups for one in scene.laws] == [
        (),
        (("between", ("A1", "A2")), ("between", ("course = 1",))),
        (),
    ]
    materials = {"A1": "stone", "A2": "stone", "B1": "brick"}
    groups = {
        ("laws", "0"): (),
        ("laws", "1"): (frozenset({"A1", "A2"}), frozenset({"B1"})),
        ("laws", "2"): (),
    }
    rules = law_rules(scene.document, scene.laws, groups, materials, {})
    assert [(set(rule.first), set(rule.second)) for rule in rules] == [
        ({"A1", "A2"}, {"B1"}),
        ({"A1", "A2"}, {"B1"}),
        (set(materials), set(materials)),
    ]
    with pytest.raises(SceneError, match=r"scene.toml:6: no selected stone is of 'brick'"):
        law_rules(scene.document, scene.laws, groups, {"A1": "stone"}, {})


def test_the_general_law_and_the_contact_points_are_those_of_the_contact_table():
    contact = parsed(
        "[contact]\nfriction = 0.7\ndynamic_friction = 0.5\nrestitution = 0.2\npoints = 8\nplacement = 'inertia'\n"
    ).contact
    assert contact.law == DryJoint(0.7, 0.5, 0.2)
    assert (contact.points, contact.placement) == (8, Placement.INERTIA)


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("[contact]\npoints = 5\n", 2, "points = 5 is unknown; known here: 1, 3, 4, 8"),
        ("[contact]\nplacement = 'corner'\n", 2, "did you mean 'corners'?"),
        ("[contact]\ndynamic_friction = 0.9\n", 2, "dynamic_friction = 0.9; give from 0 up to the static"),
        ("[laws]\ntype = 'dry'\n", 1, "'laws' is not a list of tables; write [[laws]] above each"),
        ("laws = [1]\n", 1, "'laws' is not a list of tables"),
        ("[[law]]\n", 1, "unknown table [law]; did you mean 'laws'?"),
        ("[[laws]]\nfriction = 0.5\n", 1, '[[laws]] has no \'type\'; give type: "dry" or "mortar"'),
        ("[[laws]]\ntype = 'mortor'\n", 2, "type = 'mortor' is unknown; did you mean 'mortar'?"),
        ("[[laws]]\ntype = 3\n", 2, "type = 3 is not a text"),
        (
            MORTAR.replace("shear", "sheer"),
            5,
            "unknown key 'sheer' in [[laws]] of type 'mortar'; did you mean 'shear'",
        ),
        (
            MORTAR.replace("shear = 2e5\n", ""),
            1,
            "[[laws]] of type 'mortar' has no 'shear'; give shear: a number [Pa]",
        ),
        (MORTAR.replace("1e5", "-1.0"), 4, "tension = -1.0 is out of range; give a number [Pa], at least 0"),
        (
            MORTAR + "dynamic_friction = 0.6\n",
            1,
            "dynamic_friction = 0.6; give from 0 up to the static friction, 0.5",
        ),
        (
            MORTAR.replace("2e5", "0"),
            1,
            "tension = 100000.0 holds nothing with friction = 0.5 and shear = 0; give a shear strength, of 50000 Pa",
        ),
        (
            SPRINGS + "tension = 2e4\n",
            1,
            "tension = 20000.0 holds nothing with friction = 0.5 and shear = 0; give a shear strength, of 10000 Pa",
        ),
        (MORTAR + "materials = ['stone']\n", 6, "1 materials; give two names"),
        (MORTAR + "materials = ['stone', 'ston']\n", 6, "unknown material 'ston'; did you mean 'stone'?"),
        (
            MORTAR + "materials = ['stone', 'stone']\nbetween = ['a', 'b']\n",
            7,
            "both 'materials' and 'between'",
        ),
        (MORTAR + "between = ['a']\n", 6, "between = ['a'] is not two lists of codes or expressions"),
        (MORTAR + "between = [['a'], []]\n", 6, "is not two lists"),
        (MORTAR + MORTAR.replace("0.5", "'x'"), 8, "friction = 'x' is not a number"),
        ("[[loads]]\ntype = 'force'\nstones = []\n", 3, "stones = [] is not a list of codes or expressions"),
        (
            SETTLEMENT.replace("duration = 5\n", ""),
            1,
            "has no 'duration'; give duration: a number [s], greater than 0",
        ),
        ("[[loads]]\ntype = 'tilt'\naxis = [0, 1, 0]\n", 1, "give either 'rate' or 'angle'"),
        (
            "[[loads]]\ntype = 'tilt'\naxis = [0, 1, 0]\nrate = 0.1\nangle = 3\n",
            1,
            "give either 'rate' or 'angle'",
        ),
        ("[[loads]]\ntype = 'motion'\nstones = ['S']\nspin = 3\n", 4, "a spin without a pivot"),
        (
            "[[loads]]\ntype = 'ground_motion'\nstones = ['S']\n",
            1,
            "without a record; give at least one of x, y, z",
        ),
        (
            "[[loads]]\ntype = 'ground_motion'\nstones = ['S']\nx = 'a.csv'\n",
            4,
            "the unit of the acceleration in 'a.csv'",
        ),
        (
            "[[loads]]\ntype = 'ground_motion'\nstones = ['S']\nx = 'a.csv'\nunit = 'furlong'\n",
            5,
            "unknown unit 'furlong'",
        ),
        ("[[meshes]]\nsize = 0.1\n", 1, "[[meshes]] has no 'stones'"),
        ("[[meshes]]\nstones = ['S']\nsize = 0\n", 3, "give a number [m], greater than 0"),
        (
            "[[meshes]]\nstones = ['S']\nelement = 'hex9'\n",
            3,
            "element = 'hex9' is unknown; did you mean 'hex8'",
        ),
        ("[[throw]]\nvelocity = [1, 0, 0]\n", 1, "[[throw]] has no 'stones'"),
        ("[[throw]]\nstones = ['S']\nvelocity = [1, 0]\n", 3, "not a list of three numbers"),
        (FORCE + "force = 3\n", 4, "force = 3 is not a list of three numbers or a table { time"),
        (
            FORCE + "force = { time = [0, 1] }\n",
            4,
            "force = { … } has no 'value'; give value: a list of lists",
        ),
        (
            FORCE + "force = { time = [0, 1], value = [1, 2] }\n",
            4,
            "value = [1, 2] is not a list of lists of three",
        ),
        (FORCE + "force = { time = [0, 1], value = [[1, 2, 3]] }\n", 4, "value has 1 entries for 2 times"),
        (
            FORCE + "force = { time = [0, 0], value = [[1, 2, 3], [1, 2, 3]] }\n",
            4,
            "time 0 s comes after 0 s",
        ),
        (FORCE + "force = { time = [-1], value = [[1, 2, 3]] }\n", 4, "time = [-1] is out of range"),
        (
            FORCE + "force = { times = [0] }\n",
            4,
            "unknown key 'times' in force = { … }; did you mean 'time'?",
        ),
        (
            FORCE + "[loads.force]\ntime = [0]\nvalue = [[1, 2, nan]]\n",
            6,
            "value = [[1, 2, nan]] is out of range",
        ),
        (
            MOTION + "spin = { time = [0, 1], value = [[1, 2, 3], [1, 2, 3]] }\n",
            5,
            "is not a list of numbers",
        ),
        (MOTION + "spin = { file = 'a.csv', time = [1] }\n", 5, "unknown key 'time' in spin = { … }"),
    ],
)
def test_a_mistake_is_named_with_its_line(text, line, said):
    fails_at_line(line, said, parsed, text)


def test_histories_are_constants_tables_or_files_beside_the_scene(tmp_path):
    (tmp_path / "push.csv").write_text("time, x, y, z\n0, 0, 0, 0\n2, 0, 4, 8\n")
    text = (
        FORCE
        + "force = [1, 2, 3]\n"
        + FORCE
        + "force = { file = 'push.csv' }\n"
        + MOTION
        + "spin = { time = [0, 2], value = [0, 90] }\n"
        + STONE
    )
    first, second, third = parse_scene(text, str(tmp_path / "scene.toml")).loads
    np.testing.assert_array_equal(first.values["force"](7.0), [1, 2, 3])
    np.testing.assert_array_equal(second.values["force"](1.0), [0, 2, 4])
    assert float(third.values["spin"](1.0)) == 45.0
    (tmp_path / "push.csv").write_text("0, 0, 0, 0\n2, 0, 4, 8\n2, 1, 1, 1\n")
    with pytest.raises(SceneError, match=r"push.csv:3: time 2 s comes after 2 s"):
        parse_scene(text, str(tmp_path / "scene.toml"))
    (tmp_path / "push.csv").write_text("0, 0\n2, 1\n")
    with pytest.raises(
        SceneError, match=r"push.csv:1: 2 columns; give time \[s\], x \[N\], y \[N\], z \[N\]"
    ):
        parse_scene(text, str(tmp_path / "scene.toml"))
    (tmp_path / "push.csv").unlink()
    with pytest.raises(SceneError, match=r"push.csv: cannot be read: No such file"):
        parse_scene(text, str(tmp_path / "scene.toml"))


@pytest.mark.parametrize("unit", ["m/s²", "m s⁻²", "M/SEC^2"])
def test_units_of_acceleration_are_read_in_any_spelling(tmp_path, unit):
    (tmp_path / "a.csv").write_text("0 0\n1 2\n2 0\n")
    head = f"[[loads]]\ntype = 'ground_motion'\nstones = ['S']\nunit = '{unit}'\ny = 'a.csv'\n"
    assert parse_scene(head + STONE, str(tmp_path / "scene.toml")).loads[0].values["y"].peak == 2.0
    with pytest.raises(SceneError, match=r"scene.toml:4: .*unknown unit 'm/s3'; give g, m/s2"):
        parse_scene(head.replace(unit, "m/s3") + STONE, str(tmp_path / "scene.toml"))


def test_records_are_read_filtered_and_corrected_as_asked(tmp_path):
    """A synthetic record of 1 Hz in cm/s², on a wrong baseline."""
    time = np.arange(0, 20, 0.01)
    rows = 50 * np.cos(2 * np.pi * time) + 2.0
    (tmp_path / "a.csv").write_text("\n".join(f"{t:.2f} {a:.6f}" for t, a in zip(time, rows, strict=True)))
    head = "[[loads]]\ntype = 'ground_motion'\nstones = ['S']\nunit = 'cm/s2'\ny = 'a.csv'\n"
    path = str(tmp_path / "scene.toml")
    raw = parse_scene(head + STONE, path).loads[0].values["y"]
    assert raw.peak == pytest.approx(0.52)
    kept = parse_scene(head + "baseline = 2\n" + STONE, path).loads[0].values["y"]
    assert abs(kept.displacement[-1]) < 1e-2 * abs(raw.displacement[-1])
    passed = parse_scene(head + "low = 0.2\norder = 2\n" + STONE, path).loads[0].values["y"]
    assert len(passed) - len(raw) == pytest.approx(2 * 0.75 * 2 / 0.2 / 0.01, abs=2)
    assert passed.source.endswith("a.csv, Butterworth 0.2 to 50 Hz (order 2, both ways)")
    for wrong, said in (("low = 60.0", "below 50 Hz"), ("baseline = 1", "degree = 1; give 2 or more")):
        with pytest.raises(SceneError) as caught:
            parse_scene(f"{head}{wrong}\n{STONE}", path)
        assert str(caught.value).startswith(f"{path}:5: ")
        assert said in str(caught.value)


def test_the_examples_of_the_documentation_are_valid():
    documented = (ROOT / "docs/scene.md").read_text(encoding="utf-8")
    examples = re.findall(r"^```toml\n(.*?)^```$", documented, re.MULTILINE | re.DOTALL)
    assert len(examples) == 9
    assert "[materials.sandstone.orthotropy]" in examples[1]
    material = (
        "[materials.sandstone]\ndensity = 2200\nyoung = 1e10\npoisson = 0.2\nstones = ['kind = sill']\n"
    )
    # every load of a scene with stages names them, so that example stands alone
    (staged,) = (one for one in examples if "[[stages]]" in one)
    assert len(parse_scene(f"{material}\n{staged}", "scene.toml").stages) == 5
    examples.remove(staged)
    # another [bodies]
    (arch,) = (one for one in examples if "voussoir and code like" in one)
    assert parse_scene(f"{material}\n{arch}", "scene.toml").bodies.deformable
    examples.remove(arch)
    scene = parse_scene("\n".join([material, *examples]), "scene.toml")
    assert scene.materials[0].material.orthotropy is not None
    assert (len(scene.meshes), len(scene.laws), len(scene.loads)) == (3, 2, 2)


@pytest.fixture
def build(url):
    return lambda text: assembled(url, TWO_COURSES + text).scene


def test_laws_and_loads_find_their_stones(build):
    scene = build(
        MORTAR
        + 'between = [["course = 1"], ["W02-01", "W02-02"]]\n'
        + '[[loads]]\ntype = "gravity_ramp"\nduration = 0.5\n'
        + '[[loads]]\ntype = "tilt"\naxis = [0, 1, 0]\nangle = { time = [0, 10], value = [0, 30] }\n'
        + '[[loads]]\ntype = "force"\nstones = ["W02-01", "W02-02"]\nforce = [0, 500, 0]\n'
        + '[[loads]]\ntype = "spreading"\nfirst = ["W01-01"]\nsecond = ["W01-02"]\ndirection = [2, 0, 0]\n'
        + "distance = 0.1\nduration = 2\n"
        + '[[loads]]\ntype = "motion"\nstones = ["W01-03"]\nspin = 90\npivot = [1, 2, 3]\n'
        + '[[throw]]\nstones = ["W02-03"]\nvelocity = [1, 2, 3]\nspin = [0, 0, 180]\n'
    )
    ground = {block.code for block in scene.blocks if block.code.startswith("W01")}
    (rule,) = scene.contact.rules
    assert (rule.first, rule.second) == (ground, {"W02-01", "W02-02"})
    assert rule.law == MortarJoint(0.5, 1e5, 2e5)
    ramp, tilt = scene.loads.gravity
    down = np.array(scene.gravity)
    np.testing.assert_allclose(ramp(0.25, down), down / 2)
    np.testing.assert_allclose(tilt(10.0, down), [9.81 * 0.5, 0, -9.81 * np.sqrt(0.75)], atol=1e-12)
    (force,) = scene.loads.forces
    assert force.stones == {"W02-01", "W02-02"}
    left, right, turn = scene.loads.motions
    assert (left.stones, right.stones) == ({"W01-01"}, {"W01-02"})
    np.testing.assert_allclose(right.pose(9.0).displacement, [0.05, 0, 0], atol=1e-15)
    np.testing.assert_allclose(turn.pose(1.0).rotation @ [1, 0, 0], [0, 1, 0], atol=1e-15)
    velocity = {block.code: block.velocity for block in scene.blocks}
    np.testing.assert_allclose(velocity.pop("W02-03"), (1, 2, 3, 0, 0, np.pi))
    assert not any(any(one) for one in velocity.values())


def test_a_force_at_a_point_takes_its_arm_from_the_centre_of_mass(build):
    text = '[[loads]]\ntype = "force"\nstones = ["W02-01"]\nforce = [0, 500, 0]\npoint = [1, 2, 3]\n'
    scene = build(text)
    block = next(one for one in scene.blocks if one.code == "W02-01")
    centre = mass_properties(block.vertices, block.faces).centroid
    np.testing.assert_allclose(scene.loads.forces[0].arm, np.array([1, 2, 3]) - centre)


def test_the_ground_shakes_along_its_azimuth(build, tmp_path):
    record = tmp_path / "a.csv"
    record.write_text("0 0\n1 2\n2 0\n")
    scene = build(
        f"[[loads]]\ntype = 'ground_motion'\nstones = ['course = 1']\nx = '{record}'\nunit = 'm/s2'\nazimuth = 90\n"
    )
    # triangle of 2 m/s² in 2 s: the velocity is 1 m/s at 1 s, and the place 0.5 m on its line
    np.testing.assert_allclose(scene.loads.motions[0].pose(1.0).displacement, [0, 0.5, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        (
            FORCE.replace("'S'", "'W02-99'") + "force = [1, 0, 0]\n",
            15,
            "'W02-99' is not the code of a selected stone",
        ),
        (
            FORCE.replace("'S'", "'course = 9'") + "force = [1, 0, 0]\n",
            15,
            "stones: no selected stone satisfies",
        ),
        (
            FORCE.replace("'S'", "'W01-01'") + "force = [1, 0, 0]\n",
            15,
            "a force on stone W01-01, which is fixed",
        ),
        (
            FORCE.replace("'S'", "'course = 2'") + "force = [1, 0, 0]\npoint = [0, 0, 0]\n",
            17,
            "one point for 8 stones; name one stone",
        ),
        (
            SETTLEMENT.replace("S1", "W02-01"),
            15,
            "stone W02-01 is to be moved, but it is rigid; name it under 'fixed'",
        ),
        (
            SETTLEMENT.replace("S1", "W01-01") * 2,
            20,
            "stone W01-01 is moved by two loads, settlement and settlement",
        ),
        (
            "[[loads]]\ntype = 'spreading'\nfirst = ['W01-01']\nsecond = ['course = 1']\ndirection = [1, 0, 0]\n"
            "distance = 0.1\nduration = 1\n",
            16,
            "stone W01-01 is moved by two loads",
        ),
        ("[[loads]]\ntype = 'tilt'\naxis = [0, 0, 0]\nrate = 1\n", 13, "axis = (0.0, 0.0, 0.0)"),
        (
            "[[throw]]\nstones = ['W01-01']\nvelocity = [1, 0, 0]\n",
            14,
            "stone W01-01 is thrown, but it is fixed",
        ),
        ("[[throw]]\nstones = ['W02-01']\n" * 2, 16, "stone W02-01 is thrown twice"),
        (MORTAR + "between = ['course = 1', 'W02-99']\n", 18, "between: 'W02-99' is not the code"),
    ],
)
def test_a_load_or_law_that_does_not_suit_its_stones_is_named_with_its_line(build, text, line, said):
    fails_at_line(line, said, build, text)


def test_groups_of_stones_have_meshes_of_their_own_and_the_later_counts(build):
    scene = build(
        "deformable = ['course = 2']\n[mesh]\nsize = 0.3\nelement = 'tet10'\n"
        "[[meshes]]\nstones = ['course = 2 and depth > 0.4', 'W02-01']\nsize = 0.5\n"
        "[[meshes]]\nstones = ['W02-01']\nelement = 'hex8'\n"
    )
    meshes = {block.code: (block.mesh_size, block.element) for block in scene.blocks}
    assert meshes["W02-01"] == (0.3, Element.HEX8)
    deep = {code for code, mesh in meshes.items() if mesh == (0.5, Element.TET10)}
    assert deep
    assert {mesh for code, mesh in meshes.items() if code not in deep | {"W02-01"}} == {
        (0.3, Element.TET10),
        (None, Element.TET10),  # fixed
    }


def test_meshes_by_place_and_by_distance_to_contact(build):
    scene = build(
        "deformable = ['course = 2']\n[mesh]\nsize = 0.3\ncontact_size = 0.1\nmesher = 'gmsh'\n"
        "[[meshes]]\nstones = ['z > 0']\nsize = 0.5\ngrowth = 0.2\n"
        "[[meshes]]\nstones = ['W02-01']\ncontact_size = 0.05\nmesher = 'delaunay'\n"
    )
    settings = {
        block.code: (block.mesh_size, block.contact_size, block.growth, block.mesher)
        for block in scene.blocks
        if block.fidelity is Fidelity.DEFORMABLE
    }
    assert settings.pop("W02-01") == (0.3, 0.05, 0.5, "delaunay")
    assert set(settings.values()) == {(0.5, 0.1, 0.2, "gmsh")}


def test_a_mesh_of_no_stone_is_named_with_its_line(build):
    with pytest.raises(SceneError, match=r"scene.toml:14: stones: 'W02-99' is not the code"):
        build("[[meshes]]\nstones = ['W02-99']\nsize = 0.1\n")


def test_check_reports_the_meshes(url, tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(
        TWO_COURSES + "deformable = ['W02-01', 'W02-02', 'W02-03']\n[mesh]\nsize = 0.4\n"
        "[[meshes]]\nstones = ['W02-02']\nelement = 'hex8'\n"
    )
    uses = {(one.element, one.size, one.stones) for one in check_scene(path, url).meshes}
    assert uses == {(str(Block.element), 0.4, 2), ("hex8", 0.4, 1)}


def test_check_reports_laws_and_loads(url, tmp_path):
    (tmp_path / "a.csv").write_text("0 0\n1 2\n2 0\n")
    path = tmp_path / "scene.toml"
    path.write_text(
        TWO_COURSES
        + MORTAR
        + 'between = [["W01-01"], ["course = 2"]]\n'
        + '[[loads]]\ntype = "ground_motion"\nstones = ["course = 1"]\nx = "a.csv"\nunit = "m/s2"\n'
        + '[[throw]]\nstones = ["W02-01"]\nvelocity = [1, 0, 0]\n'
    )
    report = check_scene(path, url)
    assert report.laws == ("mortar, 1 stones and 8 stones: friction 0.5, tension 100000, shear 200000",)
    assert report.loads == (
        "ground_motion, 10 stones: x 'a' (2 s, peak 2 m/s² at 1 s, ends with 2 m/s, 2 m, brakes for 10 s), unit m/s2, "
        "azimuth 0, scale 1, start 0, order 4, baseline 0",
        "throw, 1 stones: velocity (1, 0, 0), spin (0, 0, 0)",
    )


def test_check_warns_first_of_a_run_that_ends_before_its_load_is_over(url, tmp_path):
    (tmp_path / "a.csv").write_text("0 0\n1 2\n2 0\n")
    path = tmp_path / "scene.toml"
    motion = '[[loads]]\ntype = "ground_motion"\nstones = ["course = 1"]\nx = "a.csv"\nunit = "m/s2"\n'
    path.write_text(TWO_COURSES + "[time]\nduration = 0.9\n" + motion)
    report = check_scene(path, url)
    said = "the run ends at 0.9 s, before the peak of the ground motion at 1 s, and it goes on until 12 s"
    assert report.cautions == (said,)
    lines = check_lines(report, verbose=False)
    assert lines[1] == f"  caution: {said}"
    assert lines[-1] == f"sound: it can be run; but {said}"
    path.write_text(path.read_text().replace("duration = 0.9", "duration = 12.5"))
    assert check_scene(path, url).cautions == ()


def test_a_station_gives_all_its_components(tmp_path):
    """East is x and north is y, before the azimuth turns both."""
    for stream, peak in (("HNE", 100.0), ("HNN", 200.0), ("HNZ", 50.0)):
        header = f"SAMPLING_INTERVAL_S: 1.0\nNDATA: 3\nSTREAM: {stream}\nUNITS: cm/s^2\n"
        (tmp_path / f"XX.ABC.{stream}.ASC").write_text(f"{header}0\n{peak}\n0\n")
    head = "[[loads]]\ntype = 'ground_motion'\nstones = ['S']\nstation = 'XX.ABC.*.ASC'\n"
    values = parse_scene(head + STONE, str(tmp_path / "scene.toml")).loads[0].values
    assert [(one.direction, one.peak) for one in values["station"]] == [
        ((1.0, 0.0, 0.0), 1.0),
        ((0.0, 1.0, 0.0), 2.0),
        ((0.0, 0.0, 1.0), 0.5),
    ]
    with pytest.raises(SceneError, match="records by axes and by station"):
        parse_scene(head + "x = 'XX.ABC.HNE.ASC'\n" + STONE, str(tmp_path / "scene.toml"))
    with pytest.raises(SceneError, match="no such file"):
        parse_scene(head.replace("XX", "YY") + STONE, str(tmp_path / "scene.toml"))
