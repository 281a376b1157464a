"""Settings that a study tries, by the outputs of the scene; and their lines of TOML against the overlay."""

import tomllib
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechanics.scene.scene import Block, Fidelity, Method, Placement
from mechanics.scene.shapes import BOX_FACES
from mechanics.stones.materials import Material
from mechanics.stones.meshing.elements import Element
from pipelines.scene.file import parse_scene
from pipelines.tradeoff.grid import grid, setting_name
from pipelines.tuning.overlay import Overlay, overlaid, overlay_from, overlay_record, scene_lines
from tests.pipelines.results_by_hand import box

STONE = Material("limestone", 2350.0, 12e9, 0.2)
PLAIN = "[materials.limestone]\ndensity = 2350.0\nyoung = 12e9\npoisson = 0.2\n"
REST = PLAIN + "[time]\nrelaxation = true\n"

overlays = st.builds(
    Overlay,
    fidelity=st.none() | st.sampled_from([Fidelity.RIGID, Fidelity.DEFORMABLE]),
    element=st.none() | st.sampled_from(list(Element)),
    cells=st.none() | st.floats(0.1, 50.0),
    points=st.none() | st.sampled_from([1, 3, 4, 8]),
    placement=st.none() | st.sampled_from(list(Placement)),
    step=st.none() | st.floats(1e-6, 1.0),
    theta=st.none() | st.floats(0.5, 1.0),
    method=st.none() | st.sampled_from(list(Method)),
    tolerance=st.none() | st.floats(1e-14, 0.5),
    velocity_tolerance=st.none() | st.floats(1e-14, 0.5),
    motion_error=st.none() | st.floats(1e-9, 1.0),
    max_iterations=st.none() | st.integers(1, 10**6),
)


def blocks(fidelity, faces=BOX_FACES, corners=None):
    """A fixed stone and two that are not."""
    corners = box((0, 0, 0), (0.6, 0.3, 0.4)) if corners is None else corners
    kinds = (Fidelity.FIXED, fidelity, fidelity)
    return [
        Block(f"S{n}", corners, faces, STONE, kind, mesh_size=0.3 if kind is Fidelity.DEFORMABLE else None)
        for n, kind in enumerate(kinds)
    ]


def tried(text, stones, stress=False):
    return {one.name: one for one in grid(parse_scene(text, "scene.toml"), stones, 0.3, stress)}


def test_a_scene_of_rigid_stones_is_tried_with_rigid_stones_only():
    found = tried(REST, blocks(Fidelity.RIGID))
    assert {one.element for one in found.values()} == {None}
    assert "as written" in found
    assert "rigid" not in found  # it is as it is written
    assert {"3 points", "8 points", "points by inertia"} <= set(found)


def test_a_requested_stress_makes_stones_deform():
    found = tried(REST, blocks(Fidelity.RIGID), stress=True)
    ladder = [one for name, one in found.items() if "cell" in name]
    assert {one.overlay.fidelity for one in ladder} == {Fidelity.DEFORMABLE}
    assert found["as written"].element is None


def test_stones_that_deform_are_tried_rigid_and_on_all_meshes():
    found = tried(REST, blocks(Fidelity.DEFORMABLE))
    assert found["rigid"].element is None
    assert {"tet4, 1 cell", "tet4, 4 cells", "tet10, 2 cells", "hex8, 3 cells", "hex20, 1 cell"} <= set(found)
    assert {"profile fast", "profile balanced", "profile accurate"} <= set(found)
    models = [one for one in found.values() if one.varied is None]
    assert models == sorted(models, key=lambda one: one.effort * one.unknowns)
    assert all(found[one.varied].varied is None for one in found.values() if one.varied is not None)


def test_hexahedra_are_left_out_where_they_do_not_suit():
    apex = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 1.0]]
    pyramid = ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4))
    found = tried(REST, blocks(Fidelity.DEFORMABLE, pyramid, box((0, 0, 0), (1, 1, 1))[:5] * 0 + apex))
    assert not any(name.startswith("hex") for name in found)
    assert "tet10, 2 cells" in found


def test_steps_are_varied_only_where_motion_is_followed():
    assert not any("h " in name or "motion" in name for name in tried(REST, blocks(Fidelity.RIGID)))
    moving = tried(PLAIN + "[time]\nstep = 1e-3\nduration = 2e-3\n", blocks(Fidelity.RIGID))
    steps = {one.step for one in moving.values()}
    assert {2e-3, 5e-4, 2.5e-4} < steps
    assert 4e-3 not in steps  # longer than the run
    assert {"motion to 1e-05 m", "motion to 1e-03 m"} < set(moving)
    assert not any("θ" in name for name in moving)
    motion = tried(PLAIN + "[time]\nstop_at_equilibrium = false\ntheta = 0.6\n", blocks(Fidelity.RIGID))
    assert {"θ 0.5", "θ 1"} <= set(motion)
    assert "θ 0.6" not in motion


def test_a_region_that_deforms_is_tried_within_a_wall_that_does_too():
    stones = blocks(Fidelity.DEFORMABLE)
    stones[2] = replace(stones[2], fidelity=Fidelity.RIGID, mesh_size=None)
    found = tried(REST, stones)
    assert found["as written"].unknowns < found["deformable"].unknowns
    assert found["tet10, 2 cells"].overlay.fidelity is None  # the rest as the scene has it


@given(overlays)
def test_names_distinguish_settings_and_records_read_back(overlay):
    assert overlay_from(overlay_record(overlay)) == overlay
    assert (setting_name(overlay) == "as written") == (
        replace(overlay, velocity_tolerance=None, max_iterations=None) == Overlay()
    )


@given(overlays, st.floats(0.01, 10.0))
def test_lines_that_are_pasted_make_the_scene_that_was_run(overlay, width):
    lines, spacing = scene_lines(overlay, width), "[contact]\nspacing = 0.1\n"
    own = lines.replace("[contact]\n", spacing) if "[contact]" in lines else spacing + lines
    pasted = parse_scene(PLAIN + "\n" + own, "scene.toml")
    meant = overlaid(parse_scene(PLAIN + "\n" + spacing, "scene.toml"), overlay, width)
    assert pasted.bodies == meant.bodies
    assert pasted.mesh.element == meant.mesh.element
    assert pasted.mesh.size == pytest.approx(meant.mesh.size, rel=1e-5)
    assert (pasted.contact.points, pasted.contact.placement) == (
        meant.contact.points,
        meant.contact.placement,
    )
    assert (pasted.time.step, pasted.time.theta) == pytest.approx(
        (meant.time.step, meant.time.theta), rel=1e-5
    )
    assert pasted.solver.method == meant.solver.method
    assert pasted.solver.max_iterations == meant.solver.max_iterations
    assert pasted.solver.tolerance == pytest.approx(meant.solver.tolerance, rel=1e-5)
    assert pasted.solver.velocity_tolerance == pytest.approx(meant.solver.velocity_tolerance, rel=1e-5)


def test_a_setting_that_changes_nothing_has_no_lines():
    assert scene_lines(Overlay(), 0.3) == ""
    assert tomllib.loads(scene_lines(Overlay(cells=2.0), 0.3)) == {"mesh": {"size": 0.15}}
