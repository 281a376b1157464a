"""Files of other programs and from sites: each is read correctly, or refused at a line.

Written after exports of Excel (German and French settings), Trimble Business Center (PNEZD), Leica Infinity and LisCAD
(blank-separated lists), Blender, Rhino and MeshLab (OBJ); solids are written here by gmsh and trimesh themselves.
"""

import re
from dataclasses import replace

import gmsh
import numpy as np
import pytest
import trimesh

from ground.errors import MomaError
from survey.formats.options import ReadingOptions
from survey.formats.reading import open_survey
from survey.records.survey import BlockRecord, Reject, SolidRecord

CORNERS = [(10.0, 2.0, 0.5), (10.6, 2.0, 0.5), (10.6, 2.0, 0.8), (10.0, 2.0, 0.8)]
INSIDE = [(10.1, 2.003, 0.6), (10.4, 1.998, 0.7)]


def read(path, format, options=None):
    """(stones, rejects) of a file."""
    both = list(open_survey(path, format, options).blocks)
    return [one for one in both if not isinstance(one, Reject)], [
        one for one in both if isinstance(one, Reject)
    ]


def the_stone(stones, code="W01-01", kind="header", course=1):
    (stone,) = stones
    assert isinstance(stone, BlockRecord)
    assert (stone.code, stone.kind, stone.course) == (code, kind, course)
    np.testing.assert_array_equal(stone.vertices, CORNERS)
    np.testing.assert_array_equal(stone.points, INSIDE)
    return stone


def located(error, path, line):
    """Assert that an error names the file, and the line where there are lines."""
    assert isinstance(error, MomaError)
    assert error.where is not None
    place = str(path) if line is None else f"{path}:{line}"
    assert error.where.startswith(place), f"{error.where}, not line {line}"
    assert error.remedy


# --- tables ---


def table(separator=",", mark=".", end="\n", head=None, tail="", quote=""):
    """The stone as a table; numbers with `mark`."""
    columns = ["block", "kind", "course", "role", "x", "y", "z", "sigma", "depth"]
    lines = [separator.join(head or columns)]
    for role, places in (("vertex", CORNERS), ("point", INSIDE)):
        for place in places:
            numbers = [f"{v:.4f}".replace(".", mark) for v in (*place, 0.003, 0.5)]
            cells = ["W01-01", "header", "1", role, *numbers]
            lines.append(separator.join(f"{quote}{cell}{quote}" for cell in cells) + tail)
    return end.join(lines) + end


BOM = b"\xef\xbb\xbf"
TABLES = {
    "plain": table().encode(),
    "unix without last line end": table().rstrip("\n").encode(),
    "excel, english": BOM + table(end="\r\n").encode(),
    "excel, german": BOM + table(";", ",", "\r\n").encode(),
    "excel, german, ansi": table(";", ",", "\r\n").encode("latin-1"),
    "libreoffice, all quoted": table(quote='"').encode(),
    "quoted, german": table(";", ",", "\r\n", quote='"').encode(),
    "tabs, french": table("\t", ",").encode(),
    "semicolons with points": table(";").encode(),
    "upper-case names of columns": table(
        head=["Block", "KIND", "Course", "Role", "X", "Y", "Z", "Sigma", "Depth"]
    ).encode(),
    "blank lines and comments": b"# made on site\n\n" + table().replace("\n", "\n\n").encode() + b"\n# end\n",
    "blanks around": table(separator=" , ").encode(),
    "reordered columns": "\n".join(
        ",".join(line.split(",")[k] for k in (3, 0, 6, 5, 4, 2, 1)) for line in table().splitlines()
    ).encode(),
}


