"""`moma ingest` of surveys with wrong stones: no partial result, no data lost.

By default a file is taken whole or not at all, and the database stays as it was, byte for byte. With `--keep-going` the
good stones are taken, and what is left over is itself a survey: corrected, it is taken in too, and the database then
holds what it would hold of a file that was right from the start.
"""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from moma.cli import app

CORNERS = [(10.0, 2.0, 0.5), (10.6, 2.0, 0.5), (10.6, 2.0, 0.8), (10.0, 2.0, 0.8)]
INSIDE = [(10.1, 2.003, 0.6), (10.4, 1.998, 0.7), (10.2, 2.001, 0.75)]
COUNT = 8


def moma(code):
    rows = [f"  vertex {x:.4f} {y:.4f} {z:.4f}" for x, y, z in shifted(CORNERS, code)]
    rows += [f"  point {x:.4f} {y:.4f} {z:.4f}" for x, y, z in shifted(INSIDE, code)]
    return [f"stone W{code} header course 1", "  note state sound", *rows, "end"]


def csv(code):
    rows = [("vertex", place) for place in shifted(CORNERS, code)]
    rows += [("point", place) for place in shifted(INSIDE, code)]
    return [f"W{code},header,1,{role},{x:.4f},{y:.4f},{z:.4f},0.003,0.4" for role, (x, y, z) in rows]


def pnezd(code):
    rows = [("v", place) for place in shifted(CORNERS, code)] + [
        ("p", place) for place in shifted(INSIDE, code)
    ]
    return [
        f"{100 * code + k},{y:.4f},{x:.4f},{z:.4f},W{code} HEADER 1 {role}"
        for k, (role, (x, y, z)) in enumerate(rows)
    ]


def shifted(places, code):
    return [(x + 0.7 * code, y, z) for x, y, z in places]


HEADS = {
    "moma": [
        *("moma-survey 1", "name wall", "observer 12 -20 1", "sigma 0.003"),
        *("depth header 0.4 source guess", ""),
    ],
    "csv": ["block,kind,course,role,x,y,z,sigma,depth"],
    "pnezd": ["Point,Northing,Easting,Elevation,Code"],
}
STONES = {"moma": moma, "csv": csv, "pnezd": pnezd}
OPTIONS = {"moma": [], "csv": [], "pnezd": ["--codes", "{block} {kind} {course} {role}"]}
# what goes wrong with stone 3: a word in place of a number, a face without area, a corner lost
SPOILS = {
    "a coordinate": lambda lines: [line.replace("0.7500", "0.75OO") for line in lines],
    "a line": lambda lines: [line.replace("11.6000", "").replace("12.1000", "") for line in lines],
    "a flat face": lambda lines: [line.replace("0.8000", "0.5000") for line in lines],
}


def survey(path, format, spoil=None, stones=range(COUNT)):
    """Write a survey, of which stone 3 is spoiled."""
    lines = [*HEADS[format]]
    for code in stones:
        own = STONES[format](code)
        lines += SPOILS[spoil](own) if spoil and code == 3 else own
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


@pytest.fixture
def header(tmp_path):
    """Write a header file for point lists, which have no depths."""
    path = tmp_path / "header.moma"
    path.write_text("\n".join(HEADS["moma"]) + "\n", encoding="utf-8")
    return path


def ingest(database, path, format, *more, header=None):
    given = ["--header", str(header)] if format != "moma" and header is not None else []
    words = [
        "ingest",
        str(path),
        "--format",
        format,
        "--db",
        f"sqlite:///{database}",
        *OPTIONS[format],
        *given,
        *more,
    ]
    return CliRunner().invoke(app, words)


def stored(database):
    """Return the data of every stone in the database, by code."""
    done = CliRunner().invoke(app, ["query", "header", "--db", f"sqlite:///{database}", "--format", "json"])
    assert done.exit_code == 0, done.output
    return {row["code"]: row for row in json.loads(done.stdout)}


@pytest.mark.parametrize("format", HEADS)
@pytest.mark.parametrize("spoil", SPOILS)
def test_a_wrong_stone_leaves_the_database_as_it_was(tmp_path, header, format, spoil):
    database = tmp_path / "wall.db"
    first = survey(tmp_path / "first.txt", format, stones=[20, 21])
    assert ingest(database, first, format, header=header).exit_code == 0
    before = database.read_bytes()
    bad = survey(tmp_path / "bad.txt", format, spoil)
    done = ingest(database, bad, format, header=header)
    assert done.exit_code == 1
    assert f"{bad.name}:" in done.output.replace("\n", "")
    assert database.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "bad.txt",
        "first.txt",
        "header.moma",
        "wall.db",
    ]


@pytest.mark.parametrize("format", HEADS)
@pytest.mark.parametrize("spoil", SPOILS)
def test_rejects_that_are_corrected_complete_the_survey(tmp_path, header, format, spoil):
    database, whole = tmp_path / "wall.db", tmp_path / "whole.db"
    bad = survey(tmp_path / "wall.txt", format, spoil)
    rejects = tmp_path / "rejects.txt"
    done = ingest(database, bad, format, "--keep-going", "--rejects", str(rejects), header=header)
    assert done.exit_code == 0, done.output
    assert set(stored(database)) == {f"W{k}" for k in range(COUNT) if k != 3}

    # the reason stands in it; the right lines in place of the wrong ones make a survey of it
    text = rejects.read_text(encoding="utf-8")
    assert "wall.txt:" in text
    wrong = "\n".join(SPOILS[spoil](STONES[format](3)))
    assert text.count(wrong) == 1
    text = text.replace(wrong, "\n".join(STONES[format](3)))
    rejects.write_text(text.replace("name wall", "name wall, corrected"), encoding="utf-8")
    again = ingest(database, rejects, format, header=header)
    assert again.exit_code == 0, again.output

    assert ingest(whole, survey(tmp_path / "right.txt", format), format, header=header).exit_code == 0
    pieced, at_once = stored(database), stored(whole)
    assert set(pieced) == set(at_once)
    for code, row in at_once.items():
        assert pieced[code] | {"survey": None} == row | {"survey": None}


def test_a_file_that_is_wrong_as_a_whole_is_refused_even_so(tmp_path):
    database = tmp_path / "wall.db"
    path = tmp_path / "wall.moma"
    path.write_bytes(b"moma-survey 1\n\x00\x01\x02\n")
    assert ingest(database, path, "moma", "--keep-going").exit_code == 1
    assert not database.exists()


def test_numbers_in_the_database_are_those_of_the_survey(tmp_path):
    database = tmp_path / "wall.db"
    assert ingest(database, survey(tmp_path / "wall.moma", "moma"), "moma").exit_code == 0
    rows = stored(database)
    assert len(rows) == COUNT
    for row in rows.values():
        sizes = [row["length"], row["height"], row["depth"], row["volume"]]
        np.testing.assert_allclose(
            sizes, [0.6, 0.3, 0.4, 0.072], atol=1e-4
        )  # the faces lean by some milliradians
        assert (row["redundancy"], row["points"], row["rejected"]) == (4, 3, 0)
