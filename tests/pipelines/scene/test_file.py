"""Scene files: every mistake is named with its line, its value and a remedy, before anything runs."""

import re
from dataclasses import fields

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ground.errors import MomaError, SceneError
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, SolverSettings, Start, TimeSettings
from mechanics.stones.meshing.elements import Element
from pipelines.scene.file import TABLES, parse_scene, read_scene
from pipelines.scene.settings import Fidelities, MeshSettings, Output, Selection
from survey.joints.settings import JointSettings
from tests.paths import ROOT
from tests.pipelines.scene.reference import with_tables
from tests.pipelines.scenes import fails_at_line

SAMPLE = ROOT / "data/samples/window/window.toml"
STONE = "[materials.stone]\ndensity = 2000\nyoung = 1e10\npoisson = 0.2\n"


def parsed(text):
    return parse_scene(text, "scene.toml")


def test_the_smallest_scene_has_a_material_and_defaults_for_the_rest():
    scene = parse_scene(STONE, "dir/tower.toml")
    assert scene.name == "tower"
    assert scene.gravity == (0.0, 0.0, -9.81)
    assert (scene.bodies.default, scene.bodies.ring) == (None, 3)  # as the outputs need it
    assert scene.output.stress is None
    assert scene.materials[0].material.density == 2000.0
    assert scene.contact.law.friction == 0.6


def test_damping_strengths_and_the_way_to_start_are_read():
    scene = parse_scene(
        STONE
        + "mass_damping = 2\nstiffness_damping = 1e-4\ntensile_strength = 2e6\ncompressive_strength = 3e7\n"
        + "[time]\nstart = 'equilibrium'\nlumped_mass = true\n[mesh]\nelement = 'hex20'\n",
        "scene.toml",
    )
    material = scene.materials[0].material
    assert (material.mass_damping, material.stiffness_damping) == (2.0, 1e-4)
    assert (material.tensile_strength, material.compressive_strength) == (2e6, 3e7)
    assert (scene.time.start, scene.time.lumped_mass) == (Start.EQUILIBRIUM, True)
    assert scene.mesh == MeshSettings(0.2, Element.HEX20)


LAYERS = "[materials.stone.orthotropy]\nyoung = [3e9, 2e9, 1e9]\nshear = [1e9, 1e9, 1e9]\npoisson = [0.2, 0.1, 0.1]\n"


