"""Tables, layers and drawings as files of knowledge: mapped columns, relations, files that come back."""

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import select, update

from archmodel.database.as_known import as_known
from archmodel.database.session import open_database
from archmodel.describe.entity import describe
from archmodel.query.api import find_faces, find_rows
from archmodel.query.geojson import feature_collection
from archmodel.store.revisions import RowCounts
from archmodel.stratigraphy.graphml import read_graphml
from archmodel.tables.entities import Entity
from archmodel.tables.knowledge import Note, Statement
from ground.errors import UsageError
from pipelines.draw.stratigraphy.matrix import draw, study
from pipelines.record.export.export import export_file
from pipelines.record.record import record
from survey.clouds.outlines.vector import read_vector
from tests.archmodel.stones import box_stone, store
from tests.archmodel.stratigraphy.drawings import artifact, drawing, group, line, shape

STONES = (
    box_stone("S1", "header", course=1, at=(0.0, 0.0, 0.0)),
    box_stone("S2", "stretcher", course=1, at=(1.0, 0.0, 0.0)),
    box_stone("S3", "stretcher", course=2, at=(0.0, 0.0, 1.0)),
)


@pytest.fixture
def url(new_url: Callable[[], str]) -> str:
    made = new_url()
    store(made, STONES)
    return made


def file(tmp_path: Path, name: str, text: str) -> Path:
    """A file of this text."""
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


def stated(url: str, author: str = "A", **options: str) -> Callable[[Path], dict[str, RowCounts]]:
    """Record a file; the outcome by table."""
    return lambda path: record([path], url, author=author, source="by eye", **options).files[0].tables


def known(url: str) -> dict[str, tuple[object, ...]]:
    """Phase, material and mark of each stone."""
    with open_database(url) as database, database.session(read_only=True) as session:
        rows = find_rows(session, "entity", columns=["code", "phase", "material", "mark"])
    return {str(row["code"]): tuple(row.values())[1:] for row in rows}


@pytest.mark.parametrize(
    "text",
    [
        "Stein;Art;Lage;Phase;Material;Steinmetzzeichen;x;y\nS1;header;1;II;Tuff;Fisch;0,0;0\nS1;header;1;II;Tuff;Fisch;0,3;0\n",
        "code,building phase,rock,mason's mark\nS1,II,Tuff,Fisch\nS2,,-,\n",
        "Südwand\nStein Nr.\tBauphase\tGestein\tSMZ\nS1\tII\tTuff\tFisch\nS2\t?\t\t\n",
    ],
)
def test_columns_become_statements_in_any_usual_form(url: str, tmp_path: Path, text: str):
    path = file(tmp_path, "table.csv", text)
    tables = stated(url)(path)
    assert (tables["phase"], tables["material"], tables["mark"]) == (RowCounts(new=1),) * 3
    assert tables["new phase"] == RowCounts(new=1)
    assert known(url)["S1"] == ("II", "Tuff", "Fisch")
    assert known(url)["S2"] == (None, None, None)
    assert stated(url)(path) == {}


def test_a_table_needs_author_and_source_and_says_where_it_is_wrong(url: str, tmp_path: Path):
    path = file(tmp_path, "t.csv", "Stein;Phase\nS1;II\nS9;II\n")
    with pytest.raises(UsageError, match=r"the author.*--author NAME"):
        record([path], url, source="by eye")
    with pytest.raises(UsageError, match="the source"):
        record([path], url, author="A")
    with pytest.raises(UsageError, match=r"t\.csv:3: there is no stone 'S9'"):
        stated(url)(path)
    twice = file(tmp_path, "two.csv", "Stein;Phase\nS1;II\nS1;III\n")
    with pytest.raises(UsageError, match=r"two\.csv:3: phase of S1 is 'III', but 'II' in line 2"):
        stated(url)(twice)
    assert known(url)["S1"] == (None, None, None)


def test_other_columns_are_chosen_by_name(url: str, tmp_path: Path):
    path = file(tmp_path, "t.csv", "Inventar;Zeitstellung\nS1;II\n")
    with pytest.raises(UsageError, match=r"no line names the columns|no column names the stones"):
        stated(url)(path)
    stated(url, columns="code=Inventar,phase=Zeitstellung")(path)
    assert known(url)["S1"][0] == "II"


