"""Roles under any name, dates where names stand, unknown depths and merged cells."""

from datetime import date

import pytest

from ground.errors import SurveyError
from survey.formats.options import ReadingOptions
from survey.formats.tables.reader import open_csv
from survey.records.survey import Reject
from tests.survey.formats.workbooks import xlsx

CORNERS = [(0.0, 2.0, 0.0), (0.5, 2.0, 0.0), (0.5, 2.0, 0.4), (0.0, 2.0, 0.4)]
ON_FACE = (0.25, 2.0, 0.2)


def read(path):
    stream = open_csv(path, ReadingOptions())
    return list(stream.blocks), stream.remarks


def table(head, rows):
    return "\n".join([head, *(";".join(map(str, row)) for row in rows)]) + "\n"


@pytest.mark.parametrize("name", ["Point", "Bemerkung", "Genre de point"])
def test_a_column_of_roles_is_the_role_whatever_its_name(tmp_path, name):
    rows = [("1-1", "sommet", *one) for one in CORNERS] + [("1-1", "face", *ON_FACE)]
    path = tmp_path / "wall.csv"
    path.write_text(table(f"Stein;{name};X;Y;Z", rows), encoding="utf-8")
    (stone,), _ = read(path)
    assert len(stone.vertices) == 4
    assert len(stone.points) == 1


def test_letters_that_number_points_are_no_roles(tmp_path):
    rows = [("1-1", letter, *one) for letter, one in zip("bces", CORNERS, strict=True)]
    path = tmp_path / "wall.csv"
    path.write_text(table("Stein;Punkt;X;Y;Z", rows), encoding="utf-8")
    (stone,), _ = read(path)
    assert len(stone.vertices) == 4


@pytest.mark.parametrize("unknown", ["-", "–", "n/a"])
def test_a_depth_that_is_not_known_is_empty(tmp_path, unknown):
    path = tmp_path / "wall.csv"
    path.write_text(table("Stein;X;Y;Z;Tiefe", [("1-1", *one, unknown) for one in CORNERS]), encoding="utf-8")
    (stone,), _ = read(path)
    assert stone.depth is None


@pytest.mark.parametrize("name", ["1-Jan", "01. Jan", "Feb 02"])
def test_a_name_that_became_a_date_is_questioned(tmp_path, name):
    path = tmp_path / "wall.csv"
    path.write_text(table("Stein;X;Y;Z", [(name, *one) for one in CORNERS]), encoding="utf-8")
    found, _ = read(path)
    assert all(isinstance(one, Reject) for one in found)
    assert "the name of a stone is a date" in str(found[0].error)


def test_a_date_in_a_workbook_is_questioned(tmp_path):
    path = tmp_path / "wall.xlsx"
    path.write_bytes(xlsx({"a": [["Stein", "X", "Y", "Z"], *[[date(2026, 1, 1), *one] for one in CORNERS]]}))
    found, _ = read(path)
    assert "wall.xlsx:2: the name of a stone is a date, 2026-01-01; format the column as text" in str(
        found[0].error
    )


def test_merged_cells_hold_for_all_of_their_rows(tmp_path):
    rows = [["Stein", "X", "Y", "Z"], *[[None if k else "1-1", *one] for k, one in enumerate(CORNERS)]]
    (tmp_path / "wall.xlsx").write_bytes(xlsx({"a": rows}, merged=["A2:A5"]))
    (stone,), remarks = read(tmp_path / "wall.xlsx")
    assert (stone.code, len(stone.vertices)) == ("1-1", 4)
    assert "1 merged cells hold for all of their rows" in remarks


def test_a_coordinate_without_a_value_names_the_formula(tmp_path):
    path = tmp_path / "wall.csv"
    path.write_text(table("Stein;X;Y;Z", [("1-1", "", y, z) for _, y, z in CORNERS]), encoding="utf-8")
    found, _ = read(path)
    assert "x is empty; fill it in; the formulas of a workbook" in str(found[0].error)


def test_names_of_columns_are_shown_as_tabs_separate_them(tmp_path):
    path = tmp_path / "wall.csv"
    path.write_text("Point ID\tRod Height\tLocal N\n1\t1.5\t2.0\n", encoding="utf-8")
    with pytest.raises(SurveyError, match="among Point ID, Rod Height, Local N"):
        read(path)
