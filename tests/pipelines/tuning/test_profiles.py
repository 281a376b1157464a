"""Profiles: settings that they change and keep, expected errors, and the page that documents them."""

import re
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from ground.errors import UsageError
from mechanics.scene import shapes
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import ContactSettings, Fidelity, Scene, Start, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.meshing.elements import Element
from moma.cli.options import ProfileName
from pipelines.results.quantities import QUANTITIES, Quantities, StoneQuantities
from pipelines.scene.file import parse_scene
from pipelines.tuning.expected_errors import BOUNDS, TYPICAL, expected_errors, loops
from pipelines.tuning.measured_errors import COLLAPSE, ERRORS
from pipelines.tuning.overlay import Overlay, overlaid, overlaid_scene
from pipelines.tuning.profiles import PROFILES, profile_named, with_profile
from tests.paths import ROOT

PAGE = (ROOT / "docs/runs.md").read_text(encoding="utf-8")
SCENE = """
[select]
where = ["course <= 4"]
[materials.limestone]
density = 2350.0
young = 12e9
poisson = 0.2
[bodies]
default = "deformable"
rigid = ["W02-02"]
fixed = ["course = 1"]
[mesh]
size = 0.07
contact_size = 0.02
[[meshes]]
stones = ["W03-01"]
size = 0.5
[contact]
friction = 0.3
points = 1
[time]
step = 0.1
duration = 3.0
balance_tolerance = 1e-3
[solver]
tolerance = 1e-3
threads = 2
"""


def parsed(text=SCENE):
    return parse_scene(text, "scene.toml")


def at(name, scene, width=0.4):
    return overlaid(scene, PROFILES[name].overlay(scene.time), width)


def test_settings_of_a_profile_take_precedence_over_those_of_the_scene():
    scene, found = parsed(), at("accurate", parsed())
    assert found.bodies.default is Fidelity.DEFORMABLE
    assert (found.mesh.size, found.mesh.contact_size, found.mesh.element) == (0.2, None, Element.TET10)
    assert (found.contact.points, found.time.step, found.time.theta) == (8, 0.002, 1.0)
    assert (found.solver.tolerance, found.solver.max_iterations) == (1e-7, 5000)
    assert at("fast", scene).bodies.default is Fidelity.RIGID


def test_the_definition_of_the_task_stays():
    scene, found = parsed(), at("fast", parsed())
    assert found.bodies == replace(scene.bodies, default=Fidelity.RIGID)  # its lists
    assert found.meshes == scene.meshes
    assert found.time == replace(scene.time, step=0.01, theta=1.0)  # duration, tolerance of the balance
    assert (found.contact.law, found.solver.threads) == (scene.contact.law, 2)
    same = ("selection", "materials", "joints", "gravity", "laws", "loads", "throws", "output", "text")
    assert all(getattr(found, name) == getattr(scene, name) for name in same)


def test_balanced_leaves_to_the_scene_what_deforms():
    for default in ("rigid", "deformable"):
        scene = parsed(SCENE.replace('default = "deformable"', f'default = "{default}"'))
        assert at("balanced", scene).bodies == scene.bodies


def test_a_scene_that_asks_for_the_motion_keeps_it():
    moving = parsed(SCENE.replace("step = 0.1", "step = 0.1\ntheta = 0.6"))
    assert (at("accurate", moving).time.theta, at("accurate", moving).time.step) == (0.5, 0.0005)
    relaxed = parsed(SCENE.replace("step = 0.1", "step = 0.1\ntheta = 0.6\nrelaxation = true"))
    assert at("accurate", relaxed).time.theta == 1.0


def test_without_a_name_a_scene_stays_as_it_is_and_a_wrong_name_is_refused():
    scene = parsed()
    assert with_profile(scene, None, []) is scene
    with pytest.raises(UsageError, match="balanced"):
        profile_named("balansed")


def test_profiles_become_finer_one_by_one():
    fast, balanced, accurate = PROFILES.values()
    assert list(PROFILES) == ["fast", "balanced", "accurate"] == [*get_args(ProfileName)]
    assert fast.rest.tolerance > balanced.rest.tolerance > accurate.rest.tolerance
    assert fast.rest.step > balanced.rest.step > accurate.rest.step
    assert fast.step > balanced.step > accurate.step
    assert balanced.rest.cells < accurate.rest.cells


def wall():
    return Scene(
        "wall",
        shapes.wall(shapes.bond(2, 3, halves_first=True), 0.5, 0.25, 0.4, slab=False),
        contact=ContactSettings(DryJoint(0.6)),
        time=TimeSettings(start=Start.EQUILIBRIUM),
    )


def test_an_assembled_scene_is_overlaid_like_its_file():
    scene = overlaid_scene(wall(), PROFILES["accurate"].rest)
    fixed = [one.code for one in wall().blocks if one.fidelity is Fidelity.FIXED]
    assert len(fixed) == 3  # half a stone, one, half a stone
    for block in scene.blocks:
        assert block.fidelity is (Fidelity.FIXED if block.code in fixed else Fidelity.DEFORMABLE)
        # 0.25 m is the smallest width of all of them
        assert block.mesh_size == (None if block.code in fixed else pytest.approx(0.125))
    kept = overlaid_scene(wall(), PROFILES["accurate"].rest, frozenset({"2-1"}))
    assert [one.code for one in kept.blocks if one.fidelity is Fidelity.RIGID] == ["2-1"]
    same = overlaid_scene(wall(), Overlay())
    assert (same.time, same.contact, same.solver) == (wall().time, wall().contact, wall().solver)
    assert all(one.fidelity is other.fidelity for one, other in zip(same.blocks, wall().blocks, strict=True))


