import subprocess
import sys
import tracemalloc
from pathlib import Path

import pytest

from ground.errors import UsageError
from survey.formats.native.reader import read_head
from survey.formats.options import ReadingOptions
from survey.formats.reading import FORMATS, open_survey, read_survey
from survey.records.survey import BlockRecord
from tests.moma.commands import prints
from tests.survey.formats.survey_files import CSV, EXAMPLES, MOMA, PNEZD
from tests.survey.scanned_stones import scanned_box, write_ply


def test_a_format_that_there_is_not_is_a_wrong_use(tmp_path: Path) -> None:
    with pytest.raises(
        UsageError,
        match=r"'dxf'; known formats: moma, csv, pnezd, penzd, gsi, jobxml, landxml, geojson, solids",
    ):
        open_survey(tmp_path / "a.dxf", "dxf")
    assert {one.format for one in EXAMPLES.values()} == set(FORMATS)


def test_solids_are_no_measured_faces(tmp_path: Path) -> None:
    path = tmp_path / "m.obj"
    path.write_bytes(EXAMPLES["obj"].data)
    with pytest.raises(UsageError, match="solids, not measured faces"):
        read_survey(path, "solids")


@pytest.mark.parametrize(("format", "text"), [("csv", CSV), ("pnezd", PNEZD)])
def test_a_header_file_says_what_tables_cannot(tmp_path: Path, format: str, text: str) -> None:
    (tmp_path / "head.moma").write_text(MOMA[: MOMA.index("stone")], encoding="utf-8")
    head = read_head(tmp_path / "head.moma")
    path = tmp_path / "wall.txt"
    path.write_text(text, encoding="utf-8")
    survey = read_survey(path, format, ReadingOptions(head=head))
    assert (survey.head.name, survey.head.path) == ("north wall, bay 3", str(path))
    assert survey.head.stations[:2] == head.stations
    assert (survey.head.control, survey.head.depth_rules) == (head.control, head.depth_rules)


def test_memory_does_not_grow_with_the_file(tmp_path: Path) -> None:
    """Five thousand stones more: nothing is kept but their codes, against stones of 14 lines."""
    peaks, path = [], tmp_path / "a.moma"
    for count in (3000, 8000):
        with path.open("w", encoding="utf-8") as file:
            file.write("moma-survey 1\nsigma 0.003\n")
            for k in range(count):
                file.write(f"stone W{k} header\n" + "vertex 1.2345 2.3456 3.4567\n" * 14 + "end\n")
        tracemalloc.start()
        assert sum(isinstance(one, BlockRecord) for one in open_survey(path, "moma").blocks) == count
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert path.stat().st_size > 3_000_000
    assert peaks[1] - peaks[0] < 5_000 * 250


def test_solids_alone_load_what_solids_need() -> None:
    program = "import sys, survey.formats.reading; print([one for one in ('trimesh', 'scipy') if one in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


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
