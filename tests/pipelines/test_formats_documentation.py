"""docs/formats.md is true of the files that a run writes."""

import re
from pathlib import Path

import numpy as np
import pytest

from pipelines.joint_table import JOINT_COLUMNS
from pipelines.summary import summarise
from pipelines.vtk_output import body_cells, body_grid, contact_grid, joint_grid
from tests.pipelines.handmade import deformable_body, result_of, rigid_body

PAGE = (Path(__file__).parents[2] / "docs" / "formats.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def result():
    return result_of(
        [
            rigid_body("base", (0, 0, 0), (1, 1, 1)),
            deformable_body("D1", (0, 0, 1), (1, 1, 3), lambda points: np.ones(len(points)), 1.0),
        ]
    )


def rows(heading, columns):
    """Cells of the table under a heading."""
    section = PAGE.split(f"\n## {heading}")[1].split("\n## ")[0]
    found = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in section.splitlines()]
    return [row for row in found if len(row) == columns and row[0].startswith("`")]


def test_every_array_is_documented_with_its_place_and_unit(result):
    frame = result.frames[-1]
    for heading, grid in (
        ("Stones", body_grid(result, frame, body_cells(result))),
        ("Contact points", contact_grid(frame.contacts)),
        ("Joints", joint_grid(result.joints)),
    ):
        written = [
            (f"`{name}`", on, grid.units.get(name, ""))
            for on, data in (("points", grid.point_data), ("cells", grid.cell_data))
            for name in data
        ]
        assert [tuple(row[:3]) for row in rows(heading, 4)] == written


def test_every_column_of_the_joints_is_documented():
    assert rows("Joints", 2) == [[f"`{name}`", meaning] for name, meaning in JOINT_COLUMNS.items()]


def test_every_key_of_the_summary_is_documented(result):
    section = PAGE.split("\n## `summary.json`")[1].split("\n## ")[0]
    named = set(re.findall(r"`(\w+)`", section))
    summary = summarise(result, version="1", seconds={})
    assert set(summary) <= named
    assert set(summary["joints"]) <= named
    assert set(summary["stress"]) <= named
