"""Scenes of imported solids: unchanged where joints stay open, fitted to each other where they are closed."""

from math import pi, sin

import numpy as np
import pytest

from mechanics.stones.polyhedra import mass_properties
from pipelines.ingest.ingest import ingest
from pipelines.run.check import check_scene
from pipelines.run.run import run_scene
from survey.joints.settings import JointMode
from tests.pipelines.scenes import assembled

SCENE = """
[scene]
name = "Solids"
[select]
where = ["depth > 0"]
[materials.limestone]
density = 2000.0
young = 12e9
poisson = 0.2
[bodies]
default = "rigid"
fixed = ["BASE"]
[output]
pictures = []
"""
OPEN = '[joints]\nmode = "as-surveyed"\n'


def loft(name, front, back):
    """OBJ of a solid between two polygons (n, 3), the front counter-clockwise seen from -y."""
    n = len(front)
    sides = [(i, i + n, (i + 1) % n + n, (i + 1) % n) for i in range(n)]
    faces = [tuple(range(n)), tuple(range(2 * n - 1, n - 1, -1)), *sides]
    rows = [f"o {name}", *(f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in [*front, *back])]
    rows += [f"f {' '.join(str(i - 2 * n) for i in face)}" for face in faces]
    return "\n".join(rows) + "\n"


def rectangle(x, z, length, height, y=0.0, tail=1.0):
    """Return corners counter-clockwise seen from -y; a tail shrinks it about its centre line, above its bed."""
    a, b = 0.5 * length * (1 - tail), tail * height
    return [(x + a, y, z), (x + length - a, y, z), (x + length - a, y, z + b), (x + a, y, z + b)]


def hexagon(x, z, radius, y):
    return [(x + radius * np.cos(k * pi / 3), y, z + radius * np.sin(k * pi / 3)) for k in range(6)]


BASE = loft("BASE:ashlar", rectangle(-1.0, 0.0, 3.0, 0.3), rectangle(-1.0, 0.0, 3.0, 0.3, 0.6))
# 0.8 × 0.4 in front, half of that in length and height behind, 0.5 m deep; its bed is level
WEDGE = loft("WEDGE:voussoir", rectangle(0.0, 0.3, 0.8, 0.4), rectangle(0.0, 0.3, 0.8, 0.4, 0.5, 0.5))
FRUSTUM = 0.5 * 0.8 * 0.4 * (1 + 0.5 + 0.25) / 3
COLUMN = loft(
    "COLUMN:ashlar",
    hexagon(1.5, 0.3 + 0.2 * sin(pi / 3), 0.2, 0.0),
    hexagon(1.5, 0.3 + 0.2 * sin(pi / 3), 0.2, 0.5),
)
PRISM = 0.5 * 1.5 * 3**0.5 * 0.2**2


@pytest.fixture
def scene_of(tmp_path):
    """Return a function that assembles a scene of solids."""

    def build(objects, text):
        path = tmp_path / "stones.obj"
        path.write_text("".join(objects))
        url = f"sqlite:///{tmp_path / 'stones.db'}"
        if not (tmp_path / "stones.db").exists():
            ingest([path], url, "solids")
        return assembled(url, text)

    build.url = f"sqlite:///{tmp_path / 'stones.db'}"
    return build


def volume_of(block):
    return mass_properties(block.vertices, block.faces, block.code).volume


def test_with_open_joints_solids_stay_as_they_were_made(scene_of):
    assembly = scene_of([BASE, WEDGE, COLUMN], SCENE + OPEN)
    blocks = {block.code: block for block in assembly.scene.blocks}
    assert assembly.closing.mode is JointMode.AS_SURVEYED
    assert assembly.closing.largest_displacement == 0.0
    # its bed shares the plane of the top of the base: that joint is closed as it is
    assert ("BASE", "WEDGE") in {one.stones for one in assembly.closing.joints if not one.left_open}
    assert volume_of(blocks["WEDGE"]) == pytest.approx(FRUSTUM, rel=1e-12)
    assert volume_of(blocks["COLUMN"]) == pytest.approx(PRISM, rel=1e-12)
    assert len(blocks["COLUMN"].faces) == 8
    corners = sorted([*rectangle(0.0, 0.3, 0.8, 0.4), *rectangle(0.0, 0.3, 0.8, 0.4, 0.5, 0.5)])
    np.testing.assert_allclose(sorted(map(tuple, blocks["WEDGE"].vertices.tolist())), corners, atol=1e-12)
    np.testing.assert_allclose(np.abs(assembly.towards), [0, 1, 0], atol=0.05)


