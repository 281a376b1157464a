"""Scenes model no more than their outputs require: stones read, deformed and computed, and the report on it."""

import json

import numpy as np
import pytest
from sqlalchemy import event
from typer.testing import CliRunner

from archmodel.tables.entities import Entity
from archmodel.tables.surveys import Measurement
from ground.errors import SceneError
from mechanics.scene.scene import Fidelity
from mechanics.simulate import simulate
from moma.cli import app
from moma.cli.text.checks import check_lines
from pipelines.run.assemble import assemble
from pipelines.run.check import check_scene
from pipelines.scene.file import parse_scene
from pipelines.scene.selection import select_groups, select_stones

LOW = """
[scene]
name = "Low"
[select]
where = ["course <= 4"]
[materials.limestone]
density = 2350.0
young = 12e9
poisson = 0.2
[bodies]
fixed = ["course = 1"]
[mesh]
size = 0.5
"""
REGION = LOW.replace("[mesh]", "ring = 1\n[mesh]") + '[output]\nstress = ["W03-04"]\npictures = []\n'
BESIDE_RIGID = "are rigid and spread forces otherwise"


def report_on(url, folder, text):
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return check_scene(path, url)


def test_nothing_is_read_of_stones_that_are_not_selected(session):
    """The expressions of lists and groups hold for most stones of the building."""
    read = {Entity: set(), Measurement: set()}
    text = LOW.replace("[materials", 'exclude = ["course = 4"]\n[materials')
    text = text.replace("fixed = [", 'deformable = ["length > 0"]\nfixed = [')
    scene = parse_scene(text + '[output]\nstress = ["depth > 0"]\n', "scene.toml")

    def note(one, _):
        read[Measurement if isinstance(one, Measurement) else Entity].add(one.id)

    for cls in read:
        event.listen(cls, "load", note, propagate=True)
    try:
        models = select_stones(scene, session)
        groups = select_groups(scene, session, models)
    finally:
        for cls in read:
            event.remove(cls, "load", note)
    assert len(read[Measurement]) == len(models) == 25
    assert len(read[Entity]) == 32  # with those that are excluded, whose surveys are not read
    assert groups["output", "stress"] == ({model.record.code for model in models},)


def test_the_region_deforms_with_its_ring_and_only_its_stress_is_computed(session):
    assembly = assemble(parse_scene(REGION, "scene.toml"), session)
    facing = {
        code
        for joint in assembly.closing.joints
        if "W03-04" in joint.stones
        for code in joint.stones
        if not code.startswith("W01")
    }
    blocks = {block.code: block for block in assembly.scene.blocks}
    assert {code for code, block in blocks.items() if block.fidelity is Fidelity.DEFORMABLE} == facing
    assert 4 <= len(facing) < 10
    assert {code for code, block in blocks.items() if block.stress} == {"W03-04"}
    alone = assemble(parse_scene(REGION.replace("ring = 1", "ring = 0"), "scene.toml"), session)
    assert [b.code for b in alone.scene.blocks if b.fidelity is Fidelity.DEFORMABLE] == ["W03-04"]
    result = simulate(alone.scene)
    stressed = [body for body in result.bodies if body.stress is not None]
    assert [body.code for body in stressed] == ["W03-04"]
    (remark,) = alone.remarks
    rigid = sum(block.fidelity is Fidelity.RIGID for block in alone.scene.blocks)
    assert remark.startswith(f"scene.toml:10: {rigid} stones {BESIDE_RIGID}")


def test_the_ring_is_meshed_coarser_unless_the_scene_says_how(session):
    def sizes(text):
        blocks = assemble(parse_scene(text, "scene.toml"), session).scene.blocks
        return {block.code: block.mesh_size for block in blocks if block.mesh_size is not None}

    usual = sizes(REGION)
    assert usual.pop("W03-04") == 0.5
    assert set(usual.values()) == {1.0}
    given = sizes(
        REGION.replace("[mesh]", "[mesh]\nring_size = 0.7")
        + '[[meshes]]\nstones = ["W03-05"]\nsize = 0.4\n[[meshes]]\nstones = ["course = 2"]\nelement = "hex8"\n'
    )
    assert (given.pop("W03-04"), given.pop("W03-05")) == (0.5, 0.4)
    assert set(given.values()) == {0.7}