@pytest.mark.parametrize(
    ("blocks", "free"),
    [
        (shapes.column(3, 0.8, 0.5, top=0.6), 0.0),  # three joints, three drums
        (shapes.semicircular_arch(7, 0.4), 1 / 8),  # eight joints, seven voussoirs
    ],
)
def test_the_free_part_of_the_joints_is_that_of_statics(blocks, free):
    scene = Scene("free", blocks, time=TimeSettings(step=0.01, start=Start.EQUILIBRIUM))
    assert loops(simulate(scene)) == pytest.approx(free)


def found(outcome="equilibrium", stress=(0.1, 0.1)):
    stones = {
        str(number): StoneQuantities(
            1.0, (0.0, 0.0, 0.0), *([None] * 4 if one is None else [1e5] * 3 + [one])
        )
        for number, one in enumerate(stress)
    }
    values = [1e5 if any(one is not None for one in stress) else None] * 3
    return Quantities(outcome, 1.0, *values, stones, {}, {}, 1e-5, 1e-5, {})


def expected(name, run, free):
    """Return the expected errors of a run in which stones without stress are rigid."""
    rigid = any(one.stress_error is None for one in run.stones.values())
    return expected_errors(name, run, free, rigid=rigid)


def test_what_is_expected_goes_with_the_estimates_of_the_run():
    for name in ("balanced", "accurate"):
        coarse, fine = (expected(name, found(stress=(one, one)), 0.2) for one in (0.1, 0.05))
        for quantity in (*TYPICAL, *BOUNDS):
            assert coarse[quantity].value == pytest.approx(2.0 * fine[quantity].value)
            assert coarse[quantity].of == QUANTITIES[quantity]
            assert coarse[quantity].bound == (quantity in BOUNDS)


def test_where_statics_decides_forces_hold_to_the_tolerance_and_rigid_stones_do_not_move():
    said = expected("fast", found(stress=(None, None)), 0.0)
    assert said["joint_forces"].value == 1e-4
    assert said["displacement"].value == pytest.approx(1.0, abs=0.01)
    assert "stone_von_mises_mean" not in said
    assert expected("fast", found(stress=(None, None)), 0.5)["joint_forces"].value > 0.1
    assert said["support_reactions"].value == said["joint_forces"].value  # these are forces in joints too


def test_stones_that_a_list_lets_deform_are_as_good_in_fast_as_in_balanced():
    fast, balanced = (expected(name, found(), 0.3) for name in ("fast", "balanced"))
    assert {**fast, "collapse": None} == {**balanced, "collapse": None}


def test_stones_that_deform_without_stress_count_like_others():
    """Stones of a ring deform only for the stress of their neighbours."""
    run = found(stress=(0.1, None))
    assert expected_errors("balanced", run, 0.3, rigid=False) == expected("balanced", found(), 0.3)
    nothing = expected_errors("balanced", found(stress=(None, None)), 0.3, rigid=False)
    assert list(nothing) == ["collapse"]  # no estimate, no claim


def test_rigid_neighbours_spoil_the_stress():
    alone = expected("balanced", found(), 0.3)
    mixed = expected("balanced", found(stress=(0.1, None)), 0.3)
    forces = mixed["joint_forces"].value
    assert forces == expected("fast", found(stress=(None, None)), 0.3)["joint_forces"].value
    whole = np.hypot(alone["stone_von_mises_mean"].value, forces)
    assert mixed["stone_von_mises_mean"].value == pytest.approx(whole)


@pytest.mark.parametrize("outcome", ["moving", "collapsed"])
def test_nothing_is_claimed_of_what_was_not_measured(outcome):
    assert expected("balanced", found(outcome), 0.3) == {}


def test_the_numbers_were_measured_at_all_profiles():
    assert list(ERRORS) == list(COLLAPSE) == list(PROFILES)
    for name in ("balanced", "accurate"):
        assert set(ERRORS[name]) == {*TYPICAL, *BOUNDS}
    assert all(low <= high for own in ERRORS.values() for _, low, high in own.values())


def test_the_table_of_the_page_is_that_of_the_profiles():
    section = PAGE.split("## Profiles", 1)[1].split("\n## ", 1)[0]
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in section.splitlines()
        if line.startswith("| ")
    ]
    assert rows[0] == ["setting", *PROFILES]
    keys = {
        "stones in no list of `[bodies]`": lambda one: one.rest.fidelity or "as the scene has it",
        "cells across a typical stone": lambda one: one.rest.cells,
        "`step` in motion, s": lambda one: one.step,
        "`theta` in motion": lambda one: one.theta,
    }
    named = set()
    for label, *cells in rows[1:]:
        (key,) = re.findall(r"^`?([a-z_]+)", label)
        named.add({"stones": "fidelity"}.get(key, key))
        value = keys.get(label, lambda one, key=key: getattr(one.rest, key))
        said = [value(one) for one in PROFILES.values()]
        assert cells == [f"{one:g}" if isinstance(one, int | float) else str(one) for one in said], label
    assert named == set(vars(Overlay()))
