"""Building in stages: what stands keeps its place and its forces, what is new is laid where it was drawn."""

from dataclasses import replace
from itertools import count

import numpy as np
import pytest

from ground.errors import SceneError
from mechanics.dynamics.handover import of_run
from mechanics.dynamics.outcome import Outcome
from mechanics.dynamics.simulation import Simulation
from mechanics.model.model import build_model
from mechanics.scene.laws.elastic_joint import ElasticJoint
from mechanics.scene.laws.mortar import MortarJoint
from mechanics.scene.loads.forces import StoneForce
from mechanics.scene.loads.load import Loads
from mechanics.scene.loads.motions import settlement
from mechanics.scene.loads.time_series import History
from mechanics.scene.scene import ContactSettings, Fidelity
from mechanics.scene.shapes import semicircular_arch
from mechanics.scene.stages import Stage
from mechanics.simulate import simulate, simulate_stages
from tests.mechanics.dynamics.test_resuming import Kept, assert_same_bits
from tests.mechanics.shapes import brick, ground, scene
from tests.validation.one_answer.matrix import Setting, at
from tests.validation.one_answer.scenes import SCENES

G = 9.81
SUNK = 0.02
CALM = {"step": 0.005, "duration": 3.0, "relaxation": True}


def portal(second=(), **time):
    """Two piers on supports of their own, of which the second sinks, and a beam across, in three stages."""
    base = [
        brick("A", (0, 0, -1), (1, 1, 0), Fidelity.FIXED),
        brick("B", (3, 0, -1), (4, 1, 0), Fidelity.FIXED),
    ]
    piers = [brick("a", (0.2, 0, 0), (0.8, 1, 2)), brick("b", (3.2, 0, 0), (3.8, 1, 2))]
    beam = brick("beam", (0.2, 0, 2), (3.8, 1, 2.5))
    sinks = Loads(motions=(settlement(["B"], (0, 0, -SUNK), 0.5),))
    plain = scene(*base, *piers, **CALM | time)
    return [
        Stage("piers", plain),
        Stage("settling", replace(plain, loads=sinks)),
        Stage("beam", scene(*base, *piers, beam, **CALM | time)),
    ]


def body(result, code):
    (found,) = [one for one in result.bodies if one.code == code]
    return found


def test_the_reaction_is_the_weight_after_every_stage():
    result = simulate_stages(portal())
    assert [one.outcome for one in result.stages] == ["equilibrium", "settled", "equilibrium"]
    assert [one.laid for one in result.stages] == [4, 0, 1]
    for stage, weight in zip(result.stages, 2000 * G * np.array([2.4, 2.4, 4.2]), strict=True):
        assert stage.weight == pytest.approx(weight, rel=1e-12)
        assert stage.reaction == pytest.approx(weight, rel=1e-6)
        assert stage.forces.sum(axis=0)[2] == pytest.approx(weight, rel=1e-6)
        assert stage.reaction_error < 1e-6


def test_a_stone_is_laid_level_over_one_that_has_sunk():
    """Mortar fills the bed; what is laid before the settlement leans."""
    stages = portal()
    late = simulate_stages(stages)
    assert np.abs(body(late, "beam").displacement).max() < 1e-4 * SUNK
    np.testing.assert_allclose(body(late, "b").displacement[:, 2], -SUNK, rtol=1e-3)
    assert late.stages[2].bed == pytest.approx(SUNK, rel=1e-3)
    early = simulate_stages(
        [stages[0], stages[2], Stage("settling", replace(stages[2].scene, loads=stages[1].scene.loads))]
    )
    assert early.outcome is Outcome.SETTLED
    assert body(early, "beam").displacement[:, 2].min() < -0.9 * SUNK
    assert early.stages[2].bed == 0.0


def test_what_has_risen_is_cut_off_the_stone_that_is_laid_on_it():
    stages = portal()
    rises = Loads(motions=(settlement(["B"], (0, 0, SUNK), 0.5),))
    stages[1] = replace(stages[1], scene=replace(stages[1].scene, loads=rises))
    result = simulate_stages(stages)
    assert result.outcome is Outcome.EQUILIBRIUM
    assert np.abs(body(result, "beam").displacement).max() < 1e-4 * SUNK
    assert result.stages[2].bed == pytest.approx(-SUNK, rel=1e-3)


