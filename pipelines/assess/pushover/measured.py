"""Measured curves: CSV with a displacement [mm] and a force [kN] in the first two columns."""

from pathlib import Path

import numpy as np

from ground.errors import UsageError
from mechanics.arrays import Array

_MISSING = ("", "nan", "na")
_FORM = "give lines with a displacement in mm and a force in kN, separated by a comma"


def read_curve(path: Path) -> Array:
    """Return a measured curve (n, 2): displacement and force [m], [N].

    Lines before the first with two numbers are headings; columns after the second are left out, and so are lines where
    one of the two is missing, as instruments write them.

    Raises
    ------
    UsageError : the file cannot be read, or a line after the headings has no two numbers
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"the measured curve cannot be read: {error}", where=str(path)) from error
    rows: list[tuple[float, float]] = []
    for number, line in enumerate(lines, start=1):
        cells = [cell.strip() for cell in line.split(",")[:2]]
        if len(cells) < 2 or any(cell.lower() in _MISSING for cell in cells):
            continue
        try:
            displacement, force = map(float, cells)
        except ValueError as error:
            if rows:
                raise UsageError("no two numbers", where=f"{path}:{number}", remedy=_FORM) from error
            continue
        rows.append((displacement, force))
    if not rows:
        raise UsageError("no measured points", where=str(path), remedy=_FORM)
    return np.array(rows) * [1e-3, 1e3]
