"""Files of rejected stones: their lines of the survey file, each with the reason, ready for correction.

A file of rejects has the format and the header of the survey: once corrected, it can be ingested by itself.
"""

import codecs
import hashlib
import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

from moma.errors import UsageError
from survey.formats.reading import SOLIDS
from survey.records.survey import Reject

__all__ = ["MARK", "check_targets", "default_path", "rejects_text"]

MARK = b"# rejected by moma"
"""First or second line of the files, by which they are recognised."""

_STONE = re.compile(rb"\s*stone\b")


def default_path(survey: Path) -> Path:
    """Return the default file for the rejects of a survey file: beside it, ``NAME.rejects.SUFFIX``."""
    plain = survey.resolve() if survey.is_dir() else survey
    suffix = ".txt" if survey.is_dir() or survey.suffix.lower() in SOLIDS else survey.suffix
    return plain.with_name(f"{plain.stem}.rejects{suffix}")


def check_targets(targets: Sequence[Path], surveys: Sequence[Path]) -> None:
    """Check that files of rejects replace neither a survey nor any other file of the user.

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
        _check_replaceable(target)


def rejects_text(survey: Path, format: str, rejects: Sequence[Reject], kept: Iterable[int] = ()) -> bytes:
    """Write the rejected stones of a survey file in its own format.

    Parameters
    ----------
    survey : the file
    format : name of its format
    rejects : stones that could not be ingested
    kept : lines of the survey that its stones depend on, such as stations in a list of points
    """
    head = [] if format == "solids" else _head_lines(survey, format)
    ordered = sorted(rejects, key=lambda one: one.spans[0].start if one.spans else 0)
    wanted = {line for one in ordered for span in one.spans for line in span} if format != "solids" else set()
    lines = dict(_picked(survey, wanted.union(kept))) if wanted else {}
    text = head + [lines[line] for line in sorted(kept) if line in lines]
    for one in ordered:
        reason = " ".join(str(one.error).split())
        text += [b"\n", b"# " + reason.encode("ascii", "backslashreplace") + b"\n"]
        text += [lines[line] for span in one.spans for line in span if line in lines]
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


def _head_lines(survey: Path, format: str) -> list[bytes]:
    """Return the lines that hold for all stones of a file."""
    head = []
    with survey.open("rb") as file:
        for line in _ended(file):
            if format == "moma" and _STONE.match(line):
                break
            head.append(line)
            if format == "csv" and line.strip() and not line.lstrip().startswith(b"#"):
                break
            if format not in ("moma", "csv"):
                return []
    return head


def _picked(survey: Path, wanted: set[int]) -> Iterator[tuple[int, bytes]]:
    with survey.open("rb") as file:
        for number, line in enumerate(_ended(file), start=1):
            if number in wanted:
                yield number, line


def _ended(file: BinaryIO) -> Iterator[bytes]:
    """Yield lines that end in a line feed, without a byte order mark, since other lines will precede them."""
    for number, line in enumerate(file):
        plain = line.removeprefix(codecs.BOM_UTF8) if number == 0 else line
        yield plain if plain.endswith(b"\n") else plain + b"\n"
