"""`moma propose`: what it prints, records and refuses."""

from dataclasses import replace

import pytest

from synthetic.buildings.facings import two_facings
from synthetic.buildings.ribs import RibVaultShape, rib_vault
from synthetic.buildings.window import make_window
from synthetic.formats import write_head, write_moma, write_obj
from tests.moma.commands import answer, fails, invoke, prints


@pytest.fixture
def holes(tmp_path):
    """A database with the sample without two stones."""
    survey = make_window().survey
    kept = tuple(one for one in survey.blocks if one.code not in {"W05-02", "W10-05"})
    write_moma(replace(survey, blocks=kept), tmp_path / "holes.moma")
    url = f"sqlite:///{tmp_path / 'holes.db'}"
    prints("ingest", tmp_path / "holes.moma", "--db", url)
    return url


@pytest.fixture(scope="module")
def facings(tmp_path_factory):
    """A database with a wall of two facings; tests do not write into it."""
    place = tmp_path_factory.mktemp("facings")
    write_moma(two_facings(3.0, 4, 2).building.survey, place / "two.moma")
    url = f"sqlite:///{place / 'two.db'}"
    prints("ingest", place / "two.moma", "--db", url)
    return url


def proposals(*arguments):
    return answer("propose", *arguments)


def entries(url):
    """Numbers of entries that the history of a stone tells."""
    return len(answer("query", "entity", "--db", url))


def test_missing_stones_are_proposed_and_nothing_is_recorded(holes):
    report = proposals("missing", "--db", holes)
    assert [one["code"] for one in report["proposals"]] == ["H-W05-02", "H-W10-05"]
    assert report["entry"] is None
    assert entries(holes) == 96
    again = invoke("propose", "missing", "--db", holes)
    assert "nothing is recorded: give --record" in again.stderr


def test_proposals_are_recorded_once_and_related(holes):
    report = proposals(
        "missing", "--db", holes, "--record", "--author", "A. Mason", "--source", "photographs"
    )
    assert report["entry"] is not None
    assert report["related"] == report["entry"] + 1
    assert entries(holes) == 98
    shown = answer("show", "H-W05-02", "--db", holes)
    assert shown["hypothesis"] is True
    assert set(shown["relations"]) >= {"rests_on", "supports", "beside"}
    history = prints("show", "H-W05-02", "--history", "--db", holes)
    assert "A. Mason, photographs" in history
    second = proposals("missing", "--db", holes, "--record")
    assert (second["proposals"], second["entry"]) == ([], None)
    assert "nothing to propose" in invoke("propose", "missing", "--db", holes).stderr


def test_where_limits_what_is_proposed_not_what_is_known(holes):
    report = proposals("missing", "--db", holes, "--where", "course = 5")
    assert [one["code"] for one in report["proposals"]] == ["H-W05-02"]
    assert report["stones"] == 96


def test_hypotheses_are_withdrawn_by_a_record(holes, tmp_path):
    proposals("missing", "--db", holes, "--record")
    before = answer("show", "W05-01", "--db", holes)["relations"]
    text = '[[withdraw]]\nwhat = "hypothesis"\nstones = ["H-W05-02"]\nsource = "a flue"\n'
    (tmp_path / "flue.toml").write_text(text, encoding="utf-8")
    assert "1 withdrawn" in prints("record", tmp_path / "flue.toml", "--db", holes)
    assert entries(holes) == 97
    after = answer("show", "W05-01", "--db", holes)["relations"]
    assert sum(map(len, after.values())) == sum(map(len, before.values())) - 1
    (tmp_path / "again.toml").write_text(text.replace("flue", "pipe"), encoding="utf-8")
    assert "nothing changed" in prints("record", tmp_path / "again.toml", "--db", holes)
    (tmp_path / "seen.toml").write_text(text.replace("H-W05-02", "W05-01"), encoding="utf-8")
    refused = fails(2, "record", tmp_path / "seen.toml", "--db", holes)
    assert "W05-01 is no hypothesis: it was surveyed" in refused
    # the hole is there as before
    assert [one["code"] for one in proposals("missing", "--db", holes)["proposals"]] == ["H-W05-01+1"]


