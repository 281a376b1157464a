from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from moma.errors import SurveyError
from survey.formats.csv_points import read_csv
from survey.records import Survey

HEAD = "block,kind,course,role,x,y,z\n"
ROWS = "A,header,1,vertex,0,0,0\nA,header,1,vertex,1,0,0\nA,header,1,vertex,1,1,0\n"


def write(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "wall.csv"
    path.write_text(text, encoding="utf-8")
    return path


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
        (HEAD.replace("z\n", "z,colour\n"), 1, "'colour'"),
        (HEAD, 2, "no points"),
        (HEAD + "A,header,1,vertex,0,0\n", 2, "6 fields for 7 columns"),
        (HEAD + "A,header,1,corner,0,0,0\n", 2, "'corner'"),
        (HEAD + "A,header,one,vertex,0,0,0\n", 2, "'one'"),
        (HEAD + "A,header,1,vertex,0,0,inf\n", 2, "'inf'"),
        (HEAD + "A b,header,1,vertex,0,0,0\n", 2, "'A b'"),
        (HEAD + 'A,header,1,vertex,0,0,"0\n', 2, "table line"),
        (HEAD + ROWS + "A,jamb,1,point,0,0,0\n", 5, "line 2"),
        (HEAD + ROWS[:48], 2, "2 vertices"),
        (
            HEAD.replace("z\n", "z,depth\n") + "A,header,1,point,0,0,0,1\nA,header,1,point,0,0,0,2\n",
            3,
            "1 m before",
        ),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, text: str, line: int, words: str) -> None:
    with pytest.raises(SurveyError) as error:
        read_csv(write(tmp_path, text))
    assert f"wall.csv:{line}: " in str(error.value)
    assert words in str(error.value)


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.integers(0, 130), st.integers(0, 4), st.binary(max_size=4), st.text(max_size=10))
def test_mutated_tables_are_read_or_refused_with_their_line(
    tmp_path: Path, at: int, gone: int, data: bytes, text: str
) -> None:
    whole = (HEAD + ROWS).encode()
    path = tmp_path / "wall.csv"
    path.write_bytes(whole[:at] + data + text.encode("utf-8", "replace") + whole[at + gone :])
    try:
        survey = read_csv(path)
    except SurveyError as error:
        where = str(error.where)
        located = where.startswith(f"{path}:") and int(where.rpartition(":")[2]) >= 1
        assert located, where
    else:
        assert survey.blocks