def test_a_layer_of_ones_own_comes_back_unchanged_and_its_edits_are_opinions(url: str, tmp_path: Path):
    stated(url)(file(tmp_path, "t.csv", "Stein;Phase;Bemerkung\nS1;II;worn\nS2;I;\n"))
    with open_database(url) as database, database.session(read_only=True) as session:
        columns = ["code", "phase", "phase_begins", "material", "mark", "depth_origin", "measurements"]
        layer = feature_collection(find_faces(session, "entity", columns=columns))
        (note,) = session.scalars(select(Note))
        assert (note.key, note.text) == ("remark", "worn")
    path = file(tmp_path, "own.geojson", json.dumps(layer))
    assert stated(url, "B")(path)["phase"] == RowCounts(unchanged=2)
    with open_database(url) as database, database.session(read_only=True) as session:
        assert not list(session.scalars(select(Statement).where(Statement.author == "B")))
    edited = file(tmp_path, "edited.geojson", json.dumps(layer).replace('"phase": "I"', '"phase": "III"'))
    tables = stated(url, "B")(edited)
    assert tables["phase"] == RowCounts(new=1, unchanged=1)
    assert known(url)["S2"][0] == "III"


def test_attributes_of_a_geopackage_are_read(url: str, tmp_path: Path):
    path = tmp_path / "layer.gpkg"
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("CREATE TABLE gpkg_contents (table_name TEXT, data_type TEXT)")
        connection.execute("INSERT INTO gpkg_contents VALUES ('stones', 'features')")
        connection.execute("CREATE TABLE stones (fid INTEGER, geom BLOB, Stein TEXT, Phase TEXT)")
        connection.execute("INSERT INTO stones VALUES (1, x'00', 'S3', 'IV')")
    stated(url)(path)
    assert known(url)["S3"][0] == "IV"


def test_a_geopackage_of_ones_own_comes_back_unchanged_and_its_edits_are_opinions(url: str, tmp_path: Path):
    stated(url)(file(tmp_path, "first.csv", "code;phase;mark\nS1;I;fish\nS2;I;\n"))
    path = tmp_path / "own.gpkg"
    export_file(url, path)
    counts = stated(url, "B")(path)
    assert sum(counts.values(), RowCounts()).changes == 0
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE stones SET phase = 'II' WHERE code = 'S2'")
    assert stated(url, "B")(path)["phase"].changes == 1
    assert (known(url)["S1"][0], known(url)["S2"][0]) == ("I", "II")


def test_what_was_assumed_of_a_depth_stays_assumed_in_a_geopackage(url: str, tmp_path: Path):
    pytest.importorskip("pyogrio")
    path = tmp_path / "own.gpkg"
    with open_database(url) as database, database.session() as session:
        session.execute(update(Entity).where(Entity.code == "S1").values(depth_origin="rule"))
    export_file(url, path)
    outlines, _ = read_vector(path, "elevation", {})
    said = {outline.code: outline.said for outline in outlines}
    with open_database(url) as database, database.session(read_only=True) as session:
        rows = find_rows(session, "entity", columns=["code", "depth", "depth_origin", "depth_source", "zone"])
    for row in rows:
        stone = said[str(row["code"])]
        stored = (stone.depth_origin, stone.depth_source, stone.zone)
        assert stored == (row["depth_origin"], row["depth_source"], row["zone"])
        assert stone.depth == pytest.approx(row["depth"], abs=1e-9)
    assert said["S1"].depth_origin == "rule"


@pytest.mark.parametrize(
    "text",
    [
        "unit;relation;unit\n101;over;102\n102;cuts;103\n103;abuts;S1\n",
        "Befund,Beziehung,Befund 2\n102,unter,101\n102,schneidet,103\nS1,angebaut von,103\n",
        "101\tliegt über\t102\n103\tgeschnitten von\t102\n103\tstößt an\tS1\n",
    ],
)
def test_relations_of_a_list_make_units_and_a_matrix(url: str, tmp_path: Path, text: str):
    tables = stated(url)(file(tmp_path, "harris.csv", text))
    assert tables == {"unit": RowCounts(new=3), "stratigraphy": RowCounts(new=3)}
    with open_database(url) as database, database.session(read_only=True) as session:
        matrix = study(session)
    assert matrix.order.below == {"101": ("102",), "102": ("103",), "103": ("S1",), "S1": ()}