@pytest.mark.parametrize("name", TABLES)
def test_tables_of_spreadsheets_are_read_right(tmp_path, name):
    path = tmp_path / "wall.csv"
    path.write_bytes(TABLES[name])
    stones, rejects = read(path, "csv")
    assert rejects == []
    stone = the_stone(stones)
    if name != "reordered columns":
        assert stone.sigma == pytest.approx(0.003)
        assert stone.depth == 0.5


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
def test_umlauts_of_zones_and_sources_survive(tmp_path, encoding):
    path = tmp_path / "wall.csv"
    lines = table(";", ",").splitlines()
    said = ";".join(["zone", "depth_source"])
    ends = "südlicher Querhausgiebel;Maßband, größte Öffnung"
    text = f"{lines[0]};{said}\n" + "".join(f"{line};{ends}\n" for line in lines[1:])
    path.write_bytes(text.encode(encoding))
    stone = the_stone(read(path, "csv")[0])
    assert stone.zone == "südlicher Querhausgiebel"
    assert stone.depth_source == "Maßband, größte Öffnung"


# (what is wrong, bytes, line of the first error): the whole file or the stone, but at that line
ODD_TABLES = {
    "trailing delimiters": (table(";", ",", tail=";;").encode(), 2),
    "empty rows of a spreadsheet": (table(";", ",").encode() + b";;;;;;;;\n", 8),
    "a number with a thousands separator": (table(";", ",").replace("10,4000", "1.010,4").encode(), 7),
    "both decimal marks": (table(";", ",").replace("10,4000", "10.4").encode(), 7),
    "decimal commas between commas": (table(",", ",").encode(), 2),
    "a formula error": (table().replace("10.4000", "#REF!").encode(), 7),
    "a unit": (table().replace("10.4000", "10.4 m").encode(), 7),
    "millimetres": (table().replace("10.4000", "1e9").encode(), 7),
    "an empty coordinate": (table().replace("10.4000", "").encode(), 7),
    "not a number": (table().replace("10.4000", "nan").encode(), 7),
    "an unclosed quote": (table().replace("vertex", '"vertex', 1).encode(), 2),
    "a missing column": (table().replace(",z,", ",q,").encode(), 1),
    "a column twice": (table().replace(",y,", ",x,").encode(), 1),
    "utf-16": (table().encode("utf-16"), 1),
    "a zip, as xlsx is": (b"PK\x03\x04\x14\x00\x06\x00" + bytes(range(256)), None),
    "nothing": (b"", 1),
    "names of columns alone": (b"block,kind,course,role,x,y,z\n", 2),
    "html": (b"<!DOCTYPE html><html><body>404</body></html>\n", 1),
    "another role": (table().replace("point", "bead").encode(), 6),
    "another kind within a stone": (
        table().replace("W01-01,header,1,point", "W01-01,jamb,1,point").encode(),
        6,
    ),
    "two corners only": ("\n".join(table().splitlines()[:3] + table().splitlines()[5:]).encode(), 2),
}


SPREADSHEET_HABITS = (
    "trailing delimiters",
    "empty rows of a spreadsheet",
    "utf-16",
)  # may be read right, too


@pytest.mark.parametrize("name", ODD_TABLES)
def test_tables_that_are_wrong_say_where(tmp_path, name):
    path = tmp_path / "wall.csv"
    content, line = ODD_TABLES[name]
    path.write_bytes(content)
    try:
        stones, rejects = read(path, "csv")
    except MomaError as error:
        located(error, path, line)
        return
    if name in SPREADSHEET_HABITS and not rejects:
        the_stone(stones)
        return
    located(rejects[0].error, path, line)
    for (
        stone
    ) in stones:  # what is wrong may be no part of it; else it must not come out of the rest of its lines
        the_stone([stone])


def test_a_windows_dash_is_read_or_refused_at_its_line(tmp_path):
    # Windows-1252 has an en dash at 0x96, which in Latin-1 is a control character
    path = tmp_path / "wall.csv"
    lines = table().splitlines()
    text = f"{lines[0]},zone\n" + "".join(f"{line},nave – north\n" for line in lines[1:])
    path.write_bytes(text.encode("cp1252"))
    try:
        stones, _ = read(path, "csv")
    except MomaError as error:
        located(error, path, 2)
    else:
        assert the_stone(stones).zone == "nave – north"


