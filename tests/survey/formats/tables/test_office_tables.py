"""Tables and lists as offices deliver them: rows of units, two columns of kinds, codes, numbers of points."""

import re
from itertools import chain

import pytest

from ground.errors import SurveyError, UsageError
from survey.formats.options import ReadingOptions
from survey.formats.reading import format_of
from survey.formats.tables.reader import open_csv, open_penzd
from survey.formats.tables.roles import read_roles
from survey.records.survey import BlockRecord, Reject
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


def table(path, names, cells, encoding="cp1252"):
    path.write_text("\n".join(";".join(row) for row in [names, *cells]), encoding=encoding)
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


@pytest.mark.parametrize("mark", ["'", "’", " ", "\u00a0", "\u202f"])
@pytest.mark.parametrize("decimal", [".", ","])
def test_thousands_may_be_set_apart(tmp_path, mark, decimal):
    def written(value):
        return f"{value:,.3f}".replace(".", "#").replace(",", mark).replace("#", decimal)

    cells = [
        [str(k), *map(written, (2683401 + x, 1248077 + y, z)), f"{code}:{role}"]
        for k, (code, role, x, y, z) in enumerate(POINTS, 1)
    ]
    path = table(tmp_path / "a.csv", ["Nr", "Ost", "Nord", "H", "Code"], cells, "utf-8")
    stones = list(open_penzd(path).blocks)
    assert stones[0].vertices[1].tolist() == pytest.approx([2683402.1, 1248077.001, 0.35], abs=1e-9)


@pytest.mark.parametrize("text", ["1.234,5", "12 345", "1'23", "1'2345", "1’234'567"])
def test_what_may_be_two_numbers_or_none_is_refused(tmp_path, text):
    cells = [[code, role, text, str(y), str(z)] for code, role, _, y, z in POINTS]
    found = list(open_csv(table(tmp_path / "a.csv", ["Stein", "Rolle", "x", "y", "z"], cells)).blocks)
    assert all(isinstance(one, Reject) and text in one.error.what for one in found)


KIND_LETTERS = {("01", 1): "E", ("01", 2): "L", ("02", 1): "E", ("02", 2): "L"}


@pytest.mark.parametrize("on_face", ["Fl", "m", "Fläche"])
@pytest.mark.parametrize(
    ("width", "template"), [(2, "{course:2}{number:2}{kind} {role?}"), (1, "{block}{kind} {role?}")]
)
def test_codes_without_marks_are_read_as_the_message_says(tmp_path, on_face, width, template):
    rows = [f"H{k},{k},7,2,HP" for k in range(3)]
    for k, (code, role, x, y, z) in enumerate(POINTS):
        course, number = code.split("-")
        name = f"{course}{int(number):0{width}d}{KIND_LETTERS[course, int(number)]}"
        rows.append(f"{k},{x},{y},{z},{name}{f' {on_face}' if role == 'F' else ''}")
    path = tmp_path / "a.txt"
    path.write_text("\n".join(rows))
    with pytest.raises(SurveyError) as refused:
        open_penzd(path)
    codes, roles = re.findall(r'--(?:codes|roles) "([^"]*)"', str(refused.value))
    assert (codes, roles) == (template, "HP=control")
    options = ReadingOptions(codes=codes, roles=read_roles(roles), kinds={"e": "quoin", "l": "stretcher"})
    stream = open_penzd(path, options)
    stones = list(stream.blocks)
    assert [(len(one.vertices), len(one.points), one.kind) for one in stones] == [
        (4, 2, kind) for kind in ("quoin", "stretcher") * 2
    ]
    assert {one.course for one in stones} == ({1, 2} if width == 2 else {None})
    assert "left out: 3 HP" in stream.remarks[0]


def test_letters_that_tell_stones_of_one_number_apart_are_no_kinds(tmp_path):
    rows = [
        f"{k}{letter},{x + 5 * (letter == 'b')},{y},{z},{code}{letter}"
        for letter in "ab"
        for k, (code, _, x, y, z) in enumerate(POINTS)
    ]
    path = tmp_path / "a.txt"
    path.write_text("\n".join(rows))
    with pytest.raises(SurveyError, match=r'--codes "\{block\}"'):
        open_penzd(path)


