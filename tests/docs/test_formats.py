"""docs/formats.md is true of the survey files that are read, and of the files that a run writes."""

import re
import shlex

import numpy as np
import pytest
from typer.testing import CliRunner

from moma.cli import app
from pipelines.results.summary import summarise
from survey.formats.native import reader as moma_ascii
from survey.formats.native.header import HeadReader
from survey.formats.native.reader import with_header
from survey.formats.native.stone import STONE_WORDS
from survey.formats.options import ReadingOptions
from survey.formats.reading import FORMATS, open_survey
from survey.formats.tables.reader import NEEDED, OPTIONAL
from survey.geometry.solids import Solid
from survey.records.survey import Reject
from tests.docs.quantities import PAGES, with_tables
from tests.paths import ROOT
from tests.pipelines.results_by_hand import deformable_body, result_of, rigid_body
from tests.survey.joints.assemblies import dome, obj
from tests.survey.scanned_stones import scanned_box, write_ply

PAGE = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def result():
    return result_of(
        [
            rigid_body("base", (0, 0, 0), (1, 1, 1)),
            deformable_body("D1", (0, 0, 1), (1, 1, 3), lambda points: np.ones(len(points)), 1.0),
        ]
    )


def rows(heading, columns):
    """Cells of the table under a heading."""
    section = re.split(r"\n## |\n# (?=[A-Z])", PAGE.split(f"\n## {heading}")[1])[0]
    found = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in section.splitlines()]
    return [row for row in found if len(row) == columns and row[0].startswith("`")]


@pytest.mark.parametrize("name", PAGES)
def test_tables_of_results_are_those_of_the_catalogue(name):
    """`python -m tests.docs.quantities` renews them."""
    page = (ROOT / "docs" / name).read_text(encoding="utf-8")
    assert with_tables(page) == page


def test_a_table_that_lacks_a_result_gets_it_back():
    line = next(one for one in PAGE.splitlines(keepends=True) if one.startswith("| `opening` | cells"))
    assert with_tables(PAGE.replace(line, "")) == PAGE


def test_every_key_of_the_summary_is_documented(result):
    section = PAGE.split("\n## `summary.json`")[1].split("\n## ")[0]
    named = set(re.findall(r"`(\w+)`", section))
    summary = summarise(result, version="1", seconds={})
    assert set(summary) <= named
    assert set(summary["joints"]) <= named
    assert set(summary["displacement"]) <= named
    assert set(summary["stress"]) <= named


