"""Clouds as programs write them as text and PLY, and LAS files that announce too much, by the command line."""

import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.moma.commands import answer, fails, invoke
from tests.paths import ROOT
from tests.survey.clouds import scans

CASE = ROOT.parent / "shared/cases/photographs/text-columns"

NAMED = ["yxz.csv", "hoch.txt", "id.csv", "rgb_first.csv", "intensity_first.txt", "quoted.csv"]
READ = [
    *(
        *("be.ply", "cc.txt", "cc2.txt", "crlf.ply", "d.ply", "exp.xyz", "fcol.ply", "fortran.xyz"),
        *("g.ptx", "name.csv"),
    ),
    *(
        *("nan.ply", "nan.xyz", "nan_first.ply", "nan_first.xyz", "ptx_as.pts", "semi.txt"),
        *("trail.csv", "two.pts"),
    ),
    *("upper.ply", "utf16.txt", "zeros.ply"),
]
REFUSED = {
    "cam_before.ply": "camera comes before the points",
    "dem.asc": "a grid of heights, not points",
    "id_noheader.csv": "the first column counts the rows",
    "mixed.pts": "is not a point like the others",
    "mm.xyz": "in mm it would lie there",
    "trunc.ply": "announces 4000 points and holds 3900",
}


@pytest.fixture(scope="module")
def clouds(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The clouds of the case, of a tenth of its points."""
    if not CASE.is_dir():
        pytest.skip("the cases lie beside the project")
    folder = tmp_path_factory.mktemp("clouds")
    script = (CASE / "gen.py").read_text(encoding="utf-8")
    script = script.replace("n=40000", "n=4000").replace(r"hdr='200\n200", r"hdr='200\n20")
    (folder / "gen.py").write_text(script, encoding="utf-8")
    subprocess.run([sys.executable, "-W", "ignore", "gen.py"], cwd=folder, check=True)
    return folder


def words(cloud: Path, folder: Path) -> list[object]:
    outlines = ["--outlines", CASE / "o.csv", "--wall", "0,0 2,0.04", "--header", CASE / "head.moma"]
    return ["ingest", "--cloud", cloud, *outlines, "--db", f"sqlite:///{folder}/a.db"]


@pytest.mark.parametrize("name", [*NAMED, *(pytest.param(name, marks=pytest.mark.slow) for name in READ)])
def test_columns_are_read_by_their_names(clouds: Path, tmp_path: Path, name: str) -> None:
    """The wall runs along x, and its stone lies behind its face, towards y: mirrored, it would not."""
    done = invoke(*words(clouds / name, tmp_path))
    assert done.exit_code == 0, done.output
    (stone,) = answer("query", "entity", "--columns", "x,y,z,area", "--db", f"sqlite:///{tmp_path}/a.db")
    assert stone == {
        "x": pytest.approx(0.496, abs=1e-3),
        "y": pytest.approx(0.210, abs=1e-3),
        "z": pytest.approx(0.250, abs=1e-3),
        "area": pytest.approx(0.5, abs=1e-4),
    }


@pytest.mark.parametrize(("name", "reason"), REFUSED.items())
def test_what_is_no_cloud_in_metres_is_refused_with_its_reason(
    clouds: Path, tmp_path: Path, name: str, reason: str
) -> None:
    assert reason in fails(1, *words(clouds / name, tmp_path))


def test_the_unit_that_a_message_advises_is_read(clouds: Path, tmp_path: Path) -> None:
    line = fails(1, *words(clouds / "mm.xyz", tmp_path))
    titles = line.rpartition("e.g. ")[2].strip()
    path = tmp_path / "named.xyz"
    path.write_text(f"{titles}\n{(clouds / 'mm.xyz').read_text(encoding='utf-8')}", encoding="utf-8")
    assert "1 stones" in invoke(*words(path, tmp_path)).output


def test_a_las_file_that_announces_billions_of_records_is_refused_at_once(tmp_path: Path) -> None:
    path = scans.las(tmp_path / "garbage.las", np.zeros((50, 3)) + np.arange(50)[:, None])
    whole = bytearray(path.read_bytes())
    struct.pack_into("<I", whole, 100, 3_470_000_000)  # number of records before the points
    path.write_bytes(whole)
    assert "announces 3470000000 records" in fails(1, "cloud", path)
