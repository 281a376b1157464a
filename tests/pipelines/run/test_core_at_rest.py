"""A wall of two facings with a core stands on the whole of its beds: no block of the core falls to find its rest."""

import numpy as np
import pytest

from mechanics.contact.contacts import gaps
from mechanics.dynamics.contact_search import detector
from mechanics.model.model import build_model
from mechanics.scene.laws.dry_joint import DryJoint
from mechanics.scene.scene import Block, ContactSettings, Fidelity, Scene, Start, TimeSettings
from mechanics.simulate import simulate
from mechanics.stones.materials import Material
from pipelines.ingest.records import surveyed_block
from pipelines.propose.propose import core_record
from survey.joints.close import close_joints
from survey.joints.settings import JointSettings
from survey.unseen.core.facings import facing_stone
from survey.unseen.core.propose import propose_infill
from synthetic.buildings.facings import two_facings

STONE = Material("limestone", density=2350.0, young=12e9, poisson=0.2)
RUBBLE = Material("core", density=1900.0, young=1e9, poisson=0.2)


@pytest.fixture(scope="module")
def built():
    """Scene of the wall, from its survey, and which of its blocks are core."""
    blocks = two_facings(5.0, 8).building.blocks()
    alone = close_joints(blocks)
    stones = [facing_stone(block, solid) for block, solid in zip(blocks, alone.solids, strict=True)]
    core = [surveyed_block(core_record(one)) for one in propose_infill(stones)]
    closed = close_joints([*blocks, *core], JointSettings(max_width=0.04))
    origin = closed.solids[0].vertices.mean(axis=0)
    scene = Scene(
        "wall",
        tuple(
            Block(
                solid.code,
                solid.vertices - origin,
                solid.faces,
                RUBBLE if block.kind == "infill" else STONE,
                Fidelity.FIXED if block.course == 1 else Fidelity.RIGID,
            )
            for block, solid in zip([*blocks, *core], closed.solids, strict=True)
        ),
        contact=ContactSettings(law=DryJoint(friction=0.6)),
        time=TimeSettings(step=0.005, theta=1.0, duration=0.1, relaxation=True, start=Start.EQUILIBRIUM),
    )
    return scene, np.array([block.kind == "infill" for block in [*blocks, *core]])


def test_blocks_of_the_core_bear_on_what_is_below_them_and_no_strip_is_as_thin_as_a_relief(built):
    scene, core = built
    model, state = build_model(scene)
    contacts = detector(model)(state, np.zeros(len(core)))
    level = np.abs(contacts.frame[:, 0, 2]) > 0.9
    beside = core[contacts.bodies].any(axis=1)
    area = contacts.area[level & beside]
    gap = gaps(contacts, state)[level & beside]
    # no bed is open by more than an ångström over a thousandth of the area
    assert area[gap > 1e-10].sum() < 1e-3 * area.sum()
    # strips along the hidden sides, of which a fifth of all pairs were, are gone
    pairs, pair = np.unique(contacts.bodies[beside], axis=0, return_inverse=True)
    total = np.bincount(pair.ravel(), contacts.area[beside], len(pairs))
    point = contacts.arm[beside][:, 0]
    length = np.array([np.ptp(point[pair.ravel() == k], axis=0).max() for k in range(len(pairs))])
    assert np.mean(total < 0.005 * length) < 0.08


def test_the_wall_rests_where_it_was_built(built):
    scene, _ = built
    result = simulate(scene)
    assert result.outcome.value == "equilibrium"
    assert result.cautions == ()
    weight = 9.81 * sum(body.mass for body in result.bodies if body.code in _moving(scene))
    assert result.reaction == pytest.approx(weight, rel=1e-6)


def _moving(scene):
    return {block.code for block in scene.blocks if block.fidelity is not Fidelity.FIXED}