# --- point lists ---


def points(order="yxz", separator=",", mark=".", codes=("W01-01:v", "W01-01:p"), width=0):
    out = []
    for k, (x, y, z) in enumerate([*CORNERS, *INSIDE]):
        place = {"x": x, "y": y, "z": z}
        numbers = [f"{place[axis]:{width}.4f}".replace(".", mark) for axis in order]
        out.append(separator.join([str(101 + k), *numbers, codes[k >= 4]]))
    return "\n".join(out) + "\n"


LISTS = {
    "trimble": ("pnezd", "Point,Northing,Easting,Elevation,Code\r\n" + points().replace("\n", "\r\n"), None),
    "trimble, below a title": (
        "pnezd",
        "Job: 2024-11\nPoint,Northing,Easting,Elevation,Code\n" + points(),
        None,
    ),
    "trimble, without head": ("pnezd", points(), None),
    "leica, blanks": ("pnezd", points(separator=" ", width=14), None),
    "liscad, tabs": ("penzd", "Pt\tE\tN\tH\tCode\n" + points("xyz", "\t"), None),
    "german, semicolons": ("penzd", "Nr;Rechtswert;Hochwert;Höhe;Code\n" + points("xyz", ";", ","), None),
    "comments": ("pnezd", "# job 12, TS16\n" + points(), None),
    "codes with kind and course": (
        "pnezd",
        points(codes=("W01-01 HEADER 1 V", "W01-01 HEADER 1 P")),
        "{block} {kind} {course} {role}",
    ),
    "codes with dots": ("pnezd", points(codes=("W01-01#v", "W01-01#p")), "{block}#{role}"),
}


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1"])
@pytest.mark.parametrize("name", LISTS)
def test_point_lists_of_instruments_are_read_right(tmp_path, name, encoding):
    format, text, codes = LISTS[name]
    path = tmp_path / "list.txt"
    path.write_bytes(text.encode(encoding))
    stones, rejects = read(path, format, ReadingOptions(codes=codes, kind="header"))
    assert rejects == []
    stone = the_stone(stones, course=1 if codes and "course" in codes else None)
    assert stone.names == tuple(str(k) for k in (105, 106, 101, 102, 103, 104))


ODD_LISTS = {
    "no code": (points(codes=("", "")), (1,)),
    "another code": (points(codes=("W01-01:v", "tree")), (5,)),
    "a point twice": (points().replace("104,", "103,"), (4,)),
    "a coordinate that is a word": (points().replace("10.4000", "lost"), (6,)),
    "degrees": (points().replace("10.4000", "48°12'"), (6,)),
    "four fields": (points().replace("102,2.0000,", "102,"), (2,)),
    "infinite": (points().replace("10.4000", "inf"), (6,)),
}


@pytest.mark.parametrize("name", ODD_LISTS)
def test_point_lists_that_are_wrong_say_where(tmp_path, name):
    text, lines = ODD_LISTS[name]
    path = tmp_path / "list.txt"
    path.write_text(text, encoding="utf-8")
    try:
        stones, rejects = read(path, "pnezd", ReadingOptions(kind="header"))
    except MomaError as error:
        first = error
    else:
        assert rejects, "nothing was said of what is wrong"
        for stone in stones:  # not of the rest of its points
            the_stone(
                [replace(stone, points=stone.points if len(stone.points) else np.array(INSIDE))], course=None
            )
        first = rejects[0].error
    assert any(re.match(rf"{re.escape(str(path))}:{line}\b", first.where or "") for line in lines), (
        first.where
    )
    assert first.remedy


