"""The rib vault of a storey with a core, from the survey to rest: what its springers bear, and where it goes."""

import numpy as np
import pytest

from archmodel.database.session import open_database
from mechanics.dynamics.outcome import Outcome
from mechanics.scene.scene import Fidelity
from mechanics.simulate import simulate
from pipelines.propose.propose import Recording, propose_core
from pipelines.record.record import record
from pipelines.run.assemble import assemble
from pipelines.scene.file import read_scene
from synthetic.write import write_sample
from tests.moma.commands import answer, prints

SPRINGERS = ("T1", "T2", "T3", "T4")


@pytest.fixture(scope="module")
def storey(tmp_path_factory):
    """The database of a storey of 17 courses, its scene and its result."""
    folder = tmp_path_factory.mktemp("storey")
    write_sample("tower", folder, courses=17)
    url = f"sqlite:///{folder / 'storey.db'}"
    prints("ingest", folder / "tower.moma", "--db", url)
    solids = ["--format", "solids", "--header", folder / "head.moma"]
    prints("ingest", folder / "solids.obj", *solids, "--db", url)
    record([folder / "knowledge.toml"], url)
    propose_core(url, recording=Recording())
    with open_database(url, create=False) as database, database.session(read_only=True) as session:
        built = assemble(read_scene(folder / "tower.toml"), session)
    return url, built.scene, simulate(built.scene)


def pressing(scene, result, code):
    """Force of every other stone on a stone [N], by code."""
    names = [block.code for block in scene.blocks]
    out = {}
    for (candidate, antagonist), force in zip(result.contacts.bodies, result.contacts.force, strict=True):
        for own, other, sign in ((candidate, antagonist, 1.0), (antagonist, candidate, -1.0)):
            if names[own] == code:
                out[names[other]] = out.get(names[other], np.zeros(3)) + sign * force
    return out


@pytest.mark.slow
def test_the_storey_rests_with_its_vault(storey):
    _, scene, result = storey
    assert result.outcome is Outcome.EQUILIBRIUM
    assert result.reaction == pytest.approx(result.weight, rel=1e-6)
    fixed = {block.code for block in scene.blocks if block.fidelity is Fidelity.FIXED}
    assert {"T1", "T4"} <= fixed
    assert not any(name.startswith(("N", "E", "S", "W", "T2", "T3")) for name in fixed)


@pytest.mark.slow
def test_corbels_bear_the_vault_and_walls_its_thrust(storey):
    _, scene, result = storey
    on_springer = {code: pressing(scene, result, code) for code in SPRINGERS}
    of_vault = {
        code: sum(force for other, force in forces.items() if other[1] not in "IO")
        for code, forces in on_springer.items()
    }
    # a quarter of the weight each
    loads = np.array([-force[2] for force in of_vault.values()])
    assert loads == pytest.approx(np.full(4, loads.mean()), rel=0.05)
    for code, corbel in (("T2", "AI08-K2"), ("T3", "AI08-K1")):
        forces = on_springer[code]
        assert forces[corbel][2] > 0.7 * loads.mean()
        thrust = of_vault[code][:2]
        walls = sum(force for other, force in forces.items() if other[1] == "I" and other != corbel)
        # how much each takes is open between rigid stones, but not that both together take all, and walls only push
        both = walls + forces[corbel]
        assert -both[:2] == pytest.approx(thrust, rel=1e-3)
        assert -walls[:2] @ thrust > 0.0
        assert np.hypot(*forces[corbel][:2]) <= 0.6001 * forces[corbel][2]


@pytest.mark.slow
def test_its_stones_are_found_by_kind_zone_and_relation(storey):
    url = storey[0]

    def codes(kind, where):
        return {one["code"] for one in answer("query", kind, "--where", where, "--db", url)}

    assert codes("corbel", "zone = 'A inner' and course = 8") == {"AI08-K1", "AI08-K2"}
    assert codes("rib_springer", "rests_on(kind = corbel) and zone = vault") == {"T2", "T3"}
    assert codes("boss", "rests_on(kind = rib_segment)") == {"B"}
    assert codes("entity", "member_of(is_a(wall_rib)) and rests_on(T2)") == {"FE-17", "FS-01"}
    assert {code[:3] for code in codes("web_stone", "course = 9")} == {"N09", "E09", "S09", "W09"}
