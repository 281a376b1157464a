"""Tables of results in the documentation, from the catalogue: `python -m tests.docs.quantities` renews them."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain

import numpy as np

from archmodel.quantities import quantities_of
from archmodel.query.api import attributes
from archmodel.query.structures import STRUCTURE_ATTRIBUTES
from mechanics.results.result import Result
from pipelines.results.run_csv import JOINT_COLUMNS, SERIES_COLUMNS
from pipelines.results.vtk import body_cells, body_grid, contact_grid, joint_grid
from pipelines.results.vtu import UnstructuredGrid
from tests.paths import ROOT
from tests.pipelines.results_by_hand import deformable_body, result_of, rigid_body

Rows = list[Sequence[str]]

SURVEY_TABLES = (
    *("measure_again", "beds", "faces", "odd", "depths", "since", "control", "evidence"),
    *("courses", "kinds", "contradictions", "stones"),
)
"""Tables of survey.json that its page shows."""

PAGES = ("formats.md", "query.md", "runs.md")
"""Pages of docs/ that have such tables."""


def _result() -> Result:
    """Return a result with every array of the files."""
    soft = deformable_body("D1", (0, 0, 1), (1, 1, 3), lambda points: np.ones(len(points)), 1.0)
    return result_of([rigid_body("base", (0, 0, 0), (1, 1, 1)), soft])


def _arrays(grid: UnstructuredGrid, *bearers: str) -> Rows:
    """Return name, place, unit and meaning of the arrays of a grid."""
    known = quantities_of(*bearers)
    places = chain(
        ((name, "points") for name in grid.point_data), ((name, "cells") for name in grid.cell_data)
    )
    return [(f"`{name}`", on, grid.units.get(name, ""), known[name].meaning) for name, on in places]


def _columns(meanings: Mapping[str, str]) -> Rows:
    return [(f"`{name}`", meaning) for name, meaning in meanings.items()]


def _headed(*bearers: str, named: bool = False) -> Rows:
    """Return name, heading, unit and meaning of the quantities of reports; `named`: of which table, first."""
    return [
        (
            *([f"`{bearer}`"] if named else []),
            f"`{one.name}`",
            one.heading,
            "" if one.unit in (None, "-") else str(one.unit),
            one.meaning,
        )
        for bearer in bearers
        for one in quantities_of(bearer).values()
    ]


def _tables() -> Mapping[str, Sequence[Rows]]:
    """Return the rows of the tables under each heading."""
    result = _result()
    frame = result.frames[-1]
    return {
        "## `summary.json`": [
            [
                (f"`{one.name}`", "" if one.unit in (None, "-") else str(one.unit), one.meaning)
                for one in quantities_of("summary").values()
            ]
        ],
        "## Stones (": [
            _arrays(body_grid(result, frame, body_cells(result)), "cell of a stone", "point of a stone")
        ],
        "## Contact points (": [_arrays(contact_grid(frame.contacts), "contact")],
        "## Joints (": [
            _arrays(joint_grid(result.joints), "joint", "joint in joints.vtu"),
            _columns(JOINT_COLUMNS),
        ],
        "## Time series (": [_columns(one) for one in SERIES_COLUMNS.values()],
        "## Columns of a cell": [
            _columns({one.name: one.described for one in quantities_of("cell of disks").values()})
        ],
        "## Numbers of a load": [_headed("load in assessment.json")],
        "## Tables of the page": [_headed(*SURVEY_TABLES, named=True)],
        "### Results of runs": [
            [(f"`{one.name}`", one.type_name, one.definition) for one in attributes() if one.of_run]
        ],
        "### About structures": [
            _columns({one.name: one.definition for one in STRUCTURE_ATTRIBUTES.values()})
        ],
        "## Peaks and time series": [
            [(f"`{one.name}`", str(one.unit), one.meaning) for one in quantities_of("peak").values()]
        ],
    }


def with_tables(page: str) -> str:
    """Return a page with its tables of results renewed, whose heads and rules stay."""
    return "\n".join(_renewed(page.splitlines())) + "\n"


def _renewed(lines: Iterable[str]) -> Iterator[str]:
    tables, waiting, old = _tables(), list[Rows](), False
    for line in lines:
        if line.startswith("#"):
            waiting = next((list(rows) for head, rows in tables.items() if line.startswith(head)), [])
        if old and line.startswith("|"):
            continue
        old = False
        yield line
        if waiting and line.startswith("|---"):
            yield from (f"| {' | '.join(row)} |" for row in waiting.pop(0))
            old = True


if __name__ == "__main__":
    for name in PAGES:
        path = ROOT / "docs" / name
        path.write_text(with_tables(path.read_text(encoding="utf-8")), encoding="utf-8")