def test_eastings_and_northings_are_not_exchanged(tmp_path):
    # Lambert-93 of Notre-Dame: easting 652 km, northing 6,862 km
    path = tmp_path / "list.txt"
    rows = [(652_000.0 + x, 6_862_000.0 + y, z) for x, y, z in CORNERS]
    path.write_text("".join(f"{k},{n:.4f},{e:.4f},{h:.4f},A:v\n" for k, (e, n, h) in enumerate(rows)))
    (stone,), _ = read(path, "pnezd")
    np.testing.assert_array_equal(stone.vertices, rows)


# --- solids ---

WEDGE = np.array([[0, 0], [0.6, 0], [0.5, 0.4], [0.1, 0.4]])  # of a voussoir, 0.3 m deep: volume 0.06 m³


def wedge(shift=(0.0, 0.0, 0.0)):
    """trimesh of a voussoir: corners of both sides, 12 triangles."""
    vertices = np.array([(x, y, z) for y in (0.0, 0.3) for x, z in WEDGE]) + shift
    quads = [(0, 1, 2, 3), (7, 6, 5, 4), (1, 0, 4, 5), (2, 1, 5, 6), (3, 2, 6, 7), (0, 3, 7, 4)]
    faces = [tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert mesh.volume == pytest.approx(0.06)
    return mesh


def volume(solid):
    total, base = 0.0, solid.vertices[0]
    for face in solid.faces:
        p = solid.vertices[list(face)] - base
        total += sum(float(p[0] @ np.cross(p[k], p[k + 1])) / 6 for k in range(1, len(p) - 1))
    return total


def is_the_wedge(solid, resolution=1e-9, shift=(0.0, 0.0, 0.0)):
    assert isinstance(solid, SolidRecord)
    assert solid.vertices.shape == (8, 3)
    assert sorted(len(face) for face in solid.faces) == [4] * 6, "triangles of one plane are one face"
    assert volume(solid) == pytest.approx(0.06, abs=resolution)
    expected = {tuple(p) for p in np.round(wedge(shift).vertices, 5)}
    assert {tuple(p) for p in np.round(solid.vertices + 0.0, 5)} == expected


@pytest.mark.parametrize("ending", ["stl", "stl_ascii", "ply", "ply_ascii", "obj"])
def test_solids_that_trimesh_writes(tmp_path, ending):
    kind, _, how = ending.partition("_")
    path = tmp_path / f"V07.{kind}"
    options = {"file_type": ending} if kind == "stl" else {"encoding": "ascii"} if how else {}
    wedge().export(path, **options)
    stones, rejects = read(path, "solids", ReadingOptions(kind="voussoir"))
    assert rejects == []
    (stone,) = stones
    assert stone.kind == "voussoir"
    is_the_wedge(stone, 1e-6)


@pytest.mark.parametrize("ending", ["stl", "ply"])
def test_bodies_apart_in_one_mesh_are_stones_of_their_own(tmp_path, ending):
    path = tmp_path / f"arch.{ending}"
    trimesh.util.concatenate([wedge(), wedge((1, 0, 0)), wedge((2, 0, 0))]).export(path)
    stones, rejects = read(path, "solids")
    assert rejects == []
    assert len({stone.code for stone in stones}) == 3
    assert [volume(stone) for stone in stones] == pytest.approx([0.06] * 3, abs=1e-6)


def test_single_precision_on_a_national_grid_is_not_taken_for_a_stone(tmp_path):
    # binary STL has 32-bit numbers: 0.5 m at a northing of 6,860 km
    path = tmp_path / "far.stl"
    wedge((650_000.0, 6_860_000.0, 300.0)).export(path)
    try:
        stones, rejects = read(path, "solids")
    except MomaError:
        return
    assert stones == []
    assert rejects


OBJ = """# {program}
mtllib wall.mtl
{objects}"""


def obj(style):
    """Two wedges, one metre apart, as a program writes them."""
    quads = [(0, 1, 2, 3), (7, 6, 5, 4), (1, 0, 4, 5), (2, 1, 5, 6), (3, 2, 6, 7), (0, 3, 7, 4)]
    word, corner, before = {
        "blender": ("o", "{0}/1/1", "vt 0 0\nvn 0 0 1\ns 0\nusemtl Stone\n"),
        "rhino": ("g", "{0}//1", "usemtl diffuse\nvn 0 0 1\n"),
        "meshlab": ("o", "{0}", ""),
        "relative": ("o", "{1}", ""),
    }[style]
    out = []
    for k, name in enumerate(("V01:voussoir", "K01:keystone")):
        out.append(f"{word} {name}")
        out += [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in wedge((k, 0, 0)).vertices]
        out.append(
            before + "\n".join("f " + " ".join(corner.format(8 * k + i + 1, i - 8) for i in q) for q in quads)
        )
    return OBJ.format(program=style, objects="\n".join(out)) + "\n"


@pytest.mark.parametrize("style", ["blender", "rhino", "meshlab", "relative"])
def test_objects_of_obj_files_are_stones(tmp_path, style):
    path = tmp_path / "arch.obj"
    path.write_text(obj(style))
    stones, rejects = read(path, "solids")
    assert rejects == []
    assert [(stone.code, stone.kind) for stone in stones] == [("V01", "voussoir"), ("K01", "keystone")]
    for k, stone in enumerate(stones):
        is_the_wedge(stone, shift=(k, 0, 0))


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("order", [1, 2])
def test_volumes_of_gmsh_are_stones(tmp_path, version, binary, order):
    path = tmp_path / "pair.msh"
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.option.setNumber("Mesh.Binary", binary)
        boxes = [(3, gmsh.model.occ.addBox(x, 0, 0, 0.6, 0.3, 0.4)) for x in (0, 0.6)]
        gmsh.model.occ.fragment(boxes[:1], boxes[1:])  # they share a face, as stones of a wall do
        gmsh.model.occ.synchronize()
        for (_, tag), name in zip(boxes, ("A:header", "B:stretcher"), strict=True):
            gmsh.model.addPhysicalGroup(3, [tag], name=name)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.2)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
    stones, rejects = read(path, "solids")
    assert rejects == []
    assert sorted((stone.code, stone.kind) for stone in stones) == [("A", "header"), ("B", "stretcher")]
    for stone in stones:
        assert volume(stone) == pytest.approx(0.072, rel=1e-9)
        assert len(stone.faces) == 6


