"""Cell W2 of folds by the number of their disks: `python -m benchmarks.geology_scales [--write]`.

Reads the runs of folds that `python -m benchmarks.geology` made with a tenth of the disks and with all of them. What is
missing is left out. `--write` puts the tables into docs/geology.md.
"""

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.geology import read_run
from benchmarks.report import (
    ROOT,
    Row,
    columns,
    commit,
    guarded,
    machine,
    options_of,
    print_json,
    print_table,
    spread,
    table_lines,
    write_between,
)
from mechanics.arrays import Array
from mechanics.planar.measures.cells import Cell, members, shape_of
from pipelines.geology.experiments.fold import Fold
from pipelines.geology.file import read_geology
from pipelines.geology.observe import Instants
from pipelines.geology.sample import prepare

_PAGE = ROOT / "docs" / "geology.md"
_NAME = "W2"
_DRAGGED = 10.0  # height above the floor within which the lowest disks stay behind, in diameters [-]
_LOW, _HIGH = 1.6, 14.5  # heights of W2 with a tenth of the disks, in diameters [-]
_WIDTH = 0.03  # of the band about W2 whose shear is told, over the length of the sample [-]
_HEIGHTS = (1.5, 3.0, 5.0, 10.0, 15.0)  # between which the shear is told, in diameters [-]
_CELLS = columns(
    "disks disks | seeds seeds :d | begins W2 begins, diameters above the floor | "
    "dragged of its disks below 10 diameters, % | lambda_x λx of W2 | "
    "alike λx of a cell there, 1.6 to 14.5 diameters above the floor | "
    "deviation standard deviation of its x, over that at the start"
)
_SHEAR = columns(
    "disks disks | "
    + " | ".join(f"height{k} {low:g} to {high:g}" for k, (low, high) in enumerate(pairwise(_HEIGHTS)))
)


def main() -> None:
    """Print how W2 and the shear near the floor go by the size of the disks."""
    parser = options_of("geology_scales", __doc__)
    for name, folder in (("tenth", "geology-seeds"), ("full", "geology-full")):
        parser.add_argument(f"--{name}", type=Path, default=Path("out") / folder, metavar="DIR")
    parser.add_argument("--write", action="store_true", help="put the tables into docs/geology.md")
    options = parser.parse_args()
    groups = [_measured(folder) for folder in (options.tenth, options.full)]
    rows = [_row(group) for group in groups if group]
    if options.json:
        print_json(rows)
        return
    for name, table in (("scales", _CELLS), ("scales-shear", _SHEAR)):
        print_table(rows, table)
        print()
        if options.write and rows:
            about = [f"Measured at {commit()} on {machine()}.", ""]
            write_between(name, about + table_lines(rows, table), _PAGE)


def _measured(folder: Path) -> list[dict[str, Any]]:
    """Return the measures of each fold with 100 sweeps of a folder at its end."""
    found = []
    for path in sorted(folder.glob("fold-*-*-100/summary.json")):
        stored = read_run(path.parent)
        scene = read_geology(path.parent / "scene.toml", "fold")
        sample = prepare(scene, folder / ".samples")
        instants = Instants(tuple(sorted((path.parent / "arrays").glob("fields-*.npz"))))
        start, now = sample.centre, instants[-1].position[: len(sample.radius), :2]
        assert isinstance(scene.experiment, Fold)
        diameter = 2.0 * float(sample.radius.mean())
        place = next(cell for cell in scene.cells if cell.name == _NAME)
        alike = Cell(
            "alike",
            (place.centre[0], 0.5 * (_LOW + _HIGH) * diameter),
            0.5 * (_HIGH - _LOW) * diameter,
        )
        there = members(alike, start)
        shape = shape_of(start[there], now[there])
        within = np.abs(start[:, 0] - place.centre[0]) <= 0.5 * _WIDTH * scene.experiment.length
        found.append(
            {
                "disks": len(sample.radius),
                "begins": (place.centre[1] - place.radius) / diameter,
                "dragged": 100.0 * float((start[members(place, start), 1] < _DRAGGED * diameter).mean()),
                "lambda_x": float(stored["cells"][_NAME]["lambda_x"][-1]),
                "alike": float(shape.extent[0]),
                "deviation": float(shape.spread[0]),
                "shear": shear_by_height(start[within], now[within], diameter),
            }
        )
    return found


def shear_by_height(start: Array, now: Array, diameter: float) -> list[float]:
    """Return ∂x/∂y of the motion of disks, by their height at the start over their mean diameter [-].

    Parameters
    ----------
    start, now : (n, 2) places [m]
    diameter : [m]
    """
    height = start[:, 1] / diameter
    shear = []
    for low, high in pairwise(_HEIGHTS):
        disks = (height > low) & (height <= high)
        shear.append(float(shape_of(start[disks], now[disks]).gradient[0, 1]))
    return shear


def _row(group: Sequence[dict[str, Any]]) -> Row:
    row: Row = {"seeds": len(group)}
    for name, digits in (
        ("disks", 0),
        ("begins", 1),
        ("dragged", 0),
        ("lambda_x", 2),
        ("alike", 2),
        ("deviation", 2),
    ):
        row[name] = spread((one[name] for one in group), digits)
    for number in range(len(_HEIGHTS) - 1):
        row[f"height{number}"] = spread((one["shear"][number] for one in group), 1)
    return row


if __name__ == "__main__":
    guarded(main)