def test_a_loop_is_refused_and_nothing_is_recorded_but_authors_may_disagree(url: str, tmp_path: Path):
    stated(url)(file(tmp_path, "a.csv", "u;r;u\n1;over;2\n2;over;3\n"))
    loop = file(tmp_path, "b.csv", "u;r;u\n3;over;1\n4;over;3\n")
    with pytest.raises(UsageError, match=r"later than itself: .*3 above 1"):
        stated(url)(loop)
    stated(url, "B")(loop)
    with open_database(url) as database, database.session(read_only=True) as session:
        with pytest.raises(UsageError, match="these are opinions of A, B"):
            study(session)
        assert study(session, "B").order.below["4"] == ("3",)
        with as_known(session, 2) as then:
            assert set(study(then).order.units) == {"1", "2", "3"}


RELATIONS = """
[record]
author = "A"
[[structure]]
kind = "stratigraphic_unit"
code = "SU 1"
stones = ["S1"]
[[structure]]
kind = "stratigraphic_unit"
code = "SU 2"
[[phase]]
name = "late"
begins = 1500
[[phase]]
name = "early"
ends = 1200
[[of_phase]]
phase = "late"
structures = ["SU 2"]
[[of_phase]]
phase = "early"
structures = ["SU 1"]
[[relation]]
kind = "rests_on"
structures = ["SU 1"]
to = ["SU 2"]
[[relation]]
kind = "abuts"
of = ["S2"]
to = ["SU 1", "S3"]
"""


def test_relations_of_structures_and_stones_in_toml_are_stated_and_withdrawn(url: str, tmp_path: Path):
    record([file(tmp_path, "r.toml", RELATIONS)], url)
    with open_database(url) as database, database.session(read_only=True) as session:
        matrix = study(session)
        assert {str(link) for link in matrix.links} == {"SU 1 above SU 2", "S2 abuts SU 1", "S2 abuts S3"}
        (wrong,) = matrix.contradictions
        assert (wrong.unit, wrong.target) == ("SU 1", "SU 2")
        page = draw(matrix, tmp_path / "m.html")
        assert '<tr id="unit-SU 1"><td>SU 1</td>' in page
        assert "<td>S1</td>" in page
    back = '[record]\nauthor = "A"\n[[withdraw]]\nwhat = "relation"\nkind = "below"\n'
    back += 'structures = ["SU 2"]\nto = ["SU 1"]\n'
    record([file(tmp_path, "w.toml", back)], url)
    with open_database(url) as database, database.session(read_only=True) as session:
        assert len(study(session).links) == 2


def test_a_relation_of_stones_by_geometry_is_none_of_structures(url: str, tmp_path: Path):
    wrong = RELATIONS.replace("rests_on", "across_the_wall")
    with pytest.raises(UsageError, match="SU 1 is a structure, and across_the_wall a relation of stones"):
        record([file(tmp_path, "r.toml", wrong)], url)


def test_a_column_of_damage_takes_terms_in_any_language(new_url: Callable[[], str], tmp_path: Path):
    made = new_url()
    store(made, STONES)
    terms = file(
        tmp_path,
        "terms.toml",
        '[[term]]\nvocabulary = "observation"\nname = "crack"\nlabels = { de = "Riss" }\n',
    )
    record([terms], made, author="A", source="glossary")
    assert stated(made)(file(tmp_path, "damage.csv", "Stein;Schaden\nS1;Riss\n"))["observation"] == RowCounts(
        new=1
    )
    with pytest.raises(UsageError, match="unknown type of observation 'Sprung'"):
        stated(made)(file(tmp_path, "wrong.csv", "Stein;Schaden\nS1;Sprung\n"))
    with open_database(made) as database, database.session(read_only=True) as session:
        assert [
            row["code"] for row in find_rows(session, "entity", ["observed(Riss)"], columns=["code"])
        ] == ["S1"]


