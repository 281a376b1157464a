"""Kinds of solids by rule."""

from pathlib import Path

import numpy as np
import pytest

from archmodel.database.session import open_database
from archmodel.tables.entities import Entity
from ground.errors import QueryError, UsageError
from moma.cli.text.runs_and_surveys import ingest_lines
from pipelines.ingest.ingest import ingest
from pipelines.ingest.kind_rules import RULE_ATTRIBUTES, kind_rules
from pipelines.ingest.reading_options import reading_options, solid_options
from survey.formats.options import ReadingOptions
from survey.geometry.convex_parts import convex_parts
from survey.geometry.solids import Solid
from tests.survey.joints.assemblies import dome, groin, obj, prism, wall


def kinds_of(
    tmp_path: Path, text: str, rules: tuple[str, ...] = (), supports: tuple[str, ...] = ()
) -> dict[str, str]:
    (tmp_path / "stones.obj").write_text(text)
    url = f"sqlite:///{tmp_path / 'stones.db'}"
    ingest([tmp_path / "stones.obj"], url, "solids", rules=kind_rules(rules, supports))
    with open_database(url) as database, database.session(read_only=True) as session:
        return {one.code: one.kind for one in session.query(Entity)}


WALL = obj(wall(lean=0.0), None)  # four courses of 0.3 m, stones 0.51 m long, half stones at the ends of two


def test_supports_are_the_stones_that_stand_on_the_ground(tmp_path: Path) -> None:
    kinds = kinds_of(tmp_path, WALL, supports=("z < 0.01",))
    assert {code for code, kind in kinds.items() if kind == "support"} == {f"W0-{k}" for k in range(4)}
    assert set(kinds.values()) == {"support", "ashlar"}


def test_the_last_rule_that_holds_counts_and_supports_count_most(tmp_path: Path) -> None:
    rules = (
        "quoin: depth < 0.3",
        "voussoir: z > 0.5",
        "header: z > 0.8 and depth < 0.3",
        "sill: z_max < 0.31",
    )
    kinds = kinds_of(tmp_path, WALL, rules, ("code = W0-1", "code like 'W0-2'"))
    assert kinds["W1-0"] == kinds["W1-4"] == "quoin"  # half stones
    assert kinds["W1-1"] == "ashlar"
    assert kinds["W2-0"] == kinds["W3-1"] == "voussoir"
    assert kinds["W3-0"] == "header"
    assert kinds["W0-0"] == kinds["W0-3"] == "sill"
    assert kinds["W0-1"] == kinds["W0-2"] == "support"


@pytest.mark.parametrize(
    ("rule", "stones"),
    [
        ("volume > 0.05", {"W0", "W1", "W2", "W3"}),  # 0.51 · 0.3 · 0.37 = 0.0566
        ("volume < 0.05", {"W1", "W3"}),
        ("depth < length", {"W0", "W1", "W2", "W3"}),
        ("not depth > 0.3", {"W1", "W3"}),  # of half stones the larger side is at the end of the wall
        ("z in (0, 5)", {"W0"}),
        ("z_max >= 1.19 or z_max < 0.31", {"W0", "W3"}),
        ("course is null", {"W0", "W1", "W2", "W3"}),
        ("course > 1", set()),
        ("kind = ashlar and not code like 'w0%'", {"W1", "W2", "W3"}),
        ("kind = stone", {"W0", "W1", "W2", "W3"}),
        ("kind != stone", set()),
        ("kind in (header, rubble)", set()),
    ],
)
def test_rules_are_written_as_queries_are(tmp_path: Path, rule: str, stones: set[str]) -> None:
    kinds = kinds_of(tmp_path, WALL, (f"lintel: {rule}",))
    assert {code[:2] for code, kind in kinds.items() if kind == "lintel"} == stones


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ("z < 0.01", "names no kind"),
        (": z < 0.01", "names no kind"),
        ("voussoir: hight > 2", "unknown attribute 'hight'; known: height"),
        ("voussoir: z < low", "z is a number, 'low' is not"),
        ("voussoir: z < kind", "z is a number, 'kind' is not"),
        ("voussoir: z like '1%'", "z is a number, like is for texts"),
        ("voussoir: above(A)", "above is a function"),
        ("voussoir: z - 0.1 > 0", "a rule computes nothing"),
        ("voussoir: kind < header", "kinds have no order"),
        ("voussoir: z <", "is not a value"),
        ("voussoir:", "attribute"),
    ],
)
def test_bad_rules_say_what_is_wrong_with_them(rule: str, words: str) -> None:
    with pytest.raises(UsageError) as caught:
        kind_rules([rule])
    assert words in str(caught.value)


def test_errors_within_an_expression_point_at_it() -> None:
    with pytest.raises(QueryError, match="at character 11"):
        kind_rules(supports=["z < 1 and w > 2"])


