"""Pictures of a result: surfaces, colours, and drawing processes that fail."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ground.errors import MissingLibraryError
from mechanics.scene.scene import Fidelity
from pipelines.draw import pictures
from pipelines.draw.catalogue import PICTURES
from pipelines.draw.offscreen.jobs import load_surface, save_surface
from pipelines.draw.offscreen.parts import nice_ceiling
from pipelines.draw.offscreen.result import colouring
from pipelines.draw.offscreen.surfaces import WallSurface, wall_surface
from pipelines.draw.pictures import OF_RESULTS, draw_pictures, drawing_process, missing, package_of
from pipelines.reports.page.scenes import run_model
from pipelines.results.stone_values import stone_results
from pipelines.run.run import chosen_pictures
from tests.paths import ROOT
from tests.pipelines.results_by_hand import result_of, rigid_body

pytestmark = pytest.mark.draws
TOWARDS = np.array([0.0, -1.0, 0.0])


def test_the_edges_drawn_are_those_of_the_stones_not_of_the_mesh(mixed):
    surface = wall_surface(mixed)
    segments = surface.points[surface.edges]
    assert np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum() == pytest.approx(12 + 16 + 12)
    corners = surface.points[surface.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.sum() == pytest.approx(6 + 10 + 6)
    assert areas[surface.deformable].sum() == pytest.approx(10)
    assert areas[surface.fixed].sum() == pytest.approx(6)


def test_a_corner_on_an_edge_draws_no_edge_and_causes_no_warning():
    """A face fanned from a corner whose edge has another corner on it holds a triangle without area."""
    cube = rigid_body("a", (0, 0, 0), (1, 1, 1))
    first, *others = cube.faces
    corners = np.vstack([cube.reference, cube.reference[list(first[:2])].mean(axis=0)])
    bent = replace(
        cube, reference=corners, position=corners, faces=((first[0], len(corners) - 1, *first[1:]), *others)
    )
    surface = wall_surface(result_of([bent], pairs=(), forces=()))
    segments = surface.points[surface.edges]
    assert np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum() >= 11.0
    assert len(surface.triangles) == 13


def test_a_surface_survives_its_file(mixed, tmp_path):
    surface = wall_surface(mixed)
    save_surface(tmp_path / "s.npz", surface)
    again = load_surface(tmp_path / "s.npz", WallSurface)
    assert np.array_equal(again.field("von_mises"), surface.field("von_mises"), equal_nan=True)
    assert np.array_equal(again.resultants, surface.resultants)
    assert np.array_equal(again.edges, surface.edges)


@pytest.mark.parametrize(
    ("value", "end"), [(1.0, 1.0), (1.01, 1.2), (0.083, 0.1), (7.9e5, 8e5), (8.1e5, 1e6), (2.2e-6, 2.5e-6)]
)
def test_the_scale_ends_at_a_round_number(value, end):
    top, intervals = nice_ceiling(value)
    assert top == pytest.approx(end)
    step = top / intervals
    assert float(f"{step:.1e}") == pytest.approx(step)  # two digits at most


def test_colours_are_in_the_unit_that_the_scale_names(mixed):
    surface = wall_surface(mixed)
    stress = colouring(surface, "von_mises", 1.4e6)
    assert stress.title == "Von Mises stress [MPa]"
    assert (stress.top, stress.saturated) == (pytest.approx(1.5), True)
    assert np.nanmax(stress.values) == pytest.approx(2.0)
    moved = colouring(surface, "displacement", None)
    assert moved.title == "Displacement [mm]"
    assert (moved.top, moved.saturated) == (pytest.approx(5.0), False)


def test_the_surface_shows_tension_compression_and_what_joints_carry(strong):
    surface = wall_surface(strong)
    elastic = slice(8, -8)
    assert np.nanmax(surface.field("principal_compression")) == pytest.approx(2e6)
    assert surface.field("principal_tension")[elastic] == pytest.approx(0.0, abs=1e-6)
    assert np.nanmax(surface.field("utilisation")) == pytest.approx(0.5)
    assert surface.field("error")[elastic] == pytest.approx(0.1)
    assert surface.joint_pressure == pytest.approx([3000.0, 3000.0, 800.0, 800.0])  # two triangles each
    assert surface.joint_points[surface.joint_triangles][:, :, 2].mean(axis=1) == pytest.approx([1, 1, 3, 3])
    assert surface.in_kern.tolist() == [True, False]
    assert surface.resultant_points[1] == pytest.approx([0.7, 0.5, 3.0])


def test_pictures_show_the_wall_in_colour_on_white(strong, tmp_path):
    from PIL import Image

    names = draw_pictures(strong, tmp_path, PICTURES, TOWARDS)
    nothing = ("displacement", "principal_tension")  # it stands, and is pressed everywhere
    assert names == tuple(f"{name}.png" for name in PICTURES if name not in nothing)
    for name in names:
        pixels = np.asarray(Image.open(tmp_path / name).convert("RGB")).astype(int)
        assert (pixels[[0, -1], :, :][:, [0, -1]] == 255).all()  # corners: background
        spread = np.ptp(pixels, axis=2)
        coloured, grey = (spread > 60).mean(), ((spread < 12) & (pixels.mean(axis=2) < 220)).mean()
        if name == "resultants.png":
            continue  # two thin strokes
        assert coloured > 0.005, name
        assert grey > 0.01, name


def test_the_resultants_are_blue_within_the_kern_and_red_outside(strong, tmp_path):
    from PIL import Image

    draw_pictures(strong, tmp_path, ("resultants",), TOWARDS)
    pixels = np.asarray(Image.open(tmp_path / "resultants.png").convert("RGB")).astype(int)
    red, green, blue = np.moveaxis(pixels, 2, 0)
    rows = {
        "blue": np.flatnonzero(((blue - red) > 80).any(axis=1)),
        "red": np.flatnonzero(((red - green) > 80).any(axis=1)),
    }
    assert len(rows["blue"]) > len(rows["red"]) > 0  # the larger force has the longer stroke
    assert rows["red"].max() < rows["blue"].min()  # the upper joint is out of its kern


def test_a_process_that_was_started_ahead_draws_the_same(strong, tmp_path):
    (tmp_path / "ahead").mkdir()
    with drawing_process(OF_RESULTS) as ready:
        draw_pictures(strong, tmp_path / "ahead", ("resultants",), TOWARDS, ready)
    draw_pictures(strong, tmp_path, ("resultants",), TOWARDS)
    assert (tmp_path / "ahead/resultants.png").read_bytes() == (tmp_path / "resultants.png").read_bytes()


def test_a_process_that_gets_no_job_ends_with_its_block():
    with drawing_process(OF_RESULTS) as idle:
        assert idle.poll() is None
    assert idle.returncode is not None


def test_every_picture_is_documented():
    page = (ROOT / "docs/scene.md").read_text(encoding="utf-8")
    section = page.split("\n## Pictures\n")[1].split("\n## ")[0]
    assert re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE) == list(PICTURES)


@pytest.mark.parametrize(
    ("which", "name", "reason"),
    [
        ("rigid", "von_mises", "no stone deforms"),
        ("rigid", "error", "no stone deforms"),
        ("mixed", "utilisation", "no material of a deformable stone has a strength"),
        ("mixed", "von_mises", None),
        ("mixed", "resultants", None),
        ("rigid", "displacement", "no stone has moved by more than the tolerance of the solver, 1e-06 mm"),
        ("mixed", "displacement", None),
        ("strong", "principal_tension", "no stone is in tension"),
        ("strong", "utilisation", None),
    ],
)
def test_a_picture_that_would_show_nothing_has_a_reason(request, which, name, reason):
    assert missing(request.getfixturevalue(which), name) == reason


@pytest.mark.parametrize("way", [0.0, 6e-17, -9e-12])
def test_what_stands_shows_what_its_joints_carry_instead_of_its_displacement(way):
    """The page and the pictures: a scale of 10⁻¹¹ µm, or of 1 m, would be of what rounding leaves."""
    still = result_of(
        [
            rigid_body("base", (0, 0, 0), (1, 1, 1), Fidelity.FIXED),
            rigid_body("top", (0, 0, 1), (1, 1, 2), shift=(0, 0, way)),
        ],
        pairs=((1, 0),),
        forces=((0.0, 0.0, 900.0),),
    )
    scene = SimpleNamespace(output=SimpleNamespace(pictures=None))
    assert chosen_pictures(scene, still) == (("pressure",), [])
    scene.output.pictures = ("displacement", "resultants")
    drawn, warnings = chosen_pictures(scene, still)
    assert drawn == ("resultants",)
    assert warnings[0].startswith("no picture displacement: no stone has moved")
    scene.output.pictures = ("displacement",)
    assert chosen_pictures(scene, still)[1][0].endswith("; pressure.png is drawn instead")
    assert run_model(still, stone_results(still), TOWARDS, np.zeros(3)).colour == "joint_pressure"


def test_without_pressed_joints_there_is_no_picture_of_them():
    alone = result_of([rigid_body("a", (0, 0, 0), (1, 1, 1))], pairs=(), forces=())
    assert missing(alone, "pressure") == missing(alone, "resultants") == "no joint is pressed"
    assert wall_surface(alone).joint_triangles.shape == (0, 3)


def test_without_deformable_stones_no_stress_is_drawn(rigid, tmp_path):
    assert draw_pictures(rigid, tmp_path, ("von_mises", "utilisation"), TOWARDS) == ()


@pytest.mark.parametrize(
    ("message", "package"),
    [
        ("libGL.so.1: cannot open shared object file: No such file or directory", "libgl1"),
        ("libXrender.so.1: cannot open shared object file", "libxrender1"),
        ("libEGL.so.1: cannot open", "libegl1"),
        ("No module named 'vtkmodules'", None),
    ],
)
def test_a_missing_library_is_named_by_its_package(message, package):
    assert package_of(message) == package


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("import sys; print('libGL.so.1: cannot open'); sys.exit(3)", "apt-get install libgl1"),
        ("import os; os.abort()", "cannot draw off screen"),
        ("import sys; sys.exit('no GLX')", "no GLX"),
    ],
)
def test_a_drawing_process_that_fails_is_reported_not_followed(mixed, tmp_path, monkeypatch, program, said):
    broken = tmp_path / "python"
    broken.write_text(f"#!/bin/sh\nexec '{pictures.sys.executable}' -c \"{program}\"\n", encoding="utf-8")
    broken.chmod(0o755)
    monkeypatch.setattr(pictures.sys, "executable", str(broken))
    with pytest.raises(MissingLibraryError, match=said):
        draw_pictures(mixed, tmp_path, ("von_mises",), TOWARDS)
