"""Lists whose easting and northing are exchanged: evidence, questions, and what is clear."""

from pathlib import Path

import numpy as np
import pytest

from ground.errors import SurveyError
from survey.formats.options import ReadingOptions
from survey.formats.tables.axes import Outlines, exchanged, exchanged_station
from survey.formats.tables.reader import open_csv, open_penzd, open_pnezd
from survey.orientation.formats.control import read_control
from survey.records.survey import Station, SurveyHead

FORMATS = {"pnezd": open_pnezd, "penzd": open_penzd}


def wall(
    order: str,
    *,
    station: bool = True,
    origin: tuple[float, float] = (0.0, 0.0),
    towards: int = 1,
    stones: int = 8,
) -> list[str]:
    """Return rows of a wall along the easting, seen from the south; `towards` -1: corners clockwise."""
    rows, corners = [], [(0.0, 0.0), (0.5, 0.0), (0.5, 0.3), (0.0, 0.3)][::towards]
    for k in range(stones):
        for right, up in corners:
            east, north = origin[0] + 0.6 * k + right, origin[1] + 0.02 * up
            rows.append((east, north, 1.0 + up, f"W01-{k + 1:02d}:v"))
    if station:
        rows.append((origin[0] + 2.0, origin[1] - 6.0, 1.5, "S1:s"))
    return [
        f"{n},{a:.4f},{b:.4f},{z:.4f},{code}"
        for n, (east, north, z, code) in enumerate(rows, start=1)
        for a, b in [(north, east) if order == "pnezd" else (east, north)]
    ]