def test_the_core_as_blocks_or_storeys(facings):
    core = proposals("infill", "--db", facings)["proposals"]
    assert {one["kind"] for one in core} == {"infill"}
    storeys = proposals("infill", "--db", facings, "--as", "storeys", "--storey-height", 0.5)["proposals"]
    assert 1 < len(storeys) < len(core)
    volumes = [sum(one["volume"] for one in some) for some in (core, storeys)]
    assert 0.9 * volumes[0] < volumes[1] < volumes[0]
    named = proposals("infill", "--db", facings, "--facings", "code like 'F%'", "code like 'B%'")["proposals"]
    assert [one["code"] for one in named][:3] == [one["code"] for one in core][:3]
    lower = proposals("infill", "--db", facings, "--where", "course <= 2")["proposals"]
    assert {one["course"] for one in lower} == {1, 2}


def test_the_core_is_recorded_once(tmp_path):
    write_moma(two_facings(2.5, 3, 3).building.survey, tmp_path / "two.moma")
    url = f"sqlite:///{tmp_path / 'two.db'}"
    prints("ingest", tmp_path / "two.moma", "--db", url)
    first = proposals("infill", "--db", url, "--record")
    assert first["entry"] is not None
    second = proposals("infill", "--db", url, "--record")
    assert (second["proposals"], second["entry"]) == ([], None)
    # another shape of the same core is none that is missing
    assert proposals("infill", "--db", url, "--as", "storeys")["proposals"] == []


@pytest.mark.parametrize("kind", ["web_stone", "severy"])
def test_stones_of_a_vault_are_no_facing(tmp_path, kind):
    """Webs and ribs with their backs to each other have no core between them, nor have subkinds of a user."""
    building = rib_vault(RibVaultShape(segments=4, wall_rib=0.22)).building
    named = tuple(
        replace(one, kind=kind if one.kind == "web_stone" else one.kind) for one in building.survey.blocks
    )
    head = building.survey.head
    rules = tuple(
        replace(one, kind=kind if one.kind == "web_stone" else one.kind) for one in head.depth_rules
    )
    survey = replace(building.survey, head=replace(head, depth_rules=rules), blocks=named)
    write_moma(survey, tmp_path / "vault.moma")
    write_obj(building.modelled, tmp_path / "solids.obj")
    write_head(head, tmp_path / "head.moma")
    (tmp_path / "kinds.toml").write_text(
        "[[kind]]\nname = 'severy'\nparent = 'web_stone'\ndefinition = 'A web stone of chalk.'\n",
        encoding="utf-8",
    )
    url = f"sqlite:///{tmp_path / 'vault.db'}"
    prints("record", tmp_path / "kinds.toml", "--db", url)
    prints("ingest", tmp_path / "vault.moma", "--db", url)
    solids = ["--format", "solids", "--header", tmp_path / "head.moma"]
    prints("ingest", tmp_path / "solids.obj", *solids, "--db", url)
    assert proposals("infill", "--db", url)["proposals"] == []


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["missing", "--as", "blocks"], "--as is for the core of walls"),
        (["missing", "--facings", "a", "b"], "--facings is for the core of walls"),
        (["infill", "--storey-height", 2.0], "--storey-height is for storeys"),
        (["infill", "--as", "storeys", "--storey-height", 0], "--storey-height is 0 m"),
        (["missing", "--author", "A"], "--author is for what is recorded"),
        (["infill", "--facings", "zone = 'x'", "zone = 'y'"], "no stone satisfies"),
        (["infill", "--facings", "course = 1", "course < 3"], "in both facings"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(facings, arguments, said):
    assert said in fails(2, "propose", *arguments, "--db", facings)