def test_stress_of_no_stone_is_computed_where_none_is_asked_for(session):
    scene = parse_scene(
        LOW.replace("[mesh]", 'default = "deformable"\n[mesh]').replace("<= 4", "<= 2")
        + "[output]\nstress = []\n",
        "scene.toml",
    )
    result = simulate(assemble(scene, session).scene)
    soft = [body for body in result.bodies if body.fidelity is Fidelity.DEFORMABLE]
    assert len(soft) == 8
    for body in soft:
        assert (body.stress, body.von_mises, body.principal, body.values) == (None, None, None, None)
        assert len(body.cells) > 0
        assert body.volume == pytest.approx(np.sum(body.node_volume), rel=1e-9)
    assert all(one is None for frame in result.frames for one in frame.stresses)


def test_contacts_between_fixed_stones_are_not_computed(session):
    """Stones of the lowest course are beside each other, and share faces."""
    assembly = assemble(parse_scene(LOW.replace("<= 4", "<= 2"), "scene.toml"), session)
    held = [block.fidelity is Fidelity.FIXED for block in assembly.scene.blocks]
    beside = [
        joint for joint in assembly.closing.joints if all(code.startswith("W01") for code in joint.stones)
    ]
    assert len(beside) >= 8
    assert all(joint.area > 0.05 and not joint.left_open for joint in beside)
    bodies = simulate(assembly.scene).contacts.bodies
    assert len(bodies) > 30
    assert not np.array(held)[bodies].all(axis=1).any()


def test_check_says_how_each_stone_is_modelled_and_why(url, tmp_path):
    report = report_on(url, tmp_path, REGION)
    assert report.bodies["deformable"] == report.ring + 1
    stones = {one.code: one for one in report.stones}
    assert stones["W03-04"].stress
    lines = check_lines(report, verbose=False, explain=True)
    assert f"  stress of 1 stone; {report.ring} around them deform too" in lines
    assert "    W01-01  fixed       support: named in [bodies] fixed" in lines
    assert "    W03-04  deformable  stress asked for by [output] stress" in lines
    assert "    W03-05  deformable  within 1 joint of W03-04" in lines
    assert "    W04-07  rigid       no output needs its stress" in lines
    assert not any("support:" in line for line in check_lines(report, verbose=False))


def test_the_command_explains(url, tmp_path):
    (tmp_path / "low.toml").write_text(REGION)
    arguments = ["check", str(tmp_path / "low.toml"), "--db", url]
    short, long = (CliRunner().invoke(app, [*arguments, *more]).stdout for more in ([], ["--explain"]))
    explained = [line for line in long.splitlines() if line not in short.splitlines()]
    plan = json.loads(CliRunner().invoke(app, [*arguments, "--json"]).stdout)
    assert len(explained) == len(plan["stones"]) == sum(plan["bodies"].values()) == 32
    assert plan["stones"][0] == {
        "code": "W01-01",
        "fidelity": "fixed",
        "reason": "support: named in [bodies] fixed",
        "stress": False,
    }


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        (LOW, 12, "[mesh] has no effect: no stone deforms; ask for their stress by stress in [output]"),
        (
            REGION + '[[meshes]]\nstones = ["course = 2", "W01-01"]\nsize = 0.1\n',
            None,
            None,
        ),
        (
            REGION + '[[meshes]]\nstones = ["W01-01", "W04-07"]\nsize = 0.1\n',
            18,
            "[[meshes]] has no effect: none of its stones deforms",
        ),
        (REGION.replace('"W03-04"', '"course = 1"').replace("[mesh]\nsize = 0.5\n", ""), 14, "(W01-01: support"),
        (REGION.replace("[mesh]", 'rigid = ["W03-04"]\n[mesh]'), 17, "(W03-04: named in [bodies] rigid)"),
        (
            REGION.replace("[mesh]", 'rigid = ["W03-04"]\n[mesh]').replace('"W03-04"]\np', '"course = 3"]\np'),
            17,
            "1 of the stones of stress have none: W03-04 is rigid",
        ),
        (REGION.replace("ring = 1", 'default = "deformable"\nring = 2'), 13, "ring has no effect: it goes with"),
        (
            LOW.replace("[mesh]\nsize = 0.5\n", "ring = 2\n"),
            12,
            "ring has no effect: no stress in [output] asks for that of a stone",
        ),
        (REGION.replace("ring = 1", "ring = 2"), None, None),
        (
            REGION.replace("ring = 1", "ring = 0").replace("[mesh]", "[mesh]\nring_size = 1.0"),
            14,
            "ring_size has no effect: no stone deforms for the stress of another",
        ),
        (
            REGION.replace("ring = 1", 'default = "deformable"').replace("[mesh]", "[mesh]\nring_size = 1.0"),
            14,
            "ring_size has no effect: it goes with default",
        ),
    ],
)  # fmt: skip
def test_keys_without_effect_are_named_with_their_line(session, text, line, said):
    remarks = assemble(parse_scene(text, "scene.toml"), session).remarks
    idle = [one for one in remarks if BESIDE_RIGID not in one]
    if said is None:
        assert idle == []
        return
    found = [one for one in idle if said in one]
    assert len(found) == 1
    assert found[0].startswith(f"scene.toml:{line}: ")


