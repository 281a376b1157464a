"""Tables as people deliver them: each says the same two stones in its own way."""

import re
from pathlib import Path

import numpy as np
import pytest

from ground.errors import SurveyError, UsageError
from ground.tables.columns import unit_of
from survey.formats.options import ReadingOptions
from survey.formats.reading import open_survey
from survey.formats.tables.columns import ALIASES, find_columns, read_map
from survey.formats.tables.kinds import kind_of, read_kinds
from survey.records.survey import BlockRecord, Reject
from tests.survey.formats.workbooks import ods, xlsx

ROWS = [
    ("W1", "header", "2", "v", 10.25, 37.5, 6.75),
    ("W1", "header", "2", "v", 10.5, 37.5, 6.75),
    ("W1", "header", "2", "v", 10.5, 37.5, 7.0),
    ("W1", "header", "2", "p", 10.375, 37.5, 6.875),
    ("W2", "stretcher", "", "v", 11.0, 37.5, 6.75),
    ("W2", "stretcher", "", "v", 11.5, 37.5, 6.75),
    ("W2", "stretcher", "", "v", 11.5, 37.5, 7.0),
]
HEAD = ("block", "kind", "course", "role", "x", "y", "z")


def text(head=HEAD, rows=ROWS, separator=",", mark=".", scale=1.0, end="\n"):
    lines = [separator.join(head)]
    for *words, x, y, z in rows:
        numbers = [f"{round(scale * one, 6):g}".replace(".", mark) for one in (x, y, z)]
        lines.append(separator.join([*words, *numbers]))
    return end.join(lines) + end


def write(path: Path, data: str | bytes, encoding="utf-8") -> Path:
    path.write_bytes(data if isinstance(data, bytes) else data.encode(encoding))
    return path


def read(path: Path, format="csv", **options) -> list[BlockRecord]:
    found = list(open_survey(path, format, ReadingOptions(**options)).blocks)
    assert not [str(one.error) for one in found if isinstance(one, Reject)]
    return found


def assert_same(found: list[BlockRecord], courses=(2, None), kinds=("header", "stretcher")) -> None:
    assert [(one.code, one.kind, one.course) for one in found] == list(
        zip(("W1", "W2"), kinds, courses, strict=True)
    )
    np.testing.assert_allclose(found[0].vertices, [row[4:] for row in ROWS[:3]], rtol=1e-12)
    np.testing.assert_allclose(found[0].points, [ROWS[3][4:]], rtol=1e-12)
    np.testing.assert_allclose(found[1].vertices, [row[4:] for row in ROWS[4:]], rtol=1e-12)


GERMAN = ("Stein-Nr.", "Steinart", "Schicht", "Punktart", "Rechtswert", "Hochwert", "Höhe")
FRENCH = ("Pierre", "Type de pierre", "Assise", "Rôle", "Abscisse", "Ordonnée", "Altitude")
ITALIAN = ("Concio", "Tipo di pietra", "Filare", "Ruolo", "Est", "Nord", "Quota")
SPANISH = ("Sillar", "Tipo de piedra", "Hilada", "Tipo de punto", "Este", "Norte", "Cota")


