"""Tables and lists as offices deliver them: rows of units, two columns of kinds, codes, numbers of points."""

import re

import pytest

from ground.errors import SurveyError
from survey.formats.options import ReadingOptions
from survey.formats.tables.reader import open_csv, open_penzd
from survey.records.survey import BlockRecord
from tests.survey.formats.workbooks import xlsx

PLACES = [(0.0, 0.0), (0.5, 0.0), (0.5, 0.3), (0.0, 0.3), (0.2, 0.1), (0.3, 0.2)]
POINTS = [
    (f"0{course}-{n}", "EEEEFF"[k], 0.6 * n + x, 0.001 * k, 0.35 * course + z)
    for course in (1, 2)
    for n in (1, 2)
    for k, (x, z) in enumerate(PLACES)
]


def read(path, **options):
    """Return the stones of a table by code, with their corners, points and kind."""
    records = list(open_csv(path, ReadingOptions(**options)).blocks)
    assert all(isinstance(one, BlockRecord) for one in records), records
    return {one.code: (len(one.vertices), len(one.points), one.kind) for one in records}


def table(path, names, cells):
    path.write_text("\n".join(";".join(row) for row in [names, *cells]), encoding="cp1252")
    return path


FACES = {f"0{course}-{n}": (4, 2) for course in (1, 2) for n in (1, 2)}


@pytest.mark.parametrize(
    ("names", "units", "scale"),
    [
        (("Rechtswert", "Hochwert", "Höhe"), ("m", "m", "m ü. NN"), 1.0),
        (("x", "y", "z"), ("[mm]", "[mm]", "[mm]"), 1000.0),
        (("Est", "Nord", "Quota"), ("cm", "cm", "cm"), 100.0),
    ],
)
def test_a_row_of_units_beneath_the_names(tmp_path, names, units, scale):
    rows = [
        [code, "Läufer", "Ecke" if role == "E" else "Fläche", *(scale * one for one in place)]
        for code, role, *place in POINTS
    ]
    sheet = [["Aufmass 3/24"], ["Stein", "Art", "Typ", *names], [None, None, None, *units], *rows]
    path = tmp_path / "a.xlsx"
    path.write_bytes(xlsx({"Tabelle1": sheet}))
    stones = list(open_csv(path).blocks)
    assert {one.code: (len(one.vertices), len(one.points)) for one in stones} == FACES
    assert {one.kind for one in stones} == {"stretcher"}
    assert stones[0].vertices[1].tolist() == pytest.approx([1.1, 0.001, 0.35])


def test_of_two_columns_of_kinds_the_one_of_roles_is_the_role(tmp_path):
    cells = [
        [code, "Läufer", "Ecke" if role == "E" else "Punkt", *map(str, place)]
        for code, role, *place in POINTS
    ]
    names = ["Stein", "Art", "Typ", "x", "y", "z"]
    faces = {code: (*face, "stretcher") for code, face in FACES.items()}
    assert read(table(tmp_path / "a.csv", names, cells)) == faces
    # a column of kinds alone, whose values are roles
    short = [[row[0], *row[2:]] for row in cells]
    found = read(table(tmp_path / "b.csv", ["Stein", "Typ", "x", "y", "z"], short))
    assert found == {code: (*face, "ashlar") for code, face in FACES.items()}


def test_two_columns_of_kinds_without_roles_are_a_question(tmp_path):
    cells = [[code, "Läufer", "Sandstein", *map(str, place)] for code, _, *place in POINTS]
    path = table(tmp_path / "a.csv", ["Stein", "Art", "Typ", "x", "y", "z"], cells)
    with pytest.raises(SurveyError, match="are both kind"):
        read(path)


@pytest.mark.parametrize(
    ("written", "template"),
    [
        ("{code}/L/{course}/{role}", "{block}/{kind}/{course}/{role}"),
        ("{code};{role}", "{block};{role}"),
        ("{code}{role}", "{block}{role}"),
    ],
)
def test_numbers_of_points_are_no_stones_and_the_codes_are_found(tmp_path, written, template):
    cells = [
        [str(k), *map(str, place), f'"{written.format(code=code, role=role, course=int(code[1]))}"']
        for k, (code, role, *place) in enumerate(POINTS, 1)
    ]
    path = table(tmp_path / "a.csv", ["Pkt", "Rechts", "Hoch", "Höhe", "Bemerkung"], cells)
    with pytest.raises(SurveyError, match="column 'Pkt' numbers the points") as refused:
        read(path)
    columns, codes = re.findall(r'--(?:columns|codes) "([^"]*)"', str(refused.value))
    assert (columns, codes) == ("description=Bemerkung", template)
    faces = read(path, columns=columns, codes=codes, kinds={"l": "stretcher"})
    assert {code: face[:2] for code, face in faces.items()} == FACES


