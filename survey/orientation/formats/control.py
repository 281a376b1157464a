"""Files of control points as the Damped Bundle Adjustment Toolbox reads them, and their place in a network.

One point per line, its values separated by commas, semicolons or tabs: number, name, X, Y, Z and, if the place is not
fixed, its standard deviations (one, or three) or its covariance (nine, row by row). The name may be left out. Lines
that begin with # are comments.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from moma.errors import SurveyError
from survey.arrays import Array
from survey.formats.fields import parse_number, shown
from survey.formats.text_lines import TextLines
from survey.orientation.network import Control, Network, listed

__all__ = ["ControlRow", "read_control", "with_control", "write_control"]

_BETWEEN = re.compile(r"[,;\t]")
_FAR = 10.0  # mean offset between two lists of the same points over its spread, from which it is a shift of the origin


@dataclass(frozen=True)
class ControlRow:
    """One line of such a file.

    Attributes
    ----------
    number : of the point, as in the marks
    name : label; empty if it has none
    place : (3,) [m]
    covariance : (3, 3) [m²]; zero: the place is fixed
    where : ``file:line``
    """

    number: str
    name: str
    place: Array
    covariance: Array
    where: str = ""


def read_control(path: Path) -> tuple[ControlRow, ...]:
    """Read a file of control points.

    Raises
    ------
    SurveyError
        naming file and line, if a line is wrong, or a number is there twice
    """
    lines = TextLines(path)
    rows: dict[str, ControlRow] = {}
    for number, line in lines.rows():
        where = f"{lines.path}:{number}"
        row = _row([one.strip() for one in _BETWEEN.split(line)], where)
        if row.number in rows:
            raise SurveyError(
                f"point {row.number} is there twice, first at {rows[row.number].where}",
                where=where,
                remedy="keep one",
            )
        rows[row.number] = row
    if not rows:
        raise SurveyError(
            "the file has no control points", where=lines.path, remedy="give one point per line"
        )
    return tuple(rows.values())


def _row(words: list[str], where: str) -> ControlRow:
    labelled = len(words) in (5, 6, 8, 14)
    if not (labelled or len(words) in (4, 7, 13)):
        raise SurveyError(
            f"a control point of {len(words)} values",
            where=where,
            remedy="write: number, name, X, Y, Z, and deviations: none, one, three, or nine covariances, with commas",
        )
    if not words[0]:
        raise SurveyError("a control point without a number", where=where, remedy="write its number first")
    first = 2 if labelled else 1
    values = [parse_number(word, "a coordinate", where) for word in words[first:]]
    place, rest = np.array(values[:3]), np.array(values[3:])
    if len(rest) <= 3:
        if (rest < 0.0).any():
            raise SurveyError(
                f"a standard deviation of {rest.min():g}", where=where, remedy="it must not be negative"
            )
        if rest.any() and not rest.all():
            raise SurveyError(
                "a standard deviation of 0 beside others",
                where=where,
                remedy="give all of them, or none for a fixed point",
            )
        covariance = np.diag(np.broadcast_to(rest, 3).astype(float) ** 2) if len(rest) else np.zeros((3, 3))
    else:
        covariance = rest.reshape(3, 3)
        if not np.allclose(covariance, covariance.T) or np.linalg.eigvalsh(covariance).min() <= 0.0:
            raise SurveyError(
                "its covariance is not symmetric and positive",
                where=where,
                remedy="give nine values row by row",
            )
    return ControlRow(words[0], words[1].strip('"') if labelled else "", place, covariance, where)


def with_control(
    network: Network, rows: Sequence[ControlRow], *, fixed: bool = False, check: Sequence[str] = ()
) -> Network:
    """Give a network its control points, in place of those that it has.

    A program may have moved the origin for its own file. Where the file's own control points differ from the given ones
    by the same vector, within a tenth of its length, the given ones are moved by it, with a remark.

    Parameters
    ----------
    fixed : the places are not adjusted, whatever their precision
    check : numbers or names of the points that check the adjustment only

    Raises
    ------
    SurveyError
        if none of the points is marked on a photograph, or a point to check is unknown
    """
    marked = set(network.point.tolist())
    index = {name: k for k, name in enumerate(network.names) if k in marked}
    known = [row for row in rows if row.number in index]
    if not known:
        raise SurveyError(
            f"none of the {len(rows)} control points is marked on a photograph: {listed([row.number for row in rows])}",
            where=rows[0].where.rpartition(":")[0] if rows else network.path,
            remedy=f"marked points: {listed(list(index))}",
        )
    names = {row.number for row in known} | {row.name for row in known if row.name}
    for wanted in check:
        if wanted not in names:
            raise SurveyError(
                f"no control point {shown(wanted)} to check",
                where=network.path,
                remedy=f"known: {listed(sorted(names))}",
            )
    own = {one.point: one.place for one in network.control}
    pairs = [(own[index[row.number]], row.place) for row in known if index[row.number] in own]
    shift, remarks = np.zeros(3), list(network.remarks)
    if len(pairs) >= 2:
        off = np.array([a - b for a, b in pairs])
        if np.linalg.norm(off.mean(axis=0)) > _FAR * np.ptp(off, axis=0).max():
            shift = off.mean(axis=0)
            place = ", ".join(f"{one:.3f}" for one in shift)
            remarks.append(f"{network.path} has another origin: control points are moved by ({place}) m")
    control = tuple(
        Control(
            index[row.number],
            row.place + shift,
            np.zeros((3, 3)) if fixed else row.covariance,
            row.number in check or (row.name != "" and row.name in check),
            row.where,
        )
        for row in known
    )
    left = [row.number for row in rows if row.number not in index]
    if left:
        remarks.append(f"control points that are marked nowhere: {listed(left)}")
    start = network.start.copy()
    for one in control:
        if not np.isfinite(start[one.point]).all():
            start[one.point] = one.place
    return replace(network, control=control, start=start, remarks=tuple(remarks))


def write_control(rows: Sequence[ControlRow], path: Path) -> None:
    """Write control points with all digits."""
    text = ["# number, name, X, Y, Z, covariance row by row where the place is not fixed"]
    for row in rows:
        values = [*row.place.tolist(), *(row.covariance.ravel().tolist() if row.covariance.any() else ())]
        text.append(", ".join([row.number, row.name or row.number, *map(repr, values)]))
    path.write_text("\n".join([*text, ""]), encoding="utf-8", newline="\n")
