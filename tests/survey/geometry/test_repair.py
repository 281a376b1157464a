"""Surfaces that are nearly closed become closed; what was done is said, and what is left has a place."""

import itertools
import re

import numpy as np
import pytest

from ground.errors import GeometryError
from survey.formats.options import ReadingOptions
from survey.formats.reading import open_survey
from survey.formats.solids.bodies import RawBody, closed_bodies
from survey.geometry.repair.polygons import simple_polygons, without_repeats
from survey.geometry.repair.repair import open_edges, repair
from survey.geometry.solids import volume_of
from survey.geometry.watertight import check_watertight
from survey.records.survey import Reject, SolidRecord

BOX = np.array(list(itertools.product((0.0, 1.0), (0.0, 0.5), (0.0, 0.3))))
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
VOLUME = 0.15


def body(vertices, polygons, tolerance=None):
    (one,) = closed_bodies(RawBody("A", np.asarray(vertices, float), polygons), tolerance=tolerance)
    if isinstance(one, GeometryError):
        raise one
    return one


def unwelded(noise, faces=FACES, seed=0):
    """A box whose faces have corners of their own, each a little beside."""
    rng = np.random.default_rng(seed)
    corners = np.concatenate([BOX[list(face)] for face in faces])
    starts = np.cumsum([0, *map(len, faces)])
    polygons = [tuple(range(a, b)) for a, b in itertools.pairwise(starts)]
    return corners + rng.uniform(-noise, noise, corners.shape), polygons


def test_a_closed_box_stays_as_it_is():
    one = body(BOX, FACES)
    assert one.repairs == ()
    np.testing.assert_array_equal(one.solid.vertices, BOX)


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize(("noise", "tolerance"), [(2e-7, None), (3e-6, None), (3e-4, 1e-3)])
def test_corners_that_differ_in_their_last_digits_are_welded(noise, tolerance, triangles):
    faces = [t for a, b, c, d in FACES for t in ((a, b, c), (a, c, d))] if triangles else FACES
    one = body(*unwelded(noise, faces), tolerance)
    assert len(one.solid.vertices) == 8
    assert volume_of(one.solid) == pytest.approx(VOLUME, rel=20 * noise)
    assert "corners of open edges welded" in one.repairs[0]


def test_the_tolerance_that_would_do_is_named():
    with pytest.raises(GeometryError, match=r"not closed: 24 edges have one face") as error:
        body(*unwelded(2e-4))
    assert error.value.remedy == "close it, or give --repair 0.001, which would"
    with pytest.raises(GeometryError, match="not closed"):
        body(*unwelded(2e-7), 0.0)


def test_orientation_is_made_one_and_duplicates_count_once():
    turned = [face[::-1] if k % 2 else face for k, face in enumerate(FACES)]
    one = body(BOX, [*turned, FACES[0]])
    assert volume_of(one.solid) == pytest.approx(VOLUME)
    assert one.doubled == 1


@pytest.mark.parametrize("bad", [(0, 1, 1), (0, 0, 0), (3, 3, 2, 2), (0, 1), (0, 1, 0), (0, 8, 1)])
def test_faces_without_area_are_dropped(bad):
    vertices = np.vstack([BOX, 0.5 * (BOX[0] + BOX[1])])
    one = body(vertices, [*FACES, bad])
    assert one.repairs == ("1 faces without area dropped",)
    assert volume_of(one.solid) == pytest.approx(VOLUME)


def test_a_corner_twice_in_a_row_is_one():
    one = body(BOX, [(0, 1, 1, 3, 2), *FACES[1:]])
    assert (one.repairs, len(one.solid.faces)) == ((), 6)
    assert without_repeats((1, 1, 2, 3, 2, 4)) == (1, 2, 4)


