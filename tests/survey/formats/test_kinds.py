"""Kinds in upper or lower case, wherever a survey is read."""

from pathlib import Path

import pytest

from survey.formats.options import ReadingOptions
from survey.formats.reading import read_survey
from tests.moma.commands import prints
from tests.survey.scanned_stones import scanned_box, write_ply

NATIVE = """moma-survey 1
sigma 0.003
depth Header 0.5 source drawing
canon HEADER 0.4 0.3 sigma 0.02 source drawing
stone A Header course 1
  vertex 0 0 0
  vertex 0.4 0 0
  vertex 0.4 0 0.3
  vertex 0 0 0.3
end
"""
TABLE = """block,kind,course,role,x,y,z
A,Header,1,v,0,0,0
A,header,1,v,0.4,0,0
A,HEADER,1,v,0.4,0,0.3
A,Header,1,v,0,0,0.3
"""


@pytest.mark.parametrize(("format", "text"), [("moma", NATIVE), ("csv", TABLE)])
def test_a_header_is_a_header_however_it_is_written(tmp_path: Path, format: str, text: str) -> None:
    path = tmp_path / "wall.txt"
    path.write_text(text)
    survey = read_survey(path, format, ReadingOptions())
    assert [one.kind for one in survey.blocks] == ["header"]
    assert [one.kind for one in (*survey.head.depth_rules, *survey.head.canons)] in ([], ["header", "header"])


def test_kinds_of_options_and_rules_may_be_written_in_capitals(tmp_path: Path) -> None:
    for k in range(3):
        points, triangles = scanned_box((0.5, 0.3, 0.24), 0.1, noise=0.0)
        points[:, 2] += 0.25 * k
        write_ply(tmp_path / f"S{k}.ply", points, triangles)
    told = prints(
        *("ingest", tmp_path, "--format", "solids", "--kind", "Header", "--db", f"sqlite:///{tmp_path}/a.db"),
        *("--kind-where", "Stretcher: kind = HEADER and z > 0.4", "--support", "z < 0.1"),
    )
    assert "(1 header, 1 stretcher, 1 support)" in told