def test_an_open_mesh_is_refused_by_name(tmp_path):
    path = tmp_path / "open.obj"
    path.write_text(obj("meshlab").replace("f 1 2 3 4\n", "", 1))
    stones, rejects = read(path, "solids")
    assert [stone.code for stone in stones] == ["K01"]
    assert [reject.code for reject in rejects] == ["V01"]
    assert "closed" in str(rejects[0].error)


def test_faces_that_look_inwards_are_turned(tmp_path):
    mesh = wedge()
    mesh.invert()
    path = tmp_path / "V01.ply"
    mesh.export(path)
    (stone,), _ = read(path, "solids")
    is_the_wedge(stone, 1e-6)


# --- one line of a survey gone wrong ---

STONES = 6


def whole_survey(format):
    """(lines, first line and the line behind the last of each stone) of six stones."""
    lines = {
        "moma": ["moma-survey 1", "observer 10 -20 1", "sigma 0.003", "depth * 0.4 source guess"],
        "csv": ["block,kind,course,role,x,y,z,sigma,depth"],
        "pnezd": ["Point,Northing,Easting,Elevation,Code"],
    }[format]
    spans = []
    for k in range(STONES):
        first = len(lines)
        rows = [
            (role, (x + k, y, z))
            for role, some in (("vertex", CORNERS), ("point", INSIDE))
            for x, y, z in some
        ]
        if format == "moma":
            lines += [f"stone S{k} header course {k + 1}"]
            lines += [f"  {role} {x:.4f} {y:.4f} {z:.4f}" for role, (x, y, z) in rows] + ["end"]
        elif format == "csv":
            lines += [
                f"S{k},header,{k + 1},{role},{x:.4f},{y:.4f},{z:.4f},0.003,0.4" for role, (x, y, z) in rows
            ]
        else:
            lines += [
                f"{100 * k + i},{y:.4f},{x:.4f},{z:.4f},S{k}:{role}"
                for i, (role, (x, y, z)) in enumerate(rows)
            ]
        spans.append((first, len(lines)))
    return lines, spans