@pytest.mark.parametrize(
    "data",
    [
        text(),
        text(separator=";", mark=","),
        text(separator="\t", mark=","),
        text(separator="|"),
        text(end="\r\n"),
        text(end="\r"),
        "﻿" + text(),
        "sep=;\n" + text(separator=";"),
        "sep=,\r\n" + text(end="\r\n"),
        '"sep=\t"\n' + text(separator="\t"),
        text(("Block", "KIND", "Course", "Role", "X", "Y", "Z")),
        text(("block", "kind", "course", "role", "Easting", "Northing", "Elevation")),
        text(("block", "kind", "course", "role", "E [m]", "N [m]", "H [m]")),
        text(("block", "kind", "course", "role", "x [mm]", "y [mm]", "z [mm]"), scale=1000),
        text(("block", "kind", "course", "role", "x_cm", "y (cm)", "z in cm"), scale=100),
        text(GERMAN, separator=";", mark=","),
        text([one.replace("ö", "oe") for one in GERMAN], separator=";", mark=","),
        text(FRENCH),
        text(ITALIAN),
        text(SPANISH),
        "Aufmaß Nordwand\n\nBearbeiter: N. N.\n" + text(),
        "# a comment\n\n" + text().replace("\n", "\n\n"),
        text().replace("\n", ",,\n"),
        re.sub("^", '"', text(separator='","'), flags=re.MULTILINE).replace("\n", '"\n').removesuffix('"'),
        "\n".join(f"{k if k else ''},{line}" for k, line in enumerate(text().splitlines())),  # pandas' index
        text(("Unnamed: 0", *HEAD[1:])).replace("Unnamed: 0", "block"),
        text(rows=[(a, b, c and f"{c}.0", *rest) for a, b, c, *rest in ROWS]),
        text(rows=[(a, b, c and f"{c},0", *rest) for a, b, c, *rest in ROWS], separator=";", mark=","),
        text(rows=[(a, {"header": "Binder", "stretcher": "Läufer"}[b], *rest) for a, b, *rest in ROWS]),
        text(rows=[(a, {"header": "boutisse", "stretcher": "panneresse"}[b], *rest) for a, b, *rest in ROWS]),
        text(rows=[(*rest[:3], {"v": "Ecke", "p": "Fläche"}[rest[3]], *rest[4:]) for rest in ROWS]),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp1252"])
def test_every_table_says_the_same(tmp_path, data, encoding):
    if encoding == "cp1252" and data.startswith("﻿"):
        pytest.skip("there is no such mark")
    assert_same(read(write(tmp_path / "a.csv", data, encoding)))


@pytest.mark.parametrize("made", [xlsx, ods])
@pytest.mark.parametrize("name", ["a.xlsx", "a.csv"])
def test_a_workbook_says_the_same(tmp_path, made, name):
    """Whatever its name; with a title, an empty sheet, numbers as numbers and as texts with commas."""
    rows = [
        ["Aufmaß"],
        [],
        list(GERMAN),
        *([*row[:2], float(row[2]) if row[2] else None, *row[3:]] for row in ROWS),
    ]
    rows[4][4] = "10,5"
    path = write(tmp_path / name, made({"Tabelle1": rows, "Tabelle2": []}))
    assert_same(read(path))
    stream = open_survey(path, "csv")
    assert stream.remarks == ("read from sheet 'Tabelle1' of a workbook",)
    assert stream.header == 3


def test_one_of_several_sheets_is_named(tmp_path):
    table = [list(HEAD), *map(list, ROWS)]
    path = write(tmp_path / "a.xlsx", xlsx({"notes": [["x"]], "points": table}))
    with pytest.raises(UsageError, match="has 2 sheets: notes, points; name one with --sheet"):
        open_survey(path, "csv")
    assert_same(read(path, sheet="points"))
    with pytest.raises(UsageError, match="no sheet 'walls'; sheets: notes, points"):
        open_survey(path, "csv", ReadingOptions(sheet="walls"))
    with pytest.raises(UsageError, match="not a workbook"):
        open_survey(write(tmp_path / "a.csv", text()), "csv", ReadingOptions(sheet="points"))


def test_a_file_that_is_no_workbook_inside_is_told(tmp_path):
    path = write(tmp_path / "a.xlsx", b"PK\x03\x04" + b"x" * 100)
    with pytest.raises(SurveyError, match="looks like a workbook, but cannot be read"):
        open_survey(path, "csv")
    with pytest.raises(SurveyError, match=r"this is a workbook \(XLSX, ODS\)"):
        open_survey(path, "moma")


@pytest.mark.parametrize(
    ("head", "columns"),
    [
        (("A", "B", "C", "D", "E1", "F", "G"), "block=A,kind=B,course=C,role=D,x=E1,y=F,z=G"),
        (("A", "kind", "course", "role", "y", "x", "z"), "block=A,x=y,y=x"),
        (("block", "kind", "course", "role", "x", "y", "Höhe über NN [m]"), "z=Höhe über NN"),
        (HEAD, "block=1,kind=2,course=3,role=4,x=5,y=6,z=7"),
    ],
)
def test_columns_are_named_by_a_map(tmp_path, head, columns):
    assert_same(read(write(tmp_path / "a.csv", text(head)), columns=columns))


def test_a_table_without_names_is_read_by_numbers(tmp_path):
    body = text().partition("\n")[2]
    assert_same(read(write(tmp_path / "a.csv", body), columns="block=1,kind=2,course=3,role=4,x=5,y=6,z=7"))
    path = write(tmp_path / "b.txt", "W1 0 0 0\nW1 1 0 0\nW1 1 0 1\n")
    (one,) = read(path, columns="block=1,x=2,y=3,z=4")
    assert one.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 0, 1]]


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ("block", "not of the form WHAT=COLUMN"),
        ("blok=A", "did you mean block?"),
        ("x=a,x=b", "x is given twice"),
    ],
)
def test_a_wrong_map_is_refused(columns, words):
    with pytest.raises(UsageError) as error:
        read_map(columns)
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("head", "columns", "words"),
    [
        (HEAD, "z=Höhe", "no column 'Höhe' for z; the columns are: block, kind"),
        (
            (*HEAD[:-1], "Pegel"),
            None,
            "no column 'z' among block, kind, course, role, x, y, Pegel; name it with --columns",
        ),
        ((*HEAD[:4], "x", "Easting", "z"), None, "columns 'x' and 'Easting' are both x"),
        ((*HEAD[:6], "z [km]"), None, "column 'z [km]' is in 'km', which is not a unit of length"),
        (("block", "kind", "coarse", *HEAD[3:]), None, "unknown column 'coarse', nearly course"),
    ],
)
def test_columns_that_are_not_clear_are_asked_for(tmp_path, head, columns, words):
    with pytest.raises(SurveyError) as error:
        open_survey(write(tmp_path / "a.csv", text(head)), "csv", ReadingOptions(columns=columns))
    assert words in str(error.value)