def test_numbers_of_points_beside_a_column_that_repeats(tmp_path):
    cells = [[str(k), *map(str, place), code] for k, (code, _, *place) in enumerate(POINTS, 1)]
    path = table(tmp_path / "a.csv", ["Nr", "x", "y", "z", "Objekt"], cells)
    with pytest.raises(SurveyError, match='--columns "block=Objekt"'):
        read(path)
    assert read(path, columns="block=Objekt").keys() == FACES.keys()


@pytest.mark.parametrize(("title", "mark"), [("Code", " "), ("Beschreibung", "_"), ("desc", ":")])
def test_codes_in_a_column_of_codes_are_no_names(tmp_path, title, mark):
    cells = [
        [str(k), *map(str, place), f"{code}{mark}{role}"] for k, (code, role, *place) in enumerate(POINTS, 1)
    ]
    path = table(tmp_path / "a.csv", ["Point", "East", "North", "Elev", title], cells)
    with pytest.raises(SurveyError, match=f"column '{title}' holds codes of stones and roles") as refused:
        read(path)
    (codes,) = re.findall(r'--codes "([^"]*)"', str(refused.value))
    assert {code: face[:2] for code, face in read(path, codes=codes).items()} == FACES
    # names that end in letters of their own are names
    named = [
        [*row[:-1], f"{code} E"] for row, (code, role, *_) in zip(cells, POINTS, strict=True) if role == "E"
    ]
    assert len(read(table(tmp_path / "b.csv", ["Point", "East", "North", "Elev", title], named))) == len(
        FACES
    )


def test_a_list_whose_code_comes_second_is_read_as_the_message_says(tmp_path):
    lines = [
        f"{k:>8} {code + '_' + role:>12} {x:14.4f}{y:14.4f}{z:10.4f}"
        for k, (code, role, x, y, z) in enumerate(POINTS, 1)
    ]
    path = tmp_path / "leica.txt"
    path.write_text("\n".join(lines))
    with pytest.raises(SurveyError) as refused:
        open_penzd(path)
    columns = re.findall(r'--columns "([^"]*)"', str(refused.value))[0]
    with pytest.raises(SurveyError) as refused:
        read(path, columns=columns)
    codes = re.findall(r'--codes "([^"]*)"', str(refused.value))[0]
    assert {code: face[:2] for code, face in read(path, columns=columns, codes=codes).items()} == FACES


def test_titles_with_digits_before_a_list_and_roles_that_follow_names(tmp_path):
    lines = ["Projekt: Nordwand 2024", "System: ETRS89/UTM32", "", "Punktnr.  Ostwert  Nordwert  Höhe  Code"]
    lines += [
        f"{1000 + k}  {x:.3f}  {y:.3f}  {z:.3f}  {code}{role}".replace(".", ",")
        for k, (code, role, x, y, z) in enumerate(POINTS)
    ]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(lines), encoding="cp1252")
    with pytest.raises(SurveyError, match=r"a.txt:5: description '01-1E'.*--codes \"\{block\}\{role\}\""):
        open_penzd(path)
    stones = list(open_penzd(path, ReadingOptions(codes="{block}{role}")).blocks)
    assert {one.code: (len(one.vertices), len(one.points)) for one in stones} == FACES


def test_a_point_without_a_number_is_no_title(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("1,2.0,O.5,3.0,A1:v\n2,2.5,0.5,3.0,A1:v\n3,2.5,0.5,3.3,A1:v\n")
    (reject,) = list(open_penzd(path).blocks)
    assert ":1: " in str(reject.error)


def test_letters_that_are_of_the_names_are_no_roles(tmp_path):
    rows = [f"{k},{x},{y},{z},{code}E" for k, (code, role, x, y, z) in enumerate(POINTS) if role == "E"]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(rows))
    with pytest.raises(SurveyError, match=r'--codes "\{block\}"'):
        open_penzd(path)