@pytest.mark.parametrize(
    "words", [("E1 E2 E3 E4 M1 M2"), ("Ecke 1,Ecke 2,Ecke 3,Ecke 4,Mitte,Mitte"), ("v1 v2 v3 v4 p p")]
)
def test_corners_and_middles_that_are_numbered_are_roles(tmp_path, words):
    names = words.split("," if "," in words else None)
    cells = [[code, names[k % 6], *map(str, place)] for k, (code, _, *place) in enumerate(POINTS)]
    found = read(table(tmp_path / "a.csv", ["Stein", "Pkt", "x", "y", "z"], cells))
    assert {code: one[:2] for code, one in found.items()} == FACES
    # names of points that say nothing of roles are names
    cells = [
        [code, f"P{k}", *map(str, place)] for k, (code, role, *place) in enumerate(POINTS) if role == "E"
    ]
    assert set(read(table(tmp_path / "b.csv", ["Stein", "Pkt", "x", "y", "z"], cells)).values()) == {
        (4, 0, "ashlar")
    }


def test_words_for_roles_are_stated_as_the_message_says(tmp_path):
    word = {"E": "Kante", "F": "innen 3"}
    cells = [[code, word[role], *map(str, place)] for code, role, *place in POINTS]
    path = table(tmp_path / "a.csv", ["Stein", "Rolle", "x", "y", "z"], cells)
    (first, *_) = open_csv(path).blocks
    assert '--roles "Kante=point"' in str(first.error)
    roles = read_roles("Kante=vertex,innen=Fläche")
    assert {code: one[:2] for code, one in read(path, roles=roles).items()} == FACES
    with pytest.raises(UsageError, match="roles are vertex, point, station and control"):
        read_roles("Kante=Rand,innen=drinnen")


@pytest.mark.parametrize("workbook", [False, True])
def test_the_name_of_a_stone_holds_for_the_rows_below_it(tmp_path, workbook):
    cells = [
        [
            *([code, code[1]] if k % 6 == 0 else ["", ""]),
            "Ecke" if role == "E" else "Fläche",
            *map(str, place),
        ]
        for k, (code, role, *place) in enumerate(POINTS)
    ]
    names = ["Stein", "Lage", "Typ", "x", "y", "z"]
    path = table(tmp_path / "a.csv", names, cells)
    if workbook:
        path = tmp_path / "a.xlsx"
        path.write_bytes(xlsx({"Messung": [names, *cells]}))
    stream = open_csv(path)
    stones = list(stream.blocks)
    assert {one.code: (len(one.vertices), len(one.points)) for one in stones} == FACES
    assert {one.code: one.course for one in stones} == {code: int(code[1]) for code in FACES}
    assert any("of the stone above" in remark for remark in stream.remarks)


def test_a_name_that_is_missing_once_is_an_error(tmp_path):
    cells = [[code, role, *map(str, place)] for code, role, *place in POINTS]
    cells[2][0] = ""
    found = list(open_csv(table(tmp_path / "a.csv", ["Stein", "Rolle", "x", "y", "z"], cells)).blocks)
    assert sum(isinstance(one, Reject) for one in found) == 1


@pytest.mark.parametrize("names", [("Lage", "Nr"), ("course", "block"), ("assise", "n° pierre")])
def test_numbers_that_begin_anew_in_each_course_are_joined_as_the_message_says(tmp_path, names):
    cells = [[*map(str, map(int, code.split("-"))), role, *map(str, place)] for code, role, *place in POINTS]
    path = table(tmp_path / "a.csv", [*names, "role", "x", "y", "z"], cells)
    with pytest.raises(SurveyError, match="numbered anew") as refused:
        open_csv(path)
    (columns,) = re.findall(r'--columns "([^"]*)"', str(refused.value))
    assert columns == f"block={names[0]}+{names[1]}"
    stones = list(open_csv(path, ReadingOptions(columns=columns)).blocks)
    assert {one.code: one.course for one in stones} == {"1-1": 1, "1-2": 1, "2-1": 2, "2-2": 2}
    assert all((len(one.vertices), len(one.points)) == (4, 2) for one in stones)