def test_no_name_of_a_column_stands_for_two_things():
    names = [(one, what) for what, names in ALIASES.items() for one in names]
    for one, what in names:
        found = find_columns(
            [one, *(other for other in ("block", "x", "y", "z") if other != what)], read_map(""), "", True
        )
        assert found.at.get(what) == 0, one


def test_unknown_columns_are_notes_unless_they_are_ignored(tmp_path):
    rows = [",".join(row) for row in (("block", "x", "y", "z", "Anmerkung", "Datum"), *(
        ("A", str(k % 2), "0", str(k // 2), "rissig" if k else "", f"{k}.5.") for k in range(3)))]  # fmt: skip
    path = write(tmp_path / "a.csv", "\n".join(rows))
    (one,) = read(path)
    assert one.notes == {"anmerkung": "rissig", "datum": "0.5.; 1.5.; 2.5."}
    assert "kept as notes: Anmerkung, Datum" in open_survey(path, "csv").remarks[0]
    (one,) = read(path, columns="ignore=Datum")
    assert one.notes == {"anmerkung": "rissig"}
    (one,) = read(path, columns="ignore=*")
    assert one.notes == {}


def test_a_quoted_field_may_have_several_lines(tmp_path):
    path = write(tmp_path / "a.csv", 'block,x,y,z,note\nA,0,0,0,"one\ntwo, ""three"""\nA,1,0,0,\nA,1,0,1,\n')
    (one,) = read(path)
    assert one.notes == {"note": 'one two, "three"'}
    assert one.spans == (range(2, 6),)


@pytest.mark.parametrize(
    ("name", "code"),
    [("Stein 12a", "Stein_12a"), ("N° 5", "N_5"), ("Größe 7", "Größe_7"), ("(7)", "7"), ("A.1/2", "A.1/2")],
)
def test_names_are_made_into_codes_and_kept(tmp_path, name, code):
    (one,) = read(write(tmp_path / "a.csv", f"block;x;y;z\n{name};0;0;0\n{name};1;0;0\n{name};1;0;1\n"))
    assert one.code == code
    assert one.notes == ({} if name == code else {"name": name})


def test_two_names_that_make_one_code_are_refused(tmp_path):
    path = write(tmp_path / "a.csv", "block;x;y;z\nA 1;0;0;0\nA_1;1;0;0\nA 1;1;0;1\n")
    (one,) = open_survey(path, "csv").blocks
    assert isinstance(one, Reject)
    assert "'A 1' and 'A_1' both give the code A_1" in str(one.error)


@pytest.mark.parametrize("unit", [0.001, 0.3048])
def test_the_unit_is_that_of_coordinates_and_depths(tmp_path, unit):
    data = "block;x;y;z;sigma;depth;Tiefe Sigma [cm]\n" + "".join(
        f"A;{x / unit:.9f};0;{z / unit:.9f};{0.004 / unit:.9f};{0.5 / unit:.9f};2\n"
        for x, z in ((0, 0), (1, 0), (1, 1))
    )
    (one,) = read(write(tmp_path / "a.csv", data), unit=unit)
    np.testing.assert_allclose(one.vertices, [[0, 0, 0], [1, 0, 0], [1, 0, 1]], atol=1e-9)
    np.testing.assert_allclose((one.sigma, one.depth, one.depth_sigma), (0.004, 0.5, 0.02), rtol=1e-6)


LIST = "1,0,0,0,A1.1 SPR v\n2,0,1,0,A1.1 SPR v\n3,0,1,1,A1.1 SPR v\n4,0,0.5,0.5,A1.1 SPR p\n"


def test_a_wrong_template_is_one_error_with_the_right_one(tmp_path):
    path = write(tmp_path / "a.txt", "".join(f"{k},{k},0,0,A1.{k} SPR v\n" for k in range(880)))
    with pytest.raises(SurveyError) as error:
        open_survey(path, "pnezd")
    assert str(error.value) == (
        f"{path}:1: description 'A1.0 SPR v' is not of the form {{block}}:{{role}}, nor is any other of 100; "
        'it would be read by --codes "{block} {kind} {role}"'
    )
    (one,) = read(write(path, LIST), "pnezd", codes="{block} {kind} {role}", kinds=read_kinds("SPR=springer"))
    assert (one.code, one.kind, one.vertices.shape, one.points.shape) == ("A1.1", "springer", (3, 3), (1, 3))


@pytest.mark.parametrize(
    ("form", "names"),
    [("pnezd", "Point,Easting,Northing,Elevation,Code"), ("penzd", "Pkt;Hochwert;Rechtswert;Höhe;Code")],
)
def test_a_list_with_its_axes_in_the_other_order_is_refused(tmp_path, form, names):
    separator = ";" if ";" in names else ","
    path = write(tmp_path / "a.txt", f"{names}\n{LIST.replace(',', separator)}")
    with pytest.raises(SurveyError, match=r"not the order of p.*give --format p"):
        open_survey(path, form, ReadingOptions(codes="{block} {kind} {role}"))


@pytest.mark.parametrize(
    "data",
    [
        re.sub(r"([^,\n]+)", r'"\1"', LIST),
        "sep=,\n" + LIST,
        "﻿" + LIST.replace(",", ";").replace(".5", ",5"),
        LIST.replace(",", "\t"),
        LIST.replace(",", " "),
        LIST.replace(",", "|"),
        '"pid","y","x","z","text"\n' + LIST,
        LIST.replace("SPR v\n", "SPR BEG\n", 1).replace("0,1,1,A1.1 SPR v", "0,1,1,A1.1 SPR END"),
    ],
)
def test_every_list_says_the_same(tmp_path, data):
    (one,) = read(write(tmp_path / "a.txt", data), "pnezd", codes="{block} {kind} {role}")
    assert one.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 0, 1]]
    assert one.points.tolist() == [[0.5, 0, 0.5]]


def test_a_list_in_a_workbook_is_read(tmp_path):
    rows = [
        [float(p), float(n), float(e), float(z), d]
        for p, n, e, z, d in (line.split(",") for line in LIST.splitlines())
    ]
    (one,) = read(write(tmp_path / "a.xlsx", xlsx({"S": rows})), "pnezd", codes="{block} {kind} {role}")
    assert (one.code, one.names) == ("A1.1", ("4", "1", "2", "3"))


def test_a_column_of_codes_is_taken_apart_by_the_template(tmp_path):
    data = "Punkt;Rechts;Hoch;Höhe;Code\n" + LIST.replace(",", ";").replace("0;0;", "0;0;", 1)
    (one,) = read(write(tmp_path / "a.csv", data), codes="{block} {kind} {role}")
    assert (one.code, one.kind, one.names) == ("A1.1", "spr", ("4", "1", "2", "3"))


@pytest.mark.parametrize(
    "outline",
    [
        "POLYGON Z ((0 0 0, 1 0 0, 1 0 1, 0 0 0))",
        "POLYGONZ((0 0 0,1 0 0,1 0 1,0 0 0))",
        "LINESTRING Z (0 0 0, 1 0 0, 1 0 1)",
        "MULTIPOLYGON Z (((0 0 0, 1 0 0, 1 0 1, 0 0 0)))",
        "SRID=25832;POLYGON ZM ((0 0 0 9, 1 0 0 9, 1 0 1 9, 0 0 0 9))",
    ],
)
def test_outlines_as_well_known_text(tmp_path, outline):
    """As QGIS and OGR write them: quoted in CSV, or between tabs."""
    for data in (f'WKT,Stein,depth\n"{outline}",A,0.5\n', f"wkt_geom\tStein\tdepth\n{outline}\tA\t0.5\n"):
        (one,) = read(write(tmp_path / "a.csv", data))
        assert one.vertices.tolist() == [[0, 0, 0], [1, 0, 0], [1, 0, 1]]
        assert (one.code, one.depth) == ("A", 0.5)


@pytest.mark.parametrize(
    ("outline", "words"),
    [
        ("POLYGON ((0 0, 1 0, 1 1, 0 0))", "two dimensions, without z"),
        ("POLYGON Z ((0 0 0, 9 0 0, 9 0 9, 0 0 0), (1 0 1, 2 0 1, 2 0 2, 1 0 1))", "2 rings"),
        ("POINT Z (0 0 0)", "is not an outline"),
        ("POLYGON Z ((0 0 0, 1 0 x, 1 0 1))", "not a number"),
        ("POLYGON Z ((0 0 0, 1 0 0))", "2 vertices"),
    ],
)
def test_an_outline_that_is_not_one_is_refused(tmp_path, outline, words):
    (one,) = open_survey(write(tmp_path / "a.csv", f'block;WKT\nA;"{outline}"\n'), "csv").blocks
    assert isinstance(one, Reject)
    assert words in str(one.error)


def test_kinds_have_words_in_five_languages():
    assert [kind_of(one, {}) for one in ("Läufer", "LAEUFER", "clé", "dovela", "Header", "rib segment")] == [
        "stretcher",
        "stretcher",
        "keystone",
        "voussoir",
        "header",
        "rib_segment",
    ]
    assert kind_of("SPR", {"spr": "springer"}) == "springer"


def test_kinds_are_read_from_a_table(tmp_path):
    path = write(tmp_path / "kinds.csv", "abbreviation;kind\nSPR;springer\nVOU;voussoir\n")
    assert read_kinds(str(path)) == {"spr": "springer", "vou": "voussoir"}
    for wrong in ("SPR", "SPR=", "=springer", "SPR=springer,SPR=sill", "SPR=spring er!"):
        with pytest.raises(UsageError):
            read_kinds(wrong)


def test_units_of_columns():
    assert unit_of("x [MM]") == ("x", "mm")
    assert unit_of("Tiefe in cm") == ("Tiefe", "cm")
    assert unit_of("z/m") == ("z", "m")
    assert unit_of("Zimmer") == ("Zimmer", None)
    assert unit_of("depth (m a.s.l.)") == ("depth (m a.s.l.)", None)