@pytest.mark.parametrize("away", [0.0, 4e-6])
@pytest.mark.parametrize("cuts", [1, 3])
def test_t_junctions_divide_the_edge(away, cuts):
    """The lower face has corners within an edge that its neighbour has not."""
    places = [(one + 1) / (cuts + 1) for one in range(cuts)]
    vertices = np.vstack([BOX, [BOX[0] + t * (BOX[4] - BOX[0]) + [0, 0, away] for t in places]])
    between = tuple(range(8, 8 + cuts))
    one = body(vertices, [*FACES[:4], (0, 2, 6, 4, *between[::-1]), FACES[5]])
    assert f"{cuts} corners divide edges of other faces" in one.repairs[0]
    assert volume_of(one.solid) == pytest.approx(VOLUME, rel=1e-4)


def test_a_bridge_between_an_outline_and_its_hole_is_read():
    """A frame: top and bottom are one polygon each, with a bridge to the hole."""
    outer = [(0, 0), (3, 0), (3, 3), (0, 3)]
    inner = [(1, 1), (2, 1), (2, 2), (1, 2)]
    vertices = [(x, y, z) for z in (0, 1) for x, y in (*outer, *inner)]
    top = (8, 9, 10, 11, 8, 12, 15, 14, 13, 12)
    bottom = tuple(i - 8 for i in top)[::-1]
    sides = [(k, (k + 1) % 4, 8 + (k + 1) % 4, 8 + k) for k in range(4)]
    walls = [(4 + (k + 1) % 4, 4 + k, 12 + k, 12 + (k + 1) % 4) for k in range(4)]
    one = body(vertices, [top, bottom, *sides, *walls])
    assert volume_of(one.solid) == pytest.approx(8.0)


def test_a_pinched_polygon_is_split():
    flat = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (-1, 0, 0), (-1, -1, 0)], float)
    assert sorted(simple_polygons(flat, (0, 1, 2, 0, 3, 4))) == [(0, 1, 2), (0, 3, 4)]


def ball(rings=14, around=20):
    """A closed ball of many small faces."""
    angles = np.linspace(0, np.pi, rings + 1)[1:-1]
    turns = np.arange(around) * 2 * np.pi / around
    vertices = [
        (0, 0, 1),
        *((np.sin(a) * np.cos(t), np.sin(a) * np.sin(t), np.cos(a)) for a in angles for t in turns),
    ]
    vertices.append((0, 0, -1))
    last = len(vertices) - 1
    faces = [(0, 1 + k, 1 + (k + 1) % around) for k in range(around)]
    for row in range(rings - 2):
        low, high = 1 + row * around, 1 + (row + 1) * around
        for k in range(around):
            j = (k + 1) % around
            faces += [(low + k, high + k, high + j), (low + k, high + j, low + j)]
    low = 1 + (rings - 2) * around
    return np.array(vertices), [*faces, *((last, low + (k + 1) % around, low + k) for k in range(around))]


@pytest.mark.parametrize("missing", [1, 2, 5])
def test_small_holes_are_covered(missing):
    vertices, faces = ball()
    one = body(vertices, faces[:-missing])
    whole = body(vertices, faces)
    assert "1 hole covered" in one.repairs[0]
    assert volume_of(one.solid) == pytest.approx(volume_of(whole.solid), rel=0.01)


def test_a_large_hole_is_named_with_its_place():
    vertices, faces = ball()
    with pytest.raises(GeometryError) as error:
        body(vertices + np.array([100.0, 0.0, 5.0]), faces[: -(20 + 4 * 40)])
    assert re.search(
        r"a hole 2\.\d+ m wide with 20 edges about \(100\.000, -?0\.000, 4\.\d+\)", str(error.value)
    )
    assert error.value.remedy == "close it there"
    with pytest.raises(GeometryError, match=r"not closed: 4 edges have one face; a hole 0\.583 m wide"):
        body(BOX, FACES[1:])