def test_a_drawing_brings_units_with_kinds_titles_and_parents_and_tells_what_it_leaves_out(
    url: str, tmp_path: Path
):
    path = drawing(
        tmp_path / "em.graphml",
        group("n0", "#9B3333", "US10", shape("n1", "TSU", "TSU12")),
        shape("n2", "USVs", "USV3", "lost pier"),
        artifact("n3", "ARTIFACT_TYPE_DATA_OBJECT", "D.1"),
        line("n0", "n2", "line", "copre"),
        line("n2", "n3", "dashed"),
    )
    report = record([path], url, author="A", source="drawn").files[0]
    assert report.tables == {
        "unit": RowCounts(new=3),
        "stratigraphy": RowCounts(new=1),
        "note": RowCounts(new=2),
    }
    assert report.notes == (
        "left out, as it is no stratigraphy: 1 documents, 1 lines of provenance (dashed)",
        "3 units are new, as structures of the kind stratigraphic_unit",
    )
    with open_database(url) as database, database.session(read_only=True) as session:
        assert describe(session, "TSU12")["part_of"] == ["US10"]
        assert describe(session, "USV3")["title"] == "lost pier"
        again = tmp_path / "again.graphml"
        again.write_text(draw(study(session), again), encoding="utf-8")
    # what holds is no new opinion of whoever brings the drawing back; what was drawn into it is
    assert record([again], url, author="B", source="drawn").files[0].outcome.changes == 0
    text = again.read_text(encoding="utf-8").replace(">above<", ">cuts<")
    again.write_text(text, encoding="utf-8")
    counts = record([again], url, author="B", source="drawn").files[0].tables
    assert counts == {"stratigraphy": RowCounts(new=1)}


def test_absolute_dates_of_a_drawing_date_its_units_and_go_out_again(url: str, tmp_path: Path):
    def dated(number: str, name: str, text: str) -> str:
        drawn = artifact(number, "ARTIFACT_TYPE_ANNOTATION", name)
        return drawn.replace("<data key='d6'>", f"<data key='d5'>{text}</data><data key='d6'>", 1)

    path = drawing(
        tmp_path / "em.graphml",
        shape("n1", "US", "US1"), shape("n2", "US", "US2"), shape("n3", "US", "US3"),
        dated("p1", "absolute_time_start", "circa 1238"), dated("p2", "absolute_time_end", "1210"),
        line("n1", "n2", "line", "copre"), line("n2", "n3", "line", "copre"),
        line("n3", "p1", "dashed"), line("n1", "p2", "dashed"),
    )  # fmt: skip
    report = record([path], url, author="A", source="drawn").files[0]
    assert report.tables["note"] == RowCounts(new=2)
    assert not any("left out" in note for note in report.notes)
    with open_database(url) as database, database.session(read_only=True) as session:
        matrix = study(session)
        # what lies on US3 is not older; US1 ended before US3 began
        assert [matrix.bounds[unit].begins for unit in ("US3", "US2", "US1")] == [1238, 1238, 1238]
        (wrong,) = matrix.contradictions
        assert wrong.text == "US1 (?–1210) lies later than US3 (1238–?): US1 > US2 > US3"
        rows = find_rows(session, "stratigraphic_unit", ["contradicted()"], columns=["code"])
        assert {row["code"] for row in rows} == {"US1", "US3"}
        again = tmp_path / "again.graphml"
        again.write_text(draw(matrix, again), encoding="utf-8")
    units = read_graphml(again).units
    assert (units["US3"].begins, units["US1"].ends) == ("circa 1238", "1210")
    assert record([again], url, author="B", source="drawn").files[0].outcome.changes == 0
    # a date that somebody changes in the drawing is theirs
    again.write_text(again.read_text(encoding="utf-8").replace(">1210<", ">1310<"), encoding="utf-8")
    record([again], url, author="B", source="drawn")
    with open_database(url) as database, database.session(read_only=True) as session:
        assert study(session).contradictions == ()