MORTAR = '[[laws]]\ntype = "mortar"\nfriction = 0.5\ntension = 2e4\nshear = 2e4\n'


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        (LOW + MORTAR, None, None),
        (LOW + MORTAR.replace("shear = 2e4", "shear = 4e3"), 17, "no more than shear/friction = 8000 Pa is held"),
        (LOW + MORTAR.replace("friction = 0.5", "friction = 0").replace("r = 2e4", "r = 0"), None, None),
        (
            LOW + MORTAR + 'between = [["course = 1"], ["course = 4"]]\n',
            14,
            "[[laws]] has no effect: no joint lies between its stones",
        ),
        (LOW + MORTAR + 'between = [["course = 1"], ["course = 2"]]\n' + MORTAR, 14, "later laws hold in all of them"),
        (LOW + MORTAR + MORTAR + 'between = [["course = 1"], ["course = 2"]]\n', None, None),
        (LOW + "[joints]\nmode = 'as-surveyed'\n" + MORTAR + 'between = [["W01-01"], ["W04-01"]]\n', None, None),
    ],
)  # fmt: skip
def test_laws_without_effect_and_tension_beyond_the_cone_are_named_with_their_line(session, text, line, said):
    remarks = assemble(parse_scene(text, "scene.toml"), session).remarks
    found = [one for one in remarks if "[mesh]" not in one]
    if said is None:
        assert found == []
        return
    (remark,) = found
    assert remark.startswith(f"scene.toml:{line}: ")
    assert said in remark


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (LOW + '[output]\nstress = ["W99-01"]\n', r"scene.toml:15: stress: 'W99-01' is not the code"),
        (LOW + '[output]\nstress = ["course = 9"]\n', r"scene.toml:15: stress: no selected stone satisfies"),
        (
            REGION + '[[loads]]\ntype = "force"\nstones = ["W03-04"]\nforce = [0, 0, -1]\n',
            r"a force on stone W03-04, which is deformable",
        ),
    ],
)
def test_stress_that_cannot_be_had_is_refused(session, text, message):
    with pytest.raises(SceneError, match=message):
        assemble(parse_scene(text, "scene.toml"), session)


def test_a_neighbour_under_a_force_stays_rigid(session):
    text = REGION + '[[loads]]\ntype = "force"\nstones = ["W03-05"]\nforce = [0, 0, -1]\n'
    assembly = assemble(parse_scene(text, "scene.toml"), session)
    assert assembly.modelled["W03-05"].fidelity is Fidelity.RIGID
    assert "force" in assembly.modelled["W03-05"].reason
