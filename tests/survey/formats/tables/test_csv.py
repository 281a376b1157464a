from itertools import product
from pathlib import Path

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.formats.options import ReadingOptions, whole
from survey.formats.tables.reader import open_csv
from survey.records.survey import BlockRecord, Reject, Station, Survey, SurveyHead

HEAD = "block,kind,course,role,x,y,z\n"
ROWS = "A,header,1,vertex,0,0,0\nA,header,1,vertex,1,0,0\nA,header,1,vertex,1,1,0\n"


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "wall.csv"
    path.write_text(text, encoding="utf-8")
    return path


def read_csv(path: Path, sigma: float = 0.003) -> Survey:
    return whole(open_csv(path, ReadingOptions(sigma=sigma)), path)


def test_the_sample_written_as_a_table_is_the_same_survey(tmp_path: Path, survey: Survey) -> None:
    lines = ["role,block,kind,course,z,y,x,depth,sigma"]  # columns in an order of their own
    for b in survey.blocks:
        for role, places in (("vertex", b.vertices), ("point", b.points)):
            start = f'{role},"{b.code}",{b.kind},{b.course or ""}'
            end = f"{b.depth or ''},{b.sigma}"
            lines += [f"{start},{float(z)!r},{float(y)!r},{float(x)!r},{end}" for x, y, z in places]
    table = read_csv(write(tmp_path, "\r\n".join(lines)))
    assert table.head.name == "wall"
    for a, b in zip(table.blocks, survey.blocks, strict=True):
        np.testing.assert_array_equal(a.vertices, b.vertices)
        np.testing.assert_array_equal(a.points, b.points)
        assert (a.code, a.kind, a.course, a.depth) == (b.code, b.kind, b.course, b.depth)
        assert a.sigma == pytest.approx(b.sigma, rel=1e-12)


def test_what_is_left_out_has_a_default(tmp_path: Path) -> None:
    (block,) = read_csv(write(tmp_path, HEAD + ROWS.replace(",1,vertex", ",,vertex"))).blocks
    assert (block.course, block.sigma, block.depth, block.points.shape) == (None, 0.003, None, (0, 3))


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("", 1, "no column 'block'"),
        ("block,kind,course,role,x,y\n", 1, "no column 'z'"),
        (HEAD.replace("z\n", "z,detph\n"), 1, "'detph', nearly depth"),
        (HEAD, 2, "no points"),
        (HEAD + "A,header,1,vertex,0,0\n", 2, "6 fields for 7 columns"),
        (HEAD + "A,header,1,blob,0,0,0\n", 2, "'blob'"),
        (HEAD + "A,header,one,vertex,0,0,0\n", 2, "'one'"),
        (HEAD + "A,header,1,vertex,0,0,inf\n", 2, "'inf'"),
        (HEAD + "?!,header,1,vertex,0,0,0\n", 2, "'?!'"),
        (HEAD + 'A,header,1,vertex,0,0,"0\n', 2, "table line"),
        (HEAD + ROWS + "A,jamb,1,point,0,0,0\n", 5, "line 2"),
        (HEAD + ROWS[:48], 2, "2 vertices"),
        (
            HEAD.replace("z\n", "z,depth\n") + "A,header,1,point,0,0,0,1\nA,header,1,point,0,0,0,2\n",
            3,
            "1 m before",
        ),
        (HEAD + ROWS + 'A,header,1,point,0,0,1.5\nA,header,1,point,0,0,"1,5"\n', 6, "decimal comma"),
        (HEAD.replace(",", ";") + ROWS.replace(",", ";").replace("1;1;0", "1.234,5;1;0"), 4, "'1.234,5'"),
        (HEAD.replace(",", ";") + ROWS.replace(",", ";").replace(";1;0;0", ";1,5;0;0.5"), 3, "line 3 writes"),
        (HEAD.replace("z\n", "z,depth_sigma\n") + ROWS.replace("\n", ",0.1\n"), 2, "no depth"),
        (HEAD.replace("z\n", "z,station\n") + ROWS.replace("\n", ",S\n"), 2, "no station 'S'"),
        (
            HEAD.replace("z\n", "z,zone\n") + ROWS.replace("\n", ",a\n", 1).replace("0\n", "0,b\n"),
            3,
            "'a' before",
        ),
        (HEAD.replace("z\n", "z,sigma\n") + ROWS.replace("\n", ",0\n"), 2, "greater than 0"),
        (HEAD.replace("course", "kind"), 1, "are both kind"),
        (HEAD.replace("z\n", "z,x\n"), 1, "'x'"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, text: str, line: int, words: str) -> None:
    with pytest.raises(SurveyError) as error:
        read_csv(write(tmp_path, text))
    assert f"wall.csv:{line}: " in str(error.value)
    assert words in str(error.value)