def test_a_material_may_have_axes_of_its_own():
    scene = parse_scene(STONE + LAYERS + "axes = [[0, 3, 0], [-1, 0, 0], [0, 0, 1]]\n", "scene.toml")
    orthotropy = scene.materials[0].material.orthotropy
    assert orthotropy.young == (3e9, 2e9, 1e9)
    assert orthotropy.axes == ((0.0, 1.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    assert parse_scene(STONE, "scene.toml").materials[0].material.orthotropy is None


def test_the_sample_scene_is_valid():
    scene = read_scene(SAMPLE)
    assert scene.bodies.fixed == ("course = 1",)
    assert scene.text == SAMPLE.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("[contact]\nfrictoin = 0.6\n", 2, "unknown key 'frictoin' in [contact]; did you mean 'friction'?"),
        ("[contcat]\n", 1, "unknown table [contcat]; did you mean 'contact'?"),
        ("\nname = 'x'\n", 2, "unknown key 'name'"),
        (
            "[contact]\nfriction = 'high'\n",
            2,
            "friction = 'high' is not a number; give a number [-], at least 0",
        ),
        ("[contact]\nfriction = true\n", 2, "friction = true is not a number"),
        ("[contact]\nfriction = -0.1\n", 2, "friction = -0.1 is out of range"),
        ("[contact]\nfriction = nan\n", 2, "friction = nan is out of range"),
        ("[time]\nstep = 0.0\n", 2, "give a number [s], greater than 0"),
        ("[time]\n# slower\ntheta = 0.4\n", 3, "at least 0.5 and at most 1"),
        ("[time]\nstep = 0.1\nduration = 0.01\n", 3, "shorter than step"),
        ("[solver]\nmax_iterations = 1.5\n", 2, "not a whole number"),
        ("[bodies]\ndefault = 'elastic'\n", 2, "known here: auto, deformable, rigid"),
        ("[bodies]\nfixed = 'course = 1'\n", 2, "not a list of texts"),
        ("[gravity]\ndirection = [0, 0]\n", 2, "not a list of three numbers"),
        ("[gravity]\ndirection = [0, 0, 0]\n", 2, "direction has no length"),
        ("[output]\npictures = ['von_mise']\n", 2, "did you mean 'von_mises'?"),
        ("[joints]\nmode = 'shut'\n", 2, "mode = 'shut' is unknown"),
        ("[mesh]\nelement = 'tet5'\n", 2, "element = 'tet5' is unknown; did you mean 'tet4'"),
        ("[time]\nstart = 'still'\n", 2, "start = 'still' is unknown; known here: equilibrium, rest"),
        ("[time]\nstep = \n", 2, "not TOML"),
        ("[time\n", 1, "not TOML"),
        ("time = 3\n", 1, "'time' is not a table"),
    ],
)
def test_a_mistake_is_named_with_its_line(text, line, said):
    fails_at_line(line, said, parsed, text if "not TOML" in said else text + STONE)


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("[scene]\nname = 'x'\n", 1, "no material"),
        ("[materials]\ndensity = 2000\n", 2, "'density' stands in no material"),
        ("[materials.a]\ndensity = 2000\nyoung = 1e10\n", 1, "[materials.a] has no 'poisson'"),
        (STONE.replace("0.2", "0.5"), 4, "poisson = 0.5 is out of range"),
        (
            STONE + LAYERS.replace("3e9", "0"),
            6,
            "is out of range; give a list of three numbers [Pa], greater than 0",
        ),
        (STONE + LAYERS.replace("shear", "sheer"), 7, "unknown key 'sheer'"),
        (STONE + LAYERS + "axes = [[1, 0, 0]]\n", 9, "axes are not three directions"),
        (
            STONE + LAYERS + "axes = [[1, 0, 0], [0, 1, 0], [0, 1, 1]]\n",
            5,
            "give three unit vectors at right angles",
        ),
        (STONE + LAYERS.replace("0.2, 0.1", "5.0, 0.1"), 5, "poisson"),
        (STONE + "orthotropy = 3\n", 5, "'orthotropy' is not a table"),
        (STONE + "tensile_strength = 0\n", 5, "give a number [Pa], greater than 0"),
        (STONE + "stiffness_damping = -1e-4\n", 5, "give a number [s], at least 0"),
        (STONE + STONE.replace("stone", "brick"), 5, "'stone' and 'brick' both lack 'stones'"),
    ],
)
def test_a_mistake_in_the_materials_is_named_with_its_line(text, line, said):
    fails_at_line(line, said, parsed, text)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(SceneError, match="no such scene file"):
        read_scene(tmp_path / "none.toml")
    (tmp_path / "latin.toml").write_bytes(b"[scene]\nname = '\xe9glise'\n")
    with pytest.raises(SceneError, match="not UTF-8"):
        read_scene(tmp_path / "latin.toml")
    with pytest.raises(SceneError, match="cannot be read"):
        read_scene(tmp_path)


@given(st.text(max_size=200) | st.text(alphabet="[]{}=\"'#\n.a1 -,", max_size=60))
def test_no_text_makes_the_reader_fail_in_another_way(text):
    try:
        parse_scene(text, "scene.toml")
    except MomaError as error:
        message = str(error)
    else:
        return
    assert re.match(r"scene\.toml:\d+: ", message)


@pytest.mark.parametrize(
    ("table", "owners"),
    [
        ("select", [Selection]),
        ("bodies", [Fidelities]),
        ("joints", [JointSettings]),
        ("contact", [DryJoint, ContactSettings]),
        ("mesh", [MeshSettings]),
        ("time", [TimeSettings]),
        ("solver", [SolverSettings]),
        ("output", [Output]),
    ],
)
def test_every_setting_has_a_key_with_its_default(table, owners):
    keys = {key.name: key.default for key in TABLES[table]}
    settings = {one.name: one.default for owner in owners for one in fields(owner)}
    # laws and rules are tables of their own, thickness comes from joints; "auto" leaves the model to the outputs
    others = ("law", "rules", "thickness")
    assert keys == {name: value for name, value in settings.items() if name not in others} | (
        {"default": "auto"} if table == "bodies" else {}
    )


PAGE = (ROOT / "docs/scene.md").read_text(encoding="utf-8")


def test_the_tables_of_the_page_are_those_of_the_keys():
    assert with_tables(PAGE) == PAGE


def test_an_old_table_is_renewed():
    old = PAGE.replace("| `step` | s | `0.001` | Time step h. |\n", "| `stride` | m | | Old. |\n")
    assert old != PAGE
    assert with_tables(old) == PAGE


def test_a_table_that_is_missing_is_named():
    with pytest.raises(LookupError, match=r"sections \[\[throw\]\]"):
        with_tables(PAGE[: PAGE.index("## `[[throw]]`")])