def test_a_slit_between_faces_that_cross_is_brought_together():
    """A side follows its corners in order, the top in another: two corners 1 mm apart are taken the wrong way round."""
    vertices, polygons = (
        [(x, y, z) for z in (0.0, 1.0) for x, y in ((0, 0), (1, 0), (1, 0.5), (1.001, 0.5), (1, 1), (0, 1))],
        [],
    )
    sides = [(k, (k + 1) % 6, 6 + (k + 1) % 6, 6 + k) for k in range(6)]
    polygons = [*sides, (5, 4, 2, 3, 1, 0), (6, 7, 9, 8, 10, 11)]
    one = body(vertices, polygons)
    assert volume_of(one.solid) == pytest.approx(1.0, rel=2e-3)
    assert "welded, up to 1 mm apart" in one.repairs[0]


def test_repair_counts_and_leaves_open_edges_to_the_caller():
    vertices, faces = ball()
    found = repair(vertices, faces[:-60], 1e-9)
    assert found.deeds == ()
    assert len(open_edges(found.polygons)) == found.left[0].edges == 20


OBJ = (
    "o s\n"
    + "".join(f"v {x} {y} {z}\n" for x, y, z in BOX.tolist())
    + "".join(f"f {' '.join(str(i + 1) for i in face)}\n" for face in FACES)
)


def solids(path, text, **options):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return list(open_survey(path, "solids", ReadingOptions(**options)).blocks)


@pytest.mark.parametrize(
    "text",
    [
        OBJ.replace(" 0.0\n", " \\\n0.0\n"),
        OBJ.replace("f ", "f \\\n \\\n"),
        OBJ.replace(" ", "\t"),
        OBJ.replace("f 1 2 4 3", "f -8 -7 -5 -6"),
        OBJ.replace("f 1 2 4 3", "f 1/1/1 2//1 4/1 3"),
        "mtllib a.mtl\n# \\\n" + OBJ.replace("f", "usemtl x\nlod 3\nf", 1),
        OBJ.replace("0.3\n", "0.3 nan nan nan\n"),
    ],
)
def test_the_grammar_of_obj_is_read(tmp_path, text):
    (one,) = solids(tmp_path / "a.obj", text)
    assert isinstance(one, SolidRecord)
    assert len(one.faces) == 6


def stl(names, offsets):
    out = []
    for name, offset in zip(names, offsets, strict=True):
        out.append(f"solid {name}")
        for a, b, c, d in FACES:
            for triangle in ((a, b, c), (a, c, d)):
                out += ["facet normal 0 0 0", " outer loop"]
                out += [
                    f"  vertex {x} {y} {z}" for x, y, z in (BOX[list(triangle)] + [offset, 0, 0]).tolist()
                ]
                out += [" endloop", "endfacet"]
        out.append("endsolid")
    return "\n".join(out) + "\n"


@pytest.mark.parametrize(
    ("names", "codes"),
    [
        (("S", "S"), ["S-1", "S-2"]),
        (("", ""), ["a-1", "a-2"]),
        (("S", "T", "S"), ["S-1", "T", "S-2"]),
        (("Stein 1", "Stein 1"), ["Stein_1-1", "Stein_1-2"]),
    ],
)
def test_solids_of_one_name_are_numbered(tmp_path, names, codes):
    found = solids(tmp_path / "a.stl", stl(names, range(0, 2 * len(names), 2)))
    assert [one.code for one in found if isinstance(one, SolidRecord)] == codes
    lines = []
    for k, name in enumerate(names):
        lines.append(f"o {name or 'a'}")
        lines += [f"v {x + 2 * k} {y} {z}" for x, y, z in BOX.tolist()]
        lines += [f"f {' '.join(str(i - 8) for i in face)}" for face in FACES]
    found = solids(tmp_path / "a.obj", "\n".join(lines))
    assert [one.code for one in found if isinstance(one, SolidRecord)] == codes


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_fields_of_ply_that_nobody_reads_may_be_anything(tmp_path, form):
    """CloudCompare writes scalars that are not numbers; scanners write colours, normals and a list for each face."""
    head = (
        f"ply\nformat {form} 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nproperty float scalar_Distance\nelement face 6\nproperty list uchar int vertex_indices\n"
        "property list uchar float texcoord\nproperty uchar alpha\nend_header\n"
    ).encode()
    if form == "ascii":
        rows = [f"{x} {y} {z} 255 nan" for x, y, z in BOX.tolist()]
        rows += [f"4 {a} {b} {c} {d} 2 nan inf 255" for a, b, c, d in FACES]
        data = head + "\n".join(rows).encode() + b"\n"
    else:
        order = "<" if "little" in form else ">"
        vertex = np.dtype([("place", f"{order}f4", 3), ("red", "u1"), ("scalar", f"{order}f4")])
        face = np.dtype(
            [("n", "u1"), ("i", f"{order}i4", 4), ("m", "u1"), ("t", f"{order}f4", 2), ("alpha", "u1")]
        )
        vertices, faces = np.zeros(8, vertex), np.zeros(6, face)
        vertices["place"], vertices["scalar"] = BOX, np.nan
        faces["n"], faces["i"], faces["m"], faces["t"] = 4, FACES, 2, np.nan
        data = head + vertices.tobytes() + faces.tobytes()
    (one,) = solids(tmp_path / "a.ply", data)
    assert isinstance(one, SolidRecord)
    assert len(one.faces) == 6


