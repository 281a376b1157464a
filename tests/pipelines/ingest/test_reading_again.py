"""Questions refuse a file before anything is stored; the same file read with other options is another reading."""

import json

import numpy as np
import pytest
import trimesh

from archmodel.database.session import open_database
from archmodel.store.stones import load_stones
from archmodel.tables.entities import Entity
from ground.errors import DatabaseError, SurveyError
from pipelines.ingest.ingest import ingest
from pipelines.ingest.outlined import mask_options
from pipelines.ingest.reading_options import reading_options, solid_options
from tests.pipelines.ingest.test_cases import CASES, needs_shared


def boxes(path, size, columns=4):
    """Boxes in a row on others: the lengths of a block, along x, y, z."""
    shapes = [
        trimesh.creation.box(size, trimesh.transformations.translation_matrix(np.multiply(size, (i, 0, k))))
        for k in range(2)
        for i in range(columns)
    ]
    trimesh.Scene(shapes).export(path)
    return path


def outlines(path, unit):
    """Four outlines of 0.5 by 0.3 m in another unit."""
    rings = {
        f"A{k}": (np.array([(k, 0), (k + 0.5, 0), (k + 0.5, 0.3), (k, 0.3)]) / unit).tolist()
        for k in range(4)
    }
    path.write_text(json.dumps(rings))
    return path


def longest(url):
    """Length of the longest stone as the database has it now."""
    with open_database(url) as database, database.session(read_only=True) as session:
        found = load_stones(session, session.query(Entity).all())
    return max(float(np.ptp(one.solid_vertices, axis=0).max()) for one in found), len(found)


@pytest.fixture
def url(tmp_path):
    return f"sqlite:///{tmp_path}/a.db"


def read(path, url, again=False, unit=None, **given):
    if path.suffix == ".json":
        return ingest(
            [path], url, "masks", options=mask_options(reading_options(unit=unit), depth=0.4), again=again
        )
    return ingest(
        [path], url, "solids", options=solid_options(reading_options(unit=unit), **given), again=again
    )


@pytest.mark.parametrize("case", ["stl", "outlines"])
def test_a_question_of_the_unit_stores_nothing_and_its_answer_works(tmp_path, url, case):
    path = (
        boxes(tmp_path / "a.stl", (500.0, 300.0, 300.0))
        if case == "stl"
        else outlines(tmp_path / "a.json", 1e-3)
    )
    with pytest.raises(
        SurveyError, match="have the size of stones in mm, not metres; give --unit mm, or --unit m"
    ):
        read(path, url)
    assert not (tmp_path / "a.db").exists() or longest(url)[1] == 0
    read(path, url, unit="mm")
    size, count = longest(url)
    assert size == pytest.approx(0.5)
    read(path, url, again=True, unit="cm")  # another reading of the same bytes
    assert longest(url) == (pytest.approx(5.0), count)
    read(path, url, again=True, unit="mm")
    assert longest(url) == (pytest.approx(0.5), count)


def test_a_file_read_twice_without_again_is_refused_with_the_way_out(tmp_path, url):
    path = outlines(tmp_path / "a.json", 1e-3)
    read(path, url, unit="mm")
    with pytest.raises(DatabaseError, match=r"in the database already.*other options, give --again"):
        read(path, url, unit="cm")


def test_the_same_stones_under_other_codes_are_not_taken_in_twice(tmp_path, url):
    path = boxes(tmp_path / "a.stl", (0.5, 0.3, 0.3))
    again = tmp_path / "b.stl"  # solids without names are numbered by the file
    again.write_bytes(path.read_bytes())
    read(path, url)
    with pytest.raises(
        DatabaseError, match="8 stones have codes that the survey 'a' of the same file did not give"
    ):
        read(again, url, again=True)
    assert longest(url)[1] == 8


@needs_shared
@pytest.mark.parametrize(
    ("file", "answer"), [("b_mm.stl", {"unit": "mm"}), ("y_up.obj", {"up": "y"}), ("y_up.obj", {"up": "z"})]
)
def test_advice_of_the_cases_can_be_followed(tmp_path, url, file, answer):
    path = CASES / "wild/unit-advice-cannot-be-followed" / file
    with pytest.raises(SurveyError, match="; give --"):
        read(path, url)
    (done,) = read(path, url, **answer).files
    assert done.questions == ()
    assert longest(url)[0] < 3.0


@pytest.mark.parametrize(
    ("spoilt", "words"),
    [
        ({"A": "1,2o"}, "write e.g. 12.345$"),
        ({"A": "1,2o", "B": "0,3o"}, "; 1 more of 3 stones are wrong; --keep-going takes the rest$"),
        (
            {"A": "1,2o", "C": ""},
            "; 1 more of 3 stones are wrong, as .*: x is empty; --keep-going takes the rest$",
        ),
    ],
)
def test_a_stone_that_is_wrong_is_told_with_the_others(tmp_path, spoilt, words):
    corners = [("0", "0"), ("0,5", "0"), ("0,5", "0,3"), ("0", "0,3")]
    rows = [f"{code};{x};0;{z};0,4" for code in "ABC" for x, z in corners[:3]]
    rows += [f"{code};{spoilt.get(code, '0')};0;0,3;0,4" for code in "ABC"]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["Stein;x;y;z;Tiefe", *rows]))
    with pytest.raises(SurveyError, match=words):
        ingest([path], f"sqlite:///{tmp_path}/a.db", "csv")