def spoiled(rng, line):
    """Damage one line as accidents do."""
    cut = int(rng.integers(len(line) + 1))
    odd = [
        *("\t", ";", ",", '"', "#", "nan", "1e400", "-", "ü", "١", "\u2028", "{}", "stone", "end"),
        "0" * 400,
        " ",
        "--1",
    ]
    word = odd[rng.integers(len(odd))]
    words = line.replace(",", " , ").split()
    k = int(rng.integers(len(words)))
    return [
        line[:cut],
        line[cut:],
        line[:cut] + word + line[cut:],
        line[:cut] + word + line[cut + 1 :],
        "".join([*words[:k], word, *words[k + 1 :]]),
        " ".join(words[:k] + words[k + 1 :]),
        line[:cut] + chr(int(rng.integers(1, 0x3000))) + line[cut:],
        line.swapcase(),
        line.replace(".", ","),
        line[::-1],
    ][rng.integers(10)]


@pytest.mark.parametrize("format", ["moma", "csv", "pnezd"])
@pytest.mark.parametrize("count", [150, pytest.param(3500, marks=pytest.mark.slow)])
def test_a_spoiled_line_harms_its_own_stone_alone(tmp_path, format, count):
    """Whatever becomes of one line, the other stones come out as they are, or the file is refused at some line."""
    rng = np.random.default_rng(101)
    lines, spans = whole_survey(format)
    path = tmp_path / f"wall.{format}"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\n")
    sound = {stone.code: stone for stone in read(path, format)[0]}
    assert len(sound) == STONES
    taken = refused = 0
    for _ in range(count):
        k = int(rng.integers(STONES))
        at = int(rng.integers(*spans[k]))
        changed = [*lines]
        changed[at] = spoiled(rng, lines[at])
        path.write_bytes(("\n".join(changed) + "\n").encode("utf-8", "surrogatepass"))
        try:
            stones, rejects = read(path, format)
        except MomaError as error:
            refused += 1
            stones, rejects = list(sound.values()), [Reject(f"S{k}", error)]
        for reject in rejects:
            assert re.match(rf"{re.escape(str(path))}:\d+", reject.error.where or ""), reject.error.where
        for stone in stones:
            assert np.isfinite(stone.vertices).all()
            assert len(stone.vertices) >= 3
            if stone.code in sound and stone.code != f"S{k}":
                other = sound[stone.code]
                extra = len(stone.vertices) + len(stone.points) > 6  # the line may now be one of this stone
                assert extra or np.array_equal(stone.vertices, other.vertices), changed[at]
        missing = set(sound) - {stone.code for stone in stones} - {f"S{k}"}
        assert missing <= {reject.code for reject in rejects}, (missing, changed[at])
        if f"S{k}" in {stone.code for stone in stones}:
            taken += 1
            stone = next(one for one in stones if one.code == f"S{k}")
            whole = len(stone.vertices) + len(stone.points) >= 6
            # a first row without a number is a title, and what is left of a description may be the word of a station
            title = at == spans[0][0] and not any(map(str.isdigit, changed[at]))
            blank = changed[at].strip() == "" or "#" in changed[at] or title
            assert whole or rejects or blank or open_survey(path, format).head.stations, changed[at]
    print(f"{format}: {refused} of {count} refused whole, {taken} spoiled stones taken")