def test_a_run_weighs_the_solids_and_not_prisms_behind_their_faces(scene_of, tmp_path):
    scene_of([BASE, WEDGE, COLUMN], SCENE + OPEN)
    (tmp_path / "scene.toml").write_text(SCENE + OPEN)
    report = check_scene(tmp_path / "scene.toml", scene_of.url)
    assert report.problems == ()
    summary = run_scene(tmp_path / "scene.toml", scene_of.url, tmp_path / "out").summary
    weight = 2000.0 * 9.81 * (FRUSTUM + PRISM)
    assert summary["outcome"] == "equilibrium"
    assert summary["reaction"]["total_vertical"] == pytest.approx(weight, rel=1e-3)


def test_closing_joints_of_boxes_works_as_for_measured_stones(scene_of):
    boxes = [
        loft(f"{name}:ashlar", rectangle(x, z, length, 0.3), rectangle(x, z, length, 0.3, 0.4))
        for name, x, z, length in (
            ("BASE", 0.0, 0.0, 1.2),
            ("A", 0.0, 0.31, 0.595),
            ("B", 0.605, 0.31, 0.595),
        )
    ]
    assembly = scene_of(boxes, SCENE)
    joints = {frozenset(one.stones): one for one in assembly.closing.joints}
    assert set().union(*joints) == {"BASE", "A", "B"}
    for joint in joints.values():
        assert joint.width == pytest.approx(0.01, abs=1e-9)
    blocks = {block.code: block for block in assembly.scene.blocks}
    assert volume_of(blocks["BASE"]) == pytest.approx(1.2 * 0.305 * 0.4, rel=1e-9)
    assert volume_of(blocks["A"]) == pytest.approx(0.6 * 0.305 * 0.4, rel=1e-9)
    # corners move by half a joint, along or up, at most √2 · 5 mm
    assert assembly.closing.largest_displacement == pytest.approx(0.005 * 2**0.5, abs=1e-9)


@pytest.mark.parametrize(("stone", "volume"), [(WEDGE, FRUSTUM), (COLUMN, PRISM)], ids=["wedge", "column"])
def test_closing_keeps_the_shape_of_solids_that_are_no_prisms_or_have_more_sides(scene_of, stone, volume):
    """They stand on the base already: nothing needs to move."""
    assembly = scene_of([BASE, stone], SCENE)
    assert assembly.closing.largest_displacement < 1e-9
    assert assembly.closing.gaps == ()
    (block,) = (one for one in assembly.scene.blocks if one.code != "BASE")
    assert volume_of(block) == pytest.approx(volume, rel=1e-9)


def test_closing_leads_a_solid_of_more_sides_to_its_bed(scene_of):
    """The column stands 6 mm above the base: both move by half of that."""
    raised = loft(
        "COLUMN:ashlar",
        hexagon(1.5, 0.306 + 0.2 * sin(pi / 3), 0.2, 0.0),
        hexagon(1.5, 0.306 + 0.2 * sin(pi / 3), 0.2, 0.5),
    )
    assembly = scene_of([BASE, raised], SCENE)
    (joint,) = assembly.closing.joints
    assert joint.width == pytest.approx(0.006, abs=1e-9)
    assert not joint.left_open
    assert joint.area == pytest.approx(0.2 * 0.5, rel=0.03)
    column = next(one for one in assembly.scene.blocks if one.code == "COLUMN")
    base = next(one for one in assembly.scene.blocks if one.code == "BASE")
    assert column.vertices[:, 2].min() == pytest.approx(base.vertices[:, 2].max(), abs=1e-12)
    assert 0.3 < base.vertices[:, 2].max() < 0.306
    assert len(column.faces) == 8