@pytest.mark.parametrize("ending", [".txt", ".asc", ".prn"])
def test_a_text_with_clear_names_of_columns_needs_no_format(tmp_path, ending):
    cells = [[code, role, *map(str, place)] for code, role, *place in POINTS]
    path = table(tmp_path / f"a{ending}", ["Stein", "Rolle", "Ost", "Nord", "Höhe"], cells)
    assert format_of(path) == "csv"
    unclear = table(tmp_path / f"b{ending}", ["Stein", "Rolle", "x", "y", "z"], cells)
    with pytest.raises(UsageError, match="does not tell the format"):
        format_of(unclear)


@pytest.mark.parametrize("word", ["Bogen", "arc", "Arco"])
def test_stones_of_an_arch_have_no_course(tmp_path, word):
    cells = [
        [code, word if code == "02-2" else code[1], role, *map(str, place)] for code, role, *place in POINTS
    ]
    stream = open_csv(table(tmp_path / "a.csv", ["Stein", "Lage", "Rolle", "x", "y", "z"], cells))
    assert [one.course for one in stream.blocks] == [1, 1, 2, None]
    assert any(word in remark for remark in stream.remarks)


@pytest.mark.parametrize(
    ("written", "template"),
    [("N-C{course}-S{number}-{role}", "{block}-{role}"), ("N{course}.{number} {role}", "{block} {role}")],
)
def test_roles_of_codes_may_be_numbered(tmp_path, written, template):
    cells = []
    for k, (code, role, *place) in enumerate(POINTS):
        course, number = code.split("-")
        numbered = f"{'v' if role == 'E' else 'f'}{k % 6 + 1}"
        text = written.format(course=course, number=number, role=numbered)
        cells.append([str(k), *map(str, place), text])
    path = table(tmp_path / "a.csv", ["Pt", "East", "North", "Elev", "Code"], cells)
    for reading in (open_penzd, open_csv):
        with pytest.raises(SurveyError) as refused:
            reading(path)
        (codes,) = re.findall(r'--codes "([^"]*)"', str(refused.value))
        assert codes == template
        stones = list(reading(path, ReadingOptions(codes=codes)).blocks)
        assert [(len(one.vertices), len(one.points)) for one in stones] == [(4, 2)] * 4


def test_what_ends_a_name_is_no_numbered_role(tmp_path):
    cells = [[str(k), *map(str, place), f"N-{code}-B7"] for k, (code, _, *place) in enumerate(POINTS)]
    with pytest.raises(SurveyError, match=r'--codes "\{block\}"'):
        open_penzd(table(tmp_path / "a.csv", ["Pt", "East", "North", "Elev", "Code"], cells))


@pytest.mark.parametrize(
    ("names", "scale"),
    [("X{k};Y{k};Z{k}", 1.0), ("Est {k} [cm];Nord {k} [cm];Alt {k} [cm]", 100.0), ("x_{k};y_{k};z_{k}", 1.0)],
)
def test_a_row_for_each_stone_has_numbered_corners(tmp_path, names, scale):
    corners = {code: [] for code in FACES}
    for code, role, *place in POINTS:
        if role == "E":
            corners[code].append([f"{scale * value:.4f}".replace(".", ",") for value in place])
    corners["02-2"].pop()  # a triangle
    cells = [[code, "9", *chain(*places), *[""] * 3 * (5 - len(places))] for code, places in corners.items()]
    titles = ";".join(names.format(k=k) for k in range(1, 6)).split(";")
    stones = list(open_csv(table(tmp_path / "a.csv", ["Stein", "Lage", *titles], cells)).blocks)
    assert [len(one.vertices) for one in stones] == [4, 4, 4, 3]
    assert stones[1].vertices[1].tolist() == pytest.approx([1.7, 0.001, 0.35], abs=2e-4)
    assert {one.course for one in stones} == {9}


