"""The window bay of the sample: it stands; without what carries its arch it falls."""

from dataclasses import replace

import numpy as np
import pytest

from archmodel.database.session import open_database
from mechanics.dynamics.outcome import Outcome
from mechanics.scene.scene import Fidelity, Method, SolverSettings, TimeSettings
from mechanics.simulate import simulate
from pipelines.ingest.ingest import ingest
from pipelines.run.assemble import assemble
from pipelines.scene.file import read_scene
from tests.paths import ROOT

SAMPLE = ROOT / "data/samples/window"


@pytest.fixture(scope="module")
def assembly(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('window')}/window.db"
    ingest([SAMPLE / "window.moma"], url)
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        return assemble(read_scene(SAMPLE / "window.toml"), session)


def rigid(scene, without=()):
    """The scene in rigid stones, in true motion from the start."""
    blocks = tuple(
        replace(
            block,
            mesh_size=None,
            fidelity=Fidelity.FIXED if block.fidelity is Fidelity.FIXED else Fidelity.RIGID,
        )
        for block in scene.blocks
        if block.code not in without
    )
    return replace(
        scene,
        blocks=blocks,
        time=TimeSettings(step=2e-3, theta=1.0, duration=1.5),
        solver=SolverSettings(Method.NSGS, tolerance=1e-5, max_iterations=1000),
    )


def jamb_and_springers(assembly, side):
    """Codes of the jamb (+1 right, -1 left) and of the springers that stand on it."""
    stones = {m.record.code: m.record for m in assembly.models}
    middle = stones["V4"].outline[:, 0].mean()
    return {
        code
        for code, stone in stones.items()
        if stone.kind in ("jamb", "springer") and side * (stone.outline[:, 0].mean() - middle) > 0
    }


@pytest.mark.slow
def test_the_wall_of_rigid_stones_stands_and_every_stone_is_in_balance(assembly):
    result = simulate(rigid(assembly.scene))
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.reaction < 1e-3
    assert result.errors.balance < 1e-4
    weight = sum(b.mass for b in result.bodies if b.fidelity is not Fidelity.FIXED) * 9.81
    assert result.reaction == pytest.approx(weight, rel=1e-3)
    assert max(np.abs(b.displacement).max() for b in result.bodies) < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("side", [-1, 1])
def test_the_arch_falls_without_the_jamb_and_springers_of_one_side(assembly, side):
    gone = jamb_and_springers(assembly, side)
    assert len(gone) == 6
    result = simulate(rigid(assembly.scene, gone))
    assert result.outcome is Outcome.COLLAPSED
    fallen = {b.code for b in result.bodies if b.displacement[:, 2].min() < -0.01}
    assert "V4" in fallen
    assert len(fallen & {f"V{i}" for i in range(1, 8)}) >= 5
    # the other side of the wall does not move
    assert not fallen & {"W02-01", "W02-05", "W03-01", "W12-01"}


def test_the_wall_falls_without_its_keystone(assembly):
    assert simulate(rigid(assembly.scene, {"V4"})).outcome is Outcome.COLLAPSED


@pytest.mark.slow
def test_the_wall_of_deformable_stones_rests_with_its_weight_on_the_ground(assembly):
    result = simulate(assembly.scene)
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.errors.natural_map <= 1e-6
    assert result.errors.reaction < 1e-3
    assert result.errors.balance < 1e-4
    # the mean vertical stress in the course on the ground is about the weight over the bed of that course
    stressed = np.concatenate([b.von_mises for b in result.bodies if b.von_mises is not None])
    assert np.isfinite(stressed).all()
    second = [b for b in result.bodies if b.code.startswith("W02")]
    mean = np.average([-b.stress[:, 2].mean() for b in second], weights=[b.volume for b in second])
    panel = result.weight / (4.8 * 0.38)
    assert 0.7 * panel < mean < 1.3 * panel
