"""Inputs that failed once, each with its right result; they lie beside the project."""

from pathlib import Path

import numpy as np
import pytest

from ground.errors import SurveyError
from mechanics.scene.loads.record_files import read_accelerogram
from pipelines.ingest.ingest import ingest
from pipelines.ingest.reading_options import reading_options, solid_options
from survey.formats.options import ReadingOptions
from survey.formats.reading import open_survey
from survey.geometry.convex_parts import convex_parts
from survey.geometry.solids import Solid, volume_of
from survey.records.survey import Reject, SolidRecord
from tests.paths import ROOT

CASES = ROOT.parent / "shared/cases"
SCANS, ASSEMBLIES = (ROOT.parent / "shared/data" / one for one in ("scans", "assemblies"))

needs_shared = pytest.mark.skipif(not CASES.is_dir(), reason="the cases lie beside the project")


def solids(path: Path, **given) -> list[SolidRecord]:
    found = list(open_survey(path, "solids", solid_options(ReadingOptions(), **given)).blocks)
    assert not [str(one.error) for one in found if isinstance(one, Reject)]
    return found


@needs_shared
@pytest.mark.parametrize(("case", "format"), [("excel-sep-line", "csv"), ("penzd-quoted-fields", "penzd")])
def test_tables(tmp_path, case, format):
    options = reading_options(CASES / case / "head.moma")
    (file,) = ingest([CASES / case / "t.csv"], f"sqlite:///{tmp_path}/c.db", format, options=options).files
    assert sum(file.stones.values()) == 2


@needs_shared
@pytest.mark.parametrize("snap", [None, 1e-3, 1e-5])
def test_a_box_whose_corners_differ_in_the_last_digit(snap):
    (one,) = solids(CASES / "corners-differ-in-last-digit/t.obj", snap=snap)
    assert np.ptp(one.vertices, axis=0) == pytest.approx([1.0, 0.5, 0.3], abs=1e-6)
    assert len(one.vertices) == 8


@needs_shared
@pytest.mark.parametrize("case", ["face-with-corner-twice", "obj-line-continuation", "snap-all-rejected"])
@pytest.mark.parametrize("snap", [None, 1e-3])
def test_boxes_of_other_programs(case, snap):
    (one,) = solids(CASES / case / "t.obj", snap=snap)
    assert volume_of(Solid(one.code, one.vertices, one.faces)) == pytest.approx(0.15, rel=1e-6)


@needs_shared
@pytest.mark.parametrize(("file", "codes"), [("a.stl", ["OBJECT-1", "OBJECT-2"]), ("b.stl", ["b-1", "b-2"])])
def test_solids_of_one_name(file, codes):
    assert [one.code for one in solids(CASES / "stl-solids-of-one-name" / file)] == codes


@needs_shared
def test_an_arch_with_y_upwards_is_asked_about_and_turned(tmp_path):
    path = CASES / "y-is-up/t.obj"
    with pytest.raises(SurveyError, match="give --up y if y points upwards"):
        ingest([path], f"sqlite:///{tmp_path}/a.db", "solids", options=reading_options())
    for up in ("y", "z"):
        options = solid_options(ReadingOptions(), up=up)
        (file,) = ingest([path], f"sqlite:///{tmp_path}/{up}.db", "solids", options=options).files
        assert file.questions == ()
    heights = np.concatenate([one.vertices[:, 2] for one in solids(path, up="y")])
    assert np.ptp(heights) == pytest.approx(1.28, abs=0.01)


@needs_shared
def test_a_table_of_an_earthquake_with_decimal_commas():
    found = read_accelerogram(CASES / "quake-decimal-comma/t.csv", "m/s2")
    assert (found.dt, len(found)) == (pytest.approx(0.01), 400)
    assert found.peak == pytest.approx(0.489532)


@needs_shared
@pytest.mark.parametrize("snap", [None, 0.002])
def test_a_folded_stone_has_convex_parts(snap):
    (one,) = solids(CASES / "armadillo-after-snap/Mesh_1.obj", snap=snap)
    parts = convex_parts(Solid(one.code, one.vertices, one.faces))
    assert sum(map(volume_of, parts)) == pytest.approx(volume_of(Solid(one.code, one.vertices, one.faces)))


@needs_shared
def test_the_scans_of_a_wall_come_in_whole():
    found = [one for path in sorted(SCANS.glob("*.ply")) for one in solids(path)]
    assert len(found) == 39
    repaired = {one.code: one.remarks for one in found if one.remarks}
    assert set(repaired) == {"stone_0", "stone_27"}
    assert all("welded, up to 1.3 mm apart" in remarks[0] for remarks in repaired.values())


@needs_shared
@pytest.mark.slow
def test_the_armadillo_comes_in_whole_and_has_convex_parts():
    found = solids(ASSEMBLIES / "armadillo.obj", snap=0.002)
    assert len(found) == 399
    for one in found:
        assert len(convex_parts(Solid(one.code, one.vertices, one.faces))) <= 32