def test_a_joint_that_is_drawn_open_stays_open():
    low, high = brick("low", (0, 0, 0), (1, 1, 1)), brick("high", (0, 0, 1.01), (1, 1, 2))
    result = simulate_stages(
        [Stage("low", scene(ground(), low, **CALM)), Stage("high", scene(ground(), low, high, **CALM))]
    )
    np.testing.assert_allclose(body(result, "high").displacement[:, 2], -0.01, rtol=1e-3)


def test_springs_keep_what_they_bore_before_the_next_course():
    """A stone W on springs k A sinks by W/kA as it is laid; built at once it also sinks with what bears it."""
    stiff, area = 1e7, 1.0
    stones = [ground(), *(brick(str(k), (0, 0, k), (1, 1, k + 1)) for k in range(3))]
    joints = ContactSettings(ElasticJoint(0.6, stiff, stiff))
    at_once = replace(scene(*stones, **CALM), contact=joints)
    stages = [Stage(str(k), replace(at_once, blocks=tuple(stones[: k + 2]))) for k in range(3)]
    sunk = 2000.0 * G / (stiff * area)
    # built at once the joints bear 3, 2 and 1 stones; what is laid last bears on each of them by itself alone
    whole, built = simulate(at_once), simulate_stages(stages)
    assert -body(whole, "2").displacement[:, 2].mean() == pytest.approx(6 * sunk, rel=1e-3)
    assert -body(built, "2").displacement[:, 2].mean() == pytest.approx(3 * sunk, rel=1e-3)
    assert -body(built, "0").displacement[:, 2].mean() == pytest.approx(3 * sunk, rel=1e-3)
    assert built.stages[2].bed == pytest.approx(2 * sunk, rel=1e-3)


@pytest.mark.parametrize("fidelity", [Fidelity.RIGID, Fidelity.DEFORMABLE])
def test_forces_go_on_under_new_numbers(fidelity):
    """A stone before all others is taken away: numbers of bodies, shapes and nodes change, forces and places do not."""
    aside = brick("0", (5, 0, 0), (6, 1, 1), fidelity)
    own = (
        ground((-2, -2, -1), (8, 3, 0)),
        brick("a", (0, 0, 0), (1, 1, 1), fidelity),
        brick("b", (0, 0, 1), (1, 1, 2)),
    )
    model, drawn = build_model(scene(aside, *own, **CALM))
    first = Simulation(model, drawn)
    for _ in range(200):
        step = first.step()
    after, there = build_model(scene(*own, **CALM))
    second = Simulation(after, first.handed_over().to(after, there))
    again = second.step()
    pairs = [tuple(one) for one in again.contacts.bodies]
    assert len(pairs) >= 8
    for pair in set(pairs):
        rows = [row for row, one in enumerate(pairs) if one == pair]
        old = step.force[[tuple(one - 1) == pair for one in step.contacts.bodies]]
        np.testing.assert_allclose(again.force[rows].sum(axis=0), old.sum(axis=0), rtol=1e-4, atol=1.0)
    assert again.solution.iterations <= step.solution.iterations + 1
    np.testing.assert_allclose(again.after.centre, step.after.centre[1:], atol=1e-7)


def test_a_broken_bond_stays_broken():
    stones = ground(), brick("a", (0, 0, 0), (1, 1, 1)), brick("b", (0, 0, 1), (1, 1, 2))
    bonded = replace(
        scene(*stones, **CALM | {"relaxation": False}), contact=ContactSettings(MortarJoint(0.6, 1e4, 1e5))
    )

    def pulled(name, *newtons):
        forces = tuple(StoneForce(frozenset({"b"}), History.constant((0, 0, one))) for one in newtons)
        return Stage(name, replace(bonded, loads=Loads(forces=forces)))

    weight = 2000 * G
    held = simulate_stages([pulled("rest"), pulled("pull", weight + 5e3)])
    assert held.outcome is Outcome.EQUILIBRIUM
    push = StoneForce(
        frozenset({"b"}),
        History(np.array([0.0, 0.1, 0.2]), np.array([[0, 0, weight + 2e4], [0, 0, weight + 2e4], [0, 0, 0]])),
    )
    broken = simulate_stages(
        [
            pulled("rest"),
            Stage("break", replace(bonded, loads=Loads(forces=(push,)))),
            pulled("again", weight + 5e3),
        ]
    )
    assert broken.outcome is not Outcome.EQUILIBRIUM
    assert len(broken.stages) == 3 or "were not built" in broken.cautions[0]


