"""BODIES.DAT of LMGC90: bodies in their places, axes and supports; what has no shape is named."""

import numpy as np
import pytest

from survey.formats.reading import format_of, open_survey
from survey.geometry.solids import Solid, volume_of
from survey.records.survey import Reject

CORNERS = np.array([(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
QUADS = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
HEAD = "! File BODIES\n!\n! the keyword   $$$$$$  ends a body record.\n"
FRAME = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])


def numbers(names, values, form="{:13.7E}"):
    return "  ".join(f"{name}= {form.format(value)}" for name, value in zip(names, values, strict=True))


def polyhedron(size, shift=(0, 0, 0), letter="E", third="coo3", at=1, faces="nb_face"):
    """A block of half sizes as POLYR, its triangles in mixed order, as files have them."""
    triangles = [(one[0], one[k], one[k + 1])[:: 1 if k == 1 else -1] for one in QUADS for k in (1, 2)]
    lines = [f" POLYR      {at}  color  BLEUx  nb_vertex=      8    {faces}=     12"]
    corners = (numbers(("coo1", "coo2", third), one).replace("E", letter) for one in CORNERS * size + shift)
    lines += [" " * 29 + one for one in corners]
    lines += [" " * 29 + numbers(("ver1", "ver2", "ver3"), [c + 1 for c in one], "{}") for one in triangles]
    return "\n".join(lines)


def body(number, shape, centre=(0, 0, 0), inertia=(0, 0, 0), kind="RBDY3"):
    return "\n".join(
        [
            "$bdyty",
            f" {kind}      {number}",
            "$blmty",
            " PLAIN      1  behav  PLEXx  avrd= 0.0000000D+00  gyrd= 0.0000000D+00",
            " " * 29 + numbers(("I1  ", "I2  ", "I3  "), inertia),
            "$nodty",
            " NO6xx      1                " + numbers(("coo1", "coo2", "coo3"), centre),
            " " * 29 + numbers(("coo4", "coo5", "coo6"), (0, 0, 0)),
            "$tacty",
            shape,
            "$$$$$$",
            "",
        ]
    )


def frames(number, axes, moved=(0, 0, 0)):
    rows = [numbers([f"X({k})" for k in (1, 2, 3)], moved)]
    rows += [numbers([f"{name}({k})" for k in (1, 2, 3)], row) for name, row in zip("abg", axes, strict=True)]
    return "\n".join(["$bdyty", f" RBDY3        {number}", "$nodty", *rows, "$$$$$$", ""])


def held(number, components=6):
    rows = [f" vlocy      {k}  0.0000000D+00  0.0  0.0  0.0  1.0  0.0" for k in range(1, components + 1)]
    return "\n".join(["$bdyty", "! a comment", f" RBDY3      {number}", "$dofty", *rows, "$$$$$$", ""])


@pytest.fixture
def read(tmp_path):
    def read(text, dof="", driven=""):
        path = tmp_path / "BODIES.DAT"
        path.write_text(HEAD + text, encoding="utf-8")
        if dof:
            (tmp_path / "DOF.INI").write_text(dof, encoding="utf-8")
        if driven:
            (tmp_path / "DRV_DOF.DAT").write_text(driven, encoding="utf-8")
        assert format_of(path) == "solids"
        return list(open_survey(path, "solids").blocks)

    return read


def volume(stone):
    return volume_of(Solid(stone.code, stone.vertices, stone.faces))


def test_polyhedra_stand_about_their_centres_with_plane_faces(read):
    text = body(1, polyhedron((0.3, 0.2, 0.1), letter="D"), centre=(5, 6, 7))
    text += body(9, polyhedron((0.3, 0.2, 0.15), third="coor", faces="nb_faces"))
    first, second = read(text)
    assert (first.code, second.code) == ("1", "2")  # as LMGC90 counts, whatever the file states
    assert np.abs(first.vertices.mean(axis=0) - (5, 6, 7)).max() < 1e-6
    assert [len(stone.faces) for stone in (first, second)] == [6, 6]
    assert volume(first) == pytest.approx(0.6 * 0.4 * 0.2, rel=1e-6)


def test_bodies_in_axes_of_inertia_are_turned_and_moved_as_dof_ini_says(read):
    text = body(1, polyhedron((0.3, 0.2, 0.1)), centre=(5, 6, 7), inertia=(1, 2, 3))
    (stone,) = read(text, frames(1, FRAME, moved=(0.5, 0, 0)))
    wanted = (CORNERS * (0.3, 0.2, 0.1)) @ FRAME + (5.5, 6, 7)
    far = np.linalg.norm(stone.vertices[:, None] - wanted[None], axis=2).min(axis=1)
    assert far.max() < 1e-6


def test_bodies_in_axes_of_inertia_without_dof_ini_are_refused_with_the_way_out(read):
    (reject,) = read(body(1, polyhedron((1, 1, 1)), inertia=(1, 2, 3)))
    assert isinstance(reject, Reject)
    assert "put DOF.INI into the same folder" in str(reject.error)


def test_bodies_held_in_every_direction_are_supports(read):
    text = "".join(body(k, polyhedron((1, 1, 1), shift=(0, 0, 2 * k))) for k in (1, 2, 3))
    stones = read(text, driven=held(2) + held(3, components=5))
    assert [stone.kind for stone in stones] == ["ashlar", "support", "ashlar"]


def test_planes_are_boxes_and_clusters_are_separate_stones(read):
    plane = " PLANx      1  color  VERTx  axe1= 4.0D+00  axe2= 3.0D+00  axe3= 1.0D-01"
    cluster = polyhedron((1, 1, 1)) + "\n" + polyhedron((1, 1, 1), shift=(2, 0, 0), at=2)
    base, *parts = read(body(1, plane, centre=(0, 0, -1.1)) + body(2, cluster))
    assert volume(base) == pytest.approx(8 * 4 * 3 * 0.1)
    assert base.vertices[:, 2].max() == pytest.approx(-1.0)
    assert [stone.code for stone in parts] == ["2-1", "2-2"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (body(1, " SPHER      1  color  BLEUx  byrd= 1.0D+00"), "its shape is SPHER, not POLYR"),
        (body(1, polyhedron((1, 1, 1)), kind="RBDY2"), "it is RBDY2"),
        (body(1, polyhedron((1, 1, 1)), kind="MAILx"), "it is MAILx"),
    ],
)
def test_bodies_of_other_shapes_are_refused_by_name_and_others_stay(read, text, said):
    reject, stone = read(text + body(2, polyhedron((1, 1, 1))))
    assert said in str(reject.error)
    assert "BODIES.DAT:" in str(reject.error)
    assert volume(stone) == pytest.approx(8.0)


@pytest.mark.parametrize(
    ("cut", "said"),
    [("ver1= 1", "8 of 8 corners and 0 of 12 faces"), ("$$$$$$", "has no end"), ("ver3=", "2 numbers")],
)
def test_a_file_that_is_cut_short_is_refused(read, cut, said):
    text = body(1, polyhedron((1, 1, 1)))
    text = text[: text.index(cut)] + ("\n$$$$$$\n" if cut != "$$$$$$" else "")
    with pytest.raises(Exception, match=said):
        read(text)
