"""Files as offices deliver them: what the command line answers, by the cases that lie beside the project."""

import re
import shutil
from pathlib import Path

import pytest

from tests.moma.commands import answer, fails, invoke
from tests.paths import ROOT

CASES = ROOT.parent / "shared/cases"
WILD, PHOTOGRAPHS, NEWCOMER = CASES / "wild", CASES / "photographs", CASES / "newcomer-wall"
CODES, NUMBERED = "{block} {kind} {course?} {role}", "{zone}.{course}.{number}.{kind}.{role}"
KINDS = "Q=quoin,B=header,L=stretcher,G=jamb,V=voussoir,S=keystone,K=springer"

pytestmark = pytest.mark.skipif(not CASES.is_dir(), reason="the cases lie beside the project")

OUTLINES = [  # words of the command; what it answers
    (["--outlines", WILD / "dxf-mixed-entities/s_mixed.dxf"], "12 stones"),
    (["--outlines", WILD / "dxf-attribute-names/v_attrib_names.dxf"], "Q12"),
    (["--outlines", WILD / "dxf-attribute-names/j_frame_texts.dxf"], "leave it out with --layer STONES"),
    (["--outlines", WILD / "dxf-hidden-layers/p_frozen.dxf"], "frozen or off are left out: 6 OLD, 6 OLD2"),
    (["--outlines", WILD / "dxf-elevation-and-3d/y_elevation_all.dxf"], "12 stones"),
    (["--outlines", WILD / "dxf-elevation-and-3d/x_elevation.dxf"], "12 stones"),
    (["--outlines", WILD / "dxf-elevation-and-3d/l_3d.dxf"], "12 stones"),
    (["--outlines", WILD / "outlines-drawn-twice/o_twice.dxf"], "3 overlap"),
    (["--outlines", WILD / "outlines-lon-lat/m_lonlat.geojson"], "longitudes and latitudes"),
    (["--outlines", WILD / "outlines-lon-lat/n_lonlat_crs.geojson"], "longitudes and latitudes"),
    (["--masks", WILD / "mask-semantic-classes/i_three_classes.png", "--size", "2.0x1.2"], "--layer 100"),
    (["--masks", WILD / "mask-semantic-classes/c_rgb_antialiased.png", "--size", "2.0x1.2"], "resampled"),
    (["--masks", WILD / "annotations-labelme-via/i_labelme.json", "--size", "2.0x1.2"], "12 stones"),
    (
        ["--masks", WILD / "annotations-labelme-via/j_via.json", "--size", "2.0x1.2"],
        "how large its picture is",
    ),
    (["--outlines", NEWCOMER / "Steine.gpkg"], "a second stone 10-04"),
    (["--outlines", NEWCOMER / "Steine.dxf"], "leave it out with --layer STEINE"),
]


@pytest.mark.parametrize(("words", "answer"), OUTLINES)
def test_outlines_and_masks(tmp_path, words, answer):
    done = invoke("ingest", *words, "--depth", 0.4, "--db", f"sqlite:///{tmp_path}/a.db")
    assert answer in done.output


def test_three_slips_of_a_drawing_are_named(tmp_path):
    rejects = ["--keep-going", "--rejects", tmp_path / "r.geojson"]
    done = invoke(
        "ingest",
        "--outlines",
        NEWCOMER / "Steine.gpkg",
        "--depth",
        0.4,
        *rejects,
        "--db",
        f"sqlite:///{tmp_path}/a.db",
    )
    assert done.exit_code == 0
    for slip in (
        "03-05: crosses itself",
        "06-09: no joint: no joint parts it from 06-11",
        "a second stone 10-04",
    ):
        assert slip in done.output


@pytest.mark.parametrize(
    ("file", "answer"),
    [
        ("b_merged.xlsx", "12 merged cells hold for all of their rows"),
        ("d_formulas.xlsx", "formulas of a workbook have values once it is opened and saved"),
        ("i_missing.csv", "12 stones"),
        ("p_tab_spaces.csv", "Point ID, Description, Rod Height"),
    ],
)
def test_tables(tmp_path, file, answer):
    folder = WILD / "excel-merged-and-missing"
    options = ["--format", "csv", "--header", folder / "head.moma", "--db", f"sqlite:///{tmp_path}/a.db"]
    assert answer in invoke("ingest", folder / file, *options).output


@pytest.mark.parametrize(
    ("file", "answer"),
    [
        ("quake-seismosignal-station/f_seismosignal.txt", "direction of 'f_seismosignal' is not stated"),
        ("quake-formats-refused/g_dmg.V2", "format of CSMIP"),
        ("quake-formats-refused/h_cosmos.v2c", "format of COSMOS"),
        ("quake-formats-refused/i_geonet.V2A", "format of GeoNet"),
        ("quake-formats-refused/k_gap.csv", "unit of the acceleration is not known"),
    ],
)
def test_records(tmp_path, file, answer):
    text = (WILD / "quake-seismosignal-station/b.toml").read_text()
    scene = tmp_path / "b.toml"
    scene.write_text(text.replace("f_seismosignal.txt", str(WILD / file)))
    assert answer in invoke("check", scene).output