def examples(language):
    """The examples of a format: what is behind its name, and the text."""
    return re.findall(rf"^```{language}(?: ([^\n]*))?\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)


def stones(path, text, format, **options):
    path.write_text(text, encoding="utf-8")
    stream = open_survey(path, format, ReadingOptions(**options))
    found = list(stream.blocks)
    assert not [one.error for one in found if isinstance(one, Reject)]
    return stream.head, found


def test_the_native_example_is_read(tmp_path):
    ((_, text),) = examples("moma")
    head, (first, second) = stones(tmp_path / "a.moma", text, "moma")
    assert (head.name, len(head.stations), len(head.control)) == ("north wall, bay 3", 2, 3)
    assert (len(head.depth_rules), len(head.canons), head.extrusion.tail) == (4, 1, 0.9)
    assert [len(one.marks) for one in head.photographs] == [4]
    assert (first.zone, first.station, first.depth, first.notes) == (
        "west bay",
        "S2",
        0.51,
        {"edge": "eroded"},
    )
    assert (len(first.vertices), len(first.points), first.sigmas[3]) == (4, 2, 0.010)
    assert (second.photograph, second.image.shape, len(second.vertices)) == ("P1", (4, 2), 0)


def test_the_header_file_is_read(tmp_path):
    ((_, text),) = examples("moma-head")
    path = tmp_path / "head.moma"
    path.write_text(text, encoding="utf-8")
    options = with_header(ReadingOptions(), path)
    assert (len(options.head.stations), len(options.head.depth_rules), options.sigma) == (1, 1, 0.004)


def test_the_tables_are_read(tmp_path):
    (_, one), (_, other) = examples("csv")
    _, (block,) = stones(tmp_path / "a.csv", one, "csv")
    assert (block.code, block.depth, block.sigmas.tolist()) == ("W01-01", 0.51, [0.003, 0.003, 0.003, 0.010])
    _, (block,) = stones(tmp_path / "b.csv", other, "csv")
    assert (block.code, block.kind, block.zone) == ("B_1", "sill", "west bay")
    assert (block.depth, block.depth_sigma) == pytest.approx((0.45, 0.02))
    assert block.depth_source == "drilled; see report"
    assert block.notes == {"name": "B 1", "bemerkung": "rissig"}
    np.testing.assert_allclose(block.points, [[10.16, 37.98, 6.86]])


def test_the_point_lists_are_read(tmp_path):
    (first, one), (template, other) = examples("pnezd")
    assert first == ""
    head, (block,) = stones(tmp_path / "a.txt", one, "pnezd")
    assert [station.name for station in head.stations] == ["S1"]
    assert block.kind == "ashlar"
    _, (again,) = stones(tmp_path / "b.txt", other, "pnezd", codes=template)
    assert (again.kind, again.course, again.names) == ("header", 1, ("104", "101", "102", "103"))
    np.testing.assert_array_equal(again.vertices, block.vertices)
    np.testing.assert_array_equal(again.points, block.points)


def test_the_solid_is_read(tmp_path):
    ((_, text),) = examples("obj")
    _, (solid,) = stones(tmp_path / "a.obj", text, "solids")
    assert (solid.code, solid.kind, [len(face) for face in solid.faces]) == ("W1", "header", [4] * 6)


def test_the_grammar_is_that_of_the_reader():
    """The one beside the code has remarks, and the same productions."""
    ((_, grammar),) = examples("ebnf")
    lines = re.sub(r"\(\* .*? \*\)", "", moma_ascii.__doc__).splitlines()
    beside = [line.strip() for line in lines if re.match(r"    (\w+ +=|  +\|) ", line)]
    assert beside == [line.strip() for line in grammar.splitlines()]


def test_every_word_of_the_native_format_is_explained():
    heads, stone, _ = PAGE.split("\n## The native format")[1].split("\n### ")[0].split("|---|---|")[1:]
    named = [re.findall(r"^\| (`.*?) \|", text, re.MULTILINE) for text in (heads, stone)]
    words = [set(re.findall(r"`(\w+)`", " ".join(one))) for one in named]
    assert words[0] == set(HeadReader().takers)
    assert words[1] == set(STONE_WORDS) - {"end"}


def test_every_column_of_the_tables_is_explained():
    names = [name for row in rows("Tables of points", 2) for name in re.findall(r"`(\w+)`", row[0])]
    assert names == [*NEEDED, *OPTIONAL]


def test_every_format_is_explained():
    table = PAGE.split("\n## ")[0]
    named = [
        name for row in re.findall(r"^\| (`.*?) \|", table, re.MULTILINE) for name in row.split("`")[1::2]
    ]
    assert [name for name in named if not name.startswith("-")] == list(FORMATS)


def test_the_commands_for_solids_do_what_they_say(tmp_path, monkeypatch):
    """On two rings of a dome, rounded to a millimetre, the lower of which stands on the ground."""
    section = PAGE.split("\n## Closed solids")[1].split("\n## Plausible")[0]
    found = re.findall(r"^```sh\n(.*?)^```$", section, re.MULTILINE | re.DOTALL)
    assert [line.split()[1] for text in found for line in text.splitlines()] == ["ingest"] * 3
    stones = [Solid(one.code, one.vertices - np.array([0, 0, 0.49]), one.faces) for one in dome(2)]
    (tmp_path / "vault.obj").write_text(obj(stones, 3))
    (tmp_path / "scans").mkdir()
    for number in range(2):
        points, triangles = scanned_box((0.5, 0.3, 0.24), 0.03, seed=number)
        write_ply(tmp_path / f"scans/S{number}.ply", points + np.array([0.51 * number, 0.0, 0.0]), triangles)
    monkeypatch.chdir(tmp_path)
    printed = []
    for number, text in enumerate(found):
        for line in text.splitlines():
            command = [*shlex.split(line)[1:], "--db", f"sqlite:///{number}.db"]
            done = CliRunner().invoke(app, command)
            assert done.exit_code == 0, done.output
            printed.append(done.stdout)
    assert "2 stones of survey 'scans' (2 ashlar)" in printed[0]
    assert "6 plane faces recognised" in printed[0]
    assert "20 stones of survey 'vault' (20 ashlar)" in printed[1]
    assert "0 convex, 20 not" in printed[1]
    assert "contacts brought into" in printed[1]
    assert "(10 support, 10 voussoir)" in printed[2]