def test_kinds_that_there_are_not_and_other_formats_are_refused_before_anything_is_read(
    tmp_path: Path,
) -> None:
    path = tmp_path / "stones.obj"
    path.write_text(WALL)
    url = f"sqlite:///{tmp_path / 'stones.db'}"
    with pytest.raises(UsageError, match="--kind-where: unknown kind 'vousoir'; did you mean voussoir"):
        ingest([path], url, "solids", rules=kind_rules(["vousoir: z > 0"]))
    with pytest.raises(UsageError, match="at character 9: unknown kind 'vousoir'; did you mean voussoir"):
        ingest([path], url, "solids", rules=kind_rules(["header: kind = vousoir"]))
    with pytest.raises(UsageError, match="--support: a rule for solids with format csv"):
        ingest([path], url, "csv", rules=kind_rules(supports=["z < 0"]))
    assert not (tmp_path / "stones.db").exists()


def test_what_a_rule_may_ask_for_is_documented() -> None:
    page = Path("docs/formats.md").read_text(encoding="utf-8")
    section = page.split("### Kinds by rule", 1)[1].split("\n#", 1)[0]
    for name in RULE_ATTRIBUTES:
        assert f"`{name}`" in section, name


# --- what the report says ---


def test_the_report_counts_what_is_convex_and_what_snapping_did(tmp_path: Path) -> None:
    path = tmp_path / "groin.obj"
    path.write_text(obj(groin(), 3))
    report = ingest(
        [path],
        f"sqlite:///{tmp_path / 'g.db'}",
        "solids",
        options=solid_options(ReadingOptions(), snap=0.003),
    )
    solids = report.files[0].solids
    assert solids is not None
    assert solids.snapping is not None
    assert (solids.convex, solids.not_convex) == (6, ("G0", "G1", "G2"))
    assert (solids.snapping.contacts, solids.snapping.planes, solids.snapping.left_open) == (18, 10, ())
    assert 1e-4 < solids.snapping.largest_movement < 1e-3


def test_what_comes_back_from_the_database_is_plane_and_says_how_it_came_to_be(tmp_path: Path) -> None:
    path, url = tmp_path / "dome.obj", f"sqlite:///{tmp_path / 'd.db'}"
    path.write_text(obj(dome(2), 3, doubled=True))
    ingest([path], url, "solids", options=solid_options(ReadingOptions(), snap=0.003))
    with open_database(url) as database, database.session(read_only=True) as session:
        for one in session.query(Entity):
            text = one.measurement.provenance_text
            assert "8 faces were there twice; 2 faces that are not plane were folded; snapped within" in text
            faces = tuple(tuple(face) for face in one.measurement.solid_faces)
            assert len(convex_parts(Solid(one.code, one.measurement.solid_vertices, faces))) == 2


def test_tolerances_and_units_that_make_no_sense_are_refused() -> None:
    with pytest.raises(UsageError, match="--snap: the tolerance is -1 m"):
        solid_options(ReadingOptions(), snap=-1.0)
    with pytest.raises(UsageError, match="--unit: unknown unit 'yd'; units: m, dm, cm, mm, ft, in"):
        reading_options(unit="yd")


def test_contacts_that_stay_open_are_listed(tmp_path: Path) -> None:
    """Two stones of a course, 6 mm apart in height, under one that lies half-way between."""
    path = tmp_path / "step.obj"
    heights = {"A": (0.0, 1.0, 0.0, 1.0), "B": (1.2, 2.0, 0.0, 1.006), "C": (0.0, 2.0, 1.003, 2.0)}
    stones = []
    for code, (left, right, low, high) in heights.items():
        front = np.array([(left, 0.0, low), (right, 0.0, low), (right, 0.0, high), (left, 0.0, high)])
        stones.append(prism(code, front, front + np.array([0.0, 1.0, 0.0])))
    path.write_text(obj(stones, 3))
    report = ingest(
        [path],
        f"sqlite:///{tmp_path / 's.db'}",
        "solids",
        options=solid_options(ReadingOptions(), snap=0.002),
    )
    lines = [line.strip() for line in ingest_lines(report, verbose=False)]
    assert "3 convex, 0 not" in lines
    assert "1 contacts left as they are:" in lines
    assert "B and C: others that share their planes are too far from a common one" in lines
    solids = report.files[0].solids
    assert solids is not None
    assert "snapped within 0.002 m: corners moved by up to 0 m" in solids.remarks["B"][0]
    assert f"B: {solids.remarks['B'][0]}" in [line.strip() for line in ingest_lines(report, verbose=True)]


@pytest.mark.parametrize(
    ("digits", "hint"), [(2, None), (3, "--snap 0.002"), (5, "--snap 2e-05"), (None, None)]
)
def test_coordinates_that_may_be_rounded_are_pointed_out(
    tmp_path: Path, digits: int | None, hint: str | None
) -> None:
    (tmp_path / "wall.obj").write_text(obj(wall(2, 2), digits))
    report = ingest([tmp_path / "wall.obj"], f"sqlite:///{tmp_path / 'w.db'}", "solids")
    found = [line for line in ingest_lines(report, verbose=False) if "decimals" in line]
    if hint is None:
        assert found == []
    else:
        (line,) = found
        assert line.strip().startswith(
            f"coordinates have {digits} decimals: if they are rounded, {hint} brings"
        )
