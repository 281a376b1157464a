"""Files of rejected stones: their lines of the survey file, each with the reason, ready for correction.

A file of rejects has the format and the header of the survey: once corrected, it can be ingested by itself.
"""

import codecs
import csv
import hashlib
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from ground.errors import UsageError
from ground.tables.rows import is_workbook, open_rows
from ground.tables.text_lines import TextLines
from survey.formats.reading import ENDINGS, SOLIDS
from survey.records.survey import Reject

MARK = b"# rejected by moma"
"""First or second line of the files, by which they are recognised."""

_BY_LINES = ("moma", "csv", "pnezd", "penzd", "gsi")
"""Formats of which each line is of one stone; of others, reasons alone are written."""

_PLAIN = (*SOLIDS, *ENDINGS["landxml"], *ENDINGS["jobxml"], *ENDINGS["geojson"])
_BOOKS = (".xlsx", ".xls", ".xlsb", ".ods")
_STONE = re.compile(rb"\s*stone\b")


def default_path(survey: Path) -> Path:
    """Return the default file for the rejects of a survey file: beside it, ``NAME.rejects.SUFFIX``."""
    plain = survey.resolve() if survey.is_dir() else survey
    ending = survey.suffix.lower()
    suffix = ".csv" if ending in _BOOKS else ".txt" if survey.is_dir() or ending in _PLAIN else survey.suffix
    return plain.with_name(f"{plain.stem}.rejects{suffix}")


def check_targets(targets: Sequence[Path], surveys: Sequence[Path]) -> None:
    """Check that files of rejects are text, and replace neither a survey nor any other file of the user.

    Parameters
    ----------
    targets : file of rejects of each survey
    surveys : the survey files

    Raises
    ------
    UsageError
        naming the file that would be lost
    """
    read = {survey.resolve() for survey in surveys}
    for target in targets:
        if target.resolve() in read:
            remedy = "name another file with --rejects"
            raise UsageError("is the survey file itself", where=str(target), remedy=remedy)
        if target.suffix.lower() in _BOOKS:
            remedy = "name a text file, such as rejects.csv, with --rejects"
            raise UsageError("rejects are not written as a workbook", where=str(target), remedy=remedy)
        _check_replaceable(target)


def rejects_text(
    survey: Path,
    format: str,
    rejects: Sequence[Reject],
    also: Iterable[int] = (),
    *,
    header: int = 0,
    sheet: str | None = None,
) -> bytes:
    """Write the rejected stones of a survey file in its own format; those of a workbook as text.

    Parameters
    ----------
    survey : the file
    format : name of its format
    rejects : stones that could not be ingested
    also : lines of the survey that its stones depend on, such as stations in a list of points
    header : number of lines at the beginning of a table that hold for all stones
    sheet : of a workbook
    """
    by_lines = format in _BY_LINES
    head = _head_lines(survey) if format == "moma" else []
    if by_lines and header:
        head = [line for _, line in _picked(survey, set(range(1, header + 1)), sheet)]
    ordered = sorted(rejects, key=lambda one: one.spans[0].start if one.spans else 0)
    wanted = {line for reject in ordered for span in reject.spans for line in span} if by_lines else set()
    lines = dict(_picked(survey, wanted.union(also), sheet)) if wanted else {}
    text = head + [lines[line] for line in sorted(also) if line in lines]
    for reject in ordered:
        reason = " ".join(str(reject.error).split())
        text += [b"\n", b"# " + reason.encode("ascii", "backslashreplace") + b"\n"]
        text += [lines[line] for span in reject.spans for line in span if line in lines]
    count = f": {len(rejects)} of {survey.name}, as written {_digest(text)}\n"
    text.insert(1 if format == "moma" else 0, MARK + count.encode("ascii", "backslashreplace"))
    return b"".join(text)


def _digest(lines: Sequence[bytes]) -> str:
    """Compute the digest that shows whether a file of rejects was changed after it was written."""
    return hashlib.sha256(b"".join(lines)).hexdigest()[:16]


def _check_replaceable(path: Path) -> None:
    """Refuse a file that MOMA has not written, or that was changed since."""
    if path.is_dir():
        raise UsageError("is a folder", where=str(path), remedy="name a file with --rejects")
    if not path.exists():
        return
    lines = path.read_bytes().splitlines(keepends=True)
    mark = next((line for line in lines[:2] if line.startswith(MARK)), None)
    if mark is None:
        what = "exists and is not a file of rejects"
    elif mark.split()[-1].decode("ascii", "replace") != _digest([line for line in lines if line is not mark]):
        what = "exists and was changed since it was written"
    else:
        return
    raise UsageError(what, where=str(path), remedy="move it away, or name another file with --rejects")


def _head_lines(survey: Path) -> list[bytes]:
    """Return the lines of a native file before its first stone."""
    head = []
    for _, line in _lines(survey):
        if _STONE.match(line):
            break
        head.append(line)
    return head


def _picked(survey: Path, wanted: set[int], sheet: str | None) -> Iterator[tuple[int, bytes]]:
    return (line for line in _lines(survey, sheet) if line[0] in wanted)


def _lines(survey: Path, sheet: str | None = None) -> Iterator[tuple[int, bytes]]:
    """Yield lines that end in a line feed, without a byte order mark, since other lines will precede them."""
    if is_workbook(survey):
        for number, row in open_rows(survey, sheet):
            text = io.StringIO()
            csv.writer(text, delimiter=";", lineterminator="\n").writerow(row)
            yield number, text.getvalue().encode("utf-8")
        return
    text_lines = TextLines(survey)
    if text_lines.is_converted:
        for number, line in text_lines:
            yield number, f"{line}\n".encode()
        return
    with survey.open("rb") as file:
        for number, raw in enumerate(file, start=1):
            plain = raw.removeprefix(codecs.BOM_UTF8) if number == 1 else raw
            yield number, plain if plain.endswith(b"\n") else plain + b"\n"