@pytest.mark.parametrize(("corner", "face"), [("sommet", "doucine"), ("Ecke", "Bosse"), ("corner", "boss")])
def test_a_column_of_which_some_words_are_roles_is_asked_about(tmp_path, corner, face):
    cells = [[code, corner if role == "E" else face, *map(str, place)] for code, role, *place in POINTS]
    path = table(tmp_path / "a.csv", ["Stein", "Objekt", "x", "y", "z"], cells)
    with pytest.raises(SurveyError, match="corners and other points") as refused:
        open_csv(path)
    roles, columns = re.findall(r'--(?:roles|columns) "([^"]*)"', str(refused.value))
    assert {code: one[:2] for code, one in read(path, roles=read_roles(roles)).items()} == FACES
    assert {code: one[:2] for code, one in read(path, columns=columns).items()} == dict.fromkeys(
        FACES, (6, 0)
    )


def test_numbered_corners_of_a_national_grid_are_asked_about_their_axes(tmp_path):
    cells = [
        [
            "1",
            *chain(
                *(
                    (f"{5411000 + x}", f"{431000 + y}", f"{z}")
                    for x, y, z in [(0, 0, 0), (1, 0, 0), (1, 0, 1)]
                )
            ),
        ]
    ]
    names = [f"{axis}{k}" for k in (1, 2, 3) for axis in "XYZ"]
    with pytest.raises(SurveyError, match="northing"):
        open_csv(table(tmp_path / "a.csv", ["Stein", *names], cells))
    clear = [f"{axis}{k}" for k in (1, 2, 3) for axis in ("Nord", "Ost", "Höhe")]
    (stone,) = open_csv(table(tmp_path / "b.csv", ["Stein", *clear], cells)).blocks
    assert stone.vertices[1].tolist() == [431000, 5411001, 0]


@pytest.mark.parametrize(
    ("height", "scale"),
    [
        ("Höhe [m ü. M.]", 1.0),
        ("H.ü.M.", 1.0),
        ("Quota (m s.l.m.)", 1.0),
        ("Altitude NGF", 1.0),
        ("Elev (mm a.s.l.)", 1000.0),
    ],
)
def test_heights_say_what_they_are_counted_from(tmp_path, height, scale):
    cells = [[code, role, str(x), str(y), str(scale * z)] for code, role, x, y, z in POINTS]
    path = table(tmp_path / "a.csv", ["Stein", "Rolle", "Ost", "Nord", height], cells)
    (stone, *_) = open_csv(path).blocks
    assert stone.vertices[2].tolist() == pytest.approx([1.1, 0.002, 0.65])


@pytest.mark.parametrize(
    ("title", "words", "kinds"),
    [
        ("Art", ("L", "B", "F", "L"), {"stretcher", "header", "infill"}),
        ("Art", ("E", "P", "E", "P"), {"quoin", "slab"}),
        ("Position", ("Rand", "Mitte", "Rand", "Mitte"), {"ashlar"}),
        ("Position", ("Rand", "oben", "Rand", "oben"), {"ashlar"}),
    ],
)
def test_words_that_never_differ_within_a_stone_are_no_roles(tmp_path, title, words, kinds):
    word = dict(zip(FACES, words, strict=True))
    cells = [[code, word[code], *map(str, place)] for code, role, *place in POINTS if role == "E"]
    abbreviations = {"l": "stretcher", "b": "header", "f": "infill", "e": "quoin", "p": "slab"}
    found = read(table(tmp_path / "a.csv", ["Stein", title, "x", "y", "z"], cells), kinds=abbreviations)
    assert {code: one[:2] for code, one in found.items()} == dict.fromkeys(FACES, (4, 0))
    assert {one[2] for one in found.values()} == kinds