def test_codes_of_zone_course_and_number(tmp_path):
    path, options = (
        NEWCOMER / "Tachymeter_Nordwand.txt",
        ["--format", "penzd", "--db", f"sqlite:///{tmp_path}/a.db"],
    )
    assert f'--codes "{NUMBERED}"' in invoke("ingest", path, *options).output
    options += ["--codes", NUMBERED, "--kinds", KINDS, "--header", NEWCOMER / "head.moma"]
    done = invoke("ingest", path, *options)
    assert "158 stones" in done.output
    assert "left out: 2 FP" in done.output


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "leans", "sunk"),
    [
        (["wall_at_rest_with_arch.txt"], None, None),
        (["wall_left_third_leans_25mm.txt"], 22.9 / 3.66, None),
        (["releve_mur_nord.xlsx"], 22.9 / 3.66, "05-08"),
    ],
)
def test_what_a_wall_has_done(tmp_path, words, leans, sunk):
    table = words[0].endswith("xlsx")
    options = ["--header", NEWCOMER / ("tete.moma" if table else "head.moma"), "--out", tmp_path / "out"]
    if not table:
        options += ["--format", "penzd", "--codes", CODES, "--kinds", KINDS, "--sigma", 0.003]
    text = invoke("survey-report", NEWCOMER / words[0], *options).output
    assert "beds: no movement found" in text
    found = re.search(r"leans outwards as one by (\S+) ± (\S+) mm over (\S+) m", text)
    assert (found is None) == (leans is None)
    if found is not None and leans is not None:
        amount, sigma, tall = map(float, found.groups())
        assert abs(amount - leans * tall) < 3.0 * sigma
    assert (sunk is None) or f"{sunk}: it stands sunk" in text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("project", "answers"),
    [
        ("swapped-control-remove/p.toml", ["σ₀ 1.0", "C3", "are exchanged"]),
        ("names-with-blanks/photographs.toml", ["IMG 001", "σ₀ 0.98"]),
        ("marks-roughness/p.toml", ["σ₀ 1.0", "218 points"]),
    ],
)
def test_photographs(tmp_path, project, answers):
    folder = shutil.copytree((PHOTOGRAPHS / project).parent, tmp_path / "p")
    done = invoke("orient", folder / Path(project).name, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert all(answer in done.output for answer in answers), done.output


@pytest.mark.parametrize("cloud", ["idpose.e57", "idpose.xyz"])
def test_an_identity_pose_is_no_station(tmp_path, cloud):
    folder, url = PHOTOGRAPHS / "e57-identity-pose", f"sqlite:///{tmp_path}/a.db"
    drawn = ["--outlines", folder / "front.geojson", "--header", folder / "head.moma"]
    done = invoke("ingest", "--cloud", folder / cloud, *drawn, "--db", url)
    assert "2 stones" in done.output
    places = [float(row["y"]) for row in answer("query", "entity", "--columns", "y", "--db", url)]
    assert places == pytest.approx([-9.79, -9.77], abs=2e-3)  # behind a face at -9.99 that looks towards -y


@pytest.mark.parametrize(
    ("file", "advice", "stones"),
    [
        (["b_mm.stl"], ["--unit", "mm"], 4),
        (["y_up.obj"], ["--up", "y"], 9),
        (["--outlines", "h_mm_unitless.dxf", "--depth", "0.4"], ["--unit", "mm"], 12),
    ],
)
def test_advice_on_unit_and_axis_is_followed_as_copied(tmp_path, file, advice, stones):
    folder = WILD / "unit-advice-cannot-be-followed"
    words = [folder / word if "." in word and word != "0.4" else word for word in file]
    words += ["--db", f"sqlite:///{tmp_path}/a.db"]
    assert f"give {' '.join(advice)}" in fails(1, "ingest", *words)
    assert f"{stones} stones" in invoke("ingest", *words, *advice).output


@pytest.mark.slow
@pytest.mark.parametrize(
    ("project", "answers"),
    [
        (
            "metashape-components/comp_free.toml",
            ["σ₀ 0.974", "station ± 1.6 mm", "moma ingest asks for them"],
        ),
        ("metashape-accuracy/acc.toml", ["σ₀ 0.963", "datum: control points"]),
        ("colmap-binary/bin.toml", ["4800 marks", "12 photographs"]),
    ],
)
def test_projects_of_other_programs(tmp_path, project, answers):
    folder = shutil.copytree((PHOTOGRAPHS / project).parent, tmp_path / "p")
    done = invoke("orient", folder / Path(project).name, "--out", tmp_path / "out")
    assert done.exit_code == 0, done.output
    assert all(text in done.output for text in answers), done.output