def arch(centred):
    """The left half of an arch, the right one, then all of it without the centring."""
    stones = semicircular_arch(9, 0.5, 2.0, 1.0)
    held = [replace(one, fidelity=Fidelity.FIXED) if centred else one for one in stones]
    feet = [number for number, one in enumerate(stones) if one.fidelity is Fidelity.FIXED]
    assert len(feet) == 2
    half = {*range(len(stones) // 2), *feet}
    return [
        Stage("half", scene(*(one for number, one in enumerate(held) if number in half), **CALM)),
        Stage("whole", scene(*held, **CALM)),
        Stage("free", scene(*stones, **CALM)),
    ]


def test_an_arch_needs_its_centring():
    stands = simulate_stages(arch(True))
    assert stands.outcome is Outcome.EQUILIBRIUM
    assert [one.held > 0 for one in stands.stages] == [True, True, False]
    assert [one.weight for one in stands.stages[:2]] == [0.0, 0.0]
    assert stands.stages[2].reaction_error < 1e-6
    falls = simulate_stages(arch(False))
    assert falls.outcome is not Outcome.EQUILIBRIUM
    assert len(falls.stages) == 1
    assert falls.cautions[0] == "2 of 3 stages were not built, as stage 'half' did not come to rest"


@pytest.mark.parametrize("at", [3, 100])
def test_a_resumed_building_takes_the_same_steps(at):
    """From a checkpoint within a stage, and from one at its beginning."""
    stages = portal()
    kept, steps = Kept(10), count()
    part = simulate_stages(stages, stop=lambda: next(steps) == at, archive=kept)
    assert part.outcome is Outcome.INTERRUPTED
    for step in list(kept.kept)[-2:]:
        again = simulate_stages(stages, archive=Kept(10, kept.kept[step]))
        assert_same_bits(simulate_stages(stages), again)


def test_stages_that_cannot_be_are_refused():
    first = portal()[0]
    with pytest.raises(SceneError, match="without stages"):
        simulate_stages([])
    with pytest.raises(SceneError, match="two stages of the same name"):
        simulate_stages([first, first])
    thrown = replace(first.scene.blocks[2], velocity=(1.0, 0, 0, 0, 0, 0))
    with pytest.raises(SceneError, match="begins in motion"):
        simulate_stages([Stage("thrown", replace(first.scene, blocks=(*first.scene.blocks[:2], thrown)))])


def test_an_ordinary_run_is_a_building_of_one_stage():
    one = portal()[2].scene
    alone, staged = simulate(one), simulate_stages([Stage("all", one)])
    assert len(staged.stages) == 1
    assert_same_bits(alone, replace(staged, stages=()))


def test_all_contacts_of_a_run_meet_as_it_begins():
    _, drawn = build_model(portal()[0].scene)
    assert of_run(drawn).meets(np.array([[0, 2], [2, 3]])).all()


def test_a_rest_that_strain_alone_holds_is_undecided_in_stages_too():
    """A lintel of two stones with upright joints, struck from its centring, falls if they do not deform."""
    setting = Setting("accurate", "auto", relaxation=True, static=False, step=1e-2)
    struck = at(SCENES["lintel of 2, 3×0.3, μ 0.7"], setting)
    held = replace(struck, blocks=tuple(replace(one, fidelity=Fidelity.FIXED) for one in struck.blocks))
    built = simulate_stages([Stage("centring", held), Stage("struck", struck)])
    assert built.outcome is Outcome.UNDECIDED
    assert "self-stress" in built.reason
    assert [(one.outcome, one.reason) for one in built.stages] == [
        ("equilibrium", ""),
        ("undecided", built.reason),
    ]