@pytest.mark.parametrize(("separator", "mark"), [(",", "."), *product([";", "\t"], ".,")])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_tables_of_all_lands_say_the_same(tmp_path: Path, separator: str, mark: str, encoding: str) -> None:
    rows = [
        ("Block", "KIND", "course", "role", "x", "y", "z", "sigma", "depth", "depth_sigma", "depth_source", "zone"),
        ("A", "header", "1", "v", "0.25", "0", "1e-1", "0.004", "", "", "", ""),
        ("A", "header", "1", "vertex", "1.25", "0", "0", "", "0.5", "0.01", "Ségur, p. 3", ""),
        ("A", "header", "1", "p", "1.25", "-0.5", "1", "0.003", "0.5", "", "", "façade"),
        ("A", "header", "1", "v", "1.25", "0", "1.75", "", "", "", "", ""),
    ]  # fmt: skip

    def field(text: str) -> str:
        shown = text if text.startswith("S") else text.replace(".", mark)
        return f'"{shown}"' if separator in shown else shown

    text = "# Besançon\r\n\r\n" + "\r\n".join(separator.join(map(field, row)) for row in rows)
    path = tmp_path / "wall.csv"
    path.write_bytes(text.encode(encoding))
    (block,) = read_csv(path, sigma=0.002).blocks
    assert block.vertices.tolist() == [[0.25, 0.0, 0.1], [1.25, 0.0, 0.0], [1.25, 0.0, 1.75]]
    assert block.points.tolist() == [[1.25, -0.5, 1.0]]
    assert (block.depth, block.depth_sigma, block.depth_source) == (0.5, 0.01, "Ségur, p. 3")
    assert (block.zone, block.names, block.line) == ("façade", (), 4)
    assert block.sigmas is not None
    assert block.sigmas.tolist() == [0.003, 0.004, 0.002, 0.002]  # the point, then the corners
    assert block.sigma == pytest.approx(np.sqrt((9 + 16 + 4 + 4) / 4) * 1e-3, rel=1e-14)


def test_the_lines_of_a_block_may_lie_anywhere(tmp_path: Path) -> None:
    rows = ROWS.splitlines()
    other = [row.replace("A,header", "B,sill") for row in rows]
    lines = [other[0], rows[0], rows[1], "", other[1], other[2], "# half", rows[2]]
    second, first = read_csv(write(tmp_path, HEAD + "\n".join(lines))).blocks
    assert (first.code, first.line, first.spans) == ("A", 3, (range(3, 5), range(9, 10)))
    assert (second.code, second.line, second.spans) == ("B", 2, (range(2, 3), range(6, 8)))
    assert first.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0]]


def test_a_wrong_line_spoils_its_block_and_no_other(tmp_path: Path) -> None:
    text = (
        HEAD
        + "B,sill,1,vertex,0,0\n"  # 2: spoils B before it begins
        + ROWS  # 3 to 5
        + ROWS.replace("A,", "B,")  # 6 to 8
        + "!,sill,1,vertex,0,0,0\n"  # 9: whose is it?
        + ROWS.replace("A,", "C,")  # 10 to 12
        + "C,header,1,point,0,0,zero\n"  # 13
        + "C,header,1,point,0,0,0\n"  # 14
    )
    found = list(open_csv(write(tmp_path, text)).blocks)
    assert [one.code for one in found] == ["B", "A", None, "C"]
    assert [one.code for one in found if isinstance(one, BlockRecord)] == ["A"]
    rejects = [one for one in found if isinstance(one, Reject)]
    assert [(str(one.error.where).rpartition(":")[2], one.spans) for one in rejects] == [
        ("2", (range(2, 3), range(6, 9))),
        ("9", (range(9, 10),)),
        ("13", (range(10, 15),)),
    ]


def test_a_line_that_is_no_row_spoils_the_block_that_it_names(tmp_path: Path) -> None:
    for wrong in (
        'A,header,1,"point,0,0,0',
        "A,header",
        'A,header,1,point,0,0,0,"',
        " A ,header,1,point,0,0,0,7",
    ):
        (one,) = open_csv(write(tmp_path, HEAD + ROWS + wrong + "\n")).blocks
        assert isinstance(one, Reject), wrong
        assert one.spans == (range(2, 6),)


def test_rows_and_columns_of_nothing_are_passed_over(tmp_path: Path) -> None:
    """As spreadsheets write them at the bottom and at the right."""
    text = (HEAD + ROWS).replace("\n", ",,\n") + ",,,,,,,,\n\n,,\n"
    (one,) = read_csv(write(tmp_path, text)).blocks
    assert one.vertices.shape == (3, 3)
    with pytest.raises(SurveyError, match="9 fields for 7 columns"):
        read_csv(write(tmp_path, text.replace("1,1,0,,", "1,1,0,,x")))


def test_a_table_of_nothing_but_wrong_lines_is_refused_early(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"wall\.csv:2: .*fields"):
        open_csv(write(tmp_path, HEAD + "?\n" * 5000))
    assert len(list(open_csv(write(tmp_path, HEAD + "?\n" * 500)).blocks)) == 500


def test_the_head_of_another_file_is_taken(tmp_path: Path) -> None:
    head = SurveyHead("north wall", "head.moma", (Station("S", np.array([0.0, -9.0, 2.0])),))
    path = write(tmp_path, HEAD.replace("z\n", "z,station\n") + ROWS.replace("\n", ",S\n"))
    stream = open_csv(path, ReadingOptions(head=head, sigma=0.01))
    (block,) = stream.blocks
    assert isinstance(block, BlockRecord)
    assert (stream.head.name, stream.head.path, stream.head.stations) == (
        "north wall",
        str(path),
        head.stations,
    )
    assert (block.station, block.sigma, block.sigmas) == ("S", 0.01, None)