def test_y_may_point_upwards(tmp_path):
    (one,) = solids(tmp_path / "a.obj", OBJ, up="y")
    assert np.ptp(one.vertices, axis=0).tolist() == pytest.approx([1.0, 0.3, 0.5])
    (low,) = np.flatnonzero((one.vertices == [0.0, 0.0, 0.0]).all(axis=1))
    assert low >= 0
    assert one.vertices[:, 2].min() == 0.0


def test_snapping_of_nothing_is_no_fault(tmp_path):
    (one,) = solids(tmp_path / "a.obj", OBJ.rpartition("f ")[0], snap=0.001)
    assert isinstance(one, Reject)
    assert "not closed: 4 edges have one face" in str(one.error)


def mutated(rng):
    """A box or a ball with a few faults of the kinds that programs make."""
    vertices, faces = (BOX.copy(), list(FACES)) if rng.random() < 0.5 else ball(6, 9)
    for _ in range(rng.integers(1, 4)):
        k = int(rng.integers(len(faces)))
        match rng.integers(8):
            case 0:
                del faces[k]
            case 1:
                faces.append(faces[k][::-1])
            case 2:
                faces[k] = faces[k][::-1]
            case 3:
                faces[k] = (*faces[k], faces[k][int(rng.integers(len(faces[k])))])
            case 4:
                vertices = vertices + rng.normal(0.0, 10.0 ** rng.uniform(-9, -1), vertices.shape)
            case 5:  # a corner of its own
                vertices = np.vstack(
                    [vertices, vertices[faces[k][0]] + rng.normal(0.0, 10.0 ** rng.uniform(-9, -2), 3)]
                )
                faces[k] = (len(vertices) - 1, *faces[k][1:])
            case 6:  # a corner on an edge
                a, b = faces[k][:2]
                vertices = np.vstack([vertices, 0.5 * (vertices[a] + vertices[b])])
                faces[k] = (a, len(vertices) - 1, *faces[k][1:])
            case 7:
                faces[k] = tuple(rng.permutation(faces[k]).tolist())
        if not faces:
            break
    return vertices, faces


def check_mutated(seeds):
    accepted = 0
    for seed in seeds:
        rng = np.random.default_rng(seed)
        vertices, faces = mutated(rng)
        tolerance = (None, 0.0, 1e-3)[seed % 3]
        for one in closed_bodies(RawBody("A", vertices, faces), tolerance=tolerance):
            if isinstance(one, GeometryError):
                assert one.remedy
            else:
                check_watertight(one.solid)
                accepted += 1
    return accepted


def test_mutated_meshes_are_closed_or_refused():
    assert 15 < check_mutated(range(80)) < 80


@pytest.mark.slow
def test_a_thousand_mutated_meshes_are_closed_or_refused():
    assert 200 < check_mutated(range(1000, 3000)) < 2000