def written(folder: Path, rows: list[str], name: str = "wall.txt") -> Path:
    path = folder / name
    path.write_text("\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("order", FORMATS)
def test_a_list_read_in_the_other_order_is_a_question(tmp_path: Path, order: str) -> None:
    path = written(tmp_path, wall(order))
    (other,) = set(FORMATS) - {order}
    assert FORMATS[order](path).remarks == ()
    with pytest.raises(SurveyError, match="as in a mirror") as caught:
        FORMATS[other](path)
    assert f"--format {order}" in str(caught.value)
    # the second answer holds too: columns by number are taken at their word, and give the same stones as the format
    columns, codes = (
        str(caught.value).split(f'{option} "')[1].split('"')[0] for option in ("--columns", "--codes")
    )
    stones = list(open_csv(path, ReadingOptions(columns=columns, codes=codes)).blocks)
    turned = list(FORMATS[order](path).blocks)
    for stone, straight in zip(stones, turned, strict=True):
        np.testing.assert_array_equal(stone.vertices[:, [1, 0, 2]], straight.vertices)


@pytest.mark.parametrize(
    ("origin", "grid"),
    [
        ((412_334.0, 5_403_112.0), "UTM"),
        ((3_512_345.0, 5_812_345.0), "Gauss-Krüger"),
        ((2_612_345.0, 1_212_345.0), "LV95"),
        ((652_345.0, 6_862_345.0), "UTM or Lambert-93"),
    ],
)
def test_coordinates_of_a_national_grid_tell_the_order(tmp_path: Path, origin, grid: str) -> None:
    path = written(tmp_path, wall("penzd", station=False, origin=origin))
    assert open_penzd(path).remarks == ()
    with pytest.raises(SurveyError, match=f"those of {grid} only"):
        open_pnezd(path)


@pytest.mark.parametrize("title", ["# PENZD", "P E N Z D;PENZD", None])
def test_names_of_the_file_and_titles_tell_the_order(tmp_path: Path, title: str | None) -> None:
    rows = wall("penzd", station=False)
    path = written(tmp_path, ([title] if title else []) + rows, "wall.txt" if title else "Nordwand_ENZ.txt")
    assert open_penzd(path).remarks == ()
    with pytest.raises(SurveyError, match="says PENZD"):
        open_pnezd(path)


def test_stations_of_the_header_file_tell_the_order(tmp_path: Path) -> None:
    rows = wall("penzd", station=False, origin=(5000.0, 1000.0), stones=3)
    head = SurveyHead("wall", "", (Station("observer", np.array([5001.0, 994.0, 1.5])),))
    path = written(tmp_path, rows)
    assert open_penzd(path, ReadingOptions(head=head)).remarks == ()
    with pytest.raises(SurveyError, match="over 1000 m away unless"):
        open_pnezd(path, ReadingOptions(head=head))


@pytest.mark.parametrize(
    "rows", [wall("penzd", station=False), wall("penzd", towards=-1), wall("penzd", stones=3)]
)
@pytest.mark.parametrize("order", FORMATS)
def test_what_nothing_tells_is_read_as_stated_and_said(tmp_path: Path, rows: list[str], order: str) -> None:
    (remark,) = FORMATS[order](written(tmp_path, rows)).remarks
    assert "the mirror image" in remark


def test_names_of_columns_are_clear(tmp_path: Path) -> None:
    rows = [row.replace(":", ",") for row in wall("penzd", origin=(412_334.0, 5_403_112.0), station=False)]
    for titles in ("name,easting,northing,z,block,role", "name,x,y,z,block,role"):
        assert open_csv(written(tmp_path, [titles, *rows])).remarks == ()
    # X is the northing of geodesists
    path = written(tmp_path, ["name,Y,X,z,block,role", *rows])
    with pytest.raises(SurveyError, match="those of UTM only") as caught:
        open_csv(path)
    right, mirrored = str(caught.value).split('--columns "')[1:]
    (first, *_) = open_csv(path, ReadingOptions(columns=right.split('"')[0])).blocks
    (second, *_) = open_csv(path, ReadingOptions(columns=mirrored.split('"')[0])).blocks
    assert (
        first.vertices[0].tolist() == second.vertices[0, [1, 0, 2]].tolist() == [412_334.0, 5_403_112.0, 1.0]
    )


def test_control_points_of_a_national_grid_whose_northing_comes_first(tmp_path: Path) -> None:
    places = [(412_334.0 + k, 5_403_112.0 + k * k, 100.0 + k) for k in range(4)]
    for titles in ([], ["number,X,Y,Z"]):
        good = [f"{k},{e},{n},{z}" for k, (e, n, z) in enumerate(places)]
        turned = [f"{k},{n},{e},{z}" for k, (e, n, z) in enumerate(places)]
        assert read_control(written(tmp_path, titles + good)) != ()
        with pytest.raises(SurveyError, match="X is the northing"):
            read_control(written(tmp_path, titles + turned))
    named = read_control(written(tmp_path, ["number, northing, easting, height", *turned]))
    assert named[0].place.tolist() == list(places[0])


@pytest.mark.parametrize(("off", "same"), [(0.05, True), (0.2, False)])
def test_a_station_that_lies_apart_is_another(off: float, same: bool) -> None:
    there = np.array([400.0, 100.0, 1.5])
    assert exchanged_station(np.array([100.0, 400.0 + off, 1.5]), there) is same


@pytest.mark.parametrize(("away", "beside"), [(500.0, True), (2000.0, False)])
def test_stones_beyond_reach_tell_nothing(away: float, beside: bool) -> None:
    there = np.array([[400_000.0, 100_000.0, 2.0]])
    assert exchanged(np.array([[100_000.0, 400_000.0 + away, 2.0]]), there) is beside


@pytest.mark.parametrize(("pairs", "wrong", "habit"), [(3, 0, 0), (6, 0, 1), (20, 1, 1), (20, 4, 0)])
def test_a_habit_needs_six_pairs_and_nine_stones_of_ten(pairs: int, wrong: int, habit: int) -> None:
    seen = [-1.0] * wrong + [1.0] * (pairs - wrong)
    assert Outlines(list(seen), list(seen)).habit() == habit


@pytest.mark.parametrize(("rise", "counts"), [(4.0, 1), (1.0, 1), (0.3, 0)])
def test_a_face_that_lies_has_no_left_and_right(rise: float, counts: int) -> None:
    """Faces that rise by so much in a metre: the horizontal share of their area is .97, .71 and .29."""
    corners = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, rise], [0.0, 1.0, rise]])
    outlines = Outlines()
    outlines.add("W1-1", corners, np.array([0.5, -5.0, 1.0]))
    assert len(outlines.turns) == counts
